//! What was found in a scan, drawn, also of a scan that is refused: from above, from the
//! side, and the cloth flattened. What is missing where is marked on the bearings.
//!
//! Of a scan in which no plate was found, three views along its own axes.

use image::{Rgb, RgbImage};

use super::pane::{Pane, Upright, View};
use crate::base::units::M_PER_MM;
use crate::base::{Isometry3, Point3, Vector3};
use crate::picture::draw::{polygon, text, text_width};
use crate::scan::error::PlateCandidate;
use crate::scan::{Found, FoundSquare, LengthUnit, Orientation, ScanError, ScannedBoundary};

/// Side of a pane, and height of the legend under the panes \[pixels\].
const PANE: u32 = 720;
const LEGEND: u32 = 200;
/// Distance between lines of text, and of text from the picture's left side \[pixels\].
const LINE: i32 = 20;
const INDENT: i32 = 16;

/// Where the bearings stand, as a share of half a pane: beyond the specimen's corners.
const RING: f64 = 0.93;
/// Length of the arrow along the warp \[m\].
const WARP_ARROW_M: f64 = 0.022;

const WHITE: Rgb<u8> = Rgb([255, 255, 255]);
const SCENE: Rgb<u8> = Rgb([170, 170, 170]);
const CLOTH: Rgb<u8> = Rgb([120, 130, 145]);
const PLATE: Rgb<u8> = Rgb([0, 70, 210]);
const MEASURED: Rgb<u8> = Rgb([0, 140, 60]);
const FLOOR: Rgb<u8> = Rgb([150, 90, 30]);
const RIM: Rgb<u8> = Rgb([210, 0, 0]);
const BRIDGED: Rgb<u8> = Rgb([255, 140, 0]);
const MISSING: Rgb<u8> = Rgb([230, 0, 160]);
const TEXT: Rgb<u8> = Rgb([40, 40, 40]);

/// Draws an answered scan.
#[must_use]
pub fn draw(scan: &ScannedBoundary) -> RgbImage {
    let warp = (scan.orientation == Orientation::Given).then(|| {
        let local_from_scan = scan.found.local_from_scan.unwrap_or_else(Isometry3::identity);
        local_from_scan * scan.sim_from_scan.inverse_transform_vector(&Vector3::x())
    });
    // The plate as the text says it: measured on the cloth, not as it first read.
    let mut found = scan.found.clone();
    if let Some(plate) = &mut found.plate {
        plate.radius_m = scan.quality.plate_radius_m;
    }
    let mut image = views(&found, None, warp);
    let percent = 100.0 * scan.quality.observed_fraction;
    let mut outcome = format!("rim found, {percent:.0} % of it observed");
    if warp.is_none() {
        outcome += "; which of its sides run along the warp is not known";
    }
    legend(&mut image, &found, (&outcome, MEASURED));
    image
}

/// Draws what was found in a scan that was refused, and where what is missing.
#[must_use]
pub fn draw_refused(found: &Found, why: &ScanError) -> RgbImage {
    let mut image = views(found, Some(why), None);
    legend(&mut image, found, (&format!("refused: {why}"), MISSING));
    image
}

/// The three views; `warp` is its direction in the local frame, if it is known.
fn views(found: &Found, why: Option<&ScanError>, warp: Option<Vector3>) -> RgbImage {
    let mut image = RgbImage::from_pixel(3 * PANE, PANE + LEGEND, WHITE);
    match found.local_from_scan {
        Some(local_from_scan) => {
            let scene: Vec<Point3> = found.scene.iter().map(|p| local_from_scan * p).collect();
            above(&mut image, found, &scene, why, warp);
            side(&mut image, found, &scene);
            flattened(&mut image, found, why, warp.is_some());
        }
        None => own_axes(&mut image, found),
    }
    image
}

/// Half the width of a view that shows the whole specimen \[m\].
fn half_view_m(found: &Found) -> f64 {
    0.8 * found.specimen_side_m
}

fn above(
    image: &mut RgbImage,
    found: &Found,
    scene: &[Point3],
    why: Option<&ScanError>,
    warp: Option<Vector3>,
) {
    let view = View { right: Vector3::x(), down: Vector3::z(), half: half_view_m(found) };
    let mut pane = Pane::new(image, [0, 0], PANE, view);
    scene.iter().for_each(|p| pane.dot(p, 1, SCENE));
    found.cloth.iter().for_each(|p| pane.dot(p, 1, CLOTH));
    circle(&mut pane, found.plate_radius_m, PLATE);
    if let Some(plate) = &found.plate {
        circle(&mut pane, plate.radius_m, MEASURED);
    }
    rim(&mut pane, found);
    pane.bearings(RING, TEXT);
    if let Some(place) = why.and_then(ScanError::place) {
        pane.arc(RING, [place.bearing_deg, place.arc_deg], MISSING);
    }
    if let Some(warp) = warp {
        pane.arrow(&Point3::origin(), &Point3::from(WARP_ARROW_M * warp), "warp", TEXT);
    }
    pane.frame("from above, with bearings", TEXT);
    pane.axes("x", Upright::Down("z"), TEXT);
    pane.scale_bar(50.0 * M_PER_MM, "50 mm", TEXT);
}

fn side(image: &mut RgbImage, found: &Found, scene: &[Point3]) {
    let view = View { right: Vector3::x(), down: -Vector3::y(), half: half_view_m(found) };
    let mut pane = Pane::new(image, [PANE, 0], PANE, view);
    // The plate stands high in the pane: cloth and floor are below it.
    pane.shift([0.0, -0.5 * half_view_m(found)]);
    scene.iter().for_each(|p| pane.dot(p, 1, SCENE));
    found.cloth.iter().for_each(|p| pane.dot(p, 1, CLOTH));
    let across = |half_m: f64, y: f64| [-1.0, 1.0].map(|s| Point3::new(s * half_m, y, 0.0));
    if let Some(height_m) = found.floor_height_m {
        let [a, b] = across(0.99 * half_view_m(found), height_m);
        pane.line(&a, &b, FLOOR);
    }
    let [a, b] = across(found.plate_radius_m, 0.0);
    pane.line(&a, &b, PLATE);
    rim(&mut pane, found);
    pane.frame("from the side, bearing 0\u{b0} to the right", TEXT);
    pane.axes("x", Upright::Up("y"), TEXT);
    pane.scale_bar(50.0 * M_PER_MM, "50 mm", TEXT);
}

fn flattened(image: &mut RgbImage, found: &Found, why: Option<&ScanError>, warp_known: bool) {
    let view = View { right: Vector3::x(), down: Vector3::z(), half: half_view_m(found) };
    let mut pane = Pane::new(image, [2 * PANE, 0], PANE, view);
    let at = |m: [f64; 2]| Point3::new(m[0], 0.0, m[1]);
    found.flat.iter().for_each(|&m| pane.dot(&at(m), 1, CLOTH));
    circle(&mut pane, found.plate_radius_m, PLATE);
    let mut square = |square: &FoundSquare, color| {
        for k in 0..4 {
            pane.line(&at(square.corners[k]), &at(square.corners[(k + 1) % 4]), color);
        }
    };
    let expected = found.square.or_else(|| {
        let outline = found.outline?;
        let share = found.specimen_side_m / outline.side_m;
        let middle = [0, 1].map(|c| outline.corners.iter().map(|m| m[c]).sum::<f64>() / 4.0);
        let grown = |m: [f64; 2]| [0, 1].map(|c| middle[c] + share * (m[c] - middle[c]));
        let corners = outline.corners.map(grown);
        Some(FoundSquare { corners, side_m: found.specimen_side_m })
    });
    expected.iter().for_each(|expected| square(expected, PLATE));
    found.outline.iter().for_each(|outline| square(outline, MEASURED));
    pane.bearings(RING, TEXT);
    if let Some(place) = why.and_then(ScanError::place) {
        pane.arc(RING, [place.bearing_deg, place.arc_deg], MISSING);
    }
    // The square's x axis, towards the middle of its first side, is the warp if that is known.
    if let Some(FoundSquare { corners: [a, b, c, d], side_m }) = found.square.filter(|_| warp_known)
    {
        let middle = [0, 1].map(|k| 0.25 * (a[k] + b[k] + c[k] + d[k]));
        let share = 2.0 * WARP_ARROW_M / side_m;
        let tip = [0, 1].map(|k| middle[k] + share * (0.5 * (a[k] + b[k]) - middle[k]));
        pane.arrow(&at(middle), &at(tip), "warp", TEXT);
    }
    let title = if found.flat.is_empty() {
        "the cloth flattened: not reached"
    } else {
        "the cloth flattened"
    };
    pane.frame(title, TEXT);
    pane.scale_bar(50.0 * M_PER_MM, "50 mm", TEXT);
}

fn rim(pane: &mut Pane, found: &Found) {
    for (k, point) in found.rim.iter().enumerate() {
        let next = &found.rim[(k + 1) % found.rim.len()];
        let color = if point.observed && next.observed { RIM } else { BRIDGED };
        pane.line(&point.position_m, &next.position_m, color);
    }
}

/// A level circle about the plate's axis at the height of its face.
fn circle(pane: &mut Pane, radius_m: f64, color: Rgb<u8>) {
    pane.circle(&Point3::origin(), [&Vector3::x(), &Vector3::z()], radius_m, color);
}

/// A scene without a plate: views along its own axes.
fn own_axes(image: &mut RgbImage, found: &Found) {
    let axes = [
        (Vector3::x(), -Vector3::y(), ["x", "y"]),
        (Vector3::x(), -Vector3::z(), ["x", "z"]),
        (Vector3::y(), -Vector3::z(), ["y", "z"]),
    ];
    let (middle, half) = extent(&found.scene);
    let metres = found.unit.is_some();
    for (k, (right, down, names)) in (0_u32..).zip(axes) {
        let mut pane = Pane::new(image, [k * PANE, 0], PANE, View { right, down, half });
        pane.shift([-middle.dot(&right), -middle.dot(&down)]);
        found.scene.iter().for_each(|p| pane.dot(p, 1, SCENE));
        if let Some(PlateCandidate { centre, up, radius_m, .. }) = &found.plate_candidate {
            let across = if up.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
            let u = up.cross(&across).normalize();
            let axes = [&u, &up.cross(&u)];
            pane.circle(centre, axes, found.plate_radius_m, PLATE);
            pane.circle(centre, axes, *radius_m, MEASURED);
        }
        pane.frame(&format!("along the scan's {} and {} axes", names[0], names[1]), TEXT);
        pane.axes(names[0], Upright::Up(names[1]), TEXT);
        let length = 10_f64.powf((0.6 * half).log10().floor());
        let label = if metres {
            format!("{} mm", (length / M_PER_MM * 10.0).round() / 10.0)
        } else {
            format!("{length} file units")
        };
        pane.scale_bar(length, &label, TEXT);
    }
}

/// Middle and half extent of most of the points.
fn extent(points: &[Point3]) -> (Vector3, f64) {
    let sorted = [0, 1, 2].map(|axis| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    });
    let at = |values: &[f64], share: f64| {
        values.get((share * values.len() as f64) as usize).copied().unwrap_or(0.0)
    };
    let bounds = sorted.map(|values| [at(&values, 0.01), at(&values, 0.99)]);
    let middle = Vector3::from(bounds.map(|[low, high]| 0.5 * (low + high)));
    let half = bounds.map(|[low, high]| 0.55 * (high - low)).into_iter().fold(1e-6, f64::max);
    (middle, half)
}

/// What the colours mean, the figures, and the outcome in words and its colour.
fn legend(image: &mut RgbImage, found: &Found, (outcome, color): (&str, Rgb<u8>)) {
    let mut y = PANE as i32 + 12;
    let mut x = INDENT;
    for (name, color) in [
        ("scanned", SCENE),
        ("cloth", CLOTH),
        ("expected: plate, square", PLATE),
        ("measured: plate, square", MEASURED),
        ("floor", FLOOR),
        ("rim", RIM),
        ("rim bridged", BRIDGED),
        ("missing or wrong", MISSING),
    ] {
        let [left, top] = [x as f32, y as f32 + 2.0];
        let [right, bottom] = [left + 12.0, top + 12.0];
        polygon(image, &[[left, top], [right, top], [right, bottom], [left, bottom]], color);
        text(image, x + 18, y, name, TEXT);
        x += 46 + text_width(name) as i32;
    }
    y += LINE + 6;
    for line in figures(found) {
        text(image, INDENT, y, &line, TEXT);
        y += LINE;
    }
    y += 6;
    let most = image.width() as f32 - 2.0 * INDENT as f32;
    for line in wrapped(outcome, |line| text_width(line) <= most) {
        text(image, INDENT, y, &line, color);
        y += LINE;
    }
}

/// The figures so far, one line each.
#[must_use]
pub fn figures(found: &Found) -> Vec<String> {
    let mm = |metres: f64| metres / M_PER_MM;
    let unit = found.unit.map_or("not known", LengthUnit::name);
    let spacing = found.point_spacing_m;
    let spacing = spacing.map(|m| format!(", points of the cloth {:.1} mm apart", mm(m)));
    let mut lines = vec![format!("unit {unit}{}", spacing.unwrap_or_default())];
    match (&found.plate, &found.plate_candidate) {
        (Some(plate), _) => lines.push(format!(
            "plate reads {:.1} mm in radius ({:.0} expected), noise {:.2} mm",
            mm(plate.radius_m),
            mm(found.plate_radius_m),
            mm(plate.noise_m)
        )),
        (None, Some(best)) => lines.push(format!(
            "no drape: at the likeliest place the surface ends short of a square of {:.0} mm on {:.0} % of the bearings, \
             beyond it on {:.0} %",
            mm(found.specimen_side_m),
            100.0 * best.short,
            100.0 * best.beyond
        )),
        (None, None) => lines.push("no plate".to_owned()),
    }
    if found.local_from_scan.is_some() {
        lines.push(found.floor_height_m.map_or("no floor".to_owned(), |height_m| {
            format!("floor {:.0} mm below the plate's top", -mm(height_m))
        }));
    }
    if let Some(outline) = &found.outline {
        lines.push(format!(
            "the flattened cloth is a square of {:.1} mm ({:.0} expected)",
            mm(outline.side_m),
            mm(found.specimen_side_m)
        ));
    } else if !found.flat.is_empty() {
        lines.push("the flattened cloth is no square whose size could be told".to_owned());
    }
    lines
}

/// Breaks a text at its spaces into lines that fit; a word that does not has its own.
fn wrapped(text: &str, fits: impl Fn(&str) -> bool) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last().map_or("", String::as_str);
        let longer = if last.is_empty() { word.to_owned() } else { format!("{last} {word}") };
        if last.is_empty() || fits(&longer) {
            lines.pop();
            lines.push(longer);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::wrapped;

    #[test]
    fn lines_break_at_spaces_and_lose_no_word() {
        let text = "one two three four five six seven";
        let fits = |line: &str| line.len() <= 12;
        let lines = wrapped(text, fits);
        assert!(lines.iter().all(|line| fits(line)), "{lines:?}");
        assert_eq!(lines.join(" "), text);
        assert_eq!(wrapped("", fits), [""]);
        assert_eq!(wrapped("incontrovertible it is", fits), ["incontrovertible", "it is"]);
    }
}

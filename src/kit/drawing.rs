//! The stand as a dimensioned drawing on A4, from the same outlines that its parts are turned from.

use super::bench::{Bench, Kind};
use super::sheet::{Anchor, BLACK, Item, Pen, Shape, Sheet};
use super::solid::{Part, parts};

const MM_PER_M: f64 = 1e3;
/// A4 upright.
const SIZE_MM: [f64; 2] = [210.0, 297.0];
/// Scale of the assembly.
pub const SCALE: f64 = 0.5;
/// Scale of the section of the edge.
const EDGE_SCALE: f64 = 5.0;
/// Width of the edge that is shown \[mm of the thing\].
const EDGE_MM: f64 = 9.0;

const OUTLINE: Pen = Pen { width_mm: 0.35, ink: BLACK, dashed: false };

/// The drawing.
#[must_use]
pub fn stand(bench: &Bench) -> Sheet {
    let what = match bench.kind {
        Kind::Square => "stand for the drape of a square",
        Kind::Cusick => "stand for the standard Cusick drape",
    };
    let mut sheet = Sheet::new("stand", what, SIZE_MM);
    let frame = vec![[8.0, 8.0], [202.0, 8.0], [202.0, 289.0], [8.0, 289.0]];
    sheet.named("frame", Shape::Line { points: frame, closed: true }, OUTLINE);
    sheet.text([14.0, 19.0], 6.0, format!("scan2params kit: {what}"));
    let line = "All lengths in mm. Assembly 1:2, section of the edge 5:1, when printed at 100 %.";
    sheet.text([14.0, 26.0], 3.4, line);
    let parts = parts(bench);
    assembly(&mut sheet, bench, &parts);
    edge(&mut sheet, bench, &parts[0]);
    table(&mut sheet, bench, &parts);
    sheet.ruler([14.0, 278.0]);
    sheet
}

/// From a half section to both sides of an axis on the paper: `foot` is where height 0 lies.
fn section(part: &Part, axis: f64, foot: f64, upside_down: bool) -> Shape {
    let sign = if upside_down { 1.0 } else { -1.0 };
    let place = |side: f64| {
        move |&[r, h]: &[f64; 2]| {
            [axis + side * SCALE * r * MM_PER_M, foot + sign * SCALE * h * MM_PER_M]
        }
    };
    let [extent, _] = part.extent_m();
    // From outside: the outline as it is seen, without sockets and holes.
    let seen = outer(&part.profile, extent);
    let right: Vec<[f64; 2]> = seen.iter().map(place(1.0)).collect();
    let left: Vec<[f64; 2]> = seen.iter().rev().map(place(-1.0)).collect();
    Shape::Line { points: [right, left].concat(), closed: true }
}

/// The part of an outline that is seen from the side: from the axis to the foot's outer end, and up
/// to the top.
fn outer(profile: &[[f64; 2]], extent: f64) -> Vec<[f64; 2]> {
    let from = profile.iter().skip_while(|p| p[0] < extent).take_while(|p| p[0] > 0.0);
    let mut seen = vec![[0.0, 0.0]];
    seen.extend(from);
    let top = seen[seen.len() - 1][1];
    seen.push([0.0, top]);
    seen
}

fn assembly(sheet: &mut Sheet, bench: &Bench, parts: &[Part]) {
    let (axis, table) = (95.0, 186.0);
    let up = |m: f64| table - SCALE * m * MM_PER_M;
    let out = |m: f64| SCALE * m * MM_PER_M;
    let mut height = 0.0;
    let by_name = |name: &str| parts.iter().find(|part| part.name == name);
    if let Some(base) = by_name("base") {
        sheet.named("base", section(base, axis, up(0.0), false), OUTLINE);
        height += bench.base_m;
    }
    for name in ["post-lower", "post-upper"] {
        let Some(piece) = by_name(name) else { continue };
        for _ in 0..piece.count {
            sheet.named(piece.name, section(piece, axis, up(height), false), OUTLINE);
            height += bench.post_piece_m;
        }
    }
    let middle = height + bench.edge_radius_m;
    if let [top, bottom, ..] = parts {
        sheet.named("plate-bottom", section(bottom, axis, up(middle), true), OUTLINE);
        sheet.named("plate-top", section(top, axis, up(middle), false), OUTLINE);
    }
    sheet.line(&[[axis, up(bench.top_m()) - 8.0], [axis, up(0.0) + 5.0]], Pen::DASHED);
    sheet.line(&[[20.0, up(0.0)], [170.0, up(0.0)]], Pen::THIN);
    sheet.text([21.0, up(0.0) + 4.0], 3.0, "table");
    let lowest = bench.top_m() - bench.hanging_m();
    sheet.line(&[[30.0, up(lowest)], [184.0, up(lowest)]], Pen::DASHED);
    let deep = bench.hanging_m() * MM_PER_M;
    sheet.text([126.0, up(lowest) - 5.5], 3.0, format!("cloth hangs {deep:.0} deep at most,"));
    sheet.text([126.0, up(lowest) - 1.5], 3.0, "more if it stretches: keep free");
    dimensions(sheet, bench, axis, &up, &out);
}

fn dimensions(
    sheet: &mut Sheet,
    bench: &Bench,
    axis: f64,
    up: &impl Fn(f64) -> f64,
    out: &impl Fn(f64) -> f64,
) {
    let mm = |m: f64| m * MM_PER_M;
    let (top, radius) = (up(bench.top_m()), out(bench.plate_radius_m));
    let dia = format!("dia {:.1}", mm(2.0 * bench.plate_radius_m));
    sheet.dimension([axis - radius, top - 12.0], [axis + radius, top - 12.0], &dia);
    for side in [-1.0, 1.0] {
        let x = axis + side * radius;
        sheet.line(&[[x, top - 2.0], [x, top - 14.0]], Pen::THIN);
    }
    sheet.dimension([28.0, up(0.0)], [28.0, top], &format!("{:.1}", mm(bench.top_m())));
    sheet.line(&[[26.0, top], [axis - radius - 2.0, top]], Pen::THIN);
    let (foot, base) = (up(0.0) + 12.0, out(bench.base_radius_m));
    sheet.dimension(
        [axis - base, foot],
        [axis + base, foot],
        &format!("dia {:.1}", mm(2.0 * bench.base_radius_m)),
    );
    for side in [-1.0, 1.0] {
        let x = axis + side * base;
        sheet.line(&[[x, up(0.0) + 1.0], [x, foot + 2.0]], Pen::THIN);
    }
    let at = up(bench.top_m() - 0.2 * bench.post_piece_m);
    let post = out(bench.post_radius_m);
    sheet.line(&[[axis + post, at], [axis + post + 14.0, at]], Pen::THIN);
    let text = format!(
        "post dia {:.1}, {} x {:.1}",
        mm(2.0 * bench.post_radius_m),
        bench.post_pieces,
        mm(bench.post_piece_m)
    );
    sheet.text([axis + post + 15.0, at + 1.0], 3.0, text);
    let base_text = format!("base {:.1} thick", mm(bench.base_m));
    sheet.text([axis + base + 4.0, up(0.5 * bench.base_m) + 1.0], 3.0, base_text);
}

/// The plate's edge, five times as large: both halves.
fn edge(sheet: &mut Sheet, bench: &Bench, top: &Part) {
    let (right, middle) = (72.0, 238.0);
    let radius = bench.plate_radius_m * MM_PER_M;
    let rim: Vec<[f64; 2]> =
        top.profile.iter().filter(|p| p[0] > 0.5 * bench.plate_radius_m).copied().collect();
    let place = |sign: f64| {
        move |&[r, h]: &[f64; 2]| {
            [
                right - EDGE_SCALE * (radius - r * MM_PER_M),
                middle - sign * EDGE_SCALE * h * MM_PER_M,
            ]
        }
    };
    let half = EDGE_SCALE * bench.edge_radius_m * MM_PER_M;
    let inner = right - EDGE_SCALE * EDGE_MM;
    let mut points = vec![[inner, middle + half]];
    points.extend(rim.iter().rev().map(place(-1.0)));
    points.extend(rim.iter().map(place(1.0)));
    points.push([inner, middle - half]);
    sheet.named("edge", Shape::Line { points, closed: false }, OUTLINE);
    sheet.line(&[[inner, middle], [right, middle]], Pen::DASHED);
    sheet.text([inner, middle + half + 6.0], 3.0, "halves glued here (dashed)");
    let centre = [right - half, middle];
    let (sin, cos) = (-0.6_f64).sin_cos();
    let tip = [centre[0] + half * cos, centre[1] + half * sin];
    sheet.arrow([tip[0] + 14.0 * cos, tip[1] + 14.0 * sin], tip, 2.2, OUTLINE);
    let edge = bench.edge_radius_m * MM_PER_M;
    sheet.text([tip[0] + 15.0 * cos, tip[1] + 15.0 * sin], 3.4, format!("R {edge:.1} all round"));
    sheet.dimension(
        [inner + 6.0, middle - half],
        [inner + 6.0, middle + half],
        &format!("{:.1}", 2.0 * edge),
    );
    sheet.text([14.0, middle - half - 8.0], 4.0, "section of the plate's edge, 5:1");
}

/// What is printed, how often.
fn table(sheet: &mut Sheet, bench: &Bench, parts: &[Part]) {
    let (x, mut y) = (112.0, 216.0);
    let mut row = |cells: [String; 4], y: f64| {
        for (text, offset) in cells.into_iter().zip([0.0, 34.0, 46.0, 70.0]) {
            let words = Item::Text {
                at: [x + offset, y],
                size_mm: 3.2,
                anchor: Anchor::Start,
                upwards: false,
                ink: BLACK,
                text,
            };
            sheet.items.push(words);
        }
    };
    row(["file".into(), "pieces".into(), "   dia x height".into(), "cm^3".into()], y);
    for part in parts {
        y += 6.0;
        let [radius, height] = part.extent_m().map(|m| m * MM_PER_M);
        let size = format!("{:.1} x {height:.1}", 2.0 * radius);
        let volume = format!("{:.1}", part.volume_m3() * 1e6);
        row([format!("{}.stl", part.name), part.count.to_string(), size, volume], y);
    }
    let [spigot, hole] = [bench.spigot_radius_m, bench.hole_radius_m].map(|m| 2.0 * m * MM_PER_M);
    let deep = bench.socket_m * MM_PER_M;
    for line in [
        format!("Spigots dia {spigot:.1}, holes dia {hole:.1}, sockets {deep:.1} deep."),
        "No supports: every part stands on a flat face.".to_owned(),
        "Smooth the plate's face and edge; the face stays".to_owned(),
        "flat within 0.5. Glue the halves on the post.".to_owned(),
    ] {
        y += 6.0;
        let words = Item::Text {
            at: [x, y],
            size_mm: 3.0,
            anchor: Anchor::Start,
            upwards: false,
            ink: BLACK,
            text: line,
        };
        sheet.items.push(words);
    }
}

#[cfg(test)]
mod tests {
    use super::super::template::outside;
    use super::*;

    #[test]
    fn the_drawing_stays_on_its_paper() {
        for kind in [Kind::Square, Kind::Cusick] {
            assert_eq!(outside(&stand(&Bench::of(kind))), Vec::<String>::new());
        }
    }
}

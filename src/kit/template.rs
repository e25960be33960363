//! What is printed on paper at 1:1: the template that the specimen is cut by, the card that centres
//! it on the plate, and the target that a camera's scale is measured on.

use super::bench::{Bench, Kind};
#[cfg(test)]
use super::sheet::Item;
use super::sheet::{BLACK, BLUE, Ink, Pen, Shape, Sheet};

/// Paper around the specimen \[mm\].
const AROUND_MM: f64 = 20.0;
/// Room for words below \[mm\].
const BELOW_MM: f64 = 12.0;
/// The mark: from the edge inward, and along it \[mm\], as `augment --mark` colours it.
pub const MARK_MM: [f64; 2] = [12.0, 80.0];
/// Distance of the crosses of the scale target \[mm\]: all four lie on the plate of the standard
/// experiment.
pub const TARGET_MM: f64 = 120.0;

const MM_PER_M: f64 = 1e3;

/// The template that the specimen is cut by; the mark is drawn in the colour that the cloth gets.
#[must_use]
pub fn specimen(bench: &Bench, mark: Ink) -> Sheet {
    let side = bench.specimen_m * MM_PER_M;
    let wide = side + 2.0 * AROUND_MM;
    let mut sheet = Sheet::new("specimen", specimen_title(bench), [wide, wide + BELOW_MM]);
    let [low, middle, high] = [AROUND_MM, 0.5 * wide, wide - AROUND_MM];
    let centre = [middle; 2];
    if bench.kind == Kind::Square {
        let band = high - MARK_MM[0];
        let half = 0.5 * MARK_MM[1];
        let corners = [
            [band, middle - half],
            [high, middle - half],
            [high, middle + half],
            [band, middle + half],
        ];
        sheet.filled(Some("mark"), &corners, mark);
        sheet.upwards([band - 2.0, middle], 4.0, "MARK THE CLOTH HERE");
    }
    outline(&mut sheet, "cut", bench, centre, Pen::CUT);
    let plate = Shape::Circle { centre, radius: bench.plate_radius_m * MM_PER_M };
    sheet.named("plate", plate, Pen::DASHED);
    sheet.cross(centre, 6.0, Pen::THIN);
    sheet.line(&[[low, middle], [low + 15.0, middle]], Pen::THIN);
    sheet.line(&[[middle, low], [middle, low + 15.0]], Pen::THIN);
    sheet.line(&[[middle, high - 15.0], [middle, high]], Pen::THIN);
    warp_arrow(&mut sheet, [middle + 14.0, middle - 30.0], [middle + 110.0, middle - 30.0]);
    sheet.middle([middle + 62.0, middle - 34.0], 6.0, BLUE, "WARP");
    sheet.middle([middle - 60.0, middle - 60.0], 8.0, BLACK, "THIS SIDE UP = FACE");
    for (k, what) in ["fabric", "specimen", "face"].into_iter().enumerate() {
        let y = middle + 62.0 + 12.0 * k as f64;
        sheet.text([middle - 100.0, y], 4.5, what);
        sheet.line(&[[middle - 78.0, y], [middle - 10.0, y]], Pen::THIN);
    }
    let sizes = match bench.kind {
        Kind::Square => {
            let diagonal = side * std::f64::consts::SQRT_2;
            sheet.dimension([low, low - 6.0], [high, low - 6.0], &format!("{side:.1} mm"));
            sheet.dimension([low - 6.0, low], [low - 6.0, high], &format!("{side:.1} mm"));
            format!("Both diagonals {diagonal:.1} mm: check them on the cloth. Cut on the line.")
        }
        Kind::Cusick => {
            sheet.dimension([low, low - 6.0], [high, low - 6.0], &format!("dia {side:.1} mm"));
            format!("Diameter {side:.1} mm both ways: check it on the cloth. Cut on the line.")
        }
    };
    sheet.text([low, high + 12.0], 4.5, sizes);
    let plate = bench.plate_radius_m * MM_PER_M;
    let warp = "Lay the arrow along the warp (along the selvedge; knits: along the wales).";
    sheet.text([low, high + 19.0], 4.5, format!("{warp} Dashed: the plate, R {plate:.0}."));
    sheet
}

fn specimen_title(bench: &Bench) -> String {
    let side = bench.specimen_m * MM_PER_M;
    match bench.kind {
        Kind::Square => format!("specimen, square {side:.0} x {side:.0} mm"),
        Kind::Cusick => format!("specimen, disc of {side:.0} mm"),
    }
}

/// The flat specimen's outline.
fn outline(sheet: &mut Sheet, id: &'static str, bench: &Bench, [x, y]: [f64; 2], pen: Pen) {
    let half = 0.5 * bench.specimen_m * MM_PER_M;
    let shape = match bench.kind {
        Kind::Square => Shape::Line {
            points: vec![
                [x - half, y - half],
                [x + half, y - half],
                [x + half, y + half],
                [x - half, y + half],
            ],
            closed: true,
        },
        Kind::Cusick => Shape::Circle { centre: [x, y], radius: half },
    };
    sheet.named(id, shape, pen);
}

fn warp_arrow(sheet: &mut Sheet, from: [f64; 2], to: [f64; 2]) {
    sheet.arrow(from, to, 8.0, Pen { width_mm: 1.2, ink: BLUE, dashed: false });
}

/// The card that lies around the plate, level with it, while the cloth is laid, and is lowered to
/// let it fall.
#[must_use]
pub fn placement(bench: &Bench) -> Sheet {
    let side = bench.specimen_m * MM_PER_M;
    let card = side + 2.0 * AROUND_MM;
    let around = 6.0;
    let wide = card + 2.0 * around;
    let title = format!("placement card, {card:.0} x {card:.0} mm");
    let mut sheet = Sheet::new("placement", title, [wide, wide + BELOW_MM]);
    let middle = 0.5 * wide;
    let centre = [middle; 2];
    let corners =
        [[around, around], [wide - around, around], [wide - around; 2], [around, wide - around]];
    sheet.named("card", Shape::Line { points: corners.to_vec(), closed: true }, Pen::CUT);
    let hole = bench.card_hole_m * MM_PER_M;
    sheet.named("hole", Shape::Circle { centre, radius: hole }, Pen::CUT);
    let pen = Pen { width_mm: 0.5, ink: BLUE, dashed: false };
    outline(&mut sheet, "cloth", bench, centre, pen);
    let half = 0.5 * side;
    for direction in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
        let at = |r: f64| [middle + r * direction[0], middle + r * direction[1]];
        sheet.line(&[at(hole + 4.0), at(half + 16.0)], Pen::THIN);
    }
    warp_arrow(
        &mut sheet,
        [middle + hole + 14.0, middle - 12.0],
        [middle + half - 16.0, middle - 12.0],
    );
    let warp = match bench.kind {
        Kind::Square => "WARP, marked side",
        Kind::Cusick => "WARP",
    };
    sheet.middle([middle + 0.5 * (hole + half), middle - 16.0], 5.0, BLUE, warp);
    sheet.middle([middle, middle + 3.0], 5.0, BLACK, format!("cut out: dia {:.0} mm", 2.0 * hole));
    sheet.text([middle + 6.0, middle + hole + 14.0], 5.0, "blue: edge of the cloth");
    let how = "Glue to stiff board 3 to 5 mm thick, cut on the black lines. Level with the plate's top when the cloth is laid.";
    sheet.text([around, wide + 6.0], 4.5, how);
    sheet
}

/// Four crosses at the corners of a square, for the extent of a pixel on the plate's plane.
#[must_use]
pub fn target() -> Sheet {
    let wide = TARGET_MM + 30.0;
    let title = format!("scale target, crosses {TARGET_MM:.0} mm apart");
    let mut sheet = Sheet::new("target", title, [wide, wide + BELOW_MM]);
    let (low, high) = (15.0, 15.0 + TARGET_MM);
    for place in [[low, low], [high, low], [high, high], [low, high]] {
        sheet.cross(place, 9.0, Pen { width_mm: 0.5, ..Pen::CUT });
        sheet.circle(place, 4.0, Pen::CUT);
    }
    let square = vec![[low, low], [high, low], [high, high], [low, high]];
    sheet.named("target", Shape::Line { points: square, closed: true }, Pen::DASHED);
    sheet.dimension([low, low + 12.0], [high, low + 12.0], &format!("{TARGET_MM:.1} mm"));
    sheet.dimension([low + 14.0, low], [low + 14.0, high], &format!("{TARGET_MM:.1} mm"));
    let middle = 0.5 * wide;
    let words = [
        "Print on stiff paper, lay it flat on the plate".to_owned(),
        "and photograph it with the camera as it stands.".to_owned(),
        format!("mm_per_pixel = {TARGET_MM:.0} / pixels between"),
        "two crosses, the mean of the four sides.".to_owned(),
    ];
    for (k, line) in words.into_iter().enumerate() {
        sheet.middle([middle + 6.0, middle - 12.0 + 7.0 * k as f64], 4.0, BLACK, line);
    }
    sheet
}

/// All that is printed for a bench.
#[must_use]
pub fn all(bench: &Bench, mark: Ink) -> Vec<Sheet> {
    let mut sheets = vec![specimen(bench, mark), placement(bench)];
    if bench.kind == Kind::Cusick {
        sheets.push(target());
    }
    sheets
}

/// Items that reach beyond a sheet.
#[cfg(test)]
pub(super) fn outside(sheet: &Sheet) -> Vec<String> {
    let inside = |[x, y]: [f64; 2]| {
        (0.0..=sheet.size_mm[0]).contains(&x) && (0.0..=sheet.size_mm[1]).contains(&y)
    };
    let mut faults = Vec::new();
    for item in &sheet.items {
        let places = match item {
            Item::Shape { shape: Shape::Line { points, .. }, .. } => points.clone(),
            Item::Shape { shape: Shape::Circle { centre: [x, y], radius: r }, .. } => {
                vec![[x - r, y - r], [x + r, y + r]]
            }
            Item::Text { at: [x, y], size_mm, anchor, upwards, text, .. } => {
                let length = super::sheet::length_mm(text, *size_mm);
                let back = if *anchor == super::sheet::Anchor::Middle { 0.5 * length } else { 0.0 };
                if *upwards {
                    vec![[*x - size_mm, y + back], [*x, y + back - length]]
                } else {
                    vec![[x - back, y - size_mm], [x - back + length, *y]]
                }
            }
        };
        if !places.iter().all(|&p| inside(p)) {
            faults.push(format!("{item:?}"));
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::super::sheet::length_mm;
    use super::*;

    #[test]
    fn the_target_lies_on_the_plate() {
        let plate = Bench::of(Kind::Cusick).plate_radius_m * MM_PER_M;
        assert!(0.5 * TARGET_MM * std::f64::consts::SQRT_2 + 4.0 < plate);
    }

    #[test]
    fn nothing_runs_off_the_paper() {
        for kind in [Kind::Square, Kind::Cusick] {
            for sheet in all(&Bench::of(kind), [220, 40, 40]) {
                assert_eq!(outside(&sheet), Vec::<String>::new(), "{}", sheet.name);
            }
        }
        let mut sheet = Sheet::new("s", "", [10.0, 10.0]);
        sheet.text([5.0, 5.0], 3.0, "too long for this");
        assert_eq!(outside(&sheet).len(), 1);
        assert!(length_mm("too long for this", 3.0) > 10.0);
    }
}

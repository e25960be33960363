//! How the experiment is made, as Markdown and as HTML to print.
//!
//! In: a [`Bench`] and the colour of the mark. Out: text whose numbers come from the simulator, the
//! scan path and the readers, so that none can drift. What is a choice of this protocol says so.

use super::bench::{Bench, Kind};
use super::checklist::checklist;
use super::solid::parts;
use super::template::{MARK_MM, TARGET_MM};
use super::tiles::PAPERS;
use crate::batch::SCANS;
use crate::calibrate::silhouette::SilhouetteLimits;
use crate::fabric::DENSITY_LIMITS_G_M2;
use crate::scan::ScanOptions;
use crate::sensor::Ring;

const MM_PER_M: f64 = 1e3;
/// Largest error of the density that the table of weighing allows \[%\].
const WEIGHING_PERCENT: f64 = 1.0;

/// The names of example files: fabric, specimen, face, drop.
pub const EXAMPLES: [&str; 5] = ["s1_up_d1", "s1_up_d2", "s1_down_d1", "s2_up_d1", "s2_down_d1"];
/// The fabric of the examples.
pub const EXAMPLE_FABRIC: &str = "linen7";

/// The protocol as Markdown.
#[must_use]
pub fn markdown(bench: &Bench, mark: &str) -> String {
    let before = [make(bench), specimens(bench, mark), weigh(bench), lay(bench)].join("\n");
    let after = match bench.kind {
        Kind::Square => [scan(bench, mark), name_scans(mark), refusals()].join("\n"),
        Kind::Cusick => [photograph(bench), name_pictures()].join("\n"),
    };
    format!("{}\n{before}\n{after}\n{}", heading(bench), record(bench))
}

/// Markdown as an HTML page that prints.
#[must_use]
pub fn html(markdown: &str) -> String {
    let options =
        pulldown_cmark::Options::ENABLE_TABLES | pulldown_cmark::Options::ENABLE_TASKLISTS;
    let mut body = String::new();
    pulldown_cmark::html::push_html(&mut body, pulldown_cmark::Parser::new_ext(markdown, options));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>scan2params: protocol</title>\n\
         <style>\nbody {{ font: 11pt/1.45 Helvetica, Arial, sans-serif; max-width: 46em; margin: 2em auto; padding: 0 1em; }}\n\
         table {{ border-collapse: collapse; margin: 0.8em 0; }}\n\
         th, td {{ border: 1px solid #999; padding: 0.2em 0.6em; text-align: left; vertical-align: top; }}\n\
         pre {{ background: #f3f3f3; padding: 0.6em; white-space: pre-wrap; }}\n\
         li:has(input) {{ list-style: none; }}\n\
         h2 {{ margin-top: 1.6em; break-after: avoid; }}\ntr, pre {{ break-inside: avoid; }}\n\
         @media print {{ body {{ margin: 0; max-width: none; font-size: 10pt; }} }}\n</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

fn mm(metres: f64) -> String {
    let text = format!("{:.1}", metres * MM_PER_M);
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

fn heading(bench: &Bench) -> String {
    let (side, plate) = (mm(bench.specimen_m), mm(bench.plate_radius_m));
    match bench.kind {
        Kind::Square => format!(
            "# A drape for scan2params\n\nA specimen of {side} x {side} mm is laid centred on a plate of radius {plate} mm, falls to rest, and \
             is scanned. This kit was written by `scan2params kit`; the limits below are those that the program checks.\n"
        ),
        Kind::Cusick => format!(
            "# A standard Cusick drape for scan2params\n\nA disc of {side} mm is laid centred on a plate of radius {plate} mm, falls to rest, and \
             is photographed from straight above. This kit was written by `scan2params kit --bench cusick`; `scan2params \
             calibrate` fits a fabric to the pictures.\n"
        ),
    }
}

fn make(bench: &Bench) -> String {
    let papers = PAPERS.map(|paper| format!("`templates-{}.pdf`", paper.name)).join(", ");
    let mut text = format!(
        "## 1. Make the stand\n\n- [ ] Print one of {papers} at 100 %, without \"fit to page\". Measure the ruler on each page: 100 mm and 1 inch. \
         Tiles are cut along the dashed lines and laid cross on cross. For a cutter or CAD there are the same drawings as SVG.\n\
         - [ ] Print the parts (STL, millimetres), each on its flat face, without supports; `stand.pdf` has the dimensions:\n\n\
         | file | pieces | what |\n|---|---|---|\n"
    );
    for part in parts(bench) {
        text += &format!("| `{}.stl` | {} | {} |\n", part.name, part.count, part.what);
    }
    text + &format!(
        "\n- [ ] Smooth the plate's face and its edge. The simulator takes the edge as fully round with a radius of {} mm, and friction of \
         cloth on the plate as {}; leave no burr and no tape on it.\n- [ ] Assemble: base, post, lower half, upper half; glue the halves. The top \
         stands {} mm above the table. Level it within a degree.\n- [ ] Glue the placement card to stiff board, cut it out, and its hole.\n",
        mm(bench.edge_radius_m),
        crate::sim::Plate::default().friction,
        mm(bench.top_m())
    )
}

fn specimens(bench: &Bench, mark: &str) -> String {
    let mark = match bench.kind {
        Kind::Square => format!(
            "- [ ] Mark both sides of the specimen, in the middle of the edge to which the warp runs, {} mm along the edge and {} mm inwards, with chalk or thin \
             paint in {mark}, a hue that the cloth has not (grey, black and white have none). Tape stiffens the edge: chalk is better.\n",
            MARK_MM[1], MARK_MM[0]
        ),
        Kind::Cusick => "- [ ] Draw a thin chalk arrow along the warp on the side that lies up, on the part that lies on the plate.\n".to_owned(),
    };
    format!(
        "## 2. Cut and condition\n\n- [ ] Condition the fabric flat and free of tension at 20 C and 65 % relative humidity (ISO 139: within 2 C and 4 \
         %) for 24 h, 4 h at least, and measure there.\n- [ ] Cut two specimens at least by the template, and as many as section 3 weighs, its arrow along the warp, 100 mm and more from the \
         selvedge and from each other's threads. Write fabric, specimen number and face on the corner of a spare piece, not on the specimen.\n{mark}\
         - [ ] Rest each specimen flat for an hour. Do not fold it; iron creases out and condition again.\n\n\
         How many drapes: five are a good beginning, of two specimens, both faces, one of them twice. If two disagree, drop a third.\n"
    )
}

/// Squares or discs whose weight is known to [`WEIGHING_PERCENT`] on a scale that shows steps of
/// `step_g`.
fn pieces(area_m2: f64, density_g_m2: f64, step_g: f64) -> usize {
    let least_g = 0.5 * step_g / (0.01 * WEIGHING_PERCENT);
    (least_g / (area_m2 * density_g_m2)).ceil().max(1.0) as usize
}

fn weigh(bench: &Bench) -> String {
    let (area_m2, what) = match bench.kind {
        Kind::Square => (bench.specimen_m.powi(2), "squares"),
        Kind::Cusick => (std::f64::consts::PI * (0.5 * bench.specimen_m).powi(2), "discs"),
    };
    let [least, most] = DENSITY_LIMITS_G_M2;
    let mut text = format!(
        "## 3. Weigh\n\nThe stiffnesses are found in proportion to the weight: an error of 1 % in g/m^2 is 1 % in all of them. A kitchen scale is \
         enough if enough cloth lies on it. Weigh N {what} of the template together, after conditioning:\n\n    density_g_m2 = grams / (N x {area_m2:.4})\n\n\
         So many bring half of the scale's step below {WEIGHING_PERCENT} %:\n\n| fabric | 50 g/m^2 | 100 | 200 | 400 |\n|---|---|---|---|---|\n"
    );
    for step_g in [1.0, 0.1] {
        let counts = [50.0, 100.0, 200.0, 400.0].map(|d| pieces(area_m2, d, step_g).to_string());
        text += &format!("| N, a scale that shows {step_g} g | {} |\n", counts.join(" | "));
    }
    text + &format!(
        "\n- [ ] Check the scale with a known weight (water: 100 ml are 100 g). Densities of {least} to {most} g/m^2 are taken.\n\
         - [ ] All drapes of a fabric get one density, or each specimen its own where they were weighed alone.\n"
    )
}

fn lay(bench: &Bench) -> String {
    let side = match bench.kind {
        Kind::Square => "marked side at the arrow",
        Kind::Cusick => "warp along the arrow",
    };
    format!(
        "## 4. Lay, let fall\n\n- [ ] Stand the placement card on four equal stacks around the post, its face level with the plate's top.\n\
         - [ ] Lay the specimen on plate and card, {side}, its edge on the blue line, the face up for `up`, the back up for `down`. Stroke it flat, without \
         stretching it. The card centres it within a millimetre.\n- [ ] Hold the card by two opposite edges, take the stacks away, and lower it straight \
         down to the base in about two seconds. Do not touch the cloth any more; a drape that was touched is laid anew.\n\
         - [ ] Wait 60 s, always the same (chosen: cloth creeps). Cloth hangs {} mm deep if it does not stretch; nothing may touch it.\n\
         - [ ] For the next drop lift the cloth off, rest it flat for 10 minutes (chosen), and lay it anew. Folds may come out another number of times: \
         that is the cloth, not a mistake; keep every drop.\n",
        mm(bench.hanging_m())
    )
}

fn scan(bench: &Bench, mark: &str) -> String {
    let ring = Ring::default();
    let [high, low] =
        [0, 1].map(|k| ring.elevations_rad.get(k).copied().unwrap_or(0.0).to_degrees());
    let each = ring.views / ring.elevations_rad.len().max(1);
    let limits = ScanOptions::default().tuning.limits;
    format!(
        "## 5. Scan\n\n- [ ] One view from straight above, {each} around from {high:.0} degrees above the middle of the hanging cloth, {each} around \
         level with it ({low:.0} degrees), {:.2} m away: what the virtual scans of this package have. The level ones see the rim and into the folds; a \
         scan from above alone is refused. A scanner led by hand goes round twice, high and low.\n\
         - [ ] A structured-light or laser scanner, or a near-range depth camera. Points {:.1} mm apart or closer, noise of 1 mm at most; a LiDAR of \
         a phone is too coarse.\n- [ ] The cloth on the plate, all of the rim, and some of the table are in the scan. Within {} mm of the post there is nothing but \
         cloth, stand, card and table; beyond, other things do not matter, but no second drape.\n\
         - [ ] Do not crop to the cloth, do not fill holes, do not close the mesh, do not decimate. Save colours if there is a mark.\n\
         - [ ] Look at once: `scan2params inspect SCAN --mark {mark} --out found.png` says what is missing and where, while the cloth still hangs.\n",
        ring.distance_m,
        limits.needed_m * MM_PER_M,
        mm((bench.reach_m() / 0.05).ceil() * 0.05)
    )
}

/// The table of densities that `batch` reads, with the example's rows.
#[must_use]
pub fn densities() -> String {
    let mut text = "# one row for each scan; warp_toward may be left out where --mark is given\nfile,density_g_m2\n".to_owned();
    for name in EXAMPLES {
        text += &format!("{EXAMPLE_FABRIC}_{name}.ply,182.5\n");
    }
    text
}

fn name_scans(mark: &str) -> String {
    let endings = SCANS.map(|ending| format!(".{ending}")).join(", ");
    let [first, ..] = EXAMPLES;
    format!(
        "## 6. Name, estimate, combine\n\nOne folder `scans`, one file for each drape: `FABRIC_sN_FACE_dN` for specimen, face (`up`, `down`) and drop, as in \
         `{EXAMPLE_FABRIC}_{first}.ply`. Endings that `batch` reads: {endings}, and folders of depth images with a `views.json`. The densities are a \
         table beside it, `densities.csv`; `densities.example.csv` of this kit is one to copy:\n\n{}\n\
         Then all of it, and each face's parameters from its drapes; knits and finished fabrics bend differently towards face and \
         back:\n\n    scan2params batch scans --density-csv densities.csv --mark {mark} --out results\n    scan2params combine \
         results/files/{EXAMPLE_FABRIC}_*_up_*.params.json --out {EXAMPLE_FABRIC}_up.json\n    scan2params combine \
         results/files/{EXAMPLE_FABRIC}_*_down_*.params.json --out {EXAMPLE_FABRIC}_down.json\n",
        indented(&densities())
    )
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("    {line}\n")).collect()
}

fn refusals() -> String {
    let mut text = "## What makes a scan refused\n\nNo answer is given to such a scan, exit code 4; the message names the place. The limits are those of this \
         version:\n\n| refused | avoid it |\n|---|---|\n"
        .to_owned();
    for item in checklist(&ScanOptions::default()) {
        text += &format!("| {} <!-- {} --> | {} |\n", item.refused, item.code, item.avoid);
    }
    text + "\nA scan that is answered still has a verdict: reliable, doubtful or do not use, with its grounds. `combine` leaves out what is not to be used, \
         and says so.\n"
}

/// How much too small an outline appears that hangs `depth_m` below the plate, of radius
/// `radius_m`, seen from `height_m` above the plate \[m\].
fn perspective_m(height_m: f64, depth_m: f64, radius_m: f64) -> f64 {
    radius_m * depth_m / (height_m + depth_m)
}

fn photograph(bench: &Bench) -> String {
    let limits = SilhouetteLimits::default();
    let (depth, radius) = (0.6 * bench.hanging_m(), 0.8 * bench.reach_m());
    let mut text = format!(
        "## 5. Photograph from straight above\n\nThe outline hangs below the plate's plane, where the scale is measured: a camera sees it too small, by its depth \
         over its distance. A rim {} mm deep at a radius of {} mm:\n\n| camera above the plate | 1 m | 2 m | 3 m | 5 m |\n|---|---|---|---|---|\n| outline \
         too small by | ",
        mm(depth),
        mm(radius)
    );
    let off = [1.0, 2.0, 3.0, 5.0]
        .map(|height| format!("{:.1} mm", perspective_m(height, depth, radius) * MM_PER_M));
    text += &off.join(" | ");
    let share = [1.0, 2.0, 3.0, 5.0]
        .map(|height| format!("{:.1} %", 100.0 * perspective_m(height, depth, 1.0)));
    text += &format!(" |\n| of its size | {}", share.join(" | "));
    text += &format!(
        " |\n\n- [ ] Hang the camera as high as the room allows, 2 m at least, with a long focal length, its axis through the plate's centre: a plumb line from the \
         lens ends there, and the plate's picture is round within 0.5 %.\n- [ ] Fix focus, zoom and place, and do not change them until all drapes are taken.\n\
         - [ ] Scale: lay the target (`templates`, {TARGET_MM:.0} mm between crosses) printed on stiff paper, flat on the plate, all four crosses on it. mm_per_pixel = {TARGET_MM:.0} / pixels between two crosses, the mean of the four sides; sides \
         that differ by more than 0.5 % say that the camera is tilted. Give \
         `--scale-sigma` the share of the table above for your height, or twice the reading error over {TARGET_MM:.0} mm in percent if that is more.\n\
         - [ ] One figure against a plain ground, the darker or the brighter: lower the card in a colour that is far from the cloth's. The mean greys must differ by \
         {:.0} of 255 at least, at most {:.0} % of the pixels may lie between, holes and other figures cover at most {:.0} % of it, and the drape covers {:.0} to {:.0} \
         % of the picture without touching its border. Light evenly, without a shadow at the rim.\n- [ ] Save PNG or JPEG, as it is, without rotating it afterwards.\n",
        limits.contrast,
        100.0 * limits.between,
        100.0 * limits.second,
        100.0 * limits.covers[0],
        100.0 * limits.covers[1]
    );
    text
}

/// An example of the manifest that `calibrate` reads.
#[must_use]
pub fn manifest() -> String {
    let mut text = "# one row for each picture; leave a cell empty where it is not known\nfile,kind,fabric,specimen,face,capture,\
         density_g_m2,experiment,mm_per_pixel,role,warp_toward\n"
        .to_owned();
    for (k, name) in EXAMPLES.into_iter().enumerate() {
        let mut parts = name.split('_');
        let [specimen, face, drop] =
            [parts.next(), parts.next(), parts.next()].map(Option::unwrap_or_default);
        let role = if k < 3 { "fit" } else { "holdout" };
        text += &format!(
            "pictures/{EXAMPLE_FABRIC}_{name}.png,silhouette,{EXAMPLE_FABRIC},{specimen},{face},{drop},182.5,cusick,0.2143,{role},90\n"
        );
    }
    text
}

fn name_pictures() -> String {
    format!(
        "## 6. Manifest, calibrate\n\nOne row for each picture in `manifest.csv`; `manifest.example.csv` of this kit is one to copy. Specimen and face make the independent unit, \
         captures are repeats of it; `mm_per_pixel` is the scale measured above; `warp_toward` is where the arrow points in the picture, in degrees, \
         anticlockwise from the right; `role` is `fit` for drapes that the fabric is fitted to and `holdout` for those that it predicts. Mark both faces of some \
         specimens `fit` and both of others `holdout`:\n\n{}\nThen:\n\n    scan2params calibrate manifest.csv --out calibration\n",
        indented(&manifest())
    )
}

fn record(bench: &Bench) -> String {
    let device = match bench.kind {
        Kind::Square => "scanner",
        Kind::Cusick => "camera, its height",
    };
    format!(
        "## Record with the files\n\nFabric (name, composition, knit or woven), g/m^2 and how it was weighed, thickness, face and back, how the warp was found; \
         temperature, humidity, hours conditioned; operator, date, {device}; repeated drops, and why. Kit of scan2params {}.\n",
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_cloth_lies_on_the_scale() {
        for (area_m2, density, step_g) in
            [(0.09, 50.0, 1.0), (0.09, 400.0, 0.1), (0.07, 182.0, 1.0)]
        {
            let count = pieces(area_m2, density, step_g);
            let percent = |n: usize| 100.0 * 0.5 * step_g / (n as f64 * area_m2 * density);
            assert!(percent(count) <= WEIGHING_PERCENT, "{count}");
            assert!(count == 1 || percent(count - 1) > WEIGHING_PERCENT, "{count}");
        }
    }

    /// A ray from the camera through the rim meets the plate's plane farther in.
    #[test]
    fn a_low_rim_looks_small() {
        let (height, depth, radius) = (2.0, 0.04, 0.12);
        let on_plate = radius * height / (height + depth);
        assert!((perspective_m(height, depth, radius) - (radius - on_plate)).abs() < 1e-15);
    }

    #[test]
    fn tables_and_boxes_reach_the_page() {
        let page = html(&markdown(&Bench::of(Kind::Square), "red"));
        let count = |part: &str| page.matches(part).count();
        assert!(count("<table>") == 3 && count("type=\"checkbox\"") > 15, "{page}");
        assert!(!page.contains("[ ]"), "a box was left as text");
    }
}

//! boundary.png: the scanned rim on those of the simulated drapes, from above and from the
//! side, over the scanned cloth.

use image::{Rgb, RgbImage};

use super::simulated::SimulatedDrape;
use super::verdict::one_line;
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3};
use crate::job::Outcome;
use crate::job::verdict::Level;
use crate::picture::draw::{self, line, stroke, text, text_width};

const PANE: i32 = 720;
const MARGIN: i32 = 64;
/// Characters that fit beside each other: one is 8 pixels wide in the mean.
const MOST_CHARACTERS: usize = (2 * PANE as usize - 24) / 9;
/// Half the width of the view \[m\].
const HALF_VIEW_M: f64 = 0.165;
const WHITE: Rgb<u8> = Rgb([255, 255, 255]);
const CLOTH: Rgb<u8> = Rgb([205, 210, 216]);
const SCANNED: Rgb<u8> = Rgb([200, 30, 30]);
const BRIDGED: Rgb<u8> = Rgb([255, 150, 0]);
const SIMULATED: Rgb<u8> = Rgb([20, 90, 200]);
const RELEASED: Rgb<u8> = Rgb([150, 175, 215]);
const RELIABLE: Rgb<u8> = Rgb([0, 120, 50]);
const DOUBTFUL: Rgb<u8> = Rgb([190, 110, 0]);
const TEXT: Rgb<u8> = Rgb([40, 40, 40]);
const GRID: Rgb<u8> = Rgb([232, 232, 232]);
const LABEL: Rgb<u8> = Rgb([146, 146, 146]);

/// Width of a rim's line, in pixels.
const RIM_WIDTH: f32 = 1.8;

/// A view: horizontal and downward coordinate \[m\] of a point.
type View = fn(&Point3) -> [f64; 2];

/// Draws both views with a legend and the mean error.
#[must_use]
pub fn draw(outcome: &Outcome) -> RgbImage {
    let mut image = RgbImage::from_pixel((2 * PANE) as u32, (PANE + MARGIN) as u32, WHITE);
    let views: [(View, &str); 2] = [
        (|p| [p.x, p.z], "from above: warp right, weft down (mm)"),
        (|p| [p.x, -p.y - 0.075], "from the side: warp right, up (mm)"),
    ];
    for (pane, (view, title)) in views.into_iter().enumerate() {
        let left = pane as i32 * PANE;
        grid(&mut image, left);
        let evidence = outcome.rim.scanned().map(|scanned| &scanned.evidence);
        for p in evidence.iter().flat_map(|e| &e.cloth) {
            dot(&mut image, left, view(p), CLOTH, 1.0);
        }
        let simulated =
            [(SimulatedDrape::second(outcome), RELEASED), (SimulatedDrape::of(outcome), SIMULATED)];
        for (shown, color) in simulated {
            if let Some(shown) = shown {
                rim(&mut image, left, view, &shown.drape.boundary, |_| color);
            }
        }
        let color = |observed| if observed { SCANNED } else { BRIDGED };
        rim(&mut image, left, view, outcome.rim.boundary(), color);
        for corner in evidence.iter().flat_map(|e| &e.corners) {
            dot(&mut image, left, view(corner), SCANNED, 4.5);
        }
        text(&mut image, left + 12, PANE - 22, title, TEXT);
    }
    legend(&mut image, outcome);
    image
}

fn legend(image: &mut RgbImage, outcome: &Outcome) {
    let words = |shown: SimulatedDrape<'_>| {
        let [mean, largest] = shown.distances_m.map(|m| m / M_PER_MM);
        format!("{}: {mean:.2} mm, largest {largest:.2}, {} folds", shown.name, shown.drape.nodes)
    };
    let first = SimulatedDrape::of(outcome).map_or_else(|| "no simulated drape".to_owned(), words);
    let second = SimulatedDrape::second(outcome).map(words).unwrap_or_default();
    let mut x = 12;
    let parts =
        [("scanned rim", SCANNED), ("bridged", BRIDGED), (&first, SIMULATED), (&second, RELEASED)];
    for (words, color) in parts {
        text(image, x, PANE + 4, words, color);
        x += text_width(words) as i32 + 24;
    }
    let name = outcome.job.input.file_name().unwrap_or_default().to_string_lossy();
    text(image, 12, PANE + 22, &name, TEXT);
    let color = match outcome.verdict.level {
        Level::Reliable => RELIABLE,
        Level::Doubtful => DOUBTFUL,
        Level::DoNotUse => SCANNED,
    };
    text(image, 12, PANE + 40, &one_line(&outcome.verdict, MOST_CHARACTERS), color);
}

fn pixel(left: i32, [x, y]: [f64; 2]) -> [f32; 2] {
    let scale = f64::from(PANE) / (2.0 * HALF_VIEW_M);
    [(f64::from(left) + (x + HALF_VIEW_M) * scale) as f32, ((y + HALF_VIEW_M) * scale) as f32]
}

fn grid(image: &mut RgbImage, left: i32) {
    for k in -3..=3 {
        let at = f64::from(k) * 0.05;
        line(image, pixel(left, [at, -HALF_VIEW_M]), pixel(left, [at, HALF_VIEW_M]), GRID);
        line(image, pixel(left, [-HALF_VIEW_M, at]), pixel(left, [HALF_VIEW_M, at]), GRID);
        let [x, _] = pixel(left, [at, 0.0]);
        let label = format!("{}", k * 50);
        text(image, (x - 0.5 * text_width(&label)) as i32, 4, &label, LABEL);
    }
}

fn rim(
    image: &mut RgbImage,
    left: i32,
    view: View,
    rim: &Boundary,
    color: impl Fn(bool) -> Rgb<u8>,
) {
    let points = rim.points();
    for (k, point) in points.iter().enumerate() {
        let next = &points[(k + 1) % points.len()];
        let [a, b] = [point, next].map(|p| pixel(left, view(&p.position_m)));
        let color = color(point.observed && next.observed);
        stroke(image, a, b, RIM_WIDTH, color);
        draw::dot(image, a, 0.5 * RIM_WIDTH, color);
    }
}

/// A dot of `radius` pixels, if its centre lies in the pane.
fn dot(image: &mut RgbImage, left: i32, at: [f64; 2], color: Rgb<u8>, radius: f32) {
    let [x, y] = pixel(left, at);
    let pane = PANE as f32;
    if (0.0..pane).contains(&(x - left as f32)) && (0.0..pane).contains(&y) {
        draw::dot(image, [x, y], radius, color);
    }
}

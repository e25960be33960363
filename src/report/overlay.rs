//! boundary.png: the scanned rim on the re-simulated one, from above and from the
//! side, over the scanned cloth.

use image::{Rgb, RgbImage};
use imageproc::drawing::draw_filled_circle_mut;

use super::verdict::one_line;
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3};
use crate::job::Outcome;
use crate::job::verdict::Level;
use crate::picture::draw::{line, text};

const PANE: i32 = 720;
const MARGIN: i32 = 64;
/// Characters of the font that fit beside each other.
const MOST_CHARACTERS: usize = (2 * PANE as usize - 24) / 9;
/// Half the width of the view \[m\].
const HALF_VIEW_M: f64 = 0.165;
const WHITE: Rgb<u8> = Rgb([255, 255, 255]);
const CLOTH: Rgb<u8> = Rgb([205, 210, 216]);
const SCANNED: Rgb<u8> = Rgb([200, 30, 30]);
const BRIDGED: Rgb<u8> = Rgb([255, 150, 0]);
const SIMULATED: Rgb<u8> = Rgb([20, 90, 200]);
const RELIABLE: Rgb<u8> = Rgb([0, 120, 50]);
const DOUBTFUL: Rgb<u8> = Rgb([190, 110, 0]);
const TEXT: Rgb<u8> = Rgb([40, 40, 40]);
const GRID: Rgb<u8> = Rgb([232, 232, 232]);

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
            dot(&mut image, left, view(p), CLOTH, 1);
        }
        if let Some(again) = &outcome.resimulation {
            rim(&mut image, left, view, &again.drape.boundary, |_| SIMULATED);
        }
        let color = |observed| if observed { SCANNED } else { BRIDGED };
        rim(&mut image, left, view, outcome.rim.boundary(), color);
        for corner in evidence.iter().flat_map(|e| &e.corners) {
            dot(&mut image, left, view(corner), SCANNED, 4);
        }
        text(&mut image, left + 12, PANE - 20, title, TEXT);
    }
    legend(&mut image, outcome);
    image
}

fn legend(image: &mut RgbImage, outcome: &Outcome) {
    let y = PANE + 8;
    text(image, 12, y, "scanned rim", SCANNED);
    text(image, 130, y, "bridged", BRIDGED);
    let line = match &outcome.resimulation {
        Some(again) => format!(
            "re-simulated rim: mean error {:.2} mm, largest {:.2} mm, {} folds",
            again.mean_distance_m / M_PER_MM,
            again.largest_distance_m / M_PER_MM,
            again.drape.nodes
        ),
        None => "not re-simulated".to_owned(),
    };
    text(image, 220, y, &line, SIMULATED);
    let name = outcome.job.input.file_name().unwrap_or_default().to_string_lossy();
    text(image, 12, y + 18, &name, TEXT);
    let color = match outcome.verdict.level {
        Level::Reliable => RELIABLE,
        Level::Doubtful => DOUBTFUL,
        Level::DoNotUse => SCANNED,
    };
    text(image, 12, y + 36, &one_line(&outcome.verdict, MOST_CHARACTERS), color);
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
        text(image, x as i32 - 12, 4, &format!("{}", k * 50), GRID.map_text());
    }
}

/// The grid's labels are darker than its lines.
trait Darker {
    fn map_text(self) -> Self;
}

impl Darker for Rgb<u8> {
    fn map_text(self) -> Self {
        Self(self.0.map(|c| c / 2 + 30))
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
        line(image, a, b, color);
        line(image, [a[0], a[1] + 1.0], [b[0], b[1] + 1.0], color);
    }
}

fn dot(image: &mut RgbImage, left: i32, at: [f64; 2], color: Rgb<u8>, radius: i32) {
    let [x, y] = pixel(left, at).map(|v| v.round() as i32);
    if (left..left + PANE).contains(&x) && (0..PANE).contains(&y) {
        draw_filled_circle_mut(image, (x, y), radius, color);
    }
}

//! What was found, drawn: top view, side view and unrolled view. Cloth grey, rim
//! red, bridged orange, corners blue.

use image::{Rgb, RgbImage};

use crate::base::Point3;
use crate::picture::draw;
use crate::scan::ScannedBoundary;

const PANE: u32 = 700;
const PIXELS_PER_M: f64 = 1900.0;

/// Draws the three views side by side.
#[must_use]
pub fn draw(scan: &ScannedBoundary) -> RgbImage {
    let mut image = RgbImage::from_pixel(3 * PANE, PANE, Rgb([255, 255, 255]));
    let views: [fn(&Point3) -> [f64; 2]; 2] = [|p| [p.x, p.z], |p| [p.x, -p.y - 0.06]];
    for (pane, view) in views.iter().enumerate() {
        let mut dot = |p: &Point3, color: [u8; 3], size: f32| {
            let [x, y] = view(p);
            put(&mut image, pane as u32, x, y, color, size);
        };
        for p in &scan.evidence.cloth {
            let shade = 150 + (80.0 * (p.y / -0.17).clamp(0.0, 1.0)) as u8;
            dot(p, [shade; 3], 1.0);
        }
        for p in scan.boundary.points() {
            dot(&p.position_m, if p.observed { [220, 0, 0] } else { [255, 150, 0] }, 2.2);
        }
        for p in &scan.evidence.corners {
            dot(p, [0, 60, 230], 5.0);
        }
    }
    for m in &scan.evidence.material {
        put(&mut image, 2, m[0], m[1], [150; 3], 1.0);
    }
    image
}

/// A dot `size` pixels wide, if its centre lies in the pane.
fn put(image: &mut RgbImage, pane: u32, x: f64, y: f64, color: [u8; 3], size: f32) {
    let side = f64::from(PANE);
    let [x, y] = [x, y].map(|v| v * PIXELS_PER_M + 0.5 * side);
    if (0.0..side).contains(&x) && (0.0..side).contains(&y) {
        let centre = [(f64::from(pane) * side + x) as f32, y as f32];
        draw::dot(image, centre, 0.5 * size, Rgb(color));
    }
}

//! What was found, drawn: top view, side view and unrolled view. Cloth grey, rim
//! red, bridged orange, corners blue.

use image::{Rgb, RgbImage};

use crate::base::Point3;
use crate::scan::ScannedBoundary;

const PANE: u32 = 700;
const PIXELS_PER_M: f64 = 1900.0;

/// Draws the three views side by side.
#[must_use]
pub fn draw(scan: &ScannedBoundary) -> RgbImage {
    let mut image = RgbImage::from_pixel(3 * PANE, PANE, Rgb([255, 255, 255]));
    let views: [fn(&Point3) -> [f64; 2]; 2] = [|p| [p.x, p.z], |p| [p.x, -p.y - 0.06]];
    for (pane, view) in views.iter().enumerate() {
        let mut dot = |p: &Point3, color: [u8; 3], size: i64| {
            let [x, y] = view(p);
            put(&mut image, pane as u32, x, y, color, size);
        };
        for p in &scan.evidence.cloth {
            let shade = 150 + (80.0 * (p.y / -0.17).clamp(0.0, 1.0)) as u8;
            dot(p, [shade; 3], 1);
        }
        for p in scan.boundary.points() {
            dot(&p.position_m, if p.observed { [220, 0, 0] } else { [255, 150, 0] }, 2);
        }
        for p in &scan.evidence.corners {
            dot(p, [0, 60, 230], 5);
        }
    }
    for m in &scan.evidence.material {
        put(&mut image, 2, m[0], m[1], [150; 3], 1);
    }
    image
}

fn put(image: &mut RgbImage, pane: u32, x: f64, y: f64, color: [u8; 3], size: i64) {
    let half = f64::from(PANE) / 2.0;
    let (px, py) = ((x * PIXELS_PER_M + half) as i64, (y * PIXELS_PER_M + half) as i64);
    for dx in 0..size {
        for dy in 0..size {
            let (qx, qy) = (px + dx - size / 2, py + dy - size / 2);
            if (0..i64::from(PANE)).contains(&qx) && (0..i64::from(PANE)).contains(&qy) {
                image.put_pixel(pane * PANE + qx as u32, qy as u32, Rgb(color));
            }
        }
    }
}

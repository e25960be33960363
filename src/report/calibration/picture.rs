//! The picture of a drape: its outlines, and the distance between them around the rim.

use image::{Rgb, RgbImage};

use crate::base::units::M_PER_MM;
use crate::calibrate::comparison::Comparison;
use crate::calibrate::measured::Measured;
use crate::picture::draw;

const WHITE: Rgb<u8> = Rgb([255; 3]);
const INK: Rgb<u8> = Rgb([40; 3]);
const FAINT: Rgb<u8> = Rgb([215; 3]);
const MEASURED: Rgb<u8> = Rgb([20, 20, 20]);
const SIMULATED: Rgb<u8> = Rgb([214, 70, 40]);
const WARP: Rgb<u8> = Rgb([40, 110, 200]);
/// Sides of the picture's two halves in pixels.
const SIDE: u32 = 480;
/// Pixels a metre of the plan.
const SCALE: f64 = 1400.0;
/// Distance that reaches half the height of the residual's chart \[m\].
const REACH_M: f64 = 15e-3;

/// The outlines of a drape, and how far the measured one lies outside the simulated one around the
/// rim.
#[must_use]
pub fn picture(measured: &Measured, comparison: &Comparison) -> RgbImage {
    let mut image = RgbImage::from_pixel(2 * SIDE, SIDE + 40, WHITE);
    let middle = f64::from(SIDE) / 2.0;
    let at = |[x, z]: [f64; 2]| [x, z].map(|v| (middle + v * SCALE) as f32);
    let closed = |points: &[[f64; 2]]| -> Vec<[f32; 2]> {
        points.iter().chain(points.first()).map(|&p| at(p)).collect()
    };
    let [px, pz] = comparison.pose.offset_m;
    let radius_m = measured.bench.plate.radius_m;
    let circle: Vec<[f64; 2]> = (0..180)
        .map(|k| f64::from(2 * k).to_radians())
        .map(|t| [px + radius_m * t.cos(), pz + radius_m * t.sin()])
        .collect();
    draw::polyline(&mut image, &closed(&circle), 1.0, FAINT);
    let (sin, cos) = comparison.pose.rotation_rad.sin_cos();
    draw::line(&mut image, at([px, pz]), at([px + 0.04 * cos, pz + 0.04 * sin]), WARP);
    draw::polyline(&mut image, &closed(comparison.measured.points_m()), 2.0, MEASURED);
    draw::polyline(&mut image, &closed(comparison.simulated.points_m()), 1.6, SIMULATED);
    residual_chart(&mut image, comparison);
    let m = &measured.measures;
    let said = format!(
        "{} line {}: {:.2} mm rms; drape coefficient {:.1}, simulated {:.1}; folds {}, simulated {}",
        measured.entry.fabric,
        measured.entry.line,
        comparison.rms_m / M_PER_MM,
        m.drape_coefficient,
        comparison.measures.drape_coefficient,
        m.folds,
        comparison.measures.folds
    );
    draw::text(&mut image, 8, SIDE as i32 + 14, &said, INK);
    draw::text(&mut image, 8, 6, "black: measured, red: simulated, blue: warp", INK);
    image
}

/// On the right half: distance over the bearing from the warp.
fn residual_chart(image: &mut RgbImage, comparison: &Comparison) {
    let (left, width) = (SIDE as f32 + 30.0, SIDE as f32 - 60.0);
    let middle = 0.5 * SIDE as f32;
    let half = middle - 30.0;
    for step in -3..=3 {
        let y = middle - half * step as f32 / 3.0;
        draw::stroke(image, [left, y], [left + width, y], 1.0, FAINT);
        let label = format!("{}", step * 5);
        draw::text(image, left as i32 - 28, y as i32 - 8, &label, INK);
    }
    for quarter in 0..=4 {
        let x = left + width * quarter as f32 / 4.0;
        draw::stroke(image, [x, middle - half], [x, middle + half], 1.0, FAINT);
        draw::text(image, x as i32 - 12, SIDE as i32 - 24, &format!("{}", quarter * 90), INK);
    }
    let title = "measured rim outside simulated rim [mm] over bearing from warp [deg]";
    draw::text(image, left as i32, 6, title, INK);
    for row in &comparison.rows {
        let turn = row.bearing_rad.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let x = left + width * turn as f32;
        let y = middle - half * (row.outwards_m / REACH_M).clamp(-1.0, 1.0) as f32;
        draw::dot(image, [x, y], 2.0, SIMULATED);
    }
}

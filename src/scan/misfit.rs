//! How well the sheet explains the scan: how far surface points lie off it, in one place or
//! everywhere, and how far raw points scatter across it.
//!
//! In: the sheet and the scan's points with their material coordinates, local frame \[m\]. Out:
//! [`Misfit`] and [`Scatter`], which `limits` judges.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::fit::{Raw, RawPoint};
use super::measured::{Misfit, Scatter};
use super::parameterisation::Parameterisation;
use super::sheet::Sheet;
use super::square::Square;
use super::tuning::SheetTuning;
use crate::numeric::robust;

/// Distances of the surface points to the sheet, which is flat within `flat_m` of its middle, and
/// the strain of the sheet, of this side.
pub(super) fn of_surface(
    sheet: &Sheet,
    surface: &Parameterisation,
    material: &[[f64; 2]],
    square: &Square,
    [side_m, flat_m]: [f64; 2],
) -> Misfit {
    let off: Vec<f64> =
        surface.points.iter().zip(material).map(|(p, &m)| (p - sheet.at(m)).norm()).collect();
    let rms =
        |off: &[f64]| (off.iter().map(|d| d * d).sum::<f64>() / off.len().max(1) as f64).sqrt();
    let on_plate = |m: &[f64; 2]| m[0].hypot(m[1]) < flat_m;
    let over_plate: Vec<f64> =
        off.iter().zip(material).filter(|(_, m)| on_plate(m)).map(|(d, _)| *d).collect();
    let worst = (0..off.len()).max_by(|&a, &b| off[a].total_cmp(&off[b]));
    let worst_bearing_deg = worst.map_or(0.0, |worst| square.bearing_deg(material[worst]));
    // The median of the length of three normal deviates is 1.538 of one.
    let typical_m = 3.0_f64.sqrt() / 1.538 * robust::median(off.clone()).unwrap_or(0.0);
    let half_share = half_share(&off, material);
    Misfit {
        rms_m: rms(&off),
        on_plate_m: rms(&over_plate),
        typical_m,
        half_share,
        worst_bearing_deg,
        strain: strain(sheet, side_m),
    }
}

/// The median over the sheet, its edges apart, of the larger principal strain (logarithmic).
fn strain(sheet: &Sheet, side_m: f64) -> f64 {
    /// Places along a side, and the share of the side over which they lie.
    const PLACES: u32 = 41;
    const INNER: f64 = 0.95;
    let step = INNER * side_m / f64::from(PLACES - 1);
    let at = |k: u32| f64::from(k) * step - 0.5 * INNER * side_m;
    let strains = (0..PLACES * PLACES).map(|k| {
        let stretches = sheet.slopes([at(k % PLACES), at(k / PLACES)]).singular_values();
        stretches.iter().map(|stretch| stretch.ln().abs()).fold(0.0, f64::max)
    });
    robust::median(strains.collect()).unwrap_or(0.0)
}

/// Side of the places over which the sheet is judged \[m\].
const PLACE_M: f64 = 25e-3;

/// The place of material coordinates \[m\].
fn place(material: [f64; 2]) -> [i32; 2] {
    material.map(|x| (x / PLACE_M).floor() as i32)
}

/// The share of the sheet's places that hold half of the squared distances: small where the cloth
/// is off in one place, large where it is off everywhere.
fn half_share(off: &[f64], material: &[[f64; 2]]) -> f64 {
    let mut squares = BTreeMap::<[i32; 2], f64>::new();
    for (d, &m) in off.iter().zip(material) {
        *squares.entry(place(m)).or_default() += d * d;
    }
    let mut squares: Vec<f64> = squares.into_values().collect();
    squares.sort_by(|a, b| b.total_cmp(a));
    let (half, mut sum) = (0.5 * squares.iter().sum::<f64>(), 0.0);
    let holds_half = |square: &f64| {
        sum += square;
        sum >= half
    };
    let first = squares.iter().position(holds_half).unwrap_or(0);
    (first + 1) as f64 / squares.len().max(1) as f64
}

/// How far raw points scatter across the sheet, whose middle on the plate is flat within `flat_m`.
/// 0 where too few are seen.
pub(super) fn scatter(
    sheet: &Sheet,
    raw: &Raw,
    material: &[[f64; 2]],
    flat_m: f64,
    tuning: &SheetTuning,
) -> Scatter {
    /// Points of a place that tell its scatter.
    const LEAST: usize = 30;
    let across = |p: &RawPoint| {
        let place_m = p.of_nearest(material);
        let (_, at, slopes) = sheet.near(place_m);
        let across = slopes.column(0).cross(&slopes.column(1));
        (place(place_m), (p.at - at).dot(&across) / across.norm())
    };
    let near = raw.points.par_iter().filter(|p| f64::from(p.distance_m) < tuning.scatter_m);
    let off: Vec<([i32; 2], f64)> = near.map(across).collect();
    let mut places = BTreeMap::<[i32; 2], Vec<f64>>::new();
    for (place, off_m) in off {
        places.entry(place).or_default().push(off_m);
    }
    let (mut on_plate, mut hanging) = (Vec::new(), Vec::new());
    for (place, off) in places.into_iter().filter(|(_, off)| off.len() >= LEAST) {
        let [x, y] = place.map(|k| (f64::from(k) + 0.5) * PLACE_M);
        let is_flat = x.hypot(y) < flat_m;
        let scatter_m = robust::sigma(&off).unwrap_or(0.0);
        if is_flat { on_plate.push(scatter_m) } else { hanging.push(scatter_m) }
    }
    Scatter {
        on_plate_m: robust::median(on_plate).unwrap_or(0.0),
        hanging_m: robust::quantile(hanging, 0.75).unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_squares_lies_in_one_place_of_a_crease_and_in_half_of_them_of_an_even_misfit() {
        let material: Vec<[f64; 2]> = (0..1600)
            .map(|k| [f64::from(k % 40), f64::from(k / 40)].map(|x| (x + 0.5) * 5e-3))
            .collect();
        let even = vec![1e-3; 1600];
        // 8 x 8 places of 5 x 5 points; a sum that rounds may take one more
        assert!((half_share(&even, &material) - 0.5).abs() < 0.02);
        let crease: Vec<f64> = material
            .iter()
            .map(|m| if m[0] < 25e-3 && m[1] < 25e-3 { 1e-2 } else { 1e-3 })
            .collect();
        assert!((half_share(&crease, &material) - 1.0 / 64.0).abs() < 1e-12);
    }
}

//! The uncertainty of the rim: which of its points are observed, and each point's sigma.
//!
//! The sheet may be wrong where layers of cloth touch or where it had to bridge.
//! It then shows one of three signs near the rim: scanned points that it does not
//! explain, a strain that no drape has, or no points under it. A rim point with a
//! sign counts as bridged and its sigma grows.
//!
//! In: the rim, the sheet and all surface points, local frame \[m\]. Out: the rim
//! with its flags and sigmas set.

use super::rim::Rim;
use super::sheet::Sheet;
use super::tuning::UncertaintyTuning;
use crate::base::Point3;
use crate::base::boundary::POINTS_PER_SIDE;
use crate::geom::Neighbours;

/// Surface points and how they relate to the sheet.
pub(super) struct Explained<'a> {
    /// All surface points, also those that were not parameterised.
    pub surface: &'a [Point3],
    /// The parameterised ones.
    pub parameterised: &'a [Point3],
    /// Material coordinates of those on the sheet [m].
    pub material: &'a [[f64; 2]],
    /// Distance between surface points [m].
    pub spacing_m: f64,
    /// Noise of single points [m].
    pub noise_m: f64,
    /// What the noise leaves of itself on the smoothed surface, seen over the plate [m].
    pub on_plate_m: f64,
    /// Standard error of the frame's origin [m].
    pub origin_sigma_m: f64,
    /// Standard error of the edge's place, common to all sides [m].
    pub edge_sigma_m: f64,
    /// The constants.
    pub tuning: &'a UncertaintyTuning,
}

/// Scanned cloth that the sheet does not explain, around the rim point with most of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unexplained {
    /// Its area \[m^2\].
    pub area_m2: f64,
    /// The point's number.
    pub rim_point: usize,
    /// Distance between the points that it is counted in \[m\].
    pub spacing_m: f64,
}

/// Sets flags and sigmas of the rim's points.
pub(super) fn assess(rim: &mut Rim, sheet: &Sheet, points: &Explained, half_m: f64) -> Unexplained {
    let tuning = points.tuning;
    let bound = tuning.unexplained_m + points.noise_m;
    let curvature_per_m = curvature_per_m(rim);
    let folds_sigma_m =
        tuning.folds_sigma_m * (curvature_per_m / tuning.folds_curvature_per_m).powi(2);
    let views_sigma_m = tuning.views_sigma_m
        * (points.noise_m / (points.noise_m + tuning.views_noise_m)).powi(2)
        * (1.0 + curvature_per_m / tuning.doubling_curvature_per_m);
    let sheet_sigma_m = sheet_sigma_m(curvature_per_m, points.on_plate_m, tuning);
    let views_sigma_m = views_sigma_m.max(sheet_sigma_m);
    // Everything on the sheet, so that a surface point can ask how far it is off.
    let step = 2.5e-3;
    let count = (2.0 * half_m / step).round() as i32;
    let samples: Vec<Point3> = (0..=count)
        .flat_map(|i| (0..=count).map(move |k| (i, k)))
        .map(|(i, k)| sheet.at([f64::from(i) * step - half_m, f64::from(k) * step - half_m]))
        .collect();
    let on_sheet = Neighbours::new(&samples);
    let all = Neighbours::new(points.surface);
    let own = Neighbours::new(points.parameterised);
    let spacing_m = points.spacing_m;
    let mut most = Unexplained { area_m2: 0.0, rim_point: 0, spacing_m };
    for (index, (point, &m)) in rim.points.iter_mut().zip(&rim.material).enumerate() {
        let at = point.position_m;
        let near = all.within(&at, tuning.around_m);
        let off =
            |p: &Point3| on_sheet.one(p).is_none_or(|near| near.distance() > bound + 0.7 * step);
        let unexplained = near.iter().filter(|&&i| off(&points.surface[i])).count() as f64;
        let area_m2 = unexplained * points.spacing_m.powi(2);
        if area_m2 > most.area_m2 {
            most = Unexplained { area_m2, rim_point: index, spacing_m };
        }
        let mine = own.within(&at, tuning.around_m);
        let support = mine
            .iter()
            .filter(|&&i| {
                (points.material[i][0] - m[0]).hypot(points.material[i][1] - m[1])
                    < 1.2 * tuning.around_m
            })
            .count() as f64;
        let wanted = 0.5 * std::f64::consts::PI * (tuning.around_m / points.spacing_m).powi(2);
        let inside = [m[0] * (1.0 - 6e-3 / half_m), m[1] * (1.0 - 6e-3 / half_m)];
        let strained = [m, inside].iter().any(|&place| is_strained(sheet, place, tuning));
        // A corner has a quarter disc of cloth around it.
        let corner = m[0].abs().min(m[1].abs()) > half_m - tuning.around_m;
        let wanted = if corner { 0.5 * wanted } else { wanted };
        let trusted = !strained
            && unexplained <= tuning.max_unexplained * near.len() as f64
            && support > tuning.min_support * wanted;
        point.observed &= trusted;
        let variance = (tuning.posterior_share * point.sigma_m).powi(2)
            + tuning.rotation_sigma_m.powi(2)
            + folds_sigma_m.powi(2)
            + views_sigma_m.powi(2)
            + points.origin_sigma_m.powi(2)
            + points.edge_sigma_m.powi(2) / 3.0;
        point.sigma_m = variance.sqrt();
    }
    widen_bridges(rim, points.noise_m, tuning);
    most
}

/// What the sheet is off by across the cloth that no number of points averages out: views that
/// disagree and noise that is smooth over several points show over the plate, where the cloth is
/// smooth, and move the sheet the more the sharper its folds are \[m\].
pub(super) fn sheet_sigma_m(
    curvature_per_m: f64,
    on_plate_m: f64,
    tuning: &UncertaintyTuning,
) -> f64 {
    tuning.on_plate_share * on_plate_m * (1.0 + curvature_per_m / tuning.doubling_curvature_per_m)
}

/// Whether the sheet has a strain at a place that no drape has.
fn is_strained(sheet: &Sheet, place: [f64; 2], tuning: &UncertaintyTuning) -> bool {
    let values = sheet.slopes(place).singular_values();
    values.max() > tuning.stretches[1] || values.min() < tuning.stretches[0]
}

/// Root mean square curvature of the rim's sides \[1/m\].
pub(super) fn curvature_per_m(rim: &Rim) -> f64 {
    let squares: Vec<f64> = rim
        .points
        .chunks_exact(POINTS_PER_SIDE)
        .zip(rim.side_lengths_m)
        .flat_map(|(side, length_m)| {
            let step_m = length_m / (POINTS_PER_SIDE - 1) as f64;
            side.windows(3).map(move |p| {
                let [before, at, after] = [0, 1, 2].map(|k| p[k].position_m.coords);
                ((before + after - at * 2.0) / step_m.powi(2)).norm_squared()
            })
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Adds what bridging costs to the sigmas of the points that were not observed.
fn widen_bridges(rim: &mut Rim, noise_m: f64, tuning: &UncertaintyTuning) {
    let count = rim.points.len();
    let step_m = rim.side_lengths_m.iter().sum::<f64>() / count as f64;
    let observed: Vec<bool> = rim.points.iter().map(|p| p.observed).collect();
    for (i, point) in rim.points.iter_mut().enumerate().filter(|(i, _)| !observed[*i]) {
        let away = |d: &usize| observed[(i + d) % count] || observed[(i + count - d) % count];
        let steps = (1..=count / 2).find(away).unwrap_or(count / 2);
        let bridge =
            tuning.bridged_share * steps as f64 * step_m + tuning.bridged_noise_share * noise_m;
        point.sigma_m = point.sigma_m.hypot(bridge);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tuning::Tuning;
    use super::*;
    use crate::base::BoundaryPoint;

    /// A rim whose sides are arcs of so much curvature \[1/m\].
    fn rim(curvature_per_m: f64) -> Rim {
        let side_m = 0.3;
        let step_rad = side_m / (POINTS_PER_SIDE - 1) as f64 * curvature_per_m;
        let point = |k: usize| {
            let turn = k as f64 * step_rad;
            let at = Point3::new(turn.cos() / curvature_per_m, turn.sin() / curvature_per_m, 0.0);
            BoundaryPoint { position_m: at, sigma_m: 0.0, observed: true }
        };
        let points: Vec<BoundaryPoint> =
            (0..4).flat_map(|_| (0..POINTS_PER_SIDE).map(point)).collect();
        let material = vec![[0.0; 2]; points.len()];
        Rim { points, material, side_lengths_m: [side_m; 4], edge_m: [0.0; 4] }
    }

    #[test]
    fn a_sheet_is_as_unsure_as_the_plate_is_rough_and_more_so_where_folds_are_sharp() {
        let tuning = Tuning::default().uncertainty;
        let sigma_m =
            |per_m, on_plate_m| sheet_sigma_m(curvature_per_m(&rim(per_m)), on_plate_m, &tuning);
        let flat_m = tuning.on_plate_share * 0.1e-3;
        assert!((sigma_m(1e-3, 0.1e-3) / flat_m - 1.0).abs() < 1e-3);
        let doubling = tuning.doubling_curvature_per_m;
        assert!((sigma_m(doubling, 0.3e-3) / (6.0 * flat_m) - 1.0).abs() < 0.03);
    }
}

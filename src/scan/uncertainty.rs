//! The uncertainty of the rim: which of its points are observed, and each point's sigma.
//!
//! The sheet may be wrong where layers of cloth touch or where it had to bridge.
//! It then shows one of three signs near the rim: scanned points that it does not
//! explain, a strain that no drape has, or no points under it. A rim point with a
//! sign counts as bridged and its sigma grows.
//!
//! In: the rim, the sheet and all surface points, local frame \[m\]. Out: the rim
//! with its flags and sigmas set.

use super::neighbours::Neighbours;
use super::rim::Rim;
use super::sheet::Sheet;
use crate::base::Point3;
use crate::base::boundary::POINTS_PER_SIDE;

/// Points farther off the sheet than this are not explained by it [m], plus the
/// noise of smoothed points.
const UNEXPLAINED_M: f64 = 2.0e-3;
/// Radius around a rim point in which points count [m].
const AROUND_M: f64 = 12e-3;
/// Largest share of unexplained points among them.
const MAX_UNEXPLAINED: f64 = 0.2;
/// Principal stretches accepted. Empirical: the softest knit of the paper's range
/// stretches 7 % under its own weight; the fit adds some.
const STRETCHES: [f64; 2] = [0.85, 1.15];
/// Least number of surface points around a rim point, in cells of the downsampled
/// cloth on the half disc of cloth there.
const MIN_SUPPORT: f64 = 0.3;
/// Standard deviation added where the rim is bridged: this share of the distance to
/// the next observed point, and this share of the noise. This and all below:
/// empirical, from `evaluate scan`, whose `sigma_factor` columns must be near 1.
const BRIDGED_SHARE: f64 = 0.04;
const BRIDGED_NOISE_SHARE: f64 = 0.15;
/// What folds cost in smoothing and parameterising: the standard deviation at a root mean
/// square curvature of the rim of 40 / m [m], growing with its square.
const FOLDS_SIGMA_M: f64 = 0.03e-3;
const FOLDS_CURVATURE_PER_M: f64 = 40.0;
/// What the cloth's rotation on the plate is off by, 0.05 degrees at the rim [m].
const ROTATION_SIGMA_M: f64 = 0.06e-3;
/// What the views disagree by does not average out over the points of a place: the
/// standard deviation that it tends to on a straight rim [m], by the square of
/// noise / (noise + this) [m], and the curvature that doubles it [1/m]: the sharper the
/// folds, the more a shifted view moves the sheet.
const VIEWS_SIGMA_M: f64 = 1.04e-3;
const VIEWS_NOISE_M: f64 = 0.6e-3;
const DOUBLING_CURVATURE_PER_M: f64 = 150.0;
/// Share of the sheet's posterior deviation that counts: it takes downsampled points as
/// as noisy as single ones.
const POSTERIOR_SHARE: f64 = 0.5;

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
    /// Standard error of the frame's origin [m].
    pub origin_sigma_m: f64,
    /// Standard error of the edge's place, common to all sides [m].
    pub edge_sigma_m: f64,
}

/// Scanned cloth that the sheet does not explain, around the rim point with most of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unexplained {
    /// Its area \[m^2\].
    pub area_m2: f64,
    /// The point's number.
    pub rim_point: usize,
}

/// Sets flags and sigmas of the rim's points.
pub(super) fn assess(rim: &mut Rim, sheet: &Sheet, points: &Explained, half_m: f64) -> Unexplained {
    let bound = UNEXPLAINED_M + points.noise_m;
    let curvature_per_m = curvature_per_m(rim);
    let folds_sigma_m = FOLDS_SIGMA_M * (curvature_per_m / FOLDS_CURVATURE_PER_M).powi(2);
    let views_sigma_m = VIEWS_SIGMA_M
        * (points.noise_m / (points.noise_m + VIEWS_NOISE_M)).powi(2)
        * (1.0 + curvature_per_m / DOUBLING_CURVATURE_PER_M);
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
    let mut most = Unexplained { area_m2: 0.0, rim_point: 0 };
    for (index, (point, &m)) in rim.points.iter_mut().zip(&rim.material).enumerate() {
        let at = point.position_m;
        let near = all.within(&at, AROUND_M);
        let off =
            |p: &Point3| on_sheet.one(p).is_none_or(|near| near.distance() > bound + 0.7 * step);
        let unexplained = near.iter().filter(|&&i| off(&points.surface[i])).count() as f64;
        let area_m2 = unexplained * points.spacing_m.powi(2);
        if area_m2 > most.area_m2 {
            most = Unexplained { area_m2, rim_point: index };
        }
        let mine = own.within(&at, AROUND_M);
        let support = mine
            .iter()
            .filter(|&&i| {
                (points.material[i][0] - m[0]).hypot(points.material[i][1] - m[1]) < 1.2 * AROUND_M
            })
            .count() as f64;
        let wanted = 0.5 * std::f64::consts::PI * (AROUND_M / points.spacing_m).powi(2);
        let inside = [m[0] * (1.0 - 6e-3 / half_m), m[1] * (1.0 - 6e-3 / half_m)];
        let strained = [m, inside].iter().any(|&place| {
            let values = sheet.slopes(place).singular_values();
            values.max() > STRETCHES[1] || values.min() < STRETCHES[0]
        });
        // A corner has a quarter disc of cloth around it.
        let corner = m[0].abs().min(m[1].abs()) > half_m - AROUND_M;
        let wanted = if corner { 0.5 * wanted } else { wanted };
        let trusted = !strained
            && unexplained <= MAX_UNEXPLAINED * near.len() as f64
            && support > MIN_SUPPORT * wanted;
        point.observed &= trusted;
        let variance = (POSTERIOR_SHARE * point.sigma_m).powi(2)
            + ROTATION_SIGMA_M.powi(2)
            + folds_sigma_m.powi(2)
            + views_sigma_m.powi(2)
            + points.origin_sigma_m.powi(2)
            + points.edge_sigma_m.powi(2) / 3.0;
        point.sigma_m = variance.sqrt();
    }
    widen_bridges(rim, points.noise_m);
    most
}

/// Root mean square curvature of the rim's sides \[1/m\].
fn curvature_per_m(rim: &Rim) -> f64 {
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
fn widen_bridges(rim: &mut Rim, noise_m: f64) {
    let count = rim.points.len();
    let step_m = rim.side_lengths_m.iter().sum::<f64>() / count as f64;
    let observed: Vec<bool> = rim.points.iter().map(|p| p.observed).collect();
    for (i, point) in rim.points.iter_mut().enumerate().filter(|(i, _)| !observed[*i]) {
        let away = |d: &usize| observed[(i + d) % count] || observed[(i + count - d) % count];
        let steps = (1..=count / 2).find(away).unwrap_or(count / 2);
        let bridge = BRIDGED_SHARE * steps as f64 * step_m + BRIDGED_NOISE_SHARE * noise_m;
        point.sigma_m = point.sigma_m.hypot(bridge);
    }
}

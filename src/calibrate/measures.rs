//! What is counted on an outline, measured or simulated: drape coefficient, folds, Fourier
//! amplitudes.
//!
//! In: an outline \[m\], specimen and plate. Out: numbers. All of them go by the distance of the
//! outline from its own centroid over the bearing, so that they need neither the plate's centre nor
//! the specimen's orientation; where a ray meets the outline more than once, the farthest point
//! counts.

use crate::base::Outline;
use crate::sim::Experiment;
use crate::sim::experiment::{Outline as Cut, Specimen};

/// Bearings at which the distance is taken: one a degree.
pub const BEARINGS: usize = 360;
/// Order of the highest Fourier amplitude.
pub const ORDERS: usize = 16;

/// How folds are counted: the maxima of the smoothed distance that rise by at least the prominence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldRule {
    /// Width of the moving mean \[degrees\].
    pub smoothing: usize,
    /// Least prominence of a maximum \[m\].
    pub prominence_m: f64,
}

impl Default for FoldRule {
    /// The rule of the index of the measured silhouettes, whose pixels are 1.39 mm.
    fn default() -> Self {
        Self { smoothing: 13, prominence_m: 1.39e-3 }
    }
}

/// What is counted on an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct Measures {
    /// Drape coefficient: the part of the ring around the plate that the outline covers \[%\].
    pub drape_coefficient: f64,
    /// Number of folds.
    pub folds: usize,
    /// Amplitudes of the harmonics 1 to 16 of the distance over the bearing \[m\].
    pub amplitudes_m: [f64; ORDERS],
    /// Bearing of the first maximum of harmonics 1 to 16, from +x towards +z \[rad\].
    pub phases_rad: [f64; ORDERS],
    /// Mean distance from the centroid \[m\].
    pub mean_m: f64,
}

impl Measures {
    /// Of an outline in an experiment with a disc.
    #[must_use]
    pub fn of(outline: &Outline, experiment: &Experiment, rule: &FoldRule) -> Self {
        let distance = distances_m(outline, outline.centroid_m());
        let harmonics = harmonics(&distance);
        Self {
            drape_coefficient: drape_coefficient(outline.area_m2(), experiment),
            folds: folds(&distance, rule),
            amplitudes_m: harmonics.map(|[amplitude, _]| amplitude),
            phases_rad: harmonics.map(|[_, phase]| phase),
            mean_m: distance.iter().sum::<f64>() / BEARINGS as f64,
        }
    }
}

/// The drape coefficient \[%\] of a drape that covers `area_m2` from above: of a disc, or of a
/// square by the same formula.
#[must_use]
pub fn drape_coefficient(area_m2: f64, experiment: &Experiment) -> f64 {
    let disc = |radius: f64| std::f64::consts::PI * radius * radius;
    let plate = disc(experiment.plate.radius_m);
    let Specimen { outline, warp_m, weft_m, .. } = experiment.specimen;
    let specimen = match outline {
        Cut::Disc => disc(0.5 * weft_m),
        Cut::Rectangle => warp_m * weft_m,
    };
    100.0 * (area_m2 - plate) / (specimen - plate)
}

/// Farthest distance of the outline from `centre` at each of [`BEARINGS`] bearings, from +x towards
/// +z \[m\]; 0 where a ray does not meet it.
#[must_use]
pub fn distances_m(outline: &Outline, centre: [f64; 2]) -> Vec<f64> {
    farthest_m(outline.segments(), centre)
}

/// The same of segments in any order.
#[must_use]
pub fn farthest_m(segments: impl Iterator<Item = [[f64; 2]; 2]>, centre: [f64; 2]) -> Vec<f64> {
    let mut farthest = vec![0.0_f64; BEARINGS];
    let step = std::f64::consts::TAU / BEARINGS as f64;
    for [a, b] in segments {
        let (a, b) = ([a[0] - centre[0], a[1] - centre[1]], [b[0] - centre[0], b[1] - centre[1]]);
        each_bearing(a, b, step, |bearing, distance, _| {
            let at = bearing.rem_euclid(BEARINGS as isize) as usize;
            farthest[at] = farthest[at].max(distance);
        });
    }
    farthest
}

/// Calls `meet` with each whole multiple of `step` (its number, not reduced), the distance from the
/// origin and the fraction of the segment from `a` to `b`, where the segment crosses that bearing.
pub(super) fn each_bearing(
    a: [f64; 2],
    b: [f64; 2],
    step: f64,
    mut meet: impl FnMut(isize, f64, f64),
) {
    let start = a[1].atan2(a[0]);
    let twice = a[0] * b[1] - b[0] * a[1];
    let swept = twice.atan2(a[0] * b[0] + a[1] * b[1]);
    let (low, high) = if swept < 0.0 { (start + swept, start) } else { (start, start + swept) };
    let (first, last) = ((low / step).ceil() as isize, (high / step).floor() as isize);
    for k in first..=last {
        let (sin, cos) = (k as f64 * step).sin_cos();
        // distances of the ends from the ray
        let (da, db) = (a[1] * cos - a[0] * sin, b[1] * cos - b[0] * sin);
        if da != db {
            let part = (da / (da - db)).clamp(0.0, 1.0);
            let at = [0, 1].map(|c| a[c] + (b[c] - a[c]) * part);
            meet(k, at[0] * cos + at[1] * sin, part);
        }
    }
}

/// Number of maxima of a closed row of distances \[m\].
#[must_use]
pub fn folds(distances: &[f64], rule: &FoldRule) -> usize {
    let n = distances.len();
    let width = rule.smoothing.max(1);
    let mean = |i: usize| {
        (0..width).map(|k| distances[(i + n + k - width / 2) % n]).sum::<f64>() / width as f64
    };
    let smooth: Vec<f64> = (0..n).map(mean).collect();
    (0..n).filter(|&i| prominence(&smooth, i) >= rule.prominence_m).count()
}

/// How far a closed row rises at `i` above the higher of the two lowest places between it and
/// higher ground; 0 where `i` is no maximum. The highest place of all rises above the lowest.
fn prominence(row: &[f64], i: usize) -> f64 {
    let n = row.len();
    // of equal neighbours the first one is the maximum
    if row[(i + n - 1) % n] >= row[i] || row[(i + 1) % n] > row[i] {
        return 0.0;
    }
    let col = |step: usize| {
        let mut lowest = row[i];
        for k in 1..n {
            let value = row[(i + k * step) % n];
            if value > row[i] {
                return Some(lowest);
            }
            lowest = lowest.min(value);
        }
        None
    };
    let lowest = row.iter().copied().fold(f64::INFINITY, f64::min);
    row[i] - col(1).into_iter().chain(col(n - 1)).fold(lowest, f64::max)
}

/// Amplitude \[m\] and bearing of the first maximum \[rad\] of the harmonics 1 to 16.
fn harmonics(distances: &[f64]) -> [[f64; 2]; ORDERS] {
    let n = distances.len() as f64;
    std::array::from_fn(|k| {
        let order = (k + 1) as f64;
        let angle = |i: usize| order * std::f64::consts::TAU * i as f64 / n;
        let sums = distances.iter().enumerate().fold([0.0; 2], |[c, s], (i, r)| {
            let (sin, cos) = angle(i).sin_cos();
            [c + r * cos, s + r * sin]
        });
        let phase = sums[1].atan2(sums[0]).rem_euclid(std::f64::consts::TAU) / order;
        [2.0 * sums[0].hypot(sums[1]) / n, phase]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(rho: impl Fn(f64) -> f64) -> Outline {
        let point = |k: usize| {
            let theta = std::f64::consts::TAU * k as f64 / 2000.0;
            [0.3 + rho(theta) * theta.cos(), 0.4 + rho(theta) * theta.sin()]
        };
        Outline::new((0..2000).map(point).collect()).unwrap()
    }

    #[test]
    fn a_wavy_outline_has_its_folds_amplitudes_and_coefficient() {
        let (bench, rule) = (Experiment::standard_cusick(), FoldRule::default());
        let outline = curve(|t| 0.12 + 8e-3 * (7.0 * t - 2.1).cos());
        let m = Measures::of(&outline, &bench, &rule);
        assert_eq!(m.folds, 7);
        assert!((m.amplitudes_m[6] - 8e-3).abs() < 1e-5 && (m.phases_rad[6] - 0.3).abs() < 1e-3);
        let rest = m.amplitudes_m.iter().enumerate().filter(|(k, _)| *k != 6).map(|(_, a)| *a);
        assert!(rest.fold(0.0, f64::max) < 1e-5);
        assert!((m.mean_m - 0.12).abs() < 1e-6);
        let area = std::f64::consts::PI * (0.12_f64.powi(2) + 0.5 * 8e-3_f64.powi(2));
        let exact = 100.0 * (area / std::f64::consts::PI - 0.0081) / (0.0225 - 0.0081);
        assert!((m.drape_coefficient - exact).abs() < 1e-3);
        let flat = Measures::of(&curve(|_| 0.15), &bench, &rule);
        assert!((flat.drape_coefficient - 100.0).abs() < 1e-3 && flat.folds == 0);
    }

    #[test]
    fn folds_are_maxima_with_prominence_and_no_harmonic() {
        let rule = FoldRule { smoothing: 1, prominence_m: 1e-3 };
        let count = |rho: &dyn Fn(f64) -> f64| {
            let row: Vec<f64> = (0..360).map(|k| rho(f64::from(k).to_radians())).collect();
            folds(&row, &rule)
        };
        // a shoulder of less than the prominence on each of five folds is no fold, one of more is
        let two = |small: f64| move |t: f64| 0.01 * (5.0 * t).cos() + small * (10.0 * t).cos();
        assert_eq!(count(&two(0.0)), 5);
        assert_eq!(count(&two(2.6e-3)), 5);
        assert_eq!(count(&two(0.01)), 10);
        assert_eq!(count(&|_| 0.1), 0);
        // one maximum is prominent over the lowest place
        assert_eq!(count(&|t| 0.01 * t.cos()), 1);
        assert_eq!(count(&|t| 0.4e-3 * t.cos()), 0);
    }

    #[test]
    fn the_farthest_of_several_crossings_counts() {
        // a fold that overhangs its own root
        let bent = |t: f64| [t + 0.9 * (6.0 * t).sin() / 6.0 * 1.6, 0.1 + 0.02 * (6.0 * t).cos()];
        let points = (0..3000).map(|k| bent(std::f64::consts::TAU * f64::from(k) / 3000.0));
        let polar: Vec<[f64; 2]> = points.map(|[t, r]| [r * t.cos(), r * t.sin()]).collect();
        let outline = Outline::new(polar.clone()).unwrap();
        let distance = distances_m(&outline, [0.0; 2]);
        for p in polar {
            let bearing = p[1].atan2(p[0]).to_degrees().round().rem_euclid(360.0) as usize % 360;
            let near = (0..3).map(|k| distance[(bearing + 359 + k) % 360]).fold(0.0, f64::max);
            assert!(near > p[0].hypot(p[1]) - 2e-3, "{bearing}");
        }
    }
}

//! The free edge, measured in material coordinates.
//!
//! The rim of the parameterised cloth is nearly four straight lines, however deep the
//! folds in space: this is where it can be measured well. Every 5 mm along a side
//! a strip of raw points across the edge is compared with a density that is even
//! inside and drops at the edge e, blurred by the noise s, over a thin even
//! background of strays:
//!   f(w | e)  ~  Phi((e - w) / s) + b.
//! The estimate is the posterior mean of e, which is free of the bias that the
//! outermost point has for sparse points. Then a stiff smoothing spline runs along
//! the side; strips where the cloth is not seen up to the edge do not count and
//! are filled by it.
//!
//! In: raw points as (along, outward) pairs of each side \[m\]. Out: the edge's
//! outward coordinate as a function of the along coordinate, with its sigma.

use rayon::prelude::*;

use super::sides::to_side;
use super::tuning::{EdgeTuning, Look};
use crate::base::boundary::SIDES;
use crate::numeric::robust;

/// Steps of 0.1 mm between the places of the coarse look for a strip's edge.
const COARSE_STEPS: usize = 6;
/// Standard deviations of the blur beyond which it is whole or nothing, to 1e-10.
const BLURRED: f64 = 6.0;

/// The edge of one side.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// Distance between the strips \[m\].
    pub station_m: f64,
    /// Along coordinate of the strips \[m\].
    pub along: Vec<f64>,
    /// Outward coordinate, smoothed \[m\].
    pub outward: Vec<f64>,
    /// Its standard deviation \[m\].
    pub sigma: Vec<f64>,
    /// Whether the edge was seen in the strip.
    pub observed: Vec<bool>,
}

impl Edge {
    fn locate(&self, along: f64) -> (usize, f64) {
        let s = ((along - self.along[0]) / self.station_m)
            .clamp(0.0, (self.along.len() - 1) as f64 - 1e-9);
        (s as usize, s.fract())
    }

    /// Outward coordinate at an along coordinate.
    pub fn outward_at(&self, along: f64) -> f64 {
        let (k, t) = self.locate(along);
        self.outward[k] * (1.0 - t) + self.outward[k + 1] * t
    }

    /// Mean outward coordinate where it was observed (everywhere if nowhere).
    pub fn mean_m(&self) -> f64 {
        let seen: Vec<f64> =
            self.outward.iter().zip(&self.observed).filter(|p| *p.1).map(|p| *p.0).collect();
        let list = if seen.is_empty() { &self.outward } else { &seen };
        list.iter().sum::<f64>() / list.len() as f64
    }

    /// Moves the whole edge outward.
    pub fn shift(&mut self, by_m: f64) {
        self.outward.iter_mut().for_each(|w| *w += by_m);
    }

    /// Standard deviation there.
    pub fn sigma_at(&self, along: f64) -> f64 {
        let (k, t) = self.locate(along);
        self.sigma[k] * (1.0 - t) + self.sigma[k + 1] * t
    }

    /// Whether the nearest strip saw the edge.
    pub fn observed_at(&self, along: f64) -> bool {
        let (k, t) = self.locate(along);
        self.observed[if t < 0.5 { k } else { k + 1 }]
    }
}

/// The edge as one strip shows it.
#[derive(Clone, Copy, Debug)]
struct StripEdge {
    /// Posterior mean, outward of the nominal edge [m].
    outward_m: f64,
    /// Posterior standard deviation [m].
    sigma_m: f64,
}

/// The edge of a side that need not be straight yet, from downsampled points.
pub(super) fn measure_bent(points: &[[f64; 2]], half_m: f64, tuning: &EdgeTuning) -> Edge {
    measure_with(points, half_m, tuning.first_blur_m, tuning.first, tuning)
}

/// Measures one side; `points` are (along, outward), `half_m` half the side,
/// `blur_m` the noise in the sheet's plane.
fn measure(points: &[[f64; 2]], half_m: f64, blur_m: f64, tuning: &EdgeTuning) -> Edge {
    measure_with(points, half_m, blur_m, tuning.measure, tuning)
}

/// Edges of the four sides from material coordinates of raw points near them.
pub(super) fn measure_sides(
    material: &[[f64; 2]],
    half_m: f64,
    blur_m: f64,
    tuning: &EdgeTuning,
) -> [Edge; SIDES] {
    std::array::from_fn(|side| {
        let points: Vec<[f64; 2]> = material.iter().map(|&m| to_side(side, m)).collect();
        measure(&points, half_m, blur_m, tuning)
    })
}

fn measure_with(
    points: &[[f64; 2]],
    half_m: f64,
    blur_m: f64,
    look: Look,
    tuning: &EdgeTuning,
) -> Edge {
    let (station_m, strip_half_m) = (tuning.station_m, tuning.strip_half_m);
    let strips = (2.0 * half_m / station_m).round() as usize + 1;
    let along: Vec<f64> = (0..strips).map(|k| k as f64 * station_m - half_m).collect();
    let mut across: Vec<Vec<f64>> = vec![Vec::new(); strips];
    let window = (-look.inward_m, look.outward_m);
    for p in points {
        let w = p[1] - half_m;
        if w < window.0 || w > window.1 {
            continue;
        }
        let from = ((p[0] - strip_half_m + half_m) / station_m).ceil().max(0.0) as usize;
        for (k, list) in across.iter_mut().enumerate().skip(from) {
            if along[k] > p[0] + strip_half_m {
                break;
            }
            list.push(w);
        }
    }
    // Points per strip within the inner 6 mm, where the cloth surely is.
    let inner_range = -look.inward_m..-look.inward_m + 6e-3;
    let inner = |list: &Vec<f64>| list.iter().filter(|w| inner_range.contains(*w)).count() as f64;
    let usual =
        robust::median(across.iter().map(inner).filter(|n| *n > 0.0).collect()).unwrap_or(0.0);
    let found: Vec<Option<StripEdge>> = across
        .par_iter()
        .map(|list| {
            (inner(list) >= (tuning.least_inner * usual).max(4.0))
                .then(|| strip_edge(list, blur_m, look, tuning))
                .flatten()
        })
        .collect();
    smooth(along, &found, half_m, look, tuning)
}

/// The edge in one strip, if it is there.
fn strip_edge(across: &[f64], blur_m: f64, look: Look, tuning: &EdgeTuning) -> Option<StripEdge> {
    /// A place where the edge may be, its log-likelihood, and how many steps it stands for.
    struct Place {
        k: usize,
        log: f64,
        width: f64,
    }
    // More points do not help: the strip's edge is not that straight. So quantiles stand for them.
    let mut across = across.to_vec();
    across.sort_unstable_by(f64::total_cmp);
    let stride = across.len().div_ceil(tuning.most_points).max(1);
    let across: Vec<f64> = across.into_iter().skip(stride / 2).step_by(stride).collect();
    let (low, high) = (-look.inward_m, look.outward_m);
    let step = 0.1e-3;
    let first = low + 4e-3;
    let count = ((high - 2e-3 - first) / step) as usize;
    let (blur, background) = (blur_m.max(tuning.least_blur_m), tuning.background);
    let log_of = |e: f64| -> f64 {
        let mass = (e - low) + background * (high - low);
        // Away from the edge a point's density is that of the cloth or of the strays.
        let inside = across.partition_point(|w| e - w > BLURRED * blur);
        let blurred = across.partition_point(|w| e - w > -BLURRED * blur);
        let near = across[inside..blurred].iter();
        near.map(|w| (normal_share((e - w) / blur) + background).ln()).sum::<f64>()
            + inside as f64 * background.ln_1p()
            + (across.len() - blurred) as f64 * background.ln()
            - across.len() as f64 * mass.ln()
    };
    let place =
        |width: f64| move |k: usize| Place { k, log: log_of(first + k as f64 * step), width };
    // A coarse look finds the peak, a fine one its shape. Far from the peak one coarse
    // place stands for all that it skips.
    let mut coarse: Vec<Place> =
        (0..count).step_by(COARSE_STEPS).map(place(COARSE_STEPS as f64)).collect();
    let peak = coarse.iter().max_by(|a, b| a.log.total_cmp(&b.log))?.k;
    let near = peak.saturating_sub(3 * COARSE_STEPS)..(peak + 3 * COARSE_STEPS + 1).min(count);
    coarse.retain(|place| !near.contains(&place.k));
    let places: Vec<Place> = near.map(place(1.0)).chain(coarse).collect();
    let top = places.iter().map(|place| place.log).fold(f64::NEG_INFINITY, f64::max);
    let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
    for Place { k, log, width } in places {
        let (p, e) = (width * (log - top).exp(), first + k as f64 * step);
        total += p;
        mean += p * e;
        square += p * e * e;
    }
    let mean = mean / total;
    let variance = (square / total - mean * mean).max(step * step / 12.0);
    // At the ends of the search the edge is not in the strip.
    ((first + 0.5e-3..high - 2.5e-3).contains(&mean))
        .then(|| StripEdge { outward_m: mean, sigma_m: variance.sqrt() })
}

/// The normal distribution's cumulative share, to 1e-4 (logistic-type
/// approximation, Bowling et al. 2009).
fn normal_share(x: f64) -> f64 {
    1.0 / (1.0 + (-x * (1.5976 + 0.070_56 * x * x)).exp())
}

/// Whittaker smoothing (second differences) with robust weights.
fn smooth(
    along: Vec<f64>,
    found: &[Option<StripEdge>],
    half_m: f64,
    look: Look,
    tuning: &EdgeTuning,
) -> Edge {
    let n = along.len();
    let mut observed: Vec<bool> = found.iter().map(Option::is_some).collect();
    let mut line = vec![0.0; n];
    let mut sigma = vec![f64::INFINITY; n];
    for round in 0..6 {
        let mut matrix = crate::numeric::banded::Banded::zeros(n, 2);
        let mut right = vec![0.0; n];
        for k in 0..n {
            // A faint pull to the nominal edge keeps an unseen side defined.
            matrix.add(k, k, 1.0 / tuning.nominal_sigma_m.powi(2));
            if let (Some(StripEdge { outward_m: e, sigma_m }), true) = (found[k], observed[k]) {
                let s = sigma_m.max(0.1e-3);
                let off = if round == 0 { e } else { e - line[k] };
                let weight = 1.0 / (s * s) / (1.0 + (off / tuning.robust_m).powi(2));
                matrix.add(k, k, weight);
                right[k] += weight * e;
            }
            if k + 2 < n {
                let stencil = [(k, 1.0), (k + 1, -2.0), (k + 2, 1.0)];
                for (a, x) in stencil.iter().enumerate() {
                    for y in &stencil[..=a] {
                        matrix.add(x.0, y.0, x.1 * y.1 / look.bend_m.powi(2));
                    }
                }
            }
        }
        let Some(factor) = matrix.cholesky() else { break };
        factor.solve(&mut right);
        line = right;
        for k in 0..n {
            sigma[k] = factor.inverse_form(&[(k, 1.0)]).sqrt();
            observed[k] = found[k].is_some_and(|f| (f.outward_m - line[k]).abs() < look.off_line_m);
        }
    }
    let outward = line.iter().map(|w| w + half_m).collect();
    Edge { station_m: tuning.station_m, along, outward, sigma, observed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt as _;
    use rand_distr::{Distribution, Normal};

    fn shipped() -> EdgeTuning {
        crate::scan::tuning::Tuning::default().edge
    }

    /// Random points on 300 mm of cloth whose edge lies at 151 mm.
    fn strip(per_mm2: f64, noise_m: f64, seed: u64) -> Vec<[f64; 2]> {
        let mut rng = crate::base::seed::rng(seed, "edge", 0);
        let noise = Normal::new(0.0, noise_m).unwrap();
        let count = (300.0 * 31.0 * per_mm2) as usize;
        (0..count)
            .map(|_| {
                let w = 0.12 + 0.031 * rng.random::<f64>() + noise.sample(&mut rng);
                [0.3 * rng.random::<f64>() - 0.15, w]
            })
            .collect()
    }

    #[test]
    fn edge_is_unbiased_over_noise_and_density() {
        for (per_mm2, noise_m, bias_m) in [
            (3.0, 0.15e-3, 0.05e-3),
            (1.0, 0.15e-3, 0.1e-3),
            (1.0, 1e-3, 0.1e-3),
            (0.3, 2e-3, 0.4e-3),
        ] {
            let mut mean = 0.0;
            for seed in 0..4 {
                let edge = measure(&strip(per_mm2, noise_m, seed), 0.15, noise_m, &shipped());
                mean += edge.outward.iter().sum::<f64>() / edge.outward.len() as f64 / 4.0;
                assert!(edge.observed.iter().filter(|o| **o).count() > 55);
            }
            assert!(
                (mean - 0.151).abs() < bias_m,
                "{per_mm2} {noise_m}: {:.3} mm",
                (mean - 0.151) * 1e3
            );
        }
    }

    #[test]
    fn a_hidden_stretch_of_edge_is_not_observed_and_is_bridged() {
        let points: Vec<[f64; 2]> = strip(1.0, 0.15e-3, 1)
            .into_iter()
            .filter(|p| p[0].abs() > 0.02 || p[1] < 0.13)
            .collect();
        let edge = measure(&points, 0.15, 0.15e-3, &shipped());
        assert!(!edge.observed_at(0.0) && edge.observed_at(0.05));
        assert!((edge.outward_at(0.0) - 0.151).abs() < 0.5e-3);
        assert!(edge.sigma_at(0.0) > edge.sigma_at(0.05));
    }
}

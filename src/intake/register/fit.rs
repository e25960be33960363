//! How views lie on one another.

use std::sync::Arc;

use rayon::prelude::*;

use super::thinned::{FINE_STRIDE, STRIDE, Thinned, pairs};
use crate::base::Isometry3;
use crate::numeric::robust::median;

/// Cells have something in common that lie within three times this of each other \[m\],
pub(super) const COMMON_WITHIN_M: f64 = 10e-3;
/// and views that have this share of their cells in common, or more.
const LEAST_COMMON: f64 = 0.05;
/// A cell is astray that lies this far off \[m\] and so many times the misfit.
pub(super) const ASTRAY_M: f64 = 2e-3;
pub(super) const ASTRAY: f64 = 4.0;
/// No scanner's points lie nearer than this \[m\]; parts of one cloud do.
pub(super) const NEAREST_M: f64 = 0.1e-3;
/// A view is held against so many others, those with which it has most in common.
const PARTNERS: usize = 8;

/// How a view lies on the others. A view that shares nothing has no misfit (NaN).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Share of the view's cells that lie opposite one of that other view of which this is most
    /// \[-\].
    pub shared: f64,
    /// Their distance from the other views' planes, robustly (1.48 of the median) \[m\]; NaN if
    /// none is shared.
    pub misfit_m: f64,
    /// Share of the view's cells opposite others' that lie much farther off than that \[-\].
    pub astray: f64,
}

/// Distances from planes as one, robustly: 1.48 of their median; NaN of none.
pub(super) fn robust_misfit_m(off_m: &[f64]) -> f64 {
    1.4826 * median(off_m.to_vec()).unwrap_or(f64::NAN)
}

/// The usual misfit of some views \[m\]; 0 where none is known.
pub(super) fn usual_m(fits: &[Fit]) -> f64 {
    let known = fits.iter().map(|fit| fit.misfit_m).filter(|m| m.is_finite());
    median(known.collect()).unwrap_or(0.0)
}

/// The share of the cells of view `a` that lie opposite one of view `b`, within three reaches
/// \[-\].
fn share(views: &[Arc<Thinned>], poses: &[Isometry3], [a, b]: [usize; 2], reach_m: f64) -> f64 {
    let found = pairs(&views[a], &poses[a], &views[b], &poses[b], reach_m, STRIDE);
    found.count() as f64 / views[a].asked.len().div_ceil(STRIDE).max(1) as f64
}

/// The share of the cells of view `a` that it has in common with view `b`.
pub(super) fn common(views: &[Arc<Thinned>], poses: &[Isometry3], a: usize, b: usize) -> f64 {
    share(views, poses, [a, b], COMMON_WITHIN_M)
}

/// That share over all other views together, where a cell counts the less the farther it lies off:
/// half at the reach.
pub(super) fn agreeing(views: &[Arc<Thinned>], poses: &[Isometry3], a: usize, reach_m: f64) -> f64 {
    let others = (0..views.len()).filter(|&b| b != a);
    let found = others
        .flat_map(|b| pairs(&views[a], &poses[a], &views[b], &poses[b], reach_m, FINE_STRIDE));
    let sum: f64 = found.map(|pair| 1.0 / (1.0 + (pair.off_m / reach_m).powi(2))).sum();
    sum / views[a].asked.len().div_ceil(FINE_STRIDE).max(1) as f64
}

/// For each view the others with which it has most in common, and at least a little.
pub(super) fn partners(views: &[Arc<Thinned>], poses: &[Isometry3]) -> Vec<Vec<usize>> {
    let of = |a: usize| {
        let others = (0..views.len()).filter(|&b| b != a);
        let shares = others.map(|b| (common(views, poses, a, b), b));
        let mut others: Vec<(f64, usize)> =
            shares.filter(|(share, _)| *share > LEAST_COMMON).collect();
        others.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        others.into_iter().take(PARTNERS).map(|(_, b)| b).collect()
    };
    (0..views.len()).into_par_iter().map(of).collect()
}

/// How each view lies on its partners.
pub(super) fn fits(
    views: &[Arc<Thinned>],
    partners: &[Vec<usize>],
    poses: &[Isometry3],
) -> Vec<Fit> {
    let of = |a: usize| {
        let mut off_m = Vec::new();
        let mut most = 0;
        for &b in &partners[a] {
            let before = off_m.len();
            let found =
                pairs(&views[a], &poses[a], &views[b], &poses[b], COMMON_WITHIN_M, FINE_STRIDE);
            off_m.extend(found.map(|pair| pair.off_m.abs()));
            most = most.max(off_m.len() - before);
        }
        let shared = most as f64 / views[a].asked.len().div_ceil(FINE_STRIDE).max(1) as f64;
        let misfit_m = robust_misfit_m(&off_m);
        let far_m = ASTRAY_M.max(ASTRAY * misfit_m);
        let astray = off_m.iter().filter(|&&off_m| off_m > far_m).count();
        Fit { shared, misfit_m, astray: astray as f64 / off_m.len().max(1) as f64 }
    };
    (0..views.len()).into_par_iter().map(of).collect()
}

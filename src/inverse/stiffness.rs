//! What a fit says of one stiffness.

use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::numeric::moments::Z90;

/// One stiffness of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinedStiffness {
    /// Name in files.
    pub key: &'static str,
    /// Value, SI unit.
    pub value: f64,
    /// 90 % interval, SI unit.
    pub interval90: [f64; 2],
    /// Share of the prior's variance that the scans took away: 0, the drape does not show it and
    /// the interval is the prior's; 1, the drape alone tells.
    pub shown: f64,
    /// Whether the value lies at an end of what was allowed.
    pub at_limit: bool,
}

impl RefinedStiffness {
    /// Stiffness `k` of the paper's order: its logarithm, the standard deviations of that after and
    /// before the drapes, and the ends of what was allowed. No interval is wider than the prior's.
    pub(crate) fn of(k: usize, ln: f64, [sigma, prior]: [f64; 2], limits: [f64; 2]) -> Self {
        let (value, sigma) = (ln.exp(), sigma.min(prior));
        let half = (Z90 * sigma).exp();
        Self {
            key: TABLE_2[k].key,
            value,
            interval90: [value / half, value * half],
            shown: 1.0 - (sigma / prior).powi(2),
            at_limit: limits.iter().any(|end| (end - ln).abs() < AT_LIMIT),
        }
    }
}

/// The first of the six stiffnesses, which are not bending.
pub(crate) const STRETCH_AND_SHEAR: usize = STIFFNESSES / 2;
/// Factor, as a logarithm, on the stretch and shear found with which a fit begins again: cells lock
/// where stretch is stiff over weight, locked ones have been seen to end 0.5 too low, and a start
/// that is too stiff comes down by itself.
pub(crate) const STIFFER: f64 = 1.0;

/// Shared unknowns with other logarithms of stretch and shear, within their limits.
pub(crate) fn with_stretch(
    shared: &[f64],
    limits: &[[f64; 2]],
    other: impl Fn(usize, f64) -> f64,
) -> Vec<f64> {
    let mut shared = shared.to_vec();
    for (k, [low, high]) in limits.iter().enumerate().take(STRETCH_AND_SHEAR) {
        shared[k] = other(k, shared[k]).clamp(*low, *high);
    }
    shared
}

/// How near an end of what is allowed a logarithm counts as there.
const AT_LIMIT: f64 = 1e-3;

//! How far a pair may move along a straight line without touching.
//!
//! In: kind, corner positions and displacements (metres), the current distance
//! (metres), the largest fraction of interest.
//! Out: a fraction `t`, never 0 for a positive distance, such that at every
//! time in `[0, t]` the pair stays farther apart than [`KEEP`] of its distance.
//!
//! Source: additive CCD, Li et al. 2021 (Codimensional IPC), section 5, with
//! two changes. The speed bound is the largest relative displacement of a
//! corner of one element against a corner of the other; the relative
//! displacement of any two points is a convex combination of these, so the
//! bound holds, and it is never above the paper's sum of two maxima. The
//! step aims at `KEEP` of the distance, not at 0, so that the promise holds at
//! every time before `t` and not only at `t`: the step that is taken in the
//! end is the least over all pairs.
//!
//! Fails: nothing; it may be pessimistic for elements that slide past each
//! other at a small distance (then [`MAX_ADVANCES`] ends it early).
//!
//! Dropped: roots of the coplanarity cubic: not conservative in floating point
//! without intervals, and touching, not a kept distance, is what it finds.

use super::distance::{PairKind, closest};
use crate::base::Vector3;

/// Fraction of the current distance that a step never undercuts. Li et al.
/// use 0.1 to 0.2; empirical.
pub const KEEP: f64 = 0.1;
/// Advancing stops below this fraction of the first distance. Empirical: each
/// advance gains at least `STOP - KEEP` of the distance.
const STOP: f64 = 0.2;
/// A guess, not tuned: ending early costs step length, never safety.
const MAX_ADVANCES: usize = 100;

/// Bound on the relative displacement of any two points of the elements,
/// metres.
pub fn relative_motion_m(kind: PairKind, dx: &[Vector3; 4]) -> f64 {
    let first = match kind {
        PairKind::PointTriangle => 1,
        PairKind::EdgeEdge => 2,
    };
    let mut largest_sq = 0.0_f64;
    for a in &dx[..first] {
        for b in &dx[first..] {
            largest_sq = largest_sq.max((a - b).norm_squared());
        }
    }
    largest_sq.sqrt()
}

/// The fraction for a pair at `x` with `motion_m = relative_motion_m(dx)`.
pub fn safe_fraction(
    kind: PairKind,
    x: &[Vector3; 4],
    dx: &[Vector3; 4],
    motion_m: f64,
    limit: f64,
) -> f64 {
    let first_m = closest(kind, x).distance_sq.sqrt();
    let floor_m = KEEP * first_m;
    let mut distance_m = first_m;
    let mut fraction = 0.0;
    for _ in 0..MAX_ADVANCES {
        let room_m = distance_m - floor_m;
        if room_m >= (limit - fraction) * motion_m {
            return limit;
        }
        fraction += room_m / motion_m;
        let moved = [0, 1, 2, 3].map(|i| x[i] + dx[i] * fraction);
        distance_m = closest(kind, &moved).distance_sq.sqrt();
        if distance_m < STOP * first_m {
            break;
        }
    }
    fraction
}

//! The steps of least squares whose every evaluation is a drape, and their damping (Marquardt 1963): what follows a step
//! that lowered the cost, and one that did not.

use nalgebra::{DMatrix, DVector};

/// Where a damped step of least squares leads from `at`, the first of its unknowns (the others follow them and have no
/// limits), within their `limits`, and by how much the cost is foretold to fall. `whole` is the normal matrix of data and
/// priors, `right` its right-hand side; the largest change of one of the first unknowns is `longest`.
pub(crate) fn damped_step(
    (whole, right): (&DMatrix<f64>, &DVector<f64>),
    at: &[f64],
    limits: &[[f64; 2]],
    damping: f64,
    longest: f64,
) -> Option<(Vec<f64>, f64)> {
    let mut damped = whole.clone();
    for k in 0..at.len() {
        damped[(k, k)] *= 1.0 + damping;
    }
    let mut step = damped.cholesky()?.solve(right);
    let largest = step.rows(0, at.len()).amax();
    step *= (longest / largest).min(1.0);
    let next: Vec<f64> = at
        .iter()
        .zip(limits)
        .enumerate()
        .map(|(k, (value, [low, high]))| (value + step[k]).clamp(*low, *high))
        .collect();
    (0..at.len()).for_each(|k| step[k] = next[k] - at[k]);
    let foretold = 2.0 * right.dot(&step) - step.dot(&(whole * &step));
    Some((next, foretold))
}

/// Damping of the steps to come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damping {
    value: f64,
    rejected: usize,
}

/// Damping of the first step, and least damping after a step that raised the cost.
const FIRST: f64 = 1e-2;
const REJECTED: f64 = 0.1;
/// Shortenings of a step in a row before the fit ends.
const REJECTIONS: usize = 2;

impl Damping {
    pub(crate) fn first() -> Self {
        Self { value: FIRST, rejected: 0 }
    }

    /// Share that is added to the diagonal.
    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    /// A step lowered the cost.
    pub(crate) fn lower(&mut self) {
        (self.value, self.rejected) = (0.2 * self.value, 0);
    }

    /// A step did not lower the cost: whether a shorter one is to be tried.
    pub(crate) fn raise(&mut self) -> bool {
        let again = self.rejected < REJECTIONS;
        if again {
            self.value = (10.0 * self.value).max(REJECTED);
            self.rejected += 1;
        }
        again
    }
}

/// Foretold fall of the cost, in squared standard deviations, that is not worth a drape.
pub(crate) const LEAST_GAIN: f64 = 0.05;
/// Change of a logarithm that is not worth one.
pub(crate) const LEAST_MOVE: f64 = 3e-3;

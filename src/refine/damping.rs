//! The damping of least squares whose every evaluation is a drape (Marquardt 1963): what follows a step that
//! lowered the cost, and one that did not.

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

//! The least squares over one drape: the sums over its data, the priors of its numbers.

use nalgebra::{DMatrix, DVector};

/// Weight of what lies so many standard deviations off: from `outlier` on it pulls no harder (Huber
/// 1964).
pub(crate) fn huber_weight(far: f64, outlier: f64) -> f64 {
    if far > outlier { outlier / far } else { 1.0 }
}

/// What so many data cost that lie so many standard deviations off, with that weight.
pub(crate) fn huber_cost(counts: f64, far: f64, weight: f64) -> f64 {
    counts * far * far * weight * (2.0 - weight)
}

/// The sums over a drape's data: normal matrix and right-hand side, shared unknowns first, then its
/// own.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
    /// Squared distances in standard deviations, outliers weighted down.
    pub cost: f64,
    /// Number of independent coordinates.
    pub independent: f64,
}

/// What draws one number to what is expected of it: precision, right-hand side and cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pull {
    pub precision: f64,
    pub right: f64,
    pub cost: f64,
}

impl Pull {
    /// Of a Gaussian on a number, its mean and standard deviation, that pulls no harder from
    /// `outlier` standard deviations on.
    pub fn robust(value: f64, [mean, sigma]: [f64; 2], outlier: f64) -> Self {
        let off = (mean - value) / sigma;
        let weight = huber_weight(off.abs(), outlier);
        Self {
            precision: weight * sigma.powi(-2),
            right: weight * off / sigma,
            cost: huber_cost(1.0, off, weight),
        }
    }

    /// Of a Gaussian of some precision on a number that is so far beyond its mean.
    pub fn gaussian(precision: f64, beyond: f64) -> Self {
        Self { precision, right: -(precision * beyond), cost: precision * beyond * beyond }
    }

    /// Of a number that stays what it is expected to be, so far beyond that.
    pub fn fixed(beyond: f64) -> Self {
        Self { cost: 0.0, ..Self::gaussian(FIXED, beyond) }
    }

    /// Whether the number may move.
    pub fn is_free(&self) -> bool {
        self.precision < FIXED
    }
}

/// Precision of a number that stays what it is.
const FIXED: f64 = 1e18;

/// One drape's part of the least squares.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub sums: Sums,
    /// The priors of the numbers that it alone has.
    pub own: Vec<Pull>,
}

impl Part {
    /// What the drape costs, with those priors.
    pub fn cost(&self) -> f64 {
        self.own.iter().fold(self.sums.cost, |cost, pull| cost + pull.cost)
    }
}

/// A drape's own numbers at their best, from some on, beside shared unknowns as they are: they and
/// the weights of outliers follow each other in some rounds, until no number changes by
/// `least_change`.
pub(crate) fn at_best<T: Copy + From<[f64; N]> + Into<[f64; N]>, const N: usize>(
    from: T,
    rounds: usize,
    least_change: f64,
    part_at: impl Fn(&T) -> Part,
) -> T {
    let mut own: [f64; N] = from.into();
    for _ in 0..rounds {
        let Part { sums, own: pulls } = part_at(&own.into());
        let first = sums.right.len() - N;
        let mut matrix = sums.normal.view((first, first), (N, N)).into_owned();
        let mut right = sums.right.rows(first, N).into_owned();
        for (m, pull) in pulls.iter().enumerate() {
            matrix[(m, m)] += pull.precision;
            right[m] += pull.right;
        }
        let Some(factor) = matrix.cholesky() else { break };
        let change = factor.solve(&right);
        own.iter_mut().zip(&change).for_each(|(own, change)| *own += change);
        if change.amax() < least_change {
            break;
        }
    }
    own.into()
}

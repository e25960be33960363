//! The least squares around the drapes of one cloth, and the step from there.

use nalgebra::{DMatrix, DVector};

use super::step::damped_step;
use super::sums::{Part, Pull};

/// What draws the shared unknowns to what is expected of them: precision, right-hand side and cost.
pub(crate) struct SharedPrior {
    pub precision: DMatrix<f64>,
    pub right: DVector<f64>,
    pub cost: f64,
}

impl SharedPrior {
    /// Of unknowns each of which has a prior of its own.
    pub fn of_each(pulls: &[Pull]) -> Self {
        let each = |of: fn(&Pull) -> f64| DVector::from_iterator(pulls.len(), pulls.iter().map(of));
        Self {
            precision: DMatrix::from_diagonal(&each(|pull| pull.precision)),
            right: each(|pull| pull.right),
            cost: pulls.iter().map(|pull| pull.cost).sum(),
        }
    }
}

/// Drapes of one cloth, each with what its fit keeps of it, and the least squares around them.
#[derive(Clone)]
pub(crate) struct State<D> {
    /// The shared unknowns.
    pub shared: Vec<f64>,
    pub drapes: Vec<D>,
    /// What each drape adds.
    pub parts: Vec<Part>,
    /// Sum of squared distances in standard deviations, outliers weighted down, and of the priors'.
    pub cost: f64,
    /// The data's part of it, and the number of independent coordinates.
    pub data_cost: f64,
    pub independent: f64,
    /// Normal matrix of the data, precision of the priors and right-hand side of both: the shared
    /// unknowns, then each drape's own.
    pub normal: DMatrix<f64>,
    pub priors: DMatrix<f64>,
    pub right: DVector<f64>,
}

/// Where a damped step leads.
pub(crate) struct Step {
    /// The shared unknowns there.
    pub to: Vec<f64>,
    /// By how much the cost is predicted to fall.
    pub predicted: f64,
    /// Largest change of a shared unknown.
    pub moved: f64,
}

impl<D> State<D> {
    /// The sums of all drapes, their own numbers at their best.
    pub fn around(shared: Vec<f64>, prior: &SharedPrior, drapes: Vec<D>, parts: Vec<Part>) -> Self {
        let common = shared.len();
        let size = common + parts.iter().map(|part| part.own.len()).sum::<usize>();
        let (mut normal, mut priors) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent, mut cost) = (0.0, 0.0, 0.0);
        let mut first = common;
        for Part { sums, own } in &parts {
            let column = |c: usize| if c < common { c } else { first + c - common };
            for a in 0..common + own.len() {
                right[column(a)] += sums.right[a];
                for b in 0..common + own.len() {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            for (m, pull) in own.iter().enumerate() {
                priors[(first + m, first + m)] = pull.precision;
                right[first + m] += pull.right;
                cost += pull.cost;
            }
            data_cost += sums.cost;
            independent += sums.independent;
            first += own.len();
        }
        priors.view_mut((0, 0), (common, common)).copy_from(&prior.precision);
        (0..common).for_each(|k| right[k] += prior.right[k]);
        cost += data_cost + prior.cost;
        Self { shared, drapes, parts, cost, data_cost, independent, normal, priors, right }
    }

    /// Root mean square distance of an independent coordinate in standard deviations.
    pub fn misfit(&self) -> f64 {
        (self.data_cost / self.independent).sqrt()
    }

    /// A damped step, the shared unknowns within their limits and none changed by more than
    /// `longest`.
    pub fn step(&self, limits: &[[f64; 2]], longest: f64, damping: f64) -> Option<Step> {
        let whole = &self.normal + &self.priors;
        let from = &self.shared;
        let (to, predicted) = damped_step((&whole, &self.right), from, limits, damping, longest)?;
        let moved = to.iter().zip(from).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        Some(Step { to, predicted, moved })
    }

    /// Covariance of all unknowns where the data are so many times less sure; `None` where they
    /// have no solution.
    pub fn covariance(&self, less_sure: f64) -> Option<DMatrix<f64>> {
        let precision = &self.normal / (less_sure * less_sure) + &self.priors;
        let size = precision.nrows();
        precision.cholesky().map(|factor| factor.solve(&DMatrix::identity(size, size)))
    }
}

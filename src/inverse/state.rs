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
    /// Of unknowns with a prior each.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::{Sums, at_best};

    const SHARED: f64 = 1.0;
    const OWN: [f64; 2] = [0.5, -0.25];
    /// How a place moves with the shared number and with the drape's own.
    const MOVES: [[f64; 2]; 3] = [[1.0, 0.2], [-0.5, 1.0], [0.3, 0.7]];

    /// A drape without noise, beside a shared and an own number.
    fn part(drape: usize, shared: f64, own: f64) -> Part {
        let (mut normal, mut right) = (DMatrix::zeros(2, 2), DVector::zeros(2));
        let mut cost = 0.0;
        for moves in MOVES {
            let off = moves[0] * (SHARED - shared) + moves[1] * (OWN[drape] - own);
            let column = DVector::from_row_slice(&moves);
            normal += &column * column.transpose();
            right += &column * off;
            cost += off * off;
        }
        let sums = Sums { normal, right, cost, independent: MOVES.len() as f64 };
        Part { sums, own: vec![Pull::robust(own, [OWN[drape], 2.0], 1e9)] }
    }

    #[test]
    fn one_step_leads_to_the_numbers_of_drapes_without_noise() {
        let beside = |drape: usize, shared: f64| {
            at_best([0.0], 1, 0.0, |own: &[f64; 1]| part(drape, shared, own[0]))[0]
        };
        let around = |shared: f64, own: [f64; 2]| {
            let prior = SharedPrior::of_each(&[Pull::robust(shared, [SHARED, 3.0], 1e9)]);
            let parts = vec![part(0, shared, own[0]), part(1, shared, own[1])];
            State::around(vec![shared], &prior, vec![(); 2], parts)
        };
        assert!((0..2).all(|drape| (beside(drape, SHARED) - OWN[drape]).abs() < 1e-12));
        let from = around(0.0, [0, 1].map(|drape| beside(drape, 0.0)));
        let step = from.step(&[[-9.0, 9.0]], 9.0, 0.0).unwrap();
        assert!((step.to[0] - SHARED).abs() < 1e-12 && (step.moved - 1.0).abs() < 1e-12);
        // nothing is left there, neither of the data nor of the priors
        assert!((step.predicted - from.cost).abs() < 1e-12, "{} {}", step.predicted, from.cost);
        let end = around(SHARED, OWN);
        assert!(end.cost < 1e-20 && end.misfit() < 1e-10 && end.independent == 6.0);

        // the shared number's variance, the drapes' own as unsure as they are
        let [shared, both, own] = [[0, 0], [0, 1], [1, 1]]
            .map(|[a, b]| MOVES.iter().map(|moves| moves[a] * moves[b]).sum::<f64>());
        let of_one = shared - both * both / (own + 0.25);
        let variance = 1.0 / (2.0 * of_one + 1.0 / 9.0);
        assert!((end.covariance(1.0).unwrap()[(0, 0)] - variance).abs() < 1e-12);
    }
}

//! A plain fit begun again where scanned sheets leave more than the plain model should.
//!
//! The least squares over tied sheets has more than one end: cells lock where stretch is stiff over
//! weight, and a sheet may rest in a minimum beside its scan's. Each other beginning is taken if it
//! ends nearer. Where much is left and another beginning comes back to the same end, it is the
//! model that does not reach the scans, and no beginning that is in the way: nothing further is
//! tried.

use super::descent::Solution;
use super::{Fit, LED_GAIN};
use crate::calibrate::equations::{Problem, State};
use crate::calibrate::options::LEAVES;
use crate::inverse::{STIFFER, STRETCH_AND_SHEAR, with_stretch};
use crate::numeric::moments::mean;

impl Fit<'_> {
    /// Where scanned sheets leave more than the plain model should, begins again at stiffer stretch
    /// and shear, as long as that helps.
    ///
    /// Cells lock where stretch is stiff over weight. A fit on such cells runs to a softer stretch
    /// before it is known what finer ones do, and what they do to that softer cloth says nothing of
    /// the true one: from there no step leads back. So what cells do is known here before the first
    /// step. Then, where stretch or shear has run off, once more at the prior of them; where one
    /// sheet lies worse than the others, at the cloth of these; last at the cloth found, with
    /// sheets that come straight to it. Whether that brought it nearer.
    pub(in crate::calibrate) fn start_otherwise(&mut self) -> bool {
        let before = self.plain.state.cost;
        let Problem { targets, options, .. } = &self.plain.problem;
        if targets.iter().all(|target| target.is_held(options)) {
            self.try_starts();
        }
        self.plain.state.cost < before - LED_GAIN
    }

    /// Begins again at the cloth found, with sheets that come straight to it: sheets that were
    /// continued from cloth to cloth bring along what friction remembers of the way.
    pub(in crate::calibrate) fn begin_again_here(&mut self) {
        self.begin_again(&self.plain.state.shared.clone());
    }

    fn try_starts(&mut self) {
        for _ in 0..STARTS {
            if self.misfit() < AGAIN {
                break;
            }
            let before = self.plain.state.cost;
            let again = self.begin_again(&self.with_stretch(|_, ln| ln + STIFFER));
            let is_same = again.is_some_and(|end| is_same_end(before, end.cost));
            if is_same && self.misfit() >= LEAVES {
                return;
            }
            if self.plain.state.cost >= before {
                break;
            }
        }
        if self.misfit() >= LEAVES && self.has_run_off() {
            let fabric_prior = self.plain.problem.fabric_prior;
            self.begin_again(&self.with_stretch(|k, _| fabric_prior.ln_mean[k] + OTHERWISE));
        }
        if self.misfit() >= AGAIN {
            self.follow_the_others();
        }
        // sheets that were continued from fabric to fabric bring along what friction remembers of
        // the way
        if self.misfit() >= AGAIN {
            self.begin_again(&self.plain.state.shared.clone());
        }
    }

    /// Where one sheet lies far worse than the others, begins again at the cloth that these have
    /// without it: a sheet that rests beside its scan's minimum draws the cloth its way, and keeps
    /// itself there. More than once, since that sheet's turn may come after another's.
    fn follow_the_others(&mut self) {
        let (mut shared, mut odd) =
            (self.plain.state.shared.clone(), odd_one(&self.plain.state.costs()));
        for _ in 0..ROUNDS {
            let Some(others) = odd.and_then(|odd| self.fit_without(odd, &shared)) else { return };
            let Some(state) = self.begin_again(&others) else { return };
            if self.misfit() < AGAIN {
                return;
            }
            (shared, odd) = (state.shared.clone(), odd_one(&state.costs()));
        }
    }

    /// The shared unknowns of the plain fit to all sheets but one, laid anew with some shared
    /// unknowns.
    fn fit_without(&mut self, odd: usize, shared: &[f64]) -> Option<Vec<f64>> {
        let mut others = self.plain.problem.clone();
        others.targets.remove(odd);
        let most = others.options.evaluations * others.targets.len();
        let begun = Fit::begun(&others, &others.cloth(shared), self.rule, self.sheets.tell);
        let Fit { mut sheets, plain, .. } = begun.ok()?;
        let (state, _) = sheets.descend(&plain.problem, plain.state, most);
        self.sheets.simulated += sheets.simulated;
        Some(state.shared)
    }

    /// Whether stretch or shear lies far from the prior.
    fn has_run_off(&self) -> bool {
        let fabric_prior = self.plain.problem.fabric_prior;
        let off = |k: usize| (self.plain.state.shared[k] - fabric_prior.ln_mean[k]).abs();
        (0..STRETCH_AND_SHEAR).any(|k| off(k) > RAN_OFF * fabric_prior.covariance[(k, k)].sqrt())
    }

    /// The plain fit's shared unknowns with other logarithms of stretch and shear.
    fn with_stretch(&self, other: impl Fn(usize, f64) -> f64) -> Vec<f64> {
        let Solution { problem, state, .. } = &self.plain;
        with_stretch(&state.shared, &problem.fabric_prior.ln_limits, other)
    }

    /// Begins the plain fit again with sheets started anew by a cloth, and with what finer cells do
    /// to that cloth, and takes the end if that is nearer. Gives the end either way; `None` where a
    /// sheet does not come to rest.
    fn begin_again(&mut self, shared: &[f64]) -> Option<State> {
        let numbers = self.plain.problem.numbers.clone();
        let found = self.finely_guided(&numbers, shared)?;
        let state = found.state.clone();
        if state.cost < self.plain.state.cost - LED_GAIN {
            let stays = std::mem::take(&mut self.plain.stays);
            self.plain = Solution { stays, ..found };
        }
        Some(state)
    }
}

/// Whether ends that cost so much are one.
fn is_same_end(one: f64, other: f64) -> bool {
    (other - one).abs() < SAME_END * one
}

/// Of sheets that cost so much the one that lies worse than the others by far, if there is one and
/// enough of those.
fn odd_one(costs: &[f64]) -> Option<usize> {
    let (odd, most) = costs.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let others: Vec<f64> = [&costs[..odd], &costs[odd + 1..]].concat();
    (others.len() >= FEWEST_OTHERS && *most > ODD * mean(&others)).then_some(odd)
}

/// Standard deviations from the prior beyond which stretch or shear has run off.
const RAN_OFF: f64 = 2.0;
/// Misfit of scanned sheets from which on the fit begins again so: cloth that the model knows
/// leaves half to four fifths of it (structured light). And how often at most.
const AGAIN: f64 = 0.3;
const STARTS: usize = 2;
/// Difference of costs, as a part, within which two beginnings have come to the same end.
const SAME_END: f64 = 0.05;
/// The same logarithm on the prior of a stretch or shear that has run off.
const OTHERWISE: f64 = 1.8;
/// How many times as much as the others on the mean a sheet costs that these are fitted without,
/// how many others there must be, and how often this is done at most.
const ODD: f64 = 1.3;
const FEWEST_OTHERS: usize = 2;
const ROUNDS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_one_where_they_cost_the_same_on_either_side() {
        // a draught that the model does not have, and a cloth that had locked
        assert!(is_same_end(1772.0, 1748.0) && is_same_end(1748.0, 1775.0));
        assert!(!is_same_end(922.0, 160.0) && !is_same_end(160.0, 922.0));
    }

    #[test]
    fn a_sheet_is_odd_beside_enough_others_that_agree() {
        assert_eq!(odd_one(&[22.0, 66.0, 210.0, 34.0]), Some(2));
        assert_eq!(odd_one(&[57.0, 50.0, 66.0, 60.0]), None);
        // of two neither is the odd one
        assert_eq!((odd_one(&[10.0, 90.0]), odd_one(&[])), (None, None));
    }
}

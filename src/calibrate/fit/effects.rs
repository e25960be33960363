//! The fit with effects: more unknowns around the plain fit, or around another cloth.

use rayon::prelude::*;

use super::descent::{Sheets, Solution};
use super::{Fit, Found, finer};
use crate::calibrate::continuation::Continuation;
use crate::calibrate::effect::{EFFECTS, Number, SENSOR_EDGE};
use crate::calibrate::equations::{Problem, State};
use crate::calibrate::evidence::{Around, DrapeAround};
use crate::calibrate::prediction::{Prediction, steadied_prediction_of};
use crate::calibrate::softened::softened;
use crate::calibrate::specimens::specimens_of;
use crate::calibrate::target::Target;
use crate::fabric::STIFFNESSES;
use crate::inverse::return_to;

impl Sheets<'_> {
    /// The least squares around a state of a problem, to whose cloth the sheets are led, with more
    /// unknowns; `None` where a sheet has no sensitivities to them. Some sheets are known to stay
    /// on a saddle.
    fn with_more<'p>(
        &mut self,
        own: &Problem<'p>,
        state: &State,
        stays: &[bool],
        numbers: &[&'static Number],
    ) -> Option<(Problem<'p>, State)> {
        let (cloth, problem) = (own.cloth(&state.shared), own.with(numbers));
        let (continuation, poses) = (Continuation::of(&problem, &cloth), state.poses());
        let sheets = self.followers.par_iter_mut().zip(&problem.targets);
        let predictions: Option<Vec<Prediction>> = sheets
            .zip(&poses)
            .zip(stays)
            .map(|(((sheet, target), pose), stays)| match stays {
                true => steadied_prediction_of(sheet, &continuation.asked, target.compared()).ok(),
                false => continuation.seen(sheet, target, pose).ok(),
            })
            .collect();
        let shared = extended(&state.shared, &own.numbers, numbers);
        let state = problem.around(&shared, predictions?, &poses);
        Some((problem, state))
    }
}

impl<'a> Fit<'a> {
    /// The least squares around the plain fit's drapes with more unknowns; `None` where a sheet has
    /// no sensitivities to them.
    fn state_with(&mut self, numbers: &[&'static Number]) -> Option<(Problem<'a>, State)> {
        let Self { sheets, plain: Solution { problem, state, kept, stays, .. }, .. } = self;
        return_to(&mut sheets.followers, kept);
        let (problem, state) = sheets.with_more(problem, state, stays, numbers)?;
        *stays = state.drapes.iter().map(|draped| draped.prediction.is_steadied).collect();
        Some((problem, state))
    }

    /// The least squares around the plain fit with every number of some effects.
    pub(in crate::calibrate) fn around_plain(
        &mut self,
        numbers: &[&'static Number],
    ) -> Option<Around> {
        self.state_with(numbers).map(|(problem, state)| around(problem, state))
    }

    /// Where the least squares end with some effects' numbers, from the plain fit on; `None` where
    /// a sheet has no sensitivities to them.
    pub(super) fn solved_with(&mut self, numbers: &[&'static Number]) -> Option<Solution<'a>> {
        let (problem, state) = self.state_with(numbers)?;
        Some(self.sheets.solve(problem, state))
    }

    /// The same with the least squares around it.
    pub(in crate::calibrate) fn found(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let solution = self.solved_with(numbers)?;
        self.found_at(&solution)
    }

    /// A solution, to which the sheets belong, with the least squares around it of every effect's
    /// numbers; `None` where a sheet has no sensitivities to them.
    fn found_at(&mut self, solution: &Solution<'_>) -> Option<Found> {
        let Solution { problem, state, .. } = solution;
        let numbers: Vec<_> =
            EFFECTS.iter().chain([&SENSOR_EDGE]).flat_map(|e| e.numbers).collect();
        let stays = vec![false; problem.targets.len()];
        let (problem, state) = self.sheets.with_more(problem, state, &stays, &numbers)?;
        Some((self.fitted(solution), around(problem, state)))
    }

    /// The fit with some effects' numbers, softening among them, from sheets led with the cloth
    /// that balances the forces on the plain fit's sheets (`softened.rs`), and with what finer
    /// cells do to that cloth; `None` where nothing softens, or a sheet does not come to rest.
    pub(in crate::calibrate) fn softened(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let (problem, state) = self.state_with(numbers)?;
        self.anew(numbers, &softened(&state, numbers, &problem.limits())?)
    }

    /// The fit from sheets started anew with some shared unknowns. What finer cells do to their
    /// cloth is known before the first step; `None` where a sheet does not come to rest.
    pub(in crate::calibrate) fn anew(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
    ) -> Option<Found> {
        let solution = self.finely_guided(numbers, shared)?;
        return_to(&mut self.sheets.followers, &solution.kept);
        self.found_at(&solution)
    }

    /// Where the least squares end from sheets started anew with some shared unknowns, with what
    /// finer cells do to that cloth.
    pub(super) fn finely_guided(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
    ) -> Option<Solution<'a>> {
        let Self { sheets, plain, .. } = self;
        let mut problem = plain.problem.with(numbers);
        let state = sheets.guided(&problem, shared, &plain.state.poses())?;
        let finer = finer(&problem, shared, &state);
        for (target, finer) in problem.targets.iter_mut().zip(finer) {
            target.finer = finer.or_else(|| target.finer.take());
        }
        let poses = state.poses();
        let state = problem.around(shared, state.into_predictions(), &poses);
        Some(sheets.solve(problem, state))
    }
}

/// The least squares around a state, as the evidence of effects has them.
fn around(problem: Problem<'_>, state: State) -> Around {
    let State { shared, parts, .. } = state;
    let drape =
        |(part, target): (_, &Target)| DrapeAround { part, is_picture: target.rim.is_none() };
    let room = |(ends, at): ([f64; 2], &f64)| ends.map(|end| end - at);
    let specimens: Vec<_> = problem.targets.iter().map(|t| t.specimen.as_deref()).collect();
    Around {
        drapes: parts.into_iter().zip(&problem.targets).map(drape).collect(),
        specimens: specimens_of(&specimens),
        precision: problem.prior(&shared).precision,
        off: problem.off(&shared),
        room: problem.limits().into_iter().zip(&shared).map(room).collect(),
        numbers: problem.numbers,
    }
}

/// Shared unknowns with some numbers, those at nothing that were not among them.
fn extended(shared: &[f64], had: &[&'static Number], numbers: &[&'static Number]) -> Vec<f64> {
    let (ln, sizes) = shared.split_at(STIFFNESSES);
    let size = |number: &&'static Number| {
        had.iter().position(|own| own == number).map_or(0.0, |at| sizes[at])
    };
    ln.iter().copied().chain(numbers.iter().map(size)).collect()
}

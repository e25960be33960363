//! The steps of the fit: sheets brought to another cloth as long as that lowers the cost.

use rayon::prelude::*;

use super::{Fit, Progress};
use crate::calibrate::continuation::{Continuation, Sheet};
use crate::calibrate::effect::{Cloth, Number};
use crate::calibrate::equations::{Draped, NormalEquations, State, parameters, rms_m};
use crate::calibrate::options::MUCH;
use crate::calibrate::pose::Pose;
use crate::calibrate::prediction::Prediction;
use crate::calibrate::target::Target;
use crate::inverse::{Descent, Ended, LEAST_GAIN, Moved, Step, descend, keep, return_to};
use crate::sim::Follower;

impl Fit<'_> {
    /// The sheets as they lie are those of the plain fit.
    pub(super) fn keep(&mut self) {
        self.kept = keep(&self.followers);
        self.stays.fill(false);
    }

    /// Puts the sheets of the plain fit back.
    pub(super) fn restore(&mut self) {
        return_to(&mut self.followers, &self.kept);
    }

    /// Steps from a state, to which the followers' sheets belong, as long as they lower the cost.
    pub(super) fn descend(
        &mut self,
        numbers: &[&'static Number],
        mut best: State,
        most: usize,
    ) -> (State, Ended) {
        if self.options.hold_per_m > 0.0 {
            let kept = keep(&self.followers);
            // held by the outlines as their poses have them by now
            match self.moved(numbers, &best.shared, &best) {
                Some(state) => best = state,
                None => return_to(&mut self.followers, &kept),
            }
        }
        descend(&mut Steps { fit: self, numbers }, best, most)
    }

    /// Predicted fall of the cost, as a share of it, that is not worth a round of drapes: more
    /// where scanned sheets say that the model is not theirs.
    pub(super) fn least_share(&self, state: &State) -> f64 {
        let held = self.targets.iter().all(|target| target.is_held(self.options));
        LEAST_SHARE[usize::from(held && state.misfit() >= MUCH)]
    }

    /// The sheets brought to another cloth, held by their outlines in the poses of the state
    /// before, and the least squares around them; `None` where one does not come to rest there. A
    /// sheet that lost its fold on the way, or does not find it, is guided by its outline again.
    pub(super) fn moved(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
        before: &State,
    ) -> Option<State> {
        let cloth = self.equations(numbers).cloth(shared);
        let asked = parameters(numbers);
        self.simulated += self.followers.len();
        let (continuation, poses) =
            (Continuation { cloth: &cloth, options: self.options, asked: &asked }, before.poses());
        let both = self.followers.par_iter_mut().zip(&self.targets).zip(&poses);
        let predictions: Option<Vec<Prediction>> = both
            .map(|((sheet, target), pose)| {
                let way = continuation.steadily_on(sheet, target, pose);
                way.or_else(|_| continuation.anew(sheet, target, pose)).ok()
            })
            .collect();
        let mut state = self.equations(numbers).around(shared, predictions?, &poses);
        let costs = state.costs().into_iter().zip(before.costs()).enumerate();
        let lost = costs.filter(|(_, (cost, before))| *cost > LOST[0] * before + LOST[1]);
        let lost: Vec<usize> = lost.map(|(k, _)| k).collect();
        if !lost.is_empty() {
            state = self.recovered(numbers, (shared, &cloth), state, &lost);
        }
        let squared: f64 =
            state.drapes.iter().map(|draped| rms_m(&draped.residuals.rows).powi(2)).sum();
        self.least_m = self.least_m.min((squared / state.drapes.len() as f64).sqrt());
        (self.tell)(Progress {
            drapes: self.simulated,
            outlines: self.targets.len(),
            rms_m: self.least_m,
        });
        Some(state)
    }

    /// The same state with some sheets guided by their outlines again, where that brings them
    /// nearer.
    pub(super) fn recovered(
        &mut self,
        numbers: &[&'static Number],
        (shared, cloth): (&[f64], &Cloth),
        state: State,
        lost: &[usize],
    ) -> State {
        let targets: Vec<Target> = lost.iter().map(|&k| self.targets[k].clone()).collect();
        let poses: Vec<Pose> = lost.iter().map(|&k| state.drapes[k].pose).collect();
        self.simulated += lost.len();
        let asked = parameters(numbers);
        let continuation = Continuation { cloth, options: self.options, asked: &asked };
        let guided = continuation.all(&targets, &poses);
        let again =
            guided.into_par_iter().zip(&targets).zip(&poses).map(|((sheet, target), pose)| {
                let (mut sheet, _) = sheet.ok()?;
                let prediction = continuation.on(&mut sheet, target, pose).ok()?;
                Some((sheet, prediction))
            });
        let again: Vec<Option<Sheet>> = again.collect();
        let (costs, all_poses) = (state.costs(), state.poses());
        let mut predictions: Vec<Prediction> =
            state.drapes.into_iter().map(|draped| draped.prediction).collect();
        for (&k, sheet) in lost.iter().zip(again) {
            let Some((sheet, prediction)) = sheet else { continue };
            let one = [self.targets[k].clone()];
            let equations = NormalEquations { targets: &one, ..self.equations(numbers) };
            let alone = equations.around(shared, vec![prediction.clone()], &[all_poses[k]]);
            if alone.costs()[0] < costs[k] {
                self.followers[k] = sheet;
                predictions[k] = prediction;
            }
        }
        self.equations(numbers).around(shared, predictions, &all_poses)
    }
}

/// A fit with some effects' numbers.
struct Steps<'f, 'a> {
    fit: &'f mut Fit<'a>,
    numbers: &'f [&'static Number],
}

impl Descent for Steps<'_, '_> {
    type Drape = Draped;

    fn sheets(&mut self) -> &mut [Follower] {
        &mut self.fit.followers
    }

    fn simulated(&self) -> usize {
        self.fit.simulated
    }

    fn step(&self, from: &State, damping: f64) -> Option<Step> {
        self.fit.equations(self.numbers).step(from, damping)
    }

    fn least_gain(&self, from: &State) -> f64 {
        LEAST_GAIN.max(self.fit.least_share(from) * from.cost)
    }

    fn brought(&mut self, step: &Step, from: &State) -> Moved<Draped> {
        Moved::to(self.fit.moved(self.numbers, &step.to, from), from)
    }
}

/// The shares of the cost that [`Fit::least_share`] gives.
const LEAST_SHARE: [f64; 2] = [1e-3, 2e-2];
/// Part of its cost, and cost, by which a drape's must rise in a step for its sheet to count as off
/// its fold.
const LOST: [f64; 2] = [1.2, 15.0];

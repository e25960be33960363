//! The steps of the fit: sheets brought to another cloth as long as that lowers the cost.

use rayon::prelude::*;

use super::{Fit, Progress};
use crate::calibrate::continuation::{Continuation, Sheet};
use crate::calibrate::effect::{Cloth, Number};
use crate::calibrate::equations::{NormalEquations, State, parameters, rms_m};
use crate::calibrate::options::MUCH;
use crate::calibrate::pose::Pose;
use crate::calibrate::prediction::Prediction;
use crate::calibrate::target::Target;
use crate::refine::Ended;
use crate::refine::damping::{Damping, LEAST_GAIN, LEAST_MOVE};
use crate::sim::{Follower, Kept};

impl Fit<'_> {
    /// The sheets as they lie are those of the plain fit.
    pub(super) fn keep(&mut self) {
        self.kept = self.followers.iter().map(Follower::keep).collect();
        self.stays.fill(false);
    }

    /// Puts the sheets of the plain fit back.
    pub(super) fn restore(&mut self) {
        self.followers.iter_mut().zip(&self.kept).for_each(|(sheet, kept)| sheet.return_to(kept));
    }

    pub(super) fn return_to(&mut self, kept: &[Kept]) {
        self.followers.iter_mut().zip(kept).for_each(|(sheet, kept)| sheet.return_to(kept));
    }

    /// Steps from a state, to which the followers' sheets belong, as long as they lower the cost.
    pub(super) fn descend(
        &mut self,
        numbers: &[&'static Number],
        mut best: State,
        most: usize,
    ) -> (State, Ended) {
        let mut kept: Vec<Kept> = self.followers.iter().map(Follower::keep).collect();
        let mut damping = Damping::first();
        if self.options.hold_per_m > 0.0 {
            // held by the outlines as their poses have them by now
            match self.moved(numbers, &best.shared, &best) {
                Some(state) => {
                    kept = self.followers.iter().map(Follower::keep).collect();
                    best = state;
                }
                None => self.return_to(&kept),
            }
        }
        loop {
            if self.simulated >= most {
                return (best, Ended::Spent);
            }
            let step = self.equations(numbers).step(&best, damping.value());
            let Some((shared, predicted)) = step else { return (best, Ended::Singular) };
            let changes = shared.iter().zip(&best.shared).map(|(a, b)| (a - b).abs());
            let moved = changes.fold(0.0, f64::max);
            if predicted < LEAST_GAIN.max(self.least_share(&best) * best.cost) || moved < LEAST_MOVE
            {
                return (best, Ended::Converged);
            }
            let state = self.moved(numbers, &shared, &best);
            match state.filter(|state| state.cost < best.cost) {
                Some(state) => {
                    best = state;
                    kept = self.followers.iter().map(Follower::keep).collect();
                    damping.lower();
                }
                None => {
                    self.return_to(&kept);
                    if !damping.raise() {
                        return (best, Ended::NoBetter);
                    }
                }
            }
        }
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
            (Continuation { cloth: &cloth, options: self.options, asked: &asked }, &before.poses);
        let both = self.followers.par_iter_mut().zip(&self.targets).zip(poses);
        let predictions: Option<Vec<Prediction>> = both
            .map(|((sheet, target), pose)| {
                let way = continuation.steadily_on(sheet, target, pose);
                way.or_else(|_| continuation.anew(sheet, target, pose)).ok()
            })
            .collect();
        let mut state = self.equations(numbers).around(shared, predictions?, poses.clone());
        let lost = |k: &usize| state.sums[*k].cost > LOST[0] * before.sums[*k].cost + LOST[1];
        let lost: Vec<usize> = (0..self.targets.len()).filter(lost).collect();
        if !lost.is_empty() {
            state = self.recovered(numbers, (shared, &cloth), state, &lost);
        }
        let squared: f64 =
            state.residuals.iter().map(|residuals| rms_m(&residuals.rows).powi(2)).sum();
        self.least_m = self.least_m.min((squared / state.residuals.len() as f64).sqrt());
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
        let poses: Vec<Pose> = lost.iter().map(|&k| state.poses[k]).collect();
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
        let mut predictions = state.predictions.clone();
        for (&k, sheet) in lost.iter().zip(again) {
            let Some((sheet, prediction)) = sheet else { continue };
            let one = [self.targets[k].clone()];
            let equations = NormalEquations { targets: &one, ..self.equations(numbers) };
            let alone = equations.around(shared, vec![prediction.clone()], vec![state.poses[k]]);
            if alone.sums[0].cost < state.sums[k].cost {
                self.followers[k] = sheet;
                predictions[k] = prediction;
            }
        }
        self.equations(numbers).around(shared, predictions, state.poses)
    }
}

/// The shares of the cost that [`Fit::least_share`] gives.
const LEAST_SHARE: [f64; 2] = [1e-3, 2e-2];
/// Part of its cost, and cost, by which a drape's must rise in a step for its sheet to count as off
/// its fold.
const LOST: [f64; 2] = [1.2, 15.0];

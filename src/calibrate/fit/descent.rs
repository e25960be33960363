//! The steps of the fit: sheets brought to another cloth as long as that lowers the cost.

use rayon::prelude::*;

use crate::calibrate::continuation::{Continuation, Sheet};
use crate::calibrate::equations::{Draped, Problem, State, rms_m};
use crate::calibrate::options::MUCH;
use crate::calibrate::pose::Pose;
use crate::calibrate::prediction::Prediction;
use crate::inverse::{Descent, Ended, LEAST_GAIN, Moved, Step, descend, keep, return_to};
use crate::sim::{Follower, Kept};

/// How far a fit is; told after every round of drapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Drapes so far.
    pub drapes: usize,
    /// Outlines that are fitted or predicted.
    pub outlines: usize,
    /// Root mean square distance of the outlines from the best drapes so far \[m\].
    pub rms_m: f64,
}

/// Where the least squares of a problem ended.
pub(super) struct Solution<'a> {
    pub problem: Problem<'a>,
    pub state: State,
    pub ended: Ended,
    /// The sheets there.
    pub kept: Vec<Kept>,
    /// Which of these are known to stay on a saddle, however they are led.
    pub stays: Vec<bool>,
}

/// The sheets of a fit.
pub(super) struct Sheets<'a> {
    pub followers: Vec<Follower>,
    /// Drapes that were simulated.
    pub simulated: usize,
    pub least_m: f64,
    pub tell: &'a (dyn Fn(Progress) + Sync),
}

impl Sheets<'_> {
    /// Where the least squares of a problem end, from a state to which the sheets belong.
    pub(super) fn solve<'p>(&mut self, problem: Problem<'p>, start: State) -> Solution<'p> {
        let most = self.simulated + problem.options.evaluations * problem.targets.len();
        let end = self.descend(&problem, start, most);
        self.solution(problem, end)
    }

    /// An end to which the sheets belong as they lie.
    pub(super) fn solution<'p>(
        &self,
        problem: Problem<'p>,
        (state, ended): (State, Ended),
    ) -> Solution<'p> {
        let stays = vec![false; problem.targets.len()];
        Solution { problem, state, ended, kept: keep(&self.followers), stays }
    }

    /// Steps from a state, to which the sheets belong, as long as they lower the cost.
    pub(super) fn descend(
        &mut self,
        problem: &Problem<'_>,
        mut best: State,
        most: usize,
    ) -> (State, Ended) {
        if problem.options.hold_per_m > 0.0 {
            let kept = keep(&self.followers);
            // held by the outlines as their poses have them by now
            match self.moved(problem, &best.shared, &best) {
                Some(state) => best = state,
                None => return_to(&mut self.followers, &kept),
            }
        }
        descend(&mut Steps { sheets: self, problem }, best, most)
    }

    /// Sheets of a cloth guided by the outlines anew, and the least squares around them; `None`,
    /// and the sheets as they were, where one does not come to rest.
    pub(super) fn guided(
        &mut self,
        problem: &Problem<'_>,
        shared: &[f64],
        poses: &[Pose],
    ) -> Option<State> {
        self.simulated += problem.targets.len();
        let cloth = problem.cloth(shared);
        let guided = Continuation::of(problem, &cloth).all(&problem.targets, poses);
        let sheets: Option<Vec<Sheet>> = guided.into_iter().map(Result::ok).collect();
        let (followers, predictions): (Vec<_>, Vec<_>) = sheets?.into_iter().unzip();
        self.followers = followers;
        Some(problem.around(shared, predictions, poses))
    }

    /// The sheets brought to another cloth, held by their outlines in the poses of the state
    /// before, and the least squares around them; `None` where one does not come to rest there. A
    /// sheet that lost its fold on the way, or does not find it, is guided by its outline again.
    fn moved(&mut self, problem: &Problem<'_>, shared: &[f64], before: &State) -> Option<State> {
        self.simulated += self.followers.len();
        let (cloth, poses) = (problem.cloth(shared), before.poses());
        let continuation = Continuation::of(problem, &cloth);
        let both = self.followers.par_iter_mut().zip(&problem.targets).zip(&poses);
        let predictions: Option<Vec<Prediction>> = both
            .map(|((sheet, target), pose)| {
                let way = continuation.steadily_on(sheet, target, pose);
                way.ok().or_else(|| {
                    *sheet = continuation.laid(target, pose, problem.options.sim.vertices);
                    continuation.seen(sheet, target, pose).ok()
                })
            })
            .collect();
        let mut state = problem.around(shared, predictions?, &poses);
        let costs = state.costs().into_iter().zip(before.costs()).enumerate();
        let lost = costs.filter(|(_, (cost, before))| *cost > LOST[0] * before + LOST[1]);
        let lost: Vec<usize> = lost.map(|(k, _)| k).collect();
        if !lost.is_empty() {
            state = self.recovered(problem, shared, state, &lost);
        }
        let squared: f64 =
            state.drapes.iter().map(|draped| rms_m(&draped.residuals.rows).powi(2)).sum();
        self.least_m = self.least_m.min((squared / state.drapes.len() as f64).sqrt());
        let (drapes, outlines) = (self.simulated, problem.targets.len());
        (self.tell)(Progress { drapes, outlines, rms_m: self.least_m });
        Some(state)
    }

    /// The same state with some sheets guided by their outlines again, where that brings them
    /// nearer.
    fn recovered(
        &mut self,
        problem: &Problem<'_>,
        shared: &[f64],
        state: State,
        lost: &[usize],
    ) -> State {
        self.simulated += lost.len();
        let cloth = problem.cloth(shared);
        let continuation = Continuation::of(problem, &cloth);
        let again = lost.par_iter().map(|&k| {
            let (target, pose) = (&problem.targets[k], &state.drapes[k].pose);
            let (mut sheet, _) = continuation.guided(target, pose).ok()?;
            let prediction = continuation.on(&mut sheet, target, pose).ok()?;
            Some((sheet, prediction))
        });
        let again: Vec<Option<Sheet>> = again.collect();
        let (costs, all_poses) = (state.costs(), state.poses());
        let mut predictions = state.into_predictions();
        for (&k, sheet) in lost.iter().zip(again) {
            let Some((sheet, prediction)) = sheet else { continue };
            let one = problem.to(vec![problem.targets[k].clone()]);
            let alone = one.around(shared, vec![prediction.clone()], &[all_poses[k]]);
            if alone.costs()[0] < costs[k] {
                self.followers[k] = sheet;
                predictions[k] = prediction;
            }
        }
        problem.around(shared, predictions, &all_poses)
    }
}

/// Sheets on their way, and the least squares that lead them.
struct Steps<'s, 'a> {
    sheets: &'s mut Sheets<'a>,
    problem: &'s Problem<'s>,
}

impl Descent for Steps<'_, '_> {
    type Drape = Draped;

    fn sheets(&mut self) -> &mut [Follower] {
        &mut self.sheets.followers
    }

    fn simulated(&self) -> usize {
        self.sheets.simulated
    }

    fn step(&self, from: &State, damping: f64) -> Option<Step> {
        self.problem.step(from, damping)
    }

    /// A share of the cost: more where scanned sheets say that the model is not theirs.
    fn least_gain(&self, from: &State) -> f64 {
        let Problem { targets, options, .. } = self.problem;
        let held = targets.iter().all(|target| target.is_held(options));
        let share = LEAST_SHARE[usize::from(held && from.misfit() >= MUCH)];
        LEAST_GAIN.max(share * from.cost)
    }

    fn brought(&mut self, step: &Step, from: &State) -> Moved<Draped> {
        Moved::to(self.sheets.moved(self.problem, &step.to, from), from)
    }
}

/// The predicted fall of the cost, as a share of it, that is not worth a round of drapes: usually,
/// and where the model is not that of the sheets.
const LEAST_SHARE: [f64; 2] = [1e-3, 2e-2];
/// Part of its cost, and cost, by which a drape's must rise in a step for its sheet to count as off
/// its fold.
const LOST: [f64; 2] = [1.2, 15.0];

//! The fabric whose drapes, seen from above, lie closest to measured outlines, plain or with
//! effects.
//!
//! Each outline guides a sheet to its branch and holds it there by weak springs
//! (`continuation.rs`); at rest on them, the sheet is continued from fabric to fabric. A scanned
//! sheet is held to its scan, and laid once on finer cells, so that it is known what cells do to
//! it; a given rim guides a sheet that nothing holds. Levenberg-Marquardt over the logarithms of
//! the six stiffnesses and the sizes of the effects that are asked for, shared by all drapes, and
//! the pose of each, with the prior's Gaussian on the former. Where the steps end, the outlines
//! lead sheets of the fabric found, and the steps continue as long as that gains.
//!
//! The first fabric is the prior's mean with its bending scaled to the outlines' drape coefficient,
//! so that the sheets are not brought to folds that they cannot hold.
//!
//! Why they are held: released, sheets leave the measured arrangement of folds for nearly regular
//! waves with any outline ([calibration.md](../../docs/design/calibration.md)), and a
//! comparison over branches says little about a fabric.
//!
//! Where it fails: tied drapes differ less from their outlines than free ones would, in all but
//! their mean extent, which is free; the force of the springs ([`Comparison::springs_share`]) says
//! what that cost. A drape that does not come to rest is left out of the fit, and the result says
//! so.

use rayon::prelude::*;

use super::comparison::Comparison;
use super::continuation::{Continuation, Sheet};
use super::effect::{Cloth, EFFECTS, Number, SENSOR_EDGE};
use super::equations::{NormalEquations, State, parameters, rms_m, shared_of};
use super::evidence::{Around, Discrepancy, DrapeAround};
use super::fabric_prior::FabricPrior;
use super::first_fabric::first_fabric;
use super::measures::FoldRule;
use super::options::{FitOptions, MUCH};
use super::pose::Pose;
use super::prediction::{Prediction, steadied_prediction_of};
use super::softened::softened;
use super::specimens::specimens_of;
use super::target::{Finer, Rim, Target};
use crate::fabric::STIFFNESSES;
use crate::numeric::moments::{Z90, mean};
use crate::refine::damping::{Damping, LEAST_GAIN, LEAST_MOVE};
use crate::refine::{Ended, RefinedStiffness};
use crate::sim::sensitivity::SensitivityError;
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

/// Why nothing was fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There is no outline.
    #[error("no outline to fit: mark at least one file `fit`")]
    Nothing,
    /// No sheet came to rest.
    #[error(
        "no drape guided by the outlines came to rest ({0}): they may be of another experiment"
    )]
    NeverAtRest(SensitivityError),
}

/// The fabric found.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The fabric, of the density of [`FabricPrior`], and the sizes of the effects that were asked
    /// for.
    pub cloth: Cloth,
    /// Its stiffnesses, paper's order, for the density of [`FabricPrior`]. The intervals are of the
    /// least squares' curvature, the misfit counted in, and have not been held against known
    /// fabrics.
    pub stiffnesses: [RefinedStiffness; STIFFNESSES],
    /// 90 % intervals of the effects' numbers, SI, in the order of [`Cloth::effects`].
    pub intervals90: Vec<[f64; 2]>,
    /// Whether each of these numbers is at an end of what is tried, but for an end at nothing.
    pub at_limit: Vec<bool>,
    /// Each outline beside its drape, or why its sheet was left out.
    pub drapes: Vec<Result<Comparison, SensitivityError>>,
    /// Sum of squared distances in standard deviations, priors' in it.
    pub cost: f64,
    /// Root mean square distance of an independent point in standard deviations.
    pub misfit: f64,
    /// Why the fit ended.
    pub ended: Ended,
    /// Drapes that were simulated.
    pub simulated: usize,
}

/// A fit with the least squares around it, of every effect's numbers.
pub(super) type Found = (Fitted, Around);

/// Outlines with their sheets, and the plain fit to them.
pub struct Fit<'a> {
    targets: Vec<Target>,
    /// For each outline given, why its sheet was left out.
    lost: Vec<Option<SensitivityError>>,
    fabric_prior: &'a FabricPrior,
    options: &'a FitOptions,
    rule: &'a FoldRule,
    tell: &'a (dyn Fn(Progress) + Sync),
    /// The numbers that the plain fit has beside the stiffnesses ([`FitOptions::declared`]).
    declared: Vec<&'static Number>,
    followers: Vec<Follower>,
    /// The sheets of the plain fit.
    kept: Vec<Kept>,
    /// Which of these are known to stay on a saddle, however they are led.
    stays: Vec<bool>,
    plain: State,
    ended: Ended,
    simulated: usize,
    least_m: f64,
}

/// Fits a plain fabric to outlines of its drapes, their mean drape coefficient given \[%\].
///
/// # Errors
/// [`FitError`].
pub fn fit<'a>(
    targets: &[Target],
    fabric_prior: &'a FabricPrior,
    drape_coefficient: f64,
    options: &'a FitOptions,
    rule: &'a FoldRule,
    tell: &'a (dyn Fn(Progress) + Sync),
) -> Result<Fit<'a>, FitError> {
    if targets.is_empty() {
        return Err(FitError::Nothing);
    }
    let first = first_fabric(targets, fabric_prior, drape_coefficient, options);
    let at_mean = |number: &'static Number| (number, options.mean_of(number));
    let effects = options.declared().into_iter().map(at_mean).collect();
    let cloth = Cloth { effects, ..Cloth::plain(first) };
    let begun = |cloth: &Cloth| Fit::begun(targets, cloth, fabric_prior, options, rule, tell);
    let mut fit = begun(&cloth)?;
    fit.run(&shared_of(&cloth));
    if fit.lost.iter().all(Option::is_none) {
        return Ok(fit);
    }
    // sheets that the first fabric did not bring to rest are guided by the one that the others
    // found
    let nearer = fit.equations(&fit.declared).cloth(&fit.plain.shared);
    match begun(&nearer) {
        Ok(mut again) if again.targets.len() > fit.targets.len() => {
            again.simulated += fit.simulated;
            again.run(&shared_of(&nearer));
            Ok(again)
        }
        _ => Ok(fit),
    }
}

impl<'a> Fit<'a> {
    /// The sheets of a cloth that outlines brought to rest, before the first step of a fit.
    fn begun(
        targets: &[Target],
        cloth: &Cloth,
        fabric_prior: &'a FabricPrior,
        options: &'a FitOptions,
        rule: &'a FoldRule,
        tell: &'a (dyn Fn(Progress) + Sync),
    ) -> Result<Self, FitError> {
        let declared = options.declared();
        let poses: Vec<Pose> = targets.iter().map(Target::first_pose).collect();
        let guided =
            Continuation { cloth, options, asked: &parameters(&declared) }.all(targets, &poses);
        let (mut own, mut sheets, mut lost) = (Vec::new(), Vec::new(), Vec::new());
        for (target, sheet) in targets.iter().zip(guided) {
            lost.push(sheet.as_ref().err().cloned());
            if let Ok(sheet) = sheet {
                own.push(target.clone());
                sheets.push(sheet);
            }
        }
        if let (true, Some(Some(error))) = (sheets.is_empty(), lost.first().cloned()) {
            return Err(FitError::NeverAtRest(error));
        }
        let (followers, predictions): (Vec<_>, Vec<_>) = sheets.into_iter().unzip();
        let equations =
            NormalEquations { targets: &own, fabric_prior, options, numbers: &declared };
        let poses = own.iter().map(Target::first_pose).collect();
        let plain = equations.around(&shared_of(cloth), predictions, poses);
        Ok(Self {
            kept: followers.iter().map(Follower::keep).collect(),
            stays: vec![false; followers.len()],
            targets: own,
            ended: Ended::Spent,
            least_m: f64::INFINITY,
            simulated: targets.len(),
            declared,
            followers,
            lost,
            plain,
            fabric_prior,
            options,
            rule,
            tell,
        })
    }
}

impl Fit<'_> {
    /// The plain fit, from the first sheets on.
    fn run(&mut self, first: &[f64]) {
        let most = self.options.evaluations * self.targets.len();
        let declared = self.declared.clone();
        let (state, ended) = self.descend(&declared, self.plain.clone(), self.simulated + most);
        (self.plain, self.ended) = (state, ended);
        self.keep();
        let mut guided_with = first.to_vec();
        for _ in 1..LEADINGS {
            // the outlines again, with a fabric that is nearer: the branches may be others
            let off = self.plain.shared.iter().zip(&guided_with).map(|(a, b)| (a - b).abs());
            if off.take(STIFFNESSES).skip(STIFFNESSES / 2).fold(0.0, f64::max) < NEAR {
                break;
            }
            guided_with.clone_from(&self.plain.shared);
            let Some(state) = self.guided(&declared, &guided_with) else { break };
            let (state, ended) = self.descend(&declared, state, self.simulated + most);
            let gained = self.plain.cost - state.cost;
            if gained > 0.0 {
                (self.plain, self.ended) = (state, ended);
                self.keep();
            }
            if gained < LED_GAIN {
                break;
            }
        }
        self.restore();
        self.look_finer();
    }

    /// Lays the tied sheets on finer cells once, with the plain cloth: what these move them by is
    /// what cells do, and no effect. Then continues with the plain fit.
    fn look_finer(&mut self) {
        let declared = self.declared.clone();
        let cloth = self.equations(&declared).cloth(&self.plain.shared);
        let finer = self.finer(&cloth, &self.plain);
        if finer.iter().all(Option::is_none) {
            return;
        }
        self.targets.iter_mut().zip(finer).for_each(|(target, finer)| target.finer = finer);
        let most = self.simulated + self.options.evaluations * self.targets.len();
        if let Some(state) = self.state_with(&declared) {
            (self.plain, self.ended) = self.descend(&declared, state, most);
            self.keep();
        }
        self.restore();
    }

    /// What finer cells do to the sheets of a cloth.
    fn finer(&self, cloth: &Cloth, state: &State) -> Vec<Option<Box<Finer>>> {
        let all = self.targets.par_iter().zip(&state.poses).zip(&state.predictions);
        let continuation = Continuation { cloth, options: self.options, asked: &[] };
        all.map(|((target, pose), prediction)| continuation.finer(target, pose, prediction))
            .collect()
    }

    /// For each outline given, whether its sheet was left out.
    #[must_use]
    pub fn lost(&self) -> Vec<bool> {
        self.lost.iter().map(Option::is_some).collect()
    }

    /// The prior of the discrepancy of what was measured from drapes of the model; of pictures it
    /// follows from the distance of two captures of one drape \[m\].
    pub(super) fn usual(&self, captures_m: Option<f64>) -> Discrepancy {
        let rims: Vec<&Rim> = self.targets.iter().filter_map(|t| t.rim.as_deref()).collect();
        let noise_m: Vec<f64> = rims.iter().map(|rim| rim.boundary.mean_sigma_m()).collect();
        let model_m = self.options.scan_model_m;
        match &rims[..] {
            [] => {
                let sigma_m = self.options.outline_m.hypot(self.options.model_m);
                Discrepancy::of_pictures(captures_m, sigma_m)
            }
            rims if rims.iter().all(|rim| rim.sheet.is_some()) => {
                Discrepancy::usual(mean(&noise_m), model_m)
            }
            _ => Discrepancy::of_rims(mean(&noise_m), model_m),
        }
    }

    /// The numbers of effects that are declared to be known no better: a part of every fit, and no
    /// effects.
    #[must_use]
    pub fn declared(&self) -> &[&'static Number] {
        &self.declared
    }

    /// Root mean square distance of an independent point of the plain fit in standard deviations.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        self.plain.misfit()
    }

    /// What was found without effects.
    #[must_use]
    pub fn plain(&self) -> Fitted {
        self.fitted(&self.declared, self.plain.clone(), self.ended)
    }

    /// The least squares around the plain fit's drapes with more unknowns; `None` where a sheet has
    /// no sensitivities to them.
    pub(super) fn state_with(&mut self, numbers: &[&'static Number]) -> Option<State> {
        self.restore();
        let (plain, declared) = (self.plain.clone(), self.declared.clone());
        self.with_more(&plain, &declared, numbers)
    }

    /// The least squares around a state, to whose numbers the sheets are led, with more unknowns;
    /// `None` where a sheet has no sensitivities to them.
    fn with_more(
        &mut self,
        state: &State,
        own: &[&'static Number],
        numbers: &[&'static Number],
    ) -> Option<State> {
        let asked = parameters(numbers);
        let cloth = self.equations(own).cloth(&state.shared);
        let continuation = Continuation { cloth: &cloth, options: self.options, asked: &asked };
        let sheets = self.followers.par_iter_mut().zip(&self.targets);
        let both = sheets.zip(&state.poses).zip(&self.stays);
        let predictions: Option<Vec<Prediction>> = both
            .map(|(((sheet, target), pose), stays)| match stays {
                true => steadied_prediction_of(sheet, &asked, target.compared()).ok(),
                false => continuation.seen(sheet, target, pose).ok(),
            })
            .collect();
        let predictions = predictions?;
        self.stays = predictions.iter().map(|prediction| prediction.is_steadied).collect();
        let shared = extended(&state.shared, own, numbers);
        Some(self.equations(numbers).around(&shared, predictions, state.poses.clone()))
    }

    /// The least squares around the plain fit with every number of some effects.
    pub(super) fn around_plain(&mut self, numbers: Vec<&'static Number>) -> Option<Around> {
        let state = self.state_with(&numbers)?;
        Some(self.around_state(numbers, &state))
    }

    /// The least squares around a state, to which the sheets are led, with every effect's numbers;
    /// `None` where a sheet has no sensitivities to them.
    fn around_found(&mut self, state: &State, own: &[&'static Number]) -> Option<Around> {
        let stays = std::mem::replace(&mut self.stays, vec![false; self.followers.len()]);
        let numbers: Vec<_> =
            EFFECTS.iter().chain([&SENSOR_EDGE]).flat_map(|e| e.numbers).collect();
        let state = self.with_more(state, own, &numbers);
        self.stays = stays;
        Some(self.around_state(numbers, &state?))
    }

    fn around_state(&self, numbers: Vec<&'static Number>, state: &State) -> Around {
        let equations = self.equations(&numbers);
        let (precision, _, _) = equations.prior(&state.shared);
        let off = equations.off(&state.shared);
        let drapes = self.targets.iter().zip(&state.residuals).zip(&state.poses);
        let drapes = drapes.map(|((target, residuals), pose)| DrapeAround {
            sums: equations.sums_of(residuals),
            pose: equations.pose_prior(target, pose),
            is_picture: target.rim.is_none(),
        });
        let drapes = drapes.collect();
        let ends = equations.limits();
        let room = ends.iter().zip(&state.shared).map(|(ends, at)| ends.map(|end| end - at));
        let room = room.collect();
        let specimens: Vec<Option<&str>> =
            self.targets.iter().map(|target| target.specimen.as_deref()).collect();
        Around { drapes, specimens: specimens_of(&specimens), precision, off, room, numbers }
    }

    /// The fit with some effects' numbers, from the plain one on; `None` where a sheet has no
    /// sensitivities to them.
    pub fn with(&mut self, numbers: &[&'static Number]) -> Option<Fitted> {
        let (state, ended) = self.descended(numbers)?;
        Some(self.fitted(numbers, state, ended))
    }

    /// The same with the least squares around it.
    pub(super) fn found(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let (state, ended) = self.descended(numbers)?;
        let around = self.around_found(&state, numbers)?;
        Some((self.fitted(numbers, state, ended), around))
    }

    fn descended(&mut self, numbers: &[&'static Number]) -> Option<(State, Ended)> {
        let state = self.state_with(numbers)?;
        let most = self.simulated + self.options.evaluations * self.targets.len();
        Some(self.descend(numbers, state, most))
    }

    /// The plain fit with the least squares around it, of every effect's numbers.
    pub(super) fn plain_found(&mut self) -> Option<Found> {
        self.restore();
        let (state, own) = (self.plain.clone(), self.declared.clone());
        let around = self.around_found(&state, &own)?;
        Some((self.plain(), around))
    }

    /// The fit with some effects' numbers, softening among them, from sheets led with the cloth
    /// that balances the forces on the plain fit's sheets (`softened.rs`), and with what finer
    /// cells do to that cloth; `None` where nothing softens, or a sheet does not come to rest.
    pub(super) fn softened(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let state = self.state_with(numbers)?;
        let shared = softened(&state, numbers, &self.equations(numbers).limits())?;
        self.around_shared(numbers, &shared, Self::plain_found)?
    }

    /// Does something with the fit around the cloth of another one, whose effects' numbers are
    /// unknowns of the model there as those declared are, its sheets started anew; `None` where one
    /// does not come to rest.
    pub(super) fn around<T>(
        &mut self,
        numbers: &[&'static Number],
        from: &Fitted,
        act: impl FnOnce(&mut Self) -> T,
    ) -> Option<T> {
        self.around_shared(numbers, &shared_of(&from.cloth), act)
    }

    /// The same around a cloth of some shared unknowns: what finer cells do to it is known before
    /// the first step.
    fn around_shared<T>(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
        act: impl FnOnce(&mut Self) -> T,
    ) -> Option<T> {
        let finer: Vec<_> = self.targets.iter().map(|target| target.finer.clone()).collect();
        let done = self.finely_guided(numbers, shared).map(|(state, ended)| {
            let (kept, stays) = (std::mem::take(&mut self.kept), self.stays.clone());
            self.keep();
            let plain = std::mem::replace(&mut self.plain, state);
            let declared = std::mem::replace(&mut self.declared, numbers.to_vec());
            let ended = std::mem::replace(&mut self.ended, ended);
            let done = act(self);
            (self.plain, self.kept, self.stays) = (plain, kept, stays);
            (self.declared, self.ended) = (declared, ended);
            done
        });
        self.targets.iter_mut().zip(finer).for_each(|(target, finer)| target.finer = finer);
        self.restore();
        done
    }

    /// Where the least squares end from sheets started anew with some shared unknowns, with what
    /// finer cells do to that cloth.
    fn finely_guided(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
    ) -> Option<(State, Ended)> {
        let state = self.guided(numbers, shared)?;
        let cloth = self.equations(numbers).cloth(shared);
        let finer = self.finer(&cloth, &state);
        let both = self.targets.iter_mut().zip(finer);
        both.filter(|(_, finer)| finer.is_some()).for_each(|(target, finer)| target.finer = finer);
        let state = self.equations(numbers).around(shared, state.predictions, state.poses);
        let most = self.simulated + self.options.evaluations * self.targets.len();
        Some(self.descend(numbers, state, most))
    }

    /// Sheets of a cloth guided by the outlines anew, in the plain fit's poses, and the least
    /// squares around them; `None`, and the sheets as they were, where one does not come to rest.
    fn guided(&mut self, numbers: &[&'static Number], shared: &[f64]) -> Option<State> {
        let cloth = self.equations(numbers).cloth(shared);
        let poses = self.plain.poses.clone();
        let asked = parameters(numbers);
        self.simulated += self.targets.len();
        let continuation = Continuation { cloth: &cloth, options: self.options, asked: &asked };
        let guided = continuation.all(&self.targets, &poses);
        let sheets: Option<Vec<Sheet>> = guided.into_iter().map(Result::ok).collect();
        let (followers, predictions): (Vec<_>, Vec<_>) = sheets?.into_iter().unzip();
        self.followers = followers;
        Some(self.equations(numbers).around(shared, predictions, poses))
    }

    pub(super) fn equations<'b>(&'b self, numbers: &'b [&'static Number]) -> NormalEquations<'b> {
        NormalEquations {
            targets: &self.targets,
            fabric_prior: self.fabric_prior,
            options: self.options,
            numbers,
        }
    }

    /// The sheets as they lie are those of the plain fit.
    fn keep(&mut self) {
        self.kept = self.followers.iter().map(Follower::keep).collect();
        self.stays.fill(false);
    }

    /// Puts the sheets of the plain fit back.
    fn restore(&mut self) {
        self.followers.iter_mut().zip(&self.kept).for_each(|(sheet, kept)| sheet.return_to(kept));
    }

    fn return_to(&mut self, kept: &[Kept]) {
        self.followers.iter_mut().zip(kept).for_each(|(sheet, kept)| sheet.return_to(kept));
    }

    /// Steps from a state, to which the followers' sheets belong, as long as they lower the cost.
    fn descend(
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
    fn least_share(&self, state: &State) -> f64 {
        let held = self.targets.iter().all(|target| target.is_held(self.options));
        LEAST_SHARE[usize::from(held && state.misfit() >= MUCH)]
    }

    /// The sheets brought to another cloth, held by their outlines in the poses of the state
    /// before, and the least squares around them; `None` where one does not come to rest there. A
    /// sheet that lost its fold on the way, or does not find it, is guided by its outline again.
    fn moved(
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
    fn recovered(
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

    fn fitted(&self, numbers: &[&'static Number], state: State, ended: Ended) -> Fitted {
        let equations = self.equations(numbers);
        let misfit = state.misfit();
        let precision = &state.normal / misfit.max(1.0).powi(2) + &state.priors;
        let size = precision.nrows();
        let covariance = precision.cholesky();
        let covariance =
            covariance.map(|factor| factor.solve(&nalgebra::DMatrix::identity(size, size)));
        let sigma_of =
            |k: usize, prior: f64| covariance.as_ref().map_or(prior, |c| c[(k, k)].sqrt());
        let stiffnesses = std::array::from_fn(|k| {
            let prior = equations.fabric_prior.covariance[(k, k)].sqrt();
            let sigmas = [sigma_of(k, prior), prior];
            RefinedStiffness::of(k, state.shared[k], sigmas, equations.fabric_prior.ln_limits[k])
        });
        let cloth = equations.cloth(&state.shared);
        let interval = |(k, (number, value)): (usize, &(&Number, f64))| {
            let half = Z90 * number.sigma * sigma_of(STIFFNESSES + k, 1.0);
            [value - half, value + half]
        };
        let intervals90 = cloth.effects.iter().enumerate().map(interval).collect();
        let is_at_limit = |(number, value): &(&Number, f64)| {
            let ends = self.options.limits_of(number).map(|end| end * number.sigma);
            ends.into_iter().any(|end| end != 0.0 && (value - end).abs() < 1e-6 * number.sigma)
        };
        let at_limit = cloth.effects.iter().map(is_at_limit).collect();
        let (cost, simulated) = (state.cost, self.simulated);
        let State { predictions, poses, residuals, .. } = state;
        let drapes = self.targets.iter().zip(predictions).zip(poses).zip(residuals);
        let mut drapes = drapes.map(|(((target, prediction), pose), residuals)| {
            Comparison::of(
                target,
                prediction,
                (pose, cloth.view()),
                residuals,
                self.options,
                self.rule,
            )
        });
        let drapes = self.lost.iter().filter_map(|lost| match lost {
            Some(error) => Some(Err(error.clone())),
            None => drapes.next().map(Ok),
        });
        let drapes = drapes.collect();
        Fitted { cloth, stiffnesses, intervals90, at_limit, drapes, cost, misfit, ended, simulated }
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

/// How often the outlines lead at most, and the fall of the cost for which they do so again.
const LEADINGS: usize = 2;
const LED_GAIN: f64 = 1.0;
/// Change of a logarithm of bending within which the sheets that the outlines led stay what they
/// are.
const NEAR: f64 = 0.2;
/// The shares of the cost that [`Fit::least_share`] gives.
const LEAST_SHARE: [f64; 2] = [1e-3, 2e-2];
/// Part of its cost, and cost, by which a drape's must rise in a step for its sheet to count as off
/// its fold.
const LOST: [f64; 2] = [1.2, 15.0];

mod starts;
#[cfg(test)]
mod tests;

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

mod descent;
mod effects;
mod starts;

pub use descent::Progress;
use descent::{Sheets, Solution};
use rayon::prelude::*;

use super::comparison::Comparison;
use super::continuation::Continuation;
use super::effect::{Cloth, Number};
use super::equations::{Draped, Problem, State, shared_of};
use super::evidence::{Around, Discrepancy};
use super::fabric_prior::FabricPrior;
use super::first_fabric::first_fabric;
use super::measures::FoldRule;
use super::options::FitOptions;
use super::pose::Pose;
use super::target::{Finer, Rim, Target};
use crate::fabric::STIFFNESSES;
use crate::inverse::{Ended, RefinedStiffness};
use crate::numeric::moments::{Z90, mean};
use crate::sim::sensitivity::SensitivityError;

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
    /// For each outline given, why its sheet was left out.
    lost: Vec<Option<SensitivityError>>,
    rule: &'a FoldRule,
    sheets: Sheets<'a>,
    /// Unknown in it are, beside the stiffnesses, the numbers that are declared to be known no
    /// better ([`FitOptions::declared`]).
    plain: Solution<'a>,
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
    let numbers = options.declared();
    let effects = numbers.iter().map(|number| (*number, options.mean_of(number))).collect();
    let first = first_fabric(targets, fabric_prior, drape_coefficient, options);
    let cloth = Cloth { effects, ..Cloth::plain(first) };
    let problem = Problem { targets: targets.to_vec(), numbers, fabric_prior, options };
    let mut fit = Fit::begun(&problem, &cloth, rule, tell)?;
    fit.run(&shared_of(&cloth));
    if fit.lost.iter().all(Option::is_none) {
        return Ok(fit);
    }
    // sheets that the first fabric did not bring to rest are guided by the one that the others
    // found
    let nearer = problem.cloth(&fit.plain.state.shared);
    match Fit::begun(&problem, &nearer, rule, tell) {
        Ok(mut again) if again.sheets.followers.len() > fit.sheets.followers.len() => {
            again.sheets.simulated += fit.sheets.simulated;
            again.run(&shared_of(&nearer));
            Ok(again)
        }
        _ => Ok(fit),
    }
}

impl<'a> Fit<'a> {
    /// The sheets of a cloth that outlines brought to rest, before the first step of a fit.
    fn begun(
        problem: &Problem<'a>,
        cloth: &Cloth,
        rule: &'a FoldRule,
        tell: &'a (dyn Fn(Progress) + Sync),
    ) -> Result<Self, FitError> {
        let poses: Vec<Pose> = problem.targets.iter().map(Target::first_pose).collect();
        let guided = Continuation::of(problem, cloth).all(&problem.targets, &poses);
        let simulated = guided.len();
        let lost: Vec<_> = guided.iter().map(|sheet| sheet.as_ref().err().cloned()).collect();
        if let (true, Some(Some(error))) = (lost.iter().all(Option::is_some), lost.first()) {
            return Err(FitError::NeverAtRest(error.clone()));
        }
        let own = problem.targets.iter().zip(&lost).filter(|(_, lost)| lost.is_none());
        let problem = problem.to(own.map(|(target, _)| target.clone()).collect());
        let (followers, predictions): (Vec<_>, Vec<_>) = guided.into_iter().flatten().unzip();
        let poses: Vec<Pose> = problem.targets.iter().map(Target::first_pose).collect();
        let state = problem.around(&shared_of(cloth), predictions, &poses);
        let sheets = Sheets { followers, simulated, least_m: f64::INFINITY, tell };
        let plain = sheets.solution(problem, (state, Ended::Spent));
        Ok(Self { lost, rule, sheets, plain })
    }

    /// The plain fit, from the first sheets on.
    fn run(&mut self, first: &[f64]) {
        let Self { sheets, plain, .. } = self;
        *plain = sheets.solve(plain.problem.clone(), plain.state.clone());
        let mut guided_with = first.to_vec();
        for _ in 1..LEADINGS {
            // the outlines again, with a fabric that is nearer: the branches may be others
            let off = plain.state.shared.iter().zip(&guided_with).map(|(a, b)| (a - b).abs());
            if off.take(STIFFNESSES).skip(STIFFNESSES / 2).fold(0.0, f64::max) < NEAR {
                break;
            }
            guided_with.clone_from(&plain.state.shared);
            let guided = sheets.guided(&plain.problem, &guided_with, &plain.state.poses());
            let Some(state) = guided else { break };
            let led = sheets.solve(plain.problem.clone(), state);
            let gained = plain.state.cost - led.state.cost;
            if gained > 0.0 {
                *plain = led;
            }
            if gained < LED_GAIN {
                break;
            }
        }
        self.look_finer();
    }

    /// Lays the tied sheets on finer cells once, with the plain cloth: what these move them by is
    /// what cells do, and no effect. Then continues with the plain fit.
    fn look_finer(&mut self) {
        let Solution { problem, state, .. } = &mut self.plain;
        let finer = finer(problem, &state.shared, state);
        if finer.iter().all(Option::is_none) {
            return;
        }
        problem.targets.iter_mut().zip(finer).for_each(|(target, finer)| target.finer = finer);
        let numbers = problem.numbers.clone();
        if let Some(solution) = self.solved_with(&numbers) {
            self.plain = solution;
        }
    }
}

/// What finer cells do to the sheets of a cloth.
fn finer(problem: &Problem<'_>, shared: &[f64], state: &State) -> Vec<Option<Box<Finer>>> {
    let cloth = problem.cloth(shared);
    let continuation = Continuation::of(problem, &cloth);
    let finer = |(target, draped): (&Target, &Draped)| {
        continuation.finer(target, &draped.pose, &draped.prediction)
    };
    problem.targets.par_iter().zip(&state.drapes).map(finer).collect()
}

impl Fit<'_> {
    /// For each outline given, whether its sheet was left out.
    #[must_use]
    pub fn lost(&self) -> Vec<bool> {
        self.lost.iter().map(Option::is_some).collect()
    }

    /// The prior of the discrepancy of what was measured from drapes of the model; of pictures it
    /// follows from the distance of two captures of one drape \[m\].
    pub(super) fn usual(&self, captures_m: Option<f64>) -> Discrepancy {
        let Problem { targets, options, .. } = &self.plain.problem;
        let rims: Vec<&Rim> = targets.iter().filter_map(|t| t.rim.as_deref()).collect();
        let noise_m: Vec<f64> = rims.iter().map(|rim| rim.boundary.mean_sigma_m()).collect();
        match &rims[..] {
            [] => {
                let sigma_m = options.outline_m.hypot(options.model_m);
                Discrepancy::of_pictures(captures_m, sigma_m)
            }
            rims if rims.iter().all(|rim| rim.sheet.is_some()) => {
                Discrepancy::usual(mean(&noise_m), options.scan_model_m)
            }
            _ => Discrepancy::of_rims(mean(&noise_m), options.scan_model_m),
        }
    }

    /// The numbers of effects that are declared to be known no better: a part of every fit, and no
    /// effects.
    #[must_use]
    pub fn declared(&self) -> &[&'static Number] {
        &self.plain.problem.numbers
    }

    /// Root mean square distance of an independent point of the plain fit in standard deviations.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        self.plain.state.misfit()
    }

    /// What was found without effects.
    #[must_use]
    pub fn plain(&self) -> Fitted {
        self.fitted(&self.plain)
    }

    fn fitted(&self, solution: &Solution<'_>) -> Fitted {
        let Solution { problem, state, ended, .. } = solution;
        let Problem { targets, fabric_prior, options, .. } = problem;
        let misfit = state.misfit();
        let covariance = state.covariance(misfit.max(1.0));
        let sigma_of =
            |k: usize, prior: f64| covariance.as_ref().map_or(prior, |c| c[(k, k)].sqrt());
        let stiffnesses = std::array::from_fn(|k| {
            let prior = fabric_prior.covariance[(k, k)].sqrt();
            let sigmas = [sigma_of(k, prior), prior];
            RefinedStiffness::of(k, state.shared[k], sigmas, fabric_prior.ln_limits[k])
        });
        let cloth = problem.cloth(&state.shared);
        let interval = |(k, (number, value)): (usize, &(&Number, f64))| {
            let half = Z90 * number.sigma * sigma_of(STIFFNESSES + k, 1.0);
            [value - half, value + half]
        };
        let intervals90 = cloth.effects.iter().enumerate().map(interval).collect();
        let is_at_limit = |(number, value): &(&Number, f64)| {
            let ends = options.limits_of(number).map(|end| end * number.sigma);
            ends.into_iter().any(|end| end != 0.0 && (value - end).abs() < 1e-6 * number.sigma)
        };
        let at_limit = cloth.effects.iter().map(is_at_limit).collect();
        let mut drapes = targets.iter().zip(&state.drapes).map(|(target, draped)| {
            Comparison::of(target, draped.clone(), cloth.view(), options, self.rule)
        });
        let drapes = self.lost.iter().filter_map(|lost| match lost {
            Some(error) => Some(Err(error.clone())),
            None => drapes.next().map(Ok),
        });
        let drapes = drapes.collect();
        let (cost, ended, simulated) = (state.cost, *ended, self.sheets.simulated);
        Fitted { cloth, stiffnesses, intervals90, at_limit, drapes, cost, misfit, ended, simulated }
    }
}

/// How often the outlines lead at most, and the fall of the cost for which they do so again.
const LEADINGS: usize = 2;
const LED_GAIN: f64 = 1.0;
/// Change of a logarithm of bending within which the sheets that the outlines led stay what they
/// are.
const NEAR: f64 = 0.2;
#[cfg(test)]
mod tests;

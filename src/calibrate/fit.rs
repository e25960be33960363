//! The fabric whose drapes, seen from above, lie closest to measured outlines.
//!
//! Each outline leads a sheet to its branch ([`DropStart::Outline`]); let go, the sheet comes to rest, and from there it
//! is led from fabric to fabric. Levenberg-Marquardt over the logarithms of the six stiffnesses, shared by all
//! drapes, and the pose of each, with the prior's Gaussian on the former. Where the steps end, the outlines lead
//! sheets of the fabric found, and the steps go on as long as that gains.
//!
//! The first fabric is the prior's mean with its bending scaled to the outlines' drape coefficient, so that the sheets are
//! not led to folds that they cannot hold.
//!
//! Where it fails: a sheet that is let go may leave for a neighbouring branch; nothing but the distance that
//! remains tells. A drape that does not come to rest is left out of the fit, and the result says so.

use rayon::prelude::*;

use super::believed::Believed;
use super::measures::{FoldRule, Measures};
use super::squares::{
    FitOptions, PARAMETERS, Pose, Row, Squares, State, Target, picture_of, rms_m,
};
use super::trial::{Trial, trial_of};
use crate::base::Outline;
use crate::base::frame::GRAVITY_M_S2;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::refine::damping::{Damping, LEAST_GAIN, LEAST_MOVE};
use crate::refine::{Ended, RefinedStiffness};
use crate::sim::sensitivity::SensitivityError;
use crate::sim::{Drape, Drop, DropStart, FollowOptions, Follower, Kept};

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
    #[error("no drape led by the outlines came to rest ({0}): they may be of another experiment")]
    NeverAtRest(SensitivityError),
}

/// A measured outline beside the drape of a fabric on its branch.
#[derive(Clone, Debug)]
pub struct Beside {
    /// The drape, at rest.
    pub drape: Drape,
    /// How it lies in the picture.
    pub pose: Pose,
    /// Root mean square distance of the outlines \[m\].
    pub rms_m: f64,
    /// Where they differ, at even steps along the measured outline.
    pub rows: Vec<Row>,
    /// The measured outline around its centroid, in the picture \[m\].
    pub measured: Outline,
    /// The drape's outline there \[m\].
    pub simulated: Outline,
    /// What is counted on the drape's outline, the picture's scale taken out.
    pub measures: Measures,
}

/// The fabric found.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The fabric, of the density of [`Believed`].
    pub fabric: Fabric,
    /// Its stiffnesses, paper's order, for the density of [`Believed`]. The intervals are of the least squares' curvature,
    /// the misfit counted in, and have not been held against known fabrics.
    pub stiffnesses: [RefinedStiffness; STIFFNESSES],
    /// Each outline beside its drape, or why its sheet was left out.
    pub drapes: Vec<Result<Beside, SensitivityError>>,
    /// Root mean square distance of an independent point in standard deviations.
    pub misfit: f64,
    /// Why the fit ended.
    pub ended: Ended,
    /// Drapes that were simulated.
    pub simulated: usize,
}

/// Fits a fabric to outlines of its drapes.
///
/// # Errors
/// [`FitError`].
pub fn fit(
    targets: &[Target],
    believed: &Believed,
    drape_coefficient: f64,
    options: &FitOptions,
    rule: &FoldRule,
    tell: &(dyn Fn(Progress) + Sync),
) -> Result<Fitted, FitError> {
    if targets.is_empty() {
        return Err(FitError::Nothing);
    }
    let mut drapes =
        Drapes { options, tell, simulated: 0, outlines: targets.len(), least_m: f64::INFINITY };
    let fabric = first_fabric(believed, drape_coefficient);
    let led = drapes.led(&fabric, targets);
    let (mut own, mut sheets, mut lost) = (Vec::new(), Vec::new(), Vec::new());
    for (target, sheet) in targets.iter().zip(led) {
        match sheet {
            Ok(sheet) => {
                own.push(target.clone());
                sheets.push(sheet);
                lost.push(None);
            }
            Err(error) => lost.push(Some(error)),
        }
    }
    if let (true, Some(Some(error))) = (sheets.is_empty(), lost.first().cloned()) {
        return Err(FitError::NeverAtRest(error));
    }
    let squares = Squares { targets: &own, believed, options };
    let most = options.evaluations * own.len();
    let mut best = drapes.state(&squares, &fabric, sheets_of(&sheets), first_poses(&own));
    let mut followers: Vec<Follower> = sheets.into_iter().map(|(follower, _)| follower).collect();
    let mut ended = drapes.descend(&squares, &mut best, &mut followers, most);
    for _ in 1..LEADINGS {
        // the outlines again, with a fabric that is nearer: the branches may be others
        let fabric = squares.fabric(&best.ln);
        let again: Result<Vec<_>, _> = drapes.led(&fabric, &own).into_iter().collect();
        let Ok(sheets) = again else { break };
        let mut state = drapes.state(&squares, &fabric, sheets_of(&sheets), best.poses.clone());
        let mut led: Vec<Follower> = sheets.into_iter().map(|(follower, _)| follower).collect();
        let why = drapes.descend(&squares, &mut state, &mut led, drapes.simulated + most);
        let gained = best.cost - state.cost;
        if gained > 0.0 {
            (best, ended) = (state, why);
        }
        if gained < LED_GAIN {
            break;
        }
    }
    Ok(fitted(&squares, best, lost, (ended, drapes.simulated), rule))
}

/// Drapes of one fabric led by outlines, each beside its own.
pub fn predict(
    targets: &[Target],
    believed: &Believed,
    fabric: &Fabric,
    options: &FitOptions,
    rule: &FoldRule,
    tell: &(dyn Fn(Progress) + Sync),
) -> Vec<Result<Beside, SensitivityError>> {
    let mut drapes =
        Drapes { options, tell, simulated: 0, outlines: targets.len(), least_m: f64::INFINITY };
    let led = drapes.led(fabric, targets);
    let beside = |(target, sheet): (&Target, Result<Sheet, SensitivityError>)| {
        let (_, trial) = sheet?;
        let one = [target.clone()];
        let squares = Squares { targets: &one, believed, options };
        let mut state = squares.around(fabric, vec![trial], vec![target.first_pose()]);
        let (trial, rows) = (state.trials.remove(0), state.rows.remove(0));
        Ok(Beside::of(target, trial, state.poses[0], rows, options, rule))
    };
    targets.iter().zip(led).map(beside).collect()
}

/// A sheet at rest and what is seen of it.
type Sheet = (Follower, Trial);

fn sheets_of(sheets: &[Sheet]) -> Vec<Trial> {
    sheets.iter().map(|(_, trial)| trial.clone()).collect()
}

fn first_poses(targets: &[Target]) -> Vec<Pose> {
    targets.iter().map(Target::first_pose).collect()
}

/// The prior's mean, its bending scaled to a drape coefficient \[%\].
fn first_fabric(believed: &Believed, drape_coefficient: f64) -> Fabric {
    let mut ln = believed.ln_mean;
    let [shortest, longest] = LENGTHS_M;
    let length_m = (LENGTH_AT_50_M + LENGTH_PER_PERCENT_M * (drape_coefficient - 50.0))
        .clamp(shortest, longest);
    let wanted = (believed.density_kg_m2 * GRAVITY_M_S2 * length_m.powi(3)).ln();
    let shift = wanted - (ln[3] + ln[4] + ln[5]) / 3.0;
    (3..STIFFNESSES).for_each(|k| ln[k] += shift);
    let ln: [f64; STIFFNESSES] = std::array::from_fn(|k| {
        let [low, high] = believed.ln_limits[k];
        ln[k].clamp(low, high)
    });
    Fabric::from_ln_stiffnesses(&ln, believed.density_kg_m2)
}

/// Bending length over drape coefficient of standard Cusick drapes: roughly a line, `docs/validation.md`.
const LENGTH_AT_50_M: f64 = 18.6e-3;
const LENGTH_PER_PERCENT_M: f64 = 0.36e-3;
const LENGTHS_M: [f64; 2] = [9e-3, 35e-3];
/// How often the outlines lead at most, and the fall of the cost for which they do so again.
const LEADINGS: usize = 3;
const LED_GAIN: f64 = 1.0;

/// Drapes on their way.
struct Drapes<'a> {
    options: &'a FitOptions,
    tell: &'a (dyn Fn(Progress) + Sync),
    simulated: usize,
    outlines: usize,
    least_m: f64,
}

impl Drapes<'_> {
    /// Sheets of a fabric led by the outlines and let go.
    fn led(&mut self, fabric: &Fabric, targets: &[Target]) -> Vec<Result<Sheet, SensitivityError>> {
        let options = &self.options.sim;
        let sheets: Vec<_> = targets
            .par_iter()
            .map(|target| {
                let outline = target.in_plan(&target.first_pose());
                let drop = Drop { start: DropStart::Outline(Box::new(outline)) };
                let mut follower = Follower::drop(fabric, &drop, options);
                let trial = trial_of(&mut follower, &PARAMETERS)?;
                Ok((follower, trial))
            })
            .collect();
        self.simulated += targets.len();
        (self.tell)(Progress {
            drapes: self.simulated,
            outlines: self.outlines,
            rms_m: self.least_m,
        });
        sheets
    }

    fn state(
        &mut self,
        squares: &Squares<'_>,
        fabric: &Fabric,
        trials: Vec<Trial>,
        poses: Vec<Pose>,
    ) -> State {
        let state = squares.around(fabric, trials, poses);
        let squared: f64 = state.rows.iter().map(|rows| rms_m(rows).powi(2)).sum();
        self.least_m = self.least_m.min((squared / state.rows.len() as f64).sqrt());
        (self.tell)(Progress {
            drapes: self.simulated,
            outlines: self.outlines,
            rms_m: self.least_m,
        });
        state
    }

    /// Steps from `best`, to which the sheets of `followers` belong, as long as they lower the cost.
    fn descend(
        &mut self,
        squares: &Squares<'_>,
        best: &mut State,
        followers: &mut [Follower],
        most: usize,
    ) -> Ended {
        let mut kept: Vec<Kept> = followers.iter().map(Follower::keep).collect();
        let mut damping = Damping::first();
        loop {
            if self.simulated >= most {
                return Ended::Spent;
            }
            let Some((ln, foretold)) = squares.step(best, damping.value()) else {
                return Ended::Singular;
            };
            let moved = (0..STIFFNESSES).map(|k| (ln[k] - best.ln[k]).abs()).fold(0.0, f64::max);
            if foretold < LEAST_GAIN || moved < LEAST_MOVE {
                return Ended::Converged;
            }
            let fabric = squares.fabric(&ln);
            let trials = self.followed(&fabric, followers);
            let poses = best.poses.clone();
            let state = trials.map(|trials| self.state(squares, &fabric, trials, poses));
            match state.filter(|state| state.cost < best.cost) {
                Some(state) => {
                    *best = state;
                    kept = followers.iter().map(Follower::keep).collect();
                    damping.lower();
                }
                None if !damping.raise() => return Ended::NoBetter,
                None => {
                    followers.iter_mut().zip(&kept).for_each(|(sheet, kept)| sheet.return_to(kept));
                }
            }
        }
    }

    /// The sheets led to another fabric; `None` where one does not come to rest there.
    fn followed(&mut self, fabric: &Fabric, followers: &mut [Follower]) -> Option<Vec<Trial>> {
        self.simulated += followers.len();
        let follow = |follower: &mut Follower| {
            let way = follower.follow_fabric(fabric, &FollowOptions::default()).ok()?;
            if way.reached < 1.0 {
                return None;
            }
            trial_of(follower, &PARAMETERS).ok()
        };
        followers.par_iter_mut().map(follow).collect()
    }
}

impl Beside {
    fn of(
        target: &Target,
        trial: Trial,
        pose: Pose,
        rows: Vec<Row>,
        options: &FitOptions,
        rule: &FoldRule,
    ) -> Self {
        Self {
            rms_m: rms_m(&rows),
            measured: target.outline.clone(),
            simulated: trial.outline.mapped(|p| picture_of(p, &pose)),
            measures: Measures::of(&trial.outline, &options.sim.experiment, rule),
            drape: trial.drape,
            pose,
            rows,
        }
    }
}

fn fitted(
    squares: &Squares<'_>,
    state: State,
    lost: Vec<Option<SensitivityError>>,
    (ended, simulated): (Ended, usize),
    rule: &FoldRule,
) -> Fitted {
    let misfit = state.misfit();
    let precision = &state.normal / misfit.max(1.0).powi(2) + &state.priors;
    let size = precision.nrows();
    let covariance =
        precision.cholesky().map(|factor| factor.solve(&nalgebra::DMatrix::identity(size, size)));
    let fabric = squares.fabric(&state.ln);
    let stiffnesses = std::array::from_fn(|k| {
        let prior = squares.believed.covariance[(k, k)].sqrt();
        let sigma = covariance.as_ref().map_or(prior, |c| c[(k, k)].sqrt());
        RefinedStiffness::of(k, state.ln[k], [sigma, prior], squares.believed.ln_limits[k])
    });
    let State { trials, poses, rows, .. } = state;
    let drapes = squares.targets.iter().zip(trials).zip(poses).zip(rows);
    let mut drapes = drapes.map(|(((target, trial), pose), rows)| {
        Beside::of(target, trial, pose, rows, squares.options, rule)
    });
    let drapes = lost
        .into_iter()
        .filter_map(|lost| match lost {
            Some(error) => Some(Err(error)),
            None => drapes.next().map(Ok),
        })
        .collect();
    Fitted { fabric, stiffnesses, drapes, misfit, ended, simulated }
}

#[cfg(test)]
mod tests;

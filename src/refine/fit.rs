//! The fabric whose drapes lie closest to its scans.
//!
//! Levenberg-Marquardt over the logarithms of the six stiffnesses, shared by all scans, and six numbers of the
//! bench for each scan, with priors on all. The scanned sheet is laid and comes to rest with the first fabric;
//! from there it is led from fabric to fabric, so that the cost is as smooth as the way. Where that ends, the
//! scanned sheet is laid again with the fabric found: continued alone, two of five fits of a trial stuck
//! in a basin beside the scan's. The bench's numbers are small and enter through their sensitivities alone. A
//! place that lies more than a few standard deviations off pulls no harder than one at that distance (Huber 1964).
//!
//! The first start is the prior's mean. Where the sheet does not come to rest with it, others are tried. Tried beside it
//! where it ends badly: the same end, for three times the cost.
//!
//! Where it fails: rims of neighbouring minima lie 0.2 to 2 mm apart, and the least squares see a step there. A step
//! that does not lower the cost is shortened a few times, and the best drape stays.

use rayon::prelude::*;

use super::damping::{Damping, LEAST_GAIN, LEAST_MOVE};
use super::data::{DataOptions, Scan, data_of};
use super::prior::Prior;
use super::refined::{Ended, Refined};
use super::squares::{FitOptions, Squares, State};
use super::trial::{NUISANCES, trial_of};
use crate::base::Surface;
use crate::fabric::STIFFNESSES;
use crate::sim::sensitivity::SensitivityError;
use crate::sim::{Drop, DropStart, FollowOptions, Follower, Kept, SimOptions};

/// Why nothing was fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There is no scan, or none with an observed place.
    #[error("nothing was observed: give at least one scan with a rim")]
    NothingObserved,
    /// No start came to rest.
    #[error(
        "no drape from the scanned sheet came to rest ({0}): the scan may be of another experiment"
    )]
    NeverAtRest(SensitivityError),
}

/// How far a fit is; told after every drape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Drapes so far, all scans and starts together.
    pub drapes: usize,
    /// Mean distance of the rims of the best drapes so far from the scans' \[m\].
    pub rim_m: f64,
}

/// Looks for the fabric of `scans`: one fabric of the given density \[kg/m^2\], dropped once or several times.
/// `others` are starts beside the prior's mean, with their names, for where no sheet comes to rest with it.
///
/// # Errors
/// [`FitError`].
pub fn fit(
    scans: &[Scan<'_>],
    density_kg_m2: f64,
    prior: &Prior,
    others: &[(&'static str, [f64; STIFFNESSES])],
    options: &FitOptions,
    tell: impl Fn(Progress),
) -> Result<Refined, FitError> {
    let mut fit = Fit::new(scans, density_kg_m2, prior, options, &tell);
    if fit.squares.data.iter().all(Vec::is_empty) {
        return Err(FitError::NothingObserved);
    }
    let mut last_error = None;
    for (name, start) in [("estimate", prior.ln_mean)].iter().chain(others) {
        match fit.from(start) {
            Ok((state, ended, drapes)) => {
                return Ok(Refined::of(scans, &fit.squares, state, (name, ended, drapes)));
            }
            Err(error) => last_error = Some(error),
        }
    }
    Err(last_error.map_or(FitError::NothingObserved, FitError::NeverAtRest))
}

/// One scan with what its drapes start from.
struct Target<'a> {
    scan: &'a Scan<'a>,
    start: DropStart,
    options: SimOptions,
}

/// A fit on its way.
struct Fit<'a> {
    targets: Vec<Target<'a>>,
    squares: Squares<'a>,
    /// Vertices on a side of the present cells.
    vertices: usize,
    tell: &'a dyn Fn(Progress),
    drapes: usize,
    least_rim_m: f64,
}

impl<'a> Fit<'a> {
    fn new(
        scans: &'a [Scan<'a>],
        density_kg_m2: f64,
        prior: &'a Prior,
        options: &'a FitOptions,
        tell: &'a dyn Fn(Progress),
    ) -> Self {
        let target = |scan: &'a Scan<'a>| Target {
            scan,
            start: match scan.sheet {
                Some(sheet) => DropStart::Surface(Box::new(sheet.clone())),
                None => DropStart::Guided(Box::new(scan.rim.clone())),
            },
            options: SimOptions { experiment: scan.experiment, ..options.sim },
        };
        let squares = Squares { data: Vec::new(), density_kg_m2, prior, options };
        let targets = scans.iter().map(target).collect();
        let mut fit =
            Self { targets, squares, vertices: 0, tell, drapes: 0, least_rim_m: f64::INFINITY };
        fit.on_cells(options.vertices[1], options.data.model_m);
        fit
    }

    /// The drapes to come are on cells of so many vertices, which lie off by so much.
    fn on_cells(&mut self, vertices: usize, model_m: f64) {
        let options = DataOptions { model_m, ..self.squares.options.data };
        self.vertices = vertices;
        self.squares.data = self.targets.iter().map(|t| data_of(t.scan, &options)).collect();
    }

    /// The best state from `start`, why it ended there and the drapes it took.
    fn from(
        &mut self,
        start: &[f64; STIFFNESSES],
    ) -> Result<(State, Ended, usize), SensitivityError> {
        let (before, options) = (self.drapes, self.squares.options);
        let most = before + options.evaluations * self.targets.len();
        let [few, many] = options.vertices;
        let (mut ln, mut near) = (*start, None);
        if few < many {
            self.on_cells(few, options.first_model_m);
            let (state, _) = self.laid_and_descended(&ln, None, most)?;
            (ln, near) = (state.ln, Some(state));
        }
        self.on_cells(many, options.data.model_m);
        let (mut best, mut ended) = self.laid_and_descended(&ln, near.as_ref(), most)?;
        for _ in 1..LAYINGS {
            if self.drapes + 2 * self.targets.len() > most {
                break;
            }
            // the sheet again with a fabric that is nearer: its branch, and its grips, may be others
            let again = self.laid_and_descended(&best.ln, Some(&best), most);
            let Ok((state, why)) = again else { break };
            let gained = best.cost - state.cost;
            if gained > 0.0 {
                (best, ended) = (state, why);
            }
            if gained < LAID_GAIN {
                break;
            }
        }
        Ok((best, ended, self.drapes - before))
    }

    /// The scanned sheets laid with one fabric, and where the steps from there end.
    fn laid_and_descended(
        &mut self,
        ln: &[f64; STIFFNESSES],
        near: Option<&State>,
        most: usize,
    ) -> Result<(State, Ended), SensitivityError> {
        let mut followers = self.lay(ln);
        let mut state = self.state(&mut followers, near)?;
        let ended = self.descend(&mut state, &mut followers, most);
        Ok((state, ended))
    }

    /// Steps from `best`, to which the sheets of `followers` belong, as long as they lower the cost.
    fn descend(&mut self, best: &mut State, followers: &mut [Follower], most: usize) -> Ended {
        let mut kept: Vec<Kept> = followers.iter().map(Follower::keep).collect();
        let mut damping = Damping::first();
        loop {
            if self.drapes >= most {
                return Ended::Spent;
            }
            let Some((ln, foretold)) = self.squares.step(best, damping.value()) else {
                return Ended::Singular;
            };
            let moved = (0..STIFFNESSES).map(|k| (ln[k] - best.ln[k]).abs()).fold(0.0, f64::max);
            if foretold < LEAST_GAIN || moved < LEAST_MOVE {
                return Ended::Converged;
            }
            let fabric = self.squares.fabric(&ln);
            let how = FollowOptions::default();
            let led = followers.par_iter_mut().all(|follower| {
                follower.follow_fabric(&fabric, &how).is_ok_and(|way| way.reached == 1.0)
            });
            let state = if led { self.state(followers, Some(best)).ok() } else { None };
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

    /// The scanned sheets at rest with the fabric of six logarithms.
    fn lay(&mut self, ln: &[f64; STIFFNESSES]) -> Vec<Follower> {
        let fabric = self.squares.fabric(ln);
        let vertices = self.vertices;
        let lay = |target: &Target| {
            let options = SimOptions { vertices, ..target.options };
            Follower::drop(&fabric, &Drop { start: target.start.clone() }, &options)
        };
        self.targets.par_iter().map(lay).collect()
    }

    /// The least squares around the sheets of `followers`; the bench's numbers begin at those of `near`.
    fn state(
        &mut self,
        followers: &mut [Follower],
        near: Option<&State>,
    ) -> Result<State, SensitivityError> {
        let mut trials = Vec::new();
        let moved: Vec<_> = followers.par_iter_mut().map(trial_of).collect();
        for (target, trial) in self.targets.iter_mut().zip(moved) {
            let trial = trial?;
            if target.scan.sheet.is_none() {
                let sheet = Surface::exact(trial.at.iter().map(|&p| p.into()));
                target.start =
                    sheet.map_or(target.start.clone(), |s| DropStart::Surface(Box::new(s)));
            }
            self.drapes += 1;
            trials.push(trial);
        }
        let distances = self.targets.iter().zip(&trials);
        let sum: f64 = distances.map(|(t, trial)| trial.rim_distance_m(t.scan.rim)).sum();
        let scans = self.targets.len();
        self.least_rim_m = self.least_rim_m.min(sum / scans as f64);
        (self.tell)(Progress { drapes: self.drapes, rim_m: self.least_rim_m });
        let bench = near.map_or_else(|| vec![[0.0; NUISANCES]; scans], |near| near.bench.clone());
        let [ln @ .., _] = followers[0].setup().fabric.in_si().map(f64::ln);
        Ok(self.squares.around(ln, trials, bench))
    }
}

/// How often the scanned sheet is laid at most, and the fall of the cost for which it is laid again.
const LAYINGS: usize = 3;
const LAID_GAIN: f64 = 1.0;
#[cfg(test)]
mod tests;

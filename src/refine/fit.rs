//! The fabric whose drapes lie closest to its scans.
//!
//! Levenberg-Marquardt over the logarithms of the six stiffnesses, shared by all scans, and six numbers of the
//! bench for each scan, with priors on all. The scanned sheet is laid and comes to rest with the first fabric;
//! from there it is led from fabric to fabric, so that the cost is as smooth as the way. Where that ends, the
//! scanned sheet is laid again with the fabric found: continued alone, two of five fits of a trial stuck
//! in a basin beside the scan's. The bench's numbers are small and enter through their sensitivities alone. A
//! place that lies more than a few standard deviations off pulls no harder than one at that distance (Huber 1964).
//!
//! The first start is the prior's mean. Where it ends badly, others are tried, and the best end counts.
//!
//! Where it fails: rims of neighbouring minima lie 0.2 to 2 mm apart, and the least squares see a step there. A step
//! that does not lower the cost is shortened a few times, and the best drape stays.

use nalgebra::{DMatrix, DVector};

use super::data::{DataOptions, Datum, Scan, data_of};
use super::refined::{Attempt, Ended, Refined};
use super::trial::{NUISANCES, Trial, trial_of};
use crate::base::{Boundary, Surface};
#[cfg(feature = "estimate")]
use crate::estimate::Estimate;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::sim::sensitivity::SensitivityError;
use crate::sim::{Drop, DropStart, FollowOptions, Follower, Kept, SimOptions};

/// What is known of the six stiffnesses without the scans' sheets; logarithms of SI values, paper's order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Means.
    pub ln_mean: [f64; STIFFNESSES],
    /// Standard deviations.
    pub ln_sigma: [f64; STIFFNESSES],
    /// Lower and upper ends; nothing beyond is tried.
    pub ln_limits: [[f64; 2]; STIFFNESSES],
}

/// Quantile of the standard normal beyond which 5 % lie on each side.
pub(super) const Z90: f64 = 1.6449;

impl Prior {
    /// Of an estimate with 90 % intervals; `limits` are the ends of what is believed at all.
    #[must_use]
    pub fn of(value: &Fabric, interval90: &[Fabric; 2], limits: &[Fabric; 2]) -> Self {
        let six = |fabric: &Fabric| {
            let [six @ .., _] = fabric.in_si();
            six.map(f64::ln)
        };
        let (mean, [low, high], ends) =
            (six(value), interval90.each_ref().map(six), limits.each_ref().map(six));
        Self {
            ln_mean: mean,
            ln_sigma: std::array::from_fn(|k| (0.5 * (high[k] - low[k]) / Z90).max(LEAST_SIGMA)),
            ln_limits: std::array::from_fn(|k| [ends[0][k].min(mean[k]), ends[1][k].max(mean[k])]),
        }
    }
}

#[cfg(feature = "estimate")]
impl Prior {
    /// Of what the network says. Values beyond what it was trained on are believed up to a factor.
    #[must_use]
    pub fn of_estimate(estimate: &Estimate) -> Self {
        let [ends_low, ends_high] = [0, 1].map(|end| {
            let six = estimate.trained.map(|ends| ends[end]);
            let factor = if end == 0 { 1.0 / BEYOND } else { BEYOND };
            let [a, b, c, d, e, f] = six.map(|value| value * factor);
            Fabric::from_paper_units([a, b, c, d, e, f, 1.0])
        });
        Self::of(&estimate.fabric, &estimate.interval90, &[ends_low, ends_high])
    }
}

#[cfg(feature = "estimate")]
/// Factor beyond what the network was trained on up to which values are tried.
const BEYOND: f64 = 3.0;
/// Least standard deviation of a prior.
const LEAST_SIGMA: f64 = 0.05;

/// How a fit is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// How sure scans and model are.
    pub data: DataOptions,
    /// Most drapes of a scan from one start.
    pub evaluations: usize,
    /// Vertices on a side of the cells of the first steps and of the last; the same: no last steps.
    pub vertices: [usize; 2],
    /// Standard deviation by which drapes on the first cells lie off \[m\].
    pub first_model_m: f64,
    /// Largest change of a logarithm in one step.
    pub longest_step: f64,
    /// Standard deviations of the bench's numbers: offset x and z \[m\], rotation \[rad\], tilt towards x and z
    /// \[rad\], height of the plate's face \[m\].
    pub bench_sigma: [f64; NUISANCES],
    /// By how much a formal standard deviation of each stiffness is too small, measured.
    pub widen: [f64; STIFFNESSES],
    /// The simulator's options but for the experiment, which each scan has.
    pub sim: SimOptions,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            data: DataOptions::default(),
            evaluations: 10,
            vertices: [61, 91],
            first_model_m: 1.5e-3,
            longest_step: 0.7,
            bench_sigma: [0.5e-3, 0.5e-3, 5e-3, 3e-3, 3e-3, 0.3e-3],
            widen: [1.0; STIFFNESSES],
            sim: SimOptions::default(),
        }
    }
}

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
/// `others` are starts beside the prior's mean, with their names.
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
    if fit.targets.iter().all(|target| target.data[0].is_empty()) {
        return Err(FitError::NothingObserved);
    }
    let mut best: Option<State> = None;
    let mut attempts = Vec::new();
    let mut last_error = None;
    for (name, start) in [("estimate", prior.ln_mean)].iter().chain(others) {
        if best.as_ref().is_some_and(|best| best.misfit() < GOOD_MISFIT) {
            break;
        }
        match fit.from(start) {
            Ok((state, ended, drapes)) => {
                attempts.push(Attempt {
                    start: name,
                    drapes,
                    ended,
                    misfit: state.misfit(),
                    rim_m: state.rim_m(scans),
                });
                if best.as_ref().is_none_or(|best| state.cost < best.cost) {
                    best = Some(state);
                }
            }
            Err(error) => last_error = Some(error),
        }
    }
    match (best, last_error) {
        (Some(state), _) => Ok(Refined::of(scans, &fit, state, attempts)),
        (None, Some(error)) => Err(FitError::NeverAtRest(error)),
        (None, None) => Err(FitError::NothingObserved),
    }
}

/// Root mean square distance, in standard deviations, below which no other start is tried.
const GOOD_MISFIT: f64 = 2.0;

/// One scan with what its drapes start from.
pub(super) struct Target {
    /// What the scan says, as sure as the drapes on the cells of each stage are.
    pub(super) data: [Vec<Datum>; 2],
    rim: Boundary,
    start: DropStart,
    options: SimOptions,
    /// Whether the start is the scan's sheet; else the rim leads the first drape, whose sheet the others
    /// start from.
    has_sheet: bool,
}

pub(super) struct Fit<'a> {
    pub(super) targets: Vec<Target>,
    density_kg_m2: f64,
    pub(super) prior: &'a Prior,
    pub(super) options: &'a FitOptions,
    tell: &'a dyn Fn(Progress),
    drapes: usize,
    least_rim_m: f64,
    stage: Stage,
}

/// Which cells the drapes are on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    First,
    Last,
}

/// A fabric with its drapes, and the least squares around it.
pub(super) struct State {
    pub(super) ln: [f64; STIFFNESSES],
    pub(super) trials: Vec<Trial>,
    /// The bench's numbers, scan by scan.
    pub(super) bench: Vec<[f64; NUISANCES]>,
    /// Sum of the squared distances in standard deviations, outliers tamed, and of the priors'.
    pub(super) cost: f64,
    /// The data's part of it, and the number of independent coordinates.
    pub(super) data_cost: f64,
    pub(super) independent: f64,
    /// Normal matrix of the data alone and of the priors (diagonal), and right-hand side of both.
    pub(super) normal: DMatrix<f64>,
    pub(super) priors: DVector<f64>,
    pub(super) right: DVector<f64>,
}

impl State {
    /// Root mean square distance of an independent coordinate in standard deviations.
    pub(super) fn misfit(&self) -> f64 {
        (self.data_cost / self.independent).sqrt()
    }

    /// Mean distance of the rims from the scans', as they are, without the bench's numbers \[m\].
    fn rim_m(&self, scans: &[Scan<'_>]) -> f64 {
        let distances = scans.iter().zip(&self.trials);
        let sum: f64 = distances.map(|(s, t)| t.rim_distance_m(s.rim)).sum();
        sum / scans.len() as f64
    }
}

impl<'a> Fit<'a> {
    fn new(
        scans: &[Scan<'_>],
        density_kg_m2: f64,
        prior: &'a Prior,
        options: &'a FitOptions,
        tell: &'a dyn Fn(Progress),
    ) -> Self {
        let target = |scan: &Scan<'_>| Target {
            data: [options.first_model_m, options.data.model_m]
                .map(|model_m| data_of(scan, &DataOptions { model_m, ..options.data })),
            rim: scan.rim.clone(),
            start: match scan.sheet {
                Some(sheet) => DropStart::Surface(Box::new(sheet.clone())),
                None => DropStart::Guided(Box::new(scan.rim.clone())),
            },
            options: SimOptions { experiment: scan.experiment, ..options.sim },
            has_sheet: scan.sheet.is_some(),
        };
        let targets = scans.iter().map(target).collect();
        Self {
            targets,
            density_kg_m2,
            prior,
            options,
            tell,
            drapes: 0,
            least_rim_m: f64::INFINITY,
            stage: Stage::First,
        }
    }

    /// The fabric of six logarithms, made one that can be.
    pub(super) fn fabric(&self, ln: &[f64; STIFFNESSES]) -> Fabric {
        let [a, b, c, d, e, f] = ln.map(f64::exp);
        Fabric::from_si([a, b, c, d, e, f, self.density_kg_m2]).project_bending().0
    }

    /// The best state from `start`, why it ended there and the drapes it took.
    fn from(
        &mut self,
        start: &[f64; STIFFNESSES],
    ) -> Result<(State, Ended, usize), SensitivityError> {
        let before = self.drapes;
        let most = before + self.options.evaluations * self.targets.len();
        let [few, many] = self.options.vertices;
        self.stage = Stage::First;
        let mut followers = self.lay(start);
        let mut best = self.state(&mut followers, None)?;
        let mut ended = self.descend(&mut best, &mut followers, most);
        if few != many {
            self.stage = Stage::Last;
            let mut followers = self.lay(&best.ln);
            best = self.state(&mut followers, Some(&best))?;
            ended = self.descend(&mut best, &mut followers, most);
        }
        for _ in 1..LAYINGS {
            if self.drapes + 2 * self.targets.len() > most {
                break;
            }
            // the sheet again with a fabric that is nearer: its branch, and its grips, may be others
            let mut followers = self.lay(&best.ln);
            let Ok(mut state) = self.state(&mut followers, Some(&best)) else { break };
            let again = self.descend(&mut state, &mut followers, most);
            let gained = best.cost - state.cost;
            if gained > 0.0 {
                (best, ended) = (state, again);
            }
            if gained < LAID_GAIN {
                break;
            }
        }
        Ok((best, ended, self.drapes - before))
    }

    /// Steps from `best`, to which the sheets of `followers` belong, as long as they lower the cost.
    fn descend(&mut self, best: &mut State, followers: &mut [Follower], most: usize) -> Ended {
        let mut kept: Vec<Kept> = followers.iter().map(Follower::keep).collect();
        let (mut damping, mut rejected) = (FIRST_DAMPING, 0);
        loop {
            if self.drapes >= most {
                return Ended::Spent;
            }
            let Some((ln, foretold)) = self.step(best, damping) else { return Ended::Singular };
            let moved = (0..STIFFNESSES).map(|k| (ln[k] - best.ln[k]).abs()).fold(0.0, f64::max);
            if foretold < LEAST_GAIN || moved < LEAST_MOVE {
                return Ended::Converged;
            }
            let fabric = self.fabric(&ln);
            let how = FollowOptions::default();
            let led = followers.iter_mut().all(|follower| {
                follower.follow_fabric(&fabric, &how).is_ok_and(|way| way.reached == 1.0)
            });
            let state = if led { self.state(followers, Some(best)).ok() } else { None };
            match state.filter(|state| state.cost < best.cost) {
                Some(state) => {
                    *best = state;
                    kept = followers.iter().map(Follower::keep).collect();
                    damping *= 0.2;
                    rejected = 0;
                }
                None if rejected == REJECTIONS => return Ended::NoBetter,
                None => {
                    followers.iter_mut().zip(&kept).for_each(|(sheet, kept)| sheet.return_to(kept));
                    damping = (10.0 * damping).max(REJECTED_DAMPING);
                    rejected += 1;
                }
            }
        }
    }

    /// The scanned sheets at rest with the fabric of six logarithms.
    fn lay(&mut self, ln: &[f64; STIFFNESSES]) -> Vec<Follower> {
        let fabric = self.fabric(ln);
        let lay = |target: &Target| {
            let vertices = self.options.vertices[self.stage as usize];
            let options = SimOptions { vertices, ..target.options };
            Follower::drop(&fabric, &Drop { start: target.start.clone() }, &options)
        };
        self.targets.iter().map(lay).collect()
    }

    /// The least squares around the sheets of `followers`; the bench's numbers begin at those of `near`.
    fn state(
        &mut self,
        followers: &mut [Follower],
        near: Option<&State>,
    ) -> Result<State, SensitivityError> {
        let mut trials = Vec::new();
        for (target, follower) in self.targets.iter_mut().zip(followers.iter_mut()) {
            let trial = trial_of(follower)?;
            if !target.has_sheet {
                let sheet = Surface::exact(trial.at.iter().map(|&p| p.into()));
                target.start =
                    sheet.map_or(target.start.clone(), |s| DropStart::Surface(Box::new(s)));
            }
            self.drapes += 1;
            trials.push(trial);
        }
        let distances = self.targets.iter().zip(&trials);
        let sum: f64 = distances.map(|(t, trial)| trial.rim_distance_m(&t.rim)).sum();
        let scans = self.targets.len();
        self.least_rim_m = self.least_rim_m.min(sum / scans as f64);
        (self.tell)(Progress { drapes: self.drapes, rim_m: self.least_rim_m });
        let bench = near.map_or_else(|| vec![[0.0; NUISANCES]; scans], |near| near.bench.clone());
        let [ln @ .., _] = followers[0].setup().fabric.in_si().map(f64::ln);
        Ok(self.around(ln, trials, bench))
    }

    /// The least squares around some drapes, the bench's numbers at their best.
    fn around(
        &self,
        ln: [f64; STIFFNESSES],
        trials: Vec<Trial>,
        mut bench: Vec<[f64; NUISANCES]>,
    ) -> State {
        for _ in 0..BENCH_ROUNDS {
            for (k, target) in self.targets.iter().enumerate() {
                bench[k] = self.bench_of(target, &trials[k], &bench[k]);
            }
        }
        let size = STIFFNESSES + NUISANCES * self.targets.len();
        let mut normal = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent) = (0.0, 0.0);
        for (k, (target, trial)) in self.targets.iter().zip(&trials).enumerate() {
            let column = |c: usize| if c < STIFFNESSES { c } else { c + NUISANCES * k };
            let sums = Sums::of(target, self.stage, trial, &bench[k], self.options.data.outlier);
            for a in 0..COLUMNS {
                right[column(a)] += sums.right[a];
                for b in 0..COLUMNS {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            data_cost += sums.cost;
            independent += sums.independent;
        }
        let mut priors = DVector::zeros(size);
        let mut cost = data_cost;
        for k in 0..STIFFNESSES {
            let off = (self.prior.ln_mean[k] - ln[k]) / self.prior.ln_sigma[k];
            priors[k] = self.prior.ln_sigma[k].powi(-2);
            right[k] += off / self.prior.ln_sigma[k];
            cost += off * off;
        }
        for (k, numbers) in bench.iter().enumerate() {
            for (m, (value, sigma)) in numbers.iter().zip(self.options.bench_sigma).enumerate() {
                let at = STIFFNESSES + NUISANCES * k + m;
                priors[at] = sigma.powi(-2);
                right[at] -= value / (sigma * sigma);
                cost += (value / sigma).powi(2);
            }
        }
        State { ln, trials, bench, cost, data_cost, independent, normal, priors, right }
    }

    /// The bench's numbers that fit one drape best.
    fn bench_of(
        &self,
        target: &Target,
        trial: &Trial,
        from: &[f64; NUISANCES],
    ) -> [f64; NUISANCES] {
        let sums = Sums::of(target, self.stage, trial, from, self.options.data.outlier);
        let mut matrix =
            sums.normal.fixed_view::<NUISANCES, NUISANCES>(STIFFNESSES, STIFFNESSES).into_owned();
        let mut right = sums.right.fixed_rows::<NUISANCES>(STIFFNESSES).into_owned();
        for (m, sigma) in self.options.bench_sigma.iter().enumerate() {
            matrix[(m, m)] += sigma.powi(-2);
            right[m] -= from[m] / (sigma * sigma);
        }
        let change = matrix.cholesky().map(|factor| factor.solve(&right)).unwrap_or_default();
        std::array::from_fn(|m| from[m] + change[m])
    }

    /// Where a damped step leads, and by how much the cost is foretold to fall.
    fn step(&self, at: &State, damping: f64) -> Option<([f64; STIFFNESSES], f64)> {
        let whole = &at.normal + DMatrix::from_diagonal(&at.priors);
        let mut damped = whole.clone();
        for k in 0..STIFFNESSES {
            damped[(k, k)] *= 1.0 + damping;
        }
        let mut step = damped.cholesky()?.solve(&at.right);
        let largest = step.rows(0, STIFFNESSES).amax();
        step *= (self.options.longest_step / largest).min(1.0);
        let ln: [f64; STIFFNESSES] = std::array::from_fn(|k| {
            let [low, high] = self.prior.ln_limits[k];
            (at.ln[k] + step[k]).clamp(low, high)
        });
        (0..STIFFNESSES).for_each(|k| step[k] = ln[k] - at.ln[k]);
        let foretold = 2.0 * at.right.dot(&step) - step.dot(&(&whole * &step));
        Some((ln, foretold))
    }
}

/// Columns of one scan: stiffnesses and bench.
const COLUMNS: usize = STIFFNESSES + NUISANCES;

/// The sums of the least squares over one scan's places.
struct Sums {
    normal: nalgebra::SMatrix<f64, COLUMNS, COLUMNS>,
    right: nalgebra::SVector<f64, COLUMNS>,
    cost: f64,
    independent: f64,
}

impl Sums {
    fn of(
        target: &Target,
        stage: Stage,
        trial: &Trial,
        bench: &[f64; NUISANCES],
        outlier: f64,
    ) -> Self {
        let mut sums = Self {
            normal: nalgebra::SMatrix::zeros(),
            right: nalgebra::SVector::zeros(),
            cost: 0.0,
            independent: 0.0,
        };
        let data = &target.data[stage as usize];
        for datum in data {
            let place = datum.place;
            let mut off = datum.position_m - trial.at[place];
            for (value, moves) in bench.iter().zip(&trial.moves[STIFFNESSES..]) {
                off -= moves[place] * *value;
            }
            let pull = datum.information * off;
            // per coordinate, so that a place of three coordinates is as far as one of one
            let far = (off.dot(&pull) / 3.0).sqrt();
            let tamed = if far > outlier { outlier / far } else { 1.0 };
            let weight = datum.counts * tamed;
            sums.cost += 3.0 * datum.counts * far * far * tamed * (2.0 - tamed);
            sums.independent += 3.0 * datum.counts;
            let columns: [_; COLUMNS] = std::array::from_fn(|c| trial.moves[c][place]);
            for a in 0..COLUMNS {
                let weighted = datum.information * columns[a] * weight;
                sums.right[a] += weighted.dot(&off);
                for b in 0..=a {
                    sums.normal[(a, b)] += weighted.dot(&columns[b]);
                }
            }
        }
        sums.normal.fill_upper_triangle_with_lower_triangle();
        sums
    }
}

/// Damping of the first step, and least damping after a step that raised the cost.
const FIRST_DAMPING: f64 = 1e-2;
const REJECTED_DAMPING: f64 = 0.1;
/// How often the scanned sheet is laid at most, and the fall of the cost for which it is laid again.
const LAYINGS: usize = 3;
const LAID_GAIN: f64 = 1.0;
/// Shortenings of a step in a row before the fit ends.
const REJECTIONS: usize = 2;
/// Foretold fall of the cost, in squared standard deviations, that is not worth a drape.
const LEAST_GAIN: f64 = 0.05;
/// Change of a logarithm that is not worth one.
const LEAST_MOVE: f64 = 3e-3;
/// Rounds in which the bench's numbers and the weights of outliers follow each other.
const BENCH_ROUNDS: usize = 3;

#[cfg(test)]
mod tests;

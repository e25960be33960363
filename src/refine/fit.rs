//! The fabric whose drapes lie closest to its scans.
//!
//! Levenberg-Marquardt over the logarithms of the six stiffnesses, shared by all scans, and the
//! numbers of each scan's bench, with priors on all. The scanned sheet is laid with the first
//! fabric and comes to rest held by weak springs ([`DropStart::HeldSurface`]); from there it is
//! continued from fabric to fabric, tied by springs all the way. Released, even the true fabric
//! moves on by 0.2 to 3 mm into an equilibrium beside the scan's, along moves that cost next to
//! nothing, and a fit bends the stiffnesses to close that gap. Held, it stays, and what a wrong
//! fabric does to the sheet shows against the springs. In the end the sheet is released, if wanted.
//! The bench's numbers are small and enter through their sensitivities alone; of a plate that is
//! found tilted or off its place by more, the drapes are made anew on that plate. A place, or a
//! number, that lies more than a few standard deviations off pulls no harder than one at that
//! distance (Huber 1964).
//!
//! The first start is the prior's mean. Where the sheet does not come to rest with it, others are
//! tried. The first step from the tied sheet is the balance of forces on it
//! ([`Refined::of_balance`]). A fit with too large a residual ([`FitOptions::largest_misfit`])
//! begins again at stiffer stretch and shear.
//!
//! Where it fails: far from the scan's fabric the tied sheet still snaps, and the least squares see
//! a step there. A step that does not lower the cost is shortened a few times, and the best drape
//! stays.

use rayon::prelude::*;

use super::data::{DataOptions, Scan, data_of, place_of};
use super::equations::{Draped, FitOptions, Problem, State};
use super::prediction::{AXIS, NUISANCES, Prediction, TILT, axis_m, places_of, prediction_of};
use super::prior::Prior;
use super::refined::Refined;
use crate::base::boundary::BoundaryPoint;
use crate::base::clock::{Begun, Stages};
use crate::base::{Boundary, Surface, SurfacePoint, Vector3};
use crate::fabric::STIFFNESSES;
use crate::inverse::{Descent, Ended, LEAST_GAIN, Moved, STIFFER, Step, descend, with_stretch};
use crate::sim::sensitivity::SensitivityError;
use crate::sim::{
    Drape, Drop, DropStart, FollowOptions, Follower, HeldRim, HeldSurface, SimOptions, Stop,
};

/// Why nothing was fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There is no scan, or none with an observed place.
    #[error("nothing was observed: give at least one scan with a rim")]
    NothingObserved,
    /// Nobody waited for the end. Said by who runs a fit, never by [`fit`].
    #[error("interrupted")]
    Interrupted,
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
    /// Mean distance of the rims of the last tied drapes from the scans' \[m\].
    pub rim_m: f64,
    /// Root mean square distance of the scans from them, in standard deviations of scan and model.
    pub misfit: f64,
    /// Whether the steps on the last cells have begun.
    pub on_last_cells: bool,
}

/// Looks for the fabric of `scans`: one fabric of the given density \[kg/m^2\], dropped once or
/// several times. Of `starts`, logarithms of SI values with their names, the first is taken with
/// which the sheets come to rest ([`Prior::starts`]).
///
/// # Errors
/// [`FitError`].
pub fn fit(
    scans: &[Scan<'_>],
    density_kg_m2: f64,
    prior: &Prior,
    starts: &[(&'static str, [f64; STIFFNESSES])],
    options: &FitOptions,
    tell: impl Fn(Progress),
) -> Result<Refined, FitError> {
    let mut fit = Fit::new(scans, density_kg_m2, prior, options, &tell);
    if fit.problem.data.iter().all(Vec::is_empty) {
        return Err(FitError::NothingObserved);
    }
    let mut last_error = None;
    for (name, start) in starts {
        match fit.from(start, First::Descends) {
            Ok(best) => {
                let of_balance = fit.of_balance.clone().unwrap_or_else(|| start.to_vec());
                let Best { state, mut followers, ended } = fit.begun_again(best);
                let released = fit.released(&mut followers);
                let how = (*name, ended, fit.drapes);
                let refined = Refined::of(scans, &fit.problem, state, released, how, &of_balance);
                return Ok(Refined { stages: fit.stages.noted().to_vec(), ..refined });
            }
            Err(error) => {
                last_error = Some(error);
                // another start helps a sheet to rest that has none yet
                if fit.is_on_finer_cells() {
                    break;
                }
            }
        }
    }
    Err(last_error.map_or(FitError::NothingObserved, FitError::NeverAtRest))
}

/// One scan, and how its drapes are made.
struct Target<'a> {
    given: &'a Scan<'a>,
    /// Rim and sheet in the plate's frame, where the scan misses it.
    moved: Option<(Boundary, Option<Surface>)>,
    options: SimOptions,
    /// What its drapes start from.
    start: DropStart,
}

impl Target<'_> {
    /// The scan in the plate's frame.
    fn scan(&self) -> Scan<'_> {
        match &self.moved {
            Some((rim, sheet)) => Scan { rim, sheet: sheet.as_ref(), ..*self.given },
            None => *self.given,
        }
    }

    /// The drapes to come are made with these numbers of the bench beyond the experiment. The first
    /// start from the scanned sheet, or from a rim alone, and that ties them.
    fn make_with(&mut self, numbers: &[f64; NUISANCES], options: &FitOptions) {
        let mut tilt = self.given.experiment.tilt;
        tilt.down_x_rad += numbers[TILT];
        tilt.down_z_rad += numbers[TILT + 1];
        self.options.experiment.tilt = tilt;
        let axis_m = axis_m(numbers);
        let (rim, sheet) = (self.given.rim, self.given.sheet);
        self.moved = (axis_m != Vector3::zeros())
            .then(|| (rim.translated(-axis_m), sheet.map(|sheet| sheet.translated(-axis_m))));
        let Scan { rim, sheet, .. } = self.scan();
        let (sag_m, farther) = (options.rim_hold_sag_m, 0.0);
        let rim = || DropStart::HeldRim(Box::new(HeldRim { rim: rim.clone(), sag_m, farther }));
        self.start = sheet.map_or_else(rim, |of| held(of.clone(), options.hold_sag_m));
    }

    /// Where a rim alone held the first drapes, those to come start from the sheet of the last of
    /// them with the rim where it was scanned, and only the rim holds. What they remember is then
    /// of a fabric near the one found. Whether that is so.
    fn begin_beside(&mut self, first: &Prediction, options: &FitOptions) -> bool {
        let scan = self.scan();
        if scan.sheet.is_some() {
            return false;
        }
        let unknown = |p: &Vector3| SurfacePoint {
            position_m: (*p).into(),
            sigma_m: UNKNOWN_M,
            observed: false,
        };
        let mut points: Vec<_> = first.at.iter().map(unknown).collect();
        for (index, point) in scan.rim.points().iter().enumerate() {
            let BoundaryPoint { position_m, sigma_m, observed } = *point;
            points[place_of(index)] = SurfacePoint { position_m, sigma_m, observed };
        }
        let surface = Surface::new(points).unwrap_or_else(|_| unreachable!("a square of places"));
        self.start = held(surface, options.rim_hold_sag_m);
        true
    }
}

/// A sheet held to a surface.
fn held(surface: Surface, sag_m: f64) -> DropStart {
    DropStart::HeldSurface(Box::new(HeldSurface { surface, sag_m, farther: 0.0 }))
}

/// Prior of cells without finer ones to compare: any number, since it moves nothing.
const NO_FINER: [f64; 2] = [0.0, 1.0];
/// Factorisations in which a sheet that only its rim leads has to come to rest: it begins farther
/// from it.
const RIM_ALONE: usize = 600;
/// Tilts up to this enter through sensitivities alone \[rad\],
const TILTED_RAD: f64 = 10e-3;
/// and places of the plate's axis \[m\].
const OFF_AXIS_M: f64 = 0.4e-3;
/// Standard deviation of a place that nothing is known of \[m\]: its spring has no strength.
const UNKNOWN_M: f64 = 1.0;

/// Where steps have led: the least squares there, the tied sheets, and why the steps ended.
struct Best {
    state: State,
    followers: Vec<Follower>,
    ended: Ended,
}

/// What the sheets on the first cells are for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum First {
    /// The first steps.
    Descends,
    /// To know what finer cells move, and nothing else.
    Stays,
}

/// How often a fit begins again at most.
const AGAIN: usize = 2;
/// What a new beginning has to bring the misfit down to, as a share of it, for another to be tried.
/// Of two scans whose misfit fell by a tenth at the first, neither came below what is allowed at
/// the second.
const WORTH_ANOTHER: f64 = 0.85;
/// A fit on its way.
struct Fit<'a> {
    targets: Vec<Target<'a>>,
    problem: Problem<'a>,
    /// Vertices on a side of the present cells.
    vertices: usize,
    /// The moves of each scan's places from the first cells to the last \[m\]; none before the
    /// last.
    finer: Vec<Vec<Vector3>>,
    /// Logarithms of the six after one undamped step from the first sheets of the present start.
    of_balance: Option<Vec<f64>>,
    tell: &'a dyn Fn(Progress),
    drapes: usize,
    stages: Stages,
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
            given: scan,
            moved: None,
            options: SimOptions {
                experiment: scan.experiment,
                iterations: match scan.sheet {
                    Some(_) => options.sim.iterations,
                    None => options.sim.iterations.max(RIM_ALONE),
                },
                ..options.sim
            },
            start: DropStart::Canonical,
        };
        let problem = Problem {
            data: Vec::new(),
            cells: NO_FINER,
            made_with: Vec::new(),
            density_kg_m2,
            prior,
            options,
        };
        let targets = scans.iter().map(target).collect();
        let mut fit = Self {
            targets,
            problem,
            vertices: 0,
            finer: Vec::new(),
            of_balance: None,
            tell,
            drapes: 0,
            stages: Stages::start(),
        };
        fit.on_cells(options.vertices[0], options.first_model_m);
        fit
    }

    /// The drapes to come are on cells of so many vertices, which lie off by so much.
    fn on_cells(&mut self, vertices: usize, model_m: f64) {
        let options = DataOptions { model_m, ..self.problem.options.data };
        self.vertices = vertices;
        self.problem.data = self.targets.iter().map(|t| data_of(&t.scan(), &options)).collect();
        self.problem.cells = if self.is_on_finer_cells() {
            self.problem.options.prior_of_cells(vertices)
        } else {
            NO_FINER
        };
    }

    /// Where a fit largest_misfit more than the simulator should, where it ends if it begins again
    /// at stiffer stretch and shear, as long as that is nearer. What coarse cells lock is taken for
    /// softer cloth before it is known what finer ones do, and from there no step leads back; so
    /// the first cells take no step here.
    fn begun_again(&mut self, mut best: Best) -> Best {
        for _ in 0..AGAIN {
            if best.state.misfit() < self.problem.options.largest_misfit {
                break;
            }
            let (found, limits) = (&best.state.shared, &self.problem.prior.ln_limits);
            let stiffer = with_stretch(found, limits, |_, ln| ln + STIFFER);
            let before = best.state.misfit();
            match self.from(&stiffer, First::Stays) {
                Ok(other) if other.state.cost < best.state.cost - LEAST_GAIN => best = other,
                _ => break,
            }
            if best.state.misfit() > WORTH_ANOTHER * before {
                break;
            }
        }
        best
    }

    /// The best state from `start`, and why it ended there.
    fn from(&mut self, start: &[f64], first: First) -> Result<Best, SensitivityError> {
        let options = self.problem.options;
        self.of_balance = None;
        let evaluations = options.evaluations[usize::from(first == First::Stays)];
        let most = self.drapes + evaluations * self.targets.len();
        let few = options.vertices[0];
        let no_last = options.vertices[1] <= few;
        let model_m = if no_last { options.data.model_m } else { options.first_model_m };
        let most_first = if first == First::Stays && !no_last { 0 } else { most };
        let as_given = vec![[0.0; NUISANCES]; self.targets.len()];
        self.make_with(&as_given, few, model_m);
        let mut best = self.initialised_and_descended(start, None, most_first)?;
        if let Some(numbers) = large(&best.state) {
            self.make_with(&numbers, few, model_m);
            match self.initialised_and_descended(&best.state.shared, None, most_first) {
                Ok(other) if other.state.cost < best.state.cost => best = other,
                _ => self.make_with(&as_given, few, model_m),
            }
        }
        if !no_last {
            let Best { state: coarse, .. } = best;
            self.begin_beside(&coarse);
            let last = options.last_vertices(&self.problem.fabric(&coarse.shared));
            self.on_cells(last, options.data.model_m);
            best = self.initialised_and_descended(&coarse.shared, Some(&coarse), most)?;
        } else if self.begin_beside(&best.state) {
            let ln = best.state.shared.clone();
            best = self.initialised_and_descended(&ln, None, most).unwrap_or(best);
        }
        Ok(best)
    }

    /// The drapes to come are made with these numbers of the benches beyond their experiments, on
    /// cells of so many vertices, which lie off by so much.
    fn make_with(&mut self, numbers: &[[f64; NUISANCES]], vertices: usize, model_m: f64) {
        for (target, numbers) in self.targets.iter_mut().zip(numbers) {
            target.make_with(numbers, self.problem.options);
        }
        self.problem.made_with = numbers.to_vec();
        self.on_cells(vertices, model_m);
    }

    /// [`Target::begin_beside`] the drapes of a state; whether any does.
    fn begin_beside(&mut self, first: &State) -> bool {
        let options = self.problem.options;
        let both = self.targets.iter_mut().zip(&first.drapes);
        both.fold(false, |any, (target, of)| target.begin_beside(&of.prediction, options) || any)
    }

    /// The scanned sheets laid with one fabric, and where the steps from there end. `coarse` is the
    /// same fabric on coarser cells: what the sheets move by from those to these, cloth may move on
    /// by.
    fn initialised_and_descended(
        &mut self,
        ln: &[f64],
        coarse: Option<&State>,
        most: usize,
    ) -> Result<Best, SensitivityError> {
        let begun = Begun::now();
        let mut followers = self.initialise(ln);
        self.stages.add(self.of_cells("first laid", "last laid"), begun);
        let moves = |(follower, before): (&Follower, &Draped)| -> Vec<Vector3> {
            let both = places_of(&follower.drape()).into_iter().zip(&before.prediction.at);
            both.map(|(a, b)| a - b).collect()
        };
        let drapes = coarse.iter().flat_map(|coarse| &coarse.drapes);
        self.finer = followers.iter().zip(drapes).map(moves).collect();
        let state = self.state(&mut followers, coarse)?;
        self.drapes += followers.len();
        self.tell_of(&state);
        if self.of_balance.is_none() {
            self.of_balance = self.problem.step(&state, 0.0).map(|step| step.to);
        }
        let mut steps = Steps { fit: self, followers: &mut followers };
        let (state, ended) = descend(&mut steps, state, most);
        Ok(Best { state, followers, ended })
    }

    /// The scanned sheets at rest with the fabric of six logarithms.
    fn initialise(&self, ln: &[f64]) -> Vec<Follower> {
        let fabric = self.problem.fabric(ln);
        let vertices = self.vertices;
        let FitOptions { step_factorisations, last_factorisations, .. } = *self.problem.options;
        let is_finer = self.is_on_finer_cells();
        let initialise = |target: &Target| {
            let mut options = SimOptions { vertices, ..target.options };
            let is_sheet = target.given.sheet.is_some();
            if is_finer && is_sheet {
                options.iterations = last_factorisations;
            }
            let drop = Drop { start: target.start.clone() };
            let mut follower = Follower::drop(&fabric, &drop, &options);
            if is_sheet {
                follower.search_at_most(step_factorisations);
            }
            follower
        };
        self.targets.par_iter().map(initialise).collect()
    }

    /// The least squares around the sheets of `followers`; the bench's numbers begin at those of
    /// `near`.
    fn state(
        &mut self,
        followers: &mut [Follower],
        near: Option<&State>,
    ) -> Result<State, SensitivityError> {
        let finer = &self.finer;
        let prediction_of =
            |(k, follower)| prediction_of(follower, finer.get(k).map(Vec::as_slice));
        let begun = Begun::now();
        let moved: Vec<_> = followers.par_iter_mut().enumerate().map(prediction_of).collect();
        self.stages.add(self.of_cells("first sensitivities", "last sensitivities"), begun);
        let predictions = moved.into_iter().collect::<Result<_, _>>()?;
        let scans = self.targets.len();
        let means = |scan| self.problem.bench_prior(scan).map(|[mean, _]| mean);
        let bench = near.map_or_else(|| (0..scans).map(means).collect(), bench_of);
        let [ln @ .., _] = followers[0].setup().fabric.in_si().map(f64::ln);
        Ok(self.problem.around(ln, predictions, &bench))
    }

    /// The least squares around the sheets of `followers` with the sensitivities of `near`, a short
    /// step away: no solve.
    fn state_near(&mut self, followers: &[Follower], near: &State) -> State {
        let moved =
            |(follower, draped): (&Follower, &Draped)| draped.prediction.at_sheet(follower.drape());
        let predictions = followers.iter().zip(&near.drapes).map(moved).collect();
        let [ln @ .., _] = followers[0].setup().fabric.in_si().map(f64::ln);
        let state = self.problem.around(ln, predictions, &bench_of(near));
        self.drapes += followers.len();
        self.tell_of(&state);
        state
    }

    /// Whether no more gain is predicted from a state.
    fn is_converged(&self, at: &State) -> bool {
        self.problem.step(at, 0.0).is_some_and(|step| step.is_little(LEAST_GAIN))
    }

    fn tell_of(&self, state: &State) {
        let distances = self.targets.iter().zip(&state.drapes);
        let sum: f64 = distances.map(|(t, d)| d.prediction.rim_distance_m(t.scan().rim)).sum();
        (self.tell)(Progress {
            drapes: self.drapes,
            rim_m: sum / self.targets.len() as f64,
            misfit: state.misfit(),
            on_last_cells: self.is_on_last_cells(),
        });
    }

    /// The released sheets, if wanted.
    fn released(&mut self, followers: &mut [Follower]) -> Vec<Option<Drape>> {
        if !self.problem.options.release {
            return vec![None; followers.len()];
        }
        let begun = Begun::now();
        let factorisations = self.problem.options.sim.iterations;
        let release = |follower: &mut Follower| {
            follower.search_at_most(factorisations);
            follower.release();
            Some(follower.drape())
        };
        let released = followers.par_iter_mut().map(release).collect();
        self.stages.add("released", begun);
        released
    }

    fn is_on_finer_cells(&self) -> bool {
        self.vertices > self.problem.options.vertices[0]
    }

    fn is_on_last_cells(&self) -> bool {
        let [first, last] = self.problem.options.vertices;
        self.is_on_finer_cells() || last <= first
    }

    /// The name of a stage on the present cells.
    fn of_cells(&self, first: &'static str, last: &'static str) -> &'static str {
        if self.is_on_last_cells() { last } else { first }
    }
}

/// A fit and its sheets on the present cells.
struct Steps<'f, 'a> {
    fit: &'f mut Fit<'a>,
    followers: &'f mut [Follower],
}

impl Descent for Steps<'_, '_> {
    type Drape = Draped;

    fn sheets(&mut self) -> &mut [Follower] {
        self.followers
    }

    fn simulated(&self) -> usize {
        self.fit.drapes
    }

    fn step(&self, from: &State, damping: f64) -> Option<Step> {
        self.fit.problem.step(from, damping)
    }

    /// New sensitivities are made only where the old ones find the step a gain and predict another.
    fn brought(&mut self, step: &Step, from: &State) -> Moved<Draped> {
        let Self { fit, followers } = self;
        let fabric = fit.problem.fabric(&step.to);
        let begun = Begun::now();
        let led = followers.par_iter_mut().all(|follower| {
            let way = follower.follow_fabric(&fabric, &FollowOptions::default());
            way.is_ok_and(|way| way.reached == 1.0 && way.stop == Stop::AtRest)
        });
        fit.stages.add(fit.of_cells("first led", "last led"), begun);
        let near = led.then(|| fit.state_near(followers, from));
        let near = match Moved::to(near, from) {
            Moved::Nearer(near) if fit.is_converged(&near) => return Moved::Last(near),
            Moved::Nearer(near) => near,
            none => return none,
        };
        match Moved::to(fit.state(followers, Some(&near)).ok(), from) {
            Moved::Nearer(state) if from.cost - state.cost < LEAST_GAIN => Moved::Last(state),
            moved => moved,
        }
    }
}

/// Tilt and place of each scan's plate as found, 0 for its other numbers, if one is too large to
/// enter through sensitivities alone.
fn large(state: &State) -> Option<Vec<[f64; NUISANCES]>> {
    let is_plates = |m: usize| [TILT, TILT + 1, AXIS, AXIS + 1].contains(&m);
    let plate = |draped: &Draped| -> [f64; NUISANCES] {
        let all = draped.whole_bench();
        std::array::from_fn(|m| if is_plates(m) { all[m] } else { 0.0 })
    };
    let plates: Vec<_> = state.drapes.iter().map(plate).collect();
    let is_large = |plate: &[f64; NUISANCES]| {
        plate[TILT].hypot(plate[TILT + 1]) > TILTED_RAD || axis_m(plate).norm() > OFF_AXIS_M
    };
    plates.iter().any(is_large).then_some(plates)
}

/// The bench's numbers of a state, scan by scan, beyond those that the drapes are made with.
fn bench_of(state: &State) -> Vec<[f64; NUISANCES]> {
    state.drapes.iter().map(|draped| draped.bench).collect()
}

#[cfg(test)]
mod tests;

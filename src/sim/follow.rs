//! Continuation: from a drape at rest to the drape of another fabric or in another experiment, on
//! the same branch.
//!
//! In: a sheet at rest with its contacts and what it remembers of its bending, and a setup to go
//! to. Out: the sheet at rest there, what the way cost, and the events on it. Each step changes the
//! model under the sheet, friction's grips carried along, moves the sheet by the sensitivity of the
//! last rest (one solve with the factor at hand) and corrects it by Newton steps on the exact
//! energy (`newton/correct.rs`); where those do not come to rest, the descents of `rest.rs` do.
//!
//! A branch that ends shows as an event: the sheet left the place that the sensitivity predicted by
//! more than [`FollowOptions::branch_jump_m`]. An event names the stretch of the way, the rims
//! before and after, and where the rim moved most. What is smaller than that is not told from the
//! curvature of the way: soft sheets have many equilibria a fraction of a millimetre apart.
//!
//! A sheet whose search for rest was to end early ([`SimOptions::energy_drop`]) can be led as well,
//! by descents alone. It has no factor that predicts its moves, so that its events mean little.
//!
//! Where it fails: a specimen's place and rotation act through the grips alone, so that a sheet is
//! not carried farther than they slip; drop it anew for more than a tenth of a millimetre.

use std::sync::Arc;

use crate::base::frame::GRAVITY_M_S2;
use crate::base::{Boundary, Vector3};
use crate::fabric::Fabric;
use crate::sim::drape::{Drape, Rested, count_nodes, fallen, rest};
use crate::sim::drop::{Drop, Hold, across_outline};
use crate::sim::effort::Effort;
use crate::sim::guide::{Guide, Target};
use crate::sim::model::Model;
use crate::sim::newton::Newton;
use crate::sim::options::{SimOptions, Stop};
use crate::sim::rest::settle;
use crate::sim::sensitivity::{Parameter, Sensitivity, SensitivityError};
use crate::sim::setup::Setup;

/// A sheet at rest, with the state of its contacts, that can be continued to other fabrics and
/// experiments.
pub struct Follower {
    rested: Rested,
    setup: Setup,
    options: SimOptions,
}

/// A sheet at rest that a [`Follower`] can come back to.
pub struct Kept {
    model: Model,
    x: Vec<Vector3>,
    stop: Stop,
    residual_n: f64,
    setup: Setup,
}

/// A spring that holds the sheet across an outline ([`Hold`]).
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Its vertex.
    pub vertex: usize,
    /// The unit vector along which it acts.
    pub along: Vector3,
    /// How far it is stretched, positive outwards \[m\].
    pub stretch_m: f64,
}

/// How a way is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowOptions {
    /// Longest step: the root mean square of the changes of the fabric's seven logarithms.
    pub longest_step: f64,
    /// How often a step that ends in an event is tried again as two halves: the event is then
    /// confined to a shorter stretch of the way, or turns out to be none.
    pub halvings: u32,
    /// Root mean square distance of the sheet's vertices from where the sensitivity put them,
    /// beyond half of the move itself, from which on it counts as having left its branch \[m\].
    pub branch_jump_m: f64,
    /// Whether to continue after an event.
    pub on_event: OnEvent,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self { longest_step: 0.25, halvings: 0, branch_jump_m: 0.3e-3, on_event: OnEvent::GoOn }
    }
}

/// What to do where a branch ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnEvent {
    /// Continue from where the sheet came to rest.
    GoOn,
    /// Stop there.
    Stop,
}

/// A stretch of the way on which the sheet left its branch.
#[derive(Clone, Debug)]
pub struct Event {
    /// The stretch, as fractions of the way.
    pub stretch: [f64; 2],
    /// The setup at its end.
    pub setup: Setup,
    /// The rim at rest before it.
    pub before: Boundary,
    /// The rim at rest after it.
    pub after: Boundary,
    /// Folds before and after.
    pub nodes: [usize; 2],
    /// Bearing from the plate's axis of the rim point that moved most: the fold that went, from
    /// +x towards +z \[rad\].
    pub bearing_rad: f64,
    /// Root mean square distance of the vertices from where the sensitivity put them \[m\].
    pub branch_jump_m: f64,
}

/// How a way was followed.
#[derive(Clone, Debug)]
pub struct Followed {
    /// The fraction of the way that was gone; less than 1 after an event at which it was to stop.
    pub reached: f64,
    /// Steps taken.
    pub steps: usize,
    /// Steps whose corrections did not come to rest by themselves.
    pub descents: usize,
    /// Where the sheet left its branch, in the order of the way.
    pub events: Vec<Event>,
    /// Why the last search for rest ended.
    pub stop: Stop,
    /// What the way cost.
    pub effort: Effort,
}

/// Why a way cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FollowError {
    /// The sheet is not at rest.
    #[error("the drape ended as `{}`, not at rest: only a sheet at rest can be followed", .0.name())]
    NotAtRest(Stop),
    /// The specimens have different outlines.
    #[error("a disc cannot be followed to a rectangle or back: drop the specimen anew")]
    OtherOutline,
}

/// A step that has been tried: the sheet on the changed model.
struct Tried {
    model: Model,
    x: Vec<Vector3>,
    stop: Stop,
    residual_n: f64,
    branch_jump_m: f64,
    left_branch: bool,
    descended: bool,
}

impl Follower {
    /// Drops a specimen and brings it to rest, as [`crate::sim::drape()`] does.
    #[must_use]
    pub fn drop(fabric: &Fabric, drop: &Drop, options: &SimOptions) -> Self {
        let (fine, start, effort) = fallen(fabric, drop, options);
        let mut rested = rest(fabric, drop, &fine, start, options);
        rested.newton.effort += effort;
        let setup = Setup { fabric: *fabric, experiment: options.experiment };
        Self { rested, setup, options: *options }
    }

    /// From now on a search for rest ends after so many factorisations
    /// ([`SimOptions::iterations`]).
    pub fn search_at_most(&mut self, factorisations: usize) {
        self.options.iterations = factorisations;
    }

    /// What the sheet is of.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The sheet as it is now; its effort is all that was spent on it since its fall began.
    #[must_use]
    pub fn drape(&self) -> Drape {
        self.rested.drape(&self.setup.fabric)
    }

    /// The rim as it is now.
    #[must_use]
    pub fn boundary(&self) -> Boundary {
        self.rested.model.grid.boundary(&self.rested.x)
    }

    /// The springs that tie the sheet across an outline; none if it was released, or is tied to a
    /// surface.
    #[must_use]
    pub fn held(&self) -> Vec<Held> {
        let Rested { model, x, .. } = &self.rested;
        let spring = |target: &Target| {
            let along = target.along?;
            let stretch_m =
                along.dot(&(x[target.vertex] - target.position_m)) - model.guide.outwards_m;
            Some(Held { vertex: target.vertex, along, stretch_m })
        };
        model.guide.targets.iter().filter_map(spring).collect()
    }

    /// How far beyond its outline the hold pulls \[m\].
    #[must_use]
    pub fn pull_m(&self) -> f64 {
        self.rested.model.guide.outwards_m
    }

    /// Holds the sheet across another outline, `outwards_m` beyond it; it has not moved yet:
    /// [`Self::follow`] leads it to rest.
    pub fn hold(&mut self, hold: &Hold, outwards_m: f64) {
        self.rested.newton.forget_place();
        let model = &mut self.rested.model;
        let Setup { fabric, experiment } = &self.setup;
        model.guide = across_outline(hold, &model.grid, fabric, experiment);
        model.guide.outwards_m = outwards_m;
    }

    /// Holds a sheet that is held to a surface to the same one of another scale, farther from the
    /// frame's origin by this share of what it was laid on; it has not moved yet, as in
    /// [`Self::hold`].
    pub fn hold_farther(&mut self, by: f64) {
        self.rested.newton.forget_place();
        self.rested.model.guide.farther = by;
    }

    /// Releases a sheet that is held, and brings it to rest: its equilibrium without the springs,
    /// from the grips that its friction has. Gives why the search for rest ended.
    pub fn release(&mut self) -> Stop {
        self.rested.model.guide = Guide::default();
        let setup = self.setup;
        let tried = self.attempt(&setup, &FollowOptions::default());
        self.accept(tried, setup);
        self.rested.stop
    }

    /// How far the sheet moves with each of `parameters`; see [`crate::sim::sensitivity`].
    ///
    /// # Errors
    /// As [`crate::sim::drape_with_sensitivities`].
    pub fn sensitivities(
        &mut self,
        parameters: &[Parameter],
    ) -> Result<Vec<Sensitivity>, SensitivityError> {
        let (fabric, options) = (self.setup.fabric, self.options);
        self.rested.sensitivities(&fabric, &options, parameters, false)
    }

    /// The same of a sheet whose rest is not stable, by its projected Hessian: what a step of least
    /// squares may be predicted with. Soft moves come out too small.
    ///
    /// # Errors
    /// As [`Self::sensitivities`].
    pub fn steadied_sensitivities(
        &mut self,
        parameters: &[Parameter],
    ) -> Result<Vec<Sensitivity>, SensitivityError> {
        let (fabric, options) = (self.setup.fabric, self.options);
        self.rested.sensitivities(&fabric, &options, parameters, true)
    }

    /// The sheet as it is now, to come back to.
    #[must_use]
    pub fn keep(&self) -> Kept {
        let Rested { model, x, stop, residual_n, .. } = &self.rested;
        let (model, x) = (model.clone(), x.clone());
        Kept { model, x, stop: *stop, residual_n: *residual_n, setup: self.setup }
    }

    /// Puts the sheet back, with the grips of its friction.
    pub fn return_to(&mut self, kept: &Kept) {
        let Kept { model, x, stop, residual_n, setup } = kept;
        self.rested.model = model.clone();
        self.rested.x.clone_from(x);
        (self.rested.stop, self.rested.residual_n) = (*stop, *residual_n);
        self.setup = *setup;
        self.options.experiment = setup.experiment;
        self.restore();
    }

    /// Continues the sheet to `fabric` in the same experiment.
    ///
    /// # Errors
    /// As [`Self::follow`].
    pub fn follow_fabric(
        &mut self,
        fabric: &Fabric,
        how: &FollowOptions,
    ) -> Result<Followed, FollowError> {
        self.follow(&Setup { fabric: *fabric, ..self.setup }, how)
    }

    /// Continues the sheet to `to`, in steps of at most [`FollowOptions::longest_step`].
    ///
    /// # Errors
    /// [`FollowError`] where the sheet is not at rest (or as near to it as its options ask), or has
    /// another outline than `to`. A sheet that does not come to rest on the way is a result:
    /// [`Followed::stop`] says so, and [`Followed::reached`] where.
    pub fn follow(&mut self, to: &Setup, how: &FollowOptions) -> Result<Followed, FollowError> {
        if !self.rested.stop.is_as_asked() {
            return Err(FollowError::NotAtRest(self.rested.stop));
        }
        let from = self.setup;
        if from.experiment.specimen.outline != to.experiment.specimen.outline {
            return Err(FollowError::OtherOutline);
        }
        let before = self.rested.newton.effort;
        let count = (from.log_distance(to) / how.longest_step).ceil().max(1.0);
        let step = 1.0 / count;
        let smallest = step * 0.5_f64.powi(how.halvings as i32);
        let mut followed = Followed {
            reached: 0.0,
            steps: 0,
            descents: 0,
            events: Vec::new(),
            stop: self.rested.stop,
            effort: Effort::default(),
        };
        let mut length = step;
        while followed.reached < 1.0 {
            // the last step ends on the setup that was asked for, to the bit
            let last = followed.reached + length > 1.0 - 1e-9;
            let next = if last { 1.0 } else { followed.reached + length };
            let setup = from.between(to, next);
            let tried = self.attempt(&setup, how);
            if (tried.left_branch || !tried.stop.is_as_asked()) && length > 1.5 * smallest {
                length *= 0.5;
                self.restore();
                continue;
            }
            followed.steps += 1;
            followed.descents += usize::from(tried.descended);
            followed.stop = tried.stop;
            let stretch = [followed.reached, next];
            let event = tried.left_branch.then(|| self.event(&tried, stretch, setup));
            self.accept(tried, setup);
            followed.reached = next;
            let stopped = event.is_some() && how.on_event == OnEvent::Stop;
            followed.events.extend(event);
            if stopped || !self.rested.stop.is_as_asked() {
                break;
            }
            length = (2.0 * length).min(step);
        }
        followed.effort = self.rested.newton.effort - before;
        Ok(followed)
    }

    /// Tries a step to `setup`; the sheet stays what it is.
    fn attempt(&mut self, setup: &Setup, how: &FollowOptions) -> Tried {
        let Rested { model: old, newton, x: x0, .. } = &mut self.rested;
        let same_cut = setup.experiment.specimen == self.setup.experiment.specimen;
        let grid = if same_cut {
            Arc::clone(&old.grid)
        } else {
            old.grid.recut(&setup.experiment.specimen)
        };
        let mut model = old.changed(&grid, &setup.fabric, &setup.experiment);
        let mut x = x0.clone();
        let predicted = newton.predict(&mut model, &mut x);
        let cell_n = setup.fabric.density_kg_m2 * grid.spacing_m.powi(2) * GRAVITY_M_S2;
        let limit_n = self.options.residual * cell_n;
        // a sheet whose search for rest ended early has no factor that predicts a move, and
        // corrections from there hardly ever come to rest: the descents begin at once
        let skip_correction = predicted.is_none() && self.options.energy_drop > 0.0;
        let corrected = match skip_correction {
            true => None,
            false => correct(&mut model, newton, &mut x, limit_n, self.options.step_m),
        };
        let (stop, residual_n) = match corrected {
            Some(residual_n) => (Stop::AtRest, residual_n),
            None => settle(&mut model, newton, &mut x, limit_n, &self.options),
        };
        let still = vec![Vector3::zeros(); x.len()];
        let predicted = predicted.as_ref().unwrap_or(&still);
        let off = x.iter().zip(x0.iter()).zip(predicted).map(|((a, b), d)| a - b - d);
        let branch_jump_m = root_mean_square(off);
        let expected_m = root_mean_square(predicted.iter().copied());
        let error = if corrected.is_some() { EXPECTED_ERROR } else { DESCENT_ERROR };
        let left_branch = branch_jump_m > how.branch_jump_m + error * expected_m;
        Tried {
            model,
            x,
            stop,
            residual_n,
            branch_jump_m,
            left_branch,
            descended: corrected.is_none(),
        }
    }

    /// Makes the factor at the sheet's rest again, after a step that was not taken.
    fn restore(&mut self) {
        let Rested { model, newton, x, .. } = &mut self.rested;
        newton.renew_contact(model, x);
        newton.is_stable(model, x);
    }

    /// Takes a step that was tried.
    fn accept(&mut self, tried: Tried, setup: Setup) {
        let Tried { mut model, x, stop, residual_n, .. } = tried;
        model.remember(&x);
        self.rested.model = model;
        self.rested.x = x;
        self.rested.stop = stop;
        self.rested.residual_n = residual_n;
        self.setup = setup;
        self.options.experiment = setup.experiment;
    }

    fn event(&self, tried: &Tried, stretch: [f64; 2], setup: Setup) -> Event {
        let (before, after) = (self.boundary(), tried.model.grid.boundary(&tried.x));
        let moved = before.positions_m().zip(after.positions_m()).map(|(a, b)| (a, (b - a).norm()));
        let most = moved.max_by(|a, b| a.1.total_cmp(&b.1));
        let bearing_rad = most.map_or(0.0, |(at, _)| at.z.atan2(at.x));
        Event {
            stretch,
            setup,
            nodes: [count_nodes(&before), count_nodes(&after)],
            bearing_rad,
            branch_jump_m: tried.branch_jump_m,
            before,
            after,
        }
    }
}

/// Part of a predicted move by which a smooth way differs from it over one step, from the way's
/// curvature: over steps of 0.25 that end on their branch 0.1 to 0.4.
const EXPECTED_ERROR: f64 = 0.5;
/// The same of a step that the descents ended: a sheet that had no equilibrium near where it was
/// predicted has mostly left its branch.
const DESCENT_ERROR: f64 = 0.1;
/// Corrections before the descents take over.
const CORRECTIONS: usize = 12;
/// Corrections in a row without progress before they do.
const IDLE: usize = 2;

/// Corrections until the sheet is at rest; `None` where it does not come to rest by them. Gives
/// the residual \[N\], and leaves the factor of the exact Hessian there.
fn correct(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    limit_n: f64,
    limit_step_m: f64,
) -> Option<f64> {
    let (mut best_j, mut idle) = (f64::INFINITY, 0);
    let mut last_n = f64::INFINITY;
    let mut again = false;
    for _ in 0..CORRECTIONS {
        let grip_change_n = newton.renew_contact(model, x);
        let done = match again {
            true => newton.correct_again(model, x),
            false => newton.correct(model, x),
        };
        let balanced = done.residual_n < limit_n && grip_change_n < limit_n;
        if balanced && done.definite && done.step_m < limit_step_m {
            return newton.is_stable(model, x).then_some(done.residual_n);
        }
        if done.decrement_j < 0.5 * best_j {
            (best_j, idle) = (done.decrement_j, 0);
        } else {
            idle += 1;
        }
        if done.fraction == 0.0 || idle > IDLE {
            return None;
        }
        let near = done.residual_n < NEAR * limit_n && done.definite && done.fraction == 1.0;
        again = near && done.residual_n < FALLING * last_n;
        last_n = done.residual_n;
    }
    None
}

/// Residual, in limits, below which a factor serves for more than one correction, ...
const NEAR: f64 = 1e4;
/// ... as long as each leaves no more than this part of the residual before.
const FALLING: f64 = 0.3;

fn root_mean_square(moves: impl ExactSizeIterator<Item = Vector3>) -> f64 {
    let count = moves.len().max(1) as f64;
    (moves.map(|m| m.norm_squared()).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests;

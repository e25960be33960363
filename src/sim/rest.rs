//! The search for equilibrium: quasi-Newton descents and Newton steps in turn.

use crate::base::Vector3;
use crate::sim::guide::Guide;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;
use crate::sim::motion::{Pace, evolve};
use crate::sim::newton::{Inertia, Memory, Newton};
use crate::sim::options::{SimOptions, Stop};

/// Descents by quasi-Newton until the residual is small, then Newton steps; round again
/// where they do not lead to rest. At a saddle the sheet is nudged off along its direction
/// of lowest curvature. Gives why it stopped and the residual \[N\].
pub(super) fn settle(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    limit_n: f64,
    options: &SimOptions,
) -> (Stop, f64) {
    let budget = newton.effort.factorisations + options.iterations;
    let mut memory = Memory::default();
    let mut nudges = 0;
    while newton.effort.factorisations < budget {
        let end = descend(model, newton, x, &mut memory, limit_n, options.energy_drop);
        memory.clear();
        match end {
            Descent::Slow(residual_n) => return (Stop::Slow, residual_n),
            // between layers: let the barrier push them apart
            Descent::Wedged => {
                let pace = Pace { first_s: 2e-3, growth: 1.2, longest_s: options.fall_step_s };
                evolve(model, newton, x, pace, UNWEDGE_STEPS, 0.0);
            }
            Descent::NearRest | Descent::Paused => {}
        }
        match finish(model, newton, x, limit_n, options.step_m) {
            Finish::Rest(residual_n) => return (Stop::AtRest, residual_n),
            Finish::Saddle(residual_n) if nudges == NUDGES => {
                return (Stop::Unstable, residual_n);
            }
            Finish::Saddle(_) => {
                nudges += 1;
                newton.nudge(model, x, NUDGE_M);
            }
            Finish::Far => {}
        }
    }
    let mut gradient = vec![Vector3::zeros(); x.len()];
    model.gradient(x, &mut gradient);
    (Stop::Iterations, gradient.iter().map(Vector3::norm).fold(0.0, f64::max))
}

/// Brings a sheet that starts from a scanned one to rest on its springs, and releases it.
///
/// First the cloth slides freely on the plate: a scanned sheet is right across the surface and off
/// by some tenths of a millimetre along it, which is a strain that no drape has and that friction
/// would keep. Then friction grips where the cloth lies by now, and the springs are released in
/// stages, each with the sheet at rest on them.
pub(super) fn release(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    springs: Guide,
    limit_n: f64,
) {
    let (held_n_m, friction) = (springs.stiffness_n_m, model.plate.friction());
    model.guide = springs;
    model.plate.set_friction(0.0);
    for _ in 0..SLIDING_DESCENTS {
        descend(model, newton, x, &mut Memory::default(), limit_n, HELD_DROP);
    }
    model.plate.set_friction(friction);
    for share in RELEASE {
        model.guide.stiffness_n_m = held_n_m * share;
        descend(model, newton, x, &mut Memory::default(), limit_n, RELEASED_DROP);
    }
    model.guide = Guide::default();
}

/// Descents of the sheet that slides on the plate; a second one continues where the first was
/// wedged.
const SLIDING_DESCENTS: usize = 2;
/// Fall of the energy in a cycle at which the sliding sheet counts as at rest on its springs.
const HELD_DROP: f64 = 1e-6;
/// Shares of their stiffness that the springs keep in the stages of their release. For the true
/// fabric a single step does as well; for another one the sheet has farther to go.
const RELEASE: [f64; 2] = [0.25, 0.06];
/// Fall of the energy in a cycle at which a stage is over.
const RELEASED_DROP: f64 = 1e-5;

/// How a descent ended.
pub(super) enum Descent {
    /// The residual \[N\] is within reach of Newton steps.
    NearRest,
    /// The energy hardly falls any more; the residual \[N\].
    Slow(f64),
    /// No fraction of a step lowers the energy.
    Wedged,
    /// It has gone on for long enough to try Newton steps.
    Paused,
}

/// Quasi-Newton descents, each on a fresh factor, friction and contact following.
pub(super) fn descend(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    memory: &mut Memory,
    limit_n: f64,
    energy_drop: f64,
) -> Descent {
    let mut last_j = model.energy_j(x);
    for _ in 0..DESCENTS {
        newton.renew_contact(model, x);
        let done = newton.quasi_newton(model, x, memory, QUASI_STEPS, limit_n);
        let now_j = model.energy_j(x);
        let drop = (last_j - now_j) / now_j.abs();
        last_j = now_j;
        if done.fraction == 0.0 || !done.definite {
            return Descent::Wedged;
        }
        if energy_drop > 0.0 && drop < energy_drop {
            return Descent::Slow(done.residual_n);
        }
        if done.residual_n < NEAR_REST * limit_n {
            return Descent::NearRest;
        }
    }
    Descent::Paused
}

/// How friction answers the forces on the plate from one Newton step to the next. Each step takes
/// the normal forces of the last one. Where cloth is drawn tight over the edge, more
/// friction there means less force in the step after, and the two can go up and down for ever; they
/// meet when friction goes half of the way. In the corrections of a continuation (`follow.rs`) the
/// same was tried and dropped: walks of the measured prior became more expensive by a third.
struct Answer {
    /// Part of the way to the normal forces of the present sheet.
    part: f64,
    last_n: f64,
}

impl Default for Answer {
    fn default() -> Self {
        Self { part: 1.0, last_n: f64::INFINITY }
    }
}

impl Answer {
    /// Renews the contacts. Gives the largest change of a normal force times friction \[N\].
    fn renew(&mut self, model: &mut Model, newton: &mut Newton, x: &[Vector3]) -> f64 {
        let change_n = newton.renew_contact_by(model, x, self.part);
        if change_n > NOT_FALLING * self.last_n {
            self.part = HALF;
        }
        self.last_n = change_n;
        change_n
    }
}

/// Share of its change one step before from which on friction counts as not settling.
const NOT_FALLING: f64 = 0.95;
/// Part of the way that it then goes.
const HALF: f64 = 0.5;

/// How Newton steps ended.
enum Finish {
    /// A stable equilibrium; residual \[N\].
    Rest(f64),
    /// An equilibrium that some small move leaves downhill; that move is the solver's
    /// direction. Residual \[N\].
    Saddle(f64),
    /// Nothing: not near enough.
    Far,
}

/// Newton steps with the exact Hessian, friction following.
fn finish(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    limit_n: f64,
    limit_step_m: f64,
) -> Finish {
    let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
    let mut answer = Answer::default();
    for _ in 0..NEWTON_STEPS {
        let grip_change_n = answer.renew(model, newton, x);
        let done = newton.iterate(model, x, still, HessianForm::Exact);
        let settled = done.residual_n < limit_n && grip_change_n < limit_n;
        if settled && done.definite && done.step_m < limit_step_m {
            if newton.is_stable(model, x) {
                return Finish::Rest(done.residual_n);
            }
        } else if done.fraction >= 0.05 {
            continue;
        } else if !settled {
            return Finish::Far;
        }
        // at rest as far as forces tell, but the factor, blind to contact outside its
        // pattern, calls the Hessian indefinite: ask the whole of it
        return match newton.lowest_curvature(model, x) {
            Some(curvature) if curvature > 0.0 => Finish::Rest(done.residual_n),
            Some(_) => Finish::Saddle(done.residual_n),
            None => Finish::Far,
        };
    }
    Finish::Far
}

/// Moves off a saddle before it is reported as the end.
const NUDGES: usize = 5;
/// Largest move of a vertex in one \[m\].
const NUDGE_M: f64 = 0.5e-3;
/// Descents, each on a fresh factor, before Newton steps are tried.
const DESCENTS: usize = 20;
/// Residual, in limits, from which Newton steps are tried.
const NEAR_REST: f64 = 100.0;
/// Steps of motion that free layers wedged against each other.
const UNWEDGE_STEPS: usize = 5;
/// Quasi-Newton iterations on one factor.
const QUASI_STEPS: usize = 15;
/// Newton steps in a row before the sheet is set in motion again.
const NEWTON_STEPS: usize = 20;

//! Motion of the sheet in time: implicit Euler with large steps.

use crate::base::Vector3;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;
use crate::sim::newton::{Inertia, Newton};

/// How the time step of a motion grows.
#[derive(Clone, Copy)]
pub(super) struct Pace {
    pub(super) first_s: f64,
    pub(super) growth: f64,
    pub(super) longest_s: f64,
}

/// Implicit Euler from rest, one Newton iteration with the projected Hessian a
/// step, until the sheet is slow or the steps run out. Its numerical damping is
/// what brings the sheet to rest.
pub(super) fn evolve(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    pace: Pace,
    steps: usize,
    slow_m_s: f64,
) {
    let mut velocity = vec![Vector3::zeros(); x.len()];
    let mut free_flight = x.to_vec();
    let mut before = x.to_vec();
    let mut dt_s = pace.first_s;
    for step in 0..steps {
        for ((y, p), u) in free_flight.iter_mut().zip(x.iter()).zip(&velocity) {
            *y = p + u * dt_s;
        }
        newton.renew_contact(model, x);
        before.copy_from_slice(x);
        let inertia = Inertia { dt_s, free_flight: Some(&free_flight) };
        let mut done = newton.iterate(model, x, inertia, HessianForm::Projected);
        for _ in 1..ITERATIONS_A_STEP {
            // a pair in the way stops the whole sheet: continue until its barrier acts
            if done.fraction > 0.5 || !done.definite {
                break;
            }
            model.membrane.forget_lagged_stress();
            done = newton.iterate(model, x, inertia, HessianForm::Projected);
        }
        let mut fastest = 0.0_f64;
        for ((u, p), q) in velocity.iter_mut().zip(x.iter()).zip(&before) {
            *u = (p - q) * (DAMPING / dt_s);
            fastest = fastest.max(u.norm());
        }
        if step > 10 && done.fraction > 0.5 && fastest < slow_m_s {
            break;
        }
        dt_s =
            if done.fraction < 0.3 { dt_s * 0.5 } else { (dt_s * pace.growth).min(pace.longest_s) };
    }
}

/// Newton iterations in a step that self-contact cuts short.
const ITERATIONS_A_STEP: usize = 4;
/// Fraction of the velocity that is left after a step.
const DAMPING: f64 = 0.97;

//! The steps of a continuation: the move that a changed model asks for, predicted with the factor
//! at hand, and the corrections that bring the sheet to rest on the changed model.
//!
//! A correction is a Newton step on the exact Hessian that is taken whole even where the energy
//! rises a little: what rises is the strain of second order, which the next one takes out again.
//! Where the exact Hessian is not positive definite, membrane compression and shear are halved in
//! its geometric stiffness, then left out, until it is; the direction then leans on the mode that
//! the sheet leaves along, and is followed for as long as the energy falls. Tried and dropped: a
//! shift by inertia (the negative curvatures are the membrane's, and far larger), and conjugate
//! gradients that stop at negative curvature (the stress that their direction predicts is no
//! longer one, and the next Hessian is indefinite for that reason).

use super::linear::CG_TOLERANCE;
use super::workspace::{Inertia, LONGEST_STEP_M, Newton, dot, largest};
use crate::base::Vector3;
use crate::sim::effort::charge;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;

/// What a correction did.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    /// Largest net force on a vertex before it \[N\].
    pub residual_n: f64,
    /// Twice the decrease of the energy that it promised \[J\].
    pub decrement_j: f64,
    /// Largest move of a vertex in the whole step \[m\].
    pub step_m: f64,
    /// Fraction of the step that was taken; more than 1 where it was followed beyond its end.
    pub fraction: f64,
    /// Whether the exact Hessian was positive definite.
    pub definite: bool,
}

/// Parts of the compression that are tried where the whole makes the Hessian indefinite.
const KEPT_COMPRESSION: [f64; 2] = [0.5, 0.0];
/// Times that a direction on an indefinite Hessian is followed at most ...
const LONGEST_FOLLOWED: f64 = 16.0;
/// ... and how far \[m\].
const FARTHEST_FOLLOWED_M: f64 = 4e-3;
/// Rise of the energy, in promised decreases, that is taken.
const RISE: f64 = 100.0;
/// Shortenings of a step before it is given up.
const SHORTENINGS: usize = 8;

impl Newton {
    /// Moves `x`, at rest on the model that the last tangent was made of, to where the linearised
    /// forces of the changed `model` balance, or as far as contacts allow. The whole move \[m\] is
    /// left in `direction`; `None`, and `x` as it was, where there is no factor to tell it.
    pub fn predict(&mut self, model: &mut Model, x: &mut [Vector3]) -> Option<Vec<Vector3>> {
        if !self.exact {
            return None;
        }
        charge(&mut self.effort.assembly_s, || model.gradient(x, &mut self.gradient));
        if !self.solve_exactly(model) {
            return None;
        }
        let whole = self.direction.clone();
        let longest = largest(&self.direction);
        if !longest.is_finite() {
            return None;
        }
        let scale = (LONGEST_STEP_M / longest).min(1.0);
        self.direction.iter_mut().for_each(|d| *d *= scale);
        let limit = self.limit(model, x);
        model.membrane.lag_linearised_stress(&model.grid, x, &self.direction, limit);
        self.try_fraction(x, limit);
        x.copy_from_slice(&self.trial);
        Some(whole)
    }

    /// One correction of `x` on `model`, contacts renewed; `x` stays where no step is found.
    pub fn correct(&mut self, model: &mut Model, x: &mut [Vector3]) -> Correction {
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        let residual_n = self.assemble(model, x, still, HessianForm::Exact);
        let mut factorised = self.factorize();
        let mut correction = Correction {
            residual_n,
            decrement_j: f64::INFINITY,
            step_m: f64::INFINITY,
            fraction: 0.0,
            definite: factorised,
        };
        for kept in KEPT_COMPRESSION {
            if !factorised {
                model.membrane.relieve_compression(&model.grid, x, kept);
                self.assemble(model, x, still, HessianForm::Exact);
                factorised = self.factorize();
            }
        }
        self.exact = factorised && correction.definite;
        if factorised {
            correction.definite &= self.solve_exactly(model);
        } else {
            // layers that hold each other up beyond the pattern
            correction.definite = self.solve(model, x, HessianForm::Exact);
            self.exact = false;
        }
        let longest = largest(&self.direction);
        if longest > 0.0 && longest.is_finite() {
            correction.step_m = longest;
            correction.decrement_j = -dot(&self.gradient, &self.direction);
            correction.fraction = self.take(model, x, &correction);
        }
        correction
    }

    /// One more correction of `x` with the factor at hand, which is that of a place nearby: for the
    /// last moves, when a new factor would be the same but for a few digits.
    pub fn correct_again(&mut self, model: &mut Model, x: &mut [Vector3]) -> Correction {
        charge(&mut self.effort.assembly_s, || model.gradient(x, &mut self.gradient));
        let residual_n = largest(&self.gradient);
        let definite = self.exact && self.solve_exactly(model);
        let step_m = largest(&self.direction);
        let decrement_j = -dot(&self.gradient, &self.direction);
        let mut correction =
            Correction { residual_n, decrement_j, step_m, fraction: 0.0, definite };
        if definite && step_m.is_finite() && step_m < LONGEST_STEP_M {
            let limit = self.limit(model, x);
            self.try_fraction(x, limit);
            x.copy_from_slice(&self.trial);
            correction.fraction = limit;
        }
        correction
    }

    /// direction = -H^-1 gradient with the exact factor; false where contact beyond the pattern
    /// shows negative curvature.
    fn solve_exactly(&mut self, model: &Model) -> bool {
        for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
            *d = -g;
        }
        if self.tangent.outside.is_empty() {
            charge(&mut self.effort.solve_s, || self.factor.solve(&mut self.direction));
            return true;
        }
        self.solve_whole(model, true, CG_TOLERANCE)
    }

    /// Largest fraction of the direction that contacts allow.
    fn limit(&mut self, model: &mut Model, x: &[Vector3]) -> f64 {
        charge(&mut self.effort.contact_s, || {
            model.self_contact.update_along(x, &self.direction);
            model.max_step(x, &self.direction)
        })
    }

    /// Moves `x` along the direction; gives the fraction.
    fn take(&mut self, model: &mut Model, x: &mut [Vector3], step: &Correction) -> f64 {
        let scale = (LONGEST_STEP_M / step.step_m).min(1.0);
        let reach = if step.definite {
            scale
        } else {
            (FARTHEST_FOLLOWED_M / step.step_m).clamp(scale, LONGEST_FOLLOWED)
        };
        self.direction.iter_mut().for_each(|d| *d *= reach);
        let limit = self.limit(model, x);
        let once = limit.min(scale / reach);
        model.membrane.lag_linearised_stress(&model.grid, x, &self.direction, once);
        let start_j = charge(&mut self.effort.search_s, || model.energy_j(x));
        let mut fraction = once;
        let mut rise_j = self.rise_j(model, x, fraction) - start_j;
        let allowed_j = if step.definite { RISE * step.decrement_j.max(0.0) } else { 0.0 };
        let allowed_j = allowed_j + super::workspace::ROUNDING * start_j.abs();
        for _ in 0..SHORTENINGS {
            if rise_j <= allowed_j {
                break;
            }
            fraction *= SHORTENED;
            rise_j = self.rise_j(model, x, fraction) - start_j;
        }
        if rise_j.is_nan() || rise_j > allowed_j {
            return 0.0;
        }
        while !step.definite && fraction >= once && fraction < limit {
            let next = (2.0 * fraction).min(limit);
            let next_j = self.rise_j(model, x, next) - start_j;
            if next_j.is_nan() || next_j >= rise_j {
                break;
            }
            (fraction, rise_j) = (next, next_j);
        }
        self.try_fraction(x, fraction);
        x.copy_from_slice(&self.trial);
        fraction * reach
    }

    /// The energy after this fraction of the direction \[J\].
    fn rise_j(&mut self, model: &Model, x: &[Vector3], fraction: f64) -> f64 {
        self.try_fraction(x, fraction);
        charge(&mut self.effort.search_s, || model.energy_j(&self.trial))
    }
}

/// What a step that rises too much is shortened to.
const SHORTENED: f64 = 0.3;

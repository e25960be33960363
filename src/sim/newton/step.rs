//! One Newton iteration: direction, limit of the contacts, line search.

use super::workspace::{
    HALVINGS, Inertia, Iteration, LONGEST_STEP_M, Newton, ROUNDING, dot, is_lower, largest,
};
use crate::base::Vector3;
use crate::sim::effort::charge;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;

impl Newton {
    /// One Newton iteration: moves `x` along the Newton direction of the step's objective as far as
    /// contacts allow and the objective falls. `x` stays where no fraction of the direction lowers
    /// the objective, or where the matrix has no factor.
    pub fn iterate(
        &mut self,
        model: &mut Model,
        x: &mut [Vector3],
        inertia: Inertia,
        form: HessianForm,
    ) -> Iteration {
        let residual_n = self.assemble(model, x, inertia, form);
        let definite = self.solve(model, x, form);
        let mut result = Iteration { residual_n, step_m: 0.0, fraction: 0.0, definite };
        let longest = largest(&self.direction);
        if longest == 0.0 || !longest.is_finite() {
            return result;
        }
        let step_m = longest.min(LONGEST_STEP_M);
        self.direction.iter_mut().for_each(|d| *d *= step_m / longest);
        let mut fraction = charge(&mut self.effort.contact_s, || {
            model.self_contact.update_along(x, &self.direction);
            model.max_step(x, &self.direction)
        });
        let start = self.objective(model, x, inertia);
        let slope = dot(&self.gradient, &self.direction);
        let unseen = -slope < ROUNDING * start.abs();
        for _ in 0..HALVINGS {
            self.try_fraction(x, fraction);
            let trial = std::mem::take(&mut self.trial);
            let value = self.objective(model, &trial, inertia);
            self.trial = trial;
            if unseen || is_lower(value, start, fraction * slope) {
                model.membrane.lag_linearised_stress(&model.grid, x, &self.direction, fraction);
                x.copy_from_slice(&self.trial);
                result.fraction = fraction;
                result.step_m = step_m * fraction;
                return result;
            }
            fraction = shortened(fraction, value - start, slope);
        }
        result
    }
}

/// The next fraction to try after `fraction` raised the objective by `rise`: the
/// minimum of the parabola through both, within a tenth and a half.
fn shortened(fraction: f64, rise: f64, slope: f64) -> f64 {
    let minimum = -slope * fraction * fraction / (2.0 * (rise - slope * fraction));
    if minimum.is_finite() { minimum.clamp(0.1 * fraction, 0.5 * fraction) } else { 0.3 * fraction }
}

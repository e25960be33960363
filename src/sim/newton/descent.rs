//! The descent towards an equilibrium: limited-memory BFGS on one factor at a time.

use std::collections::VecDeque;

use super::linear::SHIFT;
use super::workspace::{HALVINGS, Iteration, LONGEST_STEP_M, Newton, dot, is_lower, largest};
use crate::base::Vector3;
use crate::sim::effort::charge;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;

/// Least fraction of a step that is tried first, so that one that was cut short does not
/// hold up those after it.
const LEAST_FRACTION: f64 = 0.02;
/// Reach of the cache of self-contact pairs for short steps \[m\].
const REACH_M: f64 = 2e-3;

impl Newton {
    /// Lowers the energy by limited-memory BFGS on top of one factor of the
    /// projected Hessian, which is too stiff wherever the sheet buckles or rotates;
    /// the pairs of steps and gradient changes correct it at the price of a solve
    /// an iteration instead of a factor. Ends after `iterations`, or when no
    /// vertex feels more than `limit_n`, or when the line search fails.
    pub fn quasi_newton(
        &mut self,
        model: &mut Model,
        x: &mut [Vector3],
        memory: &mut Memory,
        iterations: usize,
        limit_n: f64,
    ) -> Iteration {
        match &memory.direction {
            Some(direction) => model.membrane.lag_second_order_stress(
                &model.grid,
                x,
                direction,
                SECOND_ORDER_WEIGHT,
            ),
            None => model.membrane.forget_lagged_stress(),
        }
        let residual_n = self.assemble(model, x, SHIFT, HessianForm::Projected);
        let mut result = Iteration { residual_n, step_m: 0.0, fraction: 1.0, definite: true };
        if !self.factorize_roughly() {
            result.definite = false;
            return result;
        }
        let mut energy = charge(&mut self.effort.search_s, || model.energy_j(x));
        let mut spare_m = 0.0;
        for _ in 0..iterations {
            let (slope, longest) = self.quasi_direction(memory);
            let limit = charge(&mut self.effort.contact_s, || {
                if longest > 0.25 * REACH_M {
                    model.self_contact.update_along(x, &self.direction);
                    spare_m = 0.0;
                } else if spare_m < 2.0 * longest {
                    model.self_contact.update(x, REACH_M);
                    spare_m = REACH_M;
                }
                model.max_step(x, &self.direction)
            });
            let first = limit.min((2.0 * memory.fraction).max(LEAST_FRACTION));
            memory.direction = Some(self.direction.clone());
            let Some((fraction, value)) = self.search(model, x, energy, slope, first) else {
                result.fraction = 0.0;
                return result;
            };
            energy = value;
            memory.fraction = fraction;
            result.fraction = fraction;
            result.step_m = longest * fraction;
            spare_m -= 2.0 * result.step_m;
            let previous = std::mem::take(&mut self.gradient);
            self.gradient = vec![Vector3::zeros(); previous.len()];
            charge(&mut self.effort.assembly_s, || model.gradient(&self.trial, &mut self.gradient));
            memory.push(x, &self.trial, &previous, &self.gradient);
            x.copy_from_slice(&self.trial);
            result.residual_n = largest(&self.gradient);
            if result.residual_n < limit_n {
                break;
            }
        }
        result
    }

    /// The quasi-Newton direction for the present gradient, with its slope and its
    /// largest move \[m\].
    fn quasi_direction(&mut self, memory: &mut Memory) -> (f64, f64) {
        charge(&mut self.effort.solve_s, || {
            self.direction.copy_from_slice(&self.gradient);
            memory.apply(&mut self.direction, |d| self.rough.solve(d));
        });
        self.direction.iter_mut().for_each(|d| *d = -*d);
        let mut slope = dot(&self.gradient, &self.direction);
        if slope >= 0.0 {
            memory.forget_pairs();
            for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
                *d = -g;
            }
            self.rough.solve(&mut self.direction);
            slope = dot(&self.gradient, &self.direction);
        }
        let longest = largest(&self.direction);
        let scale = (LONGEST_STEP_M / longest).min(1.0);
        if scale < 1.0 {
            self.direction.iter_mut().for_each(|d| *d *= scale);
        }
        (slope * scale, longest * scale)
    }

    /// Backtracks from `fraction` of the direction until the energy falls enough;
    /// the accepted place is in `trial`. Gives the fraction and the energy.
    fn search(
        &mut self,
        model: &Model,
        x: &[Vector3],
        energy: f64,
        slope: f64,
        mut fraction: f64,
    ) -> Option<(f64, f64)> {
        for _ in 0..HALVINGS {
            self.try_fraction(x, fraction);
            let value = charge(&mut self.effort.search_s, || model.energy_j(&self.trial));
            if is_lower(value, energy, fraction * slope) {
                return Some((fraction, value));
            }
            fraction = shortened_by_strain(fraction, value - energy, slope);
        }
        None
    }
}

/// The next fraction to try after `fraction` raised the energy by `rise`: the minimum
/// of a quartic, since it is the strain of second order that raises it.
fn shortened_by_strain(fraction: f64, rise: f64, slope: f64) -> f64 {
    let quartic = (rise - slope * fraction) / fraction.powi(4);
    let minimum = (-slope / (4.0 * quartic)).cbrt();
    if minimum.is_finite() { minimum.clamp(0.1 * fraction, 0.5 * fraction) } else { 0.3 * fraction }
}

/// One pair of the limited-memory BFGS update.
#[derive(Clone, Debug)]
struct Correction {
    /// The step s \[m\].
    step: Vec<Vector3>,
    /// The change y of the gradient along it \[N\].
    change: Vec<Vector3>,
    /// 1 / (y . s) \[1/J\].
    inverse_work: f64,
}

/// What a quasi-Newton descent remembers: the last steps and gradient changes, the
/// last direction and how much of it could be taken.
#[derive(Clone, Debug)]
pub struct Memory {
    pairs: VecDeque<Correction>,
    direction: Option<Vec<Vector3>>,
    fraction: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { pairs: Default::default(), direction: None, fraction: 1.0 }
    }
}

/// Pairs that are kept.
const MEMORY: usize = 10;
/// Weight, in the descent's lagged geometric stiffness, of the tension that the last direction
/// would have caused by its strain of second order: it stiffens the matrix where cells rotate most
/// and would otherwise cut the whole step short. The best of 0, 0.3 and 3 on two fabrics.
const SECOND_ORDER_WEIGHT: f64 = 3.0;

impl Memory {
    /// Forgets all steps, since they belong to another energy.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    fn forget_pairs(&mut self) {
        self.pairs.clear();
    }

    /// Remembers the step from `x` to `next`, if the gradient grew along it.
    fn push(&mut self, x: &[Vector3], next: &[Vector3], g: &[Vector3], next_g: &[Vector3]) {
        let s: Vec<_> = next.iter().zip(x).map(|(a, b)| a - b).collect();
        let y: Vec<_> = next_g.iter().zip(g).map(|(a, b)| a - b).collect();
        let sy = dot(&s, &y);
        if sy > 1e-12 * dot(&s, &s).sqrt() * dot(&y, &y).sqrt() {
            if self.pairs.len() == MEMORY {
                self.pairs.pop_front();
            }
            self.pairs.push_back(Correction { step: s, change: y, inverse_work: 1.0 / sy });
        }
    }

    /// The two-loop recursion (Nocedal 1980) around `solve`.
    fn apply(&self, q: &mut [Vector3], solve: impl FnOnce(&mut [Vector3])) {
        let mut alphas = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let alpha = pair.inverse_work * dot(&pair.step, q);
            q.iter_mut().zip(&pair.change).for_each(|(a, b)| *a -= b * alpha);
            alphas.push(alpha);
        }
        solve(q);
        for (pair, alpha) in self.pairs.iter().zip(alphas.iter().rev()) {
            let beta = pair.inverse_work * dot(&pair.change, q);
            q.iter_mut().zip(&pair.step).for_each(|(a, b)| *a += b * (alpha - beta));
        }
    }
}

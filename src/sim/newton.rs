//! One implicit step, and what it shares with the search for equilibrium.
//!
//! A step minimises `E(x) + 1/2 sum m |x - y|^2 / dt^2` from the current x, with
//! y the place where inertia alone would carry the sheet: implicit Euler. With
//! y = x it is a proximal (pseudo-transient) step, and with dt infinite a plain
//! Newton step for the equilibrium. How its direction is found is in `linear.rs`.

mod descent;
mod linear;
mod stability;

pub use descent::Memory;

use crate::base::Vector3;
use crate::numeric::sparse::Factor;
use crate::sim::effort::{Effort, charge};
use crate::sim::model::{Model, Tangent};

/// The solver's work space and accounts for one grid.
pub struct Newton {
    factor: Factor,
    rough: Factor<f32>,
    tangent: Tangent,
    gradient: Vec<Vector3>,
    direction: Vec<Vector3>,
    trial: Vec<Vector3>,
    krylov: [Vec<Vector3>; 3],
    /// Work so far.
    pub effort: Effort,
}

/// The inertia of a step.
#[derive(Clone, Copy, Debug)]
pub struct Inertia<'a> {
    /// Time step \[s\]; infinite for none.
    pub dt_s: f64,
    /// Where inertia alone would carry each vertex \[m\]; `None`: where it is.
    pub free_flight: Option<&'a [Vector3]>,
}

/// Which tangent a step is taken with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangency {
    /// The positive semidefinite substitute, factorised in single precision without the
    /// blocks outside the grid's pattern: a direction that the line search then judges.
    Projected,
    /// The Hessian, whole and in double precision.
    Exact,
}

/// What one Newton iteration did.
#[derive(Clone, Copy, Debug)]
pub struct Iteration {
    /// Largest force on a vertex before it, inertia left out \[N\].
    pub residual_n: f64,
    /// Largest move of a vertex \[m\].
    pub step_m: f64,
    /// Fraction of the full step that was taken; 0 if none lowered the energy.
    pub fraction: f64,
    /// Whether no negative curvature was met in the matrix with its inertia.
    pub definite: bool,
}

/// Largest move of a vertex that a step may ask for \[m\]: about a plate's edge.
const LONGEST_STEP_M: f64 = 0.03;
/// Sufficient decrease (Armijo), the usual value.
const ARMIJO: f64 = 1e-4;
/// Rounding of an energy, as a part of it; a decrease below it cannot be seen, and a
/// step that promises no more is taken whole.
const ROUNDING: f64 = 1e-13;
/// Halvings before a step is given up.
const HALVINGS: usize = 14;

impl Newton {
    /// Work space for one thread.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let n = model.grid.vertices();
        let zeros = || vec![Vector3::zeros(); n];
        Self {
            factor: Factor::new(&model.grid.analysis),
            rough: Factor::new(&model.grid.analysis),
            tangent: Tangent::default(),
            gradient: zeros(),
            direction: zeros(),
            trial: zeros(),
            krylov: [zeros(), zeros(), zeros()],
            effort: Effort::default(),
        }
    }

    /// One Newton iteration on the step's objective; `x` moves unless no fraction
    /// of the direction lowers the objective or there is no factor.
    pub fn iterate(
        &mut self,
        model: &mut Model,
        x: &mut [Vector3],
        inertia: Inertia,
        tangency: Tangency,
    ) -> Iteration {
        let residual_n = self.assemble(model, x, inertia, tangency);
        let definite = self.solve(model, x, tangency);
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
                model.foresee(x, &self.direction, fraction);
                x.copy_from_slice(&self.trial);
                result.fraction = fraction;
                result.step_m = step_m * fraction;
                return result;
            }
            fraction = shortened(fraction, value - start, slope);
        }
        result
    }

    /// Finds what touches, and the grip of friction, anew; gives the largest change of a
    /// normal force on the plate \[N\].
    pub fn renew_contact(&mut self, model: &mut Model, x: &[Vector3]) -> f64 {
        charge(&mut self.effort.contact_s, || {
            model.self_contact.update(x, 0.0);
            model.plate.renew(&model.grid, x)
        })
    }

    /// What a step minimises \[J\].
    fn objective(&mut self, model: &Model, x: &[Vector3], inertia: Inertia) -> f64 {
        charge(&mut self.effort.search_s, || {
            let pull: f64 = match inertia.free_flight {
                Some(y) => {
                    let apart = x.iter().zip(y).map(|(p, q)| (p - q).norm_squared());
                    apart.zip(&model.mass_kg).map(|(square, m)| m * square).sum()
                }
                None => 0.0,
            };
            model.energy_j(x) + 0.5 * inertia.dt_s.powi(-2) * pull
        })
    }

    fn try_fraction(&mut self, x: &[Vector3], fraction: f64) {
        for ((t, p), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
            *t = p + d * fraction;
        }
    }
}

/// Whether `value` is enough below `start` for a move along which the slope promised
/// `promised` (negative), as far as rounding tells.
fn is_lower(value: f64, start: f64, promised: f64) -> bool {
    value <= start + ARMIJO * promised + ROUNDING * start.abs()
}

/// The next fraction to try after `fraction` raised the objective by `rise`: the
/// minimum of the parabola through both, within a tenth and a half.
fn shortened(fraction: f64, rise: f64, slope: f64) -> f64 {
    let minimum = -slope * fraction * fraction / (2.0 * (rise - slope * fraction));
    if minimum.is_finite() { minimum.clamp(0.1 * fraction, 0.5 * fraction) } else { 0.3 * fraction }
}

fn largest(a: &[Vector3]) -> f64 {
    a.iter().map(Vector3::norm).fold(0.0, f64::max)
}

fn dot(a: &[Vector3], b: &[Vector3]) -> f64 {
    a.iter().zip(b).map(|(p, q)| p.dot(q)).sum()
}

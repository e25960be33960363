//! One implicit step, and what it shares with the search for equilibrium.
//!
//! A step minimises `E(x) + 1/2 sum m |x - y|^2 / dt^2` from the current x, with
//! y the place where inertia alone would carry the sheet: implicit Euler. With
//! y = x it is a proximal (pseudo-transient) step, and with dt infinite a plain
//! Newton step for the equilibrium. The direction comes from a Cholesky factor
//! on the grid's fixed pattern; the blocks of self-contact outside the pattern
//! enter by conjugate gradients preconditioned with that factor.

mod descent;
mod stability;

pub use descent::Memory;

use nalgebra::Matrix3;

use crate::base::Vector3;
use crate::numeric::sparse::Factor;
use crate::sim::model::{Model, Tangent};

/// The solver's work space and counters for one grid.
pub struct Newton {
    factor: Factor,
    rough: Factor<f32>,
    tangent: Tangent,
    gradient: Vec<Vector3>,
    direction: Vec<Vector3>,
    trial: Vec<Vector3>,
    krylov: [Vec<Vector3>; 3],
    /// Whether the last factor is the one in single precision.
    single: bool,
    /// Factorisations so far.
    pub factorisations: usize,
    /// Conjugate-gradient iterations so far.
    pub cg_iterations: usize,
}

/// The inertia of a step.
#[derive(Clone, Copy, Debug)]
pub struct Inertia<'a> {
    /// Time step \[s\]; infinite for none.
    pub dt_s: f64,
    /// Where inertia alone would carry each vertex \[m\]; `None`: where it is.
    pub free_flight: Option<&'a [Vector3]>,
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
    /// Whether the matrix with its inertia was positive definite.
    pub definite: bool,
}

/// Largest move of a vertex that a step may ask for \[m\]: about a plate's edge.
const LONGEST_STEP_M: f64 = 0.03;
/// Sufficient decrease (Armijo), the usual value.
const ARMIJO: f64 = 1e-4;
/// Newton steps shorter than this are taken without asking for a decrease \[m\].
const TRUSTED_STEP_M: f64 = 2e-6;
/// Halvings before a step is given up.
const HALVINGS: usize = 14;
/// Inertia that keeps the projected Hessian positive definite in single precision
/// \[s\]; from 0.03 to 2 s the descent is as fast.
const SHIFT: Inertia<'static> = Inertia { dt_s: 0.1, free_flight: None };

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
            single: false,
            factorisations: 0,
            cg_iterations: 0,
        }
    }

    /// One Newton iteration on the step's objective; `x` moves unless no fraction
    /// of the direction lowers the objective or the matrix is not definite.
    pub fn iterate(
        &mut self,
        model: &mut Model,
        x: &mut [Vector3],
        inertia: Inertia,
        project: bool,
    ) -> Iteration {
        let per_mass = inertia.dt_s.powi(-2);
        let residual_n = self.assemble(model, x, inertia, project);
        let mut result = Iteration { residual_n, step_m: 0.0, fraction: 0.0, definite: true };
        self.factorisations += 1;
        if !self.factorize(project) || !self.solve(model) {
            result.definite = false;
            return result;
        }
        let longest = largest(&self.direction);
        if !longest.is_finite() {
            result.definite = false;
            return result;
        }
        if longest > LONGEST_STEP_M {
            let scale = LONGEST_STEP_M / longest;
            self.direction.iter_mut().for_each(|d| *d *= scale);
        }
        let step_m = longest.min(LONGEST_STEP_M);
        model.self_contact.update_along(x, &self.direction);
        let objective = |model: &Model, x: &[Vector3]| {
            let pull: f64 = match inertia.free_flight {
                Some(y) => x
                    .iter()
                    .zip(y)
                    .zip(&model.mass_kg)
                    .map(|((p, q), m)| m * (p - q).norm_squared())
                    .sum(),
                None => 0.0,
            };
            model.energy_j(x) + 0.5 * per_mass * pull
        };
        let start = objective(model, x);
        let slope = dot(&self.gradient, &self.direction);
        let mut fraction = model.self_contact.max_step(x, &self.direction);
        for _ in 0..HALVINGS {
            self.try_fraction(x, fraction);
            let value = objective(model, &self.trial);
            let lower = value <= start + ARMIJO * fraction * slope;
            // below this the energy's rounding hides the decrease
            if lower || (step_m < TRUSTED_STEP_M && value.is_finite()) {
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

    fn try_fraction(&mut self, x: &[Vector3], fraction: f64) {
        for ((t, p), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
            *t = p + d * fraction;
        }
    }

    /// Factor of the assembled matrix: in single precision where it only gives
    /// directions.
    fn factorize(&mut self, single: bool) -> bool {
        self.single = single;
        if single {
            self.rough.factorize(&self.tangent.values)
        } else {
            self.factor.factorize(&self.tangent.values)
        }
    }

    /// Gradient and matrix of the step's objective; returns the largest force on
    /// a vertex without inertia \[N\].
    fn assemble(
        &mut self,
        model: &mut Model,
        x: &[Vector3],
        inertia: Inertia,
        project: bool,
    ) -> f64 {
        model.gradient(x, &mut self.gradient);
        let residual_n = largest(&self.gradient);
        model.hessian(x, project, &mut self.tangent);
        let per_mass = inertia.dt_s.powi(-2);
        if per_mass > 0.0 {
            let pattern = model.grid.analysis.pattern();
            for (v, m) in model.mass_kg.iter().enumerate() {
                let block = Matrix3::identity() * (m * per_mass);
                pattern.add_diagonal(&mut self.tangent.values, v, &block);
                if let Some(y) = inertia.free_flight {
                    self.gradient[v] += (x[v] - y[v]) * (m * per_mass);
                }
            }
        }
        residual_n
    }

    /// direction = -A^-1 gradient; false if a negative curvature was met.
    fn solve(&mut self, model: &Model) -> bool {
        for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
            *d = -g;
        }
        // the projected Hessian only gives a direction: without the blocks outside the
        // pattern it is stiffer still, but a descent's
        if self.single || self.tangent.outside.is_empty() {
            apply_factor(self.single, &mut self.rough, &mut self.factor, &mut self.direction);
            return true;
        }
        self.conjugate_gradients(model)
    }

    /// Solves with the outside blocks; the right-hand side is in `direction`.
    fn conjugate_gradients(&mut self, model: &Model) -> bool {
        const LIMIT: usize = 60;
        // a direction of the projected Hessian need not be exact
        let tolerance: f64 = if self.single { 1e-2 } else { 1e-4 };
        let [residual, preconditioned, product] = &mut self.krylov;
        residual.copy_from_slice(&self.direction);
        self.direction.fill(Vector3::zeros());
        preconditioned.copy_from_slice(residual);
        apply_factor(self.single, &mut self.rough, &mut self.factor, preconditioned);
        let mut search = preconditioned.clone();
        let mut rho = dot(residual, preconditioned);
        let target = rho * tolerance * tolerance;
        for _ in 0..LIMIT {
            self.cg_iterations += 1;
            multiply(model, &self.tangent, &search, product);
            let curvature = dot(&search, product);
            if curvature <= 0.0 {
                return false;
            }
            let alpha = rho / curvature;
            for v in 0..search.len() {
                self.direction[v] += search[v] * alpha;
                residual[v] -= product[v] * alpha;
            }
            preconditioned.copy_from_slice(residual);
            apply_factor(self.single, &mut self.rough, &mut self.factor, preconditioned);
            let next = dot(residual, preconditioned);
            if next <= target {
                break;
            }
            let beta = next / rho;
            rho = next;
            for (s, z) in search.iter_mut().zip(preconditioned.iter()) {
                *s = z + *s * beta;
            }
        }
        true
    }
}

fn apply_factor(single: bool, rough: &mut Factor<f32>, factor: &mut Factor, x: &mut [Vector3]) {
    if single { rough.solve(x) } else { factor.solve(x) }
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

fn multiply(model: &Model, tangent: &Tangent, x: &[Vector3], out: &mut [Vector3]) {
    model.grid.analysis.pattern().multiply(&tangent.values, x, out);
    for (r, c, block) in &tangent.outside {
        let (r, c) = (*r as usize, *c as usize);
        out[r] += block * x[c];
        out[c] += block.transpose() * x[r];
    }
}

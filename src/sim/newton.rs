//! One implicit step, and what it shares with the search for equilibrium.
//!
//! A step minimises `E(x) + 1/2 sum m |x - y|^2 / dt^2` from the current x, with
//! y the place where inertia alone would carry the sheet: implicit Euler. With
//! y = x it is a proximal (pseudo-transient) step, and with dt infinite a plain
//! Newton step for the equilibrium. The direction comes from a Cholesky factor
//! on the grid's fixed pattern; the blocks of self-contact outside the pattern
//! enter by conjugate gradients preconditioned with that factor.

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
/// Reach of the cache of self-contact pairs for short steps \[m\].
const REACH_M: f64 = 2e-3;
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

    /// Lowers the energy by limited-memory BFGS on top of one factor of the
    /// projected Hessian, which is too stiff wherever the sheet buckles or turns;
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
            Some(direction) => model.forebode(x, direction, FOREBODING),
            None => model.forget_foreseen(),
        }
        let residual_n = self.assemble(model, x, SHIFT, true);
        let mut result = Iteration { residual_n, step_m: 0.0, fraction: 1.0, definite: true };
        self.factorisations += 1;
        if !self.factorize(true) {
            result.definite = false;
            return result;
        }
        let mut energy = model.energy_j(x);
        let mut spare_m = 0.0;
        for _ in 0..iterations {
            let (slope, longest) = self.quasi_direction(memory);
            if longest > 0.25 * REACH_M {
                model.self_contact.update_along(x, &self.direction);
                spare_m = 0.0;
            } else if spare_m < 2.0 * longest {
                model.self_contact.update(x, REACH_M);
                spare_m = REACH_M;
            }
            let limit = model.self_contact.max_step(x, &self.direction);
            let first = limit.min(2.0 * memory.fraction);
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
            model.gradient(&self.trial, &mut self.gradient);
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
        self.direction.copy_from_slice(&self.gradient);
        memory.apply(&mut self.direction, |d| self.rough.solve(d));
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
            let value = model.energy_j(&self.trial);
            if value <= energy + ARMIJO * fraction * slope {
                return Some((fraction, value));
            }
            fraction = shortened_by_strain(fraction, value - energy, slope);
        }
        None
    }

    fn try_fraction(&mut self, x: &[Vector3], fraction: f64) {
        for ((t, p), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
            *t = p + d * fraction;
        }
    }

    /// The lowest curvature of the exact Hessian relative to the projected one, in
    /// the Krylov space of the gradient and `LANCZOS` products (Lanczos, made
    /// orthogonal throughout); its direction is left in `direction`, the largest
    /// move scaled to 1 m. Sees self-contact's blocks wherever they fall. A value
    /// above zero speaks for stability but does not prove it.
    pub fn lowest_curvature(&mut self, model: &mut Model, x: &[Vector3]) -> Option<f64> {
        self.assemble(model, x, SHIFT, true);
        self.factorisations += 1;
        if !self.factorize(true) {
            return None;
        }
        model.forget_foreseen();
        model.hessian(x, false, &mut self.tangent);
        // basis, orthonormal in the projected Hessian, and the Hessian's images of it
        let (mut basis, mut images): (Vec<Vec<Vector3>>, Vec<Vec<Vector3>>) = (vec![], vec![]);
        let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
        // the gradient may be nil, and blind to a mode: add a rough load
        let mut load = self.gradient.clone();
        let scale = (largest(&load) + 1e-12) * 1e-2;
        for (v, g) in load.iter_mut().enumerate() {
            *g += Vector3::from_fn(|r, _| ((12.9898 * (3 * v + r) as f64).sin() * 43758.5).fract())
                * scale;
        }
        for step in 0..LANCZOS {
            let mut next = load.clone();
            self.rough.solve(&mut next);
            let length = dot(&next, &load).max(0.0).sqrt();
            if step > 0 {
                if length < 1e-6 {
                    break;
                }
                beside.push(length);
            }
            next.iter_mut().chain(load.iter_mut()).for_each(|p| *p /= length);
            let mut product = vec![Vector3::zeros(); x.len()];
            multiply(model, &self.tangent, &next, &mut product);
            diagonal.push(dot(&product, &next));
            basis.push(next);
            images.push(load);
            for (b, image) in basis.iter().zip(&images) {
                let part = dot(&product, b);
                product.iter_mut().zip(image).for_each(|(p, i)| *p -= i * part);
            }
            load = product;
        }
        let n = diagonal.len();
        let ritz = nalgebra::DMatrix::from_fn(n, n, |r, c| match r.abs_diff(c) {
            0 => diagonal[r],
            1 => beside[r.min(c)],
            _ => 0.0,
        })
        .symmetric_eigen();
        let lowest = ritz.eigenvalues.imin();
        self.direction.fill(Vector3::zeros());
        for (b, weight) in basis.iter().zip(&ritz.eigenvectors.column(lowest)) {
            self.direction.iter_mut().zip(b).for_each(|(d, p)| *d += p * *weight);
        }
        // downhill, if there is a slope
        let sign = if dot(&self.direction, &self.gradient) > 0.0 { -1.0 } else { 1.0 };
        let longest = largest(&self.direction);
        self.direction.iter_mut().for_each(|d| *d *= sign / longest);
        Some(ritz.eigenvalues[lowest])
    }

    /// Moves `x` along `direction`, the largest move `length_m` or as far as the sheet
    /// does not touch itself.
    pub fn nudge(&mut self, model: &mut Model, x: &mut [Vector3], length_m: f64) {
        self.direction.iter_mut().for_each(|d| *d *= length_m);
        model.self_contact.update_along(x, &self.direction);
        let fraction = model.self_contact.max_step(x, &self.direction);
        self.try_fraction(x, fraction);
        x.copy_from_slice(&self.trial);
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

    /// Whether the exact Hessian at `x` is positive definite, on the pattern and,
    /// with contact blocks outside it, by the sign of every conjugate-gradient
    /// curvature met while solving for the residual. Leaves the factor in place.
    pub fn is_stable(&mut self, model: &mut Model, x: &[Vector3]) -> bool {
        model.forget_foreseen();
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        self.assemble(model, x, still, false);
        self.factorisations += 1;
        self.factorize(false) && self.solve(model)
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

/// The same where the rise is that of the strain of second order: a quartic.
fn shortened_by_strain(fraction: f64, rise: f64, slope: f64) -> f64 {
    let quartic = (rise - slope * fraction) / fraction.powi(4);
    let minimum = (-slope / (4.0 * quartic)).cbrt();
    if minimum.is_finite() { minimum.clamp(0.1 * fraction, 0.5 * fraction) } else { 0.3 * fraction }
}

/// What a quasi-Newton descent remembers: the last steps and gradient changes, the
/// last direction and how much of it could be taken.
#[derive(Clone, Debug)]
pub struct Memory {
    pairs: std::collections::VecDeque<(Vec<Vector3>, Vec<Vector3>, f64)>,
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
/// Inertia that keeps the projected Hessian positive definite in single precision
/// \[s\]; from 0.03 to 2 s the descent is as fast.
const SHIFT: Inertia<'static> = Inertia { dt_s: 0.1, free_flight: None };
/// Weight, in the descent's matrix, of the tension that the last direction would
/// have caused by its strain of second order: it stiffens the matrix where the
/// sheet turns most and would otherwise cut the whole step short. Of 0, 0.3 and 3
/// on two fabrics the best.
const FOREBODING: f64 = 3.0;
/// Products in the search for the lowest curvature.
const LANCZOS: usize = 40;

impl Memory {
    /// Forgets everything: the energy has changed.
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
            self.pairs.push_back((s, y, 1.0 / sy));
        }
    }

    /// The two-loop recursion (Nocedal 1980) around `solve`.
    fn apply(&self, q: &mut [Vector3], solve: impl FnOnce(&mut [Vector3])) {
        let mut alphas = Vec::with_capacity(self.pairs.len());
        for (s, y, rho) in self.pairs.iter().rev() {
            let alpha = rho * dot(s, q);
            q.iter_mut().zip(y).for_each(|(a, b)| *a -= b * alpha);
            alphas.push(alpha);
        }
        solve(q);
        for ((s, y, rho), alpha) in self.pairs.iter().zip(alphas.iter().rev()) {
            let beta = rho * dot(y, q);
            q.iter_mut().zip(s).for_each(|(a, b)| *a += b * (alpha - beta));
        }
    }
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

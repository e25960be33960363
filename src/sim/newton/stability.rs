//! Whether an equilibrium is stable, and if not, along which mode the energy falls.

use nalgebra::DMatrix;

use rand::RngExt as _;

use super::krylov::multiply;
use super::linear::SHIFT;
use super::workspace::{Inertia, Newton, dot, largest};
use crate::base::{Vector3, seed};
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;

/// Products in the search for the lowest curvature.
const LANCZOS: usize = 40;

impl Newton {
    /// Whether the exact Hessian at `x` is positive definite: on the pattern by its factor,
    /// and where contact has blocks outside it by the sign of every curvature met while
    /// solving for the residual by conjugate gradients.
    pub fn is_stable(&mut self, model: &mut Model, x: &[Vector3]) -> bool {
        model.membrane.forget_lagged_stress();
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        self.assemble(model, x, still, HessianForm::Exact);
        let stable = self.solve(model, x, HessianForm::Exact);
        if self.exact {
            self.factored_at.extend_from_slice(x);
        }
        stable
    }

    /// The model has changed under the sheet: the factor is no longer that of its Hessian.
    pub fn forget_place(&mut self) {
        self.factored_at.clear();
    }

    /// The lowest curvature of the exact Hessian relative to the projected one, in
    /// the Krylov space of the gradient and `LANCZOS` products (Lanczos, made
    /// orthogonal throughout); its direction is left in `direction`, the largest
    /// move scaled to 1 m. Sees self-contact's blocks wherever they fall. A value
    /// above zero speaks for stability but does not prove it.
    pub fn lowest_curvature(&mut self, model: &mut Model, x: &[Vector3]) -> Option<f64> {
        self.assemble(model, x, SHIFT, HessianForm::Projected);
        if !self.factorize_roughly() {
            return None;
        }
        model.membrane.forget_lagged_stress();
        model.hessian(x, HessianForm::Exact, &mut self.tangent);
        // basis, orthonormal in the projected Hessian, and the Hessian's images of it
        let (mut basis, mut images): (Vec<Vec<Vector3>>, Vec<Vec<Vector3>>) = (vec![], vec![]);
        let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
        // the gradient may be nil, and blind to a mode: add a rough load
        let mut load = self.gradient.clone();
        let scale = (largest(&load) + 1e-12) * 1e-2;
        let mut rng = seed::rng(0, "rough load", 0);
        for g in &mut load {
            *g += Vector3::from_fn(|_, _| rng.random_range(-scale..scale));
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
            multiply(model.grid.analysis.pattern(), &self.tangent, &next, &mut product);
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
        let ritz = DMatrix::from_fn(n, n, |r, c| match r.abs_diff(c) {
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

    /// Moves `x` along the mode that [`Self::lowest_curvature`] left, so that the vertex that moves
    /// farthest moves by `length_m`, or as far as contacts allow.
    pub fn nudge(&mut self, model: &mut Model, x: &mut [Vector3], length_m: f64) {
        self.direction.iter_mut().for_each(|d| *d *= length_m);
        model.self_contact.update_along(x, &self.direction);
        let fraction = model.max_step(x, &self.direction);
        self.try_fraction(x, fraction);
        x.copy_from_slice(&self.trial);
    }
}

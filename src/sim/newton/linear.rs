//! The direction of a step: assembly, factor, solve.
//!
//! The projected Hessian is factorised on the grid's fixed pattern, in single precision. The
//! exact one is factorised in double; where self-contact has blocks outside the pattern, or
//! where the part on the pattern is not positive definite by itself (layers that touch hold
//! each other up through those blocks), conjugate gradients on the whole of it, preconditioned
//! with whichever factor there is, give the direction.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::krylov::conjugate_gradients;
use super::workspace::{Inertia, Newton, largest};
use crate::base::Vector3;
use crate::numeric::sparse::{BlockPattern, Factor, Real, TOGETHER, Work};
use crate::sim::effort::charge;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::{Model, Tangent};

/// Inertia that keeps the projected Hessian positive definite in single precision
/// \[s\]; from 0.03 to 2 s the descent is as fast.
pub(super) const SHIFT: Inertia<'static> = Inertia { dt_s: 0.1, free_flight: None };
/// Conjugate gradients end when the residual has fallen to this, in the preconditioner's norm.
pub(super) const CG_TOLERANCE: f64 = 1e-2;
/// The residual at which conjugate gradients end where the solution itself is the result.
const LOAD_TOLERANCE: f64 = 1e-6;

impl Newton {
    /// Gradient and matrix of the step's objective; returns the largest force on
    /// a vertex without inertia \[N\].
    pub(super) fn assemble(
        &mut self,
        model: &mut Model,
        x: &[Vector3],
        inertia: Inertia,
        form: HessianForm,
    ) -> f64 {
        self.exact = false;
        self.factored_at.clear();
        charge(&mut self.effort.assembly_s, || {
            model.gradient(x, &mut self.gradient);
            let residual_n = largest(&self.gradient);
            model.hessian(x, form, &mut self.tangent);
            if inertia.dt_s.is_finite() {
                add_inertia(model, &mut self.tangent, inertia.dt_s);
                if let Some(y) = inertia.free_flight {
                    let per_mass = inertia.dt_s.powi(-2);
                    for v in 0..y.len() {
                        self.gradient[v] += (x[v] - y[v]) * (model.weight.mass_kg[v] * per_mass);
                    }
                }
            }
            residual_n
        })
    }

    /// direction = -A^-1 gradient, or as far as conjugate gradients get without meeting
    /// negative curvature; false if they meet it, or if there is no factor (the direction is
    /// then zero).
    pub(super) fn solve(&mut self, model: &mut Model, x: &[Vector3], form: HessianForm) -> bool {
        for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
            *d = -g;
        }
        let factorised = match form {
            HessianForm::Projected => self.factorize_roughly(),
            HessianForm::Exact => self.factorize(),
        };
        self.exact = factorised && form == HessianForm::Exact;
        match form {
            HessianForm::Projected if factorised => {
                charge(&mut self.effort.solve_s, || self.rough.solve(&mut self.direction));
                true
            }
            HessianForm::Exact if factorised && self.tangent.outside.is_empty() => {
                charge(&mut self.effort.solve_s, || self.factor.solve(&mut self.direction));
                true
            }
            HessianForm::Exact if factorised || self.substitute(model, x) => {
                self.solve_whole(model, factorised, CG_TOLERANCE)
            }
            _ => {
                self.direction.fill(Vector3::zeros());
                false
            }
        }
    }

    /// Solves H dx = load for each of these right-hand sides, with the exact Hessian H at `x`: the
    /// moves \[m\] of a sheet at rest under small loads on its vertices \[N\]. `None` where H is
    /// not positive definite.
    pub fn solve_loads(
        &mut self,
        model: &mut Model,
        x: &[Vector3],
        loads: &[Vec<Vector3>],
    ) -> Option<Vec<Vec<Vector3>>> {
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        let exact = if self.factored_at == x && !model.remembers() {
            true
        } else {
            model.membrane.forget_lagged_stress();
            self.assemble(model, x, still, HessianForm::Exact);
            self.factorize()
        };
        self.exact = exact;
        if !exact && !self.substitute(model, x) {
            return None;
        }
        if exact && self.tangent.outside.is_empty() {
            return charge(&mut self.effort.solve_s, || Some(moves_under(&self.factor, loads)));
        }
        let (pattern, tangent) = (model.grid.analysis.pattern(), &self.tangent);
        let mut moves = loads.to_vec();
        let solve = |some: &mut [Vec<Vector3>]| match exact {
            true => solve_whole_with(&self.factor, pattern, tangent, some),
            false => solve_whole_with(&self.rough, pattern, tangent, some),
        };
        let solved = charge(&mut self.effort.solve_s, || {
            moves.par_chunks_mut(TOGETHER).try_for_each(|some| solve(some).then_some(()))
        });
        solved.map(|()| moves)
    }

    /// The same with the projected Hessian and a little inertia, in single precision, for any exact
    /// one: for a rest that is not stable. Soft moves come out too small.
    pub fn solve_loads_steadied(
        &mut self,
        model: &mut Model,
        x: &[Vector3],
        loads: &[Vec<Vector3>],
    ) -> Option<Vec<Vec<Vector3>>> {
        model.membrane.forget_lagged_stress();
        self.assemble(model, x, SHIFT, HessianForm::Projected);
        if !self.factorize_roughly() {
            return None;
        }
        charge(&mut self.effort.solve_s, || Some(moves_under(&self.rough, loads)))
    }

    /// Factorises the tangent on the pattern; false if it is not positive definite.
    pub(super) fn factorize(&mut self) -> bool {
        self.effort.factorisations += 1;
        charge(&mut self.effort.factorisation_s, || self.factor.factorize(&self.tangent.values))
    }

    /// The same in single precision.
    pub(super) fn factorize_roughly(&mut self) -> bool {
        self.effort.factorisations += 1;
        charge(&mut self.effort.factorisation_s, || self.rough.factorize(&self.tangent.values))
    }

    /// Puts a factor of the projected Hessian where the exact one has none; the tangent
    /// stays the exact one.
    fn substitute(&mut self, model: &mut Model, x: &[Vector3]) -> bool {
        let exact = std::mem::take(&mut self.tangent);
        charge(&mut self.effort.assembly_s, || {
            model.hessian(x, HessianForm::Projected, &mut self.tangent);
            add_inertia(model, &mut self.tangent, SHIFT.dt_s);
        });
        let definite = self.factorize_roughly();
        self.tangent = exact;
        definite
    }

    /// Solves with the whole tangent, preconditioned by the exact factor or the rough
    /// one; the right-hand side is in `direction`. Stops short of negative curvature.
    pub(super) fn solve_whole(&mut self, model: &Model, exact: bool, tolerance: f64) -> bool {
        let Self { factor, rough, direction, tangent, effort, .. } = self;
        let precondition = |all: &mut [&mut [Vector3]]| {
            for x in all {
                if exact { factor.solve(x) } else { rough.solve(x) }
            }
        };
        let pattern = model.grid.analysis.pattern();
        charge(&mut effort.solve_s, || {
            conjugate_gradients(pattern, tangent, &mut [direction], tolerance, precondition)
        })
    }
}

/// Loads to the moves under them, several side by side, with the whole tangent, preconditioned by a
/// factor. False at negative curvature.
fn solve_whole_with<T: Real + Send + Sync>(
    factor: &Factor<T>,
    pattern: &BlockPattern,
    tangent: &Tangent,
    loads: &mut [Vec<Vector3>],
) -> bool {
    let mut loads: Vec<&mut [Vector3]> = loads.iter_mut().map(Vec::as_mut_slice).collect();
    let mut work = Work::default();
    let precondition = |x: &mut [&mut [Vector3]]| factor.solve_with(&mut work, x);
    conjugate_gradients(pattern, tangent, &mut loads, LOAD_TOLERANCE, precondition)
}

/// The moves under loads by a factor.
fn moves_under<T: Real + Send + Sync>(
    factor: &Factor<T>,
    loads: &[Vec<Vector3>],
) -> Vec<Vec<Vector3>> {
    let mut moves = loads.to_vec();
    moves.par_chunks_mut(TOGETHER).for_each(|some| {
        let mut some: Vec<&mut [Vector3]> = some.iter_mut().map(Vec::as_mut_slice).collect();
        factor.solve_with(&mut Work::default(), &mut some);
    });
    moves
}

/// Adds the inertia of a time step to the diagonal.
fn add_inertia(model: &Model, tangent: &mut Tangent, dt_s: f64) {
    let pattern = model.grid.analysis.pattern();
    for (v, m) in model.weight.mass_kg.iter().enumerate() {
        let block = Matrix3::identity() * (m * dt_s.powi(-2));
        pattern.add_diagonal(&mut tangent.values, v, &block);
    }
}

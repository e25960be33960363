//! One energy, one file: formula, source, unit; value, gradient, Hessian.

pub mod asymmetry;
pub mod bending;
pub mod cells;
pub mod curl;
#[cfg(test)]
mod difference;
pub mod hysteresis;
pub mod loads;
pub mod membrane;
pub mod plate;
mod signed;
mod softened;
pub mod softening;
mod stencil;

use crate::base::Vector3;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// An energy of a sheet on a grid, at the positions `x` of its vertices \[m\].
pub trait Energy {
    /// The energy \[J\].
    fn energy_j(&self, grid: &Grid, x: &[Vector3]) -> f64;

    /// Adds the gradient \[N\].
    fn add_gradient(&self, grid: &Grid, x: &[Vector3], gradient: &mut [Vector3]);

    /// Adds the part of the Hessian that is the same at all positions \[N/m\] to the values of the
    /// grid's pattern.
    fn add_constant_hessian(&self, _grid: &Grid, _values: &mut [f64]) {}

    /// Adds the rest of the Hessian \[N/m\] to the values of the grid's pattern, exact or with a
    /// positive semidefinite substitute.
    fn add_hessian(&self, _grid: &Grid, _x: &[Vector3], _form: HessianForm, _values: &mut [f64]) {}

    /// Largest fraction, up to `limit`, of the step `dx` from `x` on which the energy stays finite.
    fn max_step(&self, _grid: &Grid, _x: &[Vector3], _dx: &[Vector3], limit: f64) -> f64 {
        limit
    }
}

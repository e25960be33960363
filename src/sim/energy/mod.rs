//! One energy, one file: formula, source, unit; value, gradient, Hessian.

pub mod bending;
pub mod curl;
pub mod membrane;
pub mod plate;
pub mod softening;
mod stencil;

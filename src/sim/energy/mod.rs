//! One energy, one file: formula, source, unit; value, gradient, Hessian.

pub mod bending;
pub mod membrane;
pub mod plate;

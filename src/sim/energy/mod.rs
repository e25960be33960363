//! One energy, one file: formula, source, unit; value, gradient, Hessian.

pub mod asymmetry;
pub mod bending;
pub mod curl;
#[cfg(test)]
mod difference;
pub mod hysteresis;
pub mod membrane;
pub mod plate;
mod signed;
mod softened;
pub mod softening;
mod stencil;

//! Numerical tools: sparse factorisation on a fixed pattern, robust statistics.

pub mod banded;
pub mod bspline;
pub mod min_cut;
pub mod robust;
pub mod sparse;
pub mod spline_system;
mod triangular;

//! Numerical tools: sparse factorisation on a fixed pattern, robust statistics.

pub mod banded;
pub mod bspline;
pub mod robust;
pub mod sparse;
pub mod spline_system;

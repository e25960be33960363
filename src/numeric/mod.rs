//! Numerical tools: sparse and banded Cholesky factorisations, splines and least squares over
//! them, minimum cuts, robust statistics, acceleration of fixed-point iterations.

pub mod anderson;
pub mod banded;
pub mod bspline;
pub mod min_cut;
pub mod moments;
pub mod robust;
pub mod sparse;
pub mod spline_system;
mod triangular;

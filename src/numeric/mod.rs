//! Numbers without geometry: robust statistics, banded systems, splines.

pub mod banded;
pub mod bspline;
pub mod robust;

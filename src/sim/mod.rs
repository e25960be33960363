//! The drape simulator.

pub mod energy;
pub mod grid;

/// Version of the numbers that this simulator gives: raised whenever a change
/// moves the rim of a drape by more than the solver's tolerance. The shipped
/// model's metadata carries the version it was trained on.
pub const NUMERICS_VERSION: u32 = 1;

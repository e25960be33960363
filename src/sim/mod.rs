//! The drape simulator: from a fabric to its sheet at rest.

pub mod drape;
pub mod drop;
pub mod energy;
pub mod grid;
pub mod model;
pub mod newton;
pub mod self_contact;

pub use drape::{Drape, SimOptions, Stop, drape};
pub use drop::{Drop, DropStart};

/// Version of the numbers that this simulator gives: raised whenever a change
/// moves the rim of a drape by more than the solver's tolerance. The shipped
/// model's metadata carries the version it was trained on.
pub const NUMERICS_VERSION: u32 = 2;

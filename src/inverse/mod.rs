//! The least squares that the fits of drapes stand on.
//!
//! Unknown are numbers that all drapes share (logarithms of stiffnesses, sizes of effects) and
//! numbers of each drape's own (how it lies on its bench). A fit gives the sums over each drape's
//! data and the priors at some sheets, and brings its sheets from cloth to cloth. What a datum is
//! and what holds a sheet is the fit's.
//!
//! Flow: `sums` (one drape's data and priors, its own numbers at their best) -> `state` (the normal
//! equations of all drapes, the covariance) -> `step` (a step from there) -> `descent` (steps as
//! long as they lower the cost) -> `stiffness` (values and intervals). `scanned` has what both fits
//! take drapes of scans for.

mod descent;
pub(crate) mod scanned;
mod state;
mod step;
mod stiffness;
mod sums;

pub use descent::Ended;
pub(crate) use descent::{Descent, LEAST_GAIN, Moved, descend, keep, return_to};
pub(crate) use state::{SharedPrior, State, Step};
pub use stiffness::RefinedStiffness;
pub(crate) use stiffness::{STIFFER, STRETCH_AND_SHEAR, with_stretch};
pub(crate) use sums::{Part, Pull, Sums, at_best, huber_cost, huber_weight};

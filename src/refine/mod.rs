//! From an estimate back to the drape: does the simulator reproduce the scan, and which fabric does
//! it reproduce it with best?
//!
//! [`released_drape()`] drapes one fabric on the branch of a scan. [`fit()`] looks for the fabric
//! whose drape on that branch lies closest to the scan: every fabric that it tries starts from the
//! scanned sheet, so that the branch is the scan's and no fall decides on it.
//!
//! Flow: `data` (what a scan says of the sheet, and how surely) -> `prediction` (one fabric's drape
//! from the sheet, with its sensitivities) -> `equations` (the least squares around them, and the
//! prior: `prior`) -> `fit` (steps of these, continued from fabric to fabric) -> `refined` (values,
//! intervals, what the drape shows and what the model leaves).

mod data;
mod equations;
mod fit;
mod prediction;
mod prior;
mod refined;
mod released;

pub use crate::inverse::{Ended, RefinedStiffness};
pub use data::{DataOptions, Scan};
pub use equations::FitOptions;
pub use fit::{FitError, Progress, fit};
pub use prior::Prior;
pub use refined::{ArcResidual, Nuisance, Refined, ScanFit};
pub use released::{ReleasedDrape, StartedFrom, released_drape};

//! An input taken in: the rim, and where there is a scan the sheet, that an estimate or a
//! calibration is made from.
//!
//! In: a path and what the user knows. Out: a [`Rim`] in the simulation frame, or an
//! [`IntakeError`] that names the place and the remedy.

mod error;
mod frames;
pub mod hints;
pub mod joined;
pub mod register;
pub mod rim;
pub mod turntable;

pub use error::{IntakeError, RimError};
pub use rim::Rim;

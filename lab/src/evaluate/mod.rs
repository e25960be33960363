//! The laboratory: what the program promises, measured, for `scan2params-lab` and docs/validation.
//!
//! In: drapes with known truth, a prior, measured data. Out: rows, tables and pictures.

pub mod altered;
pub mod calibrate;
pub mod case_error;
pub mod estimate;
pub mod follow;
pub mod linear;
pub mod physics;
pub mod redrape;
pub mod refine;
pub mod rim_noise;
pub mod scan;
pub mod scenes;
pub mod sensors;
mod setup;
pub mod soak;
pub mod speed;
pub mod stages;
pub mod start;
pub mod table3;
pub mod timed;
pub mod transfer;
pub mod verdict;
pub mod views;

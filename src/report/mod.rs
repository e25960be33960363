//! Results for people and programs: the table, params.json, the overlay.

pub mod evaluate;
pub mod job;
pub mod json;
pub mod overlay;
pub mod rims;
pub mod table;

pub use job::{Job, JobError, Outcome};

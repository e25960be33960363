//! Results for people and programs: the table, params.json, the overlay.

pub mod augment;
pub mod batch;
pub mod chart;
pub mod evaluate;
pub mod job;
pub mod json;
pub mod overlay;
pub mod params;
pub mod physics;
pub mod physics_branches;
pub mod physics_drapes;
pub mod rim;
pub mod rims;
pub mod soak;
pub mod speed;
pub mod stages;
pub mod table;

pub use job::{FailureKind, Job, JobError, Outcome};
pub use rim::Rim;

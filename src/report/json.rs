//! The JSON that is written, a type for each file: values in the paper's units, lengths in mm, each
//! with its unit in its name or next to it. docs/schemas is made from these types.

mod params;
mod refinement;
mod scan;
mod simulated;

use serde_json::{Value, json};

use crate::job::Outcome;

pub use params::SCHEMA_VERSION;
pub use params::{Density, Model, Novelty, Parameter, Params, Prior, PriorPart, Rim, Simulator};
pub use refinement::{Arc, Before, Bench, BenchNumber, Companion, Fit, Refinement};
pub use refinement::{ReleasedDrape, ScanFit, Shown, TiedDrape};
pub use scan::{Inspected, Mesh, Quality, Read, View};
pub use simulated::Simulated;

/// The result as JSON.
#[must_use]
pub fn params(outcome: &Outcome) -> Value {
    json!(Params::of(outcome))
}

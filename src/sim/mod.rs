//! The drape simulator: from a fabric to its sheet at rest.
//!
//! In: a fabric, how it is released, options with the experiment. Out: the sheet with its rim and a
//! report. [`fn@drape`] is the way in; the method is in `docs/design/simulator.md`.

pub mod drape;
pub mod drop;
pub mod effort;
pub mod elastica;
pub mod energy;
pub mod experiment;
pub mod follow;
pub mod grid;
pub mod guide;
pub mod hessian_form;
pub mod hung;
mod initialise;
pub mod model;
mod motion;
pub mod newton;
pub mod numerics;
pub mod options;
pub mod parameters;
pub mod plate;
mod rest;
pub mod self_contact;
pub mod sensitivity;
pub mod setup;
pub mod strip;
mod uneven;

pub use drape::{
    Drape, count_nodes as rim_nodes, drape, drape_from, drape_on_finer, drape_with_sensitivities,
    nodes_at as rim_nodes_at, rim_harmonics_m,
};
pub use drop::{Drop, DropStart, Fall, HeldRim, HeldSurface, Hold};
pub use experiment::{Experiment, MeshWarning};
pub use follow::{Event, FollowError, FollowOptions, Followed, Follower, Held, Kept, OnEvent};
pub use hessian_form::HessianForm;
pub use numerics::{Grading, Numerics};
pub use options::{OptionsError, OptionsFault, SimOptions, Stop};
pub use plate::Plate;
pub use setup::Setup;

/// Version of the numbers that this simulator gives. It is raised whenever a change moves the rim
/// of a drape, which `tests/physics/pinned.rs` holds; the shipped model's metadata carries the
/// version that the model was trained on.
pub const NUMERICS_VERSION: u32 = 4;

//! The drape simulator: bits of its energies, pinned rims, known answers, effects, starts.

#[path = "../program/mod.rs"]
mod program;
#[path = "../promises/mod.rs"]
mod promises;

mod bits;
mod experiment;
mod pinned;
mod sim_start;

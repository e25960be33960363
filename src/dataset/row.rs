//! One row of a dataset: a fabric and what the simulator says of its drape.

use crate::base::Boundary;
use crate::fabric::Fabric;
use crate::sim::Fall;

/// What a simulator gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Its number in the run.
    pub index: u64,
    /// Which fabric of the prior it is of.
    pub fabric_index: u64,
    /// The fabric.
    pub fabric: Fabric,
    /// The run's seed.
    pub run_seed: u64,
    /// How it falls.
    pub fall: Fall,
}

/// What a simulator says of one drape.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedRow {
    /// The rim.
    pub boundary: Boundary,
    /// Whether the drape is at rest: rows that are not are kept but not trained on.
    pub at_rest: bool,
    /// Why the simulation ended, in the simulator's words.
    pub stop: String,
    /// Whether the rest is a stable equilibrium.
    pub stable: bool,
    /// Folds of the drape.
    pub node_count: u32,
    /// Potential energy \[J\].
    pub energy_j: f64,
    /// Largest force that is not in balance \[N\].
    pub residual_n: f64,
    /// Whether the sheet was led here from the sample before; else it fell.
    pub walked: bool,
}

/// One row of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Sample.
    pub index: u64,
    /// Which fabric of the prior: several drops of one fabric share it.
    pub fabric_index: u64,
    /// The fabric.
    pub fabric: Fabric,
    /// Its drape.
    pub drape: SimulatedRow,
}

//! One row of a dataset: a fabric and what the simulator says of its drape.

use crate::base::Boundary;
use crate::fabric::Fabric;
use crate::geom::Mesh;
use crate::sim::{Drape, Fall, Stop};

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

/// How a drape ended: the column `stop`, of which `converged`, `at_rest` and `stable` follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The search for rest ended so, and the sheet does not pass through itself.
    Stopped(Stop),
    /// The sheet passes through itself, however the search ended.
    Intersects,
}

impl Ending {
    /// All endings, with what the word of each means.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Stopped(Stop::AtRest), "forces balance, and every small move raises the energy"),
        (Self::Stopped(Stop::Slow), "a cycle lowered the energy by less than `energy_drop`"),
        (Self::Stopped(Stop::Unstable), "forces balance, but some small move lowers the energy"),
        (Self::Stopped(Stop::Iterations), "the iterations ran out"),
        (Self::Intersects, "the sheet passes through itself"),
    ];

    /// How a simulated drape ended.
    #[must_use]
    pub fn of(drape: &Drape) -> Self {
        if drape.intersections > 0 { Self::Intersects } else { Self::Stopped(drape.stop) }
    }

    /// The ending of this name; `None` where there is no such.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(ending, _)| ending).find(|ending| ending.name() == name)
    }

    /// The word that stands for it in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stopped(stop) => stop.name(),
            Self::Intersects => "intersects",
        }
    }

    /// Whether the search ended where its options wanted, in a sheet that cloth can have: at rest,
    /// or as near to it as `energy_drop` asks. Other rows are kept but not trained on.
    #[must_use]
    pub fn is_converged(self) -> bool {
        matches!(self, Self::Stopped(stop) if stop.is_as_asked())
    }

    /// Whether the forces balance in a stable equilibrium. A drape that ended as `slow` is near to
    /// rest, not at rest.
    #[must_use]
    pub fn is_at_rest(self) -> bool {
        self == Self::Stopped(Stop::AtRest)
    }

    /// Whether the equilibrium is stable; `None` where the forces do not balance, so that there is
    /// none, or where the sheet passes through itself.
    #[must_use]
    pub fn is_stable(self) -> Option<bool> {
        match self {
            Self::Stopped(Stop::AtRest) => Some(true),
            Self::Stopped(Stop::Unstable) => Some(false),
            Self::Stopped(Stop::Slow | Stop::Iterations) | Self::Intersects => None,
        }
    }
}

/// What a simulator says of one drape.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedRow {
    /// The rim.
    pub boundary: Boundary,
    /// How the simulation ended.
    pub ending: Ending,
    /// Folds of the drape.
    pub node_count: u32,
    /// Potential energy \[J\].
    pub energy_j: f64,
    /// Largest force that is not in balance \[N\].
    pub residual_n: f64,
    /// Whether the sheet was continued from the sample before; else it fell.
    pub walked: bool,
}

/// What a simulator gives for one sample.
#[derive(Clone, Debug)]
pub struct Simulated<S> {
    /// The row.
    pub row: SimulatedRow,
    /// The sheet in the simulation frame \[m\].
    pub sheet: Mesh,
    /// What the next sample of a walk continues from; `None` where that one falls.
    pub next: Option<S>,
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

//! How a drape is searched for, and why the search ended.

use crate::sim::experiment::Experiment;

/// How the specimen is simulated. Lengths in metres, times in seconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SimOptions {
    /// Specimen, plate and effects.
    pub experiment: Experiment,
    /// Vertices on a side of the grid that rests (61: 5 mm).
    pub vertices: usize,
    /// Vertices on a side of the grid that falls.
    pub fall_vertices: usize,
    /// Time step of the fall.
    pub fall_step_s: f64,
    /// Longest fall, in steps.
    pub fall_steps: usize,
    /// Longest motion on the fine grid before Newton steps are tried, in steps.
    pub settle_steps: usize,
    /// At rest when no vertex feels more than this fraction of its cell's weight ...
    pub residual: f64,
    /// ... and the last Newton step moved no vertex more than this.
    pub step_m: f64,
    /// Ends as [`Stop::Slow`] when a cycle of the descent lowers the energy by less
    /// than this fraction; 0 goes on to the residual's limit.
    pub energy_drop: f64,
    /// Factorisations on the fine grid before it is given up.
    pub iterations: usize,
}

impl Default for SimOptions {
    fn default() -> Self {
        Self {
            experiment: Experiment::default(),
            vertices: 61,
            fall_vertices: 31,
            fall_step_s: 1.0 / 50.0,
            fall_steps: 70,
            settle_steps: 30,
            residual: 1e-3,
            step_m: 1e-5,
            energy_drop: 0.0,
            iterations: 200,
        }
    }
}

/// Why the search for rest ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Residual and step are below their limits and the equilibrium is stable.
    AtRest,
    /// Residual and step are below their limits, but the tangent is not positive
    /// definite.
    Unstable,
    /// The energy hardly falls any more, but a residual is left.
    Slow,
    /// The iterations ran out.
    Iterations,
}

impl Stop {
    /// The word used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AtRest => "at_rest",
            Self::Unstable => "unstable",
            Self::Slow => "slow",
            Self::Iterations => "iterations",
        }
    }
}

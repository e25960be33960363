//! How a drape is searched for, and why the search ended.

use crate::sim::experiment::Experiment;

/// The experiment that is simulated, the grids it is simulated on, and when the search for rest
/// ends. Lengths are in metres, times in seconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SimOptions {
    /// The experiment: specimen, plate and effects beyond the seven parameters.
    pub experiment: Experiment,
    /// Vertices on a side of the fine grid, on which the sheet comes to rest; 61 of them lie 5 mm
    /// apart on a specimen of 300 mm.
    pub vertices: usize,
    /// Vertices on a side of the coarse grid, on which the sheet falls.
    pub fall_vertices: usize,
    /// Time step of the fall \[s\].
    pub fall_step_s: f64,
    /// Most time steps that the fall may take.
    pub fall_steps: usize,
    /// Most time steps of motion on the fine grid before the search for equilibrium begins.
    pub settle_steps: usize,
    /// The sheet is at rest when the net force on every vertex is below this fraction of a cell's
    /// weight, and when the last Newton step was shorter than [`Self::step_m`].
    pub residual: f64,
    /// The sheet is at rest when the last Newton step moved no vertex farther than this \[m\], and
    /// when the forces balance as [`Self::residual`] asks.
    pub step_m: f64,
    /// The search ends as [`Stop::Slow`] when a cycle of the descent lowers the energy by less than
    /// this fraction of itself; with 0 it goes on until the sheet is at rest.
    pub energy_drop: f64,
    /// Most Cholesky factorisations on the fine grid; then the search ends as
    /// [`Stop::Iterations`].
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
    /// Residual and step are below their limits, and the equilibrium is stable.
    AtRest,
    /// Residual and step are below their limits, but the Hessian is not positive definite: some
    /// small move lowers the energy.
    Unstable,
    /// The energy hardly falls any more, but the forces do not balance yet.
    Slow,
    /// The factorisations ran out.
    Iterations,
}

impl Stop {
    /// The word that stands for the reason in files.
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

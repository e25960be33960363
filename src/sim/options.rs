//! How a drape is searched for, and why the search ended.

use crate::sim::experiment::{Experiment, ExperimentFault};
use crate::sim::grid::LEAST_VERTICES;
use crate::sim::numerics::Numerics;

/// The experiment that is simulated, the grids it is simulated on, and when the search for rest
/// ends. Lengths are in metres, times in seconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SimOptions {
    /// The experiment: specimen, plate and effects beyond the seven parameters.
    pub experiment: Experiment,
    /// Discretisation: numerics 4, or the earlier ones. Files name what is not the default.
    #[serde(skip_serializing_if = "Numerics::is_default")]
    pub numerics: Numerics,
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
    /// this fraction of itself; with 0 it continues until the sheet is at rest.
    pub energy_drop: f64,
    /// Most Cholesky factorisations on the fine grid; then the search ends as
    /// [`Stop::Iterations`]. Fabrics of the priors need 40 to 250. Cloth that can hardly be
    /// stretched one way and easily the other, which the limits of the seven parameters allow,
    /// needs up to 800.
    pub iterations: usize,
}

impl Default for SimOptions {
    fn default() -> Self {
        Self {
            experiment: Experiment::default(),
            numerics: Numerics::default(),
            vertices: 61,
            fall_vertices: 31,
            fall_step_s: 1.0 / 50.0,
            fall_steps: 70,
            settle_steps: 30,
            residual: 1e-3,
            step_m: 1e-5,
            energy_drop: 0.0,
            iterations: 600,
        }
    }
}

/// A number of the options with which nothing can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OptionsFault {
    /// The experiment has this fault.
    #[error(transparent)]
    Experiment(#[from] ExperimentFault),
    /// A number is NaN, infinite, or outside its limits.
    #[error("{key} = {value} is outside {least} to {most}: give a value inside")]
    Outside {
        /// Name of the number.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Least value that can be simulated.
        least: f64,
        /// Largest value that can be simulated.
        most: f64,
    },
}

/// Why nothing can be simulated with some options: all of their faults.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionsError {
    /// The faults, at least one; those of the experiment come first.
    pub faults: Vec<OptionsFault>,
}

impl std::fmt::Display for OptionsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lines: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        f.write_str(&lines.join("; "))
    }
}

impl std::error::Error for OptionsError {}

/// Most vertices on a side: beyond it the factor of the Hessian takes more than 10 GB.
const MOST_VERTICES: f64 = 1000.0;

impl SimOptions {
    /// Checks that a specimen can be simulated with these options.
    ///
    /// # Errors
    /// All faults at once: those of [`Experiment::check`], and grids, time steps and tolerances
    /// outside their limits.
    pub fn check(&self) -> Result<(), OptionsError> {
        let experiment = self.experiment.check().map_or_else(|error| error.faults, |()| Vec::new());
        let mut faults: Vec<_> = experiment.into_iter().map(OptionsFault::Experiment).collect();
        let (least, grading) = (LEAST_VERTICES as f64, &self.numerics.grading);
        for (key, value, least, most) in [
            ("vertices", self.vertices as f64, least, MOST_VERTICES),
            ("fall_vertices", self.fall_vertices as f64, least, MOST_VERTICES),
            ("fall_step_s", self.fall_step_s, 1e-6, 1.0),
            ("residual", self.residual, 1e-9, 1.0),
            ("step_m", self.step_m, 1e-12, 1.0),
            ("energy_drop", self.energy_drop, 0.0, 1.0),
            ("numerics.grading.density", grading.density, 1.0, 3.0),
            ("numerics.grading.inwards_m", grading.inwards_m, 0.0, 0.1),
            ("numerics.grading.outwards_m", grading.outwards_m, 0.0, 0.1),
            ("numerics.grading.flank_m", grading.flank_m, 1e-3, 0.1),
            ("numerics.twist_hold", self.numerics.twist_hold, 0.0, 1.0),
        ] {
            if !(least..=most).contains(&value) {
                faults.push(OptionsFault::Outside { key, value, least, most });
            }
        }
        if faults.is_empty() { Ok(()) } else { Err(OptionsError { faults }) }
    }
}

/// Why the search for rest ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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

    /// Whether the search ended where its options wanted: at rest, or as near to it as
    /// [`SimOptions::energy_drop`] asks.
    #[must_use]
    pub fn is_as_asked(self) -> bool {
        matches!(self, Self::AtRest | Self::Slow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_name_no_numerics_but_those_beside_the_default() {
        let named = |options: SimOptions| serde_json::to_string(&options).unwrap();
        assert!(!named(SimOptions::default()).contains("numerics"));
        let three = SimOptions { numerics: Numerics::THREE, ..SimOptions::default() };
        assert!(named(three).contains("\"numerics\":{\"grading\":{\"density\":"));
    }

    #[test]
    fn every_bad_option_is_named_and_so_is_every_fault_of_the_experiment() {
        assert_eq!(SimOptions::default().check(), Ok(()));
        let mut bad = SimOptions { vertices: 3, step_m: f64::NAN, ..SimOptions::default() };
        bad.experiment.plate.friction = -0.1;
        bad.numerics.grading.density = 0.5;
        let error = bad.check().unwrap_err();
        assert_eq!(error.faults.len(), 4, "{error}");
        for key in [
            "plate.friction = -0.1",
            "vertices = 3 is outside 4",
            "step_m = NaN",
            "numerics.grading.density = 0.5",
        ] {
            assert!(error.to_string().contains(key), "{error}");
        }
    }
}

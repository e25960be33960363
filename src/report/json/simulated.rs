//! What `simulate --json` prints.

use serde::Serialize;

use crate::sim::{Drape, Stop, rim_harmonics_m};

/// What became of the drape of `scan2params simulate --json`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Simulated {
    /// How it ended.
    pub stop: Stop,
    /// Largest net force on a vertex \[N\].
    pub residual_n: f64,
    /// Energy \[J\].
    pub energy_j: f64,
    /// Folds \[count\].
    pub nodes: usize,
    /// Amplitudes of the rim's harmonics, 1, 2, ... \[mm\].
    pub rim_harmonics_mm: [f64; 16],
    /// Pairs of triangles that pass through each other \[count\].
    pub intersections: usize,
    /// Least height over the plate's surface \[mm\].
    pub plate_clearance_mm: f64,
    /// Linear systems factored \[count\].
    pub factorisations: usize,
    /// Processor time \[s\]; null where the system does not tell.
    pub cpu_s: Option<f64>,
}

impl Simulated {
    /// Of a drape and the time that it took \[s\].
    #[must_use]
    pub fn of(drape: &Drape, cpu_s: Option<f64>) -> Self {
        Self {
            stop: drape.stop,
            residual_n: drape.residual_n,
            energy_j: drape.energy_j,
            nodes: drape.nodes,
            rim_harmonics_mm: rim_harmonics_m(&drape.boundary).map(|m| m * 1e3),
            intersections: drape.intersections,
            plate_clearance_mm: drape.plate_clearance_m * 1e3,
            factorisations: drape.effort.factorisations,
            cpu_s,
        }
    }
}

#[cfg(test)]
#[test]
fn the_schema_of_a_simulation_is_that_of_the_type() {
    crate::base::schema::holds::<Simulated>("simulate", "simulate --json", &[]);
}

//! One sample of a dataset: a fabric's perturbed drop, simulated.

use super::row::SimulatedRow;
use crate::fabric::Fabric;
use crate::sim::{Drop, DropStart, SimOptions, Stop, drape};

/// The options under which datasets are made: the default's, but the descent ends
/// when a cycle lowers the energy by less than 1e-4 of itself. How far such rims
/// are from full rest is in `docs/validation.md`.
#[must_use]
pub fn dataset_options() -> SimOptions {
    SimOptions { energy_drop: 1e-4, ..SimOptions::default() }
}

/// Simulates sample `index` of a run: its drop is drawn from the run's seed and
/// the index.
#[must_use]
pub fn simulate(index: u64, fabric: &Fabric, run_seed: u64, options: &SimOptions) -> SimulatedRow {
    let drop_seed = run_seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ index;
    let drape = drape(fabric, &Drop { start: DropStart::Perturbed(drop_seed) }, options);
    SimulatedRow {
        at_rest: matches!(drape.stop, Stop::AtRest | Stop::Slow) && drape.intersections == 0,
        stop: if drape.intersections > 0 { "intersects".into() } else { drape.stop.name().into() },
        stable: drape.stop == Stop::AtRest,
        node_count: drape.nodes as u32,
        energy_j: drape.energy_j,
        residual_n: drape.residual_n,
        boundary: drape.boundary,
    }
}

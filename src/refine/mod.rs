//! From an estimate back to the drape: does the simulator reproduce the scan?
//!
//! In: a scanned rim (simulation frame) and a fabric. Out: the simulated drape on
//! the branch nearest to the scan and its distance to it. A drape has several
//! stable shapes; springs lead the sheet to the scanned rim and are then released,
//! so that the equilibrium found is one of the fabric's own, near what was scanned.

use crate::base::Boundary;
use crate::fabric::Fabric;
use crate::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// A re-simulated drape beside the rim it is to reproduce.
#[derive(Clone, Debug)]
pub struct Resimulation {
    /// The drape, at rest without the springs.
    pub drape: Drape,
    /// Mean distance of corresponding rim points \[m\].
    pub mean_distance_m: f64,
    /// Largest distance of corresponding rim points \[m\].
    pub largest_distance_m: f64,
}

/// Drapes `fabric` on the branch nearest to `scanned`.
#[must_use]
pub fn resimulate(scanned: &Boundary, fabric: &Fabric, options: &SimOptions) -> Resimulation {
    let start = DropStart::Guided(Box::new(scanned.clone()));
    let drape = drape(fabric, &Drop { start }, options);
    let distances = scanned.positions_m().zip(drape.boundary.positions_m());
    let largest_distance_m = distances.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    Resimulation {
        mean_distance_m: scanned.mean_distance_m(&drape.boundary),
        largest_distance_m,
        drape,
    }
}

//! The drape of a fabric on the branch nearest to a scan.
//!
//! In: a scanned rim and, where there is one, the whole scanned sheet (simulation frame), and a
//! fabric. Out: the simulated drape and its distance to the scan. A
//! drape has several stable shapes; springs lead the sheet to what was scanned and are then
//! released, so that the equilibrium found is one of the fabric's own, near the scan. A rim that was
//! read from a table has no sheet: springs then lead the border alone, after a fall.

use crate::base::{Boundary, Surface};
use crate::fabric::Fabric;
use crate::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// What led a re-simulated drape to its branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LedBy {
    /// The whole scanned sheet: [`DropStart::Surface`].
    Sheet,
    /// The rim alone: [`DropStart::Guided`].
    Rim,
}

impl LedBy {
    /// The word for it in files; "led by the" stands before it in texts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sheet => "sheet",
            Self::Rim => "rim",
        }
    }
}

/// A re-simulated drape beside the rim it is to reproduce.
#[derive(Clone, Debug)]
pub struct Resimulation {
    /// The drape, at rest without the springs.
    pub drape: Drape,
    /// What led it.
    pub led_by: LedBy,
    /// Mean distance of corresponding rim points \[m\].
    pub mean_distance_m: f64,
    /// Largest distance of corresponding rim points \[m\].
    pub largest_distance_m: f64,
}

/// Drapes `fabric` on the branch nearest to what was scanned: led by `sheet` if there is one, by the
/// rim `scanned` otherwise.
#[must_use]
pub fn resimulate(
    scanned: &Boundary,
    sheet: Option<&Surface>,
    fabric: &Fabric,
    options: &SimOptions,
) -> Resimulation {
    let (start, led_by) = match sheet {
        Some(sheet) => (DropStart::Surface(Box::new(sheet.clone())), LedBy::Sheet),
        None => (DropStart::Guided(Box::new(scanned.clone())), LedBy::Rim),
    };
    let drape = drape(fabric, &Drop { start }, options);
    Resimulation::beside(scanned, drape, led_by)
}

impl Resimulation {
    /// A drape beside the rim that it is to reproduce.
    #[must_use]
    pub fn beside(scanned: &Boundary, drape: Drape, led_by: LedBy) -> Self {
        let distances = scanned.positions_m().zip(drape.boundary.positions_m());
        let largest_distance_m = distances.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let mean_distance_m = scanned.mean_distance_m(&drape.boundary);
        Self { drape, led_by, mean_distance_m, largest_distance_m }
    }
}

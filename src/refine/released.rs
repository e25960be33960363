//! The released drape: what the simulator does with a fabric on a scan's branch when nothing holds
//! the sheet.
//!
//! In: a scanned rim and, where there is one, the whole scanned sheet (simulation frame), and a
//! fabric. Out: the simulated drape and its distance to the scan. A fabric has several stable
//! drapes within millimetres of each other, and the true fabric itself moves by 0.3 to 2 mm.
//! Springs guide the sheet to what was scanned and are then released. A rim that was read from a
//! table has no sheet: springs guide its border alone, after a fall.

use crate::base::{Boundary, Surface};
use crate::fabric::Fabric;
use crate::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// What a drape was started from before it was released.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum StartedFrom {
    /// The whole scanned sheet.
    Sheet,
    /// The rim alone.
    Rim,
}

impl StartedFrom {
    /// The word for it in files; "started from the" stands before it in texts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sheet => "sheet",
            Self::Rim => "rim",
        }
    }
}

/// A drape that nothing holds, beside the rim that was scanned.
#[derive(Clone, Debug)]
pub struct ReleasedDrape {
    /// The drape, at rest without springs unless its `stop` says otherwise.
    pub drape: Drape,
    /// What it was started from.
    pub started_from: StartedFrom,
    /// Mean distance of corresponding rim points \[m\].
    pub mean_distance_m: f64,
    /// Largest distance of corresponding rim points \[m\].
    pub largest_distance_m: f64,
}

/// Drapes `fabric` on the branch nearest to what was scanned: guided by `sheet` if there is one, by
/// the rim `scanned` otherwise.
#[must_use]
pub fn released_drape(
    scanned: &Boundary,
    sheet: Option<&Surface>,
    fabric: &Fabric,
    options: &SimOptions,
) -> ReleasedDrape {
    let (start, started_from) = match sheet {
        Some(sheet) => (DropStart::Surface(Box::new(sheet.clone())), StartedFrom::Sheet),
        None => (DropStart::Guided(Box::new(scanned.clone())), StartedFrom::Rim),
    };
    let drape = drape(fabric, &Drop { start }, options);
    ReleasedDrape::beside(scanned, drape, started_from)
}

impl ReleasedDrape {
    /// A drape beside the rim that it is to reproduce.
    #[must_use]
    pub fn beside(scanned: &Boundary, drape: Drape, started_from: StartedFrom) -> Self {
        let [mean_distance_m, largest_distance_m] = scanned.distances_m(&drape.boundary);
        Self { drape, started_from, mean_distance_m, largest_distance_m }
    }
}

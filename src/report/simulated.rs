//! The simulated drape that tables and figures show beside the scan: the tied drape where the
//! answer is a refined fabric, else the released drape, if there is one.

use crate::job::Outcome;
use crate::sim::Drape;

/// A drape tied to the scan by weak springs.
pub(crate) const TIED: &str = "tied drape";
/// A drape without springs.
pub(crate) const RELEASED: &str = "released drape";

/// A simulated drape beside the scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SimulatedDrape<'a> {
    /// The drape.
    pub drape: &'a Drape,
    /// [`TIED`] or [`RELEASED`].
    pub name: &'static str,
    /// Mean and largest distance of its rim from the scanned one \[m\].
    pub distances_m: [f64; 2],
}

impl<'a> SimulatedDrape<'a> {
    /// The one to judge the answer by.
    pub fn of(outcome: &'a Outcome) -> Option<Self> {
        let tied = outcome.taken().map(|taken| taken.first()).map(|fit| Self {
            drape: &fit.tied,
            name: TIED,
            distances_m: [fit.tied_mean_m, fit.tied_largest_m],
        });
        tied.or_else(|| Self::released(outcome))
    }

    /// The released drape where another one is shown before it.
    pub fn second(outcome: &'a Outcome) -> Option<Self> {
        outcome.taken().and_then(|_| Self::released(outcome))
    }

    fn released(outcome: &'a Outcome) -> Option<Self> {
        outcome.released.as_ref().map(|found| Self {
            drape: &found.drape,
            name: RELEASED,
            distances_m: [found.mean_distance_m, found.largest_distance_m],
        })
    }
}

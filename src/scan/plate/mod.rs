//! The plate: where in a scene a cloth may lie on a disc of known radius and hang from it.
//!
//! In: points of the scene \[m\], any frame. Out: places, those that look most like a drape
//! first, each with the plate's centre (on the cloth's surface), up, radius and noise. Which of
//! them is the drape is decided by the flattened cloth (`scan::pose`).
//!
//! A place is a flat patch that lies on no plane wider than the specimen (`wide`), with either
//! side up (`seek`), by what is around it (`evidence`). Where the scan looks from below, the
//! plate's underside lies 4 to 8 mm under the cloth, and a post or a column under that. So of
//! what lies above each other within the edge only the uppermost layer counts (`layer`), and of
//! what lies at the edge nothing that the cloth farther out is higher than (`skirt`), both when
//! the disc is sought and when it is measured (`measure`).

mod evidence;
mod layer;
mod measure;
mod placed;
mod seek;
mod skirt;
mod wide;

pub(super) use measure::{Plate, level};
pub(super) use placed::Placed;
pub(super) use skirt::Skirt;

use rayon::prelude::*;

use super::hints::Hints;
use super::options::ScanOptions;
use crate::base::Point3;
use measure::measure;
use seek::Sought;

/// A place in a scene that may be a plate with a drape on it.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The plate, if it is one.
    pub plate: Plate,
}

/// Where in a scene a drape may be.
pub(super) struct Places {
    /// The places, those that look most like a drape first.
    pub places: Vec<Place>,
    /// Share of the scene's surfaces that are planes wider than the specimen.
    pub wide_share: f64,
}

/// The places in a scene of points \[m\] that look most like a plate with a drape on it, of
/// those that the caller allows.
pub(super) fn places(points: &[Point3], hints: &Hints, options: &ScanOptions) -> Places {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let Sought { candidates, wide_share } = seek::candidates(points, hints, options);
    let measured = candidates
        .par_iter()
        .filter_map(|candidate| measure(points, candidate, radius_m, tuning))
        .filter(|plate| hints.allow(&plate.centre, &plate.up));
    Places { places: measured.map(|plate| Place { plate }).collect(), wide_share }
}

//! The plate: where in a scene a cloth may lie on a disc of known radius and hang from it.
//!
//! In: points of the scene \[m\], any frame. Out: places, those that look most like a drape
//! first, and of each place tried the plate's centre (on the cloth's surface), up, radius and
//! noise. Which of them is the drape is decided by the flattened cloth (`scan::pose`).
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

pub(super) use measure::{Plate, level, measure};
pub(super) use placed::Placed;
pub(super) use seek::{Candidate, Sought, candidates};
pub(super) use skirt::Skirt;

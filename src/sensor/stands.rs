//! Stands that people have: what carries a plate of 50 mm radius, drawn in its sizes.
//!
//! In: a kind and a seed, and the cloth that must hang free of it. Out: a [`Stand`] without a
//! own floor; [`super::Surroundings`] adds one. All sizes are guesses at things in a
//! household or a workshop.

use rand::RngExt as _;

use super::scene::{Stand, Support};
use crate::base::seed;
use crate::geom::Mesh;

/// What carries the plate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandKind {
    /// A thin post.
    Post,
    /// A can nearly as wide as the plate.
    Can,
    /// A column of 20 mm.
    Column,
    /// An upright box.
    Box,
    /// A glass, wider at the top or at the foot.
    Glass,
}

/// Least distance from the cloth below the plate to what carries it \[m\].
const CLEAR_M: f64 = 2e-3;
/// The support becomes narrower by this factor until the cloth hangs free.
const NARROWER: f64 = 0.9;

impl StandKind {
    /// Every kind.
    pub const ALL: [Self; 5] = [Self::Post, Self::Can, Self::Column, Self::Box, Self::Glass];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Post => "post",
            Self::Can => "can",
            Self::Column => "column",
            Self::Box => "box",
            Self::Glass => "glass",
        }
    }

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// A stand of this kind. `rounding_m` is that of the plate's edge; `None` draws 1 to 5 mm. The
    /// support is narrower than drawn where the cloth would touch it.
    #[must_use]
    pub fn draw(self, drape: &Mesh, rounding_m: Option<f64>, run_seed: u64) -> Stand {
        let mut rng = seed::rng(run_seed, "sensor-stand", 0);
        let mut between = |low: f64, high: f64| rng.random_range(low..=high);
        let (rounding, thickness) = (between(1e-3, 5e-3), between(4e-3, 8e-3));
        let rounding_m = rounding_m.unwrap_or(rounding);
        let radius = match self {
            Self::Post => between(4e-3, 10e-3),
            Self::Can => between(35e-3, 42e-3),
            Self::Column => 20e-3,
            Self::Box => between(30e-3, 36e-3),
            Self::Glass => between(30e-3, 38e-3),
        };
        let support = match self {
            Self::Post | Self::Can | Self::Column => Support::Column,
            Self::Box => Support::Box,
            Self::Glass => Support::Cone { foot_radius_m: between(30e-3, 38e-3) },
        };
        let mut stand = Stand {
            plate_thickness_m: thickness.max(rounding_m),
            plate_rounding_m: rounding_m,
            pedestal_radius_m: radius,
            support,
            ..Stand::MODIFIED_CUSICK
        };
        while !hangs_free(drape, &stand) && stand.pedestal_radius_m > 5e-3 {
            stand.pedestal_radius_m *= NARROWER;
            if let Support::Cone { foot_radius_m } = &mut stand.support {
                *foot_radius_m *= NARROWER;
            }
        }
        stand
    }
}

/// Whether the cloth below the plate keeps clear of what carries it.
fn hangs_free(drape: &Mesh, stand: &Stand) -> bool {
    let below = -stand.plate_thickness_m - CLEAR_M;
    let Some((support, _)) = stand.solids().pop() else { return true };
    let mut hanging = drape.vertices.iter().filter(|p| p.y < below);
    hanging.all(|p| support.distance_m(p) > CLEAR_M)
}

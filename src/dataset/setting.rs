//! What a drape stands on and among when it is scanned: the stand of the experiment, or another
//! drawn by seed.
//!
//! In: a drape in the simulation frame \[m\], a [`Setting`], a sensor, a seed. Out: the scene. With
//! the usual setting it is the bench of the modified Cusick drape. A scene with another one is
//! seen from drawn views ([`crate::sensor::draw_views`]), since things may hide the drape.

use crate::geom::Mesh;
use crate::sensor::{Profile, Scene, StandKind, Surroundings};

/// What a drape stands on and among; nothing given for the bench of the experiment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setting {
    /// What carries the plate.
    pub stand: Option<StandKind>,
    /// What stands around.
    pub surroundings: Option<Surroundings>,
    /// Radius of the plate's rounded edge \[m\]; `None` draws one for a drawn stand.
    pub rounding_m: Option<f64>,
}

/// Views around a drape whose setting is drawn.
pub const VIEWS: usize = 24;
/// A plate with a rounded edge is at least so thick \[m\].
const LEAST_THICKNESS_M: f64 = 5e-3;

impl Setting {
    /// Whether nothing is drawn.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// The drape on its stand, among what stands around. `profile` says how much room a camera
    /// needs before a wall.
    #[must_use]
    pub fn scene(&self, drape: Mesh, profile: &Profile, seed: u64) -> Scene {
        let reach_m = drape.vertices.iter().map(|p| p.x.hypot(p.z)).fold(0.0, f64::max);
        let mut scene = Scene::modified_cusick(drape);
        if let Some(kind) = self.stand {
            scene.stand = kind.draw(&scene.drape, self.rounding_m, seed);
        } else if let Some(rounding_m) = self.rounding_m {
            scene.stand.plate_rounding_m = rounding_m;
            scene.stand.plate_thickness_m = LEAST_THICKNESS_M.max(rounding_m);
        }
        if let Some(surroundings) = self.surroundings {
            const BEFORE_A_WALL_M: f64 = 0.03;
            let room_m = reach_m + profile.range_m[0] + BEFORE_A_WALL_M;
            surroundings.furnish(&mut scene, room_m, seed);
        }
        scene
    }
}

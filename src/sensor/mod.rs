//! The virtual depth camera: from a drape to the scan that a sensor makes of it.
//!
//! In: a [`Scene`] (drape, plate, pedestal, floor; simulation frame, metres),
//! poses of a camera, a [`Profile`] of its errors, a seed. Out: a
//! [`VirtualScan`]: depth images, the fused cloud in an arbitrary scanner frame
//! and unit (so that `scan` must find both), and the [`Truth`] that undoes them.
//! The same arguments give the same bytes for any number of threads.
//!
//! Error forms: axial and lateral noise after Nguyen, Izadi and Lovell,
//! "Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking"
//! (3DIMPVT 2012); the step of the depth after Khoshelham and Elberink,
//! "Accuracy and Resolution of Kinect Depth Data" (Sensors 12, 2012). The
//! other forms (flying pixels, grazing drop-out, holes, outliers, the shift of
//! edges, pose errors) are empirical. `profile.rs` says of each size where it is
//! from.
//!
//! Limits: the older profiles' noise is independent from pixel to pixel; no interreflection, no
//! lens distortion, no motion; the cloth is a sheet without thickness, seen from both sides.

mod around;
mod camera;
mod correlated;
mod even;
mod fuse;
mod lost;
mod noise;
mod passes;
mod profile;
mod render;
mod residual;
mod scene;
pub mod silhouette;
mod solids;
mod stands;
mod surroundings;
mod views;

pub use around::{Seen, draw_views, seen};
pub use camera::{Camera, CameraPose, Ring, default_ring};
pub use even::even;
pub use fuse::{Truth, VirtualScan};
pub use profile::{Fusion, Profile, Smooth};
pub use render::DepthImage;
pub use residual::{DepthNoise, LAGS_PX};
pub use scene::{Scene, SceneError, Stand, Support, Surface, Thing};
pub use solids::Solid;
pub use stands::StandKind;
pub use surroundings::Surroundings;

use fuse::Thinning;
use passes::Motion;
use render::Clean;
use scene::Stage;

/// Scans `scene` from `poses` and fuses the views.
///
/// # Errors
/// When the scene is none: a drape without triangles, sizes that are not
/// positive, a floor above the cloth.
pub fn scan(
    scene: &Scene,
    poses: &[CameraPose],
    profile: &Profile,
    seed: u64,
) -> Result<VirtualScan, SceneError> {
    let stage = Stage::new(scene)?;
    let motions = Motion::draw(profile, poses.len(), seed);
    let views: Vec<DepthImage> = poses
        .iter()
        .zip(&motions)
        .zip(0..)
        .map(|((pose, motion), view)| {
            let clean = Clean::render(&stage, pose, profile, seed, view);
            noise::measure(clean, pose, motion, profile, seed, view)
        })
        .collect();
    let thinning = Thinning::of(profile);
    let fused = fuse::fuse(&views, &thinning, seed);
    let truth = Truth::draw(profile.unit_m, seed);
    let cloud = truth.to_scanner(fused);
    Ok(VirtualScan { views, cloud, truth })
}

#[cfg(test)]
mod tests;

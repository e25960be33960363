//! The virtual depth camera: from a drape to the scan that a sensor makes of it.
//!
//! In: a [`Scene`] (drape, plate, pedestal, floor; simulation frame, metres),
//! poses of a camera, a [`Profile`] of its errors, a seed. Out: a
//! [`VirtualScan`]: depth images, the fused cloud in an arbitrary scanner frame
//! and unit (so that `scan` must find both), and the [`Truth`] that undoes them.
//! The same arguments give the same bytes, whatever the number of threads.
//!
//! Error forms: axial and lateral noise after Nguyen, Izadi and Lovell,
//! "Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking"
//! (3DIMPVT 2012); the step of the depth after Khoshelham and Elberink,
//! "Accuracy and Resolution of Kinect Depth Data" (Sensors 12, 2012). The
//! other forms (flying pixels, grazing drop-out, holes, outliers, the shift of
//! edges, pose errors) are empirical. `profile.rs` says of each size where it is
//! from.
//!
//! Limits: noise is independent from pixel to pixel (that of real consumer
//! cameras is smooth over a few pixels); no interreflection, no lens distortion,
//! no motion; the cloth is a sheet without thickness, seen from both sides.

mod camera;
mod even;
mod fuse;
mod noise;
mod profile;
mod render;
mod scene;
pub mod silhouette;
mod views;

pub use camera::{Camera, CameraPose, Ring, default_ring};
pub use even::even;
pub use fuse::{Truth, VirtualScan};
pub use profile::Profile;
pub use render::DepthImage;
pub use scene::{Scene, SceneError, Stand, Surface};

use fuse::Thinning;
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
    let views: Vec<DepthImage> = poses
        .iter()
        .zip(0..)
        .map(|(pose, view)| {
            let clean = Clean::render(&stage, pose, profile, seed, view);
            noise::measure(clean, pose, profile, seed, view)
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

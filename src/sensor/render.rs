//! Ray casting: what a camera would see without errors of depth.

use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::scene::Stage;
use super::{Camera, CameraPose, Profile};
use crate::base::{Point3, seed};

/// A measured depth image.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// The camera.
    pub camera: Camera,
    /// Where the camera stood.
    pub pose_true: CameraPose,
    /// Its pose as the fusing program estimates it.
    pub pose_believed: CameraPose,
    /// Depth along the camera's z, row by row \[m\]; NaN where nothing was measured.
    pub depth_m: Vec<f64>,
    /// Colour of each pixel.
    pub colors: Vec<[u8; 3]>,
}

impl DepthImage {
    /// The point that pixel `index` (row by row) shows, in the camera's frame
    /// \[m\]; `None` where nothing was measured.
    #[must_use]
    pub fn point_in_camera_m(&self, index: usize) -> Option<Point3> {
        let depth_m = self.depth_m[index];
        let (row, column) = (index / self.camera.width, index % self.camera.width);
        let ray = self.camera.ray(column as f64, row as f64);
        depth_m.is_finite().then(|| Point3::from(ray * depth_m))
    }
}

/// What a pixel sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Along the camera's z \[m\].
    pub(super) depth_m: f64,
    /// Between the ray and the surface's normal \[rad\].
    pub(super) incidence_rad: f64,
    pub(super) color: [u8; 3],
}

/// Offsets of the pixels around one, as columns and rows.
pub(super) const EIGHT_NEIGHBOURS: [[i32; 2]; 8] =
    [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// An image without errors of depth; `None` where there is nothing within range.
pub(super) struct Clean {
    pub(super) camera: Camera,
    pub(super) samples: Vec<Option<Sample>>,
}

impl Clean {
    /// Casts a ray for each pixel, moved by the lateral noise.
    ///
    /// That noise depends on the incidence, so a pixel is cast twice if the
    /// profile has any.
    pub(super) fn render(
        stage: &Stage<'_>,
        pose: &CameraPose,
        profile: &Profile,
        run_seed: u64,
        view: u64,
    ) -> Self {
        let camera = profile.camera;
        let cast_row = |row: usize| {
            let item = view * camera.height as u64 + row as u64;
            let mut rng = seed::rng(run_seed, "sensor-lateral", item);
            (0..camera.width)
                .map(|column| {
                    let at = [column as f64, row as f64];
                    let still = cast(stage, pose, profile, at)?;
                    let sigma = profile.lateral_sigma_px(still.incidence_rad);
                    if sigma == 0.0 {
                        return Some(still);
                    }
                    let moved = at.map(|c| {
                        let normal: f64 = StandardNormal.sample(&mut rng);
                        c + sigma * normal
                    });
                    cast(stage, pose, profile, moved)
                })
                .collect::<Vec<_>>()
        };
        let samples = (0..camera.height).into_par_iter().flat_map_iter(cast_row).collect();
        Self { camera, samples }
    }

    /// The sample at `offset` from pixel `index`, if that is in the image.
    pub(super) fn beside(&self, index: usize, offset: [i32; 2]) -> Option<Option<Sample>> {
        let (row, column) = (index / self.camera.width, index % self.camera.width);
        let column = column.checked_add_signed(offset[0] as isize)?;
        let row = row.checked_add_signed(offset[1] as isize)?;
        if column >= self.camera.width || row >= self.camera.height {
            return None;
        }
        Some(self.samples[row * self.camera.width + column])
    }
}

fn cast(stage: &Stage<'_>, pose: &CameraPose, profile: &Profile, at: [f64; 2]) -> Option<Sample> {
    let in_camera = profile.camera.ray(at[0], at[1]);
    let z = in_camera.norm().recip();
    let origin = Point3::from(pose.simulation_from_camera.translation.vector);
    let ray = pose.simulation_from_camera.rotation * (in_camera * z);
    let (hit, surface) = stage.cast(&origin, &ray, profile.range_m[1] / z)?;
    let depth_m = hit.distance * z;
    if depth_m < profile.range_m[0] {
        return None;
    }
    let cosine = (-ray.dot(&hit.normal)).clamp(0.0, 1.0);
    let albedo = stage.color(surface, &(origin + ray * hit.distance));
    // The lamp sits at the camera.
    let color = albedo.map(|channel| (f64::from(channel) * (0.4 + 0.6 * cosine)) as u8);
    Some(Sample { depth_m, incidence_rad: cosine.acos(), color })
}

//! What a view loses: patches of depth edges, and spots of surface.
//!
//! In: a clean image, the shares and sizes of a [`Profile`], a seed. Out: which pixels see
//! nothing. A patch is a disc of pixels around a pixel of a depth edge; a spot is a ball of space
//! around a place on a surface. Both are drawn anew for each view.

use rand::RngExt as _;

use super::render::{Clean, EIGHT_NEIGHBOURS, Sample};
use super::{Camera, Profile};
use crate::base::{Point3, seed};

/// The losses of one view.
pub(super) struct Lost {
    /// Middles \[pixels\] and radii of patches.
    patches: Vec<([f64; 2], f64)>,
    /// Middles in the camera's frame and radii of spots \[m\].
    spots: Vec<(Point3, f64)>,
}

impl Lost {
    pub(super) fn draw(image: &Clean, profile: &Profile, run_seed: u64, view: u64) -> Self {
        let mut rng = seed::rng(run_seed, "sensor-lost", view);
        Self { patches: patches(image, profile, &mut rng), spots: spots(image, profile, &mut rng) }
    }

    /// Whether the pixel, which sees `sample`, is lost.
    pub(super) fn has(&self, camera: &Camera, index: usize, sample: &Sample) -> bool {
        let (row, column) = (index / camera.width, index % camera.width);
        let (x, y) = (column as f64, row as f64);
        let in_patch = |([cx, cy], radius): &([f64; 2], f64)| (x - cx).hypot(y - cy) < *radius;
        if self.patches.iter().any(in_patch) {
            return true;
        }
        if self.spots.is_empty() {
            return false;
        }
        let at = Point3::from(camera.ray(x, y) * sample.depth_m);
        self.spots.iter().any(|(middle, radius)| (at - middle).norm_squared() < radius * radius)
    }
}

/// So many patches that they cover the share of the edges' pixels, were they straight and apart.
fn patches(image: &Clean, profile: &Profile, rng: &mut seed::Rng) -> Vec<([f64; 2], f64)> {
    if profile.edge_loss_fraction == 0.0 {
        return Vec::new();
    }
    let on_edge = |index: usize| {
        let Some(here) = image.samples[index] else { return false };
        let beside = EIGHT_NEIGHBOURS.iter().filter_map(|&offset| image.beside(index, offset));
        let step_m = profile.edge_step_m;
        beside.into_iter().any(|other| other.is_none_or(|o| o.depth_m > here.depth_m + step_m))
    };
    let edge: Vec<usize> = (0..image.samples.len()).filter(|&index| on_edge(index)).collect();
    let [least, most] = profile.edge_loss_px;
    let covered = least + most;
    let count = (profile.edge_loss_fraction * edge.len() as f64 / covered).round() as usize;
    let patch = |_| {
        let index = edge[rng.random_range(0..edge.len())];
        let width = image.camera.width;
        let middle = [(index % width) as f64, (index / width) as f64];
        (middle, least + rng.random::<f64>() * (most - least))
    };
    (0..count).map(patch).collect()
}

fn spots(image: &Clean, profile: &Profile, rng: &mut seed::Rng) -> Vec<(Point3, f64)> {
    let [least, most] = profile.speck_radius_m;
    let spot = |_| {
        let index = rng.random_range(0..image.samples.len());
        let radius = least + rng.random::<f64>() * (most - least);
        let (row, column) = (index / image.camera.width, index % image.camera.width);
        let ray = image.camera.ray(column as f64, row as f64);
        image.samples[index].map(|sample| (Point3::from(ray * sample.depth_m), radius))
    };
    (0..profile.specks_per_view).filter_map(spot).collect()
}

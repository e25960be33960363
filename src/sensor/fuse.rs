//! From views to one cloud, in a frame and unit of the scanner's own.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use serde::{Deserialize, Serialize};

use super::profile::Fusion;
use super::{DepthImage, Profile};
use crate::base::{Isometry3, Point3, Vector3, seed};
use crate::geom::Cloud;
use crate::io::{self, WriteError};

/// A scan, and what is true of it.
#[derive(Clone, Debug)]
pub struct VirtualScan {
    /// The views.
    pub views: Vec<DepthImage>,
    /// The fused cloud as its file holds it: in the scanner's frame and unit.
    pub cloud: Cloud,
    /// What undoes the scanner's frame and unit.
    pub truth: Truth,
}

impl VirtualScan {
    /// The points of all pixels of all views where the scanner estimates them, in
    /// its frame and unit: what a set of depth images holds, neither fused nor downsampled.
    #[must_use]
    pub fn unfused(&self) -> Cloud {
        self.truth.to_scanner(all_points(&self.views))
    }

    /// Fuses the views once more, after something was changed in them; `seed` as for
    /// [`super::scan`].
    pub fn fuse_again(&mut self, profile: &Profile, seed: u64) {
        let fused = fuse(&self.views, &Thinning::of(profile), seed);
        self.cloud = self.truth.to_scanner(fused);
    }

    /// Writes the cloud as PLY and next to it the truth as `<stem>.truth.json`.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), WriteError> {
        let path = path.as_ref();
        io::write_ply(path, &self.cloud, 1.0)?;
        self.truth.write(&path.with_extension("truth.json"))
    }
}

/// How the scanner's frame and unit relate to the simulation frame.
///
/// A point p of the cloud lies at `simulation_from_scanner * (p * unit_m)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "TruthFile", into = "TruthFile")]
pub struct Truth {
    /// Length of the cloud's unit \[m\].
    pub unit_m: f64,
    /// The rigid motion, metres.
    pub simulation_from_scanner: Isometry3,
}

/// Where a virtual scan of `scan2params augment` truly lies: a point p of the file is at
/// rotation(p * `unit_m`) + translation in the simulation frame \[m\].
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct TruthFile {
    /// Metres in a unit of the file \[m\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    unit_m: f64,
    /// Rotation as a unit quaternion, i, j, k, w \[-\].
    simulation_from_scanner_rotation_ijkw: [f64; 4],
    /// Translation, after the rotation \[m\].
    simulation_from_scanner_translation_m: [f64; 3],
}

impl From<Truth> for TruthFile {
    fn from(truth: Truth) -> Self {
        let motion = truth.simulation_from_scanner;
        Self {
            unit_m: truth.unit_m,
            simulation_from_scanner_rotation_ijkw: motion.rotation.coords.into(),
            simulation_from_scanner_translation_m: motion.translation.vector.into(),
        }
    }
}

impl From<TruthFile> for Truth {
    fn from(file: TruthFile) -> Self {
        let [i, j, k, w] = file.simulation_from_scanner_rotation_ijkw;
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let shift = Translation3::from(file.simulation_from_scanner_translation_m);
        let simulation_from_scanner = Isometry3::from_parts(shift, rotation);
        Self { unit_m: file.unit_m, simulation_from_scanner }
    }
}

impl Truth {
    /// Draws a rotation (evenly) and a shift of up to half a metre per axis.
    pub(super) fn draw(unit_m: f64, run_seed: u64) -> Self {
        let mut rng = seed::rng(run_seed, "sensor-frame", 0);
        let normals = nalgebra::Vector4::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) });
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(normals));
        let shift = Vector3::from_fn(|_, _| rng.random_range(-0.5..=0.5));
        let simulation_from_scanner = Isometry3::from_parts(Translation3::from(shift), rotation);
        Self { unit_m, simulation_from_scanner }
    }

    /// Writes the truth as JSON.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        io::atomically(path, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            writeln!(out)
        })
    }

    /// A point of the cloud in the simulation frame \[m\].
    #[must_use]
    pub fn to_simulation_m(&self, point: &Point3) -> Point3 {
        self.simulation_from_scanner * (point * self.unit_m)
    }

    /// A cloud of the simulation frame \[m\] in the scanner's frame and unit.
    pub(super) fn to_scanner(self, cloud: Cloud) -> Cloud {
        let scanner_from_simulation = self.simulation_from_scanner.inverse();
        let moved = cloud.points.iter().map(|p| (scanner_from_simulation * p) / self.unit_m);
        Cloud { points: moved.collect(), ..cloud }
    }
}

/// How a cloud is downsampled; see [`Profile`].
pub(super) struct Thinning {
    spacing_m: f64,
    samples_per_point: f64,
    fusion: Fusion,
}

impl Thinning {
    pub(super) fn of(profile: &Profile) -> Self {
        let Profile { spacing_m, samples_per_point, fusion, .. } = *profile;
        Self { spacing_m, samples_per_point, fusion }
    }
}

/// A voxel's samples so far.
struct Voxel {
    /// One of its samples, each with the same chance, so that noise is that of
    /// single measurements. (The one nearest to the voxel's centre was tried: it
    /// prefers errors towards the centre and made 0.15 mm of noise 0.25 mm.)
    chosen: usize,
    /// The least lot of the samples so far.
    lot: u64,
    samples: usize,
    /// Sums over the samples, for their mean.
    position: Vector3,
    color: [f64; 3],
}

impl Voxel {
    fn add(&mut self, point: &Point3, color: [u8; 3]) {
        self.samples += 1;
        self.position += point.coords;
        self.color.iter_mut().zip(color).for_each(|(sum, own)| *sum += f64::from(own));
    }

    /// The mean of its samples.
    fn mean(&self) -> (Point3, [u8; 3]) {
        let share = (self.samples as f64).recip();
        (Point3::from(self.position * share), self.color.map(|sum| (sum * share).round() as u8))
    }
}

/// The points of all pixels in the simulation frame \[m\].
fn all_points(views: &[DepthImage]) -> Cloud {
    let mut all = Cloud::default();
    for view in views {
        let pose = view.pose_believed.simulation_from_camera;
        for index in 0..view.depth_m.len() {
            if let Some(point) = view.point_in_camera_m(index) {
                all.points.push(pose * point);
                all.colors.push(view.colors[index]);
            }
        }
    }
    all
}

/// All views in the simulation frame \[m\], where they are estimated,
/// downsampled to one point per voxel. Where noise exceeds the spacing, a surface
/// fills several layers of voxels, and thinning evens them out: the tails weigh
/// more in the cloud than in the views.
pub(super) fn fuse(views: &[DepthImage], thinning: &Thinning, run_seed: u64) -> Cloud {
    let all = all_points(views);
    let mut lots = seed::rng(run_seed, "sensor-lots", 0);
    let mut voxels: HashMap<[i64; 3], Voxel> = HashMap::new();
    for (index, point) in all.points.iter().enumerate() {
        let cell = point.coords.map(|c| (c / thinning.spacing_m).floor());
        let key = [cell.x as i64, cell.y as i64, cell.z as i64];
        let lot: u64 = lots.random();
        let nothing = (Vector3::zeros(), [0.0; 3]);
        let fresh = Voxel { chosen: index, lot, samples: 0, position: nothing.0, color: nothing.1 };
        let voxel = voxels.entry(key).or_insert(fresh);
        voxel.add(point, all.colors[index]);
        if lot < voxel.lot {
            (voxel.chosen, voxel.lot) = (index, lot);
        }
    }
    // Hash order is random: the samples' order is not.
    let mut kept: Vec<Voxel> = voxels.into_values().collect();
    kept.sort_unstable_by_key(|voxel| voxel.chosen);
    let mut rng = seed::rng(run_seed, "sensor-thin", 0);
    kept.retain(|voxel| rng.random::<f64>() * thinning.samples_per_point < voxel.samples as f64);
    let given = |voxel: &Voxel| match thinning.fusion {
        Fusion::OneSample => (all.points[voxel.chosen], all.colors[voxel.chosen]),
        Fusion::Mean => voxel.mean(),
    };
    let (points, colors) = kept.iter().map(given).unzip();
    Cloud { points, colors, triangles: Vec::new() }
}

#[cfg(test)]
#[test]
fn the_schema_of_a_truth_is_that_of_the_type() {
    crate::base::schema::holds::<TruthFile>("truth", "NAME.truth.json", &[]);
}

//! The frame in which a scan is worked on, and what fixes it.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

use super::floor::{self, Floor};
use super::options::ScanOptions;
use super::plane::horizontal_axes;
use super::plate::Plate;
use crate::base::{Isometry3, Point3, Vector3};

/// Degrees, counter-clockwise seen from above, from the scan's own x axis laid
/// horizontal (its y axis if x points up). Every bearing of this module.
pub type Bearing = f64;

/// The local frame: origin at the centre of the plate's top face, y up, x along the
/// scan's x axis laid horizontal.
pub(super) struct LocalFrame {
    /// The local frame from the scan's, both in metres.
    pub local_from_scan: Isometry3,
    /// The floor in it, if one is seen.
    pub floor: Option<Floor>,
}

/// Finds the local frame: origin from the plate's edge, up from plate and floor,
/// each by its variance.
pub(super) fn find(scene: &[Point3], plate: &Plate, options: &ScanOptions) -> LocalFrame {
    let frame = |up: Vector3| {
        let (u, v) = horizontal_axes(&up, &Vector3::x());
        let rows = Matrix3::from_rows(&[u.transpose(), up.transpose(), v.transpose()]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
        let origin = plate.centre - up * options.cloth_height_m;
        let to_origin = Translation3::from(-origin.coords);
        Isometry3::from_parts(Translation3::identity(), rotation) * to_origin
    };
    let mut local_from_scan = frame(plate.up.into_inner());
    let mut floor = floor::find(scene, &local_from_scan, options, plate.noise_m);
    // A plate that is clearly tilted keeps its own normal.
    let tuning = &options.tuning.frame;
    let plate_sigma = tuning.plate_error_factor * plate.tilt_sigma_rad + tuning.plate_sigma_rad;
    let most_rad = tuning.level_sigmas * plate_sigma.hypot(tuning.floor_sigma_rad);
    let level = |f: &Floor| f.normal.angle(&Vector3::y()) < most_rad;
    if let Some(found) = floor.filter(level) {
        let weight = (tuning.floor_sigma_rad / plate_sigma).powi(2);
        let up = (found.normal + Vector3::y() * weight).normalize();
        let up = local_from_scan.inverse_transform_vector(&up);
        let before = std::mem::replace(&mut local_from_scan, frame(up));
        let normal = local_from_scan * before.inverse_transform_vector(&found.normal);
        floor = Some(Floor { normal, ..found });
    }
    LocalFrame { local_from_scan, floor }
}

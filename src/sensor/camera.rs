//! The camera's geometry: a pinhole, x right, y down, z forward.

use crate::base::{Isometry3, Point3, Vector3};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Pinhole intrinsics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// Focal length, the same in both directions \[pixels\].
    pub focal_px: f64,
}

impl Camera {
    /// The direction of pixel (`column`, `row`) in the camera's frame, with z = 1;
    /// the pixel's centre has integer coordinates.
    #[must_use]
    pub fn ray(&self, column: f64, row: f64) -> Vector3 {
        let center = |size: usize| 0.5 * (size as f64 - 1.0);
        let x = (column - center(self.width)) / self.focal_px;
        let y = (row - center(self.height)) / self.focal_px;
        Vector3::new(x, y, 1.0)
    }
}

/// Where a camera stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// From the camera's frame (x right, y down, z forward) to the simulation frame.
    pub simulation_from_camera: Isometry3,
}

impl CameraPose {
    /// A camera at `eye` that looks at `target`, upright as far as that goes.
    #[must_use]
    pub fn look_at(eye: Point3, target: Point3) -> Self {
        let forward = (target - eye).normalize();
        // Looking straight down or up, "up" is -z, the far end of the table.
        let up = if forward.y.abs() > 0.999 { -Vector3::z() } else { Vector3::y() };
        let right = forward.cross(&up).normalize();
        let down = forward.cross(&right);
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
        let rotation = UnitQuaternion::from_rotation_matrix(&axes);
        let simulation_from_camera =
            Isometry3::from_parts(Translation3::from(eye.coords), rotation);
        Self { simulation_from_camera }
    }
}

/// Cameras around the drape, on rings of one elevation each.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// Heights above the target as angles \[rad\]; one ring of views each.
    pub elevations_rad: Vec<f64>,
    /// Views on all rings together, shared out evenly, the first rings first; every
    /// other ring is turned by half a step.
    pub views: usize,
    /// Distance from the target \[m\].
    pub distance_m: f64,
    /// Where the rings' cameras look, and the rings' axis: simulation frame \[m\]. Off
    /// the plate's axis where the specimen does not stand in the middle of the scanner.
    pub target_m: [f64; 3],
    /// Whether one more camera looks straight down.
    pub from_top: bool,
}

impl Default for Ring {
    /// 5 views from 45 degrees above, 5 from 2 degrees below the middle of the
    /// hanging cloth, where the rim and the insides of the folds show, 1 from the top.
    fn default() -> Self {
        Self {
            elevations_rad: vec![45_f64.to_radians(), (-2_f64).to_radians()],
            views: 10,
            distance_m: 0.45,
            target_m: [0.0, -0.07, 0.0],
            from_top: true,
        }
    }
}

impl Ring {
    /// Views from 40, 5 and -25 degrees, none from the top: the last see the plate's
    /// underside.
    #[must_use]
    pub fn from_below(views: usize) -> Self {
        let elevations_rad = [40_f64, 5.0, -25.0].map(f64::to_radians).to_vec();
        Self { elevations_rad, views, from_top: false, ..Self::default() }
    }

    /// The poses, in a fixed order.
    #[must_use]
    pub fn poses(&self) -> Vec<CameraPose> {
        let target = Point3::from(self.target_m);
        let rings = self.elevations_rad.len().max(1);
        let mut poses = Vec::new();
        for (ring, elevation) in self.elevations_rad.iter().enumerate() {
            let views = self.views / rings + usize::from(ring < self.views % rings);
            let step = std::f64::consts::TAU / views.max(1) as f64;
            for view in 0..views {
                let azimuth = (view as f64 + 0.5 * (ring % 2) as f64) * step;
                let away = Vector3::new(
                    elevation.cos() * azimuth.cos(),
                    elevation.sin(),
                    elevation.cos() * azimuth.sin(),
                );
                poses.push(CameraPose::look_at(target + away * self.distance_m, target));
            }
        }
        if self.from_top {
            let eye = target + Vector3::new(0.0, self.distance_m - self.target_m[1], 0.0);
            poses.push(CameraPose::look_at(eye, target));
        }
        poses
    }
}

/// The poses of [`Ring::default`].
#[must_use]
pub fn default_ring() -> Vec<CameraPose> {
    Ring::default().poses()
}

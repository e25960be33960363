//! How a drape lies where it was measured: in a picture from straight above, or in a scan's frame.

use crate::base::Vector3;

/// Numbers of a pose.
pub const POSE: usize = 11;

/// How a drape lies. Also the standard deviations of these numbers, and moves with each.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[serde(into = "[f64; POSE]")]
pub struct Pose {
    /// The plate's axis beside the origin of what was measured, x and z \[m\].
    pub offset_m: [f64; 2],
    /// The warp's bearing there, from +x towards +z \[rad\].
    pub rotation_rad: f64,
    /// Logarithm of the scale over the one given.
    pub ln_scale: f64,
    /// The specimen's centre beside the plate's axis, along warp and weft \[m\].
    pub specimen_m: [f64; 2],
    /// How far beyond the outline its springs pull \[m\].
    pub pull_m: f64,
    /// Of a scan, in which heights are seen, the height of the plate's face \[m\].
    pub height_m: f64,
    /// By how much a scan leans, as rises along warp and weft \[rad\].
    pub lean_rad: [f64; 2],
    /// How far cloth lies beyond the drape's cells, in moves from them to finer ones
    /// ([`super::target::Finer`]).
    pub cells: f64,
}

impl Pose {
    /// Its numbers, in the order of the least squares.
    fn numbers(&mut self) -> [&mut f64; POSE] {
        let ([ox, oz], [sx, sz]) = (&mut self.offset_m, &mut self.specimen_m);
        let ([lx, lz], turn) = (&mut self.lean_rad, &mut self.rotation_rad);
        let (scale, pull, height) = (&mut self.ln_scale, &mut self.pull_m, &mut self.height_m);
        [ox, oz, turn, scale, sx, sz, pull, height, lx, lz, &mut self.cells]
    }
}

impl From<[f64; POSE]> for Pose {
    fn from(values: [f64; POSE]) -> Self {
        let mut pose = Self::default();
        pose.numbers().into_iter().zip(values).for_each(|(number, value)| *number = value);
        pose
    }
}

impl From<Pose> for [f64; POSE] {
    fn from(mut pose: Pose) -> Self {
        pose.numbers().map(|number| *number)
    }
}

/// A pose in a picture whose scale is off by a logarithm.
#[must_use]
pub fn scaled(pose: &Pose, ln_scale: f64) -> Pose {
    Pose { ln_scale: pose.ln_scale + ln_scale, ..*pose }
}

/// A measured place in the plan of the simulation frame.
pub(super) fn plan_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose.rotation_rad.sin_cos();
    let scale = (-pose.ln_scale).exp();
    let (x, z) = (x - pose.offset_m[0], z - pose.offset_m[1]);
    [scale * (x * cos + z * sin), scale * (z * cos - x * sin)]
}

/// A measured place in the simulation frame; for the small angles by which scans lean.
pub(super) fn frame_of(place: &Vector3, pose: &Pose) -> Vector3 {
    let [x, z] = plan_of([place.x, place.z], pose);
    let y = (-pose.ln_scale).exp() * (place.y - pose.height_m);
    let [lean_x, lean_z] = pose.lean_rad;
    Vector3::new(x - lean_x * y, y + lean_x * x + lean_z * z, z - lean_z * y)
}

/// A place in the plan of the simulation frame, where it was measured.
#[must_use]
pub fn picture_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose.rotation_rad.sin_cos();
    let scale = pose.ln_scale.exp();
    let [axis_x, axis_z] = pose.offset_m;
    [scale * (x * cos - z * sin) + axis_x, scale * (x * sin + z * cos) + axis_z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_maps_there_and_back() {
        let numbers = [2e-3, -1e-3, 0.4, 0.02, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0];
        let pose = Pose::from(numbers);
        assert_eq!((<[f64; POSE]>::from(pose), pose.height_m), (numbers, 1e-3));
        let p = [0.11, -0.03];
        let there = picture_of(p, &pose);
        let back = plan_of(there, &pose);
        assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-15);
        let back = frame_of(&Vector3::new(there[0], 1e-3 - 0.05 * 0.02_f64.exp(), there[1]), &pose);
        assert!((back - Vector3::new(p[0], -0.05, p[1])).norm() < 1e-15);
        // the warp's bearing in the picture is the rotation
        let turned = Pose { rotation_rad: 0.4, ..Pose::default() };
        let [x, z] = picture_of([0.1, 0.0], &turned);
        assert!((z.atan2(x) - 0.4).abs() < 1e-12);
        // what rises along the warp is laid level
        let leaning = Pose { lean_rad: [-0.01, 0.0], ..Pose::default() };
        let level = frame_of(&Vector3::new(0.1, 1e-3, 0.0), &leaning);
        assert!(level.y.abs() < 1e-12 && (level.x - 0.1).abs() < 2e-5);
    }
}

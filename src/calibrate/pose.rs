//! How a drape lies where it was measured: in a picture from straight above, or in a scan's frame.

use crate::base::Vector3;

/// Numbers of a pose.
pub const POSE: usize = 11;

/// Names of the pose's numbers in files.
pub const POSE_KEYS: [&str; POSE] = [
    "offset_x",
    "offset_z",
    "rotation",
    "ln_scale",
    "specimen_x",
    "specimen_z",
    "pull",
    "height",
    "lean_x",
    "lean_z",
    "cells",
];

/// How a drape lies: the plate's axis beside the origin of what was measured, x and z \[m\]; the
/// warp's bearing there, from +x towards +z \[rad\]; the logarithm of the scale over the one given;
/// the specimen's centre beside the plate's axis, along warp and weft \[m\]; how far beyond the
/// outline its springs pull \[m\]; and of a scan, in which heights are seen, the height of the
/// plate's face \[m\] and by how much what is measured leans, as rises along warp and weft \[rad\];
/// and how far cloth lies beyond the drape's cells, in moves from them to finer ones
/// ([`super::target::Finer`]).
pub type Pose = [f64; POSE];

/// A pose in a picture whose scale is off by a logarithm.
#[must_use]
pub fn scaled(pose: &Pose, ln_scale: f64) -> Pose {
    let mut pose = *pose;
    pose[3] += ln_scale;
    pose
}

/// A measured place in the plan of the simulation frame.
pub(super) fn plan_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose[2].sin_cos();
    let scale = (-pose[3]).exp();
    let (x, z) = (x - pose[0], z - pose[1]);
    [scale * (x * cos + z * sin), scale * (z * cos - x * sin)]
}

/// A measured place in the simulation frame; for the small angles by which scans lean.
pub(super) fn frame_of(place: &Vector3, pose: &Pose) -> Vector3 {
    let [x, z] = plan_of([place.x, place.z], pose);
    let y = (-pose[3]).exp() * (place.y - pose[7]);
    let [lean_x, lean_z] = [pose[8], pose[9]];
    Vector3::new(x - lean_x * y, y + lean_x * x + lean_z * z, z - lean_z * y)
}

/// A place in the plan of the simulation frame, where it was measured.
#[must_use]
pub fn picture_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose[2].sin_cos();
    let scale = pose[3].exp();
    [scale * (x * cos - z * sin) + pose[0], scale * (x * sin + z * cos) + pose[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_maps_there_and_back() {
        let pose = [2e-3, -1e-3, 0.4, 0.02, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0];
        let p = [0.11, -0.03];
        let there = picture_of(p, &pose);
        let back = plan_of(there, &pose);
        assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-15);
        let back = frame_of(&Vector3::new(there[0], 1e-3 - 0.05 * 0.02_f64.exp(), there[1]), &pose);
        assert!((back - Vector3::new(p[0], -0.05, p[1])).norm() < 1e-15);
        // the warp's bearing in the picture is the rotation
        let mut turned = [0.0; POSE];
        turned[2] = 0.4;
        let [x, z] = picture_of([0.1, 0.0], &turned);
        assert!((z.atan2(x) - 0.4).abs() < 1e-12);
        // what rises along the warp is laid level
        let mut leaning = [0.0; POSE];
        leaning[8] = -0.01;
        let level = frame_of(&Vector3::new(0.1, 1e-3, 0.0), &leaning);
        assert!(level.y.abs() < 1e-12 && (level.x - 0.1).abs() < 2e-5);
    }
}

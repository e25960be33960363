//! Scenes of a turntable: the drape turns before a camera that stands still, no pose is known, and
//! the plate stands beside the axis.
//!
//! The sensor moves round the drape instead; what would stand still, a wall and a box, is put into
//! each view.

use nalgebra::{Translation3, UnitQuaternion, UnitVector3};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::record::{Brought, Drawn, Record, Truth};
use scan2params::base::{Isometry3, Point3, Vector3, seed};
use scan2params::geom::Cloud;
use scan2params::intake::turntable;
use scan2params::io::{Format, ReadNotes, SeenView};
use scan2params::scan::ScanOptions;
use scan2params::sensor::{CameraPose, DepthImage, SceneError, scan};

/// Views of a whole turn.
const VIEWS: [usize; 5] = [8, 12, 18, 24, 36];
/// Largest distance of the axis from the plate's middle \[m\], and angle to its normal \[rad\].
const OFF_M: f64 = 15e-3;
const TILT_RAD: f64 = 1.5_f64.to_radians();
/// How high the camera stands \[rad\].
const ELEVATION_RAD: std::ops::Range<f64> = 0.4..0.9;
/// Standard deviation of a step \[rad\].
const UNEVEN_RAD: f64 = 0.3_f64.to_radians();

/// Draws scene `index` and brings its views together. The step is said in every other scene.
pub(super) fn one(index: u64, drawn: Drawn<'_>, rng: &mut seed::Rng) -> Result<Record, SceneError> {
    let Drawn { sensor, drape, scene, seed } = drawn;
    let count = VIEWS[rng.random_range(0..VIEWS.len())];
    let turned: f64 = if rng.random() { 1.0 } else { -1.0 };
    let step_rad = turned * std::f64::consts::TAU / count as f64;
    // Some stop before the turn is whole.
    let count = if rng.random() { count } else { count - count / 4 };
    let mut evenly = |most: f64| rng.random_range(-most..most);
    let place = Translation3::new(evenly(OFF_M), 0.0, evenly(OFF_M));
    let axis = Vector3::new(evenly(TILT_RAD), 1.0, evenly(TILT_RAD));
    let axis = UnitVector3::new_normalize(axis);
    let [near, far] = sensor.usual_distance_m;
    let distance_m = rng.random_range(near..=far);
    let elevation = rng.random_range(ELEVATION_RAD);
    let target = Point3::new(0.0, -0.07, 0.0);
    let eye = target + Vector3::new(elevation.cos(), elevation.sin(), 0.0) * distance_m;
    let first = CameraPose::look_at(eye, target);
    let pose = |k: usize| {
        let uneven: f64 = StandardNormal.sample(rng);
        let angle = step_rad * k as f64 + UNEVEN_RAD * uneven;
        let turn = place * UnitQuaternion::from_axis_angle(&axis, angle) * place.inverse();
        CameraPose { simulation_from_camera: turn * first.simulation_from_camera }
    };
    let poses: Vec<CameraPose> = (0..count).map(pose).collect();
    let scanned = scan(&scene, &poses, &sensor, seed)?;
    let still = at_rest(&first.simulation_from_camera.inverse());
    let read = |image: &DepthImage| {
        let seen = (0..image.depth_m.len()).filter_map(|k| image.point_in_camera_m(k));
        let points = seen.chain(still.iter().copied()).collect();
        SeenView {
            name: String::new(),
            cloud: Cloud { points, ..Cloud::default() },
            pose: Isometry3::identity(),
            notes: ReadNotes { format: Some(Format::DepthPng), ..ReadNotes::default() },
        }
    };
    let mut views: Vec<SeenView> = scanned.views.iter().map(read).collect();
    let points = views.iter().map(|view| view.cloud.points.len()).sum();
    let said_rad = index.is_multiple_of(2).then_some(step_rad.abs());
    let frame = |image: &DepthImage| vec![image.pose_true.simulation_from_camera.inverse()];
    let frames = scanned.views.iter().map(frame).collect();
    let truth = Truth { sensor: &sensor, drape, frames, points };
    Ok(truth.record(index, || {
        let begun = turntable::begin(&mut views, said_rad, &ScanOptions::default()).ok()?;
        let settled = begun.register.settled(&begun.poses);
        Some(Brought { begun: begun.poses, settled, noise_m: begun.register.noise_m() })
    }))
}

/// A wall behind the drape and a box next to it, in the camera's frame \[m\].
fn at_rest(camera_from_simulation: &Isometry3) -> Vec<Point3> {
    let grid = |count: usize| (0..count * count).map(move |k| (k / count, k % count));
    let wall =
        grid(150).map(|(a, b)| Point3::new(-0.45, 0.006 * a as f64 - 0.4, 0.006 * b as f64 - 0.45));
    let side =
        grid(50).map(|(a, b)| Point3::new(0.003 * a as f64 - 0.05, 0.003 * b as f64 - 0.2, -0.3));
    wall.chain(side).map(|p| camera_from_simulation * p).collect()
}

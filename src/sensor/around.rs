//! Views led around a drape among other things, and what of its rim they see.
//!
//! In: a [`Scene`], a [`Profile`], a number of views, a seed. Out: poses on rings of random
//! elevations, at the sensor's usual distance, each before everything that would hide the drape.
//! A view that would stand in or behind a thing is raised, or comes nearer; one that stays
//! hidden is left out.

use rand::RngExt as _;

use super::profile::Profile;
use super::scene::{Scene, SceneError, Stage};
use super::{CameraPose, Ring};
use crate::base::{Point3, Vector3, seed};

/// A camera keeps this far from floor and things \[m\].
const ROOM_M: f64 = 0.02;
/// A view is raised by this until nothing hides the drape \[rad\].
const RAISED_RAD: f64 = 0.09;
/// And no further than this \[rad\].
const MOST_RAISED_RAD: f64 = 1.35;
/// A point is seen if nothing lies before it but for its own cloth within this \[m\].
const BEFORE_M: f64 = 1.5e-3;

/// What some views see of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Share of the points that one view or more sees.
    pub share: f64,
    /// The longest run of points in their order, round, that none sees.
    pub longest_hidden: usize,
}

/// Draws `views` poses around the drape; with a floor none of them is below it.
///
/// # Errors
/// When the scene is none.
pub fn draw_views(
    scene: &Scene,
    profile: &Profile,
    views: usize,
    run_seed: u64,
) -> Result<Vec<CameraPose>, SceneError> {
    let stage = Stage::new(scene)?;
    let mut rng = seed::rng(run_seed, "sensor-around", 0);
    let floor = scene.stand.floor_radius_m > 0.0;
    let rings = (views / 4).clamp(2, 4);
    let [near, far] = profile.usual_distance_m;
    let low_rad: f64 =
        if floor { rng.random_range(-0.05..0.12) } else { rng.random_range(-0.6..-0.2) };
    let high_rad: f64 = rng.random_range(0.6..1.0);
    let elevation = |ring: usize, rng: &mut seed::Rng| {
        let share = ring as f64 / (rings - 1) as f64;
        low_rad + (high_rad - low_rad) * share + rng.random_range(-0.06..0.06)
    };
    let ring = Ring {
        elevations_rad: (0..rings).map(|ring| elevation(ring, &mut rng)).collect(),
        views,
        distance_m: rng.random_range(near..=far),
        target_m: [rng.random_range(-0.01..0.01), -0.07, rng.random_range(-0.01..0.01)],
        from_top: rng.random(),
    };
    let ring = Ring { views: views - usize::from(ring.from_top), ..ring };
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn);
    let target = Point3::from(ring.target_m);
    let placed = ring.poses().into_iter().filter_map(|pose| {
        let eye = turn * pose.simulation_from_camera.translation.vector;
        free_eye(&stage, scene, target, eye.into(), near)
            .map(|eye| CameraPose::look_at(eye, target))
    });
    Ok(placed.collect())
}

/// The eye, raised or nearer until it sees the plate's middle and stands in nothing.
fn free_eye(
    stage: &Stage<'_>,
    scene: &Scene,
    target: Point3,
    eye: Point3,
    near_m: f64,
) -> Option<Point3> {
    let away = eye - target;
    let (flat, distance) = (away.x.hypot(away.z), away.norm());
    let begin = away.y.atan2(flat);
    let turn = away.z.atan2(away.x);
    let mut elevation = begin;
    while elevation <= MOST_RAISED_RAD.max(begin) {
        for nearer in [1.0, 0.9, 0.8] {
            let r = (distance * nearer).max(near_m.min(distance));
            let eye = target
                + Vector3::new(
                    r * elevation.cos() * turn.cos(),
                    r * elevation.sin(),
                    r * elevation.cos() * turn.sin(),
                );
            if is_free(stage, scene, &eye) {
                return Some(eye);
            }
        }
        elevation += RAISED_RAD;
    }
    None
}

fn is_free(stage: &Stage<'_>, scene: &Scene, eye: &Point3) -> bool {
    let stand = &scene.stand;
    if stand.floor_radius_m > 0.0 && eye.y < stand.floor_y_m + ROOM_M {
        return false;
    }
    if scene.things.iter().any(|thing| thing.solid.distance_m(eye) < ROOM_M) {
        return false;
    }
    // The plate's middle, and the hanging cloth at half its height: something of the drape's
    // own may lie before them, but no thing.
    let aims = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, -0.08, 0.0)];
    aims.iter().all(|aim| {
        let ray = (aim - eye).normalize();
        let hit = stage.cast(eye, &ray, (aim - eye).norm());
        !matches!(hit, Some((_, super::Surface::Thing(_))))
    })
}

/// What the views see of points on the cloth, in their order.
///
/// # Errors
/// When the scene is none.
pub fn seen(
    scene: &Scene,
    profile: &Profile,
    poses: &[CameraPose],
    points: &[Point3],
) -> Result<Seen, SceneError> {
    let stage = Stage::new(scene)?;
    let camera = profile.camera;
    let half = [0.5 * camera.width as f64, 0.5 * camera.height as f64];
    let by = |pose: &CameraPose, point: &Point3| {
        let own = pose.simulation_from_camera.inverse_transform_point(point);
        let inside = |k: usize| (own[k] / own.z * camera.focal_px).abs() < half[k];
        if own.z < profile.range_m[0] || own.z > profile.range_m[1] || !inside(0) || !inside(1) {
            return false;
        }
        let eye = Point3::from(pose.simulation_from_camera.translation.vector);
        let to = point - eye;
        let distance = to.norm();
        stage.cast(&eye, &(to / distance), distance - BEFORE_M).is_none()
    };
    let seen: Vec<bool> = points.iter().map(|p| poses.iter().any(|pose| by(pose, p))).collect();
    let count = seen.iter().filter(|seen| **seen).count();
    let (mut longest_hidden, mut run) = (0, 0);
    for seen in seen.iter().chain(&seen) {
        run = if *seen { 0 } else { run + 1 };
        longest_hidden = longest_hidden.max(run.min(points.len()));
    }
    Ok(Seen { share: count as f64 / points.len().max(1) as f64, longest_hidden })
}

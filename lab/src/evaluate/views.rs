//! Views whose poses miss, brought together: how far off they lie before and after, for `evaluate
//! views`.
//!
//! In: sensors, a folder of drapes ([`super::scenes::drapes`]), a seed. Each scene draws stand,
//! surroundings and fabric; its parts are single views, or passes of several. Each part is moved by
//! a drawn miss of up to 20 mm and 5 degrees about the drape. Out: a [`Record`] of each scene.
//!
//! The error of parts is how far they move points of the cloth apart, root mean square, without the
//! motion that all have in common. Within a pass the views keep their drift, of which the mean
//! counts. A turntable's views begin where the step and the plates put them. The figure to reach is
//! 0.2 mm for structured light and half of the noise of single points for others.

mod record;
mod turntable;

use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt as _;
use rand::seq::IndexedRandom as _;

use super::scenes::drapes::KeptDrape;
use record::{Brought, Drawn, Truth};
use scan2params::base::{Isometry3, Point3, Vector3, seed};
use scan2params::dataset::setting::Setting;
use scan2params::intake::register::{Register, View};
use scan2params::sensor::{
    CameraPose, DepthImage, Profile, SceneError, StandKind, Surroundings, draw_views, scan,
};

pub use record::{Group, Record};

/// Largest miss of a part: shift \[m\], turn \[rad\].
const MISS: [f64; 2] = [20e-3, 5.0_f64.to_radians()];

/// Scenes to draw.
#[derive(Clone, Debug)]
pub struct Series {
    /// The sensors, in turn.
    pub sensors: Vec<Profile>,
    /// The drapes to draw from.
    pub drapes: Vec<KeptDrape>,
    /// Seed of the run.
    pub seed: u64,
    /// Which scenes; odd ones are of passes.
    pub scenes: std::ops::Range<u64>,
    /// Whether they are of a turntable instead: views without poses.
    pub turntable: bool,
}

impl Series {
    /// Draws the scenes, tells of each.
    ///
    /// # Errors
    /// When a scene is none.
    pub fn run(&self, mut told: impl FnMut(&Record)) -> Result<Vec<Record>, SceneError> {
        let mut records = Vec::new();
        for index in self.scenes.clone() {
            let record = self.one(index)?;
            told(&record);
            records.push(record);
        }
        Ok(records)
    }

    fn one(&self, index: u64) -> Result<Record, SceneError> {
        if self.turntable {
            let mut rng = seed::rng(self.seed, "evaluate-turntable", index);
            let drawn = self.drawn(index / 2, &mut rng);
            return turntable::one(index, drawn, &mut rng);
        }
        let mut rng = seed::rng(self.seed, "evaluate-views", index);
        let Drawn { mut sensor, drape, scene, seed } = self.drawn(index / 2, &mut rng);
        let passes = index % 2 == 1;
        let views_of_part = if passes { rng.random_range(4..=10) } else { 1 };
        let parts = if passes { rng.random_range(2..=4) } else { rng.random_range(5..=12) };
        let mut poses = draw_views(&scene, &sensor, parts * views_of_part, seed)?;
        if passes {
            // Each pass goes round, or sees its own side.
            let round: bool = rng.random();
            let turn = |pose: &CameraPose| {
                let eye = pose.simulation_from_camera.translation.vector;
                eye.z.atan2(eye.x)
            };
            if !round {
                poses.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
            }
        }
        // The miss is drawn here; the walk within a pass stays.
        sensor.passes = if passes { parts } else { 0 };
        let scan = scan(&scene, &poses, &sensor, seed)?;
        let misses: Vec<Isometry3> = (0..parts).map(|_| miss(&mut rng)).collect();
        let parts: Vec<_> = scan.views.chunks(views_of_part).zip(&misses).collect();
        Ok(judged(index, &sensor, drape, &parts))
    }

    /// What a scene is of.
    fn drawn(&self, sensor: u64, rng: &mut seed::Rng) -> Drawn<'_> {
        let sensor = &self.sensors[sensor as usize % self.sensors.len()];
        let drape = self.drapes.choose(rng).unwrap_or_else(|| unreachable!("drapes are there"));
        let stand = StandKind::ALL.choose(rng).copied();
        // A turntable carries the drape alone.
        let around = &Surroundings::ALL[1..];
        let surroundings = around.choose(rng).copied().filter(|_| !self.turntable);
        let setting = Setting { stand, surroundings, rounding_m: None };
        let seed: u64 = rng.random();
        let scene = setting.scene(drape.mesh.clone(), sensor, seed);
        Drawn { sensor: sensor.clone(), drape, scene, seed }
    }
}

fn miss(rng: &mut seed::Rng) -> Isometry3 {
    let mut along = |most: f64| {
        let direction = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)).normalize();
        direction * most * rng.random_range(0.0..1.0_f64)
    };
    let (shift, turn) = (along(MISS[0]), along(MISS[1]));
    // About the middle of the hanging cloth.
    let middle = Translation3::new(0.0, -0.05, 0.0);
    Translation3::from(shift) * middle * UnitQuaternion::new(turn) * middle.inverse()
}

/// The record of parts that are moved by their misses.
fn judged(
    index: u64,
    sensor: &Profile,
    drape: &KeptDrape,
    parts: &[(&[DepthImage], &Isometry3)],
) -> Record {
    let cloud = |(images, miss): &(&[DepthImage], &Isometry3)| -> Vec<Point3> {
        let of = |image: &DepthImage| {
            let pose = *miss * image.pose_believed.simulation_from_camera;
            let points = (0..image.depth_m.len()).filter_map(|k| image.point_in_camera_m(k));
            points.map(|p| pose * p).collect::<Vec<_>>()
        };
        images.iter().flat_map(of).collect()
    };
    let eye = |(images, miss): &(&[DepthImage], &Isometry3)| match images {
        [image] => {
            let pose = *miss * image.pose_believed.simulation_from_camera;
            Some(Point3::from(pose.translation.vector))
        }
        _ => None,
    };
    let frames = |(images, miss): &(&[DepthImage], &Isometry3)| -> Vec<Isometry3> {
        let from_true = |image: &DepthImage| {
            let [believed, exact] =
                [image.pose_believed, image.pose_true].map(|pose| pose.simulation_from_camera);
            *miss * believed * exact.inverse()
        };
        images.iter().map(from_true).collect()
    };
    let clouds: Vec<Vec<Point3>> = parts.iter().map(cloud).collect();
    let views: Vec<View<'_>> =
        parts.iter().zip(&clouds).map(|(part, points)| View { points, eye: eye(part) }).collect();
    let truth = Truth {
        sensor,
        drape,
        frames: parts.iter().map(frames).collect(),
        points: clouds.iter().map(Vec::len).sum(),
    };
    truth.record(index, || {
        let register = Register::new(&views);
        let begun = vec![Isometry3::identity(); views.len()];
        let settled = register.settled(&begun);
        Some(Brought { begun, settled, noise_m: register.noise_m() })
    })
}

//! What the fusing program gets wrong for all views, and from view to view: the focal length, and
//! passes that drift against each other.
//!
//! In: a [`Profile`], the number of views, a seed. Out: a [`Motion`] for each view, simulation
//! frame. A pass is a run of views in their order. It begins at its own error of pose and
//! wanders as a random walk, so that neighbouring views agree better than distant ones.

use rand_distr::{Distribution as _, StandardNormal};

use super::{Camera, CameraPose, Profile};
use crate::base::{Isometry3, Vector3, seed};

/// The errors that a view has from its pass and from its device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pose: Option<Isometry3>,
    focal_factor: f64,
}

impl Motion {
    /// Of each view.
    pub(super) fn draw(profile: &Profile, views: usize, run_seed: u64) -> Vec<Self> {
        let mut rng = seed::rng(run_seed, "sensor-focal", 0);
        let normal: f64 = StandardNormal.sample(&mut rng);
        let focal_factor = 1.0 + profile.focal_error * normal;
        let poses = match profile.passes {
            0 => vec![None; views],
            passes => (0..views)
                .map(|view| Some(wandered(profile, view, views, passes, run_seed)))
                .collect(),
        };
        poses.into_iter().map(|pose| Self { pose, focal_factor }).collect()
    }

    /// The pose that the program has for a view.
    pub(super) fn moved(&self, pose: &CameraPose) -> CameraPose {
        let simulation_from_camera = match self.pose {
            Some(error) => error * pose.simulation_from_camera,
            None => pose.simulation_from_camera,
        };
        CameraPose { simulation_from_camera }
    }

    /// The camera as the program knows it.
    pub(super) fn believed(&self, camera: Camera) -> Camera {
        Camera { focal_px: camera.focal_px * self.focal_factor, ..camera }
    }
}

/// The error of a view: its pass's, and the steps of the walk from the pass's first view.
fn wandered(
    profile: &Profile,
    view: usize,
    views: usize,
    passes: usize,
    run_seed: u64,
) -> Isometry3 {
    let length = views.div_ceil(passes).max(1);
    let (pass, steps) = (view / length, view % length);
    let mut rng = seed::rng(run_seed, "sensor-pass", pass as u64);
    let mut sum = [Vector3::zeros(); 2];
    for step in 0..=steps {
        let share = if step == 0 { 1.0 } else { (length as f64).sqrt().recip() };
        for part in &mut sum {
            *part += Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) }) * share;
        }
    }
    Isometry3::new(sum[0] * profile.drift_shift_m, sum[1] * profile.drift_turn_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_origin() -> CameraPose {
        CameraPose { simulation_from_camera: Isometry3::identity() }
    }

    #[test]
    fn passes_lie_as_far_off_as_stated_and_their_views_near_to_each_other() {
        let profile = Profile { passes: 3, drift_shift_m: 1e-3, ..super::super::profile::IDEAL };
        let shift =
            |motion: &Motion| motion.moved(&at_origin()).simulation_from_camera.translation.vector;
        let (mut firsts, mut steps, mut seams) = (0.0, 0.0, 0.0);
        for seed in 0..400 {
            let motions = Motion::draw(&profile, 30, seed);
            firsts += shift(&motions[10]).norm_squared();
            steps += (shift(&motions[5]) - shift(&motions[4])).norm_squared();
            seams += (shift(&motions[10]) - shift(&motions[9])).norm_squared();
        }
        let rms = |sum: f64| (sum / 1200.0).sqrt();
        assert!((rms(firsts) / 1e-3 - 1.0).abs() < 0.06, "{}", rms(firsts));
        assert!((rms(steps) / 1e-3 - 0.1_f64.sqrt()).abs() < 0.03, "{}", rms(steps));
        assert!(rms(seams) > 1.4e-3, "{}", rms(seams));
    }

    #[test]
    fn without_passes_and_focal_error_nothing_moves() {
        let profile = super::super::profile::IDEAL;
        for motion in Motion::draw(&profile, 4, 9) {
            assert_eq!(motion.moved(&at_origin()), at_origin());
            assert_eq!(motion.believed(profile.camera), profile.camera);
        }
    }
}

//! As-rigid-as-possible relaxation of material coordinates: the best local isometry, with
//! the free edge tied to the square.
//!
//! Minimises over the coordinates x and a rotation R per point
//!   sum over links w_ij |x_j - x_i - R_i t_ij|^2 + sum over ties v (x_c - target)^2
//! alternately (local/global, Liu et al. 2008): t_ij is the step from i to j in
//! the tangent plane of i. Links whose length disagrees, because they step from
//! one layer of cloth to another, lose their weight (Geman-McClure).
//!
//! In and out: coordinates \[m\] of the parameterised points. Fixed points stay.

use super::super::tuning::ParameterisationTuning;
use super::links::{Links, norm};
use super::system::{System, Tie};
use crate::numeric::anderson::Mixer;

/// How far to go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Most rounds.
    pub rounds: usize,
    /// Conjugate gradient steps in each.
    pub steps: usize,
    /// A round that moves the points by less than this in the mean is the last \[m\].
    pub enough_m: f64,
}

/// What is relaxed.
pub(super) struct Relaxation<'a> {
    /// The steps between the points.
    pub links: &'a Links,
    /// Points that stay.
    pub fixed: &'a [bool],
    /// Distance between the points \[m\].
    pub spacing_m: f64,
    /// The constants.
    pub tuning: &'a ParameterisationTuning,
}

impl Relaxation<'_> {
    /// Relaxes `x` in place. Each round is one local and one global step; Anderson
    /// acceleration over the last rounds takes the place of the hundreds that a long strip
    /// of cloth needs to swing.
    pub fn relax(&self, ties: &[Tie], effort: Effort, x: &mut [[f64; 2]]) {
        let Self { links, fixed, spacing_m, tuning } = *self;
        let mut mixer = Mixer::default();
        for _ in 0..effort.rounds {
            let weights = links.weights(x, tuning.link_off_cells * spacing_m);
            let rotations = links.rotations(x, &weights);
            let mut next = x.to_vec();
            let system = System { links, weights: &weights, fixed, ties, tuning };
            system.solve(&rotations, effort.steps, &mut next);
            let before = x.to_vec();
            mixer.step(x.as_flattened_mut(), next.into_flattened());
            let moves = x.iter().zip(&before).map(|(a, b)| norm([a[0] - b[0], a[1] - b[1]]));
            if moves.sum::<f64>() < effort.enough_m * x.len() as f64 {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat 20 x 20 patch, 2 mm apart, with true steps.
    fn patch() -> (Links, Vec<[f64; 2]>) {
        let at = |k: usize| [(k / 20) as f64 * 2e-3, (k % 20) as f64 * 2e-3];
        let lists = (0..400).map(|i| {
            let near = (0..400_usize).filter(|&j| {
                let d = [at(j)[0] - at(i)[0], at(j)[1] - at(i)[1]];
                j != i && d[0].hypot(d[1]) < 3e-3
            });
            near.map(|j| (j as u32, [at(j)[0] - at(i)[0], at(j)[1] - at(i)[1]])).collect()
        });
        (Links::new(lists), (0..400).map(at).collect())
    }

    #[test]
    fn a_bent_patch_relaxes_to_its_true_shape() {
        let (links, truth) = patch();
        let mut x: Vec<[f64; 2]> = truth.iter().map(|p| [p[0], p[1] + 2.0 * p[0] * p[0]]).collect();
        let fixed: Vec<bool> = (0..400).map(|k| k < 40).collect();
        x[..40].copy_from_slice(&truth[..40]);
        let effort = Effort { rounds: 20, steps: 12, enough_m: 1e-6 };
        let tuning = crate::scan::tuning::Tuning::default().parameterisation;
        let patch = Relaxation { links: &links, fixed: &fixed, spacing_m: 2e-3, tuning: &tuning };
        patch.relax(&[], effort, &mut x);
        let worst =
            x.iter().zip(&truth).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
        assert!(worst < 0.05e-3, "{:.3} mm", worst * 1e3);
    }
}

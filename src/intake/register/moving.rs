//! Steps that bring views onto one another, all poses at once, and how well the places are known.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

use super::fit::{Fit, fits, usual_m};
use super::thinned::{FINE_STRIDE, STRIDE, Thinned, pairs};
use crate::base::{Isometry3, Vector3};

/// Least reach of the weights \[m\].
const LEAST_REACH_M: f64 = 1.5e-3;
/// The factor by which the reach shrinks.
const SHRINKS: f64 = 0.7;
/// Rounds with the least reach at most.
const LAST_ROUNDS: usize = 8;
/// No motion of more than this \[m\] in a round ends the search.
const AT_REST_M: f64 = 3e-5;
/// In the last rounds, of all cells, the reach is so many misfits; and how many rounds that are.
const LAST_MISFITS: f64 = 2.5;
const MISFIT_ROUNDS: usize = 3;
/// Standard deviations of the motions beforehand: shift \[m\], turn \[rad\].
const PRIOR: [f64; 2] = [30e-3, 0.15];
/// How the prior weighs against one cell's distance: the noise that a cell is taken to have \[m\].
const CELL_NOISE_M: f64 = 0.5e-3;
/// Cells whose noise is one cell's \[-\].
const CORRELATED: f64 = 9.0;
/// Weight that keeps a view where it is.
const HELD: f64 = 1e12;
/// What a turn moves, about \[m\].
const ARM_M: f64 = 0.3;

/// Views on their way onto one another.
#[derive(Clone, Copy)]
pub(super) struct Moving<'a> {
    pub(super) views: &'a [Arc<Thinned>],
    /// The views against which each is held.
    pub(super) partners: &'a [Vec<usize>],
    /// The poses given.
    pub(super) begun: &'a [Isometry3],
    /// Views that stay.
    pub(super) held: &'a [usize],
    pub(super) noise_m: f64,
}

impl Moving<'_> {
    /// The poses in which the views lie on one another best, from some on; the weights reach so far
    /// at first.
    pub(super) fn descend(&self, from: &[Isometry3], mut reach_m: f64) -> Vec<Isometry3> {
        let mut poses = from.to_vec();
        let least_m = LEAST_REACH_M.max(2.0 * self.noise_m);
        let mut last = 0;
        while last < LAST_ROUNDS {
            let stride = if reach_m > least_m { STRIDE } else { FINE_STRIDE };
            let moved_m = self.step(&mut poses, reach_m, stride);
            if reach_m > least_m {
                reach_m = (reach_m * SHRINKS).max(least_m);
            } else if moved_m < AT_REST_M {
                break;
            } else {
                last += 1;
            }
        }
        poses
    }

    /// The poses by all cells, of which those count that lie as near as most.
    pub(super) fn finished(&self, mut poses: Vec<Isometry3>) -> Vec<Isometry3> {
        for _ in 0..MISFIT_ROUNDS {
            let misfit_m = usual_m(&fits(self.views, self.partners, &poses));
            self.step(&mut poses, (LAST_MISFITS * misfit_m).max(AT_REST_M), 1);
        }
        poses
    }

    /// One step of Gauss and Newton for all motions together; the largest shift \[m\].
    fn step(&self, poses: &mut [Isometry3], reach_m: f64, stride: usize) -> f64 {
        let (mut normal, right) =
            equations(self.views, self.partners, self.begun, poses, reach_m, stride);
        for &view in self.held {
            (6 * view..6 * view + 6).for_each(|k| normal[(k, k)] += HELD);
        }
        let Some(solved) = normal.cholesky().map(|factor| factor.solve(&right)) else {
            return 0.0;
        };
        let mut moved_m: f64 = 0.0;
        for (pose, part) in poses.iter_mut().zip(solved.as_slice().chunks_exact(6)) {
            let shift = Vector3::new(part[0], part[1], part[2]);
            let turn = Vector3::new(part[3], part[4], part[5]);
            *pose = Isometry3::new(shift, turn) * *pose;
            moved_m = moved_m.max(shift.norm() + turn.norm() * ARM_M);
        }
        moved_m
    }
}

/// The normal equations of all motions, six unknowns each: shift \[m\] and turn \[rad\].
fn equations(
    views: &[Arc<Thinned>],
    partners: &[Vec<usize>],
    begun: &[Isometry3],
    poses: &[Isometry3],
    reach_m: f64,
    stride: usize,
) -> (DMatrix<f64>, DVector<f64>) {
    let size = 6 * views.len();
    let mut normal = DMatrix::<f64>::zeros(size, size);
    let mut right = DVector::<f64>::zeros(size);
    let prior = |k: usize| (CELL_NOISE_M / PRIOR[usize::from(k % 6 >= 3)]).powi(2);
    for (view, (pose, begun)) in poses.iter().zip(begun).enumerate() {
        let motion = pose * begun.inverse();
        let turn = motion.rotation.scaled_axis();
        for k in 0..6 {
            let so_far = if k < 3 { motion.translation.vector[k] } else { turn[k - 3] };
            normal[(6 * view + k, 6 * view + k)] += prior(k);
            right[6 * view + k] -= prior(k) * so_far;
        }
    }
    let others = |(a, others): (usize, &Vec<usize>)| others.iter().map(move |&b| [a, b]).collect();
    let asked: Vec<[usize; 2]> =
        partners.iter().enumerate().flat_map::<Vec<_>, _>(others).collect();
    let parts: Vec<_> = asked
        .par_iter()
        .map(|&[a, b]| {
            let mut part = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
            for pair in pairs(&views[a], &poses[a], &views[b], &poses[b], reach_m, stride) {
                // After Geman and McClure.
                let weight = (1.0 + (pair.off_m / reach_m).powi(2)).powi(-2);
                let turn = pair.at.coords.cross(&pair.normal);
                let row = pair.normal.iter().chain(turn.iter()).copied();
                let row = SVector::<f64, 6>::from_iterator(row);
                part.0 += row * row.transpose() * weight;
                part.1 -= row * (pair.off_m * weight);
            }
            part
        })
        .collect();
    for ([a, b], (square, side)) in asked.into_iter().zip(parts) {
        for (first, second, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            let mut block = normal.fixed_view_mut::<6, 6>(6 * first, 6 * second);
            block += square * sign;
        }
        let mut own = right.fixed_rows_mut::<6>(6 * a);
        own += side;
        let mut other = right.fixed_rows_mut::<6>(6 * b);
        other -= side;
    }
    (normal, right)
}

/// How far each view's points may still be off against the mean of all views, by their noise \[m\].
pub(super) fn sigmas(
    views: &[Arc<Thinned>],
    partners: &[Vec<usize>],
    begun: &[Isometry3],
    poses: &[Isometry3],
    fits: &[Fit],
) -> Vec<f64> {
    let misfit_m = usual_m(fits);
    let (mut normal, _) = equations(views, partners, begun, poses, 3.0 * misfit_m, FINE_STRIDE);
    // The motion that all have in common is nobody's error.
    let fixed = normal.trace() / 6.0;
    for (a, b) in (0..views.len()).flat_map(|a| (0..views.len()).map(move |b| (a, b))) {
        for k in 0..6 {
            normal[(6 * a + k, 6 * b + k)] += fixed;
        }
    }
    let Some(covariance) = normal.cholesky().map(|factor| factor.inverse()) else {
        return vec![f64::INFINITY; views.len()];
    };
    let of = |(view, thinned): (usize, &Arc<Thinned>)| {
        let own = covariance.fixed_view::<6, 6>(6 * view, 6 * view);
        let variance = |&k: &usize| {
            let at = (poses[view] * thinned.surfels[k].at).coords;
            let arm = at.cross_matrix();
            let moved = SMatrix::<f64, 3, 6>::from_fn(|r, c| match c {
                0..3 => f64::from(u8::from(r == c)),
                _ => -arm[(r, c - 3)],
            });
            (moved * own * moved.transpose()).trace()
        };
        let sum: f64 = thinned.asked.iter().map(variance).sum();
        misfit_m * (CORRELATED * sum / thinned.asked.len().max(1) as f64).sqrt()
    };
    views.iter().enumerate().map(of).collect()
}

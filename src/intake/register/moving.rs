//! Steps that bring views onto one another, all poses at once, and how well the places are known.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

use super::fit::{Fit, fits, usual_m};
use super::thinned::{FINE_STRIDE, Pair, STRIDE, Thinned, pairs};
use crate::base::{Isometry3, Vector3};
use crate::numeric::anderson::Mixer;

/// Least reach of the weights \[m\].
const LEAST_REACH_M: f64 = 1.5e-3;
/// The factor by which the reach shrinks.
const SHRINKS: f64 = 0.7;
/// Rounds with the least reach at most.
const LAST_ROUNDS: usize = 12;
/// No motion of more than this \[m\] in a round ends the search.
const AT_REST_M: f64 = 3e-5;
/// In the last rounds, of all cells, the reach is so many misfits; and how many rounds that are.
const LAST_MISFITS: f64 = 2.5;
const MISFIT_ROUNDS: usize = 2;
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
/// How much noisier than usual two cells may be taken to be \[-\].
const NOISES: [f64; 2] = [0.2, 5.0];

/// How far weights reach.
#[derive(Clone, Copy)]
enum Reach {
    /// For all cells \[m\].
    Even(f64),
    /// In proportion to the cells' noise \[m\], of those with the usual one.
    Noises(f64),
}

impl Reach {
    /// That of two cells so many times as noisy as usual \[m\].
    fn of_cells_m(self, noises: f64) -> f64 {
        match self {
            Self::Even(m) => m,
            Self::Noises(m) => m * noises,
        }
    }

    /// The farthest \[m\].
    fn farthest_m(self) -> f64 {
        self.of_cells_m(NOISES[1])
    }
}

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
    pub(super) fn descend(&self, from: &[Isometry3], reach_m: f64) -> Vec<Isometry3> {
        let mut poses = self.approached(from, reach_m);
        self.rest(&mut poses, Reach::Even(self.least_reach_m()), FINE_STRIDE);
        poses
    }

    /// The poses of its first, coarse steps.
    pub(super) fn approached(&self, from: &[Isometry3], mut reach_m: f64) -> Vec<Isometry3> {
        let mut poses = from.to_vec();
        while reach_m > self.least_reach_m() {
            self.step(&mut poses, Reach::Even(reach_m), STRIDE);
            reach_m *= SHRINKS;
        }
        poses
    }

    /// The least reach of even weights \[m\].
    pub(super) fn least_reach_m(&self) -> f64 {
        LEAST_REACH_M.max(2.0 * self.noise_m)
    }

    /// The poses by all cells, of which those count that lie as near as most.
    pub(super) fn finished(&self, mut poses: Vec<Isometry3>) -> Vec<Isometry3> {
        for _ in 0..MISFIT_ROUNDS {
            let misfit_m = usual_m(&fits(self.views, self.partners, &poses));
            let reach = Reach::Noises((LAST_MISFITS * misfit_m).max(AT_REST_M));
            self.rest(&mut poses, reach, 1);
        }
        poses
    }

    /// Steps until they move nothing, accelerated. Cells change their partners from step to step: a
    /// plain step takes off a small part of what is left where views share little.
    fn rest(&self, poses: &mut [Isometry3], reach: Reach, stride: usize) {
        let begun = poses.to_vec();
        let mut moved = vec![0.0; 6 * poses.len()];
        let mut mixer = Mixer::default();
        for _ in 0..LAST_ROUNDS {
            self.step(poses, reach, stride);
            let before = moved.clone();
            mixer.step(&mut moved, poses.iter().zip(&begun).flat_map(motion).collect());
            for ((pose, begun), by) in poses.iter_mut().zip(&begun).zip(moved.chunks_exact(6)) {
                let turn = Vector3::new(by[3], by[4], by[5]) / ARM_M;
                *pose = Isometry3::new(Vector3::new(by[0], by[1], by[2]), turn) * begun;
            }
            if moved.iter().zip(&before).all(|(now, before)| (now - before).abs() < AT_REST_M) {
                break;
            }
        }
    }

    /// One step of Gauss and Newton for all motions together.
    fn step(&self, poses: &mut [Isometry3], reach: Reach, stride: usize) {
        let (mut normal, right) = self.equations(poses, reach, stride);
        for &view in self.held {
            (6 * view..6 * view + 6).for_each(|k| normal[(k, k)] += HELD);
        }
        let Some(solved) = normal.cholesky().map(|factor| factor.solve(&right)) else {
            return;
        };
        for (pose, part) in poses.iter_mut().zip(solved.as_slice().chunks_exact(6)) {
            let shift = Vector3::new(part[0], part[1], part[2]);
            let turn = Vector3::new(part[3], part[4], part[5]);
            *pose = Isometry3::new(shift, turn) * *pose;
        }
    }

    /// The normal equations of all motions, six unknowns each: shift \[m\] and turn \[rad\].
    fn equations(
        &self,
        poses: &[Isometry3],
        reach: Reach,
        stride: usize,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let Self { views, partners, begun, noise_m, .. } = *self;
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
        let others =
            |(a, others): (usize, &Vec<usize>)| others.iter().map(move |&b| [a, b]).collect();
        let asked: Vec<[usize; 2]> =
            partners.iter().enumerate().flat_map::<Vec<_>, _>(others).collect();
        let parts: Vec<_> = asked
            .par_iter()
            .map(|&[a, b]| {
                let mut part = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
                for pair in
                    pairs(&views[a], &poses[a], &views[b], &poses[b], reach.farthest_m(), stride)
                {
                    let noises = noises(&pair, noise_m);
                    // After Geman and McClure.
                    let off = pair.off_m / reach.of_cells_m(noises);
                    let weight = (1.0 + off.powi(2)).powi(-2) / noises.powi(2);
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

    /// How far each view's points may still be off against the mean of all views, by their noise
    /// \[m\].
    pub(super) fn sigmas(&self, poses: &[Isometry3], fits: &[Fit]) -> Vec<f64> {
        let views = self.views;
        let misfit_m = usual_m(fits);
        let (mut normal, _) = self.equations(poses, Reach::Noises(3.0 * misfit_m), FINE_STRIDE);
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
                let at = (poses[view] * thinned.means[k]).coords;
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
}

/// What has moved a pose from where it began \[m\]: its shift, and its turn at the arm's length.
fn motion((pose, begun): (&Isometry3, &Isometry3)) -> [f64; 6] {
    let by = pose * begun.inverse();
    let (shift, turn) = (by.translation.vector, by.rotation.scaled_axis() * ARM_M);
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// How much noisier than usual two cells are \[-\].
fn noises(pair: &Pair, noise_m: f64) -> f64 {
    match pair.noise_m / noise_m {
        noises if noises.is_finite() => noises.clamp(NOISES[0], NOISES[1]),
        _ => 1.0,
    }
}

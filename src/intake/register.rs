//! Views of one scene that does not move, brought together.
//!
//! In: the points of each view \[m\], and poses that are right up to misses of some 20 mm and 5 degrees.
//! Out: better poses, how well each view lies on the others, and how well its place is known ([`Placed`]).
//!
//! Each view is thinned to the means of cells of 2 mm (4 mm of noisy sensors), each with the normal of its
//! neighbours. All poses are solved for together: each cell's mean is held against the nearest one of each
//! other view, point to plane with the mean of both normals (after Rusinkiewicz 2019, which is exact on
//! round things). The weights are Geman and McClure's; their reach shrinks from 50 mm to the views' own
//! noise. Cells are drawn evenly over the directions of their normals, so that a wide floor does not
//! outweigh the folds. A weak prior keeps a pose where the scene does not fix it, such as along a floor.
//! A view that began nearer to another fold lies worse than the others: it is placed anew, from twelve starts.
//! The last rounds count those cells alone that lie about as near as most.
//!
//! Where it fails: several views that all began nearer to other folds, which
//! [`Fit::misfit_m`] tells; a view with little in common with the others has a large
//! [`Placed::sigma_m`].

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, SymmetricEigen};
use rayon::prelude::*;

use crate::base::{Isometry3, Point3, Vector3};
use crate::geom::Neighbours;
use crate::numeric::robust::median;

/// How finely views are thinned.
#[derive(Clone, Copy)]
struct Fineness {
    /// Side of a cell \[m\]: a fold's radius is 10 mm and more.
    cell_m: f64,
    /// A cell's normal is that of the means within this \[m\].
    normal_within_m: f64,
    /// Two cells lie opposite if they are no farther than this beside each other \[m\].
    beside_m: f64,
}

const FINE: Fineness = Fineness { cell_m: 2e-3, normal_within_m: 5e-3, beside_m: 3e-3 };
/// Of views whose noise turns the normals of fine cells.
const COARSE: Fineness = Fineness { cell_m: 4e-3, normal_within_m: 9e-3, beside_m: 6e-3 };
/// Such noise: distance of a fine cell's neighbours from their plane, root mean square \[m\].
const ROUGH_M: f64 = 0.3e-3;
/// A normal is that of so many means at least.
const NORMAL_LEAST: usize = 6;
/// Cells of a view that are held against each other view.
const ASKED: usize = 4500;
/// Reach of the weights at first \[m\], of views that lie about right, and the least.
const REACH_M: f64 = 50e-3;
const FINE_REACH_M: f64 = 5e-3;
const LEAST_REACH_M: f64 = 1.5e-3;
/// The factor by which it shrinks.
const SHRINKS: f64 = 0.7;
/// Each so many-th of them while the reach shrinks, and where a count will do.
const STRIDE: usize = 9;
/// Each so many-th with the least reach.
const FINE_STRIDE: usize = 3;
/// In the last rounds, of all of them, the reach is so many misfits; and how many rounds that are.
const LAST_MISFITS: f64 = 2.5;
const MISFIT_ROUNDS: usize = 3;
/// Rounds with the least reach at most.
const LAST_ROUNDS: usize = 8;
/// No motion of more than this \[m\] in a round ends the search.
const AT_REST_M: f64 = 3e-5;
/// Two cells lie opposite only if their normals differ by no more than this \[cosine\].
const LEAST_COSINE: f64 = 0.7;
/// A cell is seen under no steeper angle than this \[cosine\].
const STEEPEST_COSINE: f64 = 0.2;
/// Standard deviations of the motions beforehand: shift \[m\], turn \[rad\].
const PRIOR: [f64; 2] = [30e-3, 0.15];
/// How the prior weighs against one cell's distance: the noise that a cell is taken to have \[m\].
const CELL_NOISE_M: f64 = 0.5e-3;
/// Views that share at least this in some poses may be meant to lie so \[-\].
pub(super) const LEAST_SHARED: f64 = 0.15;
/// Cells have something in common that lie within three times this of each other \[m\],
const COMMON_WITHIN_M: f64 = 10e-3;
/// and views that have this share of their cells in common, or more.
const LEAST_COMMON: f64 = 0.05;
/// How flat the means about a cell are, for it to be a sheet: variance across against along \[-\].
const FLAT: f64 = 0.3;
/// Cells whose noise is one cell's \[-\].
const CORRELATED: f64 = 9.0;
/// A cell is astray that lies this far off \[m\] and so many times the misfit.
const ASTRAY_M: f64 = 2e-3;
const ASTRAY: f64 = 4.0;
/// A view lies apart with more cells astray: 0.08 at most of views of one drape, 0.16 and more of two.
const MOST_ASTRAY: f64 = 0.1;
/// It also does if its misfit is so many times the usual one, and this more \[m\],
const APART: f64 = 3.0;
const APART_M: f64 = 0.3e-3;
/// or beyond this \[m\] and so many times the noise of single points, which is correlated: 8 for a D435.
const WORST_M: f64 = 2e-3;
const WORST_NOISES: f64 = 15.0;
/// A view is placed anew with more cells astray, or a misfit of so many times the usual one,
const STRAY_ASTRAY: f64 = 0.03;
const STRAY_MISFITS: f64 = 1.5;
/// from so far off \[m\], \[rad\], onto so many others,
const STARTS: [f64; 2] = [15e-3, 4.0_f64.to_radians()];
const ANCHORS: usize = 3;
/// where most of its cells lie within so many usual misfits.
const AGREEING_MISFITS: f64 = 3.0;
/// Weight that keeps a view where it is.
const HELD: f64 = 1e12;
/// What a turn moves, about \[m\].
const ARM_M: f64 = 0.3;
/// A view is held against so many others, those with which it has most in common.
const PARTNERS: usize = 8;

/// One view.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Its points in its own frame \[m\].
    pub points: &'a [Point3],
    /// Where its camera stood, in that frame; `None` for points that were fused.
    pub eye: Option<Point3>,
}

/// How a view lies on the others. A view that shares nothing has no misfit (NaN).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Share of the view's cells that lie opposite one of that other view of which this is most \[-\].
    pub shared: f64,
    /// Their distance from the other views' planes, robustly (1.48 of the median) \[m\]; NaN if none is shared.
    pub misfit_m: f64,
    /// Share of the view's cells opposite others' that lie much farther off than that \[-\].
    pub astray: f64,
}

/// A view that was brought to the others.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The common frame from the view's own.
    pub pose: Isometry3,
    /// How the view lay before,
    pub before: Fit,
    /// and how it lies now.
    pub after: Fit,
    /// Standard deviation of its points' places against the mean of all views \[m\].
    pub sigma_m: f64,
}

/// Why a view is not to be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It does not lie on the others: something has moved, or its pose was too far off.
    Apart,
    /// It shares too little with the others for its place to be known.
    Loose,
}

/// Views that can be held against each other in any poses.
pub struct Register {
    views: Vec<Arc<Thinned>>,
}

/// The mean of a cell's points, in the view's own frame.
#[derive(Clone, Copy, Debug)]
struct Surfel {
    at: Point3,
    /// To the camera, if that is known.
    normal: Vector3,
}

/// A view as it is registered.
struct Thinned {
    surfels: Vec<Surfel>,
    tree: Neighbours,
    /// The surfels that are held against other views.
    asked: Vec<usize>,
    has_eye: bool,
    noise_m: f64,
    /// Distance of a cell's neighbours from their plane, root mean square, of the middle cell \[m\].
    rough_m: f64,
    fineness: Fineness,
}

/// Two cells that lie opposite each other, common frame.
struct Pair {
    at: Point3,
    /// The mean of both normals.
    normal: Vector3,
    /// How far the first lies above the second along it \[m\].
    off_m: f64,
}

impl Register {
    /// Thins the views.
    #[must_use]
    pub fn new(views: &[View<'_>]) -> Self {
        let thinned = |fineness: Fineness| -> Vec<Arc<Thinned>> {
            views.par_iter().map(|view| Arc::new(Thinned::new(view, fineness))).collect()
        };
        let fine = thinned(FINE);
        let rough_m = median(fine.iter().map(|view| view.rough_m).collect()).unwrap_or(0.0);
        Self { views: if rough_m > ROUGH_M { thinned(COARSE) } else { fine } }
    }

    /// Some of the views.
    #[must_use]
    pub fn some(&self, which: &[usize]) -> Self {
        Self { views: which.iter().map(|&k| Arc::clone(&self.views[k])).collect() }
    }

    /// Noise of single points against the plane of their cell, of the middle view \[m\]; 0 if it is not seen.
    #[must_use]
    pub fn noise_m(&self) -> f64 {
        median(self.views.iter().map(|view| view.noise_m).collect()).unwrap_or(0.0)
    }

    /// The share of its cells that the middle view has in common with another one, in these poses.
    #[must_use]
    pub fn shared(&self, poses: &[Isometry3]) -> f64 {
        let of = |a: usize| {
            let others = (0..self.views.len()).filter(|&b| b != a);
            others.map(|b| common(&self.views, poses, a, b)).fold(0.0, f64::max)
        };
        median((0..self.views.len()).into_par_iter().map(of).collect()).unwrap_or(0.0)
    }

    /// Brings the views together from these poses on; a view that has nothing in common with others
    /// stays where it is.
    #[must_use]
    pub fn placed(&self, poses: &[Isometry3]) -> Vec<Placed> {
        let views = &self.views;
        // A map's coordinates would leave no digits for arms.
        let shift = Isometry3::from(-self.middle(poses).coords);
        let begun: Vec<Isometry3> = poses.iter().map(|pose| shift * pose).collect();
        let partners = partners(views, &begun);
        let before = fits(views, &partners, &begun);
        let all = Moving {
            views,
            partners: &partners,
            begun: &begun,
            held: &[],
            noise_m: self.noise_m(),
        };
        let ended = self.strays_placed(&all, all.descend(REACH_M));
        let partners = self::partners(views, &ended);
        let ended = Moving { partners: &partners, ..all }.finished(ended);
        let after = fits(views, &partners, &ended);
        let sigmas_m = sigmas(views, &partners, &begun, &ended, &after);
        let back = shift.inverse();
        let placed = |k: usize| Placed {
            pose: back * ended[k],
            before: before[k],
            after: after[k],
            sigma_m: sigmas_m[k],
        };
        (0..views.len()).map(placed).collect()
    }

    /// Brings the views together without those that lie apart, each of which pulls the others along, or are
    /// loose, each of which makes the mean of all unsure: the worst is left out, and again, until none is or half
    /// of them are. With each view whether it may be used.
    #[must_use]
    pub fn settled(&self, poses: &[Isometry3]) -> Vec<(Placed, Option<Unfit>)> {
        let judged = |placed: Vec<Placed>| {
            let faults = self.faults(&placed);
            placed.into_iter().zip(faults).collect::<Vec<_>>()
        };
        let mut settled = judged(self.placed(poses));
        let mut kept: Vec<usize> = (0..poses.len()).collect();
        loop {
            let worst_of = |fault: Unfit, how: fn(&Placed) -> f64| {
                let with = kept.iter().copied().filter(|&k| settled[k].1 == Some(fault));
                with.max_by(|&a, &b| how(&settled[a].0).total_cmp(&how(&settled[b].0)))
            };
            let worst = worst_of(Unfit::Apart, |view| view.after.astray)
                .or_else(|| worst_of(Unfit::Loose, |view| view.sigma_m));
            let Some(worst) = worst.filter(|_| kept.len() > 2.max(poses.len() / 2)) else {
                return settled;
            };
            kept.retain(|&k| k != worst);
            let rest: Vec<Isometry3> = kept.iter().map(|&k| poses[k]).collect();
            for (&k, again) in kept.iter().zip(judged(self.some(&kept).placed(&rest))) {
                settled[k] = again;
            }
        }
    }

    /// The poses, with each view that lies worse than the others placed anew: from several starts onto those that
    /// lie well, and then all together; as they were where that is no better.
    fn strays_placed(&self, all: &Moving<'_>, ended: Vec<Isometry3>) -> Vec<Isometry3> {
        let views = &self.views;
        let found = fits(views, &partners(views, &ended), &ended);
        let usual_m = usual_m(&found);
        let strays = |k: &usize| {
            let Fit { misfit_m, astray, .. } = found[*k];
            astray > STRAY_ASTRAY || misfit_m.is_nan() || misfit_m > STRAY_MISFITS * usual_m
        };
        let (mut strays, mut trusted): (Vec<usize>, Vec<usize>) =
            (0..views.len()).partition(strays);
        if strays.is_empty() || trusted.is_empty() {
            return ended;
        }
        strays.sort_by(|&a, &b| found[a].astray.total_cmp(&found[b].astray));
        let agreeing_m = AGREEING_MISFITS * usual_m;
        let mut poses = ended.clone();
        for k in strays {
            poses[k] = self.placed_on(&trusted, k, &poses, agreeing_m);
            trusted.push(k);
        }
        let partners = partners(views, &poses);
        let again = Moving { partners: &partners, ..*all }.descend_from(&poses, FINE_REACH_M);
        let agreeing = |poses: &[Isometry3]| -> f64 {
            (0..views.len()).map(|k| agreeing(views, poses, k, agreeing_m)).sum()
        };
        if agreeing(&again) > agreeing(&ended) { again } else { ended }
    }

    /// The pose in which a view lies best on some others, found from several starts about where it is.
    fn placed_on(
        &self,
        others: &[usize],
        view: usize,
        poses: &[Isometry3],
        agreeing_m: f64,
    ) -> Isometry3 {
        let mut others = others.to_vec();
        let share = |&b: &usize| common(&self.views, poses, view, b);
        others.sort_by(|a, b| share(b).total_cmp(&share(a)));
        others.truncate(ANCHORS);
        let last = others.len();
        others.push(view);
        let some = self.some(&others);
        let anchored: Vec<usize> = (0..last).collect();
        let mut partners: Vec<Vec<usize>> = vec![vec![last]; last];
        partners.push(anchored.clone());
        let stays: Vec<Isometry3> = others.iter().map(|&k| poses[k]).collect();
        let scored =
            |ended: &[Isometry3]| (agreeing(&some.views, ended, last, agreeing_m), ended[last]);
        let from = |motion: &Isometry3| {
            let mut begun = stays.clone();
            begun[last] = motion * begun[last];
            let moving = Moving {
                views: &some.views,
                partners: &partners,
                begun: &begun,
                held: &anchored,
                noise_m: self.noise_m(),
            };
            scored(&moving.descend(REACH_M))
        };
        let middle = self.some(&[view]).middle(&[poses[view]]);
        let found: Vec<(f64, Isometry3)> = starts(&middle).par_iter().map(from).collect();
        let better = |best: (f64, Isometry3), next: (f64, Isometry3)| {
            if next.0 > best.0 { next } else { best }
        };
        found.into_iter().fold(scored(&stays), better).1
    }

    /// Which views are not to be used, of some that were placed together.
    fn faults(&self, placed: &[Placed]) -> Vec<Option<Unfit>> {
        let fits: Vec<Fit> = placed.iter().map(|view| view.after).collect();
        let usual_m = usual_m(&fits);
        let worst_m = WORST_M.max(WORST_NOISES * self.noise_m());
        let most_m = (APART * usual_m + APART_M).min(worst_m);
        let of = |view: &Placed| match view.after.misfit_m {
            misfit_m if misfit_m > most_m || view.after.astray > MOST_ASTRAY => Some(Unfit::Apart),
            misfit_m if view.sigma_m < misfit_m => None,
            _ => Some(Unfit::Loose),
        };
        placed.iter().map(of).collect()
    }

    /// The middle of all views in these poses.
    fn middle(&self, poses: &[Isometry3]) -> Point3 {
        let all = || self.views.iter().zip(poses);
        let of = |(view, pose): (&Arc<Thinned>, &Isometry3)| -> Vector3 {
            view.asked.iter().map(|&k| (pose * view.surfels[k].at).coords).sum()
        };
        let count: usize = all().map(|(view, _)| view.asked.len()).sum();
        Point3::from(all().map(of).sum::<Vector3>() / count.max(1) as f64)
    }
}

/// Motions about a point from which a stray view is looked for.
fn starts(middle: &Point3) -> Vec<Isometry3> {
    let [shift_m, turn_rad] = STARTS;
    let about = Isometry3::from(middle.coords);
    let of = |k: usize| {
        let mut along = Vector3::zeros();
        along[k % 3] = if k < 3 { 1.0 } else { -1.0 };
        let turn = Isometry3::new(Vector3::zeros(), along * turn_rad);
        [Isometry3::from(along * shift_m), about * turn * about.inverse()]
    };
    (0..6).flat_map(of).collect()
}

/// The usual misfit of some views \[m\]; 0 where none is known.
fn usual_m(fits: &[Fit]) -> f64 {
    let known = fits.iter().map(|fit| fit.misfit_m).filter(|m| m.is_finite());
    median(known.collect()).unwrap_or(0.0)
}

/// The share of the cells of view `a` that lie this near to those of other views, summed over those \[-\].
fn agreeing(views: &[Arc<Thinned>], poses: &[Isometry3], a: usize, within_m: f64) -> f64 {
    let of = |b: usize| {
        pairs(&views[a], &poses[a], &views[b], &poses[b], within_m / 3.0, STRIDE).count()
    };
    let found: usize = (0..views.len()).filter(|&b| b != a).map(of).sum();
    found as f64 / views[a].asked.len().div_ceil(STRIDE).max(1) as f64
}

/// Views on their way onto one another.
#[derive(Clone, Copy)]
struct Moving<'a> {
    views: &'a [Arc<Thinned>],
    /// The views against which each is held.
    partners: &'a [Vec<usize>],
    /// The poses given.
    begun: &'a [Isometry3],
    /// Views that stay.
    held: &'a [usize],
    noise_m: f64,
}

impl Moving<'_> {
    /// The poses in which the views lie on one another best.
    fn descend(&self, reach_m: f64) -> Vec<Isometry3> {
        self.descend_from(self.begun, reach_m)
    }

    fn descend_from(&self, from: &[Isometry3], mut reach_m: f64) -> Vec<Isometry3> {
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
    fn finished(&self, mut poses: Vec<Isometry3>) -> Vec<Isometry3> {
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
fn sigmas(
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

/// Of the cells of `a` that are asked for each `stride`th that lies opposite one of `b`, no farther off
/// than three reaches.
fn pairs(
    a: &Thinned,
    a_pose: &Isometry3,
    b: &Thinned,
    b_pose: &Isometry3,
    reach_m: f64,
    stride: usize,
) -> impl Iterator<Item = Pair> {
    let b_from_a = b_pose.inv_mul(a_pose);
    let beside_m = b.fineness.beside_m;
    let both_eyes = a.has_eye && b.has_eye;
    a.asked.iter().step_by(stride).filter_map(move |&k| {
        let surfel = &a.surfels[k];
        let (at, normal) = (b_from_a * surfel.at, b_from_a * surfel.normal);
        let nearest = b.tree.one(&at).filter(|near| near.distance() < 3.0 * reach_m + beside_m)?;
        let other = &b.surfels[nearest.index];
        let cosine = normal.dot(&other.normal);
        let sign = if both_eyes { 1.0 } else { cosine.signum() };
        if cosine * sign < LEAST_COSINE {
            return None;
        }
        let mean = (normal * sign + other.normal).normalize();
        let offset = at - other.at;
        let off_m = offset.dot(&mean);
        let off_beside_m = (offset - mean * off_m).norm();
        (off_beside_m < beside_m && off_m.abs() < 3.0 * reach_m).then(|| Pair {
            at: a_pose * surfel.at,
            normal: b_pose * mean,
            off_m,
        })
    })
}

/// The share of the cells of view `a` that it has in common with view `b`.
fn common(views: &[Arc<Thinned>], poses: &[Isometry3], a: usize, b: usize) -> f64 {
    let found = pairs(&views[a], &poses[a], &views[b], &poses[b], COMMON_WITHIN_M, STRIDE);
    found.count() as f64 / views[a].asked.len().div_ceil(STRIDE).max(1) as f64
}

/// For each view the others with which it has most in common, and at least a little.
fn partners(views: &[Arc<Thinned>], poses: &[Isometry3]) -> Vec<Vec<usize>> {
    let of = |a: usize| {
        let others = (0..views.len()).filter(|&b| b != a);
        let shares = others.map(|b| (common(views, poses, a, b), b));
        let mut others: Vec<(f64, usize)> =
            shares.filter(|(share, _)| *share > LEAST_COMMON).collect();
        others.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        others.into_iter().take(PARTNERS).map(|(_, b)| b).collect()
    };
    (0..views.len()).into_par_iter().map(of).collect()
}

/// How each view lies on its partners.
fn fits(views: &[Arc<Thinned>], partners: &[Vec<usize>], poses: &[Isometry3]) -> Vec<Fit> {
    let of = |a: usize| {
        let mut off_m = Vec::new();
        let mut most = 0;
        for &b in &partners[a] {
            let before = off_m.len();
            let found =
                pairs(&views[a], &poses[a], &views[b], &poses[b], COMMON_WITHIN_M, FINE_STRIDE);
            off_m.extend(found.map(|pair| pair.off_m.abs()));
            most = most.max(off_m.len() - before);
        }
        let shared = most as f64 / views[a].asked.len().div_ceil(FINE_STRIDE).max(1) as f64;
        let misfit_m = 1.4826 * median(off_m.clone()).unwrap_or(f64::NAN);
        let far_m = ASTRAY_M.max(ASTRAY * misfit_m);
        let astray = off_m.iter().filter(|&&off_m| off_m > far_m).count();
        Fit { shared, misfit_m, astray: astray as f64 / off_m.len().max(1) as f64 }
    };
    (0..views.len()).into_par_iter().map(of).collect()
}

impl Thinned {
    fn new(view: &View<'_>, fineness: Fineness) -> Self {
        let origin = view.points.first().copied().unwrap_or_default().coords;
        let cells = cells(view.points, &origin, fineness.cell_m);
        let means: Vec<Point3> = cells.iter().map(Cell::mean).collect();
        let tree = Neighbours::new(&means);
        let fitted: Vec<Option<(Surfel, [f64; 2])>> = cells
            .par_iter()
            .zip(&means)
            .map(|(cell, at)| {
                let near = tree.within(at, fineness.normal_within_m);
                let near: Vec<Point3> = near.iter().map(|&k| means[k]).collect();
                let (normal, rough_m) = plane(&near)?;
                let normal = match view.eye.map(|eye| (eye - origin - at).normalize().dot(&normal))
                {
                    Some(cosine) if cosine.abs() < STEEPEST_COSINE => return None,
                    Some(cosine) => normal * cosine.signum(),
                    None => normal,
                };
                Some((Surfel { at: at + origin, normal }, [cell.noise_m(&normal), rough_m]))
            })
            .collect();
        let (surfels, noises): (Vec<Surfel>, Vec<[f64; 2]>) = fitted.into_iter().flatten().unzip();
        let tree = Neighbours::new(&surfels.iter().map(|surfel| surfel.at).collect::<Vec<_>>());
        let asked = evenly(&surfels);
        // A cell of one point says nothing of noise.
        let [noise_m, rough_m] = [0, 1].map(|of| {
            let known = noises.iter().map(|noise| noise[of]).filter(|&m| m > 0.0);
            median(known.collect()).unwrap_or(0.0)
        });
        Self { surfels, tree, asked, has_eye: view.eye.is_some(), noise_m, rough_m, fineness }
    }
}

/// The points of one cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: f64,
    sum: Vector3,
    squares: Matrix3<f64>,
}

impl Cell {
    fn mean(&self) -> Point3 {
        Point3::from(self.sum / self.count)
    }

    /// Standard deviation of its points along a normal \[m\]; 0 of a single one.
    fn noise_m(&self, normal: &Vector3) -> f64 {
        let mean = self.sum / self.count;
        let spread = self.squares - mean * mean.transpose() * self.count;
        (normal.dot(&(spread * normal)) / (self.count - 1.0).max(1.0)).max(0.0).sqrt()
    }
}

/// The cells of some points, in the order of their first points.
fn cells(points: &[Point3], origin: &Vector3, cell_m: f64) -> Vec<Cell> {
    let mut index: HashMap<[i32; 3], usize> = HashMap::new();
    let mut cells: Vec<Cell> = Vec::new();
    for point in points {
        let at = point.coords - origin;
        let key = [0, 1, 2].map(|k| (at[k] / cell_m).floor() as i32);
        let place = *index.entry(key).or_insert(cells.len());
        if place == cells.len() {
            cells.push(Cell::default());
        }
        let cell = &mut cells[place];
        cell.count += 1.0;
        cell.sum += at;
        cell.squares += at * at.transpose();
    }
    cells
}

/// The normal of the plane through some points, and their distance from it, root mean square \[m\]; `None`
/// where they are few, or no sheet.
fn plane(points: &[Point3]) -> Option<(Vector3, f64)> {
    if points.len() < NORMAL_LEAST {
        return None;
    }
    let mean = points.iter().map(|point| point.coords).sum::<Vector3>() / points.len() as f64;
    let spread = |sum: Matrix3<f64>, point: &Point3| {
        let off = point.coords - mean;
        sum + off * off.transpose()
    };
    let eigen = SymmetricEigen::new(points.iter().fold(Matrix3::zeros(), spread));
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [least, middle, _] = order;
    let flat = eigen.eigenvalues[least] < FLAT * eigen.eigenvalues[middle];
    let rough_m = (eigen.eigenvalues[least].max(0.0) / points.len() as f64).sqrt();
    flat.then(|| (eigen.eigenvectors.column(least).into_owned(), rough_m))
}

/// Some surfels, even over the directions of their normals.
fn evenly(surfels: &[Surfel]) -> Vec<usize> {
    let mut bins: Vec<Vec<usize>> = vec![Vec::new(); 6 * 9];
    for (k, surfel) in surfels.iter().enumerate() {
        let axis = surfel.normal.iamax();
        let sign = surfel.normal[axis];
        let third = |c: f64| (((c / sign.abs() + 1.0) * 1.5).floor() as usize).min(2);
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|k| third(surfel.normal[k]));
        bins[9 * (2 * axis + usize::from(sign > 0.0)) + 3 * u + v].push(k);
    }
    // The most of each bin with which there are not too many.
    let kept = |most: usize| bins.iter().map(|bin| bin.len().min(most)).sum::<usize>();
    let most = (1..=ASKED).rev().find(|&most| kept(most) <= ASKED).unwrap_or(1);
    let strided = |bin: &Vec<usize>| {
        let count = bin.len().min(most);
        let place = |k: usize| bin[k * bin.len() / count];
        (0..count).map(place).collect::<Vec<_>>()
    };
    bins.iter().flat_map(strided).collect()
}

//! Views of one scene that does not move, brought together.
//!
//! In: the points of each view \[m\], and poses that are right up to misses of some 20 mm and 5
//! degrees. Out: better poses, how well each view lies on the others, and how well its place is
//! known ([`Placed`]).
//!
//! Each view is thinned to the means of cells of 2 mm (4 mm of noisy sensors), each with the normal
//! of its neighbours. All poses are solved for together: each cell's mean is held against the
//! nearest one of each other view, point to plane with the mean of both normals (after Rusinkiewicz
//! 2019, which is exact on round things). The weights are Geman and McClure's; their reach shrinks
//! from 50 mm to the views' own noise, which the last rounds weigh cells by. Steps are accelerated
//! until they rest. Cells are drawn evenly over the directions of their normals, so that a wide
//! floor does not outweigh the folds. A weak prior keeps a pose where the scene does not fix it,
//! such as along a floor. Views that lie badly on the largest group that agrees are placed anew
//! (`strays`). The last rounds count those cells alone that lie about as near as most.
//!
//! A view is told apart by its pairs (`pairings`): the cells that it shares with each other view
//! lie as near as those of most pairs, or one of the two is wrong. Pairs that lie badly say nothing
//! of places, so that a view, or a group of views, that shares little else has a large
//! [`Placed::sigma_m`].

mod fit;
mod moving;
mod pairings;
mod strays;
mod thinned;

use std::sync::Arc;

use rayon::prelude::*;

use crate::base::{Isometry3, Point3, Vector3};
use crate::io::{Format, SeenView};
use crate::numeric::robust::median;
use fit::{common, fits, partners, usual_m};
use moving::Moving;
use pairings::Pairings;
use thinned::{COARSE, FINE, Fineness, Thinned};

pub use fit::Fit;
pub use thinned::View;

/// Views are noisy from here on: distance of a fine cell's neighbours from their plane, root mean
/// square \[m\].
const ROUGH_M: f64 = 0.3e-3;
/// Reach of the weights at first \[m\], and of views that lie about right.
const REACH_M: f64 = 50e-3;
const FINE_REACH_M: f64 = 5e-3;
/// Views that share at least this in some poses may be meant to lie so \[-\].
pub(super) const LEAST_SHARED: f64 = 0.15;
/// A view lies apart with more cells astray: 0.08 at most of views of one drape, 0.16 and more of
/// two.
const MOST_ASTRAY: f64 = 0.1;
/// It also does if its misfit is so many times the usual one, and this more \[m\],
const APART: f64 = 3.0;
const APART_M: f64 = 0.3e-3;
/// or beyond this \[m\] and so many times the noise of single points, which is correlated: 8 for a
/// D435.
const WORST_M: f64 = 2e-3;
const WORST_NOISES: f64 = 15.0;

/// A view that was brought to the others.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The common frame from the view's own.
    pub pose: Isometry3,
    /// How the view lay before,
    pub before: Fit,
    /// and how it lies now.
    pub after: Fit,
    /// Other views on which it lies so badly that one of the two must be wrong.
    pub conflicts: usize,
    /// Whether pairs that lie well, and share more than a floor, bind it to the largest group.
    pub bound: bool,
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

    /// Of views as they were read, each in its own frame.
    #[must_use]
    pub fn of(views: &[SeenView]) -> Self {
        // A depth image is seen from its frame's origin; where a cloud was seen from nobody says.
        let eye =
            |seen: &SeenView| (seen.notes.format == Some(Format::DepthPng)).then(Point3::origin);
        let views: Vec<View<'_>> =
            views.iter().map(|seen| View { points: &seen.cloud.points, eye: eye(seen) }).collect();
        Self::new(&views)
    }

    /// Some of the views.
    #[must_use]
    pub fn some(&self, which: &[usize]) -> Self {
        Self { views: which.iter().map(|&k| Arc::clone(&self.views[k])).collect() }
    }

    /// Noise of single points against the plane of their cell, of the middle view \[m\]; 0 if it is
    /// not seen.
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
        self.brought(poses, poses, REACH_M)
    }

    /// Brings views that began in some poses together, from others on; the weights reach so far at
    /// first.
    fn brought(&self, begun: &[Isometry3], from: &[Isometry3], reach_m: f64) -> Vec<Placed> {
        let views = &self.views;
        // A map's coordinates would leave no digits for arms.
        let shift = Isometry3::from(-self.middle(begun).coords);
        let [begun, from] = [begun, from]
            .map(|poses| -> Vec<Isometry3> { poses.iter().map(|pose| shift * pose).collect() });
        let before = fits(views, &partners(views, &begun), &begun);
        let partners = partners(views, &from);
        let all = Moving {
            views,
            partners: &partners,
            begun: &begun,
            held: &[],
            noise_m: self.noise_m(),
        };
        let ended = self.strays_placed(&all, all.descend(&from, reach_m));
        let partners = self::partners(views, &ended);
        let moving = Moving { partners: &partners, ..all };
        let ended = moving.finished(ended);
        let after = fits(views, &partners, &ended);
        // Views that lie badly on each other say nothing of their places.
        let pairings = Pairings::new(views, &partners, &ended);
        let good = Moving { partners: &pairings.good_partners(), ..moving };
        let sigmas_m = good.sigmas(&ended, &after);
        let (conflicts, group) = (pairings.conflicts(), pairings.largest_group());
        let back = shift.inverse();
        let placed = |k: usize| Placed {
            pose: back * ended[k],
            before: before[k],
            after: after[k],
            conflicts: conflicts[k],
            bound: group.contains(&k),
            sigma_m: sigmas_m[k],
        };
        (0..views.len()).map(placed).collect()
    }

    /// Of two views the second in the first one's frame, from a pose there on; and how it then
    /// lies.
    pub(super) fn second(&self, pose: &Isometry3) -> (Isometry3, Placed) {
        let placed = self.placed(&[Isometry3::identity(), *pose]);
        let [first, second] = placed[..] else { unreachable!("two views were placed") };
        (first.pose.inverse() * second.pose, second)
    }

    /// Brings the views together without those that lie apart, each of which pulls the others
    /// along, or are loose, each of which makes the mean of all unsure: the worst is left out, and
    /// again, until none is or half of them are. With each view whether it may be used.
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
            let worst = worst_of(Unfit::Apart, |view| view.conflicts as f64 + view.after.astray)
                .or_else(|| worst_of(Unfit::Loose, |view| f64::from(!view.bound) + view.sigma_m));
            let Some(worst) = worst.filter(|_| kept.len() > 2.max(poses.len() / 2)) else {
                return settled;
            };
            kept.retain(|&k| k != worst);
            let begun: Vec<Isometry3> = kept.iter().map(|&k| poses[k]).collect();
            let from: Vec<Isometry3> = kept.iter().map(|&k| settled[k].0.pose).collect();
            let again = judged(self.some(&kept).brought(&begun, &from, FINE_REACH_M));
            for (&k, again) in kept.iter().zip(again) {
                settled[k] = again;
            }
        }
    }

    /// Which views are not to be used, of some that were placed together.
    fn faults(&self, placed: &[Placed]) -> Vec<Option<Unfit>> {
        let fits: Vec<Fit> = placed.iter().map(|view| view.after).collect();
        let usual_m = usual_m(&fits);
        let worst_m = WORST_M.max(WORST_NOISES * self.noise_m());
        let most_m = (APART * usual_m + APART_M).min(worst_m);
        let of = |view: &Placed| match view.after.misfit_m {
            misfit_m if misfit_m > most_m || view.after.astray > MOST_ASTRAY => Some(Unfit::Apart),
            _ if view.conflicts > 0 => Some(Unfit::Apart),
            misfit_m if view.bound && view.sigma_m < misfit_m.max(usual_m) => None,
            _ => Some(Unfit::Loose),
        };
        placed.iter().map(of).collect()
    }

    /// The middle of all views in these poses.
    fn middle(&self, poses: &[Isometry3]) -> Point3 {
        let all = || self.views.iter().zip(poses);
        let of = |(view, pose): (&Arc<Thinned>, &Isometry3)| -> Vector3 {
            view.asked.iter().map(|&k| (pose * view.means[k]).coords).sum()
        };
        let count: usize = all().map(|(view, _)| view.asked.len()).sum();
        Point3::from(all().map(of).sum::<Vector3>() / count.max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::M_PER_MM;

    #[test]
    fn a_view_that_began_nearer_to_another_fold_is_placed_anew() {
        let path =
            format!("{}/fixtures/scans/mean_structured-light.ply", env!("CARGO_MANIFEST_DIR"));
        let mut points = crate::io::read_scan(path).unwrap().0.points;
        points.iter_mut().for_each(|p| *p *= M_PER_MM);
        let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
        let part = |k: usize| -> Vec<Point3> {
            let angle = k as f64 * std::f64::consts::TAU / 6.0;
            let toward = Vector3::new(angle.cos(), angle.sin(), 0.3);
            let seen = |p: &&Point3| (*p - middle).coords.angle(&toward) < 1.4;
            points.iter().filter(seen).copied().collect()
        };
        let parts: Vec<Vec<Point3>> = (0..6).map(part).collect();
        let views: Vec<View<'_>> = parts.iter().map(|points| View { points, eye: None }).collect();
        let register = Register::new(&views);
        // A miss of 20 mm and 8 degrees.
        let about = Isometry3::from(middle);
        let turn = Vector3::new(-0.572, -0.569, 0.590).normalize() * 8.0_f64.to_radians();
        let shift = Vector3::new(0.822, -0.570, 0.014).normalize() * 20e-3;
        let mut begun = vec![Isometry3::identity(); 6];
        begun[4] = Isometry3::from(shift)
            * about
            * Isometry3::new(Vector3::zeros(), turn)
            * about.inverse();
        let off_mm = |poses: &[Isometry3]| {
            let by = poses[0].inverse() * poses[4];
            let off = parts[4].iter().map(|p| (by * p - p).norm() / M_PER_MM);
            off.sum::<f64>() / parts[4].len() as f64
        };
        let all = Moving {
            views: &register.views,
            partners: &partners(&register.views, &begun),
            begun: &begun,
            held: &[],
            noise_m: register.noise_m(),
        };
        let ended = all.descend(&begun, REACH_M);
        assert!(off_mm(&ended) > 20.0, "{}", off_mm(&ended));
        let settled = register.settled(&begun);
        // Two of the others are loose, as the miss is larger than what is promised.
        assert_eq!([settled[0].1, settled[4].1], [None; 2]);
        let poses: Vec<Isometry3> = settled.iter().map(|(view, _)| view.pose).collect();
        assert!(off_mm(&poses) < 0.05, "{}", off_mm(&poses));
    }
}

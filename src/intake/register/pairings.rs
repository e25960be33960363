//! How views lie on each other pair by pair, and which of them agree.

use std::sync::Arc;

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

use super::fit::{ASTRAY, ASTRAY_M, COMMON_WITHIN_M, NEAREST_M, robust_misfit_m};
use super::thinned::{FINE_STRIDE, Thinned, pairs};
use crate::base::Isometry3;
use crate::numeric::robust::quantile;

/// A pair with fewer cells opposite each other says nothing.
const LEAST_CELLS: usize = 80;
/// The usual misfit is that of this share of the pairs: more than half may lie wrong.
const USUAL: f64 = 0.25;
/// A pair lies well with at most so many cells astray \[-\], and a misfit of so many usual ones:
/// right ones have 0.09 and 1.5 at most, two groups 11 mm apart 0.17 and 2.0.
const MOST_ASTRAY: f64 = 0.08;
const MOST_MISFITS: f64 = 1.5;
/// A pair says something if its cells' normals have this mean square along any direction \[-\]: one
/// that shares the floor alone may lie badly where that is seen at a grazing angle.
const LEAST_SPREAD: f64 = 0.03;
/// It holds its views in place from this on: each right view has a pair of 0.06 and more, one that
/// slid along the floor none above 0.035.
const HOLDING_SPREAD: f64 = 0.045;
/// Of two views that share so many cells one must be wrong with more astray \[-\], or a misfit of
/// more usual ones.
const CONFLICT_CELLS: usize = 200;
const CONFLICT_ASTRAY: f64 = 0.12;
const CONFLICT_MISFITS: f64 = 2.1;

/// How two views lie on each other.
#[derive(Clone, Copy, Debug)]
struct Pairing {
    views: [usize; 2],
    /// Cells opposite each other.
    cells: usize,
    /// Their distance from each other's planes, robustly (1.48 of the median) \[m\].
    misfit_m: f64,
    /// Share of them that lie much farther off \[-\].
    astray: f64,
    /// Least mean square of their normals along a direction \[-\].
    spread: f64,
}

/// All pairs of views that have something in common.
pub(super) struct Pairings {
    pairings: Vec<Pairing>,
    count: usize,
    usual_m: f64,
}

impl Pairings {
    pub(super) fn new(
        views: &[Arc<Thinned>],
        partners: &[Vec<usize>],
        poses: &[Isometry3],
    ) -> Self {
        let both = |a: usize| partners[a].iter().map(move |&b| [a.min(b), a.max(b)]);
        let mut asked: Vec<[usize; 2]> = (0..views.len()).flat_map(both).collect();
        asked.sort_unstable();
        asked.dedup();
        let opposite = |[a, b]: [usize; 2]| {
            pairs(&views[a], &poses[a], &views[b], &poses[b], COMMON_WITHIN_M, FINE_STRIDE)
        };
        let cells: Vec<(Vec<f64>, Matrix3<f64>)> = asked
            .par_iter()
            .map(|&[a, b]| {
                let mut normals = Matrix3::zeros();
                let off_m = opposite([a, b]).chain(opposite([b, a])).map(|pair| {
                    normals += pair.normal * pair.normal.transpose();
                    pair.off_m.abs()
                });
                (off_m.collect(), normals)
            })
            .collect();
        let known = cells.iter().filter(|(off_m, _)| off_m.len() >= LEAST_CELLS);
        let known = known.map(|(off_m, _)| robust_misfit_m(off_m));
        let usual_m = quantile(known.collect(), USUAL).unwrap_or(0.0).max(NEAREST_M);
        let far_m = ASTRAY_M.max(ASTRAY * usual_m);
        let pairing = |(&views, (off_m, normals)): (&[usize; 2], &(Vec<f64>, Matrix3<f64>))| {
            let cells = off_m.len();
            let astray = off_m.iter().filter(|&&off_m| off_m > far_m).count();
            let least = SymmetricEigen::new(*normals).eigenvalues.min();
            let share = |of: f64| of / cells.max(1) as f64;
            let (astray, spread) = (share(astray as f64), share(least));
            Pairing { views, cells, misfit_m: robust_misfit_m(off_m), astray, spread }
        };
        let pairings = asked.iter().zip(&cells).map(pairing).collect();
        Self { pairings, count: views.len(), usual_m }
    }

    fn lies_well(&self, pairing: &Pairing) -> bool {
        pairing.astray <= MOST_ASTRAY && pairing.misfit_m <= MOST_MISFITS * self.usual_m
    }

    /// Pairs that say something, and lie well or do not.
    fn that_lie(&self, well: bool) -> impl Iterator<Item = &Pairing> {
        let known = self.pairings.iter().filter(|pairing| pairing.cells >= LEAST_CELLS);
        known.filter(move |pairing| self.lies_well(pairing) == well)
    }

    /// For each view those that lie well on it.
    pub(super) fn good_partners(&self) -> Vec<Vec<usize>> {
        let mut partners = vec![Vec::new(); self.count];
        for &Pairing { views: [a, b], .. } in self.that_lie(true) {
            partners[a].push(b);
            partners[b].push(a);
        }
        partners
    }

    /// The largest group of views that hold one another in place.
    pub(super) fn largest_group(&self) -> Vec<usize> {
        let groups = (0..self.count).rev().map(|k| self.bound_to(k, &[]));
        groups.max_by_key(Vec::len).unwrap_or_default()
    }

    /// That group without the views that lie badly on others of it.
    pub(super) fn agreeing(&self) -> Vec<usize> {
        let mut agreeing = self.largest_group();
        loop {
            let bad = |k: &usize| {
                let bad = self.that_lie(false).filter(|pairing| pairing.spread >= LEAST_SPREAD);
                let within = bad.map(|pairing| pairing.views).filter(|of| of.contains(k));
                within.filter(|of| of.iter().all(|k| agreeing.contains(k))).count()
            };
            match agreeing.iter().copied().max_by_key(bad) {
                Some(worst) if bad(&worst) > 0 => agreeing.retain(|&k| k != worst),
                _ => return agreeing,
            }
        }
    }

    /// The views that a view holds in place, itself among them, directly or by others, but not by
    /// some.
    pub(super) fn bound_to(&self, view: usize, without: &[usize]) -> Vec<usize> {
        let mut bound = vec![view];
        let mut next = 0;
        while let Some(&at) = bound.get(next) {
            for pairing in self.that_lie(true).filter(|pairing| pairing.spread >= HOLDING_SPREAD) {
                let [a, b] = pairing.views;
                let other = if a == at { b } else { a };
                let new = !bound.contains(&other) && !without.contains(&other);
                if pairing.views.contains(&at) && new {
                    bound.push(other);
                }
            }
            next += 1;
        }
        bound
    }

    /// For each view on how many others it lies so badly that one of the two must be wrong.
    pub(super) fn conflicts(&self) -> Vec<usize> {
        let wrong = |pairing: &&Pairing| {
            pairing.cells >= CONFLICT_CELLS
                && pairing.spread >= LEAST_SPREAD
                && (pairing.astray > CONFLICT_ASTRAY
                    || pairing.misfit_m > CONFLICT_MISFITS * self.usual_m)
        };
        let mut conflicts = vec![0; self.count];
        for pairing in self.pairings.iter().filter(wrong) {
            pairing.views.iter().for_each(|&k| conflicts[k] += 1);
        }
        conflicts
    }
}

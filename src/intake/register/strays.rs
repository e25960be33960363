//! Views that lie badly on the others, placed anew.

use rayon::prelude::*;

use super::fit::{NEAREST_M, agreeing, common, fits, partners, usual_m};
use super::moving::Moving;
use super::pairings::Pairings;
use super::{FINE_REACH_M, REACH_M, Register};
use crate::base::{Isometry3, Point3, Vector3};

/// A view is looked for from so far off \[m\], or turned so far \[rad\], onto so many others,
const STARTS: [f64; 3] = [15e-3, 4.0_f64.to_radians(), 9.0_f64.to_radians()];
const ANCHORS: usize = 3;
/// and the best starts are followed on to where its cells lie nearest.
const FOLLOWED: usize = 12;

impl Register {
    /// The poses, with each view that does not lie well on the largest group of others placed anew:
    /// from several starts onto the group, which grows, and then all together; as they were where
    /// that is no better.
    pub(super) fn strays_placed(&self, all: &Moving<'_>, ended: Vec<Isometry3>) -> Vec<Isometry3> {
        let views = &self.views;
        let partners = self::partners(views, &ended);
        let agreeing_reach_m = usual_m(&fits(views, &partners, &ended)).max(NEAREST_M);
        let mut poses = ended.clone();
        let mut tried = Vec::new();
        loop {
            let partners = self::partners(views, &poses);
            let pairings = Pairings::new(views, &partners, &poses);
            let trusted = pairings.agreeing();
            let stray = |k: &usize| !trusted.contains(k) && !tried.contains(k);
            let in_common =
                |k: usize| -> f64 { trusted.iter().map(|&b| common(views, &poses, k, b)).sum() };
            let strays = (0..views.len()).filter(stray).map(|k| (in_common(k), k));
            let next = strays.max_by(|(a, _), (b, _)| a.total_cmp(b));
            let Some((_, next)) = next.filter(|_| trusted.len() > 1) else { break };
            tried.push(next);
            let (begun, from) = (&all.begun[next], poses[next]);
            let placed = self.placed_on(&trusted, next, &poses, begun, agreeing_reach_m);
            // Those that lie well on it come along.
            let motion = placed * from.inverse();
            for k in pairings.bound_to(next, &trusted) {
                poses[k] = motion * poses[k];
            }
        }
        if tried.is_empty() {
            return ended;
        }
        let partners = self::partners(views, &poses);
        let again = Moving { partners: &partners, ..*all }.descend(&poses, FINE_REACH_M);
        let agreeing = |poses: &[Isometry3]| -> f64 {
            (0..views.len()).map(|k| agreeing(views, poses, k, agreeing_reach_m)).sum()
        };
        if agreeing(&again) > agreeing(&ended) { again } else { ended }
    }

    /// The pose in which a view lies best on some others, found from several starts about where it
    /// is and where it began: a view can slide far on the way.
    fn placed_on(
        &self,
        others: &[usize],
        view: usize,
        poses: &[Isometry3],
        begun: &Isometry3,
        agreeing_reach_m: f64,
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
        let moving = Moving {
            views: &some.views,
            partners: &partners,
            begun: &stays,
            held: &anchored,
            noise_m: self.noise_m(),
        };
        let own = self.some(&[view]);
        let about = |pose: &Isometry3| -> Vec<Isometry3> {
            starts(&own.middle(&[*pose])).iter().map(|motion| motion * pose).collect()
        };
        let at = |pose: &Isometry3| [&stays[..last], &[*pose]].concat();
        let scored = |ended: Vec<Isometry3>, reach_m: f64| {
            (agreeing(&some.views, &ended, last, reach_m), ended[last])
        };
        // The starts that lead to the best places, roughly, are followed to their ends.
        let roughly = |start: &Isometry3| {
            let from = at(start);
            let moving = Moving { begun: &from, ..moving };
            scored(moving.approached(&from, REACH_M), moving.least_reach_m())
        };
        let starts = [about(&poses[view]), about(begun), vec![*begun]].concat();
        let mut found: Vec<(f64, Isometry3)> = starts.par_iter().map(roughly).collect();
        found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        found.truncate(FOLLOWED);
        let followed = |(_, start): &(f64, Isometry3)| {
            let from = at(start);
            let moving = Moving { begun: &from, ..moving };
            scored(moving.descend(&from, FINE_REACH_M), agreeing_reach_m)
        };
        let found: Vec<(f64, Isometry3)> = found.par_iter().map(followed).collect();
        let better = |best: (f64, Isometry3), next: (f64, Isometry3)| {
            if next.0 > best.0 { next } else { best }
        };
        found.into_iter().fold(scored(stays.clone(), agreeing_reach_m), better).1
    }
}

/// Motions about a point from which a stray view is looked for.
fn starts(middle: &Point3) -> Vec<Isometry3> {
    let [shift_m, turn_rad, far_rad] = STARTS;
    let about = Isometry3::from(middle.coords);
    let of = |k: usize| {
        let mut along = Vector3::zeros();
        along[k % 3] = if k < 3 { 1.0 } else { -1.0 };
        let turned =
            |rad: f64| about * Isometry3::new(Vector3::zeros(), along * rad) * about.inverse();
        [Isometry3::from(along * shift_m), turned(turn_rad), turned(far_rad)]
    };
    (0..6).flat_map(of).collect()
}

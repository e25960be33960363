//! Which pairs are to be cached: what `SelfContact::update` spends its time on.
//!
//! In: positions at the start, and at the end of the motion if there is one
//! (metres); the distance of interest. Out: the pairs in `SelfContact::pairs`,
//! in an order that depends on the mesh and the positions alone.
//!
//! Method: bins of the sheet that are neighbours there (`patches.rs`) are told
//! apart block by block; what is left goes down to cells, and from there to
//! elements. Bins that are no neighbours are found by their boxes
//! (`broad.rs`). Two sets of vertices are apart by `within_m` over a straight
//! motion if they are so along one fixed line at both ends: positions along a
//! line are linear in time. The line joins their centres.
//!
//! Cost, for drapes of 61 x 61 vertices (7200 triangles), before and now, in one run:
//! at reach 0 4.2-4.5 and 0.9-1.1 ms, reach 2 mm 7.6-8.0 and 1.8-2.3 ms, along a step
//! of 1 mm 5.0-5.5 and 1.2-1.4 ms, of 5 mm 8.7-9.1 and 1.5-1.8 ms.
//!
//! Dropped: boxes of all 11000 edges and 7200 triangles in one grid (before): 130 000
//! overlaps at reach 2 mm, of which 51 000 share no vertex and 2000 are near.

use super::barrier::Pair;
use super::broad::{Bounds, BoxGrid};
use super::ccd;
use super::distance::{PairKind, closest};
use super::elements::{Elements, MOLLIFIER_SIN_SQ, REST_FACTOR};
use super::patches::{Stretches, Tight, Verdict};
use crate::base::Vector3;

/// The pairs that were collected.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The pairs, in an order that depends on the mesh and the positions alone.
    pub pairs: Vec<Pair>,
    /// The distance of each at the start of the motion, metres.
    pub distances_m: Vec<f64>,
}

impl Found {
    fn clear(&mut self) {
        self.pairs.clear();
        self.distances_m.clear();
    }
}

impl Extend<(Pair, f64)> for Found {
    fn extend<I: IntoIterator<Item = (Pair, f64)>>(&mut self, found: I) {
        for (pair, distance_m) in found {
            self.pairs.push(pair);
            self.distances_m.push(distance_m);
        }
    }
}

/// Buffers, kept from call to call.
#[derive(Clone, Debug, Default)]
pub struct Work {
    /// Positions at the end of the motion, less its mean.
    pub end: Vec<Vector3>,
    stretches: Stretches,
    grid: BoxGrid,
    cell_boxes: Vec<Bounds>,
    cell_centres: Vec<Vector3>,
    bin_boxes: Vec<Bounds>,
}

/// The motion for which pairs are to be collected.
#[derive(Clone, Copy)]
struct Sweep<'a> {
    x: &'a [Vector3],
    end: Option<&'a [Vector3]>,
    within_m: f64,
}

#[inline(always)]
fn at(x: &[Vector3], v: [u32; 4]) -> [Vector3; 4] {
    [x[v[0] as usize], x[v[1] as usize], x[v[2] as usize], x[v[3] as usize]]
}

impl Sweep<'_> {
    /// Box over the motion, wide enough that the boxes of two elements overlap
    /// if these can come within the distance.
    #[inline]
    fn bounds(&self, vertices: &[u32]) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for &v in vertices {
            bounds.include(&self.x[v as usize]);
            if let Some(end) = self.end {
                bounds.include(&end[v as usize]);
            }
        }
        bounds.inflated(0.5 * self.within_m)
    }

    /// Cheap and sufficient: are two sets of vertices apart along `axis`?
    fn hulls_apart(&self, first: &[u32], second: &[u32], axis: &Vector3) -> bool {
        let needed = self.within_m * axis.norm();
        let apart_at = |x: &[Vector3]| {
            let mut high = f64::NEG_INFINITY;
            for v in first {
                high = high.max(axis.dot(&x[*v as usize]));
            }
            second.iter().all(|v| axis.dot(&x[*v as usize]) - high > needed)
        };
        apart_at(self.x) && self.end.is_none_or(apart_at)
    }

    /// The same for a pair, along `axis` from the first element to the second.
    #[inline(always)]
    fn pair_apart(
        &self,
        kind: PairKind,
        vertices: [u32; 4],
        corners: &[Vector3; 4],
        axis: &Vector3,
    ) -> bool {
        let needed_sq = self.within_m * self.within_m * axis.norm_squared();
        let apart_at = |c: &[Vector3; 4]| {
            let along = [axis.dot(&c[0]), axis.dot(&c[1]), axis.dot(&c[2]), axis.dot(&c[3])];
            let gap = match kind {
                PairKind::EdgeEdge => along[2].min(along[3]) - along[0].max(along[1]),
                PairKind::PointTriangle => along[1].min(along[2]).min(along[3]) - along[0],
            };
            gap > 0.0 && gap * gap > needed_sq
        };
        apart_at(corners) && self.end.is_none_or(|end| apart_at(&at(end, vertices)))
    }
}

/// Collects into `found` the pairs that come within `within_m` at `x`, or anywhere on the way
/// to `end`.
pub fn collect(
    elements: &Elements,
    x: &[Vector3],
    end: Option<&[Vector3]>,
    within_m: f64,
    work: &mut Work,
    found: &mut Found,
) {
    found.clear();
    let sweep = Sweep { x, end, within_m };
    elements.boxes(sweep, work);
    elements.neighbours(sweep, work, found);
    elements.strangers(sweep, work, found);
}

impl Elements {
    fn boxes(&self, sweep: Sweep, work: &mut Work) {
        let patches = &*self.patches;
        let cells = 0..patches.vertices.len() as u32;
        work.cell_boxes.clear();
        work.cell_boxes.extend(cells.clone().map(|c| sweep.bounds(patches.vertices.of(c))));
        work.cell_centres.clear();
        work.cell_centres.extend(cells.map(|c| {
            let hull = patches.vertices.of(c);
            hull.iter().map(|v| sweep.x[*v as usize]).sum::<Vector3>() / hull.len() as f64
        }));
        work.bin_boxes.clear();
        work.bin_boxes.extend((0..patches.bins() as u32).map(|bin| {
            let cells = patches.cells.of(bin).iter().map(|c| &work.cell_boxes[*c as usize]);
            cells.fold(Bounds::EMPTY, |mut all, one| {
                all.include(&one.min);
                all.include(&one.max);
                all
            })
        }));
    }

    /// Pairs of bins that are neighbours on the sheet.
    fn neighbours(&self, sweep: Sweep, work: &mut Work, found: &mut Found) {
        let patches = &*self.patches;
        match sweep.end {
            None => work.stretches.measure(patches, &[sweep.x]),
            Some(end) => work.stretches.measure(patches, &[sweep.x, end]),
        }
        for near in &patches.near_bins {
            let mu = work.stretches.of_bins(near);
            if near.apart(mu, sweep.within_m) {
                continue;
            }
            for near in &patches.near_cells[near.cells.start as usize..near.cells.end as usize] {
                match work.stretches.verdict(patches, near, mu, sweep.within_m) {
                    Verdict::Apart => {}
                    Verdict::ApartBut(tight) => {
                        found.extend(tight.iter().filter_map(|t| self.tight_pair(t, sweep)));
                    }
                    Verdict::Unknown => self.search(near.cells, sweep, found),
                }
            }
            if !patches.loose_apart(mu, sweep.within_m) {
                let apart = near.apart.start as usize..near.apart.end as usize;
                for &cells in &patches.apart_cells[apart] {
                    self.search_apart(cells, sweep, work, found);
                }
            }
        }
    }

    /// Pairs of bins that are no neighbours on the sheet.
    fn strangers(&self, sweep: Sweep, work: &mut Work, found: &mut Found) {
        let patches = &*self.patches;
        let mut grid = std::mem::take(&mut work.grid);
        grid.build(&work.bin_boxes);
        grid.overlapping_pairs(|a, b| {
            if patches.neighbours(a, b) {
                return;
            }
            let (a, b) = (a.min(b), a.max(b));
            for &c in patches.cells.of(a) {
                if work.cell_boxes[c as usize].overlaps(&work.bin_boxes[b as usize]) {
                    for &d in patches.cells.of(b) {
                        self.search_apart([c, d], sweep, work, found);
                    }
                }
            }
        });
        work.grid = grid;
    }

    /// Pairs of two cells without a common vertex, if these are near at all.
    #[inline]
    fn search_apart(&self, [c, d]: [u32; 2], sweep: Sweep, work: &Work, found: &mut Found) {
        let vertices = &self.patches.vertices;
        if work.cell_boxes[c as usize].overlaps(&work.cell_boxes[d as usize])
            && !sweep.hulls_apart(
                vertices.of(c),
                vertices.of(d),
                &(work.cell_centres[d as usize] - work.cell_centres[c as usize]),
            )
        {
            self.search([c, d], sweep, found);
        }
    }

    /// Pairs of two cells.
    fn search(&self, [c, d]: [u32; 2], sweep: Sweep, found: &mut Found) {
        let patches = &*self.patches;
        for (i, &e) in patches.edges.of(c).iter().enumerate() {
            for &f in &patches.edges.of(d)[if c == d { i + 1 } else { 0 }..] {
                found.extend(self.edge_pair(e.min(f), e.max(f), sweep));
            }
        }
        for (from, to) in [(c, d), (d, c)].into_iter().take(if c == d { 1 } else { 2 }) {
            for &p in patches.points.of(from) {
                for &t in patches.triangles.of(to) {
                    found.extend(self.point_pair(p, t, sweep));
                }
            }
        }
    }

    /// The separating line is the one at rest, carried along by the corners.
    fn tight_pair(&self, tight: &Tight, sweep: Sweep) -> Option<(Pair, f64)> {
        let [a, b] = tight.elements;
        let line = |c: &[Vector3; 4]| {
            let w = &tight.weights;
            -(c[0] * w[0] + c[1] * w[1] + c[2] * w[2] + c[3] * w[3])
        };
        match tight.kind {
            PairKind::EdgeEdge => {
                let ([i, j], [k, l]) = (self.edges[a as usize].ends, self.edges[b as usize].ends);
                let corners = at(sweep.x, [i, j, k, l]);
                if sweep.pair_apart(PairKind::EdgeEdge, [i, j, k, l], &corners, &line(&corners)) {
                    return None;
                }
                self.edge_pair(a, b, sweep)
            }
            PairKind::PointTriangle => {
                let [i, j, k] = self.triangles[b as usize];
                let corners = at(sweep.x, [a, i, j, k]);
                if sweep.pair_apart(
                    PairKind::PointTriangle,
                    [a, i, j, k],
                    &corners,
                    &line(&corners),
                ) {
                    return None;
                }
                self.point_pair(a, b, sweep)
            }
        }
    }

    #[inline]
    fn edge_pair(&self, a: u32, b: u32, sweep: Sweep) -> Option<(Pair, f64)> {
        let (first, second) = (&self.edges[a as usize], &self.edges[b as usize]);
        let ([i, j], [k, l]) = (first.ends, second.ends);
        // `|`, not `||`: a mispredicted branch costs more
        if (i == k) | (i == l) | (j == k) | (j == l) {
            return None;
        }
        let corners = at(sweep.x, [i, j, k, l]);
        let axis = corners[2] + corners[3] - corners[0] - corners[1];
        if sweep.pair_apart(PairKind::EdgeEdge, [i, j, k, l], &corners, &axis) {
            return None;
        }
        let length_sq = first.rest_length_m.powi(2) * second.rest_length_m.powi(2);
        let pair = Pair {
            kind: PairKind::EdgeEdge,
            vertices: [i, j, k, l],
            stiffness_n_m: self.params.stiffness_n_m * 0.5 * (first.weight + second.weight),
            mollify_below_m4: MOLLIFIER_SIN_SQ * length_sq,
        };
        self.if_near(pair, &corners, sweep)
    }

    #[inline]
    fn point_pair(&self, point: u32, t: u32, sweep: Sweep) -> Option<(Pair, f64)> {
        let [a, b, c] = self.triangles[t as usize];
        if (point == a) | (point == b) | (point == c) {
            return None;
        }
        let corners = at(sweep.x, [point, a, b, c]);
        let axis = corners[1] + corners[2] + corners[3] - corners[0] * 3.0;
        if sweep.pair_apart(PairKind::PointTriangle, [point, a, b, c], &corners, &axis) {
            return None;
        }
        let pair = Pair {
            kind: PairKind::PointTriangle,
            vertices: [point, a, b, c],
            stiffness_n_m: self.params.stiffness_n_m * self.point_weight[point as usize],
            mollify_below_m4: 0.0,
        };
        self.if_near(pair, &corners, sweep)
    }

    /// The pair with its distance, if it can come within reach and is not too
    /// near at rest.
    fn if_near(&self, pair: Pair, corners: &[Vector3; 4], sweep: Sweep) -> Option<(Pair, f64)> {
        let motion_m = sweep.end.map_or(0.0, |end| {
            let end = at(end, pair.vertices);
            let moved = [
                end[0] - corners[0],
                end[1] - corners[1],
                end[2] - corners[2],
                end[3] - corners[3],
            ];
            ccd::relative_motion_m(pair.kind, &moved)
        });
        let within_m = sweep.within_m + motion_m;
        let distance_sq = closest(pair.kind, corners).distance_sq;
        if distance_sq >= within_m * within_m {
            return None;
        }
        let rest_sq = closest(pair.kind, &at(&self.rest, pair.vertices)).distance_sq;
        if rest_sq < (REST_FACTOR * self.params.gap_m).powi(2) {
            return None;
        }
        Some((pair, distance_sq.sqrt()))
    }
}

//! Contact of a cloth mesh with itself that never lets it pass through.
//!
//! In: triangles (vertex indices), rest positions, positions `x` and steps `dx`
//! (metres, any inertial frame; `x` free of intersections).
//! Out: contact energy (J), gradient (N), Hessian blocks (N/m) by vertex, and
//! the fraction of a step that keeps every pair apart.
//!
//! Method: incremental potential contact (Li et al. 2020): a barrier on every
//! point-triangle and edge-edge pair nearer than the gap (`barrier.rs`), and
//! conservative continuous collision detection for the step (`ccd.rs`). A
//! solver's iteration: solve for `dx`, [`SelfContact::update_along`]`(x, dx)`,
//! [`SelfContact::max_step`], line search on the energy from there, continue at
//! the accepted point with the same cache until the next `dx`.
//! [`SelfContact::update`] is the other way: complete in a ball around `x`,
//! for several small steps on one cache.
//!
//! Pairs left out: those that share a vertex, and those whose rest distance is
//! below `REST_FACTOR` gaps, so that a flat sheet is free of contact. On the
//! default 5 mm grid with a 1 mm gap the least rest distance of a pair without
//! a common vertex is 3.5 mm, hence nothing but the first kind is left out,
//! and every crossing of two triangles without a common vertex is prevented.
//! Below 2.83 mm per cell (1 mm gap) the second kind appears: a corner against the
//! diagonal of the same cell. The fold that this misses is one within a cell or two.
//!
//! Weights: a point counts with its rest area, an edge with a third of the
//! area of its triangles, both over 25 mm^2 (a cell of the default grid), so that
//! the pressure at a given distance hardly depends on the mesh. (Convergent
//! weights, Li et al. 2023, without their correction of doubled pairs.)
//!
//! Fails: no friction between layers. Layers rest a fraction of the gap apart, not
//! at the fabric's thickness. `x` with an intersection or NaN is outside the
//! contract: energies may be infinite or NaN. Elements with very unequal sizes
//! make the broad phase slow.
//!
//! Pairs are cached in an order that depends on the mesh and on the positions alone,
//! not on the thread or on what was cached before (`collect.rs`).
//!
//! Dropped: the 2-ring left out ("bending prevents a fold within two cells"):
//! soft knits do fold within 10 mm, and neighbours are told apart many at once
//! (`patches.rs`). A barrier on the squared distance
//! (as in the IPC code): stiffness in N/m^3, same shape. Caching by vertex
//! ball only: a falling sheet has large `dx` and small relative motion, and
//! the ball then holds every pair of the sheet.

mod barrier;
mod broad;
mod ccd;
mod collect;
mod distance;
mod elements;
mod intersections;
mod patches;
#[cfg(test)]
mod tests;

pub use distance::Hessian12;
pub use elements::SelfContactParams;
pub use intersections::{count_intersections, intersecting};

use crate::base::Vector3;
use crate::sim::energy::Energy;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;
use barrier::Pair;
use collect::{Found, Work};
use distance::closest;
use elements::Elements;

/// The Hessian of one pair's energy.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// The pair's vertices; rows and columns `3 i .. 3 i + 3` of the Hessian belong to
    /// `vertices[i]`.
    pub vertices: [u32; 4],
    /// How many of the vertices, from the first on, belong to the pair's first element: 1 of a
    /// point and a triangle, 2 of two edges.
    pub first: usize,
    /// The second derivatives, N/m.
    pub hessian: Hessian12,
}

/// Where the cached pairs are all that matter.
#[derive(Clone, Debug)]
enum Coverage {
    /// Every vertex within this distance of its place at the update, metres.
    Ball(f64),
    /// The segment from the place at the update along these displacements.
    Line(Vec<Vector3>),
}

/// The contact of a sheet with itself: its elements, and the pairs of them that may touch.
#[derive(Clone, Debug)]
pub struct SelfContact {
    elements: Elements,
    /// The cached pairs.
    found: Found,
    /// Positions at the update.
    reference: Vec<Vector3>,
    coverage: Coverage,
    work: Work,
}

impl SelfContact {
    /// The contact of the mesh `triangles` (vertex indices) whose positions at rest, flat or as
    /// made, are `rest` in metres. Before the first update no pair is cached and
    /// [`SelfContact::max_step`] gives 0.
    pub fn new(triangles: &[[u32; 3]], rest: &[Vector3], params: SelfContactParams) -> Self {
        SelfContact {
            elements: Elements::new(triangles, rest, params),
            found: Found::default(),
            reference: Vec::new(),
            coverage: Coverage::Ball(0.0),
            work: Work::default(),
        }
    }

    /// Makes the contact `factor` times as stiff, the cached pairs too.
    pub fn scale_stiffness(&mut self, factor: f64) {
        self.elements.params.stiffness_n_m *= factor;
        self.found.pairs.iter_mut().for_each(|pair| pair.stiffness_n_m *= factor);
    }

    /// Gap and stiffness of the contact.
    pub fn params(&self) -> &SelfContactParams {
        &self.elements.params
    }

    /// Number of cached pairs, whether they are near or not.
    pub fn pair_count(&self) -> usize {
        self.found.pairs.len()
    }

    /// Number of pairs nearer than the gap at the positions `x` (metres).
    pub fn active_count(&self, x: &[Vector3]) -> usize {
        let gap_sq = self.elements.params.gap_m * self.elements.params.gap_m;
        self.near_pairs(x).filter(|(pair, c)| closest(pair.kind, c).distance_sq < gap_sq).count()
    }

    /// Caches every pair that is nearer than `gap + reach_m` at the positions `x` (metres). The
    /// cache is complete as long as no vertex is farther than `reach_m / 2` from `x`, and
    /// [`SelfContact::max_step`] keeps to that. The cost grows with `reach_m` beyond the edge
    /// length.
    pub fn update(&mut self, x: &[Vector3], reach_m: f64) {
        self.collect(x, None, self.elements.params.gap_m + reach_m);
        self.coverage = Coverage::Ball(0.5 * reach_m);
    }

    /// Caches every pair that can come within the gap on the way from `x` to `x + dx` (metres). The
    /// cache is complete on that way, however long it is; a common translation costs nothing.
    pub fn update_along(&mut self, x: &[Vector3], dx: &[Vector3]) {
        let mean = dx.iter().sum::<Vector3>() / dx.len().max(1) as f64;
        let mut end = std::mem::take(&mut self.work.end);
        end.clear();
        end.extend(x.iter().zip(dx).map(|(p, d)| p + d - mean));
        self.collect(x, Some(&end), self.elements.params.gap_m);
        self.work.end = end;
        let mut line = match std::mem::replace(&mut self.coverage, Coverage::Ball(0.0)) {
            Coverage::Line(buffer) => buffer,
            Coverage::Ball(_) => Vec::new(),
        };
        line.clear();
        line.extend_from_slice(dx);
        self.coverage = Coverage::Line(line);
    }

    /// Caches the pairs that come within `within_m` at `x`, or anywhere on the way to `end`.
    fn collect(&mut self, x: &[Vector3], end: Option<&[Vector3]>, within_m: f64) {
        self.reference.clear();
        self.reference.extend_from_slice(x);
        collect::collect(&self.elements, x, end, within_m, &mut self.work, &mut self.found);
    }

    /// Cached pairs that may be within the gap at `x`, with their corners: the
    /// motion since the update must make up for the distance then.
    fn near_pairs<'a>(
        &'a self,
        x: &'a [Vector3],
    ) -> impl Iterator<Item = (&'a Pair, [Vector3; 4])> {
        let moved_m = largest_relative_m(x.iter().zip(&self.reference).map(|(p, q)| p - q));
        let gap_m = self.elements.params.gap_m;
        let cached = self.found.pairs.iter().zip(&self.found.distances_m);
        cached.filter(move |(_, distance_m)| **distance_m - gap_m <= moved_m).filter_map(
            move |(pair, distance_m)| {
                let corners = pair.corners(x);
                let before = pair.corners(&self.reference);
                let moved = difference(&corners, &before);
                let apart = ccd::relative_motion_m(pair.kind, &moved) < distance_m - gap_m;
                (!apart).then_some((pair, corners))
            },
        )
    }

    /// The contact's energy at the positions `x`, J.
    pub fn energy_j(&self, x: &[Vector3]) -> f64 {
        self.near_pairs(x)
            .map(|(pair, c)| barrier::energy_j(pair, &c, self.elements.params.gap_m))
            .sum()
    }

    /// Adds the gradient at the positions `x` to `grad` (N), and gives the energy there (J).
    pub fn add_gradient(&self, x: &[Vector3], grad: &mut [Vector3]) -> f64 {
        let mut energy_j = 0.0;
        for (pair, corners) in self.near_pairs(x) {
            if let Some((e, parts)) = barrier::gradient(pair, &corners, self.elements.params.gap_m)
            {
                energy_j += e;
                for (v, part) in pair.vertices.iter().zip(parts) {
                    grad[*v as usize] += part;
                }
            }
        }
        energy_j
    }

    /// Appends the Hessian of every pair that is nearer than the gap at the positions `x`:
    /// projected for a Newton direction, exact for a test of stability.
    pub fn blocks(&self, x: &[Vector3], form: HessianForm, out: &mut Vec<Block>) {
        for (pair, corners) in self.near_pairs(x) {
            if let Some(hessian) =
                barrier::hessian(pair, &corners, self.elements.params.gap_m, form)
            {
                out.push(Block { vertices: pair.vertices, first: pair.kind.first(), hessian });
            }
        }
    }

    /// The largest fraction t in (0, 1] such that on the way to `x + t dx` no pair falls below a
    /// tenth of its distance at `x`, and the cache stays complete. It is 0 only where the cache
    /// does not cover a step from `x`: then update it first.
    pub fn max_step(&self, x: &[Vector3], dx: &[Vector3]) -> f64 {
        let mut limit = self.covered_fraction(x, dx);
        if limit <= 0.0 {
            return 0.0;
        }
        // 1e-9: rounding of the cached distance.
        let kept = 1.0 - ccd::KEEP - 1e-9;
        let moved_m = largest_relative_m(x.iter().zip(&self.reference).map(|(p, q)| p - q));
        let step_m = largest_relative_m(dx.iter().copied());
        for (pair, distance_m) in self.found.pairs.iter().zip(&self.found.distances_m) {
            if limit * step_m < kept * (distance_m - moved_m) {
                continue;
            }
            let step = pair.corners(dx);
            let motion_m = ccd::relative_motion_m(pair.kind, &step);
            let corners = pair.corners(x);
            let moved = difference(&corners, &pair.corners(&self.reference));
            let at_least_m = distance_m - ccd::relative_motion_m(pair.kind, &moved);
            if limit * motion_m >= kept * at_least_m {
                limit = ccd::safe_fraction(pair.kind, &corners, &step, motion_m, limit);
            }
        }
        limit
    }

    /// How much of the step the cache covers.
    fn covered_fraction(&self, x: &[Vector3], dx: &[Vector3]) -> f64 {
        if self.reference.len() != x.len() {
            return 0.0;
        }
        match &self.coverage {
            Coverage::Line(line) if self.reference == x && line == dx => 1.0,
            Coverage::Line(_) => 0.0,
            Coverage::Ball(radius_m) => {
                let mut fraction = 1.0_f64;
                for i in 0..x.len() {
                    // 1e-9: a reach of exactly 2 max |dx| must not cost rounding.
                    let room_m = radius_m * (1.0 + 1e-9) - (x[i] - self.reference[i]).norm();
                    let step_m = dx[i].norm();
                    if step_m * fraction > room_m {
                        fraction = room_m.max(0.0) / step_m;
                    }
                }
                fraction
            }
        }
    }

    /// The least distance of a cached pair at the positions `x`, metres; infinite if no pair is
    /// cached.
    pub fn min_distance_m(&self, x: &[Vector3]) -> f64 {
        let distances =
            self.found.pairs.iter().map(|pair| closest(pair.kind, &pair.corners(x)).distance_sq);
        distances.fold(f64::INFINITY, f64::min).sqrt()
    }
}

/// Its Hessian couples vertices outside the grid's pattern: it is that of
/// [`SelfContact::blocks`].
impl Energy for SelfContact {
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        self.energy_j(x)
    }

    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        self.add_gradient(x, gradient);
    }

    fn max_step(&self, _: &Grid, x: &[Vector3], dx: &[Vector3], limit: f64) -> f64 {
        limit.min(self.max_step(x, dx))
    }
}

fn difference(a: &[Vector3; 4], b: &[Vector3; 4]) -> [Vector3; 4] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
}

/// Bound on the relative motion of any two vertices, metres: the diagonal of the
/// box of all motions.
fn largest_relative_m(motions: impl Iterator<Item = Vector3>) -> f64 {
    let (mut low, mut high) = (Vector3::zeros(), Vector3::zeros());
    for (i, motion) in motions.enumerate() {
        if i == 0 {
            (low, high) = (motion, motion);
        }
        // plain comparisons: `f64::min` pays for NaN
        for k in 0..3 {
            low[k] = if motion[k] < low[k] { motion[k] } else { low[k] };
            high[k] = if motion[k] > high[k] { motion[k] } else { high[k] };
        }
    }
    (high - low).norm()
}

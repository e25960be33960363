//! Looks for the plate among the flat patches of a scene.
//!
//! Where the scan sees the plate from below, the cloth on it, its underside and what carries
//! it lie above each other; only the uppermost counts, for either side up ([`layer`]).

use std::collections::HashMap;

use rayon::prelude::*;

use super::super::downsample::voxel_downsample;
use super::super::neighbours::Neighbours;
use super::super::plane::{horizontal_axes, principal};
use super::super::tuning::PlateTuning;
use super::layer;
use super::placed::Placed;
use crate::base::{Point3, Vector3};
use crate::numeric::robust;

/// A flat patch that may be the plate.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// On the cloth's surface, in the middle of what is level \[m\].
    pub centre: Point3,
    /// Its normal, away from where the surface falls.
    pub up: Vector3,
    /// Share of the bearings on which the surface falls away.
    pub falling: f64,
    /// Median radius at which it does \[m\].
    pub radius_m: f64,
}

impl Candidate {
    /// Whether both are the same place with the same side up.
    pub fn is_near(&self, other: &Self, radius_m: f64) -> bool {
        (self.centre - other.centre).norm() < 0.3 * radius_m && self.up.dot(&other.up) > 0.9
    }
}

/// The flat discs that look most like a plate of this radius, among `most` of the points:
/// the best first, each place once.
pub(super) fn candidates(
    points: &[Point3],
    radius_m: f64,
    most: usize,
    tuning: &PlateTuning,
) -> Vec<Candidate> {
    let stride = points.len().div_ceil(most).max(1);
    let some: Vec<Point3> = points.iter().step_by(stride).copied().collect();
    let coarse = voxel_downsample(&some, None, radius_m * tuning.coarse_cell_radii).points;
    let tree = Neighbours::new(&coarse);
    let seeds = voxel_downsample(&coarse, None, radius_m * tuning.seed_cell_radii).points;
    let search = Search { points: &coarse, tree: &tree, radius_m, tuning };
    let patches: Vec<Patch> = seeds.par_iter().flat_map_iter(|seed| search.patches(seed)).collect();
    let different = different(&patches, tuning.same_radii * radius_m);
    let mut found: Vec<Candidate> = different.par_iter().map(|patch| search.judge(patch)).collect();
    let leaving_m = tuning.leaving_radii * radius_m;
    let score = |c: &Candidate| c.falling - 2.0 * (c.radius_m / leaving_m - 1.0).abs();
    found.sort_by(|a, b| score(b).total_cmp(&score(a)));
    found
}

/// A flat piece of surface and one of its sides.
#[derive(Clone, Copy)]
struct Patch {
    centre: Point3,
    up: Vector3,
}

/// The patches, each place and side once: most seeds around a flat place end in the same one.
fn different(patches: &[Patch], same_m: f64) -> Vec<Patch> {
    let cell = |p: &Point3| [p.x, p.y, p.z].map(|c| (c / same_m).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<Patch>> = HashMap::new();
    let mut different = Vec::new();
    for patch in patches {
        let same = |other: &Patch| {
            (other.centre - patch.centre).norm() < same_m && other.up.dot(&patch.up) > 0.99
        };
        let [i, j, k] = cell(&patch.centre);
        let beside = (0..27_i64).map(|n| [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
        if !beside.filter_map(|at| cells.get(&at)).flatten().any(same) {
            cells.entry([i, j, k]).or_default().push(*patch);
            different.push(*patch);
        }
    }
    different
}

/// The flat piece around a place.
struct Settled {
    /// `None` if it is not flat, or as wide as a table.
    patch: Option<Patch>,
    /// Whether something lay under it.
    layered: bool,
}

/// The points among which patches are looked for.
struct Search<'a> {
    points: &'a [Point3],
    tree: &'a Neighbours,
    radius_m: f64,
    tuning: &'a PlateTuning,
}

impl Search<'_> {
    /// The flat patches around `seed`, either side up.
    fn patches(&self, seed: &Point3) -> Vec<Patch> {
        let near = self.tree.within(seed, self.radius_m * self.tuning.patch_radii);
        let Some((_, up, _)) = principal(near.iter().map(|&i| self.points[i])) else {
            return Vec::new();
        };
        let Settled { patch, layered } = self.settle(&Patch { centre: *seed, up });
        // Of a single layer, the other side is the same patch.
        let other = if layered {
            self.settle(&Patch { centre: *seed, up: -up }).patch
        } else {
            patch.map(|patch| Patch { up: -patch.up, ..patch })
        };
        patch.into_iter().chain(other).collect()
    }

    /// Moves to the middle of the flat piece around `from`, in what lies uppermost.
    fn settle(&self, from: &Patch) -> Settled {
        let mut patch = *from;
        let mut layered = false;
        for _ in 0..self.tuning.patch_rounds {
            let Some(moved_m) = self.settle_once(&mut patch, &mut layered) else {
                return Settled { patch: None, layered };
            };
            if moved_m < self.tuning.settled_radii * self.radius_m {
                break;
            }
        }
        Settled { patch: Some(patch), layered }
    }

    /// One step of it: how far the centre moved, `None` if there is nothing flat.
    fn settle_once(&self, patch: &mut Patch, layered: &mut bool) -> Option<f64> {
        let Self { points, tree, radius_m, tuning } = *self;
        let Patch { centre, up } = *patch;
        let reach_m = radius_m * tuning.patch_radii;
        let wide = tree.within(&centre, radius_m * tuning.around_radii);
        let wide: Vec<Point3> = wide.iter().map(|&i| points[i]).collect();
        let in_reach = |p: &&Point3| (*p - centre).norm_squared() < reach_m * reach_m;
        let mut near: Vec<Point3> = wide.iter().filter(in_reach).copied().collect();
        *layered |= self.keep_uppermost(&mut near, &centre, &up);
        let (mean, axis, variances) = principal(near.iter().copied())?;
        // A filled disc of radius q has variances q^2 / 4 in its plane.
        let filled = variances[1] > tuning.filled * reach_m.powi(2) / 4.0;
        if !filled || flatness(&near, &mean, &axis) > tuning.flat_rms_m {
            return None;
        }
        let up = if axis.dot(&up) < 0.0 { -axis } else { axis };
        let level = |p: &&Point3| (*p - mean).dot(&up).abs() < 1.5 * tuning.flat_rms_m;
        let flat: Vec<Point3> = wide.iter().filter(level).copied().collect();
        if flat.len() as f64 > tuning.most_level * wide.len() as f64 {
            return None; // a table: as flat as wide
        }
        let (flat_mean, ..) = principal(flat.into_iter())?;
        let middle = flat_mean - up * (flat_mean - mean).dot(&up);
        let from = centre - up * (centre - mean).dot(&up);
        *patch = Patch { centre: middle, up };
        Some((middle - from).norm())
    }

    /// Drops the points that others cover; whether there were any.
    fn keep_uppermost(&self, near: &mut Vec<Point3>, centre: &Point3, up: &Vector3) -> bool {
        let (u, v) = horizontal_axes(up, &Vector3::x());
        let placed: Vec<Placed> =
            near.iter().map(|p| Placed::of(p, centre, [&u, up, &v])).collect();
        let Some(keep) = layer::uppermost(&placed, self.radius_m, self.tuning) else {
            return false;
        };
        let mut keep = keep.into_iter();
        near.retain(|_| keep.next().unwrap_or(true));
        true
    }

    /// Asks on which bearings the surface falls away from a patch.
    fn judge(&self, patch: &Patch) -> Candidate {
        let (tuning, Patch { centre, up }) = (self.tuning, *patch);
        let wide = self.tree.within(&centre, self.radius_m * tuning.reach_radii);
        let (u, v) = horizontal_axes(&up, &Vector3::x());
        let wide = wide.iter().map(|&i| Placed::of(&self.points[i], &centre, [&u, &up, &v]));
        let wide: Vec<Placed> = wide.collect();
        // Most of what is near a plate lies under it.
        let rises = |p: &&Placed| p.height_m > tuning.drop_radii * self.radius_m;
        let rising = wide.iter().filter(rises).count() as f64;
        if rising > tuning.most_rising * wide.len() as f64 {
            return Candidate { centre, up, falling: 0.0, radius_m: 0.0 };
        }
        let (falling, radius_m) = falling_edge(&wide, self.radius_m, tuning);
        Candidate { centre, up, falling, radius_m }
    }
}

/// Robust scatter of points about a plane.
fn flatness(near: &[Point3], mean: &Point3, axis: &Vector3) -> f64 {
    let heights: Vec<f64> = near.iter().map(|p| (p - mean).dot(axis)).collect();
    robust::sigma(&heights).unwrap_or(f64::INFINITY)
}

/// What one bearing has in one ring.
#[derive(Clone, Copy, Default)]
struct Ring {
    /// Points that are level with the disc, or above it.
    level: u32,
    /// Points that have fallen away.
    below: u32,
    /// And deeper than any plate is thick.
    deep: u32,
    /// Whether something level is beside it: what is below here is then covered.
    covered: bool,
}

/// Share of the bearings on which the surface leaves the plane downwards before
/// 1.8 radii and nothing stays up there, and the median radius of leaving.
fn falling_edge(points: &[Placed], radius_m: f64, tuning: &PlateTuning) -> (f64, f64) {
    let bearings = tuning.bearings;
    let count = (tuning.reach_radii * tuning.rings_per_radius).round() as usize;
    let drop_m = tuning.drop_radii * radius_m;
    let mut rings = vec![vec![Ring::default(); count]; bearings];
    for p in points {
        let ring = (p.radius_m() / radius_m * tuning.rings_per_radius) as usize;
        // What rises counts as level: it does not fall away.
        if ring < count && p.height_m < 10.0 * drop_m {
            let here = &mut rings[p.sector(bearings)][ring];
            if p.height_m < -drop_m {
                here.below += 1;
                here.deep += u32::from(p.height_m < -tuning.deep_radii * radius_m);
            } else {
                here.level += 1;
            }
        }
    }
    mark_covered(&mut rings);
    let edges = rings.iter().filter_map(|rings| sector_edge(rings, tuning));
    let edges_m: Vec<f64> =
        edges.map(|ring| ring as f64 / tuning.rings_per_radius * radius_m).collect();
    let share = edges_m.len() as f64 / bearings as f64;
    (share, robust::median(edges_m).unwrap_or(0.0))
}

/// Says where something level lies within about a ring's width.
fn mark_covered(rings: &mut [Vec<Ring>]) {
    let bearings = rings.len();
    let count = rings.first().map_or(0, Vec::len);
    let level: Vec<Vec<bool>> =
        rings.iter().map(|sector| sector.iter().map(|ring| ring.level > 0).collect()).collect();
    for ring in 0..count {
        // Sectors are narrow near the centre.
        let width = std::f64::consts::TAU * (ring as f64 + 0.5) / bearings as f64;
        let reach = ((1.0 / width).ceil() as usize).min(bearings / 2);
        let near = ring.saturating_sub(1)..(ring + 2).min(count);
        for sector in 0..bearings {
            let beside = (0..=2 * reach).map(|k| (sector + bearings + k - reach) % bearings);
            let any = beside.into_iter().any(|s| near.clone().any(|r| level[s][r]));
            rings[sector][ring].covered = any;
        }
    }
}

/// The ring at which one bearing's surface leaves the plane: level up to there but for what
/// is covered, and nearly nothing level beyond. Cloth hangs down there: beyond, or straight
/// below where a fold goes in.
fn sector_edge(rings: &[Ring], tuning: &PlateTuning) -> Option<usize> {
    let sum = |rings: &[Ring], of: fn(&Ring) -> u32| rings.iter().map(of).sum::<u32>();
    let level = |ring: &Ring| ring.level;
    let below = |ring: &Ring| ring.below;
    let deep = |ring: &Ring| ring.deep;
    let open = |ring: &Ring| if ring.covered { 0 } else { ring.below };
    // The split with the fewest points on the wrong side.
    let wrong = |r: usize| sum(&rings[..r], open) + sum(&rings[r..], level);
    let split = (1..rings.len()).min_by_key(|&r| wrong(r))?;
    let near = split.saturating_sub(tuning.inward_rings);
    let inside = sum(&rings[..split], level);
    let outside = sum(&rings[split..], below) + sum(&rings[near..split], deep);
    let clear = f64::from(wrong(split)) < tuning.most_wrong * f64::from(inside + outside);
    (clear && inside >= 4 && outside >= 3 && split + 1 < rings.len()).then_some(split)
}

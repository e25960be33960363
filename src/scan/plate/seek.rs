//! Looks for the plate among the flat patches of a scene.
//!
//! Where the scan sees the plate from below, the cloth on it, its underside and what carries
//! it lie above each other; only the uppermost counts, for either side up ([`layer`]).

use std::collections::HashMap;

use rayon::prelude::*;

use super::super::downsample::voxel_downsample;
use super::super::hints::Hints;
use super::super::options::ScanOptions;
use super::super::plane::{horizontal_axes, principal};
use super::super::tuning::PlateTuning;
use super::evidence::Evidence;
use super::layer;
use super::placed::Placed;
use super::wide::on_wide_planes;
use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;
use crate::numeric::robust;

/// A flat patch that may be the plate.
#[derive(Clone, Debug)]
pub(in crate::scan) struct Candidate {
    /// On the cloth's surface, in the middle of what is level \[m\].
    pub centre: Point3,
    /// Its normal, away from where the surface falls.
    pub up: Vector3,
    /// What speaks for it.
    pub(super) evidence: Evidence,
}

impl Candidate {
    /// Whether both are the same place with the same side up.
    pub fn is_near(&self, other: &Self, radius_m: f64) -> bool {
        (self.centre - other.centre).norm() < 0.5 * radius_m && self.up.dot(&other.up) > 0.9
    }
}

/// What is found in a scene.
pub(in crate::scan) struct Sought {
    /// The flat discs that look most like a plate with a drape on it: the best first.
    pub candidates: Vec<Candidate>,
    /// Share of the downsampled points that lie on planes wider than the specimen.
    pub wide_share: f64,
    /// Share of them on the fullest plane, wide or not.
    pub plane_share: f64,
}

/// The flat discs that look most like a plate with a drape on it, of those that may be one.
pub(in crate::scan) fn candidates(
    points: &[Point3],
    hints: &Hints,
    options: &ScanOptions,
) -> Sought {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let side_m = options.specimen_side_m;
    let stride = points.len().div_ceil(tuning.most_coarse).max(1);
    let some: Vec<Point3> = points.iter().step_by(stride).copied().collect();
    let cell_m = radius_m * tuning.coarse_cell_radii;
    let coarse = voxel_downsample(&some, cell_m);
    let tree = Neighbours::new(&coarse);
    let planes = on_wide_planes(&coarse, &tree, tuning.wide_sides * side_m, options.seed, tuning);
    let wide = &planes.wide;
    let narrow = coarse.iter().zip(wide).filter(|(_, wide)| !**wide);
    let narrow: Vec<Point3> = narrow.map(|(p, _)| *p).collect();
    let seeds = voxel_downsample(&narrow, radius_m * tuning.seed_cell_radii);
    let narrow_tree = &Neighbours::new(&narrow);
    let (points, tree, narrow) = (&coarse, &tree, &narrow);
    let search = Search { points, tree, narrow, narrow_tree, radius_m, side_m, cell_m, tuning };
    let patches: Vec<Patch> = seeds.par_iter().flat_map_iter(|seed| search.patches(seed)).collect();
    let mut different = different(&patches, tuning.same_radii * radius_m);
    different.retain(|patch| hints.allow(&patch.centre, &patch.up));
    let mut found: Vec<Candidate> = different.par_iter().map(|patch| search.judge(patch)).collect();
    let score = |of: &Candidate| of.evidence.score(tuning);
    found.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let wide_share = wide.iter().filter(|wide| **wide).count() as f64 / wide.len().max(1) as f64;
    let candidates = apart(found, side_m, radius_m, tuning);
    Sought { candidates, wide_share, plane_share: planes.fullest_share }
}

/// The first few candidates, each place once. First come a few about each drape, so that another
/// one's are among them.
fn apart(
    found: Vec<Candidate>,
    side_m: f64,
    radius_m: f64,
    tuning: &PlateTuning,
) -> Vec<Candidate> {
    let mut different: Vec<Candidate> = Vec::new();
    for candidate in found {
        if !different.iter().any(|other| other.is_near(&candidate, radius_m)) {
            different.push(candidate);
        }
    }
    let (mut apart, mut more): (Vec<Candidate>, Vec<Candidate>) = (Vec::new(), Vec::new());
    for candidate in different {
        let near = |other: &&Candidate| (other.centre - candidate.centre).norm() < 0.5 * side_m;
        let crowded = apart.iter().filter(near).count() >= tuning.most_at_one_drape;
        if crowded { &mut more } else { &mut apart }.push(candidate);
    }
    apart.truncate(tuning.most_measured / 2);
    apart.extend(more);
    apart.truncate(tuning.most_measured);
    apart
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
    /// Those that lie on no wide plane.
    narrow: &'a [Point3],
    narrow_tree: &'a Neighbours,
    radius_m: f64,
    side_m: f64,
    cell_m: f64,
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
        let Self { points, tree, radius_m, tuning, .. } = *self;
        let Patch { centre, up } = *patch;
        let reach_m = radius_m * tuning.patch_radii;
        let within =
            |reach_m| tree.within(&centre, reach_m).into_iter().map(|i| points[i]).collect();
        let mut near: Vec<Point3> = within(reach_m);
        *layered |= self.keep_uppermost(&mut near, &centre, &up);
        let (mean, axis, variances) = principal(near.iter().copied())?;
        // A filled disc of radius q has variances q^2 / 4 in its plane.
        let filled = variances[1] > tuning.filled * reach_m.powi(2) / 4.0;
        if !filled || flatness(&near, &mean, &axis) > tuning.flat_rms_m {
            return None;
        }
        let up = if axis.dot(&up) < 0.0 { -axis } else { axis };
        let level = |p: &&Point3| (*p - mean).dot(&up).abs() < 1.5 * tuning.flat_rms_m;
        let wide: Vec<Point3> = within(radius_m * tuning.around_radii);
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

    /// What speaks for a patch.
    fn judge(&self, patch: &Patch) -> Candidate {
        let Patch { centre, up } = *patch;
        let (u, v) = horizontal_axes(&up, &Vector3::x());
        let around = self.narrow_tree.within(&centre, self.tuning.around_sides * self.side_m);
        let placed = |i: &usize| Placed::of(&self.narrow[*i], &centre, [&u, &up, &v]);
        let around: Vec<Placed> = around.iter().map(placed).collect();
        let evidence = Evidence::of(&around, self.radius_m, self.side_m, self.cell_m, self.tuning);
        Candidate { centre, up, evidence }
    }
}

/// Robust scatter of points about a plane.
fn flatness(near: &[Point3], mean: &Point3, axis: &Vector3) -> f64 {
    let heights: Vec<f64> = near.iter().map(|p| (p - mean).dot(axis)).collect();
    robust::sigma(&heights).unwrap_or(f64::INFINITY)
}

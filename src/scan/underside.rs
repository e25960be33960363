//! The false underside of a closed mesh, found and cut away.
//!
//! Scanning apps close open sheets: with a flat cap, with an offset copy of the sheet
//! (a shell), or with the bulge of a Poisson surface. The cloth's free edge is then
//! the crease at which the true side becomes the false one.
//!
//! In: a welded mesh \[m\] and the plate. What lies along the surface within half a
//! side of the plate's centre is cloth for sure; what lies farther than any corner
//! can, and what runs through under the plate, is not, if the mesh joins it to the
//! cloth. Between the two runs the cheapest closed cut (maximum
//! flow), where a millimetre of cut costs exp(-(a / 30 degrees)^2) with a the angle
//! between its two sides within 2.5 mm (the dihedral angle). Out: the triangles that
//! stay. Nothing is cut from a mesh that is open all round.
//!
//! Fails where there is no crease to find: a surface rounded over more than about
//! a centimetre is refused. Tried and dropped: growing the cloth until the first
//! crease (one gentle place in the crease floods the other side), and facing (cloth
//! that swings inward faces down too).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::options::ScanOptions;
use super::plane::horizontal_axes;
use super::plate::Plate;
use super::tuning::UndersideTuning;
use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;
use crate::geom::adjacency::area_vector2;
use crate::geom::parry::hits;
use crate::geom::{Adjacency, Mesh};
use crate::numeric::min_cut::Network;

/// What was cut.
pub(super) struct Cut {
    /// Whether each triangle stays.
    pub keep: Vec<bool>,
    /// Area that goes, as a share of what hung together with the cloth.
    pub removed_share: f64,
    /// Median dihedral angle of the surface along the cut \[rad\].
    pub crease_rad: f64,
    /// Length of the cut \[m\].
    pub length_m: f64,
    /// Places on the cut whose dihedral angle is too small to show an edge \[m\].
    pub weak: Vec<Point3>,
}

/// Finds the false underside of the sheet on the plate; `None` if it has none.
pub(super) fn find(
    mesh: &Mesh,
    beside: &Adjacency,
    plate: &Plate,
    options: &ScanOptions,
) -> Option<Cut> {
    let (side_m, tuning) = (options.specimen_side_m, &options.tuning.underside);
    let plumb = plumb_lines(mesh, plate);
    let &seed = plumb.first().and_then(|line| line.first())?;
    let seed = seed as usize;
    let distance = distances(mesh, beside, seed, &plate.centre);
    let of = |face: usize| mesh.triangles[face].map(|v| distance[v as usize]);
    let nearest = |face: usize| of(face).into_iter().fold(f64::INFINITY, f64::min);
    let farthest = |face: usize| of(face).into_iter().fold(0.0, f64::max);
    let beyond_m = tuning.beyond * 0.5 * side_m * 2_f64.sqrt();
    let mut role: Vec<Role> = (0..mesh.triangles.len())
        .map(|face| match (nearest(face), farthest(face)) {
            (near, _) if !near.is_finite() => Role::Elsewhere,
            (_, far) if far < tuning.sure * 0.5 * side_m => Role::Cloth,
            (near, _) if near > beyond_m => Role::False,
            _ => Role::Open,
        })
        .collect();
    for &face in plumb.iter().filter_map(|line| line.get(1..)).flatten() {
        let face = face as usize;
        if role[face] == Role::Open && nearest(face) > 0.5 * side_m {
            role[face] = Role::False;
        }
    }
    if !role.contains(&Role::False) || !role.contains(&Role::Cloth) {
        return None;
    }
    let normals = smooth_normals(mesh, beside, tuning.smooth_m);
    // Outward is up on the plate.
    let outward = plate.up.into_inner() * normals[seed].dot(&plate.up).signum();
    let down = |face: usize| {
        let normal = normals[face];
        nearest(face) > 0.5 * side_m && normal.dot(&outward) < tuning.down * normal.norm()
    };
    let down: Vec<bool> = (0..mesh.triangles.len()).map(down).collect();
    let surface = Surface { mesh, beside, normals: &normals, down: &down, tuning };
    let keep = cheapest_cut(&surface, &role, |_| 1.0);
    let (near, inward_m) = around_cut(&surface, &role, &keep);
    let keep = cheapest_cut(&surface, &near, |vertex| (-inward_m[vertex] / tuning.nearer_m).exp());
    Some(describe(&surface, &role, keep))
}

/// What is known of a triangle beforehand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Cloth,
    False,
    Open,
    /// Not joined to the cloth.
    Elsewhere,
}

/// The triangles that vertical lines through the plate meet, downwards; lines that
/// meet none at the plate's height are left out.
fn plumb_lines(mesh: &Mesh, plate: &Plate) -> Vec<Vec<u32>> {
    let (u, v) = horizontal_axes(&plate.up, &Vector3::x());
    let above_m = 0.5 * plate.radius_m;
    (0..9)
        .filter_map(|k| {
            // Off the centre, where a mesh may have a vertex.
            let radius = (0.03 + 0.04 * f64::from(k)) * plate.radius_m;
            let bearing_rad = 0.3 + f64::from(k);
            let across = u * (radius * bearing_rad.cos()) + v * (radius * bearing_rad.sin());
            let up = plate.up.into_inner();
            let hits = hits(mesh, &(plate.centre + across + up * above_m), &-up);
            let on_plate = hits.first().is_some_and(|hit| hit.0 < 2.0 * above_m);
            on_plate.then(|| hits.into_iter().map(|hit| hit.1).collect())
        })
        .collect()
}

/// Distance of each vertex from `centre` along the mesh \[m\]: over edges, and straight
/// across pairs of triangles; infinite where the mesh does not lead.
fn distances(mesh: &Mesh, beside: &Adjacency, seed: usize, centre: &Point3) -> Vec<f64> {
    let count = mesh.vertices.len();
    let mut start = vec![0_u32; count + 1];
    mesh.triangles.iter().flatten().for_each(|&v| start[v as usize + 1] += 1);
    for k in 0..count {
        start[k + 1] += start[k];
    }
    let mut filled = start.clone();
    let mut around = vec![0_u32; 3 * mesh.triangles.len()];
    for (face, t) in (0_u32..).zip(&mesh.triangles) {
        for &v in t {
            around[filled[v as usize] as usize] = face;
            filled[v as usize] += 1;
        }
    }
    let mut distance = vec![f64::INFINITY; count];
    let mut heap = BinaryHeap::new();
    // Non-negative floats order like their bits.
    let reach = |heap: &mut BinaryHeap<_>, v: u32, through: f64, distance: &mut Vec<f64>| {
        if through < distance[v as usize] {
            distance[v as usize] = through;
            heap.push(Reverse((through.to_bits(), v)));
        }
    };
    for v in mesh.triangles[seed] {
        let from_centre = (mesh.vertices[v as usize] - centre).norm();
        reach(&mut heap, v, from_centre, &mut distance);
    }
    while let Some(Reverse((bits, v))) = heap.pop() {
        let here = f64::from_bits(bits);
        if here > distance[v as usize] {
            continue;
        }
        for &face in &around[start[v as usize] as usize..start[v as usize + 1] as usize] {
            let t = mesh.triangles[face as usize];
            let k = t.iter().position(|&c| c == v).unwrap_or(0);
            let [p, q] = [t[(k + 1) % 3], t[(k + 2) % 3]];
            for w in [p, q] {
                let step = (mesh.vertices[w as usize] - mesh.vertices[v as usize]).norm();
                reach(&mut heap, w, here + step, &mut distance);
            }
            let Some(other) = beside.across(face as usize, (k + 1) % 3) else { continue };
            let opposite = mesh.triangles[other].into_iter().find(|&c| c != p && c != q);
            let corners = |w: u32| [v, p, q, w].map(|c| mesh.vertices[c as usize]);
            if let Some((w, step)) = opposite.and_then(|w| Some((w, unfolded(corners(w))?))) {
                reach(&mut heap, w, here + step, &mut distance);
            }
        }
    }
    distance
}

/// Distance from v to w on the triangles v p q and w q p laid flat, if the straight
/// line crosses p q.
fn unfolded([v, p, q, w]: [Point3; 4]) -> Option<f64> {
    let along = q - p;
    let length = along.norm();
    let place = |c: &Point3| {
        let d = c - p;
        let x = d.dot(&along) / length;
        (x, (d.norm_squared() - x * x).max(0.0).sqrt())
    };
    let ((vx, vy), (wx, wy)) = (place(&v), place(&w));
    let crossing = vx + (wx - vx) * vy / (vy + wy);
    (0.0..=length).contains(&crossing).then(|| (vx - wx).hypot(vy + wy))
}

/// A mesh, what lies beside what, and normals.
#[derive(Clone, Copy)]
struct Surface<'a> {
    mesh: &'a Mesh,
    beside: &'a Adjacency,
    normals: &'a [Vector3],
    /// Whether each triangle faces down, where no cloth is for sure.
    down: &'a [bool],
    tuning: &'a UndersideTuning,
}

/// The dihedral angle of the surface across edge `k` of `face`: 0 where it is flat \[rad\].
fn dihedral_rad(surface: &Surface, face: usize, k: usize, other: usize) -> f64 {
    let Surface { mesh, beside, .. } = *surface;
    let edge = [k, (k + 1) % 3].map(|c| mesh.vertices[mesh.triangles[face][c] as usize]);
    let from = nalgebra::center(&edge[0], &edge[1]);
    let back = edge_to(beside, other, face);
    let same = if consistent(mesh, [face, k], [other, back]) { 1.0 } else { -1.0 };
    let [near, far] = [(face, k), (other, back)].map(|at| normal_beyond(surface, at, &from));
    (near * same).angle(&far)
}

/// Whether two triangles run along the edge they share in opposite directions.
fn consistent(mesh: &Mesh, [f, k]: [usize; 2], [g, l]: [usize; 2]) -> bool {
    mesh.triangles[f][k] == mesh.triangles[g][(l + 1) % 3]
}

/// The normal of the surface at `reach_m` of the tuning from `from`, walked to from edge `k` of
/// `face` away from it; with the sign of that triangle's own.
fn normal_beyond(
    surface: &Surface,
    (mut face, mut entered): (usize, usize),
    from: &Point3,
) -> Vector3 {
    let Surface { mesh, beside, normals, .. } = *surface;
    let corner = |face: usize, c: usize| mesh.vertices[mesh.triangles[face][c % 3] as usize];
    let mut sign = 1.0;
    for _ in 0..40 {
        let middle = (0..3).map(|c| corner(face, c).coords).sum::<Vector3>() / 3.0;
        if (middle - from.coords).norm() >= surface.tuning.reach_m {
            break;
        }
        let away = |l: &usize| {
            let at = nalgebra::center(&corner(face, *l), &corner(face, *l + 1));
            (at - from).norm_squared()
        };
        let onward = (0..3)
            .filter(|&l| l != entered && beside.across(face, l).is_some())
            .max_by(|a, b| away(a).total_cmp(&away(b)));
        let Some((l, next)) = onward.and_then(|l| Some((l, beside.across(face, l)?))) else {
            break;
        };
        let back = edge_to(beside, next, face);
        if !consistent(mesh, [face, l], [next, back]) {
            sign = -sign;
        }
        (face, entered) = (next, back);
    }
    normals[face] * sign
}

/// The edge of `face` across which `other` lies.
fn edge_to(beside: &Adjacency, face: usize, other: usize) -> usize {
    (0..3).find(|&k| beside.across(face, k) == Some(other)).unwrap_or(0)
}

/// Normals of the triangles, averaged over about `smooth_m` so that the noise of
/// small triangles does not look like a crease.
fn smooth_normals(mesh: &Mesh, beside: &Adjacency, smooth_m: f64) -> Vec<Vector3> {
    let count = mesh.triangles.len();
    let mut normals: Vec<Vector3> = (0..count).map(|face| area_vector2(mesh, face)).collect();
    let area = 0.5 * normals.iter().map(Vector3::norm).sum::<f64>();
    // A round of averaging spreads by about the side of a triangle.
    let side_m = (2.0 * area / count.max(1) as f64).sqrt();
    let rounds = (smooth_m / side_m).powi(2).min(16.0) as usize;
    for _ in 0..rounds {
        normals = (0..count)
            .into_par_iter()
            .map(|face| {
                let across = |k: usize| {
                    let other = beside.across(face, k)?;
                    let same = consistent(mesh, [face, k], [other, edge_to(beside, other, face)]);
                    Some(if same { normals[other] } else { -normals[other] })
                };
                normals[face] + (0..3).filter_map(across).sum::<Vector3>()
            })
            .collect();
    }
    normals
}

/// The inner edges of the mesh, each once: triangle, its edge, the other triangle.
fn inner_edges<'a>(
    mesh: &'a Mesh,
    beside: &'a Adjacency,
) -> impl Iterator<Item = (usize, usize, usize)> + 'a {
    (0..mesh.triangles.len()).flat_map(move |face| {
        (0..3).filter_map(move |k| {
            let other = beside.across(face, k)?;
            (face < other).then_some((face, k, other))
        })
    })
}

fn edge_m(mesh: &Mesh, face: usize, k: usize) -> f64 {
    let [a, b] = [k, (k + 1) % 3].map(|c| mesh.vertices[mesh.triangles[face][c] as usize]);
    (b - a).norm()
}

/// Whether each triangle is on the cloth's side of the cheapest cut.
fn cheapest_cut(surface: &Surface, role: &[Role], factor: impl Fn(usize) -> f64) -> Vec<bool> {
    let Surface { mesh, beside, tuning, .. } = *surface;
    const CLOTH: usize = 0;
    const FALSE: usize = 1;
    let mut nodes = 2;
    let node: Vec<Option<usize>> = role
        .iter()
        .map(|role| match role {
            Role::Cloth => Some(CLOTH),
            Role::False => Some(FALSE),
            Role::Open => {
                nodes += 1;
                Some(nodes - 1)
            }
            Role::Elsewhere => None,
        })
        .collect();
    let mut network = Network::new(nodes);
    for (face, k, other) in inner_edges(mesh, beside) {
        let (Some(a), Some(b)) = (node[face], node[other]) else { continue };
        if a != b {
            let folded = dihedral_rad(surface, face, k, other) / tuning.cheap_dihedral_rad;
            let cost = ((-folded * folded).exp() + tuning.least_cost)
                * factor(mesh.triangles[face][k] as usize);
            // In micrometres of the most expensive cut.
            network.join(a, b, (1e6 * edge_m(mesh, face, k) * cost).ceil().max(1.0) as u64);
        }
    }
    for face in (0..role.len()).filter(|&face| role[face] == Role::Open && surface.down[face]) {
        let area_m2 = 0.5 * area_vector2(mesh, face).norm();
        if let Some(node) = node[face] {
            network.join(node, FALSE, (1e6 * tuning.down_cost_per_m * area_m2).ceil() as u64);
        }
    }
    let reached = network.cut(CLOTH, FALSE);
    node.iter().map(|node| node.is_none_or(|node| reached[node])).collect()
}

/// The roles once a first cut is known: what is more than `inward_m` of the tuning inside of it is
/// cloth, what is outside is not. And the distance of each vertex inward of the cut,
/// straight through space \[m\].
fn around_cut(surface: &Surface, role: &[Role], keep: &[bool]) -> (Vec<Role>, Vec<f64>) {
    let Surface { mesh, beside, tuning, .. } = *surface;
    let mut on_cut = vec![false; mesh.vertices.len()];
    for (face, k, other) in inner_edges(mesh, beside) {
        if keep[face] != keep[other] {
            for corner in [k, (k + 1) % 3] {
                on_cut[mesh.triangles[face][corner] as usize] = true;
            }
        }
    }
    let cut: Vec<Point3> =
        (mesh.vertices.iter().zip(&on_cut)).filter(|(_, on)| **on).map(|(p, _)| *p).collect();
    let tree = Neighbours::new(&cut);
    let inward_m: Vec<f64> = (mesh.vertices.par_iter())
        .map(|p| tree.one(p).map_or(f64::INFINITY, |near| near.distance()))
        .collect();
    let near =
        |face: usize| mesh.triangles[face].iter().any(|&v| inward_m[v as usize] < tuning.inward_m);
    let again = |face: usize| match (role[face], keep[face]) {
        (Role::Elsewhere, _) => Role::Elsewhere,
        (_, false) => Role::False,
        (Role::Open, true) if near(face) => Role::Open,
        (_, true) => Role::Cloth,
    };
    ((0..role.len()).map(again).collect(), inward_m)
}

/// What there is to say of a cut.
fn describe(surface: &Surface, role: &[Role], keep: Vec<bool>) -> Cut {
    /// An edge on the cut.
    struct CutEdge {
        dihedral_rad: f64,
        length_m: f64,
    }
    let Surface { mesh, beside, tuning, .. } = *surface;
    let cut_edges = inner_edges(mesh, beside).filter(|&(f, _, g)| keep[f] != keep[g]);
    let mut weak = Vec::new();
    let mut edges: Vec<CutEdge> = Vec::new();
    for (f, k, g) in cut_edges {
        let dihedral_rad = dihedral_rad(surface, f, k, g);
        if dihedral_rad < tuning.min_crease_rad {
            let corner = |c: usize| mesh.vertices[mesh.triangles[f][c % 3] as usize];
            weak.push(nalgebra::center(&corner(k), &corner(k + 1)));
        }
        edges.push(CutEdge { dihedral_rad, length_m: edge_m(mesh, f, k) });
    }
    edges.sort_by(|a, b| a.dihedral_rad.total_cmp(&b.dihedral_rad));
    let length_m: f64 = edges.iter().map(|e| e.length_m).sum();
    let mut walked = 0.0;
    let middle = edges.iter().find(|e| {
        walked += e.length_m;
        walked >= 0.5 * length_m
    });
    let crease_rad = middle.map_or(0.0, |e| e.dihedral_rad);
    let area = |counts: &dyn Fn(usize) -> bool| -> f64 {
        let faces = (0..mesh.triangles.len()).filter(|&f| counts(f));
        faces.map(|f| area_vector2(mesh, f).norm()).sum()
    };
    let joined = area(&|f| role[f] != Role::Elsewhere);
    let removed_share = area(&|f| !keep[f]) / joined.max(f64::MIN_POSITIVE);
    Cut { keep, removed_share, crease_rad, length_m, weak }
}

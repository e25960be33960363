//! Material coordinates: every surface point's place (u, v) on the flat cloth.
//!
//! A draped cloth is nearly inextensible, so unrolling it is an isometry, known
//! where it lies flat on the plate (there u = x, v = z). From there a front grows
//! over the neighbour graph in order of distance and carries the images of the
//! u and v axes along: the discrete exponential map (Schmidt, Grimm and Wyvill
//! 2006) with averaging over all neighbours already reached. On a developable
//! surface the result does not depend on the path, so missing patches are walked
//! around. `relax` then spreads the drift evenly.
//!
//! In: surface points, normals, local frame \[m\]. Out: (u, v) \[m\] of the points
//! that hang together with the plate. Fails where two layers of cloth touch over
//! more than a few millimetres: the front steps across.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::cloth::Cloth;
use super::neighbours::Neighbours;
use super::relax::Links;
use crate::base::{Point3, Vector3};

/// Surface points with material coordinates.
pub(super) struct Unrolled {
    /// Positions, local frame \[m\].
    pub points: Vec<Point3>,
    /// Material coordinates \[m\].
    pub flat: Vec<[f64; 2]>,
    /// See [`Cloth::disorder`].
    pub disorder: Vec<f64>,
    /// Whether the point lies flat on the plate, where its place is known.
    pub fixed: Vec<bool>,
    /// Links between them.
    pub links: Links,
}

/// Largest ratio of arc to chord: links whose normals are a right angle apart.
const LARGEST_ARC: f64 = 1.12;
/// Neighbour links reach this many spacings.
const LINK_SPACINGS: f64 = 2.4;

struct Graph {
    start: Vec<usize>,
    to: Vec<u32>,
}

impl Graph {
    fn new(cloth: &Cloth) -> Self {
        let tree = Neighbours::new(&cloth.surface);
        let radius = LINK_SPACINGS * cloth.spacing_m;
        let lists: Vec<Vec<u32>> = cloth
            .surface
            .par_iter()
            .enumerate()
            .map(|(i, p)| {
                let mut near = tree.within(p, radius);
                near.retain(|&j| j != i && linked(cloth, i, j));
                near.into_iter().map(|j| j as u32).collect()
            })
            .collect();
        let mut start = vec![0];
        let mut to = Vec::new();
        for list in lists {
            to.extend(list);
            start.push(to.len());
        }
        Self { start, to }
    }

    fn of(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.to[self.start[i]..self.start[i + 1]].iter().map(|&j| j as usize)
    }
}

/// Whether the step from i to j stays in the surface: it does not rise out of
/// either tangent plane and the planes do not differ too much.
fn linked(cloth: &Cloth, i: usize, j: usize) -> bool {
    let d = cloth.surface[j] - cloth.surface[i];
    let length = d.norm();
    let steep = 0.6 * length;
    length > 1e-9
        && d.dot(&cloth.normals[i]).abs() < steep
        && d.dot(&cloth.normals[j]).abs() < steep
        && cloth.normals[i].dot(&cloth.normals[j]).abs() > 0.4
}

/// The step from one point to another along the surface, as a tangent vector at
/// the first. Between them the surface is taken as the circular cylinder that has
/// both normals: the part of the chord along its axis stays, the part around it
/// becomes an arc. (The chord laid into the first tangent plane would point too
/// much along the axis, and folds would unroll too long.)
fn surface_step(d: &Vector3, from: &Vector3, to: &Vector3) -> Vector3 {
    let turn = from.cross(to);
    let sine = turn.norm();
    if sine < 1e-3 {
        return d - from * d.dot(from);
    }
    let axis = turn / sine;
    let half = 0.5 * sine.atan2(from.dot(to));
    let middle = (from + to).normalize();
    let around = axis.cross(&middle);
    let arc = d.dot(&around) * (half / half.sin()).min(LARGEST_ARC);
    axis * d.dot(&axis) + axis.cross(from) * arc
}

/// Unrolls the cloth outward from the plate's disc of radius `seed_radius_m`,
/// no farther than `reach_m` along the cloth.
pub(super) fn unroll(cloth: &Cloth, seed_radius_m: f64, reach_m: f64) -> Unrolled {
    let graph = Graph::new(cloth);
    let count = cloth.surface.len();
    let mut front = Front {
        graph: &graph,
        cloth,
        done: vec![false; count],
        normals: cloth.normals.clone(),
        axis: vec![Vector3::zeros(); count],
        flat: vec![[0.0; 2]; count],
    };
    let mut distance = vec![f64::INFINITY; count];
    let mut parent = vec![u32::MAX; count];
    let mut fixed = vec![false; count];
    let mut heap: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
    for (i, p) in cloth.surface.iter().enumerate() {
        if p.x.hypot(p.z) < seed_radius_m
            && p.y.abs() < 0.1 * seed_radius_m
            && front.normals[i].y.abs() > 0.8
        {
            fixed[i] = true;
            distance[i] = 0.0;
            heap.push(Reverse((0, i)));
        }
    }
    while let Some(Reverse((_, j))) = heap.pop() {
        if front.done[j] {
            continue;
        }
        if fixed[j] {
            let upward = front.normals[j].y.signum();
            front.normals[j] *= upward;
            front.axis[j] = tangent(&Vector3::x(), &front.normals[j]);
            front.flat[j] = [cloth.surface[j].x, cloth.surface[j].z];
        } else {
            front.advance(j, parent[j] as usize);
        }
        front.done[j] = true;
        if front.flat[j][0].hypot(front.flat[j][1]) > reach_m {
            continue;
        }
        for k in graph.of(j) {
            let through = distance[j]
                + (cloth.surface[k] - cloth.surface[j]).norm() * detour(cloth.disorder[k]);
            if !front.done[k] && through < distance[k] {
                distance[k] = through;
                parent[k] = j as u32;
                // Non-negative floats order like their bits.
                heap.push(Reverse((through.to_bits(), k)));
            }
        }
    }
    let reached =
        |i: &usize| front.done[*i] && front.flat[*i][0].hypot(front.flat[*i][1]) < reach_m;
    let kept: Vec<usize> = (0..count).filter(reached).collect();
    let mut number = vec![u32::MAX; count];
    for (k, &i) in kept.iter().enumerate() {
        number[i] = k as u32;
    }
    let Front { normals, flat, .. } = front;
    let lists = kept.iter().map(|&i| {
        let a = tangent(&any_across(&normals[i]), &normals[i]);
        let near: Vec<(u32, [f64; 2])> = graph
            .of(i)
            .filter(|&j| number[j] != u32::MAX && normals[i].dot(&normals[j]) > 0.0)
            .map(|j| {
                let d = cloth.surface[j] - cloth.surface[i];
                (number[j], in_plane(&surface_step(&d, &normals[i], &normals[j]), &a, &normals[i]))
            })
            .collect();
        near
    });
    Unrolled {
        points: kept.iter().map(|&i| cloth.surface[i]).collect(),
        links: Links::new(lists),
        flat: kept.iter().map(|&i| flat[i]).collect(),
        disorder: kept.iter().map(|&i| cloth.disorder[i]).collect(),
        fixed: kept.iter().map(|&i| fixed[i]).collect(),
    }
}

/// How much longer a step counts that leads to a disordered point: the front
/// walks around places where two layers touch and enters them last, from both
/// sides.
fn detour(disorder: f64) -> f64 {
    1.0 + 10.0 * (disorder - 2.5).clamp(0.0, 10.0)
}

fn tangent(v: &Vector3, normal: &Vector3) -> Vector3 {
    (v - normal * v.dot(normal)).normalize()
}

/// A tangent vector in the axes `a` and `a x n`.
fn in_plane(step: &Vector3, a: &Vector3, normal: &Vector3) -> [f64; 2] {
    [step.dot(a), step.dot(&a.cross(normal))]
}

/// The front that spreads over the points, and what it has placed.
struct Front<'a> {
    graph: &'a Graph,
    cloth: &'a Cloth,
    done: Vec<bool>,
    normals: Vec<Vector3>,
    axis: Vec<Vector3>,
    flat: Vec<[f64; 2]>,
}

impl Front<'_> {
    /// Places point j from the neighbour that the front came from and the other
    /// placed neighbours that agree with it.
    fn advance(&mut self, j: usize, parent: usize) {
        if self.normals[parent].dot(&self.normals[j]) < 0.0 {
            self.normals[j] = -self.normals[j];
        }
        let through = |i: usize| {
            let d = self.cloth.surface[j] - self.cloth.surface[i];
            let chord = d.norm();
            let step = in_plane(
                &surface_step(&d, &self.normals[i], &self.normals[j]),
                &self.axis[i],
                &self.normals[i],
            );
            ([self.flat[i][0] + step[0], self.flat[i][1] + step[1]], 1.0 / chord)
        };
        // The largest group of neighbours that say the same: two layers that touch
        // put the point into two places.
        let said: Vec<(usize, [f64; 2], f64)> = self
            .graph
            .of(j)
            .filter(|&i| self.done[i] && self.normals[i].dot(&self.normals[j]) > 0.0)
            .map(|i| {
                let (at, weight) = through(i);
                (i, at, weight)
            })
            .collect();
        let agree = |a: &[f64; 2], b: &[f64; 2]| {
            (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) < self.cloth.spacing_m.powi(2)
        };
        let support =
            |a: &[f64; 2]| -> f64 { said.iter().filter(|s| agree(a, &s.1)).map(|s| s.2).sum() };
        let Some(best) = said.iter().max_by(|a, b| support(&a.1).total_cmp(&support(&b.1))) else {
            self.flat[j] = [f64::NAN; 2];
            return;
        };
        let mut along = Vector3::zeros();
        let mut sum = [0.0; 2];
        let mut weights = 0.0;
        for (i, at, weight) in said.iter().filter(|s| agree(&best.1, &s.1)) {
            along += transport(&self.axis[*i], &self.normals[*i], &self.normals[j]) * *weight;
            sum[0] += weight * at[0];
            sum[1] += weight * at[1];
            weights += weight;
        }
        self.flat[j] = [sum[0] / weights, sum[1] / weights];
        self.axis[j] = tangent(&along, &self.normals[j]);
    }
}

/// Parallel transport: the smallest rotation that takes normal `from` to `to`.
fn transport(a: &Vector3, from: &Vector3, to: &Vector3) -> Vector3 {
    let turn = from.cross(to);
    let cosine = from.dot(to);
    // Rodrigues with sin * axis = turn; 1 + cosine > 0 by the caller's filter.
    a * cosine + turn.cross(a) + turn * (turn.dot(a) / (1.0 + cosine))
}

fn any_across(normal: &Vector3) -> Vector3 {
    if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_around_a_cylinder_has_the_arc_and_the_height() {
        let radius = 6e-3;
        let at = |angle: f64, height: f64| {
            Vector3::new(radius * angle.cos(), height, radius * angle.sin())
        };
        let normal = |angle: f64| Vector3::new(angle.cos(), 0.0, angle.sin());
        for (angle, height) in [(0.01, 2e-3), (0.5, -3e-3), (0.9, 4e-3)] {
            let step =
                surface_step(&(at(angle, height) - at(0.0, 0.0)), &normal(0.0), &normal(angle));
            assert!((step.y - height).abs() < 1e-12, "{angle}");
            assert!(
                (step.z - radius * angle).abs() < 1e-9,
                "{angle}: {}",
                step.z / (radius * angle)
            );
            assert!(step.x.abs() < 1e-5 * radius);
        }
    }
}

//! Material coordinates by a geodesic front: every surface point's place (u, v) on the flat
//! cloth.
//!
//! A draped cloth is nearly inextensible, so its parameterisation is an isometry, known
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

use super::super::cloth::Cloth;
use super::super::tuning::ParameterisationTuning;
use super::links::Links;
use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;

/// Surface points with their places in the parameter plane.
pub(crate) struct Parameterisation {
    /// Positions, local frame \[m\].
    pub points: Vec<Point3>,
    /// Places in the parameter plane \[m\].
    pub flat: Vec<[f64; 2]>,
    /// See [`Cloth::disorder`].
    pub disorder: Vec<f64>,
    /// Whether the point lies flat on the plate, where its place is known.
    pub fixed: Vec<bool>,
    /// Links between them; used up by the relaxation.
    pub links: Links,
}

struct Graph {
    start: Vec<usize>,
    to: Vec<u32>,
}

impl Graph {
    fn new(cloth: &Cloth, tuning: &ParameterisationTuning) -> Self {
        let tree = Neighbours::new(&cloth.surface);
        let radius = tuning.link_cells * cloth.spacing_m;
        let lists: Vec<Vec<u32>> = cloth
            .surface
            .par_iter()
            .enumerate()
            .map(|(i, p)| {
                let mut near = tree.within(p, radius);
                near.retain(|&j| j != i && linked(cloth, i, j, tuning));
                near.sort_unstable();
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
fn linked(cloth: &Cloth, i: usize, j: usize, tuning: &ParameterisationTuning) -> bool {
    let d = cloth.surface[j] - cloth.surface[i];
    let length = d.norm();
    let steep = tuning.link_rise * length;
    length > 1e-9
        && d.dot(&cloth.normals[i]).abs() < steep
        && d.dot(&cloth.normals[j]).abs() < steep
        && cloth.normals[i].dot(&cloth.normals[j]).abs() > tuning.link_cosine
}

/// The step from one point to another along the surface, as a tangent vector at
/// the first. Between them the surface is taken as the circular cylinder that has
/// both normals: the part of the chord along its axis stays, the part around it
/// becomes an arc. (The chord laid into the first tangent plane would point too
/// much along the axis, and folds would come out too long.)
fn surface_step(d: &Vector3, from: &Vector3, to: &Vector3, largest_arc: f64) -> Vector3 {
    let cross = from.cross(to);
    let sine = cross.norm();
    if sine < 1e-3 {
        return d - from * d.dot(from);
    }
    let axis = cross / sine;
    let half = 0.5 * sine.atan2(from.dot(to));
    let middle = (from + to).normalize();
    let around = axis.cross(&middle);
    let arc = d.dot(&around) * (half / half.sin()).min(largest_arc);
    axis * d.dot(&axis) + axis.cross(from) * arc
}

/// Parameterises the cloth outward from the plate's disc of radius `seed_radius_m`,
/// no farther than `reach_m` along the cloth.
pub(super) fn grow(
    cloth: &Cloth,
    seed_radius_m: f64,
    reach_m: f64,
    tuning: &ParameterisationTuning,
) -> Parameterisation {
    let graph = Graph::new(cloth, tuning);
    let count = cloth.surface.len();
    let mut front = Front {
        graph: &graph,
        cloth,
        tuning,
        done: vec![false; count],
        normals: cloth.normals.clone(),
        axis: vec![Vector3::zeros(); count],
        flat: vec![[0.0; 2]; count],
    };
    let fixed = front.run(seed_radius_m, reach_m);
    let reached =
        |i: &usize| front.done[*i] && front.flat[*i][0].hypot(front.flat[*i][1]) < reach_m;
    let kept: Vec<usize> = (0..count).filter(reached).collect();
    let Front { normals, flat, .. } = front;
    Parameterisation {
        points: kept.iter().map(|&i| cloth.surface[i]).collect(),
        links: links_of(&kept, &graph, cloth, &normals, tuning.largest_arc),
        flat: kept.iter().map(|&i| flat[i]).collect(),
        disorder: kept.iter().map(|&i| cloth.disorder[i]).collect(),
        fixed: kept.iter().map(|&i| fixed[i]).collect(),
    }
}

/// The links among the points `kept`, whose normals agree in sign.
fn links_of(
    kept: &[usize],
    graph: &Graph,
    cloth: &Cloth,
    normals: &[Vector3],
    largest_arc: f64,
) -> Links {
    let mut number = vec![u32::MAX; cloth.surface.len()];
    for (k, &i) in kept.iter().enumerate() {
        number[i] = k as u32;
    }
    Links::new(kept.iter().map(|&i| {
        let a = tangent(&any_across(&normals[i]), &normals[i]);
        let near: Vec<(u32, [f64; 2])> = graph
            .of(i)
            .filter(|&j| number[j] != u32::MAX && normals[i].dot(&normals[j]) > 0.0)
            .map(|j| {
                let d = cloth.surface[j] - cloth.surface[i];
                let step = surface_step(&d, &normals[i], &normals[j], largest_arc);
                (number[j], in_plane(&step, &a, &normals[i]))
            })
            .collect();
        near
    }))
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
    tuning: &'a ParameterisationTuning,
    done: Vec<bool>,
    normals: Vec<Vector3>,
    axis: Vec<Vector3>,
    flat: Vec<[f64; 2]>,
}

/// Where a neighbour that is placed already puts a point.
struct Vote {
    from: usize,
    at: [f64; 2],
    weight: f64,
}

impl Front<'_> {
    /// Grows over all points in order of distance; says which lie flat on the plate.
    fn run(&mut self, seed_radius_m: f64, reach_m: f64) -> Vec<bool> {
        let (cloth, graph) = (self.cloth, self.graph);
        let count = cloth.surface.len();
        let mut distance = vec![f64::INFINITY; count];
        let mut parent = vec![u32::MAX; count];
        let mut fixed = vec![false; count];
        let mut heap: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
        for (i, p) in cloth.surface.iter().enumerate() {
            if p.x.hypot(p.z) < seed_radius_m
                && p.y.abs() < 0.1 * seed_radius_m
                && self.normals[i].y.abs() > 0.8
            {
                fixed[i] = true;
                distance[i] = 0.0;
                heap.push(Reverse((0, i)));
            }
        }
        while let Some(Reverse((_, j))) = heap.pop() {
            if self.done[j] {
                continue;
            }
            if fixed[j] {
                self.seed(j);
            } else {
                self.advance(j, parent[j] as usize);
            }
            self.done[j] = true;
            if self.flat[j][0].hypot(self.flat[j][1]) > reach_m {
                continue;
            }
            for k in graph.of(j) {
                let through = distance[j]
                    + (cloth.surface[k] - cloth.surface[j]).norm() * self.detour(cloth.disorder[k]);
                if !self.done[k] && through < distance[k] {
                    distance[k] = through;
                    parent[k] = j as u32;
                    // Non-negative floats order like their bits.
                    heap.push(Reverse((through.to_bits(), k)));
                }
            }
        }
        fixed
    }

    /// How much longer a step counts that leads to a disordered point: the front walks
    /// around places where two layers touch and enters them last, from both sides.
    fn detour(&self, disorder: f64) -> f64 {
        let more = (disorder - self.tuning.detour_disorder).clamp(0.0, 10.0);
        1.0 + self.tuning.detour * more
    }

    /// Places a point on the plate, where its place is known.
    fn seed(&mut self, j: usize) {
        let upward = self.normals[j].y.signum();
        self.normals[j] *= upward;
        self.axis[j] = tangent(&Vector3::x(), &self.normals[j]);
        self.flat[j] = [self.cloth.surface[j].x, self.cloth.surface[j].z];
    }

    /// Places point j from the neighbour that the front came from and the other
    /// placed neighbours that agree with it.
    fn advance(&mut self, j: usize, parent: usize) {
        if self.normals[parent].dot(&self.normals[j]) < 0.0 {
            self.normals[j] = -self.normals[j];
        }
        let through = |i: usize| {
            let d = self.cloth.surface[j] - self.cloth.surface[i];
            let chord = d.norm();
            let largest_arc = self.tuning.largest_arc;
            let step = surface_step(&d, &self.normals[i], &self.normals[j], largest_arc);
            let step = in_plane(&step, &self.axis[i], &self.normals[i]);
            let at = [self.flat[i][0] + step[0], self.flat[i][1] + step[1]];
            Vote { from: i, at, weight: 1.0 / chord }
        };
        // The largest group of neighbours that say the same: two layers that touch
        // put the point into two places.
        let votes: Vec<Vote> = self
            .graph
            .of(j)
            .filter(|&i| self.done[i] && self.normals[i].dot(&self.normals[j]) > 0.0)
            .map(through)
            .collect();
        let agree = |a: &Vote, b: &Vote| {
            (a.at[0] - b.at[0]).powi(2) + (a.at[1] - b.at[1]).powi(2) < self.cloth.spacing_m.powi(2)
        };
        let support =
            |a: &Vote| -> f64 { votes.iter().filter(|v| agree(a, v)).map(|v| v.weight).sum() };
        let Some(best) = votes.iter().max_by(|a, b| support(a).total_cmp(&support(b))) else {
            self.flat[j] = [f64::NAN; 2];
            return;
        };
        let mut along = Vector3::zeros();
        let mut sum = [0.0; 2];
        let mut weights = 0.0;
        for Vote { from, at, weight } in votes.iter().filter(|v| agree(best, v)) {
            along += transport(&self.axis[*from], &self.normals[*from], &self.normals[j]) * *weight;
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
    let cross = from.cross(to);
    let cosine = from.dot(to);
    // Rodrigues with sin * axis = cross; 1 + cosine > 0 by the caller's filter.
    a * cosine + cross.cross(a) + cross * (cross.dot(a) / (1.0 + cosine))
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
            let step = surface_step(
                &(at(angle, height) - at(0.0, 0.0)),
                &normal(0.0),
                &normal(angle),
                1.12,
            );
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

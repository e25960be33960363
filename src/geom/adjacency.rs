//! Which triangles of a mesh meet, where it ends, and points spread over it.
//!
//! In: triangles on shared vertices (see [`weld`] for files that repeat them at seams).
//! An edge of two triangles joins them; one of a single triangle is part of the
//! boundary; one of three or more joins nothing and bounds nothing.

use std::collections::HashMap;

use super::mesh::Mesh;
use crate::base::{Point3, Vector3};

/// No neighbour, across the boundary.
const BOUNDARY: u32 = u32::MAX;
/// No neighbour, across an edge of three or more triangles.
const MANY: u32 = u32::MAX - 1;

/// The triangles beside each triangle.
pub struct Adjacency {
    /// Across the edge from corner k to corner k + 1 of each triangle.
    beside: Vec<[u32; 3]>,
}

impl Adjacency {
    /// Of these triangles.
    #[must_use]
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut edges: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * triangles.len());
        for (face, t) in (0_u32..).zip(triangles) {
            for k in 0..3_u8 {
                let (a, b) = (t[usize::from(k)], t[usize::from((k + 1) % 3)]);
                edges.push(([a.min(b), a.max(b)], face, k));
            }
        }
        edges.sort_unstable();
        let mut beside = vec![[BOUNDARY; 3]; triangles.len()];
        for group in edges.chunk_by(|a, b| a.0 == b.0) {
            match group {
                [_] => {}
                &[(_, f, k), (_, g, l)] => {
                    beside[f as usize][usize::from(k)] = g;
                    beside[g as usize][usize::from(l)] = f;
                }
                many => many.iter().for_each(|e| beside[e.1 as usize][usize::from(e.2)] = MANY),
            }
        }
        Self { beside }
    }

    /// The triangle across edge `k` of `face`, if there is one other.
    #[must_use]
    pub fn across(&self, face: usize, k: usize) -> Option<usize> {
        let beside = self.beside[face][k];
        (beside < MANY).then_some(beside as usize)
    }

    /// Whether edge `k` of `face` belongs to no other triangle.
    #[must_use]
    pub fn is_boundary(&self, face: usize, k: usize) -> bool {
        self.beside[face][k] == BOUNDARY
    }
}

/// Unites vertices at the same place: files repeat them along the seams of textures.
/// Triangles that name a place twice after that are dropped.
#[must_use]
pub fn weld(mesh: &Mesh) -> Mesh {
    let mut index_of: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.vertices.len());
    let mut vertices = Vec::with_capacity(mesh.vertices.len());
    let place_of: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|p| {
            // Adding 0 makes the negative zero positive.
            let key = [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
            *index_of.entry(key).or_insert_with(|| {
                vertices.push(*p);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| place_of[v as usize]));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    Mesh { vertices, triangles }
}

/// Twice the area of a triangle, along its normal.
#[must_use]
pub fn area_vector2(mesh: &Mesh, face: usize) -> Vector3 {
    let [a, b, c] = mesh.triangles[face].map(|v| mesh.vertices[v as usize]);
    (b - a).cross(&(c - a))
}

/// One of the points that [`spread`] gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Its place.
    pub at: Point3,
    /// Its triangle.
    pub face: u32,
    /// The corner of the triangle (a vertex of the mesh) with the largest weight.
    pub vertex: u32,
}

/// Points spread evenly over the triangles, about `spacing` apart. The same mesh gives
/// the same points.
///
/// The places follow the R2 sequence (Roberts 2018) folded into each triangle; the
/// share of a point that is left over goes to the next triangle.
pub fn spread(mesh: &Mesh, spacing: f64) -> impl Iterator<Item = Sample> + '_ {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let mut owed = 0.5;
    let mut drawn = 0_u32;
    mesh.triangles.iter().enumerate().flat_map(move |(face, t)| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        owed += 0.5 * area_vector2(mesh, face).norm() / (spacing * spacing);
        let count = if owed.is_finite() { owed.floor().max(0.0) } else { 0.0 };
        owed = (owed - count).max(0.0);
        let first = drawn;
        drawn = drawn.wrapping_add(count as u32);
        (0..count as u32).map(move |k| {
            let at = f64::from(first.wrapping_add(k));
            let [mut u, mut v] = STEPS.map(|step| (0.5 + at * step).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let weights = [1.0 - u - v, u, v];
            let nearest = (0..3).max_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
            let at = a + (b - a) * u + (c - a) * v;
            Sample { at, face: face as u32, vertex: t[nearest] }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a unit square, the second on its own vertices.
    fn square() -> Mesh {
        let at = |x: f64, y: f64| Point3::new(x, y, 0.0);
        Mesh {
            vertices: vec![at(0., 0.), at(1., 0.), at(1., 1.), at(0., -0.), at(1., 1.), at(0., 1.)],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        }
    }

    #[test]
    fn welded_triangles_meet_and_the_rest_is_boundary() {
        let apart = Adjacency::new(&square().triangles);
        assert!((0..2).all(|f| (0..3).all(|k| apart.is_boundary(f, k))));
        let mesh = weld(&square());
        assert_eq!(mesh.vertices.len(), 4);
        let joined = Adjacency::new(&mesh.triangles);
        assert_eq!((joined.across(0, 2), joined.across(1, 0)), (Some(1), Some(0)));
        let ends = (0..2).flat_map(|f| (0..3).map(move |k| (f, k)));
        assert_eq!(ends.filter(|&(f, k)| joined.is_boundary(f, k)).count(), 4);
    }

    #[test]
    fn an_edge_of_three_triangles_joins_and_bounds_nothing() {
        let fan = [[0, 1, 2], [0, 1, 3], [1, 0, 4]];
        let fan = Adjacency::new(&fan);
        assert!(fan.across(0, 0).is_none() && !fan.is_boundary(0, 0) && fan.is_boundary(0, 1));
    }

    #[test]
    fn points_are_spread_by_area_and_lie_on_the_mesh() {
        let mut mesh = square();
        // A second square of a quarter of the area.
        let small: Vec<Point3> = mesh.vertices.iter().map(|p| p * 0.5 + Vector3::z()).collect();
        mesh.vertices.extend(small);
        mesh.triangles.extend([[6, 7, 8], [9, 10, 11]]);
        let points: Vec<Point3> = spread(&mesh, 0.01).map(|p| p.at).collect();
        assert!((points.len() as f64 - 12_500.0).abs() < 2.0, "{}", points.len());
        let upper = points.iter().filter(|p| p.z > 0.5).count();
        assert!((upper as f64 - 2_500.0).abs() < 2.0, "{upper}");
        assert!(points.iter().all(|p| p.z == 0.0 || p.z == 1.0));
        // Evenly: each tenth of the lower square's side has a tenth of its points.
        for k in 0..10 {
            let range = f64::from(k) / 10.0..f64::from(k + 1) / 10.0;
            let n = points.iter().filter(|p| p.z == 0.0 && range.contains(&p.x)).count();
            assert!((n as f64 - 1000.0).abs() < 60.0, "{k}: {n}");
        }
    }
}

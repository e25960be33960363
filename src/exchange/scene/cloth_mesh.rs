//! The flat cloth of a scene as a mesh.
//!
//! A square has square cells along the yarns, each cut in two triangles whose diagonals alternate:
//! diagonals that run one way make a grid stiffer about one of them (`hinge`). A disc has rings of
//! 6, 12, 18 ... vertices, which make nearly equilateral triangles and a round rim: a grid that is
//! cut out would have steps or slivers there.

use crate::sim::drop::CANONICAL_WAVES;

/// The flat cloth: x along the warp, y along the weft, from its centre.
pub(in crate::exchange) struct ClothMesh {
    /// Vertices \[m\].
    pub(in crate::exchange) points_m: Vec<[f64; 2]>,
    /// Square cells, of a square alone.
    pub(in crate::exchange) quads: Vec<[usize; 4]>,
    /// Triangles, with the face up.
    pub(in crate::exchange) triangles: Vec<[usize; 3]>,
    /// Half of its extent \[m\].
    half_m: f64,
}

impl ClothMesh {
    /// A square of this side, with cells of about `edge_m` \[m\].
    pub(super) fn square(side_m: f64, edge_m: f64) -> Self {
        let n = (side_m / edge_m).round().max(1.0) as usize;
        let at = |i: usize| side_m * (i as f64 / n as f64 - 0.5);
        let corner = |i: usize, j: usize| i * (n + 1) + j;
        let points_m = (0..=n).flat_map(|i| (0..=n).map(move |j| [at(i), at(j)])).collect();
        let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let (mut quads, mut triangles) = (Vec::new(), Vec::new());
        for (i, j) in cells {
            let [a, b] = [corner(i, j), corner(i + 1, j)];
            let [c, d] = [corner(i + 1, j + 1), corner(i, j + 1)];
            quads.push([a, b, c, d]);
            triangles.extend(if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
        Self { points_m, quads, triangles, half_m: 0.5 * side_m }
    }

    /// A disc of this radius, with rings about `edge_m` apart \[m\].
    pub(super) fn disc(radius_m: f64, edge_m: f64) -> Self {
        let rings = (radius_m / edge_m).round().max(1.0) as usize;
        let mut points_m = vec![[0.0, 0.0]];
        for k in 1..=rings {
            let r = radius_m * k as f64 / rings as f64;
            points_m.extend((0..6 * k).map(|m| {
                let (sin, cos) = (std::f64::consts::TAU * m as f64 / (6 * k) as f64).sin_cos();
                [r * cos, r * sin]
            }));
        }
        // a ring begins behind the 1 + 6 (1 + ... + (k - 1)) vertices within it
        let at = |k: usize, m: usize| if k == 0 { 0 } else { 1 + 3 * k * (k - 1) + m % (6 * k) };
        let mut triangles = Vec::new();
        for k in 1..=rings {
            for sixth in 0..6 {
                for m in 0..k {
                    let (outer, inner) = (sixth * k + m, sixth * (k - 1) + m);
                    triangles.push([at(k, outer), at(k, outer + 1), at(k - 1, inner)]);
                    if m + 1 < k {
                        triangles.push([at(k - 1, inner), at(k, outer + 1), at(k - 1, inner + 1)]);
                    }
                }
            }
        }
        Self { points_m, quads: Vec::new(), triangles, half_m: radius_m }
    }

    /// Its area \[m^2\].
    pub(super) fn area_m2(&self) -> f64 {
        let double = |&[a, b, c]: &[usize; 3]| {
            let [a, b, c] = [a, b, c].map(|p| self.points_m[p]);
            (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        };
        0.5 * self.triangles.iter().map(double).sum::<f64>()
    }

    /// Mean length of the sides of its cells: quads where it has them, else triangles \[m\].
    pub(super) fn mean_edge_m(&self) -> f64 {
        let length = |a: usize, b: usize| {
            let ([x, y], [u, v]) = (self.points_m[a], self.points_m[b]);
            (u - x).hypot(v - y)
        };
        let of_quads = self.quads.iter().flat_map(|&[a, b, c, d]| [[a, b], [b, c], [c, d], [d, a]]);
        let of_triangles = self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let sides: Vec<_> =
            if self.quads.is_empty() { of_triangles.collect() } else { of_quads.collect() };
        sides.iter().map(|&[a, b]| length(a, b)).sum::<f64>() / sides.len() as f64
    }

    /// Height of each vertex before the fall, by the unevenness of the canonical drop \[m\].
    pub(super) fn unevenness_m(&self) -> Vec<f64> {
        let height_m = |&[x, y]: &[f64; 2]| -> f64 {
            let (x, z) = (x / self.half_m, -y / self.half_m);
            CANONICAL_WAVES.iter().map(|wave| wave.height_at_m(x, z)).sum()
        };
        self.points_m.iter().map(height_m).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// How many triangles have each edge.
    fn edges(mesh: &ClothMesh) -> HashMap<[usize; 2], usize> {
        let mut count = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *count.entry([p.min(q), p.max(q)]).or_insert(0) += 1;
            }
        }
        count
    }

    #[test]
    fn both_are_one_sheet_without_holes_face_up() {
        for (mesh, rim) in [(ClothMesh::square(0.3, 0.01), 120), (ClothMesh::disc(0.15, 0.01), 90)]
        {
            let edges = edges(&mesh);
            assert!(edges.values().all(|&count| count <= 2));
            assert_eq!(edges.values().filter(|&&count| count == 1).count(), rim);
            // Euler: vertices - edges + faces is 1 for a disc
            assert_eq!(mesh.points_m.len() + mesh.triangles.len(), edges.len() + 1);
            for &[a, b, c] in &mesh.triangles {
                let [a, b, c] = [a, b, c].map(|p| mesh.points_m[p]);
                let double = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
                assert!(double > 0.0);
            }
        }
    }

    #[test]
    fn areas_and_counts_are_those_of_the_outline() {
        let square = ClothMesh::square(0.3, 0.01);
        assert_eq!(
            [square.points_m.len(), square.quads.len(), square.triangles.len()],
            [961, 900, 1800]
        );
        assert!((square.area_m2() - 0.09).abs() < 1e-12);
        let disc = ClothMesh::disc(0.15, 0.005);
        assert_eq!([disc.points_m.len(), disc.triangles.len()], [1 + 3 * 30 * 31, 6 * 900]);
        // a polygon of 180 corners
        let polygon = 90.0 * 0.15 * 0.15 * (std::f64::consts::TAU / 180.0).sin();
        assert!((disc.area_m2() / polygon - 1.0).abs() < 1e-12);
        assert!((disc.mean_edge_m() / 0.005 - 1.0).abs() < 0.12);
    }
}

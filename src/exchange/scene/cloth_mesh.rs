//! The flat cloth of a scene as a mesh of nearly equilateral triangles.
//!
//! Hinges between such triangles bend alike about every axis. A square has rows of vertices along
//! the warp, every other one moved by half a step. A disc has rings of 6, 12, 18 ... vertices.
//! Work to bend the mesh over that of the plate, as `MuJoCo` has it (`scripts/export/hinges.py`):
//!
//! | mesh | about the yarns | about the bias |
//! |---|---|---|
//! | this square | 0.97 to 0.99 | 0.99 |
//! | this disc, whose triangles are a tenth higher than equilateral ones | 1.11 | 1.11 |
//! | square cells with alternating diagonals | 0.97 | 1.48 |

use crate::sim::drop::CANONICAL_WAVES;

/// The flat cloth: x along the warp, y along the weft, from its centre.
pub(in crate::exchange) struct ClothMesh {
    /// Vertices \[m\].
    pub(in crate::exchange) points_m: Vec<[f64; 2]>,
    /// Triangles, with the face up.
    pub(in crate::exchange) triangles: Vec<[usize; 3]>,
    /// Half of its extent \[m\].
    half_m: f64,
}

impl ClothMesh {
    /// A square of this side, with edges of about `edge_m` \[m\].
    pub(super) fn square(side_m: f64, edge_m: f64) -> Self {
        let steps = (side_m / edge_m).round().max(1.0) as usize;
        let rows = (side_m / (edge_m * 0.75_f64.sqrt())).round().max(1.0) as usize;
        let at = |share: f64| side_m * (share - 0.5);
        // an odd row has one vertex more: half a step at either end
        let mut points_m = Vec::new();
        let mut first = Vec::new();
        for row in 0..=rows {
            first.push(points_m.len());
            let y = at(row as f64 / rows as f64);
            let last = steps + row % 2;
            points_m.extend((0..=last).map(|k| {
                let k =
                    if row % 2 == 0 { k as f64 } else { (k as f64 - 0.5).clamp(0.0, steps as f64) };
                [at(k / steps as f64), y]
            }));
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            let even_below = row % 2 == 0;
            let (even, odd) = if even_below {
                (first[row], first[row + 1])
            } else {
                (first[row + 1], first[row])
            };
            // tip on the even row, then base on it; the face is up if the even row lies below
            let of_row = (0..=steps).map(|k| [even + k, odd + k + 1, odd + k]);
            let between = (0..steps).map(|k| [even + k, even + k + 1, odd + k + 1]);
            triangles.extend(
                of_row.chain(between).map(
                    |[a, b, c]| {
                        if even_below { [a, b, c] } else { [a, c, b] }
                    },
                ),
            );
        }
        Self { points_m, triangles, half_m: 0.5 * side_m }
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
        Self { points_m, triangles, half_m: radius_m }
    }

    /// Its area \[m^2\].
    pub(super) fn area_m2(&self) -> f64 {
        let double = |&[a, b, c]: &[usize; 3]| {
            let [a, b, c] = [a, b, c].map(|p| self.points_m[p]);
            (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        };
        0.5 * self.triangles.iter().map(double).sum::<f64>()
    }

    /// Mean length of the sides of its triangles \[m\].
    pub(super) fn mean_edge_m(&self) -> f64 {
        let length = |a: usize, b: usize| {
            let ([x, y], [u, v]) = (self.points_m[a], self.points_m[b]);
            (u - x).hypot(v - y)
        };
        let around = |&[a, b, c]: &[usize; 3]| length(a, b) + length(b, c) + length(c, a);
        self.triangles.iter().map(around).sum::<f64>() / (3 * self.triangles.len()) as f64
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
        for (mesh, rim) in [(ClothMesh::square(0.3, 0.01), 131), (ClothMesh::disc(0.15, 0.01), 90)]
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
        // 35 rows of 60 and a half triangles
        assert_eq!([square.points_m.len(), square.triangles.len()], [1134, 2135]);
        assert!((square.area_m2() - 0.09).abs() < 1e-12);
        let disc = ClothMesh::disc(0.15, 0.005);
        assert_eq!([disc.points_m.len(), disc.triangles.len()], [1 + 3 * 30 * 31, 6 * 900]);
        // a polygon of 180 corners
        let polygon = 90.0 * 0.15 * 0.15 * (std::f64::consts::TAU / 180.0).sin();
        assert!((disc.area_m2() / polygon - 1.0).abs() < 1e-12);
        assert!((disc.mean_edge_m() / 0.005 - 1.12).abs() < 0.02);
    }
}

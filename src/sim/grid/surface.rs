//! What is read off a grid's vertices: triangles, mesh, rim, and the positions on a finer grid.

use std::borrow::Cow;

use super::Grid;
use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;

/// The eight neighbours.
const NEIGHBOURS: [(isize, isize); 8] =
    [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)];

impl Grid {
    /// The positions `x`, but with the vertices outside a disc where the sheet would be if it
    /// went on straight.
    fn continued<'a>(&self, x: &'a [Vector3]) -> Cow<'a, [Vector3]> {
        let mut missing = self.outside();
        if missing.is_empty() {
            return x.into();
        }
        let mut y = x.to_vec();
        let mut known: Vec<bool> = self.shares.iter().map(|&s| s > 0.0).collect();
        while !missing.is_empty() {
            let mut found = Vec::new();
            for &v in &missing {
                let (i, j) = ((v / self.n) as isize, (v % self.n) as isize);
                let at = |i: isize, j: isize| {
                    let inside =
                        (0..self.rows as isize).contains(&i) && (0..self.n as isize).contains(&j);
                    let at = (i * self.n as isize + j) as usize;
                    (inside && known[at]).then(|| y[at])
                };
                let (mut sum, mut count) = (Vector3::zeros(), 0.0);
                for (di, dj) in NEIGHBOURS {
                    if let (Some(a), Some(b)) = (at(i + di, j + dj), at(i + 2 * di, j + 2 * dj)) {
                        sum += a * 2.0 - b;
                        count += 1.0;
                    }
                }
                if count > 0.0 {
                    found.push((v, sum / count));
                }
            }
            if found.is_empty() {
                break;
            }
            for (v, p) in found {
                y[v] = p;
                known[v] = true;
            }
            missing.retain(|&v| !known[v]);
        }
        y.into()
    }

    /// The sheet as triangles, two a cell, as indices of vertices; their front is the cloth's face,
    /// which lies up on the flat specimen. The diagonals alternate from cell to cell. They matter
    /// for pictures and for self-contact, and for no elastic energy.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(2 * self.cells.len());
        for &[a, b, c, d] in &self.cells {
            let (i, j) = (a as usize / self.n, a as usize % self.n);
            if (i + j) % 2 == 0 {
                triangles.extend([[a, c, d], [a, d, b]]);
            } else {
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        triangles
    }

    /// Radius of a disc \[m\]; `None` for a specimen with sides.
    #[must_use]
    pub fn disc_radius_m(&self) -> Option<f64> {
        self.plan.disc_radius_m
    }

    /// The sheet's mesh at the vertex positions `x` \[m\]. The outermost vertices of a disc are
    /// drawn in to its rim.
    #[must_use]
    pub fn mesh(&self, x: &[Vector3]) -> Mesh {
        let mut vertices: Vec<_> = x.iter().map(|&v| Point3::from(v)).collect();
        if let Some(radius_m) = self.plan.disc_radius_m {
            let x = self.continued(x);
            for (v, p) in vertices.iter_mut().enumerate() {
                let flat = self.flat(v);
                if self.shares[v] > 0.0 && flat.norm() > radius_m {
                    let rim = flat * (radius_m / flat.norm());
                    *p = Point3::from(self.between(&x, [rim.x, rim.z]));
                }
            }
        }
        Mesh { vertices, triangles: self.triangles() }.without_stray_vertices()
    }

    /// The indices of the border's vertices in the order of [`crate::base::boundary`], each corner
    /// once: 4 (n - 1) of them.
    #[must_use]
    pub fn border(&self) -> Vec<usize> {
        let last = self.n - 1;
        let at = |i: usize, j: usize| i * self.n + j;
        let mut border = Vec::with_capacity(4 * last);
        border.extend((0..last).map(|k| at(last, k)));
        border.extend((0..last).map(|k| at(last - k, last)));
        border.extend((0..last).map(|k| at(0, last - k)));
        border.extend((0..last).map(|k| at(k, 0)));
        border
    }

    /// The rim at the vertex positions `x` \[m\], linear between vertices: 244 points in the order
    /// of [`crate::base::boundary`]. A disc has no corners; its 244 points lie evenly around it,
    /// from 45 degrees before +x on, towards +z.
    #[must_use]
    pub fn boundary(&self, x: &[Vector3]) -> Boundary {
        if let Some(radius_m) = self.plan.disc_radius_m {
            return self.disc_boundary(x, radius_m);
        }
        let border = self.border();
        let at = |index: usize| {
            let (side, k) = (index / POINTS_PER_SIDE, index % POINTS_PER_SIDE);
            let along = k as f64 * (self.n - 1) as f64 / (POINTS_PER_SIDE - 1) as f64;
            let whole = (along.floor() as usize).min(self.n - 2);
            let fraction = along - whole as f64;
            let from = side * (self.n - 1) + whole;
            let (a, b) = (x[border[from]], x[border[(from + 1) % border.len()]]);
            Point3::from(a * (1.0 - fraction) + b * fraction)
        };
        debug_assert_eq!(POINTS, SIDES * POINTS_PER_SIDE);
        match Boundary::exact((0..POINTS).map(at)) {
            Ok(boundary) => boundary,
            Err(_) => unreachable!("the walk has exactly {POINTS} points"),
        }
    }

    fn disc_boundary(&self, x: &[Vector3], radius_m: f64) -> Boundary {
        let x = self.continued(x);
        let at = |index: usize| {
            let angle = std::f64::consts::TAU * (index as f64 / POINTS as f64 - 0.125);
            Point3::from(self.between(&x, [angle.cos() * radius_m, angle.sin() * radius_m]))
        };
        match Boundary::exact((0..POINTS).map(at)) {
            Ok(boundary) => boundary,
            Err(_) => unreachable!("{POINTS} points were made"),
        }
    }

    /// The place of a flat point (x, z) of a disc: bilinear in its cell.
    fn between(&self, positions: &[Vector3], flat_xz: [f64; 2]) -> Vector3 {
        let along = |c: usize| (flat_xz[c] + self.plan.half_m[c]) / self.spacing_m;
        let (i, j) = (along(0), along(1));
        let whole = |t: f64| (t.max(0.0).floor() as usize).min(self.n - 2);
        let (a, b) = (i - whole(i) as f64, j - whole(j) as f64);
        let first = whole(i) * self.n + whole(j);
        let near = positions[first] * (1.0 - b) + positions[first + 1] * b;
        let far = positions[first + self.n] * (1.0 - b) + positions[first + self.n + 1] * b;
        near * (1.0 - a) + far * a
    }

    /// The positions of this grid's vertices, interpolated from the positions `x` on the grid
    /// `coarse` \[m\]. With `smoothness` 1 the interpolation is cubic along each direction, so
    /// that a smooth sheet stays smooth; with 0 it is linear, so that layers that are apart stay
    /// apart.
    #[must_use]
    pub fn prolong(&self, coarse: &Grid, x: &[Vector3], smoothness: f64) -> Vec<Vector3> {
        let x = &coarse.continued(x);
        let cubic = |k: usize, own: usize, other: usize| {
            let at = k as f64 * ((other - 1) as f64 / (own - 1) as f64);
            let (first, mut weights) = cubic_weights(at, other);
            for (m, weight) in weights.iter_mut().enumerate() {
                let linear = (1.0 - (at - (first + m) as f64).abs()).max(0.0);
                *weight = smoothness * *weight + (1.0 - smoothness) * linear;
            }
            (first, weights)
        };
        let mut y: Vec<_> = (0..self.vertices())
            .map(|v| {
                let (i, wi) = cubic(v / self.n, self.rows, coarse.rows);
                let (j, wj) = cubic(v % self.n, self.n, coarse.n);
                let mut sum = Vector3::zeros();
                for (a, wa) in wi.iter().enumerate() {
                    for (b, wb) in wj.iter().enumerate() {
                        sum += x[(i + a) * coarse.n + j + b] * (wa * wb);
                    }
                }
                sum
            })
            .collect();
        self.park_outside(&mut y);
        y
    }
}

/// First of four neighbouring samples and their Lagrange weights at `at` in
/// 0..n-1; one-sided near the ends.
fn cubic_weights(at: f64, n: usize) -> (usize, [f64; 4]) {
    let first = (at.floor() as isize - 1).clamp(0, n as isize - 4) as usize;
    let t = at - first as f64;
    let mut weights = [1.0; 4];
    for (k, weight) in weights.iter_mut().enumerate() {
        for m in 0..4 {
            if m != k {
                *weight *= (t - m as f64) / (k as f64 - m as f64);
            }
        }
    }
    (first, weights)
}

//! What is read off a grid's vertices: triangles, mesh, rim, and the positions on a finer grid.

use std::borrow::Cow;

use super::Grid;
use super::lines::Lines;
use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;

/// The eight neighbours, those along the lines first.
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
        // on uneven lines two diagonal neighbours and the vertex lie on no straight line
        let neighbours = if self.plan.is_even() { &NEIGHBOURS[..] } else { &NEIGHBOURS[..4] };
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
                for &(di, dj) in neighbours {
                    if let (Some(a), Some(b)) = (at(i + di, j + dj), at(i + 2 * di, j + 2 * dj)) {
                        let lines = &self.plan.lines[usize::from(di == 0)];
                        let (from, step) = if di == 0 { (j, dj) } else { (i, di) };
                        let place = |k: isize| lines.at((from + k * step) as usize);
                        let ratio = (place(0) - place(1)) / (place(1) - place(2));
                        sum += a * (1.0 + ratio) - b * ratio;
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

    /// How far along its side each vertex of [`Self::border`] lies, in steps: n - 1 of them make a
    /// side.
    #[must_use]
    pub fn along_border(&self) -> Vec<f64> {
        let last = self.n - 1;
        let [i, j] = &self.plan.lines;
        let falling = |lines: &Lines, k: usize| last as f64 - lines.at(last - k);
        let mut along = Vec::with_capacity(4 * last);
        along.extend((0..last).map(|k| j.at(k)));
        along.extend((0..last).map(|k| falling(i, k)));
        along.extend((0..last).map(|k| falling(j, k)));
        along.extend((0..last).map(|k| i.at(k)));
        along
    }

    /// The rim at the vertex positions `x` \[m\], linear between vertices on even lines and cubic
    /// on graded ones, where none of its points need be a vertex: 244 points in the order of
    /// [`crate::base::boundary`]. A disc has no corners; its 244 points lie evenly around it, from
    /// 45 degrees before +x on, towards +z.
    #[must_use]
    pub fn boundary(&self, x: &[Vector3]) -> Boundary {
        if let Some(radius_m) = self.plan.disc_radius_m {
            return self.disc_boundary(x, radius_m);
        }
        let border = self.border();
        let even = self.plan.is_even();
        let at = |index: usize| {
            let (side, k) = (index / POINTS_PER_SIDE, index % POINTS_PER_SIDE);
            if !even {
                return self.on_border(x, side, k as f64 / (POINTS_PER_SIDE - 1) as f64);
            }
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

    /// The point of a side of the border, `part` of the side from its first corner, by the cubic
    /// through the four vertices around it.
    fn on_border(&self, x: &[Vector3], side: usize, part: f64) -> Point3 {
        let last = self.n - 1;
        let rising = side == 0 || side == 3;
        let place = if rising { part } else { 1.0 - part } * last as f64;
        let lines = &self.plan.lines[if side.is_multiple_of(2) { 1 } else { 0 }];
        let (first, weights) = lines.cubic(place);
        let vertex = |k: usize| match side {
            0 => last * self.n + k,
            1 => k * self.n + last,
            2 => k,
            _ => k * self.n,
        };
        let sum: Vector3 = (0..4).map(|m| x[vertex(first + m)] * weights[m]).sum();
        Point3::from(sum)
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
        let [(i, a), (j, b)] = [0, 1].map(|c| {
            let lines = &self.plan.lines[c];
            let along = (flat_xz[c] + self.plan.half_m[c]) / self.spacing_m;
            let cell = lines.before(along).min(self.n - 2);
            (cell, (along - lines.at(cell)) / lines.width(cell))
        });
        let first = i * self.n + j;
        let near = positions[first] * (1.0 - b) + positions[first + 1] * b;
        let far = positions[first + self.n] * (1.0 - b) + positions[first + self.n + 1] * b;
        near * (1.0 - a) + far * a
    }

    /// The positions of this grid's vertices, interpolated from the positions `x` on another grid
    /// of the same specimen, `coarse` \[m\]. With `smoothness` 1 the interpolation is cubic along
    /// each direction, so that a smooth sheet stays smooth; with 0 it is linear, so that layers
    /// that are apart stay apart.
    #[must_use]
    pub fn prolong(&self, coarse: &Grid, x: &[Vector3], smoothness: f64) -> Vec<Vector3> {
        let x = &coarse.continued(x);
        let cubic = |own: &Lines, k: usize, other: &Lines| {
            let scale = (other.count() - 1) as f64 / (own.count() - 1) as f64;
            let at = own.at(k) * scale;
            let (first, mut weights) = other.cubic(at);
            for (m, weight) in weights.iter_mut().enumerate() {
                let linear = other.hat(first + m, at);
                *weight = smoothness * *weight + (1.0 - smoothness) * linear;
            }
            (first, weights)
        };
        let mut y: Vec<_> = (0..self.vertices())
            .map(|v| {
                let (i, wi) = cubic(&self.plan.lines[0], v / self.n, &coarse.plan.lines[0]);
                let (j, wj) = cubic(&self.plan.lines[1], v % self.n, &coarse.plan.lines[1]);
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

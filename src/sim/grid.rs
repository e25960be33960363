//! The specimen as a regular grid: vertices, cells, the pattern of its tangent.
//!
//! Vertex (i, j) has index `i * n + j`; i runs along the warp (x), j along the
//! weft (z). The flat specimen lies in the plane y = 0, centred on the origin.

use std::sync::{Arc, Mutex};

use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;
use crate::numeric::sparse::{Analysis, BlockPattern, BlockSlot, grid_dissection};

/// A square specimen of n x n vertices with its analysed tangent pattern.
#[derive(Debug)]
pub struct Grid {
    /// Vertices on a side.
    pub n: usize,
    /// Side of the flat specimen \[m\].
    pub side_m: f64,
    /// Distance of neighbouring vertices along weft and warp \[m\].
    pub spacing_m: f64,
    /// Corners of each cell: (i, j), (i+1, j), (i, j+1), (i+1, j+1).
    pub cells: Vec<[u32; 4]>,
    /// Slots of the six off-diagonal blocks of each cell, in the order of
    /// [`CELL_PAIRS`], and whether the block is stored transposed.
    pub cell_slots: Vec<[BlockSlot; 6]>,
    /// Pattern, ordering and symbolic factor of the tangent.
    pub analysis: Analysis,
}

/// The off-diagonal pairs (row, column) of a cell's corners; the row's vertex
/// index is the larger one, so that the block lies below the diagonal.
pub const CELL_PAIRS: [(usize, usize); 6] = [(1, 0), (2, 0), (3, 0), (1, 2), (3, 1), (3, 2)];

impl Grid {
    /// The grid of `n` x `n` vertices over a square of `side_m`. Grids are kept
    /// and shared, since the analysis is the same for every fabric.
    #[must_use]
    pub fn shared(n: usize, side_m: f64) -> Arc<Self> {
        static KEPT: Mutex<Vec<Arc<Grid>>> = Mutex::new(Vec::new());
        let mut kept = KEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(grid) = kept.iter().find(|g| g.n == n && g.side_m == side_m) {
            return Arc::clone(grid);
        }
        let grid = Arc::new(Self::new(n, side_m));
        kept.push(Arc::clone(&grid));
        grid
    }

    fn new(n: usize, side_m: f64) -> Self {
        assert!(n >= 5, "a grid needs at least 5 vertices a side, got {n}");
        let at = |i: usize, j: usize| (i * n + j) as u32;
        let mut below = vec![Vec::new(); n * n];
        for i in 0..n {
            for j in 0..n {
                // membrane and twist reach one cell, curvature along a yarn two
                for (di, dj) in [(0_isize, 1_isize), (0, 2), (1, -1), (1, 0), (1, 1), (2, 0)] {
                    let (row, column) = (i as isize + di, j as isize + dj);
                    if row < n as isize && (0..n as isize).contains(&column) {
                        below[i * n + j].push(at(row as usize, column as usize));
                    }
                }
            }
        }
        let analysis = Analysis::new(BlockPattern::new(below), Some(&grid_dissection(n, n)));
        let cells: Vec<[u32; 4]> = (0..(n - 1) * (n - 1))
            .map(|k| {
                let (i, j) = (k / (n - 1), k % (n - 1));
                [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]
            })
            .collect();
        let slot = |cell: &[u32; 4], (row, column): (usize, usize)| {
            analysis.pattern().slot(cell[row] as usize, cell[column] as usize).unwrap_or_default()
        };
        let cell_slots = cells.iter().map(|cell| CELL_PAIRS.map(|pair| slot(cell, pair))).collect();
        let spacing_m = side_m / (n - 1) as f64;
        Self { n, side_m, spacing_m, cells, cell_slots, analysis }
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.n * self.n
    }

    /// Flat position of a vertex: (x, 0, z) \[m\].
    #[must_use]
    pub fn flat(&self, vertex: usize) -> Vector3 {
        let (i, j) = (vertex / self.n, vertex % self.n);
        let at = |k: usize| k as f64 * self.spacing_m - 0.5 * self.side_m;
        Vector3::new(at(i), 0.0, at(j))
    }

    /// Cells' worth of material that a vertex carries: 1 inside, 1/2 on a side,
    /// 1/4 at a corner.
    #[must_use]
    pub fn share(&self, vertex: usize) -> f64 {
        let (i, j) = (vertex / self.n, vertex % self.n);
        let half = |k: usize| if k == 0 || k == self.n - 1 { 0.5 } else { 1.0 };
        half(i) * half(j)
    }

    /// Two triangles a cell, front side up on the flat specimen. The diagonals
    /// alternate, which only matters for pictures and self-contact: no
    /// elastic energy knows them.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(2 * self.cells.len());
        for (k, &[a, b, c, d]) in self.cells.iter().enumerate() {
            let (i, j) = (k / (self.n - 1), k % (self.n - 1));
            if (i + j) % 2 == 0 {
                triangles.extend([[a, c, d], [a, d, b]]);
            } else {
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        triangles
    }

    /// The mesh at vertex positions `x` \[m\].
    #[must_use]
    pub fn mesh(&self, x: &[Vector3]) -> Mesh {
        let vertices = x.iter().map(|&v| Point3::from(v)).collect();
        Mesh { vertices, triangles: self.triangles() }
    }

    /// Border vertices in the order of the boundary vector's walk, each corner
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

    /// The boundary vector at vertex positions `x`; between vertices linear.
    #[must_use]
    pub fn boundary(&self, x: &[Vector3]) -> Boundary {
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
            Some(boundary) => boundary,
            None => unreachable!("the walk has exactly {POINTS} points"),
        }
    }

    /// Positions on this grid from positions `x` on `coarse`: `smoothness` 1 is
    /// cubic along each direction, so that a smooth sheet stays smooth, 0 linear,
    /// so that layers apart stay apart.
    #[must_use]
    pub fn prolong(&self, coarse: &Grid, x: &[Vector3], smoothness: f64) -> Vec<Vector3> {
        let ratio = (coarse.n - 1) as f64 / (self.n - 1) as f64;
        let cubic = |k: usize| {
            let at = k as f64 * ratio;
            let (first, mut weights) = cubic_weights(at, coarse.n);
            for (m, weight) in weights.iter_mut().enumerate() {
                let linear = (1.0 - (at - (first + m) as f64).abs()).max(0.0);
                *weight = smoothness * *weight + (1.0 - smoothness) * linear;
            }
            (first, weights)
        };
        (0..self.vertices())
            .map(|v| {
                let (i, wi) = cubic(v / self.n);
                let (j, wj) = cubic(v % self.n);
                let mut sum = Vector3::zeros();
                for (a, wa) in wi.iter().enumerate() {
                    for (b, wb) in wj.iter().enumerate() {
                        sum += x[(i + a) * coarse.n + j + b] * (wa * wb);
                    }
                }
                sum
            })
            .collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boundary_of_the_flat_grid_is_the_flat_walk_at_every_resolution() {
        for n in [31, 61, 121, 40] {
            let grid = Grid::new(n, 0.3);
            let x: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
            for (index, p) in grid.boundary(&x).positions_m().enumerate() {
                let [fx, fz] = Boundary::flat_xz_m(index, 0.3);
                assert!((p - Point3::new(fx, 0.0, fz)).norm() < 1e-12, "n = {n}, {index}");
            }
        }
    }

    #[test]
    fn prolongation_is_exact_for_cubics() {
        let (coarse, fine) = (Grid::new(16, 0.3), Grid::new(31, 0.3));
        let shape = |p: Vector3| {
            let (x, z) = (p.x * 10.0, p.z * 10.0);
            Vector3::new(x * x * x - z, x * z * z, 1.0 + z * z * z + x * x * z)
        };
        let x: Vec<_> = (0..coarse.vertices()).map(|v| shape(coarse.flat(v))).collect();
        for (v, p) in fine.prolong(&coarse, &x, 1.0).into_iter().enumerate() {
            assert!((p - shape(fine.flat(v))).norm() < 1e-12);
        }
    }

    #[test]
    fn triangles_face_up_and_cover_the_square() {
        let grid = Grid::new(7, 0.3);
        let area: f64 = grid
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| grid.flat(v as usize));
                0.5 * (b - a).cross(&(c - a)).y
            })
            .sum();
        assert!((area - 0.09).abs() < 1e-12);
    }
}

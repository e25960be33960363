//! The specimen as a regular grid: vertices, cells, the pattern of its tangent.
//!
//! Vertex (i, j) has index `i * n + j`; i runs along x, j along z. The flat specimen
//! lies in the plane y = 0, centred on the origin. On the square specimen x is the
//! warp and z the weft; a [`MaterialFrame`] says how the yarns run where cells have another
//! shape, or where the grid is rotated against the yarns.
//!
//! **Discs** are cut out of the square grid. A cell that the rim cuts counts with the
//! part of it inside (its volume fraction), in every energy and in the mass; a cell with less
//! than 1 % inside is left out. Vertices without a cell carry nothing and are held far
//! above the sheet. The rim itself runs between the vertices. Taken because cells stay
//! square, so that the energies and the pattern are those of the square specimen.
//! Dropped: a grid mapped onto the disc. Its cells are all different, second
//! derivatives need the map's own, and four cells flatten to triangles on the rim.

mod frame;
mod plan;
mod surface;

pub use frame::MaterialFrame;

use std::sync::{Arc, Mutex};

use crate::base::Vector3;
use crate::numeric::sparse::{Analysis, BlockPattern, BlockSlot, grid_dissection};
use crate::sim::experiment::Specimen;
use plan::Plan;

/// A specimen of `rows` x `n` vertices, with the analysed pattern of its Hessian.
#[derive(Debug)]
pub struct Grid {
    /// Number of vertices on a side along j; on a square specimen, on any side.
    pub n: usize,
    /// Number of vertices on a side along i.
    pub rows: usize,
    /// Distance of neighbouring vertices on the flat specimen, before the material frame's steps
    /// scale it \[m\].
    pub spacing_m: f64,
    /// How the cells and the yarns lie on the flat specimen.
    pub frame: MaterialFrame,
    /// The four corners of each cell as vertex indices: (i, j), (i+1, j), (i, j+1), (i+1, j+1).
    pub cells: Vec<[u32; 4]>,
    /// The volume fraction of each cell: the part of it that is cloth, 1 but where a disc's rim
    /// cuts it.
    pub volume_fraction: Vec<f64>,
    plan: Plan,
    shares: Vec<f64>,
    /// The places in the Hessian of the six off-diagonal blocks of each cell, in the order of
    /// [`CELL_PAIRS`].
    pub cell_slots: Vec<[BlockSlot; 6]>,
    /// Pattern, order of elimination and symbolic factor of the Hessian.
    pub analysis: Analysis,
}

/// The off-diagonal pairs (row, column) of a cell's corners; the row's vertex
/// index is the larger one, so that the block lies below the diagonal.
pub const CELL_PAIRS: [(usize, usize); 6] = [(1, 0), (2, 0), (3, 0), (1, 2), (3, 1), (3, 2)];

impl Grid {
    /// The grid of `n` x `n` vertices over a square with sides of `side_m` metres. Grids are kept
    /// and shared, since the analysis of the pattern is the same for every fabric.
    #[must_use]
    pub fn shared(n: usize, side_m: f64) -> Arc<Self> {
        Self::kept(Plan {
            rows: n,
            columns: n,
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame: MaterialFrame::ALIGNED,
            disc_radius_m: None,
        })
    }

    /// The grid of `n` x `n` vertices over a specimen: over the sheared rectangle, or over the
    /// square around the disc. Grids are kept and shared.
    #[must_use]
    pub fn of(specimen: &Specimen, n: usize) -> Arc<Self> {
        Self::kept(Plan::of(specimen, n))
    }

    /// The grid of [`Self::of`], but not kept: for a specimen that no other drape will have, such
    /// as one changed by a thousandth of a millimetre.
    #[must_use]
    pub fn unshared(specimen: &Specimen, n: usize) -> Arc<Self> {
        Arc::new(Self::new(Plan::of(specimen, n)))
    }

    /// The grid of a strip cut at an angle: `rows` x `columns` vertices, `spacing_m` metres apart,
    /// with the warp rotated by `warp_rad` from x towards z.
    #[must_use]
    pub fn strip(rows: usize, columns: usize, spacing_m: f64, warp_rad: f64) -> Arc<Self> {
        let half_m = [rows, columns].map(|k| 0.5 * spacing_m * (k - 1) as f64);
        let frame = MaterialFrame { warp_rad, ..MaterialFrame::ALIGNED };
        Self::kept(Plan { rows, columns, spacing_m, half_m, frame, disc_radius_m: None })
    }

    fn kept(plan: Plan) -> Arc<Self> {
        static KEPT: Mutex<Vec<Arc<Grid>>> = Mutex::new(Vec::new());
        let mut kept = KEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(grid) = kept.iter().find(|g| g.plan == plan) {
            return Arc::clone(grid);
        }
        let grid = Arc::new(Self::new(plan));
        kept.push(Arc::clone(&grid));
        grid
    }

    fn new(plan: Plan) -> Self {
        let Plan { rows, columns: n, spacing_m, frame, .. } = plan;
        assert!(
            rows.min(n) >= LEAST_VERTICES,
            "a grid needs at least {LEAST_VERTICES} vertices a side, got {rows} x {n}"
        );
        let coupling = if frame.along_yarns() { Coupling::AlongYarns } else { Coupling::Across };
        let analysis = analyse(rows, n, coupling);
        let (mut cells, mut volume_fraction) = (Vec::new(), Vec::new());
        let mut shares = vec![0.0; rows * n];
        for k in 0..(rows - 1) * (n - 1) {
            let (i, j) = (k / (n - 1), k % (n - 1));
            let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
            let parts = plan.parts_inside([i, j]);
            let inside: f64 = parts.iter().sum();
            if inside < LEAST_VOLUME_FRACTION {
                continue;
            }
            cells.push(corners.map(|(i, j)| (i * n + j) as u32));
            volume_fraction.push(inside);
            for ((i, j), part) in corners.into_iter().zip(parts) {
                shares[i * n + j] += part;
            }
        }
        let slot = |cell: &[u32; 4], (row, column): (usize, usize)| {
            analysis.pattern().slot(cell[row] as usize, cell[column] as usize).unwrap_or_default()
        };
        let cell_slots = cells.iter().map(|cell| CELL_PAIRS.map(|pair| slot(cell, pair))).collect();
        Self {
            n,
            rows,
            spacing_m,
            frame,
            cells,
            volume_fraction,
            plan,
            shares,
            cell_slots,
            analysis,
        }
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.rows * self.n
    }

    /// Position of a vertex on the flat specimen: (x, 0, z) \[m\].
    #[must_use]
    pub fn flat(&self, vertex: usize) -> Vector3 {
        let [x, z] = self.plan.flat([(vertex / self.n) as f64, (vertex % self.n) as f64]);
        Vector3::new(x, 0.0, z)
    }

    /// Area of a cell that lies wholly on the cloth \[m^2\].
    #[must_use]
    pub fn cell_area_m2(&self) -> f64 {
        self.spacing_m * self.spacing_m * self.frame.area()
    }

    /// The material that a vertex carries, in cells: 1 inside, 1/2 on a side, 1/4 at a corner, and
    /// less along a disc's rim.
    #[must_use]
    pub fn share(&self, vertex: usize) -> f64 {
        self.shares[vertex]
    }

    /// Whether the vertex has a second difference along a direction of the grid: `step` is 1 along
    /// j and n along i. At the border it has none, since the bending moment vanishes there.
    #[must_use]
    pub fn has_second(&self, vertex: usize, step: usize) -> bool {
        let (at, count) = match step {
            1 => (vertex % self.n, self.n),
            _ => (vertex / self.n, self.rows),
        };
        at > 0
            && at < count - 1
            && [vertex, vertex - step, vertex + step].iter().all(|&v| self.shares[v] > 0.0)
    }

    /// The indices of the cells around each vertex.
    #[must_use]
    pub fn cells_around(&self) -> Vec<Vec<u32>> {
        let mut around = vec![Vec::new(); self.vertices()];
        for (k, cell) in self.cells.iter().enumerate() {
            for &v in cell {
                around[v as usize].push(k as u32);
            }
        }
        around
    }

    /// The vertices that carry no material: those outside a disc.
    #[must_use]
    pub fn outside(&self) -> Vec<usize> {
        (0..self.vertices()).filter(|&v| self.shares[v] == 0.0).collect()
    }

    /// Moves the vertices outside a disc to a metre above the plate, where nothing touches them.
    pub fn park_outside(&self, x: &mut [Vector3]) {
        for v in self.outside() {
            x[v] = self.flat(v) + Vector3::new(0.0, PARKED_M, 0.0);
        }
    }
}

/// Least number of vertices on a side of a grid.
pub const LEAST_VERTICES: usize = 4;
/// A cell with a smaller volume fraction is left out.
const LEAST_VOLUME_FRACTION: f64 = 0.01;
/// Height at which vertices outside a disc are kept \[m\].
const PARKED_M: f64 = 1.0;

/// How far the vertices of a grid couple.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coupling {
    /// Cells along the yarns: membrane and twist reach one cell, curvature along a yarn two.
    AlongYarns,
    /// Cells rotated against the yarns, where curvature couples with twist too.
    Across,
}

/// The pattern of the grid's Hessian, analysed.
fn analyse(rows: usize, n: usize, coupling: Coupling) -> Analysis {
    let narrow: &[(isize, isize)] = &[(0, 1), (0, 2), (1, -1), (1, 0), (1, 1), (2, 0)];
    let square: Vec<_> = (0..3).flat_map(|di| (-2..3).map(move |dj| (di, dj))).collect();
    let offsets = match coupling {
        Coupling::AlongYarns => narrow,
        Coupling::Across => &square,
    };
    let mut below = vec![Vec::new(); rows * n];
    for i in 0..rows {
        for j in 0..n {
            for &(di, dj) in offsets {
                let (row, column) = (i as isize + di, j as isize + dj);
                if row < rows as isize && (0..n as isize).contains(&column) {
                    below[i * n + j].push((row as usize * n + column as usize) as u32);
                }
            }
        }
    }
    Analysis::new(BlockPattern::new(below), Some(&grid_dissection(rows, n, 2)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Boundary, Point3};
    use crate::sim::experiment::Outline;

    #[test]
    fn boundary_of_the_flat_grid_is_the_flat_walk_at_every_resolution() {
        for n in [31, 61, 121, 40] {
            let grid = Grid::shared(n, 0.3);
            let x: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
            for (index, p) in grid.boundary(&x).positions_m().enumerate() {
                let [fx, fz] = Boundary::flat_xz_m(index, 0.3);
                assert!((p - Point3::new(fx, 0.0, fz)).norm() < 1e-12, "n = {n}, {index}");
            }
        }
    }

    #[test]
    fn prolongation_is_exact_for_cubics() {
        let (coarse, fine) = (Grid::shared(16, 0.3), Grid::shared(31, 0.3));
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
        let grid = Grid::shared(7, 0.3);
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

    #[test]
    fn derivatives_in_any_material_frame_are_those_of_a_linear_field() {
        let frames = [
            MaterialFrame::ALIGNED,
            MaterialFrame { warp_rad: 0.7, ..MaterialFrame::ALIGNED },
            MaterialFrame { step_i: [1.1, 0.0], step_j: [0.2, 0.9], warp_rad: -0.3 },
        ];
        for frame in frames {
            let (sin, cos) = frame.warp_rad.sin_cos();
            let warp = |[x, z]: [f64; 2]| x * cos + z * sin;
            let weft = |[x, z]: [f64; 2]| z * cos - x * sin;
            let [by_weft, by_warp] = frame.derivatives();
            let along = |by: [f64; 2], field: &dyn Fn([f64; 2]) -> f64| {
                by[0] * field(frame.step_i) + by[1] * field(frame.step_j)
            };
            for (by, field, slope) in [
                (by_weft, &weft as &dyn Fn([f64; 2]) -> f64, 1.0),
                (by_weft, &warp, 0.0),
                (by_warp, &warp, 1.0),
                (by_warp, &weft, 0.0),
            ] {
                assert!((along(by, field) - slope).abs() < 1e-14, "{frame:?}");
            }
        }
        assert_eq!(MaterialFrame::ALIGNED.derivatives(), [[0.0, 1.0], [1.0, 0.0]]);
    }

    #[test]
    fn a_disc_has_its_area_its_rim_and_carries_over() {
        let specimen = Specimen { outline: Outline::Disc, ..Specimen::default() };
        let shape = |p: Vector3| Vector3::new(p.x, 0.3 * p.x - 0.2 * p.z, p.z);
        let coarse = Grid::of(&specimen, 31);
        let x: Vec<_> = (0..coarse.vertices()).map(|v| shape(coarse.flat(v))).collect();
        for n in [31, 61] {
            let grid = Grid::of(&specimen, n);
            let area: f64 =
                (0..grid.vertices()).map(|v| grid.share(v)).sum::<f64>() * grid.cell_area_m2();
            let exact = std::f64::consts::PI * 0.15 * 0.15;
            // cells with less than 1 % inside are left out
            assert!((area / exact - 1.0).abs() < 1e-4, "{n}: {area}");
            let mut carried = grid.prolong(&coarse, &x, 1.0);
            for (v, p) in carried.iter_mut().enumerate() {
                if grid.share(v) > 0.0 {
                    assert!((*p - shape(grid.flat(v))).norm() < 1e-12, "{n} {v}");
                } else {
                    assert!(p.y > 0.9);
                }
            }
            let mesh = grid.mesh(&carried);
            let inside = (0..grid.vertices()).filter(|&v| grid.share(v) > 0.0).count();
            assert_eq!(mesh.vertices.len(), inside, "no vertex is parked above the sheet");
            let reach = mesh.vertices.iter().map(|p| p.x.hypot(p.z));
            assert!((reach.fold(0.0, f64::max) - 0.15).abs() < 1e-12);
            for p in grid.boundary(&carried).positions_m() {
                assert!((p.x.hypot(p.z) - 0.15).abs() < 1e-12);
                assert!((p.y - shape(p.coords).y).abs() < 1e-12);
            }
        }
    }
}

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
//! **Graded** grids have their lines of vertices denser near the plate's edge (`lines.rs`):
//! a tensor product, so that cells stay rectangles in the material frame, of sides
//! [`Grid::sides`] times the mean spacing. Places along i and j are counted in steps of that
//! mean spacing; on even lines a side is exactly 1, so that one code serves both.
//!
//! Dropped: a grid mapped onto the disc. Its cells are all different, second
//! derivatives need the map's own, and four cells flatten to triangles on the rim.

mod frame;
mod lines;
mod plan;
mod surface;

pub use frame::MaterialFrame;

use std::sync::{Arc, Mutex};

use crate::base::Vector3;
use crate::numeric::sparse::{Analysis, BlockPattern, BlockSlot, grid_dissection};
use crate::sim::experiment::{Experiment, Specimen};
use crate::sim::numerics::Grading;
use lines::Lines;
use plan::Plan;

/// A specimen of `rows` x `n` vertices, with the analysed pattern of its Hessian.
#[derive(Debug)]
pub struct Grid {
    /// Number of vertices on a side along j; on a square specimen, on any side.
    pub n: usize,
    /// Number of vertices on a side along i.
    pub rows: usize,
    /// Mean distance of neighbouring vertices on the flat specimen, before the material frame's
    /// steps scale it \[m\].
    pub spacing_m: f64,
    /// How the cells and the yarns lie on the flat specimen.
    pub frame: MaterialFrame,
    /// The four corners of each cell as vertex indices: (i, j), (i+1, j), (i, j+1), (i+1, j+1).
    pub cells: Vec<[u32; 4]>,
    /// The volume fraction of each cell: the part of it that is cloth, 1 but where a disc's rim
    /// cuts it.
    pub volume_fraction: Vec<f64>,
    /// The sides of each cell along i and j over the mean spacing: 1 on even lines.
    pub sides: Vec<[f64; 2]>,
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
            lines: [Lines::even(n), Lines::even(n)],
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame: MaterialFrame::ALIGNED,
            disc_radius_m: None,
            middle_m: [0.0; 2],
        })
    }

    /// The grid of `n` x `n` vertices over a specimen: over the sheared rectangle, or over the
    /// square around the disc. Grids are kept and shared.
    #[must_use]
    pub fn of(specimen: &Specimen, n: usize) -> Arc<Self> {
        Self::kept(Plan::of(specimen, n))
    }

    /// The grid of an experiment's specimen, its lines of vertices denser near the plate's edge as
    /// `grading` says; that of [`Self::of`] if it is even. Grids are kept and shared.
    #[must_use]
    pub fn graded(experiment: &Experiment, n: usize, grading: &Grading) -> Arc<Self> {
        Self::kept(Plan::graded(experiment, n, grading))
    }

    /// The grid of the same specimen with `n` x `n` vertices, evenly spaced.
    #[must_use]
    pub fn evenly(&self, n: usize) -> Arc<Self> {
        Self::kept(self.plan.evenly(n))
    }

    /// This grid's cells over another cut of the specimen: each line of vertices keeps its part of
    /// the sides. It is not kept, since no other drape will have a specimen changed by a
    /// thousandth of a millimetre.
    #[must_use]
    pub fn recut(&self, specimen: &Specimen) -> Arc<Self> {
        Arc::new(Self::new(self.plan.recut(specimen)))
    }

    /// The grid of a strip cut at an angle: `rows` x `columns` vertices, `spacing_m` metres apart,
    /// with the warp rotated by `warp_rad` from x towards z.
    #[must_use]
    pub fn strip(rows: usize, columns: usize, spacing_m: f64, warp_rad: f64) -> Arc<Self> {
        Self::kept(Plan::strip([Lines::even(rows), Lines::even(columns)], spacing_m, warp_rad))
    }

    /// The same with cells up to 1.5 times as dense in two stretches along either side.
    #[cfg(test)]
    #[must_use]
    pub fn uneven_strip(rows: usize, columns: usize, spacing_m: f64, warp_rad: f64) -> Arc<Self> {
        let lines = [rows, columns].map(|count| {
            let last = (count - 1) as f64;
            let [a, b, c, d, flank] = [0.15, 0.35, 0.6, 0.75, 0.04].map(|part| part * last);
            let band = |low, high| lines::Band { low, high, flank };
            Lines::graded(count, 1.5, &[band(a, b), band(c, d)])
        });
        Arc::new(Self::new(Plan::strip(lines, spacing_m, warp_rad)))
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
        let [rows, n] = [0, 1].map(|axis| plan.lines[axis].count());
        let (spacing_m, frame) = (plan.spacing_m, plan.frame);
        assert!(
            rows.min(n) >= LEAST_VERTICES,
            "a grid needs at least {LEAST_VERTICES} vertices a side, got {rows} x {n}"
        );
        let coupling = if frame.along_yarns() { Coupling::AlongYarns } else { Coupling::Across };
        let analysis = analyse(rows, n, coupling);
        let (mut cells, mut volume_fraction, mut sides) = (Vec::new(), Vec::new(), Vec::new());
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
            let [a, b] = [plan.lines[0].width(i), plan.lines[1].width(j)];
            sides.push([a, b]);
            for ((i, j), part) in corners.into_iter().zip(parts) {
                shares[i * n + j] += part * (a * b);
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
            sides,
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

    /// Mean area of a cell that lies wholly on the cloth \[m^2\].
    #[must_use]
    pub fn cell_area_m2(&self) -> f64 {
        self.spacing_m * self.spacing_m * self.frame.area()
    }

    /// The material that a vertex carries, in cells of mean area: on even lines 1 inside, 1/2 on a
    /// side, 1/4 at a corner, and less along a disc's rim.
    #[must_use]
    pub fn share(&self, vertex: usize) -> f64 {
        self.shares[vertex]
    }

    /// Area of cell `k`, whole, over the mean one.
    #[must_use]
    pub fn cell_size(&self, k: usize) -> f64 {
        let [a, b] = self.sides[k];
        a * b
    }

    /// Flat (x, z) of the point that the cells are arranged around, from the specimen's centre: on
    /// graded cells the plate's centre \[m\].
    #[must_use]
    pub fn middle_m(&self) -> [f64; 2] {
        self.plan.middle_m
    }

    /// The lines that a direction of the grid counts (`step` is 1 along j and n along i), and the
    /// vertex's place among them.
    fn along(&self, vertex: usize, step: usize) -> (&Lines, usize) {
        match step {
            1 => (&self.plan.lines[1], vertex % self.n),
            _ => (&self.plan.lines[0], vertex / self.n),
        }
    }

    /// The second derivative at a vertex along a direction of the grid, times the square of the
    /// spacing, as weights of vertices: `step` is 1 along j and n along i. At the border there is
    /// none, since the bending moment vanishes there.
    #[must_use]
    pub fn second(&self, vertex: usize, step: usize) -> Option<[(usize, f64); 3]> {
        let (lines, at) = self.along(vertex, step);
        let inside = at > 0
            && at < lines.count() - 1
            && [vertex, vertex - step, vertex + step].iter().all(|&v| self.shares[v] > 0.0);
        inside.then(|| {
            let [before, here, after] = lines.second(at);
            [(vertex - step, before), (vertex, here), (vertex + step, after)]
        })
    }

    /// A vector along a direction of the grid at a vertex, as weights of vertices; one-sided on the
    /// border.
    #[must_use]
    pub fn tangent(&self, vertex: usize, step: usize) -> [(usize, f64); 3] {
        let (lines, at) = self.along(vertex, step);
        let there = |inside: bool, v: usize| inside && self.shares[v] > 0.0;
        let after = there(at + 1 < lines.count(), vertex + step);
        let before = there(at > 0, vertex.wrapping_sub(step));
        match (before, after) {
            (true, true) => {
                let [b, h, a] = lines.first(at);
                [(vertex - step, b), (vertex, h), (vertex + step, a)]
            }
            (true, false) => [(vertex - step, -1.0), (vertex, 1.0), (vertex, 0.0)],
            (false, true) => [(vertex, -1.0), (vertex, 0.0), (vertex + step, 1.0)],
            (false, false) => [(vertex, 0.0); 3],
        }
    }

    /// The place along one axis, 0 for i and 1 for j, of line `k` or, with `cell`, of the middle of
    /// the cell after it, and from where to where a cell around it reaches; in steps from the first
    /// line. Outside the border that cell continues.
    #[must_use]
    pub fn extent(&self, axis: usize, k: usize, cell: bool) -> (f64, [f64; 2]) {
        let lines = &self.plan.lines[axis];
        if cell {
            let [low, high] = [lines.at(k), lines.at(k + 1)];
            (0.5 * (low + high), [low, high])
        } else {
            (lines.at(k), lines.around(k))
        }
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

    /// Grids of numerics 4: centred, off centre and rotated, of another size and skew.
    fn graded(n: usize) -> [Arc<Grid>; 3] {
        let centred = Experiment::default();
        let mut off = centred;
        (off.specimen.offset_m, off.specimen.rotation_rad) = ([0.03, -0.015], 0.4);
        let mut skewed = centred;
        (skewed.specimen.warp_m, skewed.specimen.skew_rad) = (0.31, 0.1);
        [centred, off, skewed].map(|experiment| Grid::graded(&experiment, n, &Grading::EDGE))
    }

    #[test]
    fn graded_grids_have_the_flat_walk_the_area_and_exact_prolongation() {
        let shape = |p: Vector3| {
            let (x, z) = (p.x * 10.0, p.z * 10.0);
            Vector3::new(x * x * x - z, x * z * z, 1.0 + z * z * z)
        };
        let places =
            |grid: &Grid| -> Vec<_> { (0..grid.vertices()).map(|v| grid.flat(v)).collect() };
        for (fine, coarse) in graded(61).into_iter().zip(graded(31)) {
            assert!(!fine.plan.is_even());
            let area: f64 =
                (0..fine.vertices()).map(|v| fine.share(v)).sum::<f64>() * fine.cell_area_m2();
            let cells: f64 = (0..fine.cells.len()).map(|k| fine.cell_size(k)).sum();
            assert!((area / (cells * fine.cell_area_m2()) - 1.0).abs() < 1e-12);
            assert!((cells / 3600.0 - 1.0).abs() < 1e-12, "{cells}");
            let x: Vec<_> = places(&coarse).into_iter().map(shape).collect();
            for (v, p) in fine.prolong(&coarse, &x, 1.0).into_iter().enumerate() {
                assert!((p - shape(fine.flat(v))).norm() < 1e-11, "{v}");
            }
            // the rim of an even grid of the same specimen is the flat walk on both
            let even = fine.even_twin();
            let walk = even.boundary(&places(&even));
            for (p, q) in fine.boundary(&places(&fine)).positions_m().zip(walk.positions_m()) {
                assert!((p - q).norm() < 1e-12, "{p} {q}");
            }
        }
    }

    impl Grid {
        /// The grid of the same specimen on even lines.
        fn even_twin(&self) -> Arc<Self> {
            let lines = [self.rows, self.n].map(Lines::even);
            Arc::new(Self::new(Plan { lines, ..self.plan.clone() }))
        }
    }

    #[test]
    fn cells_are_densest_where_the_plate_s_edge_is() {
        for experiment in [
            Experiment::default(),
            Experiment::standard_cusick(),
            Experiment {
                specimen: Specimen {
                    offset_m: [0.04, 0.0],
                    rotation_rad: 1.2,
                    ..Specimen::default()
                },
                ..Experiment::default()
            },
        ] {
            let grid = Grid::graded(&experiment, 61, &Grading::EDGE);
            // along lines through the plate's centre, which its edge crosses on either side
            let [x, z] = grid.middle_m();
            let place = experiment.specimen.place(Vector3::new(x, 0.0, z));
            assert!(place.norm() < 1e-12, "{place}");
            for axis in [0, 1] {
                let width = |from_centre_m: f64| {
                    let along = ([x, z][axis] + from_centre_m + 0.15) / grid.spacing_m;
                    let lines = &grid.plan.lines[axis];
                    lines.width(lines.before(along))
                };
                let edge_m = experiment.plate.radius_m;
                for sign in [-1.0, 1.0] {
                    let ratio = width(sign * (edge_m + 0.035)) / width(sign * edge_m);
                    assert!((ratio - 2.0).abs() < 0.15, "{axis} {sign}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn a_recut_grid_keeps_its_lines_and_an_even_one_its_bits() {
        let experiment = Experiment::default();
        let cut = Specimen { warp_m: 0.31, ..Specimen::default() };
        let grid = Grid::graded(&experiment, 31, &Grading::EDGE).recut(&cut);
        let before = Grid::graded(&experiment, 31, &Grading::EDGE);
        for v in 0..grid.vertices() {
            let (p, q) = (grid.flat(v), before.flat(v));
            assert!((p.x - q.x * 0.31 / 0.3).abs() + (p.z - q.z).abs() < 1e-15, "{v}");
        }
        let even = Grid::of(&Specimen::default(), 31).recut(&cut);
        let anew = Grid::of(&cut, 31);
        assert!((0..even.vertices()).all(|v| even.flat(v) == anew.flat(v)));
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
        let experiment = Experiment { specimen, ..Experiment::standard_cusick() };
        for grid in [
            Grid::of(&specimen, 31),
            Grid::of(&specimen, 61),
            Grid::graded(&experiment, 61, &Grading::EDGE),
        ] {
            let n = grid.n;
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

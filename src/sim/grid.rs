//! The specimen as a regular grid: vertices, cells, the pattern of its tangent.
//!
//! Vertex (i, j) has index `i * n + j`; i runs along x, j along z. The flat specimen
//! lies in the plane y = 0, centred on the origin. On the square specimen x is the
//! warp and z the weft; a [`MaterialFrame`] says how cells of another shape or a grid turned
//! against the yarns lie on the cloth.
//!
//! **Discs** are cut out of the square grid. A cell that the rim cuts counts with the
//! part of it inside (its volume fraction), in every energy and in the mass; a cell with less
//! than 1 % inside is left out. Vertices without a cell carry nothing and are held far
//! above the sheet. The rim itself runs between the vertices. Taken because cells stay
//! square, so that the energies and the pattern are those of the square specimen.
//! Dropped: a grid mapped onto the disc. Its cells are all different, second
//! derivatives need the map's own, and four cells flatten to triangles on the rim.

use std::sync::{Arc, Mutex};

use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;
use crate::numeric::sparse::{Analysis, BlockPattern, BlockSlot, grid_dissection};
use crate::sim::experiment::{Outline, Specimen};

/// How the grid lies on the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialFrame {
    /// Flat (x, z) of one step in i, in spacings.
    pub step_i: [f64; 2],
    /// Flat (x, z) of one step in j, in spacings.
    pub step_j: [f64; 2],
    /// Angle of the warp from x towards z on the flat specimen \[rad\].
    pub warp_rad: f64,
}

impl MaterialFrame {
    /// Square cells along warp and weft.
    pub const ALIGNED: Self = Self { step_i: [1.0, 0.0], step_j: [0.0, 1.0], warp_rad: 0.0 };

    /// Area of a cell over the square of the spacing.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.step_i[0] * self.step_j[1] - self.step_i[1] * self.step_j[0]
    }

    /// Derivatives along the yarns from differences of one step, times the
    /// spacing: `[[weft by i, weft by j], [warp by i, warp by j]]`.
    #[must_use]
    pub fn derivatives(&self) -> [[f64; 2]; 2] {
        let ([ix, iz], [jx, jz], area) = (self.step_i, self.step_j, self.area());
        let (sin, cos) = self.warp_rad.sin_cos();
        // d/dx = (jz d_i - iz d_j) / area, d/dz = (-jx d_i + ix d_j) / area
        // a quarter turn is one: its cosine's rounding must not couple anything
        let exact = |v: f64| if v.abs() < 1e-12 { 0.0 } else { v };
        let along =
            |x: f64, z: f64| [(x * jz - z * jx) / area, (z * ix - x * iz) / area].map(exact);
        [along(-sin, cos), along(cos, sin)]
    }

    /// Whether the cells' sides run along the yarns.
    #[must_use]
    pub fn along_yarns(&self) -> bool {
        let [weft, warp] = self.derivatives();
        weft[0] == 0.0 && warp[1] == 0.0 || weft[1] == 0.0 && warp[0] == 0.0
    }
}

/// Size, lay and outline of a grid: two grids with the same are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plan {
    rows: usize,
    columns: usize,
    spacing_m: f64,
    half_m: [f64; 2],
    frame: MaterialFrame,
    disc_radius_m: Option<f64>,
}

/// A specimen of rows x n vertices with its analysed tangent pattern.
#[derive(Debug)]
pub struct Grid {
    /// Vertices on a side along j; on the square specimen on either side.
    pub n: usize,
    /// Vertices on a side along i.
    pub rows: usize,
    /// Distance of neighbouring vertices \[m\], times the steps of the lay.
    pub spacing_m: f64,
    /// How the grid lies on the cloth.
    pub frame: MaterialFrame,
    /// Corners of each cell: (i, j), (i+1, j), (i, j+1), (i+1, j+1).
    pub cells: Vec<[u32; 4]>,
    /// Part of each cell that is cloth: 1 but where a disc's rim cuts it.
    pub volume_fraction: Vec<f64>,
    plan: Plan,
    shares: Vec<f64>,
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
        Self::kept(Plan {
            rows: n,
            columns: n,
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame: MaterialFrame::ALIGNED,
            disc_radius_m: None,
        })
    }

    /// The grid of `n` x `n` vertices over a specimen: the sheared rectangle, or the
    /// square around the disc.
    #[must_use]
    pub fn of(specimen: &Specimen, n: usize) -> Arc<Self> {
        Self::kept(Plan::of(specimen, n))
    }

    /// The same, not kept for others: for a specimen that no other drape will have.
    #[must_use]
    pub fn unshared(specimen: &Specimen, n: usize) -> Arc<Self> {
        Arc::new(Self::new(Plan::of(specimen, n)))
    }

    /// A rectangle of `rows` x `columns` vertices `spacing_m` apart, its warp turned
    /// by `warp_rad` from x towards z: a strip cut at an angle.
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
        let analysis = analyse(rows, n, !frame.along_yarns());
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

    /// Flat position of a vertex: (x, 0, z) \[m\].
    #[must_use]
    pub fn flat(&self, vertex: usize) -> Vector3 {
        let [x, z] = self.plan.flat([(vertex / self.n) as f64, (vertex % self.n) as f64]);
        Vector3::new(x, 0.0, z)
    }

    /// Area of a whole cell \[m^2\].
    #[must_use]
    pub fn cell_area_m2(&self) -> f64 {
        self.spacing_m * self.spacing_m * self.frame.area()
    }

    /// Cells' worth of material that a vertex carries: 1 inside, 1/2 on a side,
    /// 1/4 at a corner, and less along a disc's rim.
    #[must_use]
    pub fn share(&self, vertex: usize) -> f64 {
        self.shares[vertex]
    }

    /// Whether both neighbours `step` (1 along j, n along i) before and after the vertex
    /// are there, so that it has a second difference; not at the border, where the
    /// bending moment is zero.
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

    /// The cells around each vertex.
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

    /// Vertices that carry no material: those outside a disc.
    #[must_use]
    pub fn outside(&self) -> Vec<usize> {
        (0..self.vertices()).filter(|&v| self.shares[v] == 0.0).collect()
    }

    /// Puts the vertices outside a disc where they are in nobody's way.
    pub fn park_outside(&self, x: &mut [Vector3]) {
        for v in self.outside() {
            x[v] = self.flat(v) + Vector3::new(0.0, PARKED_M, 0.0);
        }
    }

    /// `x` with the vertices outside a disc where the sheet would go on, straight.
    fn continued<'a>(&self, x: &'a [Vector3]) -> std::borrow::Cow<'a, [Vector3]> {
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

    /// Two triangles a cell, front side up on the flat specimen. The diagonals
    /// alternate, which only matters for pictures and self-contact: no
    /// elastic energy knows them.
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

    /// Radius of a disc \[m\].
    #[must_use]
    pub fn disc_radius_m(&self) -> Option<f64> {
        self.plan.disc_radius_m
    }

    /// The mesh at vertex positions `x` \[m\]. A disc's outermost vertices are drawn in to
    /// its rim.
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

    /// The boundary vector at vertex positions `x`; between vertices linear. On a
    /// disc 244 points evenly around it, from 45 degrees before +x towards +z.
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
            Some(boundary) => boundary,
            None => unreachable!("the walk has exactly {POINTS} points"),
        }
    }

    fn disc_boundary(&self, x: &[Vector3], radius_m: f64) -> Boundary {
        let x = self.continued(x);
        let at = |index: usize| {
            let angle = std::f64::consts::TAU * (index as f64 / POINTS as f64 - 0.125);
            Point3::from(self.between(&x, [angle.cos() * radius_m, angle.sin() * radius_m]))
        };
        match Boundary::exact((0..POINTS).map(at)) {
            Some(boundary) => boundary,
            None => unreachable!("{POINTS} points were made"),
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

    /// Positions on this grid from positions `x` on `coarse`: `smoothness` 1 is
    /// cubic along each direction, so that a smooth sheet stays smooth, 0 linear,
    /// so that layers apart stay apart.
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

/// Least vertices on a side: the narrowest strip with a cell's inside.
const LEAST_VERTICES: usize = 4;
/// Part of a cell below which it is left out.
const LEAST_VOLUME_FRACTION: f64 = 0.01;
/// Samples on a side with which a disc's part of a cell is found.
const FRACTION_SAMPLES: usize = 64;
/// Height at which vertices outside a disc are kept \[m\].
const PARKED_M: f64 = 1.0;
/// The eight neighbours.
const NEIGHBOURS: [(isize, isize); 8] =
    [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)];

impl Plan {
    fn of(specimen: &Specimen, n: usize) -> Self {
        let side_m = specimen.weft_m;
        let frame = MaterialFrame {
            step_i: [specimen.warp_m / side_m, 0.0],
            step_j: [specimen.skew_rad.tan(), 1.0],
            warp_rad: 0.0,
        };
        Self {
            rows: n,
            columns: n,
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame,
            disc_radius_m: (specimen.outline == Outline::Disc).then_some(0.5 * side_m),
        }
    }

    /// Flat (x, z) of the grid coordinates (i, j) \[m\].
    fn flat(&self, [i, j]: [f64; 2]) -> [f64; 2] {
        let a = i * self.spacing_m - self.half_m[0];
        let b = j * self.spacing_m - self.half_m[1];
        let ([ix, iz], [jx, jz]) = (self.frame.step_i, self.frame.step_j);
        [ix * a + jx * b, iz * a + jz * b]
    }

    /// The material of the cell from vertex (i, j) on that each corner carries, in
    /// cells: the integral of the corner's bilinear weight over the part inside.
    fn parts_inside(&self, cell: [usize; 2]) -> [f64; 4] {
        let Some(radius_m) = self.disc_radius_m else { return [0.25; 4] };
        let inside = |a: f64, b: f64| {
            let [x, z] = self.flat([cell[0] as f64 + a, cell[1] as f64 + b]);
            x.hypot(z) <= radius_m
        };
        if [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].iter().all(|&(a, b)| inside(a, b)) {
            return [0.25; 4];
        }
        let mut parts = [0.0; 4];
        let at = |k: usize| (k as f64 + 0.5) / FRACTION_SAMPLES as f64;
        for (a, b) in (0..FRACTION_SAMPLES.pow(2))
            .map(|k| (at(k / FRACTION_SAMPLES), at(k % FRACTION_SAMPLES)))
        {
            if inside(a, b) {
                let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
                parts.iter_mut().zip(weights).for_each(|(part, w)| *part += w);
            }
        }
        parts.map(|part| part / FRACTION_SAMPLES.pow(2) as f64)
    }
}

/// The tangent's pattern: membrane and twist reach one cell, curvature along a yarn
/// two; on a grid turned against the yarns (`wide`) curvature and twist couple too.
fn analyse(rows: usize, n: usize, wide: bool) -> Analysis {
    let narrow: &[(isize, isize)] = &[(0, 1), (0, 2), (1, -1), (1, 0), (1, 1), (2, 0)];
    let square: Vec<_> = (0..3).flat_map(|di| (-2..3).map(move |dj| (di, dj))).collect();
    let offsets = if wide { &square } else { narrow };
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
    fn derivatives_of_any_lay_are_those_of_a_linear_field() {
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
            let seen = |v: usize| grid.share(v) > 0.0;
            let reach = (0..grid.vertices()).filter(|v| seen(*v)).map(|v| {
                let p = mesh.vertices[v];
                p.x.hypot(p.z)
            });
            assert!((reach.fold(0.0, f64::max) - 0.15).abs() < 1e-12);
            for p in grid.boundary(&carried).positions_m() {
                assert!((p.x.hypot(p.z) - 0.15).abs() < 1e-12);
                assert!((p.y - shape(p.coords).y).abs() < 1e-12);
            }
        }
    }
}

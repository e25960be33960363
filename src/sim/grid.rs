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

use std::sync::{Arc, Mutex};

use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;
use crate::numeric::sparse::{Analysis, BlockPattern, BlockSlot, grid_dissection};
use crate::sim::experiment::{Outline, Specimen};

/// The material frame of a grid: how one step along i and one along j lie on the flat cloth, and
/// how the yarns run there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialFrame {
    /// Where one step along i leads on the flat specimen: (x, z) over the spacing.
    pub step_i: [f64; 2],
    /// Where one step along j leads on the flat specimen: (x, z) over the spacing.
    pub step_j: [f64; 2],
    /// Angle of the warp from x towards z on the flat specimen \[rad\].
    pub warp_rad: f64,
}

impl MaterialFrame {
    /// Square cells whose sides run along warp and weft.
    pub const ALIGNED: Self = Self { step_i: [1.0, 0.0], step_j: [0.0, 1.0], warp_rad: 0.0 };

    /// The area of a cell over the square of the spacing.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.step_i[0] * self.step_j[1] - self.step_i[1] * self.step_j[0]
    }

    /// The weights with which differences over one step along i and j add up to the derivatives
    /// along weft and warp, times the spacing: `[[weft by i, weft by j], [warp by i, warp by j]]`.
    #[must_use]
    pub fn derivatives(&self) -> [[f64; 2]; 2] {
        let ([ix, iz], [jx, jz], area) = (self.step_i, self.step_j, self.area());
        let (sin, cos) = self.warp_rad.sin_cos();
        // d/dx = (jz d_i - iz d_j) / area, d/dz = (-jx d_i + ix d_j) / area
        // a right angle is one: its cosine's rounding must not couple anything
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

/// Size, material frame and outline of a grid: two grids with the same plan are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plan {
    rows: usize,
    columns: usize,
    spacing_m: f64,
    half_m: [f64; 2],
    frame: MaterialFrame,
    disc_radius_m: Option<f64>,
}

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

    /// The positions `x`, but with the vertices outside a disc where the sheet would be if it
    /// went on straight.
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
        Mesh { vertices, triangles: self.triangles() }
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

/// Least number of vertices on a side.
const LEAST_VERTICES: usize = 4;
/// A cell with a smaller volume fraction is left out.
const LEAST_VOLUME_FRACTION: f64 = 0.01;
/// Samples along a cell's side with which its volume fraction on a disc is found.
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

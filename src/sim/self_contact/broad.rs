//! Which bounding boxes overlap: a dense uniform grid, one cell per box.
//!
//! In: axis-aligned boxes, metres. Out: calls with the indices of overlapping
//! boxes; no overlap is missed, each is reported once, in an order that
//! depends on the boxes alone.
//!
//! Method: the cell is at least as wide as the widest box, a box is filed under
//! the cell of its centre (counting sort, x fastest), and so overlapping boxes
//! lie in the same or in adjacent cells: 5 contiguous runs for the forward half
//! of the neighbourhood. Boxes are kept in f32, rounded outwards by
//! [`ROUND_OUT_M`].
//!
//! Fails: slow (not wrong) when one box is much wider than the others, since
//! that box sets the cell. Boxes with non-finite bounds are reported or not.
//!
//! Dropped: filing a box under every cell that it touches: needs a duplicate
//! check per hit; a bounding volume tree over the bins of a drape, refitted and
//! descended against itself: up to 0.3 ms more per update than the
//! grid, of 1.0 ms.

use crate::base::Vector3;

/// Covers f32 rounding for coordinates up to 10 m from the boxes' common
/// corner.
const ROUND_OUT_M: f64 = 2e-6;
/// Dense cells at most; beyond, cells are widened. Empirical: 1 MiB of starts.
const MAX_CELLS: f64 = 262_144.0;

/// Axis-aligned box, metres.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub min: Vector3,
    pub max: Vector3,
}

impl Bounds {
    /// The box that holds nothing.
    pub const EMPTY: Bounds = Bounds {
        min: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// Widens the box so that it holds `p`.
    #[inline(always)]
    pub fn include(&mut self, p: &Vector3) {
        // plain comparisons: `f64::min` pays for NaN
        for k in 0..3 {
            self.min[k] = if p[k] < self.min[k] { p[k] } else { self.min[k] };
            self.max[k] = if p[k] > self.max[k] { p[k] } else { self.max[k] };
        }
    }

    /// The box widened by `by_m` on every side.
    pub fn inflated(mut self, by_m: f64) -> Self {
        self.min.add_scalar_mut(-by_m);
        self.max.add_scalar_mut(by_m);
        self
    }

    /// Whether the boxes overlap; touching counts.
    #[inline(always)]
    pub fn overlaps(&self, other: &Bounds) -> bool {
        // `&`, not `&&`: six compares cost less than one mispredicted branch.
        (self.min.x <= other.max.x)
            & (other.min.x <= self.max.x)
            & (self.min.y <= other.max.y)
            & (other.min.y <= self.max.y)
            & (self.min.z <= other.max.z)
            & (other.min.z <= self.max.z)
    }
}

#[derive(Clone, Copy, Debug)]
struct Bounds32 {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds32 {
    #[inline(always)]
    fn overlaps(&self, other: &Bounds32) -> bool {
        (self.min[0] <= other.max[0])
            & (other.min[0] <= self.max[0])
            & (self.min[1] <= other.max[1])
            & (other.min[1] <= self.max[1])
            & (self.min[2] <= other.max[2])
            & (other.min[2] <= self.max[2])
    }
}

/// The grid with its buffers, reused from build to build.
#[derive(Clone, Debug, Default)]
pub struct BoxGrid {
    origin: Vector3,
    cell_m: f64,
    dims: [usize; 3],
    /// Per cell, where its run begins; one more at the end.
    starts: Vec<u32>,
    /// Per box in the order given.
    cell_of: Vec<u32>,
    /// Sorted by cell.
    index: Vec<u32>,
    bounds: Vec<Bounds32>,
}

impl BoxGrid {
    /// Files `boxes`.
    pub fn build(&mut self, boxes: &[Bounds]) {
        self.lay_out(boxes);
        let cells = self.dims[0] * self.dims[1] * self.dims[2];
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        self.cell_of.clear();
        for b in boxes {
            let [i, j, k] = self.cell_at(b);
            let cell = (k * self.dims[1] + j) * self.dims[0] + i;
            self.cell_of.push(cell as u32);
            self.starts[cell + 1] += 1;
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        let nowhere = Bounds32 { min: [0.0; 3], max: [0.0; 3] };
        self.index.resize(boxes.len(), 0);
        self.bounds.resize(boxes.len(), nowhere);
        // Filled from the back: `starts[cell + 1]` walks down to the start.
        for (given, b) in boxes.iter().enumerate().rev() {
            let end = self.cell_of[given] as usize + 1;
            self.starts[end] -= 1;
            let slot = self.starts[end] as usize;
            self.index[slot] = given as u32;
            self.bounds[slot] = self.rounded(b);
        }
        // `starts[c + 1]` is now the start of cell `c`: shift by one.
        for cell in 0..cells {
            self.starts[cell] = self.starts[cell + 1];
        }
        self.starts[cells] = boxes.len() as u32;
    }

    fn lay_out(&mut self, boxes: &[Bounds]) {
        let mut hull = Bounds::EMPTY;
        let mut widest_m = 0.0_f64;
        for b in boxes {
            hull.min = hull.min.inf(&b.min);
            hull.max = hull.max.sup(&b.max);
            widest_m = widest_m.max((b.max - b.min).max());
        }
        let extent = hull.max - hull.min;
        self.origin = hull.min;
        self.cell_m = widest_m.max(1e-9) * (1.0 + 1e-9);
        self.dims = [1; 3];
        if !(extent.max() < 1e6 && extent.min() >= 0.0 && self.cell_m < 1e6) {
            self.origin = Vector3::zeros();
            return; // no boxes, or not finite: a single cell
        }
        while extent.iter().map(|e| (e / self.cell_m).floor() + 1.0).product::<f64>() > MAX_CELLS {
            self.cell_m *= 1.26;
        }
        self.dims = [0, 1, 2].map(|a| (extent[a] / self.cell_m) as usize + 1);
    }

    fn cell_at(&self, b: &Bounds) -> [usize; 3] {
        [0, 1, 2].map(|a| {
            let centre = 0.5 * (b.min[a] + b.max[a]) - self.origin[a];
            ((centre / self.cell_m) as usize).min(self.dims[a] - 1) // a negative cast gives 0
        })
    }

    fn rounded(&self, b: &Bounds) -> Bounds32 {
        Bounds32 {
            min: [0, 1, 2].map(|a| (b.min[a] - self.origin[a] - ROUND_OUT_M) as f32),
            max: [0, 1, 2].map(|a| (b.max[a] - self.origin[a] + ROUND_OUT_M) as f32),
        }
    }

    /// Slots of cells `i - 1 ..= i + 1` in row `(j, k)`; empty outside.
    fn row(&self, i: usize, j: usize, k: usize) -> std::ops::Range<usize> {
        if j >= self.dims[1] || k >= self.dims[2] {
            return 0..0; // `j` or `k` wrapped below 0, or past the end
        }
        let base = (k * self.dims[1] + j) * self.dims[0];
        let first = base + i.saturating_sub(1);
        let last = base + (i + 1).min(self.dims[0] - 1);
        self.starts[first] as usize..self.starts[last + 1] as usize
    }

    /// Every overlapping pair of filed boxes, once.
    pub fn overlapping_pairs(&self, mut hit: impl FnMut(u32, u32)) {
        for slot in 0..self.index.len() {
            let (mine, bounds) = (self.index[slot], self.bounds[slot]);
            let cell = self.cell_of[mine as usize] as usize;
            let i = cell % self.dims[0];
            let j = cell / self.dims[0] % self.dims[1];
            let k = cell / (self.dims[0] * self.dims[1]);
            let next = if i + 1 < self.dims[0] { cell + 1 } else { cell };
            let runs = [
                slot + 1..self.starts[next + 1] as usize,
                self.row(i, j + 1, k),
                self.row(i, j.wrapping_sub(1), k + 1),
                self.row(i, j, k + 1),
                self.row(i, j + 1, k + 1),
            ];
            for run in runs {
                for (other, index) in self.bounds[run.clone()].iter().zip(&self.index[run]) {
                    if bounds.overlaps(other) {
                        hit(mine, *index);
                    }
                }
            }
        }
    }
}

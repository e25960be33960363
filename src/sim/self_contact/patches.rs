//! Which neighbours on the sheet are apart, told for many pairs at once.
//!
//! In, once: triangles, edges, rest positions (metres). In, each time:
//! positions at one or at both ends of a motion. Out, for two neighbouring
//! bins of the sheet: a bound on their pairs' distance over the rest distance.
//!
//! Method: triangles, edges and points are filed into square bins of
//! [`BIN_CELLS`] cells by rest position. Let a patch of bins tile a convex
//! region of the flat rest sheet, `F` (3 x 2) be each triangle's deformation
//! gradient and `R` any orthonormal 3 x 2 frame. If the symmetric part of
//! `R^T F` is at least `mu > 0` in all triangles, then for two points with
//! material coordinates `U`, `V`, by integration along the straight line
//! between them, which stays in the patch,
//! `|x(U) - x(V)| |U - V| >= (U - V)^T R^T (x(U) - x(V)) >= mu |U - V|^2`:
//! no two points of the patch are nearer than `mu` times their rest distance
//! (a strongly monotone map). `F` is linear in time on a straight motion and
//! the least eigenvalue concave, so that the two ends bound the motion.
//! `R` is the polar factor of the mean `F`; a patch bent by 73 degrees off its
//! mean plane still passes for 3.5 mm at rest and 1 mm asked.
//! First blocks of 2 x 2 bins (4 x 4 cells) are asked, then blocks of 2 x 2 cells.
//! The few pairs nearer than a cell at rest (`Tight`: a corner against the diagonal
//! of the same cell) need a larger `mu` than the others and are listed, so that
//! they alone are tested where only the others are known to be apart.
//!
//! Fails: nothing is told (`mu = 0`) of patches that are not flat at rest
//! or whose outline is not convex, hence of irregular meshes: their neighbours
//! are searched pair by pair. Bins fit a grid of right triangles.
//!
//! Dropped: a linear map fitted to the patch with the largest residual as
//! error: of 3 x 3 cells of a finely folded drape a third passes at 3 mm asked,
//! since the residual of a bend grows with the patch and the monotone bound
//! does not. One level of blocks, 200 pairs of boxes where it fails: 2.4 ms for
//! a drape of 61 x 61 and 7 ms with a reach of 2 mm, against 1.0 and 2.0 ms now.

mod build;

use super::distance::PairKind;
use crate::base::Vector3;
use std::ops::Range;

/// Triangles handled together.
const LANES: usize = 8;
/// Covers the rounding of `R` and `F` to f32, relative to their entries.
const ROUNDING: f64 = 1e-5;
/// Squared sum or difference of two unit vectors below which a sheet is sheared
/// too far (by 1.2 rad) for their frame.
const DEGENERATE_SQ: f32 = 0.1;
const NONE: u32 = u32::MAX;

/// Lists of indices, stored one after the other.
#[derive(Clone, Debug)]
pub struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    fn new() -> Self {
        Lists { starts: vec![0], items: Vec::new() }
    }

    fn push(&mut self, list: impl IntoIterator<Item = u32>) {
        self.items.extend(list);
        self.starts.push(self.items.len() as u32);
    }

    /// `list_of[item]` says to which of `count` lists an item belongs.
    fn sorted(count: usize, list_of: &[Option<u32>]) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for list in list_of.iter().flatten() {
            starts[*list as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        for (item, list) in list_of.iter().enumerate() {
            if let Some(list) = list {
                items[next[*list as usize] as usize] = item as u32;
                next[*list as usize] += 1;
            }
        }
        Lists { starts, items }
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Where a list lies among all items.
    pub fn range(&self, list: u32) -> Range<usize> {
        self.starts[list as usize] as usize..self.starts[list as usize + 1] as usize
    }

    /// The items of a list.
    pub fn of(&self, list: u32) -> &[u32] {
        &self.items[self.range(list)]
    }
}

/// A triangle's corners and the inverse of its rest edge matrix, 1/m.
#[derive(Clone, Copy, Debug)]
struct Element {
    corners: [u32; 3],
    inverse: [f64; 4],
}

/// Two neighbouring bins, or a bin with itself.
#[derive(Clone, Debug)]
pub struct NearBins {
    /// Blocks of 2 x 2 bins that hold both.
    blocks: [u32; 4],
    /// Where in `Patches::near_cells` the pairs of their cells that are neighbours are listed.
    pub cells: Range<u32>,
    /// Where in `Patches::apart_cells` their other pairs of cells are listed, which are at least
    /// `loose_m` apart at rest.
    pub apart: Range<u32>,
    /// Least rest distance of a pair, metres.
    tight_m: f64,
}

/// Two neighbouring cells, or a cell with itself.
#[derive(Clone, Debug)]
pub struct NearCells {
    /// The two cells.
    pub cells: [u32; 2],
    /// Blocks of 2 x 2 cells that hold both.
    blocks: [u32; 4],
    /// Where in `Patches::tight` the pairs nearer than `loose_m` at rest are listed.
    tight: Range<u32>,
    tight_m: f64,
}

/// A pair of elements that is nearer than a cell at rest.
#[derive(Clone, Copy, Debug)]
pub struct Tight {
    /// Whether they are a point and a triangle, or two edges.
    pub kind: PairKind,
    /// The indices of the two elements.
    pub elements: [u32; 2],
    /// Weights of the corners in the vector between the closest points at rest.
    pub weights: [f64; 4],
}

/// What is known of the pairs of two neighbouring cells.
pub enum Verdict<'a> {
    /// All are farther apart than was asked.
    Apart,
    /// All but these are.
    ApartBut(&'a [Tight]),
    /// Nothing is known: the pairs must be looked at one by one.
    Unknown,
}

/// Of a bin or cell on the sheet: along the chart's axes.
type Place = [i32; 2];

/// The patches of a mesh: what is prepared once to tell neighbours on the sheet apart.
#[derive(Clone, Debug)]
pub struct Patches {
    /// Place of each bin on the sheet.
    places: Vec<Place>,
    /// Cells by bin.
    pub cells: Lists,
    /// By cell.
    pub triangles: Lists,
    pub edges: Lists,
    pub points: Lists,
    pub vertices: Lists,
    /// In groups of [`LANES`], bin by bin.
    elements: Vec<Element>,
    groups: Vec<Range<u32>>,
    /// Bins of each block of bins.
    bin_blocks: Lists,
    /// Slots in `elements` of each block of cells.
    cell_blocks: Lists,
    pub near_bins: Vec<NearBins>,
    pub near_cells: Vec<NearCells>,
    pub apart_cells: Vec<[u32; 2]>,
    tight: Vec<Tight>,
    loose_m: f64,
}

/// `F` of [`LANES`] triangles: the images of the two rest axes.
type Group = [[f32; LANES]; 6];

/// The state of all patches at the ends of a motion; buffers are reused.
#[derive(Clone, Debug, Default)]
pub struct Stretches {
    ends: Vec<Vec<Group>>,
    /// Sum of `F` by bin.
    sums: Vec<[Vector3; 2]>,
    /// `mu` of each block.
    of_bins: Vec<f64>,
    /// NaN: not yet asked for.
    of_cells: Vec<f64>,
    /// `F` again, by slot: the two images, each with a zero.
    rows: Vec<Vec<[f32; 8]>>,
}

impl Stretches {
    /// `ends`: positions at the one or both ends of a straight motion.
    pub fn measure(&mut self, patches: &Patches, ends: &[&[Vector3]]) {
        self.ends.resize(ends.len(), Vec::new());
        self.sums.clear();
        self.sums.resize(patches.bins(), [Vector3::zeros(); 2]);
        self.rows.resize(ends.len(), Vec::new());
        for ((groups, rows), x) in self.ends.iter_mut().zip(&mut self.rows).zip(ends) {
            groups.clear();
            rows.clear();
            for (bin, range) in patches.groups.iter().enumerate() {
                for g in range.clone() {
                    let elements = &patches.elements[g as usize * LANES..][..LANES];
                    groups.push(gradients(elements, x, &mut self.sums[bin], rows));
                }
            }
        }
        self.of_bins.clear();
        for block in 0..patches.bin_blocks.len() as u32 {
            let mu = self.stretch_of_bins(patches, patches.bin_blocks.of(block));
            self.of_bins.push(mu);
        }
        self.of_cells.clear();
        self.of_cells.resize(patches.cell_blocks.len(), f64::NAN);
    }

    /// `mu` of a block of bins; 0 or less if nothing can be told.
    fn stretch_of_bins(&self, patches: &Patches, bins: &[u32]) -> f64 {
        let mut mean = [Vector3::zeros(); 2];
        for &bin in bins {
            let sum = &self.sums[bin as usize];
            mean = [mean[0] + sum[0], mean[1] + sum[1]];
        }
        let frame = polar_frame(mean.map(|m| [m.x as f32, m.y as f32, m.z as f32]));
        let mut least = Least::default();
        for groups in &self.ends {
            for &bin in bins {
                for g in patches.groups[bin as usize].clone() {
                    least.include(&groups[g as usize], &frame);
                }
            }
        }
        least.eigenvalue()
    }

    fn stretch_of_cells(&self, slots: &[u32]) -> f64 {
        let mut sums = [0.0; 8];
        for rows in &self.rows {
            for &slot in slots {
                let row = &rows[slot as usize];
                for k in 0..8 {
                    sums[k] += row[k];
                }
            }
        }
        let [r, s] = polar_frame([[sums[0], sums[1], sums[2]], [sums[4], sums[5], sums[6]]]);
        let (mut a, mut c, mut off) = (f32::INFINITY, f32::INFINITY, 0.0);
        for rows in &self.rows {
            for &slot in slots {
                let f = &rows[slot as usize];
                let rf = r[0] * f[0] + r[1] * f[1] + r[2] * f[2];
                let sg = s[0] * f[4] + s[1] * f[5] + s[2] * f[6];
                let rg = r[0] * f[4] + r[1] * f[5] + r[2] * f[6];
                let sf = s[0] * f[0] + s[1] * f[1] + s[2] * f[2];
                let b = (0.5 * (rg + sf)).abs();
                a = if rf < a { rf } else { a };
                c = if sg < c { sg } else { c };
                off = if b > off { b } else { off };
            }
        }
        eigenvalue(a, c, off)
    }

    /// `mu` of two neighbouring bins.
    pub fn of_bins(&self, near: &NearBins) -> f64 {
        let known = near.blocks.iter().filter(|b| **b != NONE);
        known.map(|b| self.of_bins[*b as usize]).fold(0.0, f64::max)
    }

    /// What is known of two neighbouring cells of bins with `mu`.
    pub fn verdict<'a>(
        &mut self,
        patches: &'a Patches,
        near: &NearCells,
        mut mu: f64,
        within_m: f64,
    ) -> Verdict<'a> {
        let tight = &patches.tight[near.tight.start as usize..near.tight.end as usize];
        if mu * near.tight_m > within_m {
            return Verdict::Apart;
        }
        // testing the few listed pairs costs less than asking the blocks
        if mu * patches.loose_m > within_m {
            return Verdict::ApartBut(tight);
        }
        for &block in near.blocks.iter().filter(|b| **b != NONE) {
            if self.of_cells[block as usize].is_nan() {
                let slots = patches.cell_blocks.of(block);
                self.of_cells[block as usize] = self.stretch_of_cells(slots).max(0.0);
            }
            mu = mu.max(self.of_cells[block as usize]);
            if mu * near.tight_m > within_m {
                return Verdict::Apart;
            }
        }
        if mu * patches.loose_m > within_m {
            return Verdict::ApartBut(tight);
        }
        Verdict::Unknown
    }
}

impl NearBins {
    /// Whether all pairs of the two bins are farther apart than `within_m`.
    pub fn apart(&self, mu: f64, within_m: f64) -> bool {
        mu * self.tight_m > within_m
    }
}

impl Patches {
    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.places.len()
    }

    /// Whether two bins lie beside each other on the sheet.
    pub fn neighbours(&self, a: u32, b: u32) -> bool {
        adjacent(self.places[a as usize], self.places[b as usize])
    }

    /// Whether all pairs of cells that are no neighbours are farther apart than `within_m`.
    pub fn loose_apart(&self, mu: f64, within_m: f64) -> bool {
        mu * self.loose_m > within_m
    }
}

fn adjacent(a: Place, b: Place) -> bool {
    (a[0] - b[0]).abs() <= 1 && (a[1] - b[1]).abs() <= 1
}

/// The polar factor of a mean `F`: sum and difference of unit vectors are
/// orthogonal. Zero where that is lost in rounding.
fn polar_frame(mean: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |v: [f32; 3]| {
        let scale = 1.0 / dot(v, v).sqrt();
        v.map(|x| x * scale)
    };
    let [p, q] = mean.map(unit);
    let (sum, difference) = ([0, 1, 2].map(|k| p[k] + q[k]), [0, 1, 2].map(|k| p[k] - q[k]));
    // false also where a mean vanishes and its direction is NaN
    let sound = dot(sum, sum).min(dot(difference, difference)) >= DEGENERATE_SQ;
    if !sound {
        return [[0.0; 3]; 2];
    }
    let (sum, difference) = (unit(sum), unit(difference));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    [
        [0, 1, 2].map(|k| (sum[k] + difference[k]) * half),
        [0, 1, 2].map(|k| (sum[k] - difference[k]) * half),
    ]
}

/// `F = [b - a, c - a] inverse` of each triangle, summed into `sums`.
fn gradients(
    elements: &[Element],
    x: &[Vector3],
    sums: &mut [Vector3; 2],
    rows: &mut Vec<[f32; 8]>,
) -> Group {
    let mut group = [[0.0; LANES]; 6];
    for (lane, element) in elements.iter().enumerate() {
        let [a, b, c] = element.corners.map(|v| x[v as usize]);
        let (ab, ac) = (b - a, c - a);
        let [i, j, k, l] = element.inverse;
        let (f1, f2) = (ab * i + ac * k, ab * j + ac * l);
        sums[0] += f1;
        sums[1] += f2;
        let [f, g] = [f1, f2].map(|v| [v.x as f32, v.y as f32, v.z as f32]);
        for axis in 0..3 {
            group[axis][lane] = f[axis];
            group[axis + 3][lane] = g[axis];
        }
        rows.push([f[0], f[1], f[2], 0.0, g[0], g[1], g[2], 0.0]);
    }
    group
}

/// Least diagonal and largest off-diagonal entries of `sym(R^T F)`.
struct Least {
    diagonal: [[f32; LANES]; 2],
    off: [f32; LANES],
}

impl Default for Least {
    fn default() -> Self {
        Least { diagonal: [[f32::INFINITY; LANES]; 2], off: [0.0; LANES] }
    }
}

impl Least {
    #[inline]
    fn include(&mut self, f: &Group, frame: &[[f32; 3]; 2]) {
        let [r, s] = frame;
        for k in 0..LANES {
            let rf = r[0] * f[0][k] + r[1] * f[1][k] + r[2] * f[2][k];
            let sg = s[0] * f[3][k] + s[1] * f[4][k] + s[2] * f[5][k];
            let rg = r[0] * f[3][k] + r[1] * f[4][k] + r[2] * f[5][k];
            let sf = s[0] * f[0][k] + s[1] * f[1][k] + s[2] * f[2][k];
            let off = (0.5 * (rg + sf)).abs();
            self.diagonal[0][k] = if rf < self.diagonal[0][k] { rf } else { self.diagonal[0][k] };
            self.diagonal[1][k] = if sg < self.diagonal[1][k] { sg } else { self.diagonal[1][k] };
            self.off[k] = if off > self.off[k] { off } else { self.off[k] };
        }
    }

    fn eigenvalue(&self) -> f64 {
        let [a, c] = self.diagonal.map(|d| d.into_iter().fold(f32::INFINITY, f32::min));
        eigenvalue(a, c, self.off.into_iter().fold(0.0, f32::max))
    }
}

/// The least of the matrix of extremes, a lower bound for all: diagonal `a`, `c`.
fn eigenvalue(a: f32, c: f32, off: f32) -> f64 {
    let (a, c, b) = (f64::from(a), f64::from(c), f64::from(off));
    let rounding = ROUNDING * (1.0 + a.abs() + c.abs() + b);
    0.5 * (a + c) - (0.25 * (a - c).powi(2) + b * b).sqrt() - rounding
}

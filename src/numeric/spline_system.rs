//! Least squares over the controls of a spline map from a square into space, with
//! a few unknowns common to all of it.
//!
//! The sum over rows of `weight (sum_k row_k . dc_k + share . dz - residual)^2`, with
//! the 16 controls c_k that act at a place and the common unknowns z, has the normal
//! matrix `[K C; C^T D]`. K is sparse on a fixed pattern; z is eliminated last, by its
//! Schur complement. Rows of one span meet in a [`SpanSum`] first, so that spans can
//! be summed on many threads and the result does not depend on their number.
//!
//! K is factorised in single precision, for half the memory and time; the factor, also
//! of a K some steps ago, preconditions conjugate gradients on K itself.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rayon::prelude::*;

use super::bspline::Grid;
use super::sparse::{Analysis, BlockPattern, BlockSlot, Factor, Work, grid_dissection};

/// Cells that a spline's controls reach.
const REACH: usize = 3;
/// Controls that act at a place.
const ACTING: usize = 16;
/// Pairs of them.
const PAIRS: usize = ACTING * (ACTING + 1) / 2;
/// Conjugate gradients end when the residual has fallen to this, in the preconditioner's norm,
const TOLERANCE: f64 = 1e-3;
/// or after so many products.
const MOST_PRODUCTS: usize = 60;

/// Sums of one span, for `Z` common unknowns.
pub struct SpanSum<const Z: usize> {
    blocks: Vec<Matrix3<f64>>,
    right: [Vector3<f64>; ACTING],
    border: [[Vector3<f64>; ACTING]; Z],
    corner: SMatrix<f64, Z, Z>,
    corner_right: SVector<f64, Z>,
}

impl<const Z: usize> Default for SpanSum<Z> {
    fn default() -> Self {
        Self {
            blocks: vec![Matrix3::zeros(); PAIRS],
            right: [Vector3::zeros(); ACTING],
            border: [[Vector3::zeros(); ACTING]; Z],
            corner: SMatrix::zeros(),
            corner_right: SVector::zeros(),
        }
    }
}

impl<const Z: usize> SpanSum<Z> {
    /// Adds `weight (sum_k row_k . dc_k + share . dz - residual)^2`.
    pub fn add(
        &mut self,
        row: &[Vector3<f64>; ACTING],
        share: &SVector<f64, Z>,
        residual: f64,
        weight: f64,
    ) {
        let mut pair = 0;
        for k in 0..ACTING {
            let scaled = row[k] * weight;
            self.right[k] += scaled * residual;
            for z in 0..Z {
                self.border[z][k] += scaled * share[z];
            }
            for l in &row[..=k] {
                self.blocks[pair] += scaled * l.transpose();
                pair += 1;
            }
        }
        self.corner += share * share.transpose() * weight;
        self.corner_right += share * (weight * residual);
    }
}

/// The normal equations, their pattern and their factor.
pub struct SplineSystem<const Z: usize> {
    grid: Grid,
    analysis: Analysis,
    /// Slot of the pair (control, control + (da, db - REACH)), if there is one.
    slots: Vec<Option<BlockSlot>>,
    values: Vec<f64>,
    right: Vec<Vector3<f64>>,
    border: [Vec<Vector3<f64>>; Z],
    corner: SMatrix<f64, Z, Z>,
    corner_right: SVector<f64, Z>,
    factor: Factor<f32>,
}

impl<const Z: usize> SplineSystem<Z> {
    /// The system of a grid, without any rows yet.
    #[must_use]
    pub fn new(grid: Grid) -> Self {
        let n = grid.side();
        let pairs = |j: usize| {
            let (a, b) = (j / n, j % n);
            let offsets = (0..=REACH).flat_map(|da| (0..=2 * REACH).map(move |db| (da, db)));
            offsets.map(move |(da, db)| {
                let inside = a + da < n && (REACH..n + REACH).contains(&(b + db));
                (inside && (da, db) > (0, REACH)).then(|| (a + da) * n + b + db - REACH)
            })
        };
        let below = (0..n * n).map(|j| pairs(j).flatten().map(|i| i as u32).collect()).collect();
        let analysis = Analysis::new(BlockPattern::new(below), Some(&grid_dissection(n, n, REACH)));
        let slots = (0..n * n)
            .flat_map(|j| pairs(j).map(move |i| (i, j)))
            .map(|(i, j)| i.and_then(|i| analysis.pattern().slot(i, j)))
            .collect();
        let zeros = || vec![Vector3::zeros(); n * n];
        Self {
            grid,
            slots,
            values: vec![0.0; analysis.pattern().nonzeros()],
            right: zeros(),
            border: std::array::from_fn(|_| zeros()),
            corner: SMatrix::zeros(),
            corner_right: SVector::zeros(),
            factor: Factor::new(&analysis),
            analysis,
        }
    }

    /// Forgets all rows; the factor stays.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.right.fill(Vector3::zeros());
        self.border.iter_mut().for_each(|column| column.fill(Vector3::zeros()));
        self.corner = SMatrix::zeros();
        self.corner_right = SVector::zeros();
    }

    /// Adds the sums of the span whose first controls are `first`.
    pub fn add_span(&mut self, first: [usize; 2], sum: &SpanSum<Z>) {
        let control = |k: usize| self.grid.index(first[0] + k / 4, first[1] + k % 4);
        let mut pair = 0;
        for k in 0..ACTING {
            let i = control(k);
            self.right[i] += sum.right[k];
            for z in 0..Z {
                self.border[z][i] += sum.border[z][k];
            }
            for l in 0..=k {
                let (block, j) = (&sum.blocks[pair], control(l));
                pair += 1;
                if k == l {
                    self.analysis.pattern().add_diagonal(&mut self.values, i, block);
                } else if let Some(slot) = self.slot(j, k / 4 - l / 4, REACH + k % 4 - l % 4) {
                    BlockPattern::add_block(&mut self.values, slot, block);
                }
            }
        }
        self.corner += sum.corner;
        self.corner_right += sum.corner_right;
    }

    fn slot(&self, j: usize, da: usize, db: usize) -> Option<BlockSlot> {
        self.slots[(j * (REACH + 1) + da) * (2 * REACH + 1) + db]
    }

    /// Adds weight |sum_k scale_k (c_k + dc_k)|^2 over the controls (a, b, scale),
    /// those at `now`; the controls in increasing order.
    pub fn add_stencil(
        &mut self,
        cells: &[(usize, usize, f64)],
        now: &[Vector3<f64>],
        weight: f64,
    ) {
        let at = |a: usize, b: usize| self.grid.index(a, b);
        let sum: Vector3<f64> = cells.iter().map(|&(a, b, scale)| now[at(a, b)] * scale).sum();
        for (k, &(high_a, high_b, high)) in cells.iter().enumerate() {
            let i = at(high_a, high_b);
            self.right[i] -= sum * (weight * high);
            for &(low_a, low_b, low) in &cells[..=k] {
                let block = Matrix3::identity() * (weight * high * low);
                let j = at(low_a, low_b);
                if j == i {
                    self.analysis.pattern().add_diagonal(&mut self.values, i, &block);
                } else if let Some(slot) = self.slot(j, high_a - low_a, REACH + high_b - low_b) {
                    BlockPattern::add_block(&mut self.values, slot, &block);
                }
            }
        }
    }

    /// Adds weight |dc|^2 for every control.
    pub fn hold(&mut self, weight: f64) {
        for i in 0..self.right.len() {
            let block = Matrix3::identity() * weight;
            self.analysis.pattern().add_diagonal(&mut self.values, i, &block);
        }
    }

    /// Adds weight (dz - residual)^2 for one of the common unknowns.
    pub fn hold_common(&mut self, which: usize, residual: f64, weight: f64) {
        self.corner[(which, which)] += weight;
        self.corner_right[which] += weight * residual;
    }

    /// Factorises K as it is now; false if it is singular.
    #[must_use]
    pub fn factorize(&mut self) -> bool {
        self.factor.factorize(&self.values)
    }

    /// The least-squares step of the controls and of the common unknowns, with the last
    /// factor; `None` if they cannot be told apart.
    #[must_use]
    pub fn step(&self) -> Option<(Vec<Vector3<f64>>, SVector<f64, Z>)> {
        let Self { factor, analysis, values, right, border, .. } = self;
        let sides: Vec<&Vec<Vector3<f64>>> = std::iter::once(right).chain(border).collect();
        let solve = |b: &Vec<Vector3<f64>>| gradients(factor, analysis.pattern(), values, b);
        let mut images: Vec<Vec<Vector3<f64>>> = sides.into_par_iter().map(solve).collect();
        let mut step = images.remove(0);
        let schur = self.corner - SMatrix::from_fn(|a, b| dot(&border[a], &images[b]));
        let left = self.corner_right - SVector::from_fn(|z, _| dot(&border[z], &step));
        let common = schur.try_inverse()? * left;
        for (z, image) in images.iter().enumerate() {
            step.iter_mut().zip(image).for_each(|(s, i)| *s -= i * common[z]);
        }
        Some((step, common))
    }
}

/// K^-1 of a right-hand side by conjugate gradients, preconditioned with a rough factor of K
/// or of a matrix near it.
fn gradients(
    factor: &Factor<f32>,
    pattern: &BlockPattern,
    values: &[f64],
    right: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let mut residual = right.to_vec();
    let mut solution = vec![Vector3::zeros(); residual.len()];
    let mut product = solution.clone();
    let mut near = residual.clone();
    let mut work = Work::default();
    factor.solve_with(&mut work, &mut [&mut near]);
    let mut search = near.clone();
    let mut rho = dot(&residual, &near);
    let enough = rho * TOLERANCE * TOLERANCE;
    for _ in 0..MOST_PRODUCTS {
        if rho <= enough {
            break;
        }
        pattern.multiply(values, &search, &mut product);
        let share = rho / dot(&search, &product);
        for (((x, r), d), p) in solution.iter_mut().zip(&mut residual).zip(&search).zip(&product) {
            *x += d * share;
            *r -= p * share;
        }
        near.copy_from_slice(&residual);
        factor.solve_with(&mut work, &mut [&mut near]);
        let before = std::mem::replace(&mut rho, dot(&residual, &near));
        search.iter_mut().zip(&near).for_each(|(d, z)| *d = z + *d * (rho / before));
    }
    solution
}

fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane in space, shifted by an unknown common height, seen at scattered places.
    #[test]
    fn controls_and_a_common_unknown_are_found_together() {
        let grid = Grid::new(0.05, 0.01);
        let n = grid.side();
        let mut system = SplineSystem::<1>::new(grid);
        let mut now = vec![Vector3::zeros(); n * n];
        let mut height = 0.0;
        let truth = |at: [f64; 2]| Vector3::new(at[0], 2.0 * at[1], at[0] - at[1]);
        let value = |now: &[Vector3<f64>], at: [f64; 2]| -> Vector3<f64> {
            let w = grid.weights(at);
            (0..16).map(|k| now[grid.control(&w, k)] * w.value[k]).sum()
        };
        // Each step goes all but 1e-3 of the way, also with the factor of a step before.
        for round in 0..5 {
            system.clear();
            for k in 0..400 {
                let at = [f64::from(k % 20) * 5e-3 - 0.0475, f64::from(k / 20) * 5e-3 - 0.0475];
                let w = grid.weights(at);
                let mut sum = SpanSum::default();
                for axis in 0..3 {
                    let row = w.value.map(|value| Vector3::ith(axis, value));
                    // Every other place is off by the common unknown, 0.3 along z.
                    let share = if axis == 2 && k % 2 == 0 { 1.0 } else { 0.0 };
                    let off = truth(at)[axis] - value(&now, at)[axis];
                    sum.add(&row, &SVector::from([share]), off + (0.3 - height) * share, 1.0);
                }
                system.add_span(w.first, &sum);
            }
            for (a, b) in (0..n).flat_map(|a| (0..n - 2).map(move |b| (a, b))) {
                system.add_stencil(&[(a, b, 1.0), (a, b + 1, -2.0), (a, b + 2, 1.0)], &now, 1e-3);
                system.add_stencil(&[(b, a, 1.0), (b + 1, a, -2.0), (b + 2, a, 1.0)], &now, 1e-3);
            }
            assert!(round > 1 || system.factorize());
            let (step, common) = system.step().unwrap();
            now.iter_mut().zip(&step).for_each(|(c, s)| *c += s);
            height += common[0];
        }
        assert!((height - 0.3).abs() < 1e-9, "{height}");
        let at = [0.0123, -0.031];
        assert!((value(&now, at) - truth(at)).norm() < 1e-9, "{}", value(&now, at));
    }
}

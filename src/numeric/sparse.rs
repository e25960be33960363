//! A symmetric matrix of 3 x 3 blocks on a fixed pattern, and its Cholesky factor.
//!
//! In: the pattern (block rows under each block column) once, then values as
//! often as wanted. Out: a factor that solves, or the news that the matrix is
//! not positive definite. The pattern of a cloth's tangent is the same for every
//! fabric, so it is analysed once and shared ([`Analysis`] is cheap to clone).
//!
//! The lower triangle is stored by scalar columns (CSC), the layout that faer
//! factorises; a block's entries are found by [`BlockSlot`] without searching.

use std::ops::Range;
use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::Perm;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SymbolicSupernodalCholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side, Spec};
use nalgebra::{Matrix3, Vector3};

use crate::numeric::triangular::{Scalar, solve_in_place};

/// Where a block below the diagonal lies in the value array: its column c starts
/// at `first + c * stride - c (c - 1) / 2`, its rows are contiguous.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlockSlot {
    first: u32,
    stride: u32,
}

/// The pattern of a symmetric block matrix: lower triangle, scalar CSC.
#[derive(Debug)]
pub struct BlockPattern {
    blocks: usize,
    block_col_ptr: Vec<usize>,
    block_rows: Vec<u32>,
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
}

impl BlockPattern {
    /// From the neighbours of each block: `rows_below[j]` lists the block rows
    /// i > j that couple with j, in any order, duplicates allowed.
    #[must_use]
    pub fn new(mut rows_below: Vec<Vec<u32>>) -> Self {
        let blocks = rows_below.len();
        let mut block_col_ptr = vec![0];
        let mut block_rows = Vec::new();
        let (mut col_ptr, mut row_idx) = (vec![0], Vec::new());
        for (j, rows) in rows_below.iter_mut().enumerate() {
            rows.retain(|&i| i as usize > j);
            rows.sort_unstable();
            rows.dedup();
            for c in 0..3 {
                row_idx.extend((c..3).map(|r| 3 * j + r));
                for &i in rows.iter() {
                    row_idx.extend((0..3).map(|r| 3 * i as usize + r));
                }
                col_ptr.push(row_idx.len());
            }
            block_rows.extend_from_slice(rows);
            block_col_ptr.push(block_rows.len());
        }
        Self { blocks, block_col_ptr, block_rows, col_ptr, row_idx }
    }

    /// Number of scalar unknowns, three a block.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        3 * self.blocks
    }

    /// Number of values of a matrix on this pattern.
    #[must_use]
    pub fn nonzeros(&self) -> usize {
        self.row_idx.len()
    }

    /// Where the block (row, column), row > column, lies among the values; `None` outside the
    /// pattern.
    #[must_use]
    pub fn slot(&self, row: usize, column: usize) -> Option<BlockSlot> {
        let range = self.block_col_ptr[column]..self.block_col_ptr[column + 1];
        let below = range.len();
        let position = self.block_rows[range].binary_search(&(row as u32)).ok()?;
        let first = self.col_ptr[3 * column] + 3 + 3 * position;
        Some(BlockSlot { first: first as u32, stride: (3 * below + 2) as u32 })
    }

    /// Adds `block` to the values at a slot below the diagonal.
    #[inline]
    pub fn add_block(values: &mut [f64], slot: BlockSlot, block: &Matrix3<f64>) {
        let mut start = slot.first as usize;
        for c in 0..3 {
            let column = &mut values[start..start + 3];
            for r in 0..3 {
                column[r] += block[(r, c)];
            }
            start += slot.stride as usize - c;
        }
    }

    /// Adds the lower triangle of a symmetric `block` to the values on the diagonal.
    #[inline]
    pub fn add_diagonal(&self, values: &mut [f64], index: usize, block: &Matrix3<f64>) {
        for c in 0..3 {
            let start = self.col_ptr[3 * index + c];
            for r in c..3 {
                values[start + r - c] += block[(r, c)];
            }
        }
    }

    /// Writes the product A x to `out`, A being the symmetric matrix with these values.
    pub fn multiply(&self, values: &[f64], x: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        out.fill(Vector3::zeros());
        for j in 0..self.blocks {
            let rows = &self.block_rows[self.block_col_ptr[j]..self.block_col_ptr[j + 1]];
            for c in 0..3 {
                let column = &values[self.col_ptr[3 * j + c]..self.col_ptr[3 * j + c + 1]];
                let (own, below) = column.split_at(3 - c);
                let xc = x[j][c];
                out[j][c] += own[0] * xc;
                let mut sum = 0.0;
                for (value, r) in own[1..].iter().zip(c + 1..) {
                    out[j][r] += value * xc;
                    sum += value * x[j][r];
                }
                for (block, &i) in below.chunks_exact(3).zip(rows) {
                    let (y, x) = (&mut out[i as usize], &x[i as usize]);
                    for r in 0..3 {
                        y[r] += block[r] * xc;
                        sum += block[r] * x[r];
                    }
                }
                out[j][c] += sum;
            }
        }
    }

    fn symbolic(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.unknowns();
        SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx)
    }
}

/// A pattern with its ordering and symbolic factor; clones share it.
#[derive(Clone, Debug)]
pub struct Analysis {
    inner: Arc<Analysed>,
}

#[derive(Debug)]
struct Analysed {
    pattern: BlockPattern,
    symbolic: SymbolicCholesky<usize>,
}

impl Analysis {
    /// Analyses `pattern` with the given order of elimination of the blocks, or
    /// with approximate minimum degree if there is none.
    ///
    /// # Panics
    /// If `order` is not a permutation, or memory for the analysis is not to be had.
    #[must_use]
    pub fn new(pattern: BlockPattern, order: Option<&[u32]>) -> Self {
        let perm = order.map(|order| {
            let n = pattern.unknowns();
            let forward: Vec<usize> =
                order.iter().flat_map(|&b| (0..3).map(move |c| 3 * b as usize + c)).collect();
            let mut inverse = vec![0; n];
            for (new, &old) in forward.iter().enumerate() {
                inverse[old] = new;
            }
            Perm::new_checked(forward.into_boxed_slice(), inverse.into_boxed_slice(), n)
        });
        let ordering = match &perm {
            Some(perm) => SymmetricOrdering::Custom(perm.as_ref()),
            None => SymmetricOrdering::Amd,
        };
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(pattern.symbolic(), Side::Lower, ordering, params)
                .unwrap_or_else(|error| panic!("symbolic factorisation: {error:?}"));
        Self { inner: Arc::new(Analysed { pattern, symbolic }) }
    }

    /// The pattern that was analysed.
    #[must_use]
    pub fn pattern(&self) -> &BlockPattern {
        &self.inner.pattern
    }

    /// The factor's panels.
    fn supernodes(&self) -> &SymbolicSupernodalCholesky<usize> {
        match self.inner.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodes were asked for"),
        }
    }

    /// The unknown eliminated first, second, ...
    fn order(&self) -> &[usize] {
        self.inner.symbolic.perm().map_or(&[], |perm| perm.arrays().0)
    }

    /// Number of entries of the factor, explicit zeros of the supernodes included.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.inner.symbolic.len_val()
    }
}

/// The number types that a factor can be held in.
pub trait Real: faer::traits::RealField + Scalar {
    /// The value rounded to this type.
    fn of(value: f64) -> Self;
    /// The value in double precision.
    fn wide(self) -> f64;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn wide(self) -> f64 {
        self
    }
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

/// A numeric factor with its work space, reused from matrix to matrix. In single
/// precision it costs half and serves as a preconditioner.
pub struct Factor<T: Real = f64> {
    analysis: Analysis,
    values: Vec<T>,
    l_values: Vec<T>,
    work: Work<T>,
    memory: MemBuffer,
}

/// Work space of substitutions.
#[derive(Clone, Debug, Default)]
pub struct Work<T: Real = f64> {
    /// Right-hand sides in the factor's order.
    rhs: Vec<Vec<T>>,
    gathered: Vec<Vec<T>>,
}

impl<T: Real> Factor<T> {
    /// A factor without values yet, with its work space for one thread.
    #[must_use]
    pub fn new(analysis: &Analysis) -> Self {
        let symbolic = &analysis.inner.symbolic;
        let need = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<T>(1, Par::Seq),
        ]);
        Self {
            values: vec![T::of(0.0); analysis.pattern().nonzeros()],
            l_values: vec![T::of(0.0); symbolic.len_val()],
            work: Work::default(),
            memory: MemBuffer::new(need),
            analysis: analysis.clone(),
        }
    }

    /// Factorises the matrix with these values on the analysed pattern. False if it is not positive
    /// definite; the factor must not be used then.
    #[must_use]
    pub fn factorize(&mut self, values: &[f64]) -> bool {
        let Analysed { pattern, symbolic } = &*self.analysis.inner;
        for (own, &value) in self.values.iter_mut().zip(values) {
            *own = T::of(value);
        }
        let matrix = SparseColMatRef::new(pattern.symbolic(), self.values.as_slice());
        symbolic
            .factorize_numeric_llt(
                &mut self.l_values,
                matrix,
                Side::Lower,
                faer::linalg::cholesky::llt::factor::LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Spec::default(),
            )
            .is_ok()
    }

    /// Solves A x = b in place with the last factor: `x` holds the right-hand side and becomes the
    /// solution.
    pub fn solve(&mut self, x: &mut [Vector3<f64>]) {
        self.work.solve(&self.analysis, &self.l_values, &mut [x]);
    }

    /// Solves for some right-hand sides as [`Factor::solve`] does for one, to the last bit, with a
    /// work space of the caller's, so that several threads can share one factor. Reads the factor
    /// once for all of them.
    pub fn solve_with(&self, work: &mut Work<T>, all: &mut [&mut [Vector3<f64>]]) {
        work.solve(&self.analysis, &self.l_values, all);
    }
}

/// Right-hand sides that a factor is read for at a time; other numbers have not been timed.
pub const TOGETHER: usize = 8;

impl<T: Real> Work<T> {
    fn solve(&mut self, analysis: &Analysis, l_values: &[T], all: &mut [&mut [Vector3<f64>]]) {
        let order = analysis.order();
        self.rhs.resize_with(all.len(), Vec::new);
        for (rhs, x) in self.rhs.iter_mut().zip(all.iter()) {
            rhs.clear();
            rhs.extend(order.iter().map(|&old| T::of(x[old / 3][old % 3])));
        }
        solve_in_place(analysis.supernodes(), l_values, &mut self.rhs, &mut self.gathered);
        for (rhs, x) in self.rhs.iter().zip(all.iter_mut()) {
            for (value, &old) in rhs.iter().zip(order) {
                x[old / 3][old % 3] = value.wide();
            }
        }
    }
}

/// An order of elimination for a `rows` x `columns` grid of blocks (index
/// row * columns + column) whose stencil reaches `reach` cells: nested dissection
/// with separators as wide.
#[must_use]
pub fn grid_dissection(rows: usize, columns: usize, reach: usize) -> Vec<u32> {
    fn visit(
        r: Range<usize>,
        c: Range<usize>,
        (columns, reach): (usize, usize),
        order: &mut Vec<u32>,
    ) {
        let (height, width) = (r.len(), c.len());
        let grid = (columns, reach);
        if height.min(width) <= reach || height * width <= 5 * reach * reach {
            order.extend(r.flat_map(|i| c.clone().map(move |j| (i * columns + j) as u32)));
        } else if height >= width {
            let middle = r.start + (height - reach) / 2;
            visit(r.start..middle, c.clone(), grid, order);
            visit(middle + reach..r.end, c.clone(), grid, order);
            visit(middle..middle + reach, c, grid, order);
        } else {
            let middle = c.start + (width - reach) / 2;
            visit(r.clone(), c.start..middle, grid, order);
            visit(r.clone(), middle + reach..c.end, grid, order);
            visit(r, middle..middle + reach, grid, order);
        }
    }
    let mut order = Vec::with_capacity(rows * columns);
    visit(0..rows, 0..columns, (columns, reach), &mut order);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of blocks with a stencil two wide and a diagonally dominant matrix.
    fn grid_matrix(n: usize) -> (BlockPattern, Vec<f64>) {
        let index = |i: usize, j: usize| (i * n + j) as u32;
        let mut below = vec![Vec::new(); n * n];
        for i in 0..n {
            for j in 0..n {
                for (di, dj) in [(0, 1), (0, 2), (1, 0), (2, 0), (1, 1)] {
                    if i + di < n && j + dj < n {
                        below[index(i, j) as usize].push(index(i + di, j + dj));
                    }
                }
            }
        }
        let pattern = BlockPattern::new(below.clone());
        let mut values = vec![0.0; pattern.nonzeros()];
        for (j, rows) in below.iter().enumerate() {
            pattern.add_diagonal(&mut values, j, &(Matrix3::identity() * 40.0));
            for &i in rows {
                let k = f64::from(i) + j as f64;
                let block = Matrix3::from_fn(|r, c| (k + 3.0 * r as f64 + c as f64).sin());
                BlockPattern::add_block(&mut values, pattern.slot(i as usize, j).unwrap(), &block);
            }
        }
        (pattern, values)
    }

    #[test]
    fn factor_solves_under_both_orderings() {
        let n = 13;
        for order in [None, Some(grid_dissection(n, n, 2))] {
            let (pattern, values) = grid_matrix(n);
            let analysis = Analysis::new(pattern, order.as_deref());
            let mut factor = Factor::<f64>::new(&analysis);
            assert!(factor.factorize(&values));
            let exact: Vec<_> =
                (0..n * n).map(|i| Vector3::new(i as f64, 1.0, (i as f64).cos())).collect();
            let mut x = vec![Vector3::zeros(); n * n];
            analysis.pattern().multiply(&values, &exact, &mut x);
            factor.solve(&mut x);
            let error = x.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(0.0_f64, f64::max);
            // observed: 6e-14; a transposed block scores 1e1
            assert!(error < 1e-11, "{error:e}");
        }
    }

    #[test]
    fn right_hand_sides_solved_together_are_as_if_each_were_alone() {
        let n = 11;
        let (pattern, values) = grid_matrix(n);
        let mut factor =
            Factor::<f64>::new(&Analysis::new(pattern, Some(&grid_dissection(n, n, 2))));
        assert!(factor.factorize(&values));
        let side = |k: usize| -> Vec<Vector3<f64>> {
            let at = |i: usize| Vector3::new((i * k) as f64, (i as f64).sin(), k as f64 - 2.5);
            (0..n * n).map(at).collect()
        };
        let alone = (0..TOGETHER + 3).map(side).map(|mut x| {
            factor.solve(&mut x);
            x
        });
        let alone: Vec<_> = alone.collect();
        let mut together: Vec<_> = (0..TOGETHER + 3).map(side).collect();
        let mut work = Work::default();
        // a work space of more right-hand sides serves fewer
        for some in together.chunks_mut(TOGETHER) {
            let mut some: Vec<_> = some.iter_mut().map(Vec::as_mut_slice).collect();
            factor.solve_with(&mut work, &mut some);
        }
        assert_eq!(alone, together);
    }

    #[test]
    fn an_indefinite_matrix_is_reported() {
        let (pattern, mut values) = grid_matrix(6);
        pattern.add_diagonal(&mut values, 7, &(Matrix3::identity() * -80.0));
        let mut factor = Factor::<f64>::new(&Analysis::new(pattern, None));
        assert!(!factor.factorize(&values));
    }

    #[test]
    fn dissection_is_a_permutation() {
        for (rows, columns, reach) in [(1, 1, 2), (3, 50, 3), (61, 61, 2), (16, 31, 3)] {
            let mut order = grid_dissection(rows, columns, reach);
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, &v)| k == v as usize));
            assert_eq!(order.len(), rows * columns);
        }
    }
}

//! Forward and backward substitution with a supernodal Cholesky factor, one right-hand side or
//! some.
//!
//! faer solves panel by panel with kernels made for many right-hand sides; for one, most of the
//! time goes into their set-up. Here a panel's columns are streamed once on the way down and once
//! on the way up, which is as fast as the factor can be read, and serve all right-hand sides while
//! they are in the cache. Each of these is computed as if it were alone, to the last bit. The
//! machine's wider vector registers are used where it has some, with the same sums and no fused
//! products.

use std::ops::{AddAssign, Div, Mul, Sub};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};

/// What substitution needs of a number.
pub trait Scalar:
    Copy + Default + AddAssign + Mul<Output = Self> + Sub<Output = Self> + Div<Output = Self>
{
}

impl Scalar for f32 {}
impl Scalar for f64 {}

/// Sums kept apart in a product, so that it runs in vector registers.
const LANES: usize = 16;

/// Solves L L^T x = b in place for each x of `all`; `l_values` as faer lays them out for
/// `symbolic`, each x in the factor's order, `gathered` work space.
pub fn solve_in_place<T: Scalar>(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    l_values: &[T],
    all: &mut [Vec<T>],
    gathered: &mut Vec<Vec<T>>,
) {
    gathered.resize_with(all.len(), Vec::new);
    Arch::new().dispatch(Substitution { symbolic, l_values, all, gathered });
}

/// The substitution, compiled for each kind of vector registers.
struct Substitution<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<usize>,
    l_values: &'a [T],
    all: &'a mut [Vec<T>],
    gathered: &'a mut [Vec<T>],
}

impl<T: Scalar> WithSimd for Substitution<'_, T> {
    type Output = ();

    // What is not inlined, a closure too, is compiled for the narrowest registers.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { symbolic, l_values, all, gathered } = self;
        let panels = symbolic.n_supernodes();
        for s in 0..panels {
            Panel::new(symbolic, l_values, s).down(all, gathered);
        }
        for s in (0..panels).rev() {
            Panel::new(symbolic, l_values, s).up(all, gathered);
        }
    }
}

/// A supernode: `columns` columns from `start` on, dense, and the rows below them.
struct Panel<'a, T> {
    start: usize,
    columns: usize,
    rows: &'a [usize],
    values: &'a [T],
}

impl<'a, T: Scalar> Panel<'a, T> {
    #[inline(always)]
    fn new(symbolic: &'a SymbolicSupernodalCholesky<usize>, l_values: &'a [T], s: usize) -> Self {
        let rows = symbolic.supernode(s).pattern();
        let start = symbolic.supernode_begin()[s];
        let values = &l_values[symbolic.col_ptr_for_val()[s]..symbolic.col_ptr_for_val()[s + 1]];
        Self { start, columns: symbolic.supernode_end()[s] - start, rows, values }
    }

    #[inline(always)]
    fn column(&self, j: usize) -> &'a [T] {
        let height = self.columns + self.rows.len();
        &self.values[j * height..(j + 1) * height]
    }

    /// The substitution with L on this panel.
    #[inline(always)]
    fn down(&self, all: &mut [Vec<T>], gathered: &mut [Vec<T>]) {
        let (columns, below) = (self.columns, self.rows.len());
        for (x, gathered) in all.iter_mut().zip(gathered.iter_mut()) {
            gathered.clear();
            gathered.resize(below, T::default());
            let top = &mut x[self.start..self.start + columns];
            for j in 0..columns {
                let column = self.column(j);
                let value = top[j] / column[j];
                top[j] = value;
                for (t, l) in top[j + 1..].iter_mut().zip(&column[j + 1..columns]) {
                    *t = *t - *l * value;
                }
            }
        }
        let mut j = 0;
        while j + 4 <= columns {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &self.column(j + k)[columns..][..below]);
            for (x, gathered) in all.iter().zip(gathered.iter_mut()) {
                let top = &x[self.start + j..][..4];
                let [p, q, r, u] = [top[0], top[1], top[2], top[3]];
                for (i, g) in gathered.iter_mut().enumerate() {
                    let mut sum = a[i] * p;
                    sum += b[i] * q;
                    sum += c[i] * r;
                    sum += d[i] * u;
                    *g += sum;
                }
            }
            j += 4;
        }
        while j < columns {
            let column = &self.column(j)[columns..];
            for (x, gathered) in all.iter().zip(gathered.iter_mut()) {
                let value = x[self.start + j];
                for (g, l) in gathered.iter_mut().zip(column) {
                    *g += *l * value;
                }
            }
            j += 1;
        }
        for (x, gathered) in all.iter_mut().zip(gathered.iter()) {
            for (&row, g) in self.rows.iter().zip(gathered) {
                x[row] = x[row] - *g;
            }
        }
    }

    /// The substitution with the transpose of L on this panel.
    #[inline(always)]
    fn up(&self, all: &mut [Vec<T>], gathered: &mut [Vec<T>]) {
        let columns = self.columns;
        for (x, gathered) in all.iter().zip(gathered.iter_mut()) {
            gathered.clear();
            gathered.extend(self.rows.iter().map(|&row| x[row]));
        }
        for j in (0..columns).rev() {
            let column = self.column(j);
            for (x, gathered) in all.iter_mut().zip(gathered.iter()) {
                let top = &mut x[self.start..self.start + columns];
                let mut sum = dot(&column[columns..], gathered);
                sum += dot(&column[j + 1..columns], &top[j + 1..]);
                top[j] = (top[j] - sum) / column[j];
            }
        }
    }
}

#[inline(always)]
fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    let mut sums = [T::default(); LANES];
    let (a_lanes, b_lanes) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut rest = T::default();
    for (p, q) in a_lanes.remainder().iter().zip(b_lanes.remainder()) {
        rest += *p * *q;
    }
    for (p, q) in a_lanes.zip(b_lanes) {
        for k in 0..LANES {
            sums[k] += p[k] * q[k];
        }
    }
    for sum in sums {
        rest += sum;
    }
    rest
}

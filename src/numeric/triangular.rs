//! Forward and backward substitution with a supernodal Cholesky factor, one right-hand side.
//!
//! faer solves panel by panel with kernels made for many right-hand sides; for one, most of the
//! time goes into their set-up. Here a panel's columns are streamed once on the way down and
//! once on the way up, which is as fast as the factor can be read.

use std::ops::{AddAssign, Div, Mul, Sub};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// What substitution needs of a number.
pub trait Scalar:
    Copy + Default + AddAssign + Mul<Output = Self> + Sub<Output = Self> + Div<Output = Self>
{
}

impl Scalar for f32 {}
impl Scalar for f64 {}

/// Sums kept apart in a product, so that it runs in vector registers.
const LANES: usize = 16;

/// Solves L L^T x = b in place; `l_values` as faer lays them out for `symbolic`, `x` in the
/// factor's order, `gathered` as long as the longest panel.
pub fn solve_in_place<T: Scalar>(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    l_values: &[T],
    x: &mut [T],
    gathered: &mut Vec<T>,
) {
    let panels = symbolic.n_supernodes();
    for s in 0..panels {
        let panel = Panel::new(symbolic, l_values, s);
        let (columns, rows) = (panel.columns, panel.rows);
        let below = rows.len();
        let top = &mut x[panel.start..panel.start + columns];
        gathered.clear();
        gathered.resize(below, T::default());
        let mut j = 0;
        while j < columns {
            let column = panel.column(j);
            let value = top[j] / column[j];
            top[j] = value;
            for (t, l) in top[j + 1..].iter_mut().zip(&column[j + 1..columns]) {
                *t = *t - *l * value;
            }
            j += 1;
        }
        let mut j = 0;
        while j + 4 <= columns {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &panel.column(j + k)[columns..][..below]);
            let [p, q, r, u] = [top[j], top[j + 1], top[j + 2], top[j + 3]];
            for (i, g) in gathered.iter_mut().enumerate() {
                let mut sum = a[i] * p;
                sum += b[i] * q;
                sum += c[i] * r;
                sum += d[i] * u;
                *g += sum;
            }
            j += 4;
        }
        while j < columns {
            let value = top[j];
            for (g, l) in gathered.iter_mut().zip(&panel.column(j)[columns..]) {
                *g += *l * value;
            }
            j += 1;
        }
        for (&row, g) in rows.iter().zip(gathered.iter()) {
            x[row] = x[row] - *g;
        }
    }
    for s in (0..panels).rev() {
        let panel = Panel::new(symbolic, l_values, s);
        let columns = panel.columns;
        gathered.clear();
        gathered.extend(panel.rows.iter().map(|&row| x[row]));
        let top = &mut x[panel.start..panel.start + columns];
        for j in (0..columns).rev() {
            let column = panel.column(j);
            let mut sum = dot(&column[columns..], gathered);
            sum += dot(&column[j + 1..columns], &top[j + 1..]);
            top[j] = (top[j] - sum) / column[j];
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

impl<'a, T> Panel<'a, T> {
    fn new(symbolic: &'a SymbolicSupernodalCholesky<usize>, l_values: &'a [T], s: usize) -> Self {
        let rows = symbolic.supernode(s).pattern();
        let start = symbolic.supernode_begin()[s];
        let values = &l_values[symbolic.col_ptr_for_val()[s]..symbolic.col_ptr_for_val()[s + 1]];
        Self { start, columns: symbolic.supernode_end()[s] - start, rows, values }
    }

    fn column(&self, j: usize) -> &'a [T] {
        let height = self.columns + self.rows.len();
        &self.values[j * height..(j + 1) * height]
    }
}

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

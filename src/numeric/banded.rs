//! Cholesky factorisation of symmetric positive definite banded matrices:
//! enough for the normal equations of a tensor-product spline, with no ordering
//! to compute.

/// The lower band of a symmetric matrix, row by row.
#[derive(Clone, Debug)]
pub struct Banded {
    size: usize,
    /// Entries left of the diagonal.
    width: usize,
    /// Row i holds columns i - width ..= i.
    rows: Vec<f64>,
}

/// The Cholesky factor L of a banded matrix A = L L^T, in the same layout.
#[derive(Clone, Debug)]
pub struct Factor(Banded);

impl Banded {
    /// The zero matrix with `width` entries left of the diagonal.
    #[must_use]
    pub fn zeros(size: usize, width: usize) -> Self {
        Self { size, width, rows: vec![0.0; size * (width + 1)] }
    }

    /// Adds to the entry (row, column) and to its mirror image; the pair is
    /// given once, in either order.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (row.max(column), row.min(column));
        debug_assert!(row - column <= self.width);
        self.rows[row * (self.width + 1) + column + self.width - row] += value;
    }

    /// The Cholesky factor of the matrix; `None` if a pivot is not positive.
    #[must_use]
    pub fn cholesky(mut self) -> Option<Factor> {
        let (n, w) = (self.size, self.width);
        let stride = w + 1;
        for i in 0..n {
            let first = i.saturating_sub(w);
            let (done, current) = self.rows.split_at_mut(i * stride);
            let row_i = &mut current[..stride];
            // Entry (i, j) sits at j + w - i of row i.
            for j in first..i {
                let from = first.max(j.saturating_sub(w));
                let row_j = &done[j * stride..(j + 1) * stride];
                let a = &row_i[from + w - i..j + w - i];
                let b = &row_j[from + w - j..w];
                let sum = dot(a, b);
                row_i[j + w - i] = (row_i[j + w - i] - sum) / row_j[w];
            }
            let a = &row_i[first + w - i..w];
            let pivot = row_i[w] - dot(a, a);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            row_i[w] = pivot.sqrt();
        }
        Some(Factor(self))
    }
}

/// Four partial sums let the compiler use vector registers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (ca, cb) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + tail
}

impl Factor {
    /// Solves L y = b in place: `b` becomes y.
    pub fn forward(&self, b: &mut [f64]) {
        let Banded { size, width, rows } = &self.0;
        for i in 0..*size {
            let first = i.saturating_sub(*width);
            let row = &rows[i * (width + 1)..(i + 1) * (width + 1)];
            let sum = dot(&row[first + width - i..*width], &b[first..i]);
            b[i] = (b[i] - sum) / row[*width];
        }
    }

    /// Solves A x = b in place: `b` becomes x.
    pub fn solve(&self, b: &mut [f64]) {
        self.forward(b);
        let Banded { size, width, rows } = &self.0;
        for i in (0..*size).rev() {
            let row = &rows[i * (width + 1)..(i + 1) * (width + 1)];
            b[i] /= row[*width];
            let x = b[i];
            let first = i.saturating_sub(*width);
            for (k, value) in b[first..i].iter_mut().enumerate() {
                *value -= row[first + k + width - i] * x;
            }
        }
    }

    /// b^T A^-1 b for a sparse b: the variance of a linear combination whose
    /// information matrix is A. The entries come as (index, value).
    #[must_use]
    pub fn inverse_form(&self, entries: &[(usize, f64)]) -> f64 {
        let Some(first) = entries.iter().map(|e| e.0).min() else { return 0.0 };
        let mut b = vec![0.0; self.0.size];
        for &(i, value) in entries {
            b[i] += value;
        }
        // y = L^-1 b is zero before the first entry.
        let Banded { size, width, rows } = &self.0;
        let mut sum = 0.0;
        for i in first..*size {
            let from = i.saturating_sub(*width).max(first);
            let row = &rows[i * (width + 1)..(i + 1) * (width + 1)];
            b[i] = (b[i] - dot(&row[from + width - i..*width], &b[from..i])) / row[*width];
            sum += b[i] * b[i];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_factorised() {
        let (n, w) = (40, 11);
        let value = |i: usize, j: usize| ((i * 31 + j * 17) % 13) as f64 / 13.0 - 0.5;
        let mut a = Banded::zeros(n, w);
        let mut dense = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in i.saturating_sub(w)..=i {
                let v = if i == j { 12.0 } else { value(i, j) };
                a.add(j, i, v);
                dense[i][j] = v;
                dense[j][i] = v;
            }
        }
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| dense[i][j] * x[j]).sum()).collect();
        let factor = a.cholesky().unwrap();
        let form = factor.inverse_form(&b.iter().copied().enumerate().collect::<Vec<_>>());
        let expected: f64 = b.iter().zip(&x).map(|(b, x)| b * x).sum();
        assert!((form - expected).abs() < 1e-10 * expected);
        factor.solve(&mut b);
        for (got, want) in b.iter().zip(&x) {
            assert!((got - want).abs() < 1e-12);
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let mut a = Banded::zeros(2, 1);
        a.add(0, 0, 1.0);
        a.add(1, 0, 2.0);
        a.add(1, 1, 1.0);
        assert!(a.cholesky().is_none());
    }
}

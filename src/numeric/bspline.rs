//! Uniform cubic B-splines on a square: weights of the 16 control points that
//! act at a place, and their derivatives.

/// The square [-half, half]^2 with `intervals` knot spans a side.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    half: f64,
    intervals: usize,
}

/// Control weights of value, d/du and d/dv at one place; the control (a, b) of
/// the 4 x 4 block has the index `4 * a + b` and sits at `first + (a, b)`.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Index of the block's first control in u and v.
    pub first: [usize; 2],
    /// Weights in the spline's value.
    pub value: [f64; 16],
    /// Weights in its derivative by u.
    pub du: [f64; 16],
    /// Weights in its derivative by v.
    pub dv: [f64; 16],
}

fn cubic(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [
        s * s * s / 6.0,
        (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
        (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
        t * t * t / 6.0,
    ]
}

fn cubic_slope(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t]
}

impl Grid {
    /// A grid over [-half, half]^2 with spans of about `spacing`.
    #[must_use]
    pub fn new(half: f64, spacing: f64) -> Self {
        Self { half, intervals: ((2.0 * half / spacing).round() as usize).max(1) }
    }

    /// Half the side of the square.
    #[must_use]
    pub fn half(&self) -> f64 {
        self.half
    }

    /// Length of a knot span.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        2.0 * self.half / self.intervals as f64
    }

    /// Number of controls along a side.
    #[must_use]
    pub fn side(&self) -> usize {
        self.intervals + 3
    }

    /// Index of the control at (a, b), among all of them.
    #[must_use]
    pub fn index(&self, a: usize, b: usize) -> usize {
        a * self.side() + b
    }

    /// Largest difference of the indices of two controls that act at one place.
    #[must_use]
    pub fn bandwidth(&self) -> usize {
        3 * self.side() + 3
    }

    /// The weights of the controls that act at the place `at`; outside the square they are those of
    /// the nearest span's polynomial.
    #[must_use]
    pub fn weights(&self, at: [f64; 2]) -> Weights {
        let h = self.spacing();
        let mut first = [0; 2];
        let mut part = [0.0; 2];
        for c in 0..2 {
            let s = (at[c] + self.half) / h;
            first[c] = (s.max(0.0) as usize).min(self.intervals - 1);
            part[c] = s - first[c] as f64;
        }
        let (u, v) = (cubic(part[0]), cubic(part[1]));
        let (du, dv) = (cubic_slope(part[0]), cubic_slope(part[1]));
        let product = |x: &[f64; 4], y: &[f64; 4], scale: f64| {
            std::array::from_fn(|k| x[k / 4] * y[k % 4] * scale)
        };
        Weights {
            first,
            value: product(&u, &v, 1.0),
            du: product(&du, &v, 1.0 / h),
            dv: product(&u, &dv, 1.0 / h),
        }
    }

    /// Index, among all controls, of control k of the block that `weights` belong to.
    #[must_use]
    pub fn control(&self, weights: &Weights, k: usize) -> usize {
        self.index(weights.first[0] + k / 4, weights.first[1] + k % 4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_their_slopes_match_differences() {
        let grid = Grid::new(0.16, 0.006);
        for at in [[0.0, 0.0], [0.1234, -0.0877], [-0.16, 0.16], [0.1599, 0.03]] {
            let w = grid.weights(at);
            assert!((w.value.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            assert!(w.du.iter().sum::<f64>().abs() < 1e-9);
            // A quadratic control field: differences of its spline.
            let field = |w: &Weights| -> f64 {
                (0..16)
                    .map(|k| {
                        let i = grid.control(w, k);
                        let (a, b) = ((i / grid.side()) as f64, (i % grid.side()) as f64);
                        w.value[k] * (0.3 * a * a - a * b)
                    })
                    .sum()
            };
            let slope: f64 = (0..16)
                .map(|k| {
                    let i = grid.control(&w, k);
                    let (a, b) = ((i / grid.side()) as f64, (i % grid.side()) as f64);
                    w.du[k] * (0.3 * a * a - a * b)
                })
                .sum();
            let step = 1e-6;
            let ahead = field(&grid.weights([at[0] + step, at[1]]));
            let behind = field(&grid.weights([at[0] - step, at[1]]));
            assert!(((ahead - behind) / (2.0 * step) - slope).abs() < 1e-4 * slope.abs().max(1.0));
        }
    }
}

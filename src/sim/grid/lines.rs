//! The lines of vertices across one direction of a grid, evenly spaced or graded.
//!
//! Places are in steps of the mean spacing, from 0 for the first line to count - 1 for the last. On
//! even lines every width is exactly 1 and every place its number, so that what is computed for
//! uneven lines gives the bits of the even ones.
//!
//! **Grading.** The density of lines is `1 + (ratio - 1) b(t)`, b a bump of height 1 over each
//! [`Band`] with logistic flanks, and the lines lie at equal parts of its integral. So a
//! grid of half as many cells has every other line of the finer one, and widths change
//! smoothly, which the three-point differences on them need to stay of second order.

/// A stretch of the lines' direction, in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    pub(super) low: f64,
    pub(super) high: f64,
    /// Length over which the density rises at either end: the logistic function's scale.
    pub(super) flank: f64,
}

impl Band {
    /// The integral up to `t` of a bump of height 1 over the band.
    fn integral(&self, t: f64) -> f64 {
        // log(1 + e^t), the integral of the logistic function
        let rise = |t: f64| t.max(0.0) + (-t.abs()).exp().ln_1p();
        self.flank * (rise((t - self.low) / self.flank) - rise((t - self.high) / self.flank))
    }
}

/// The places of the lines, in steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lines(Vec<f64>);

impl Lines {
    /// Evenly spaced ones.
    pub(super) fn even(count: usize) -> Self {
        Self((0..count).map(|k| k as f64).collect())
    }

    /// As many, `ratio` times as dense in `bands` as elsewhere; evenly spaced with a ratio of 1.
    pub(super) fn graded(count: usize, ratio: f64, bands: &[Band]) -> Self {
        let mut lines = Self::even(count);
        if ratio == 1.0 {
            return lines;
        }
        let last = (count - 1) as f64;
        let of = |t: f64| t + (ratio - 1.0) * bands.iter().map(|b| b.integral(t)).sum::<f64>();
        let (first_of, last_of) = (of(0.0), of(last));
        for k in 1..count - 1 {
            let part = first_of + (last_of - first_of) * k as f64 / last;
            let (mut low, mut high) = (0.0, last);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if of(middle) < part { low = middle } else { high = middle }
            }
            lines.0[k] = 0.5 * (low + high);
        }
        lines
    }

    /// Number of lines.
    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    /// The place of line `k`.
    pub(super) fn at(&self, k: usize) -> f64 {
        self.0[k]
    }

    /// The place of a point between the lines, `k` of them from the first.
    pub(super) fn between(&self, k: f64) -> f64 {
        let cell = (k.floor() as usize).min(self.count() - 2);
        self.0[cell] + (k - cell as f64) * self.width(cell)
    }

    /// Width of the cell between the lines `cell` and `cell + 1`.
    pub(super) fn width(&self, cell: usize) -> f64 {
        self.0[cell + 1] - self.0[cell]
    }

    /// Whether all lines are evenly spaced.
    pub(super) fn are_even(&self) -> bool {
        self.0.iter().enumerate().all(|(k, &at)| at == k as f64)
    }

    /// The last line at or before the place `t`, 0 at least.
    pub(super) fn before(&self, t: f64) -> usize {
        self.0.partition_point(|&at| at <= t).saturating_sub(1)
    }

    /// From half a cell before line `k` to half a cell after it; outside the border, where there
    /// is no cell, as far as inside.
    pub(super) fn around(&self, k: usize) -> [f64; 2] {
        let (before, after) = (k.saturating_sub(1), k.min(self.count() - 2));
        [self.0[k] - 0.5 * self.width(before), self.0[k] + 0.5 * self.width(after)]
    }

    /// Weights of line `k - 1`, `k` and `k + 1` in the second derivative at `k`.
    pub(super) fn second(&self, k: usize) -> [f64; 3] {
        let (before, after) = (self.width(k - 1), self.width(k));
        let both = before + after;
        [2.0 / (before * both), -2.0 / (before * after), 2.0 / (after * both)]
    }

    /// The same in the first derivative, times the width of both cells.
    pub(super) fn first(&self, k: usize) -> [f64; 3] {
        let (before, after) = (self.width(k - 1), self.width(k));
        let ratio = after / before;
        [-ratio, ratio - 1.0 / ratio, 1.0 / ratio]
    }

    /// First of four neighbouring lines and their weights in the cubic through them at the place
    /// `t`, one-sided near the ends.
    pub(super) fn cubic(&self, t: f64) -> (usize, [f64; 4]) {
        let first = (self.before(t) as isize - 1).clamp(0, self.count() as isize - 4) as usize;
        let at: [f64; 4] = std::array::from_fn(|k| self.0[first + k] - self.0[first]);
        let t = t - self.0[first];
        let mut weights = [1.0; 4];
        for (k, weight) in weights.iter_mut().enumerate() {
            for m in 0..4 {
                if m != k {
                    *weight *= (t - at[m]) / (at[k] - at[m]);
                }
            }
        }
        (first, weights)
    }

    /// The weight of line `k` at the place `t` where it is linear between lines.
    pub(super) fn hat(&self, k: usize, t: f64) -> f64 {
        let cell = self.before(t).min(self.count() - 2);
        if k != cell && k != cell + 1 {
            return 0.0;
        }
        (1.0 - (t - self.0[k]).abs() / self.width(cell)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graded(count: usize) -> Lines {
        let steps = (count - 1) as f64 / 60.0;
        let band = |low: f64| Band { low: low * steps, high: (low + 8.0) * steps, flank: steps };
        Lines::graded(count, 1.5, &[band(16.0), band(36.0)])
    }

    #[test]
    fn lines_are_denser_in_the_bands_rise_and_are_symmetric_if_the_bands_are() {
        let lines = graded(61);
        for k in 0..61 {
            assert!(k == 0 || lines.at(k) > lines.at(k - 1));
            assert!((lines.at(k) + lines.at(60 - k) - 60.0).abs() < 1e-12, "{k}");
        }
        let width_at = |t: f64| lines.width(lines.before(t));
        let ratio = width_at(2.0) / width_at(20.0);
        assert!((ratio - 1.5).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn half_as_many_cells_have_every_other_line() {
        let (fine, coarse) = (graded(61), graded(31));
        for k in 0..31 {
            assert!((coarse.at(k) - 0.5 * fine.at(2 * k)).abs() < 1e-12, "{k}");
        }
    }

    #[test]
    fn derivatives_and_cubics_are_exact_for_what_they_know() {
        let lines = graded(31);
        let cubic = |t: f64| 0.3 + t * (1.0 + t * (-0.2 + 0.01 * t));
        for k in 1..30 {
            let of = |weights: [f64; 3], f: &dyn Fn(f64) -> f64| -> f64 {
                (0..3).map(|m| weights[m] * f(lines.at(k + m - 1))).sum()
            };
            let square = |t: f64| 0.5 * t * t - 3.0 * t;
            assert!((of(lines.second(k), &square) - 1.0).abs() < 1e-10, "{k}");
            let both = lines.width(k - 1) + lines.width(k);
            let slope = of(lines.first(k), &square) / both;
            assert!((slope - (lines.at(k) - 3.0)).abs() < 1e-10, "{k}");
        }
        for k in 0..=300 {
            let t = f64::from(k) * 0.1;
            let (first, weights) = lines.cubic(t);
            let sum: f64 = (0..4).map(|m| weights[m] * cubic(lines.at(first + m))).sum();
            assert!((sum - cubic(t)).abs() < 1e-10, "{t}");
            let linear: f64 = (0..31).map(|m| lines.hat(m, t) * lines.at(m)).sum();
            assert!((linear - t).abs() < 1e-12, "{t}");
        }
    }
}

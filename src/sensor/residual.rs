//! The noise of a depth image, real or virtual, measured in one way.
//!
//! In: depths row by row \[m\], NaN where nothing was measured; the side of a window \[pixels\].
//! Out: the standard deviation of what is left about a quadratic in each window, and how it is
//! correlated over pixels. Windows with a missing pixel do not count, nor those with more than
//! 1.5 times the lower quartile's residual, which hold edges. Outliers, more than five standard
//! deviations off by the median residual, are counted and left out of both.
//!
//! Limits: a quadratic takes up what is smoother than the window, so both figures are below
//! those of the noise itself; with windows of 32 pixels and noise that is smooth over 5, by a
//! fifth. Compare what was measured in windows of one size.

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use crate::numeric::robust;

/// Distances at which [`DepthNoise::autocorrelation`] is taken \[pixels\].
pub const LAGS_PX: [usize; 4] = [1, 2, 4, 8];
/// Windows whose residual exceeds the lower quartile by this factor hold edges.
const EDGE_FACTOR: f64 = 1.5;

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthNoise {
    /// Root mean square of the residuals \[m\].
    pub sigma_m: f64,
    /// Their autocorrelation at [`LAGS_PX`], along rows and columns.
    pub autocorrelation: [f64; 4],
    /// Mean depth of the windows \[m\].
    pub depth_m: f64,
    /// Share of the pixels that are outliers.
    pub outliers: f64,
    /// Windows that counted.
    pub windows: usize,
}

/// Sums over one window or several.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: f64,
    pixels: f64,
    products: [f64; 4],
    pairs: [f64; 4],
    depth: f64,
    outliers: f64,
    windows: usize,
}

impl DepthNoise {
    /// Of one image; `None` where no window counts.
    #[must_use]
    pub fn of(depth_m: &[f64], width: usize, window_px: usize) -> Option<Self> {
        Self::of_all(&[depth_m], width, window_px)
    }

    /// Of several images of one size together.
    #[must_use]
    pub fn of_all(images: &[&[f64]], width: usize, window_px: usize) -> Option<Self> {
        let mut all: Vec<Sums> = Vec::new();
        for image in images {
            let tops = (0..(image.len() / width + 1).saturating_sub(window_px)).step_by(window_px);
            let lefts = (0..(width + 1).saturating_sub(window_px)).step_by(window_px);
            let places: Vec<[usize; 2]> =
                tops.flat_map(|top| lefts.clone().map(move |left| [top, left])).collect();
            all.par_extend(
                places.into_par_iter().filter_map(|place| window(image, width, place, window_px)),
            );
        }
        all.sort_by(|a, b| a.rms().total_cmp(&b.rms()));
        let most = EDGE_FACTOR * all.get(all.len() / 4)?.rms();
        let quiet = all.iter().filter(|sums| sums.rms() <= most);
        let sum = quiet.fold(Sums::default(), |sum, own| sum.and(own));
        let variance = sum.squares / sum.pixels;
        let share = |k: usize| sum.products[k] / sum.pairs[k] / variance;
        Some(Self {
            sigma_m: variance.sqrt(),
            autocorrelation: std::array::from_fn(share),
            depth_m: sum.depth / (sum.pixels + sum.outliers),
            outliers: sum.outliers / (sum.pixels + sum.outliers),
            windows: sum.windows,
        })
    }
}

impl Sums {
    fn rms(&self) -> f64 {
        (self.squares / self.pixels).sqrt()
    }

    fn and(self, other: &Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            pixels: self.pixels + other.pixels,
            products: std::array::from_fn(|k| self.products[k] + other.products[k]),
            pairs: std::array::from_fn(|k| self.pairs[k] + other.pairs[k]),
            depth: self.depth + other.depth,
            outliers: self.outliers + other.outliers,
            windows: self.windows + other.windows,
        }
    }
}

/// The sums of the window at (top, left); `None` where a pixel is missing.
fn window(image: &[f64], width: usize, [top, left]: [usize; 2], side: usize) -> Option<Sums> {
    let at = |row: usize, column: usize| image[(top + row) * width + left + column];
    let half = 0.5 * (side as f64 - 1.0);
    let terms = |row: usize, column: usize| {
        let (x, y) = (column as f64 / half - 1.0, row as f64 / half - 1.0);
        Vector6::new(1.0, x, y, x * x, x * y, y * y)
    };
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    let mut depth = 0.0;
    for row in 0..side {
        for column in 0..side {
            let value = at(row, column);
            if !value.is_finite() {
                return None;
            }
            let own = terms(row, column);
            normal += own * own.transpose();
            right += own * value;
            depth += value;
        }
    }
    let found = normal.cholesky()?.solve(&right);
    let mut residuals = Vec::with_capacity(side * side);
    for row in 0..side {
        residuals.extend((0..side).map(|column| at(row, column) - terms(row, column).dot(&found)));
    }
    Some(Sums { depth, windows: 1, ..sums(&without_outliers(residuals)?, side) })
}

/// The residuals, NaN in place of outliers.
fn without_outliers(residuals: Vec<f64>) -> Option<Vec<f64>> {
    const OUTLIER_SIGMAS: f64 = 5.0;
    const SIGMA_PER_MEDIAN: f64 = 1.4826;
    let median = robust::median(residuals.iter().map(|r| r.abs()).collect())?;
    // Depths that step have a median of zero where the steps are wide: then nothing is left out.
    let most =
        if median > 0.0 { OUTLIER_SIGMAS * SIGMA_PER_MEDIAN * median } else { f64::INFINITY };
    Some(residuals.into_iter().map(|r| if r.abs() > most { f64::NAN } else { r }).collect())
}

/// Sums over the residuals of a window and over their pairs.
fn sums(residuals: &[f64], side: usize) -> Sums {
    let fit = |r: &&f64| r.is_finite();
    let pixels = residuals.iter().filter(fit).count() as f64;
    let outliers = residuals.len() as f64 - pixels;
    let mut sums = Sums { pixels, outliers, ..Sums::default() };
    sums.squares = residuals.iter().filter(fit).map(|r| r * r).sum();
    let mut pair = |k: usize, a: f64, b: f64| {
        if a.is_finite() && b.is_finite() {
            sums.products[k] += a * b;
            sums.pairs[k] += 1.0;
        }
    };
    for (k, lag) in LAGS_PX.into_iter().enumerate() {
        for row in 0..side {
            for column in 0..side {
                let here = residuals[row * side + column];
                if column + lag < side {
                    pair(k, here, residuals[row * side + column + lag]);
                }
                if row + lag < side {
                    pair(k, here, residuals[(row + lag) * side + column]);
                }
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;
    use crate::base::seed;

    #[test]
    fn white_noise_on_a_curved_surface_is_found_and_edges_do_not_count() {
        let mut rng = seed::rng(5, "test", 0);
        let width = 256;
        let depths: Vec<f64> = (0..width * 192)
            .map(|k| {
                let (x, y) = ((k % width) as f64, (k / width) as f64);
                let noise: f64 = StandardNormal.sample(&mut rng);
                // A step of 50 mm in the last columns, a pixel that is missing, and outliers.
                let step = if x > 230.0 { 0.05 } else { 0.0 };
                let bent = 0.4 + 1e-4 * x + 2e-6 * x * y;
                let off = if k % 1000 == 7 { 0.03 } else { 0.0 };
                if k == 300 { f64::NAN } else { bent + step + off + 1e-3 * noise }
            })
            .collect();
        let found = DepthNoise::of(&depths, width, 32).unwrap();
        assert_eq!(found.windows, 7 * 6 - 1);
        assert!((found.sigma_m / 1e-3 - 1.0).abs() < 0.02, "{found:?}");
        assert!((found.outliers / 1e-3 - 1.0).abs() < 0.2, "{found:?}");
        assert!(found.autocorrelation.iter().all(|c| c.abs() < 0.03), "{found:?}");
    }

    #[test]
    fn an_image_smaller_than_a_window_has_no_noise() {
        assert_eq!(DepthNoise::of(&[0.5; 100], 10, 32), None);
    }
}

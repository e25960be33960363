//! Noise that is smooth over pixels.
//!
//! In: the shares and widths of [`Smooth`], the image's size, a seed. Out: a field of unit
//! variance: white noise through Gaussian filters, each part with its own noise, so that its
//! autocorrelation is the sum of theirs. Real depth cameras match patches of several pixels, and
//! some smooth what they give; `profile` has what was measured.
//!
//! Limits: the same in all directions and everywhere in the image; nothing is shared from view to
//! view.

use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::profile::Smooth;
use super::{Camera, Profile};
use crate::base::seed;

/// A filter ends at so many of its standard deviations.
const REACH_SIGMAS: f64 = 3.5;

/// Noise of unit variance for a view's pixels, row by row; `None` where the profile's is white.
pub(super) fn field(
    profile: &Profile,
    camera: &Camera,
    run_seed: u64,
    view: u64,
) -> Option<Vec<f64>> {
    let parts = profile.smooth.iter().zip(1..).filter(|(part, _)| part.share > 0.0);
    let parts: Vec<(&Smooth, u64)> = parts.collect();
    if parts.is_empty() {
        return None;
    }
    let white = 1.0 - parts.iter().map(|(part, _)| part.share).sum::<f64>();
    let draw = |part: u64, margin: usize| White::draw(camera, margin, run_seed, view, part);
    let mut sum = draw(0, 0).values;
    sum.iter_mut().for_each(|value| *value *= white.max(0.0).sqrt());
    for (part, number) in parts {
        let kernel = kernel(part.sigma_px);
        let smooth = draw(number, kernel.len() / 2).filtered(&kernel);
        let share = part.share.sqrt();
        sum.iter_mut().zip(smooth).for_each(|(value, smooth)| *value += share * smooth);
    }
    Some(sum)
}

/// Weights along one axis whose squares sum up to one.
fn kernel(sigma_px: f64) -> Vec<f64> {
    let reach = (REACH_SIGMAS * sigma_px).ceil() as i32;
    let weight = |k: i32| (-0.5 * (f64::from(k) / sigma_px).powi(2)).exp();
    let weights: Vec<f64> = (-reach..=reach).map(weight).collect();
    let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    weights.into_iter().map(|w| w / norm).collect()
}

/// White noise of an image with a margin on all sides.
struct White {
    /// Columns, the margins among them.
    columns: usize,
    values: Vec<f64>,
}

impl White {
    /// The same bytes for any number of threads: each row has its own seed.
    fn draw(camera: &Camera, margin: usize, run_seed: u64, view: u64, part: u64) -> Self {
        let (columns, rows) = (camera.width + 2 * margin, camera.height + 2 * margin);
        let purpose = format!("sensor-smooth {part}");
        let row = |row: usize| {
            let mut rng = seed::rng(run_seed, &purpose, (view << 20) + row as u64);
            (0..columns).map(|_| StandardNormal.sample(&mut rng)).collect::<Vec<f64>>()
        };
        Self { columns, values: (0..rows).into_par_iter().flat_map_iter(row).collect() }
    }

    /// Through the kernel along rows, then along columns; the margins are used up.
    fn filtered(self, kernel: &[f64]) -> Vec<f64> {
        let width = self.columns + 1 - kernel.len();
        let along_row = |row: &[f64]| {
            let sum = |at: usize| row[at..].iter().zip(kernel).map(|(v, w)| v * w).sum();
            (0..width).map(sum).collect::<Vec<f64>>()
        };
        let rows: Vec<Vec<f64>> = self.values.par_chunks(self.columns).map(along_row).collect();
        let height = rows.len() + 1 - kernel.len();
        let along_column = |top: usize| {
            let mut sum = vec![0.0; width];
            for (row, weight) in rows[top..].iter().zip(kernel) {
                sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
            }
            sum
        };
        (0..height).into_par_iter().flat_map_iter(along_column).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products of pixels so far apart along rows and columns, in the mean.
    fn correlation(field: &[f64], camera: &Camera, lag: usize) -> f64 {
        let (mut sum, mut pairs) = (0.0, 0.0);
        for row in 0..camera.height {
            for column in 0..camera.width {
                let here = field[row * camera.width + column];
                if column + lag < camera.width {
                    (sum, pairs) =
                        (sum + here * field[row * camera.width + column + lag], pairs + 1.0);
                }
                if row + lag < camera.height {
                    let below = field[(row + lag) * camera.width + column];
                    (sum, pairs) = (sum + here * below, pairs + 1.0);
                }
            }
        }
        sum / pairs
    }

    #[test]
    fn the_field_has_unit_variance_and_the_stated_autocorrelation() {
        let smooth = [Smooth { share: 0.3, sigma_px: 1.0 }, Smooth { share: 0.6, sigma_px: 4.0 }];
        let camera = Camera { width: 900, height: 700, focal_px: 600.0 };
        let profile = Profile { smooth, camera, ..super::super::profile::IDEAL };
        let field = field(&profile, &camera, 3, 5).unwrap();
        assert_eq!(field.len(), 900 * 700);
        for lag in [0, 1, 2, 4, 8, 16] {
            let part = |s: &Smooth| s.share * (-(lag as f64 / s.sigma_px).powi(2) / 4.0).exp();
            let white = if lag == 0 { 0.1 } else { 0.0 };
            let want = white + smooth.iter().map(part).sum::<f64>();
            let found = correlation(&field, &camera, lag);
            // 6,000 patches of the wider filter: 0.6 sqrt(2 / 6,000) = 0.01.
            assert!((found - want).abs() < 0.03, "{lag} px: {found} against {want}");
        }
        let other = super::field(&profile, &camera, 3, 6).unwrap();
        let shared: f64 = field.iter().zip(&other).map(|(a, b)| a * b).sum();
        assert!((shared / field.len() as f64).abs() < 0.03, "views share noise");
    }

    #[test]
    fn white_profiles_have_no_field() {
        let profile = Profile::named("consumer").unwrap();
        assert!(field(&profile, &profile.camera, 1, 0).is_none());
    }
}

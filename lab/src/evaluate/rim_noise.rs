//! Scan noise on rims, as the training adds it.
//!
//! In: a rim (simulation frame), a density, what `noise` of the model's file says, a seed. Out:
//! both as a scan would give them. The distribution is that of `noisy` in `scripts/train.py` on the
//! numbers of `Noise` in `scripts/drape_data.py`; the draws are others (another generator).
//!
//! Where it fails: it is the model of a scan's errors that the network was trained with, not a
//! scan's own errors; those are in `scan2params-lab scan`.

use std::f64::consts::PI;

use rand::RngExt as _;
use rand_distr::StandardNormal;
use serde::Deserialize;

use scan2params::base::boundary::{POINTS, POINTS_PER_SIDE};
use scan2params::base::seed::{self, Rng};
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Boundary, BoundaryPoint, Vector3};

/// Length of the rim in the mind of the noise, and of a side \[mm\].
const RIM_MM: f64 = 1200.0;
const SIDE_MM: f64 = 300.0;
/// Waves round the rim that the smooth part is made of: constant, then cosines and sines.
const WAVES: usize = 25;

/// What a scan adds to a rim, one standard deviation each.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RimNoise {
    /// Most of the smooth part, whose size is drawn evenly from zero to this in every scan \[mm\].
    pub smooth_mm: f64,
    /// Its correlation length along the rim \[mm\].
    pub correlation_mm: f64,
    /// White noise of each coordinate \[mm\].
    pub white_mm: f64,
    /// Shift of the whole rim along each axis \[mm\].
    pub shift_mm: f64,
    /// Rotation about the vertical \[degrees\].
    pub yaw_deg: f64,
    /// Rotation about each horizontal axis \[degrees\].
    pub tilt_deg: f64,
    /// Error of the density, of it.
    pub density_relative: f64,
}

impl RimNoise {
    /// The rim and the density as scan `index` of the run `seed` gives them. The rim's sigma is
    /// that of the smooth and the white part: a motion of the whole moves no answer, and a scan
    /// that counts it errs on the side of wider intervals.
    #[must_use]
    pub fn on(&self, rim: &Boundary, density_kg_m2: f64, seed: u64, index: u64) -> (Boundary, f64) {
        let mut rng = seed::rng(seed, "rim noise", index);
        let size_mm = self.smooth_mm * rng.random::<f64>();
        let smooth = self.smooth(&mut rng);
        let mut normal = || -> f64 { rng.sample(StandardNormal) };
        let mut three = |sd: f64| Vector3::new(sd * normal(), sd * normal(), sd * normal());
        let shift = three(self.shift_mm);
        let unit = three(1.0);
        let [tilt, yaw] = [self.tilt_deg, self.yaw_deg].map(f64::to_radians);
        let turn = Vector3::new(tilt * unit.x, yaw * unit.y, tilt * unit.z);
        let points = rim.positions_m().zip(smooth).map(|(point, smooth)| {
            let moved_mm = size_mm * smooth + shift + three(self.white_mm);
            // small angles: as the training has it
            point + M_PER_MM * moved_mm + turn.cross(&point.coords)
        });
        let sigma_m = M_PER_MM * size_mm.hypot(self.white_mm);
        let known = |position_m| BoundaryPoint { position_m, sigma_m, observed: true };
        let noisy = Boundary::new(points.map(known).collect())
            .unwrap_or_else(|_| unreachable!("as many points"));
        (noisy, density_kg_m2 * (1.0 + self.density_relative * normal()))
    }

    /// A closed random curve of unit variance in each coordinate; both counts of a corner are one
    /// place on the rim.
    fn smooth(&self, rng: &mut Rng) -> Vec<Vector3> {
        let weight = |wave: usize| {
            (-0.25 * (2.0 * PI * wave as f64 * self.correlation_mm / RIM_MM).powi(2)).exp()
        };
        let weights: Vec<f64> = (0..WAVES).map(weight).collect();
        // cosine and sine of a wave have one square everywhere
        let variance: f64 = weights.iter().map(|w| w * w).sum();
        let mut vector = |sd: f64| -> Vector3 {
            Vector3::from_fn(|_, _| sd * rng.sample::<f64, _>(StandardNormal))
        };
        let waves: Vec<[Vector3; 2]> = weights
            .iter()
            .map(|w| [vector(w / variance.sqrt()), vector(w / variance.sqrt())])
            .collect();
        let at = |index: usize| {
            let (side, step) = (index / POINTS_PER_SIDE, index % POINTS_PER_SIDE);
            let along_mm =
                side as f64 * SIDE_MM + step as f64 * SIDE_MM / (POINTS_PER_SIDE - 1) as f64;
            let angle = 2.0 * PI * along_mm / RIM_MM;
            waves.iter().enumerate().fold(Vector3::zeros(), |sum, (wave, [even, odd])| {
                let (sin, cos) = (wave as f64 * angle).sin_cos();
                sum + *even * cos + *odd * sin
            })
        };
        (0..POINTS).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::base::Point3;

    const SHIPPED: RimNoise = RimNoise {
        smooth_mm: 1.0,
        correlation_mm: 40.0,
        white_mm: 0.15,
        shift_mm: 0.5,
        yaw_deg: 0.5,
        tilt_deg: 0.3,
        density_relative: 0.01,
    };
    const SCANS: u64 = 4000;

    fn flat() -> Boundary {
        let at = |i| Boundary::flat_xz_m(i, 0.3);
        Boundary::exact((0..POINTS).map(|i| Point3::new(at(i)[0], -0.1, at(i)[1]))).unwrap()
    }

    fn only(part: RimNoise) -> Vec<Vec<Vector3>> {
        let rim = flat();
        let of = |index| {
            let (noisy, _) = part.on(&rim, 0.2, 5, index);
            noisy.positions_m().zip(rim.positions_m()).map(|(a, b)| (a - b) / M_PER_MM).collect()
        };
        (0..SCANS).map(of).collect()
    }

    const NONE: RimNoise = RimNoise {
        smooth_mm: 0.0,
        correlation_mm: 40.0,
        white_mm: 0.0,
        shift_mm: 0.0,
        yaw_deg: 0.0,
        tilt_deg: 0.0,
        density_relative: 0.0,
    };

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        sum / count
    }

    /// The training's own numbers: variance a third of `smooth_mm` squared (the size is drawn
    /// evenly), correlation exp(-(lag / L)^2 / 2). Sampling error of a variance here is 3 %.
    #[test]
    fn the_smooth_part_has_the_variance_and_the_correlation_of_the_training() {
        let all = only(RimNoise { smooth_mm: 1.0, ..NONE });
        let product = |i: usize, j: usize| mean(all.iter().map(|scan| scan[i].x * scan[j].x));
        for i in [0, 30, 100, 243] {
            assert!((product(i, i) * 3.0 - 1.0).abs() < 0.1, "{i} {}", product(i, i));
        }
        let expected = |lag_mm: f64| (-0.5 * (lag_mm / 40.0).powi(2)).exp();
        for steps in [4, 8, 16] {
            let found = product(70, 70 + steps) / product(70, 70);
            let wanted = expected(5.0 * steps as f64);
            assert!((found - wanted).abs() < 0.05, "{steps} {found} {wanted}");
        }
        // a corner is one place, and the rim is closed
        assert!(all.iter().all(|scan| (scan[60] - scan[61]).norm() < 1e-9));
        assert!(all.iter().all(|scan| (scan[0] - scan[243]).norm() < 1e-9));
    }

    #[test]
    fn each_other_part_has_its_standard_deviation() {
        let sd = |all: &[Vec<Vector3>], i: usize, axis: usize| {
            mean(all.iter().map(|scan| scan[i][axis].powi(2))).sqrt()
        };
        let white = only(RimNoise { white_mm: 0.15, ..NONE });
        let shift = only(RimNoise { shift_mm: 0.5, ..NONE });
        let yaw = only(RimNoise { yaw_deg: 0.5, ..NONE });
        let tilt = only(RimNoise { tilt_deg: 0.3, ..NONE });
        // point 30 lies at x = 150, y = -100, z = 0 mm
        let [yawed, tilted] = [0.5_f64, 0.3].map(f64::to_radians);
        for (found, wanted) in [
            (sd(&white, 30, 0), 0.15),
            (sd(&shift, 30, 1), 0.5),
            (sd(&yaw, 30, 2), 150.0 * yawed),
            (sd(&yaw, 30, 1), 0.0),
            (sd(&tilt, 30, 1), 150.0 * tilted),
            (sd(&tilt, 30, 2), 100.0 * tilted),
        ] {
            assert!((found - wanted).abs() < 0.05 * wanted + 1e-9, "{found} {wanted}");
        }
        let density = RimNoise { density_relative: 0.01, ..NONE };
        let drawn = (0..SCANS).map(|k| (density.on(&flat(), 0.2, 5, k).1 / 0.2 - 1.0).powi(2));
        assert!((mean(drawn).sqrt() / 0.01 - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_shipped_model_says_what_noise_it_was_trained_with() {
        let model = scan2params::estimate::Estimator::shipped().unwrap();
        let noise: RimNoise =
            serde_json::from_value(model.model().record["noise"].clone()).unwrap();
        assert_eq!(noise, SHIPPED);
    }
}

//! The prior of a fabric before its drapes are fitted: a Gaussian over the logarithms of the six
//! stiffnesses for one density, with the moments of a prior of [`Mixture`].
//!
//! A drape does not change when all seven parameters are multiplied by one factor, so that where
//! the density is unknown it is set to the prior's median and what is fitted is stiffness over
//! weight: the Gaussian is then that of the six logarithms less the density's.

use nalgebra::{SMatrix, SVector};

use crate::fabric::{Mixture, MixtureError, STIFFNESSES};

/// A Gaussian over six logarithms of SI values, paper's order, and the ends of what is tried.
#[derive(Clone, Debug, PartialEq)]
pub struct FabricPrior {
    /// Means.
    pub ln_mean: SVector<f64, STIFFNESSES>,
    /// Covariance.
    pub covariance: SMatrix<f64, STIFFNESSES, STIFFNESSES>,
    /// Lower and upper ends; nothing beyond is tried.
    pub ln_limits: [[f64; 2]; STIFFNESSES],
    /// Areal density of the drapes \[kg/m^2\].
    pub density_kg_m2: f64,
    /// Whether that density was given; if not, stiffnesses over weight have a prior and are fitted.
    pub density_known: bool,
}

/// Fabrics that the moments are taken of: their error is a sixtieth of a standard deviation.
const SAMPLES: u64 = 4096;
/// Factor beyond the prior's ends up to which values are tried.
const BEYOND: f64 = 3.0;

impl FabricPrior {
    /// Of a prior, for a density \[kg/m^2\] or for one that is not known.
    ///
    /// # Errors
    /// When the prior cannot be drawn from.
    pub fn of(prior: &Mixture, density_kg_m2: Option<f64>) -> Result<Self, MixtureError> {
        type Seven = SVector<f64, 7>;
        let fabrics: Vec<Seven> = (0..SAMPLES)
            .map(|k| prior.sample(0, k).map(|f| Seven::from(f.in_si().map(f64::ln))))
            .collect::<Result<_, _>>()?;
        let count = SAMPLES as f64;
        let mean: Seven = fabrics.iter().sum::<Seven>() / count;
        let covariance: SMatrix<f64, 7, 7> =
            fabrics.iter().map(|f| (f - mean) * (f - mean).transpose()).sum::<SMatrix<f64, 7, 7>>()
                / count;
        let six = covariance.fixed_view::<STIFFNESSES, STIFFNESSES>(0, 0).into_owned();
        let with = covariance.fixed_view::<STIFFNESSES, 1>(0, STIFFNESSES).into_owned();
        let of_density = covariance[(STIFFNESSES, STIFFNESSES)];
        let (mut ln_mean, own) =
            (mean.fixed_rows::<STIFFNESSES>(0).into_owned(), mean[STIFFNESSES]);
        let covariance = match density_kg_m2 {
            Some(density) => {
                ln_mean += with * ((density.ln() - own) / of_density);
                six - with * with.transpose() / of_density
            }
            None => {
                let ones = SVector::<f64, STIFFNESSES>::repeat(1.0);
                six - with * ones.transpose() - ones * with.transpose()
                    + SMatrix::repeat(of_density)
            }
        };
        let [least, most] = prior.limits();
        let end = |ends: [f64; 7]| crate::fabric::Fabric::from_paper_units(ends).in_si();
        let (least, most) = (end(least), end(most));
        Ok(Self {
            ln_mean,
            covariance,
            ln_limits: std::array::from_fn(|k| [(least[k] / BEYOND).ln(), (most[k] * BEYOND).ln()]),
            density_kg_m2: density_kg_m2.unwrap_or(own.exp()),
            density_known: density_kg_m2.is_some(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_density_narrows_and_an_unknown_one_leaves_stiffness_over_weight() {
        let prior = Mixture::measured();
        let [light, heavy] = [0.1, 0.3].map(|d| FabricPrior::of(&prior, Some(d)).unwrap());
        let unknown = FabricPrior::of(&prior, None).unwrap();
        // heavier cloth of this prior is stiffer in bending
        (3..6).for_each(|k| assert!(heavy.ln_mean[k] > light.ln_mean[k] + 0.3));
        assert_eq!(light.covariance, heavy.covariance);
        assert!(light.density_known && !unknown.density_known);
        assert!((0.1..0.3).contains(&unknown.density_kg_m2), "{}", unknown.density_kg_m2);
        for fabric_prior in [&light, &unknown] {
            assert!(fabric_prior.covariance.cholesky().is_some());
            for (k, [low, high]) in fabric_prior.ln_limits.iter().enumerate() {
                assert!((low..high).contains(&&fabric_prior.ln_mean[k]));
            }
        }
        // the covariance of ln B - ln D, from its own samples
        let ratio: Vec<f64> = (0..SAMPLES)
            .map(|k| prior.sample(0, k).unwrap())
            .map(|f| (f.bending_weft_nm / f.density_kg_m2).ln())
            .collect();
        let mean = ratio.iter().sum::<f64>() / ratio.len() as f64;
        let variance = ratio.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / ratio.len() as f64;
        assert!((unknown.covariance[(3, 3)] / variance - 1.0).abs() < 1e-9);
    }
}

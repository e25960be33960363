//! What is known of the six stiffnesses before the drape is fitted.

#[cfg(feature = "estimate")]
use crate::estimate::Estimate;
#[cfg(feature = "estimate")]
use crate::fabric::Mixture;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::numeric::moments::Z90;

/// What is known of the six stiffnesses without the scans' sheets; logarithms of SI values, paper's
/// order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Means.
    pub ln_mean: [f64; STIFFNESSES],
    /// Standard deviations.
    pub ln_sigma: [f64; STIFFNESSES],
    /// Lower and upper ends; nothing beyond is tried.
    pub ln_limits: [[f64; 2]; STIFFNESSES],
}

impl Prior {
    /// Of an estimate with 90 % intervals; `limits` are the ends of the prior.
    #[must_use]
    pub fn of(value: &Fabric, interval90: &[Fabric; 2], limits: &[Fabric; 2]) -> Self {
        let six = |fabric: &Fabric| {
            let [six @ .., _] = fabric.in_si();
            six.map(f64::ln)
        };
        let (mean, [low, high], ends) =
            (six(value), interval90.each_ref().map(six), limits.each_ref().map(six));
        Self {
            ln_mean: mean,
            ln_sigma: std::array::from_fn(|k| (0.5 * (high[k] - low[k]) / Z90).max(LEAST_SIGMA)),
            ln_limits: std::array::from_fn(|k| [ends[0][k].min(mean[k]), ends[1][k].max(mean[k])]),
        }
    }
}

impl Prior {
    /// Of several estimates of one fabric: their mean. It is no surer than one of them is, since
    /// what misleads an estimate of one drop misleads that of the next.
    ///
    /// # Panics
    /// Without any.
    #[must_use]
    pub fn together(priors: &[Self]) -> Self {
        let count = priors.len() as f64;
        assert!(count > 0.0, "at least one prior");
        let mean = |of: &dyn Fn(&Self) -> f64| priors.iter().map(of).sum::<f64>() / count;
        let end = |of: &dyn Fn(&Self) -> f64, pick: fn(f64, f64) -> f64| {
            priors.iter().map(of).fold(f64::NAN, pick)
        };
        Self {
            ln_mean: std::array::from_fn(|k| mean(&|p| p.ln_mean[k])),
            ln_sigma: std::array::from_fn(|k| mean(&|p| p.ln_sigma[k].powi(2)).sqrt()),
            ln_limits: std::array::from_fn(|k| {
                [end(&|p| p.ln_limits[k][0], f64::min), end(&|p| p.ln_limits[k][1], f64::max)]
            }),
        }
    }

    /// Where a fit begins, with names: at the mean, and where no sheet comes to rest with that,
    /// with all six stiffer, and softer, within the limits.
    #[must_use]
    pub fn starts(&self) -> [(&'static str, [f64; STIFFNESSES]); 3] {
        let moved = |by: f64| {
            std::array::from_fn(|k| {
                let [low, high] = self.ln_limits[k];
                (self.ln_mean[k] + by).clamp(low, high)
            })
        };
        [("estimate", self.ln_mean), ("stiffer", moved(BESIDE)), ("softer", moved(-BESIDE))]
    }
}

/// How far beside the mean other starts are, on the logarithm.
const BESIDE: f64 = 0.4;

#[cfg(feature = "estimate")]
impl Prior {
    /// Of what a network says that was trained on fabrics of `prior`. Values beyond its training
    /// data are trusted up to a factor; all values of a fabric outside of the prior are trusted
    /// less, since the network's intervals do not hold there.
    #[must_use]
    pub fn of_estimate(estimate: &Estimate, prior: Option<&Mixture>) -> Self {
        let [ends_low, ends_high] = [0, 1].map(|end| {
            let six = estimate.trained.map(|ends| ends[end]);
            let factor = if end == 0 { 1.0 / BEYOND } else { BEYOND };
            let [a, b, c, d, e, f] = six.map(|value| value * factor);
            Fabric::from_paper_units([a, b, c, d, e, f, 1.0])
        });
        let known = Self::of(&estimate.fabric, &estimate.interval90, &[ends_low, ends_high]);
        let outside = prior.is_some_and(|prior| estimate.likeness(prior).is_outside());
        let less = if outside { OUTSIDE } else { 1.0 };
        Self { ln_sigma: known.ln_sigma.map(|sigma| less * sigma), ..known }
    }
}

#[cfg(feature = "estimate")]
/// Factor beyond what the network was trained on up to which values are tried.
const BEYOND: f64 = 3.0;
/// Factor on the standard deviations of what the network says of a fabric outside of its prior: of
/// 142 such fabrics, with a scan's noise, 47 % of the 90 % intervals hold (`scan2params-lab
/// estimate
/// --count 200 --anywhere --seed 2`), as if they were 2.6 times too narrow.
#[cfg(feature = "estimate")]
const OUTSIDE: f64 = 2.6;
/// Least standard deviation of a prior.
const LEAST_SIGMA: f64 = 0.05;

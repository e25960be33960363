//! The promise of the estimate, measured: accuracy, width and coverage of its intervals on
//! the rims of drapes that the network has not seen, for `evaluate estimate`.
//!
//! In: drapes with their fabrics ([`Row`]) and whatever answers for one. Out: [`Scores`], one
//! row for each stiffness and one for all, comparable between any two that answer: the
//! shipped estimator, and [`Baseline`], which ignores the scan. All errors are of natural
//! logarithms, as the network is trained; the root mean square is divided by the logarithmic
//! width of the prior's box, as in Table 3 of the paper.
//!
//! Where it fails: rims of the simulator without a scan's noise, drawn from the prior of the
//! training; nothing here says how the estimate does on real cloth.

use serde::Serialize;

use crate::dataset::{Manifest, Row};
use crate::estimate::{EstimateError, EstimateWarning, Estimator};
use crate::fabric::{Fabric, Mixture, MixtureError, PARAMETERS, STIFFNESSES, TABLE_2};
use crate::numeric::robust;
use crate::sim::NUMERICS_VERSION;

/// Level of the intervals.
const LEVEL: f64 = 0.9;
/// Fabrics from which the baseline learns the prior.
const BASELINE_FABRICS: u64 = 4096;
/// Seed of those fabrics: neither the training's nor one that is asked for by a user.
const BASELINE_SEED: u64 = u64::MAX;

/// What somebody says of one rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The stiffnesses in the paper's order and units.
    pub value: [f64; STIFFNESSES],
    /// Lower and upper ends of the 90 % interval on each.
    pub interval90: [[f64; 2]; STIFFNESSES],
    /// Whether the rim was called unlike those of the training.
    pub novel: bool,
}

/// What the estimator says of a drape, told its density and where its warp lies.
///
/// # Errors
/// As [`Estimator::estimate`].
pub fn answer(estimator: &Estimator, row: &Row) -> Result<Answer, EstimateError> {
    let estimate = estimator.estimate(&row.drape.boundary, row.fabric.density_kg_m2, true)?;
    let parameters = estimate.parameters();
    Ok(Answer {
        value: parameters.map(|p| p.value),
        interval90: parameters.map(|p| p.interval90),
        novel: estimate.warnings.iter().any(|w| matches!(w, EstimateWarning::NovelRim { .. })),
    })
}

/// An estimator that ignores the scan: it knows the prior alone, and says the same of every
/// rim, the geometric mean of each stiffness and the middle 90 % of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baseline(Answer);

impl Baseline {
    /// Of this prior.
    ///
    /// # Errors
    /// When the prior gives no fabric inside its box.
    pub fn of(prior: &Mixture) -> Result<Self, MixtureError> {
        let fabrics: Vec<[f64; PARAMETERS]> = (0..BASELINE_FABRICS)
            .map(|index| Ok(prior.sample(BASELINE_SEED, index)?.to_paper_units()))
            .collect::<Result<_, MixtureError>>()?;
        let logarithms = |i: usize| fabrics.iter().map(|f| f[i].ln()).collect::<Vec<f64>>();
        let at = |i: usize, share| robust::quantile(logarithms(i), share).unwrap_or(0.0).exp();
        let mean = |i: usize| (logarithms(i).iter().sum::<f64>() / fabrics.len() as f64).exp();
        let ends = [0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)];
        Ok(Self(Answer {
            value: std::array::from_fn(mean),
            interval90: std::array::from_fn(|i| ends.map(|share| at(i, share))),
            novel: false,
        }))
    }

    /// What it says of any rim.
    #[must_use]
    pub fn answer(&self) -> Answer {
        self.0
    }
}

/// Why drapes say nothing of a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnfitDrapes {
    /// The model was trained on them.
    #[error(
        "the drapes are of prior `{prior}` and seed {seed}, from which the model was trained: \
         give drapes of another seed"
    )]
    Seen {
        /// Name of the prior.
        prior: String,
        /// Seed of the run.
        seed: u64,
    },
    /// Another simulator made them.
    #[error(
        "the drapes are of simulator numerics {found}, this is {NUMERICS_VERSION}: make them \
         again with `scan2params generate`"
    )]
    Numerics {
        /// What their folder says.
        found: u32,
    },
    /// None of them is at rest.
    #[error("none of the {rows} drapes is at rest: give others")]
    None {
        /// How many there are.
        rows: usize,
    },
}

/// Makes sure that drapes made with this prior, seed and numerics are new to the model. The training's seed
/// is not, whatever the prior, since a union shares fabrics with its parts.
///
/// # Errors
/// [`UnfitDrapes::Seen`] and [`UnfitDrapes::Numerics`].
pub fn check_unseen(
    estimator: &Estimator,
    prior: &str,
    seed: u64,
    numerics: u32,
) -> Result<(), UnfitDrapes> {
    let model = estimator.model();
    if model.record.get("data_seed") == Some(&seed.into()) {
        return Err(UnfitDrapes::Seen { prior: prior.to_owned(), seed });
    }
    if numerics != NUMERICS_VERSION {
        return Err(UnfitDrapes::Numerics { found: numerics });
    }
    Ok(())
}

/// [`check_unseen`] of a folder that `generate` made.
///
/// # Errors
/// As there.
pub fn check_folder(estimator: &Estimator, folder: &Manifest) -> Result<(), UnfitDrapes> {
    check_unseen(estimator, &folder.prior, folder.seed, folder.simulator_numerics)
}

/// The drapes at rest, as training takes them.
///
/// # Errors
/// [`UnfitDrapes::None`].
pub fn at_rest(rows: Vec<Row>) -> Result<Vec<Row>, UnfitDrapes> {
    let count = rows.len();
    let kept: Vec<Row> = rows.into_iter().filter(|row| row.drape.at_rest).collect();
    if kept.is_empty() { Err(UnfitDrapes::None { rows: count }) } else { Ok(kept) }
}

/// How well one stiffness is told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ParameterScore {
    /// Name in files.
    pub key: &'static str,
    /// Median of |ln(value / truth)|.
    pub median_abs_ln_error: f64,
    /// Root mean square of the normalised error.
    pub rmse: f64,
    /// Share of the variance of the logarithms that the values explain: 1 - sum of squared
    /// errors / sum of squares about the mean of these drapes.
    pub r2: f64,
    /// Share of the drapes whose interval holds the truth.
    pub coverage: f64,
    /// Median of the factor f with which the interval runs from its middle / f to its
    /// middle * f.
    pub median_half_width_factor: f64,
}

/// How well somebody answers for many drapes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// Drapes answered for.
    pub drapes: usize,
    /// Each stiffness, in the paper's order.
    pub parameters: Vec<ParameterScore>,
    /// Mean over the stiffnesses of [`ParameterScore::rmse`].
    pub rmse: f64,
    /// Mean over the stiffnesses of [`ParameterScore::r2`].
    pub r2: f64,
    /// Share of all intervals that hold the truth.
    pub coverage: f64,
    /// Geometric mean over the stiffnesses of the median half widths.
    pub half_width_factor: f64,
    /// Share of the rims called unlike those of the training.
    pub novel_share: f64,
}

impl Scores {
    /// Of these answers beside the fabrics that they are for; `box_limits` are the prior's
    /// ([`Mixture::limits`]).
    ///
    /// # Panics
    /// When there are no answers, or not one for each fabric.
    #[must_use]
    pub fn of(truths: &[Fabric], answers: &[Answer], box_limits: [[f64; PARAMETERS]; 2]) -> Self {
        assert!(!answers.is_empty() && truths.len() == answers.len(), "one answer for each drape");
        let parameters: Vec<ParameterScore> =
            (0..STIFFNESSES).map(|i| score(i, truths, answers, box_limits)).collect();
        let mean = |of: fn(&ParameterScore) -> f64| {
            parameters.iter().map(of).sum::<f64>() / STIFFNESSES as f64
        };
        Self {
            drapes: answers.len(),
            rmse: mean(|p| p.rmse),
            r2: mean(|p| p.r2),
            coverage: mean(|p| p.coverage),
            half_width_factor: mean(|p| p.median_half_width_factor.ln()).exp(),
            novel_share: answers.iter().filter(|a| a.novel).count() as f64 / answers.len() as f64,
            parameters,
        }
    }

    /// The largest over the stiffnesses of the median error of the logarithm.
    #[must_use]
    pub fn worst_median_abs_ln_error(&self) -> f64 {
        self.parameters.iter().map(|p| p.median_abs_ln_error).fold(0.0, f64::max)
    }

    /// The least over the stiffnesses of R2.
    #[must_use]
    pub fn least_r2(&self) -> f64 {
        self.parameters.iter().map(|p| p.r2).fold(f64::INFINITY, f64::min)
    }

    /// The largest over the stiffnesses of the median half widths.
    #[must_use]
    pub fn widest_factor(&self) -> f64 {
        self.parameters.iter().map(|p| p.median_half_width_factor).fold(0.0, f64::max)
    }
}

fn score(
    i: usize,
    truths: &[Fabric],
    answers: &[Answer],
    box_limits: [[f64; PARAMETERS]; 2],
) -> ParameterScore {
    let count = answers.len() as f64;
    let truth: Vec<f64> = truths.iter().map(|f| f.to_paper_units()[i].ln()).collect();
    let error: Vec<f64> = answers.iter().zip(&truth).map(|(a, t)| a.value[i].ln() - t).collect();
    let mean = truth.iter().sum::<f64>() / count;
    let squares = error.iter().map(|e| e * e).sum::<f64>();
    let about_mean = truth.iter().map(|t| (t - mean).powi(2)).sum::<f64>();
    let ln_width = (box_limits[1][i] / box_limits[0][i]).ln();
    let holds =
        |(a, t): (&Answer, &f64)| (a.interval90[i][0].ln()..=a.interval90[i][1].ln()).contains(t);
    let half = |a: &Answer| (a.interval90[i][1] / a.interval90[i][0]).ln() / 2.0;
    let median = |values: Vec<f64>| robust::median(values).unwrap_or(f64::NAN);
    ParameterScore {
        key: TABLE_2[i].key,
        median_abs_ln_error: median(error.iter().map(|e| e.abs()).collect()),
        rmse: (squares / count).sqrt() / ln_width,
        r2: 1.0 - squares / about_mean,
        coverage: answers.iter().zip(&truth).filter(|&pair| holds(pair)).count() as f64 / count,
        median_half_width_factor: median(answers.iter().map(half).collect()).exp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: [[f64; PARAMETERS]; 2] = [[1.0; PARAMETERS], [std::f64::consts::E; PARAMETERS]];

    fn fabrics(values: &[f64]) -> Vec<Fabric> {
        values.iter().map(|&v| Fabric::from_paper_units([v, v, v, v, v, v, 200.0])).collect()
    }

    fn answer_of(value: f64, factor: f64) -> Answer {
        Answer {
            value: [value; STIFFNESSES],
            interval90: [[value / factor, value * factor]; STIFFNESSES],
            novel: false,
        }
    }

    #[test]
    fn errors_widths_and_coverage_are_what_they_are_by_hand() {
        let truths = fabrics(&[10.0, 20.0, 40.0]);
        // off by factors of 1.1, 1.2 and 1/1.3; the second and third outside +-15 %
        let answers = [answer_of(11.0, 1.15), answer_of(24.0, 1.15), answer_of(40.0 / 1.3, 1.15)];
        let scores = Scores::of(&truths, &answers, LIMITS);
        for p in &scores.parameters {
            let squares = 1.1_f64.ln().powi(2) + 1.2_f64.ln().powi(2) + 1.3_f64.ln().powi(2);
            assert!((p.median_abs_ln_error - 1.2_f64.ln()).abs() < 1e-12);
            assert!((p.rmse - (squares / 3.0).sqrt()).abs() < 1e-12);
            assert!((p.r2 - (1.0 - squares / (2.0 * 2.0_f64.ln().powi(2)))).abs() < 1e-12);
            assert!((p.coverage - 1.0 / 3.0).abs() < 1e-12);
            assert!((p.median_half_width_factor - 1.15).abs() < 1e-12);
        }
        assert!((scores.half_width_factor - 1.15).abs() < 1e-12);
    }

    #[test]
    fn the_baseline_holds_nine_in_ten_of_its_prior_and_explains_nothing() {
        let prior = Mixture::knit_2020();
        let truths: Vec<Fabric> = (0..1000).map(|k| prior.sample(3, k).unwrap()).collect();
        let baseline = Baseline::of(&prior).unwrap();
        let answers = vec![baseline.answer(); truths.len()];
        let scores = Scores::of(&truths, &answers, prior.limits());
        for p in &scores.parameters {
            assert!((p.coverage - 0.9).abs() < 0.03, "{p:?}");
            assert!(p.r2 <= 0.0 && p.r2 > -0.02, "{p:?}");
        }
    }

    #[test]
    fn drapes_of_the_training_and_of_other_numerics_are_refused() {
        let estimator = Estimator::shipped().unwrap();
        let prior = estimator.model().prior.clone();
        let seen = check_unseen(&estimator, &prior, 1, NUMERICS_VERSION);
        assert_eq!(seen, Err(UnfitDrapes::Seen { prior: prior.clone(), seed: 1 }));
        // the union of priors shares fabrics with its parts
        assert!(check_unseen(&estimator, "measured", 1, NUMERICS_VERSION).is_err());
        assert_eq!(check_unseen(&estimator, "measured", 2, NUMERICS_VERSION), Ok(()));
        let old = check_unseen(&estimator, &prior, 2, NUMERICS_VERSION - 1);
        assert_eq!(old, Err(UnfitDrapes::Numerics { found: NUMERICS_VERSION - 1 }));
    }
}

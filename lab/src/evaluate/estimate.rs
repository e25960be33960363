//! The promise of the estimate, measured: accuracy, width and coverage of its intervals on
//! the rims of drapes that the network has not seen, for `scan2params-lab estimate`.
//!
//! In: drapes with their fabrics ([`Row`]) and an estimator. Out: [`Scores`], one
//! row for each stiffness and one for all, comparable between any two that answer: the
//! shipped estimator, and [`Baseline`], which ignores the scan. All errors are of natural
//! logarithms, as the network is trained; the root mean square is divided by the logarithmic
//! width of the prior's box, as in Table 3 of the paper.
//!
//! [`noisy`] has the same rims with the scan noise of the training, [`quarters`] the scores by
//! bending length, [`by_likeness`] by the part of the prior that the answer is said to be like;
//! [`repeats`] takes the drops of one fabric together; [`pictures`] has them as charts.
//!
//! Where it fails: rims of the simulator, drawn from the prior of the training (or, [`anywhere`],
//! from the whole box); nothing here says how the estimate does on real cloth.

pub mod pictures;
pub mod repeats;
pub mod verdicts;

use serde::Serialize;

use rand::RngExt as _;
use rayon::prelude::*;

use super::rim_noise::RimNoise;
use scan2params::base::Boundary;
use scan2params::base::seed;
use scan2params::base::units::M_PER_MM;
use scan2params::dataset::{Manifest, Row};
use scan2params::estimate::{Estimate, EstimateError, EstimateWarning, Estimator};
use scan2params::fabric::{
    Fabric, Likeness, Mixture, MixtureError, PARAMETERS, STIFFNESSES, TABLE_2,
};
use scan2params::numeric::robust;
use scan2params::refine::Refined;
use scan2params::sim::NUMERICS_VERSION;
use scan2params::sim::experiment::bending_length_m;

/// Level of the intervals.
const LEVEL: f64 = 0.9;
/// Fabrics from which the baseline learns the prior.
const BASELINE_FABRICS: u64 = 4096;
/// Seed of those fabrics: neither the training's nor a user's.
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

impl Answer {
    /// What an estimate says.
    #[must_use]
    pub fn of(estimate: &Estimate) -> Self {
        let parameters = estimate.parameters();
        let novel = |w: &EstimateWarning| matches!(w, EstimateWarning::NovelRim { .. });
        Self {
            value: parameters.map(|p| p.value),
            interval90: parameters.map(|p| p.interval90),
            novel: estimate.warnings.iter().any(novel),
        }
    }

    /// What a fit says, whether it is the answer or not.
    #[must_use]
    pub fn of_fit(refined: &Refined) -> Self {
        let density = refined.fabric.density_kg_m2;
        let in_paper_units = |si: [f64; STIFFNESSES]| {
            let [a, b, c, d, e, f] = si;
            let [six @ .., _] = Fabric::from_si([a, b, c, d, e, f, density]).to_paper_units();
            six
        };
        let end = |side: usize| in_paper_units(refined.stiffnesses.map(|s| s.interval90[side]));
        let [low, high] = [end(0), end(1)];
        Self {
            value: in_paper_units(refined.stiffnesses.map(|s| s.value)),
            interval90: std::array::from_fn(|k| [low[k], high[k]]),
            novel: false,
        }
    }

    /// Which of its intervals hold the truth.
    #[must_use]
    pub fn holds(&self, truth: &Fabric) -> [bool; STIFFNESSES] {
        let truth = truth.to_paper_units();
        std::array::from_fn(|i| {
            let [low, high] = self.interval90[i];
            (low..=high).contains(&truth[i])
        })
    }
}

/// What the estimator says of a drape, told its density and where its warp lies.
///
/// # Errors
/// As [`Estimator::estimate`].
pub fn answer(estimator: &Estimator, row: &Row) -> Result<Answer, EstimateError> {
    answered(estimator, &row.drape.boundary, row.fabric.density_kg_m2)
}

/// The estimates from many drapes, told the same, on all cores.
///
/// # Errors
/// As [`Estimator::estimate`].
pub fn estimates(estimator: &Estimator, rows: &[Row]) -> Result<Vec<Estimate>, EstimateError> {
    let of = |row: &Row| estimator.estimate(&row.drape.boundary, row.fabric.density_kg_m2, true);
    rows.par_iter().map(of).collect()
}

/// [`answer`] of a rim and a density.
pub(super) fn answered(
    estimator: &Estimator,
    rim: &Boundary,
    density_kg_m2: f64,
) -> Result<Answer, EstimateError> {
    Ok(Answer::of(&estimator.estimate(rim, density_kg_m2, true)?))
}

/// The rows as scans with the training's noise give them: rim and density; the truth that scores
/// are held against is that of the rows themselves.
#[must_use]
pub fn noisy(rows: &[Row], noise: &RimNoise, seed: u64) -> Vec<Row> {
    let with_noise = |row: &Row| {
        let mut row = row.clone();
        let density_kg_m2 = row.fabric.density_kg_m2;
        (row.drape.boundary, row.fabric.density_kg_m2) =
            noise.on(&row.drape.boundary, density_kg_m2, seed, row.index);
        row
    };
    rows.iter().map(with_noise).collect()
}

/// Areal density of the fabrics of [`anywhere`] \[g/m^2\]; which one it is moves no drape.
const ANYWHERE_G_M2: f64 = 200.0;

/// Fabric `index` drawn evenly over the logarithms of a prior's box, with a positive bending
/// energy: most of them are like none of its fabrics.
#[must_use]
pub fn anywhere(prior: &Mixture, seed: u64, index: u64) -> Fabric {
    let [low, high] = prior.limits();
    let mut rng = seed::rng(seed, "anywhere", index);
    loop {
        let mut drawn: [f64; PARAMETERS] =
            std::array::from_fn(|i| low[i] * (high[i] / low[i]).powf(rng.random::<f64>()));
        drawn[STIFFNESSES] = ANYWHERE_G_M2;
        let fabric = Fabric::from_paper_units(drawn);
        if fabric.bending_is_positive() {
            return fabric;
        }
    }
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

/// Makes sure that drapes made with this prior, seed and numerics are new to the model. The
/// training's seed is not, for any prior, since a union shares fabrics with its parts.
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

/// The drapes that converged, as training takes them.
///
/// # Errors
/// [`UnfitDrapes::None`].
pub fn converged(rows: Vec<Row>) -> Result<Vec<Row>, UnfitDrapes> {
    let count = rows.len();
    let kept: Vec<Row> = rows.into_iter().filter(|row| row.drape.ending.is_converged()).collect();
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

/// The scores of some of the drapes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Which drapes: their bending lengths \[mm\], or the parts of the prior that the answers are
    /// like.
    pub name: String,
    /// Their scores. Shares of variance are within the group.
    pub scores: Scores,
}

/// The scores of each quarter of the drapes by their true bending length, softest first; fewer than
/// four groups for fewer than four drapes.
#[must_use]
pub fn quarters(
    truths: &[Fabric],
    answers: &[Answer],
    box_limits: [[f64; PARAMETERS]; 2],
) -> Vec<Group> {
    let length_mm = |k: &usize| bending_length_m(&truths[*k]) / M_PER_MM;
    let mut order: Vec<usize> = (0..truths.len()).collect();
    order.sort_by(|a, b| length_mm(a).total_cmp(&length_mm(b)));
    let ends: [usize; 5] = std::array::from_fn(|q| (q * order.len() + 2) / 4);
    let quarters = ends.windows(2).map(|ends| &order[ends[0]..ends[1]]);
    let named = quarters.filter_map(|own| {
        let (first, last) = own.first().zip(own.last())?;
        let name = format!("{:.1} to {:.1} mm", length_mm(first), length_mm(last));
        Some(group(name, own, truths, answers, box_limits))
    });
    named.collect()
}

/// The scores of the drapes whose answers are called like the same parts of the prior.
#[must_use]
pub fn by_likeness(prior: &Mixture, truths: &[Fabric], answers: &[Answer]) -> Vec<Group> {
    let called = |(truth, answer): (&Fabric, &Answer)| {
        let fabric = |values: [f64; STIFFNESSES]| {
            let [a, b, c, d, e, f] = values;
            Fabric {
                density_kg_m2: truth.density_kg_m2,
                ..Fabric::from_paper_units([a, b, c, d, e, f, 1.0])
            }
        };
        let interval90 = [0, 1].map(|end| fabric(answer.interval90.map(|ends| ends[end])));
        let likeness = Likeness::of(prior, &[(fabric(answer.value), interval90)]);
        let mut names: Vec<String> = likeness.like().iter().map(|p| p.name.clone()).collect();
        names.sort();
        if names.is_empty() { "neither".to_owned() } else { names.join(" or ") }
    };
    let names: Vec<String> = truths.iter().zip(answers).map(called).collect();
    let mut kinds = names.clone();
    kinds.sort();
    kinds.dedup();
    let of_kind = |kind: String| {
        let own: Vec<usize> = (0..names.len()).filter(|k| names[*k] == kind).collect();
        group(kind, &own, truths, answers, prior.limits())
    };
    kinds.into_iter().map(of_kind).collect()
}

fn group(
    name: String,
    own: &[usize],
    truths: &[Fabric],
    answers: &[Answer],
    box_limits: [[f64; PARAMETERS]; 2],
) -> Group {
    let truths: Vec<Fabric> = own.iter().map(|k| truths[*k]).collect();
    let answers: Vec<Answer> = own.iter().map(|k| answers[*k]).collect();
    Group { name, scores: Scores::of(&truths, &answers, box_limits) }
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
    let half = |a: &Answer| (a.interval90[i][1] / a.interval90[i][0]).ln() / 2.0;
    let median = |values: Vec<f64>| robust::median(values).unwrap_or(f64::NAN);
    ParameterScore {
        key: TABLE_2[i].key,
        median_abs_ln_error: median(error.iter().map(|e| e.abs()).collect()),
        rmse: (squares / count).sqrt() / ln_width,
        r2: 1.0 - squares / about_mean,
        coverage: answers.iter().zip(truths).filter(|(a, t)| a.holds(t)[i]).count() as f64 / count,
        median_half_width_factor: median(answers.iter().map(half).collect()).exp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) const LIMITS: [[f64; PARAMETERS]; 2] =
        [[1.0; PARAMETERS], [std::f64::consts::E; PARAMETERS]];

    pub(super) fn fabrics(values: &[f64]) -> Vec<Fabric> {
        values.iter().map(|&v| Fabric::from_paper_units([v, v, v, v, v, v, 200.0])).collect()
    }

    pub(super) fn answer_of(value: f64, factor: f64) -> Answer {
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
    fn quarters_go_by_bending_length_and_have_all_drapes_once() {
        // soft ones are answered right, stiff ones not at all
        let values: Vec<f64> = (1..=10).map(|k| 10.0 * f64::from(k)).rev().collect();
        let truths = fabrics(&values);
        let answers: Vec<Answer> =
            values.iter().map(|v| answer_of(if *v > 50.0 { 2.0 * v } else { *v }, 1.1)).collect();
        let groups = quarters(&truths, &answers, LIMITS);
        let counts: Vec<usize> = groups.iter().map(|g| g.scores.drapes).collect();
        assert_eq!((counts.iter().sum::<usize>(), counts.len()), (10, 4));
        assert!(counts.iter().all(|count| (2..=3).contains(count)), "{counts:?}");
        assert!((groups[0].scores.coverage - 1.0).abs() < 1e-12, "{groups:?}");
        assert!(groups[3].scores.coverage.abs() < 1e-12, "{groups:?}");
        assert_eq!(quarters(&truths[..2], &answers[..2], LIMITS).len(), 2);
    }

    #[test]
    fn fabrics_from_anywhere_lie_in_the_box_and_are_mostly_like_neither() {
        let prior = Mixture::union();
        let truths: Vec<Fabric> = (0..200).map(|k| anywhere(&prior, 3, k)).collect();
        let [low, high] = prior.limits();
        for (k, fabric) in truths.iter().enumerate() {
            let values = fabric.to_paper_units();
            let inside = |i: usize| (low[i] * 0.999..=high[i] * 1.001).contains(&values[i]);
            assert!((0..STIFFNESSES).all(inside) && fabric.bending_is_positive(), "{k}");
        }
        let exact = |fabric: &Fabric| {
            let [a, b, c, d, e, f, _] = fabric.to_paper_units();
            let value = [a, b, c, d, e, f];
            Answer { value, interval90: value.map(|v| [v, v]), novel: false }
        };
        let answers: Vec<Answer> = truths.iter().map(exact).collect();
        let groups = by_likeness(&prior, &truths, &answers);
        let drapes =
            |name: &str| groups.iter().find(|g| g.name == name).map_or(0, |g| g.scores.drapes);
        assert!(drapes("neither") > 150, "{}", drapes("neither"));
        let own: Vec<Fabric> = (0..200).map(|k| prior.sample(3, k).unwrap()).collect();
        let answers: Vec<Answer> = own.iter().map(exact).collect();
        let groups = by_likeness(&prior, &own, &answers);
        let neither = groups.iter().find(|g| g.name == "neither").map_or(0, |g| g.scores.drapes);
        assert!(neither < 10, "{neither}");
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

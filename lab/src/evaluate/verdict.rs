//! What scans look like to the verdict: virtual scans of a prior's fabrics through the whole
//! main job, valid or of a wrong scale, for `scan2params-lab verdict`. The limits of
//! `job::verdict` come from its table.
//!
//! In: a prior, a sensor, a scale, seeds. Out: one [`Case`] a scan, with the figures that
//! a verdict is made of, beside the truth; a [`Summary`] of many.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::case_error::CaseError;
use super::estimate::Answer;
use super::scan::{Setup, find};
use scan2params::base::units::M_PER_MM;
use scan2params::estimate::Estimator;
use scan2params::fabric::{Fabric, Mixture};
use scan2params::job::verdict::{Figures, Limits, Scale, Verdict};
use scan2params::refine::released_drape;
use scan2params::scan::{ScanError, ScanOptions, Tuning};
use scan2params::sensor::{Scene, scan};
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// One scan of a simulated drape, through the main job.
#[derive(Debug)]
pub struct Case {
    /// Its place in the run.
    pub index: u64,
    /// The true fabric.
    pub fabric: Fabric,
    /// The true drape.
    pub drape: Drape,
    /// What the main job made of it, or why it was refused.
    pub answer: Result<Judged, ScanError>,
}

/// An answer with its verdict.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What the verdict is made of.
    pub figures: Figures,
    /// The verdict.
    pub verdict: Verdict,
    /// Mean distance of the rim from the true one \[m\].
    pub rim_error_m: f64,
    /// How many of the six intervals hold the truth.
    pub covered: usize,
    /// The largest factor between a stiffness and its truth.
    pub worst_factor: f64,
}

/// Fabrics of a prior, each draped, scanned and judged once.
#[derive(Debug)]
pub struct Series {
    /// Where the fabrics are from.
    pub prior: Mixture,
    /// How they are scanned.
    pub setup: Setup,
    /// The scans are larger by this factor, unknown to the main job.
    pub scale: f64,
    /// Seed of fabrics, drops and scans.
    pub seed: u64,
    /// Which fabrics.
    pub fabrics: std::ops::Range<u64>,
}

impl Series {
    /// Runs all cases on all cores and returns them in order; `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first of [`case`].
    pub fn run(&self, estimator: &Estimator, tell: impl Fn(&Case)) -> Result<Vec<Case>, CaseError> {
        let (send, receive) = std::sync::mpsc::channel();
        let mut cases: Vec<Case> = std::thread::scope(|scope| {
            scope.spawn(move || {
                self.fabrics.clone().into_par_iter().for_each_with(send, |send, index| {
                    let of = (self.seed, index);
                    // Nobody listens any more once a case has failed.
                    let _ = send.send(case(&self.prior, &self.setup, self.scale, of, estimator));
                });
            });
            receive.into_iter().map(|case| case.inspect(&tell)).collect::<Result<_, _>>()
        })?;
        cases.sort_by_key(|case| case.index);
        Ok(cases)
    }
}

/// Drapes, scans and estimates fabric `index` of a prior, told where the warp points.
///
/// # Errors
/// When the prior gives no fabric, the drape makes no scene, or the network fails.
pub fn case(
    prior: &Mixture,
    setup: &Setup,
    scale: f64,
    (seed, index): (u64, u64),
    estimator: &Estimator,
) -> Result<Case, CaseError> {
    let fabric = prior.sample(seed, index)?;
    let options = SimOptions::default();
    let drape = drape(&fabric, &Drop { start: DropStart::Perturbed(seed ^ index) }, &options);
    let scene = Scene::modified_cusick(drape.mesh());
    let mut made = scan(&scene, &setup.poses, &setup.profile, seed ^ index)?;
    let (frame, unit_m) = (made.truth.simulation_from_scanner, made.truth.unit_m);
    for point in &mut made.cloud.points {
        let p = frame * (*point * unit_m);
        *point = frame.inverse() * (p * scale) / unit_m;
    }
    let answer = match find(&made, &Tuning::default()) {
        Err(refusal) => Err(refusal),
        Ok(found) => {
            let estimate = estimator.estimate(&found.boundary, fabric.density_kg_m2, true)?;
            let again =
                released_drape(&found.boundary, Some(&found.surface), &estimate.fabric, &options);
            // a drape that rotated as it fell lies turned, and no scan can tell
            let rim = drape.boundary.turned_onto(&found.boundary);
            let rim_error_m = rim.mean_distance_m(&found.boundary);
            let figures = Figures::of_scan(&found, &ScanOptions::default());
            let likeness = estimator.prior().map(|prior| estimate.likeness(prior));
            let figures = figures.answered(&estimate, likeness.as_ref(), Some(&again));
            let verdict = figures.verdict(&Limits::default());
            let answer = Answer::of(&estimate);
            let covered = answer.holds(&fabric).into_iter().filter(|holds| *holds).count();
            let factors = answer
                .value
                .into_iter()
                .zip(fabric.to_paper_units())
                .map(|(v, t)| (v / t).max(t / v));
            let worst_factor = factors.fold(1.0, f64::max);
            Ok(Judged { figures, verdict, rim_error_m, covered, worst_factor })
        }
    };
    Ok(Case { index, fabric, drape, answer })
}

/// The numbers of a case, by the names of their columns; those of the answer are missing where a
/// scan was refused.
#[must_use]
pub fn numbers(case: &Case) -> Vec<(&'static str, f64)> {
    let mm = |m: f64| m / M_PER_MM;
    let mut row = vec![
        ("true_bending_length_mm", mm(bending_length_m(&case.fabric))),
        ("true_folds", case.drape.nodes as f64),
    ];
    let Ok(judged) = &case.answer else { return row };
    let f = &judged.figures;
    let [s0, s1, s2, s3] = f.sides_m.map(mm);
    row.extend([
        ("rim_error_mm", mm(judged.rim_error_m)),
        ("covered_of_6", judged.covered as f64),
        ("worst_factor", judged.worst_factor),
        ("folds", f.folds as f64),
        ("side0_mm", s0),
        ("side1_mm", s1),
        ("side2_mm", s2),
        ("side3_mm", s3),
        ("observed", f.observed_fraction),
        ("gap_mm", mm(f.longest_gap_m)),
    ]);
    if let Some(scan) = &f.scan {
        let [warp, weft] = scan.widths_m.map(|m| mm(m.unwrap_or(f64::NAN)));
        row.extend([
            ("width_warp_mm", warp),
            ("width_weft_mm", weft),
            ("plate_mm", mm(scan.radius_m)),
            ("plate_sigma_mm", mm(scan.radius_sigma_m)),
            ("noise_mm", mm(f.noise_m)),
            ("misfit_of_refused", scan.misfit_m / f.given.most_misfit_m),
            ("unexplained_of_refused", scan.unexplained_m2 / f.given.most_unexplained_m2),
        ]);
    }
    if let Some(answer) = &f.answer {
        let length_m = answer.bending_length_m;
        row.extend([
            ("bending_length_mm", mm(length_m)),
            ("folds_root_m05", f.folds as f64 * length_m.sqrt()),
            ("stretch_weft", answer.stretch[0]),
            ("stretch_warp", answer.stretch[1]),
            ("novelty_of_limit", answer.novelty_m / answer.novelty_limit_m),
            ("bending_factor", (length_m / bending_length_m(&case.fabric)).powi(3)),
        ]);
        let scale = |of: fn(&Scale) -> f64| judged.verdict.scale.as_ref().map_or(f64::NAN, of);
        row.extend([
            ("scale", scale(|scale| scale.value)),
            ("scale_sigma", scale(|scale| scale.sigma)),
            ("scale_by_plate", scale(|scale| scale.plate.value)),
        ]);
        let prior = answer.prior.as_ref();
        row.extend(prior.map(|prior| ("prior_of_limit", prior.distance / prior.limit)));
    }
    if let Some(released) = &f.released {
        row.extend([
            ("released_mm", mm(released.mean_m)),
            ("released_folds", released.folds as f64),
        ]);
    }
    row
}

/// What became of many cases.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Cases by verdict, refusals among them.
    pub verdicts: BTreeMap<&'static str, usize>,
    /// Cases by the code of a ground that speaks against them.
    pub grounds: BTreeMap<&'static str, usize>,
    /// The values of each column that are numbers, in rising order.
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

impl Summary {
    /// Of these cases.
    #[must_use]
    pub fn of(cases: &[Case]) -> Self {
        let mut summary = Self::default();
        for case in cases {
            let word = case.answer.as_ref().map_or("refused", |j| j.verdict.level.name());
            *summary.verdicts.entry(word).or_default() += 1;
            for code in case.answer.iter().flat_map(|j| codes(&j.verdict)) {
                *summary.grounds.entry(code).or_default() += 1;
            }
            for (name, value) in numbers(case).into_iter().filter(|(_, value)| value.is_finite()) {
                match summary.columns.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, values)) => values.push(value),
                    None => summary.columns.push((name, vec![value])),
                }
            }
        }
        summary.columns.iter_mut().for_each(|(_, values)| values.sort_by(f64::total_cmp));
        summary
    }
}

/// Codes of the grounds that speak against a result, each once.
#[must_use]
pub fn codes(verdict: &Verdict) -> Vec<&'static str> {
    let against =
        verdict.grounds.iter().filter(|g| g.level > scan2params::job::verdict::Level::Reliable);
    let mut codes: Vec<&str> = against.map(|ground| ground.code.name()).collect();
    codes.dedup();
    codes
}

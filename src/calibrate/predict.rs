//! Drapes that are predicted: those of a cloth that was fitted to others, or is known.
//!
//! In: targets, a cloth with its effects. Out: each target [`Comparison`] its drape, led and held
//! as those of the fit are, and of scanned sheets how far off they are once they are released; or
//! why a sheet did not come to rest.

use rayon::prelude::*;

use super::comparison::Comparison;
use super::continuation::{Continuation, Sheet};
use super::effect::Cloth;
use super::equations::{Problem, rms_m, shared_of};
use super::fabric_prior::FabricPrior;
use super::fit::Progress;
use super::measures::FoldRule;
use super::options::FitOptions;
use super::pose::Pose;
use super::prediction::{prediction_of, steadied_prediction_of};
use super::target::Target;
use crate::sim::sensitivity::SensitivityError;

/// Drapes of one cloth led and held by outlines, each beside its own.
pub fn predict(
    targets: &[Target],
    fabric_prior: &FabricPrior,
    cloth: &Cloth,
    options: &FitOptions,
    rule: &FoldRule,
    tell: &(dyn Fn(Progress) + Sync),
) -> Vec<Result<Comparison, SensitivityError>> {
    let poses: Vec<Pose> = targets.iter().map(Target::first_pose).collect();
    let numbers = cloth.effects.iter().map(|(number, _)| *number).collect();
    let all = Problem { targets: targets.to_vec(), numbers, fabric_prior, options };
    let (shared, continuation) = (shared_of(cloth), Continuation::of(&all, cloth));
    let guided = continuation.all(targets, &poses);
    tell(Progress { drapes: targets.len(), outlines: targets.len(), rms_m: f64::INFINITY });
    let comparison = |(target, sheet): (&Target, Result<Sheet, SensitivityError>)| {
        let (mut sheet, mut prediction) = sheet?;
        let finer = continuation.finer(target, &target.first_pose(), &prediction);
        let problem = all.to(vec![Target { finer, ..target.clone() }]);
        let target = &problem.targets[0];
        let mut pose = target.first_pose();
        // the springs follow the pose, and the pose the drape
        for _ in 0..PREDICTIONS {
            pose = problem.around(&shared, vec![prediction], &[pose]).drapes[0].pose;
            prediction = continuation.steadily_on(&mut sheet, target, &pose)?;
        }
        let draped = problem.around(&shared, vec![prediction], &[pose]).drapes.remove(0);
        let mut release = || {
            sheet.release();
            let free = prediction_of(&mut sheet, &continuation.asked, target.compared())
                .or_else(|_| {
                    steadied_prediction_of(&mut sheet, &continuation.asked, target.compared())
                })
                .ok()?;
            let free = problem.around(&shared, vec![free], &[draped.pose]);
            Some(rms_m(&free.drapes[0].residuals.rows))
        };
        let released_rms_m = if target.is_held(options) { release() } else { None };
        let comparison = Comparison::of(target, draped, cloth.view(), options, rule);
        Ok(Comparison { released_rms_m, ..comparison })
    };
    targets.par_iter().zip(guided).map(comparison).collect()
}

/// How often a predicted drape's pose and springs follow each other.
const PREDICTIONS: usize = 2;

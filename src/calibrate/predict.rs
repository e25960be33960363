//! Drapes that are predicted: those of a cloth that was fitted to others, or is known.
//!
//! In: targets, a cloth with its effects. Out: each target [`Beside`] its drape, led and held as
//! those of the fit are, and of scanned sheets how far off they are once they are released; or why
//! a sheet did not come to rest.

use rayon::prelude::*;

use super::believed::Believed;
use super::beside::Beside;
use super::effect::{Cloth, Number};
use super::fit::Progress;
use super::lead::{Lead, Sheet};
use super::measures::FoldRule;
use super::options::FitOptions;
use super::pose::Pose;
use super::squares::{Squares, parameters, rms_m, shared_of};
use super::target::Target;
use super::trial::{steadied_trial_of, trial_of};
use crate::sim::sensitivity::SensitivityError;

/// Drapes of one cloth led and held by outlines, each beside its own.
pub fn predict(
    targets: &[Target],
    believed: &Believed,
    cloth: &Cloth,
    options: &FitOptions,
    rule: &FoldRule,
    tell: &(dyn Fn(Progress) + Sync),
) -> Vec<Result<Beside, SensitivityError>> {
    let poses: Vec<Pose> = targets.iter().map(Target::first_pose).collect();
    let numbers: Vec<&'static Number> = cloth.effects.iter().map(|(number, _)| *number).collect();
    let (shared, asked) = (shared_of(cloth), parameters(&numbers));
    let lead = Lead { cloth, options, asked: &asked };
    let led = lead.all(targets, &poses);
    tell(Progress { drapes: targets.len(), outlines: targets.len(), rms_m: f64::INFINITY });
    let beside = |(target, sheet): (&Target, Result<Sheet, SensitivityError>)| {
        let (mut sheet, mut trial) = sheet?;
        let finer = lead.finer(target, &target.first_pose(), &trial);
        let one = [Target { finer, ..target.clone() }];
        let target = &one[0];
        let squares = Squares { targets: &one, believed, options, numbers: &numbers };
        let mut pose = target.first_pose();
        // the springs follow the pose, and the pose the drape
        for _ in 0..PREDICTIONS {
            pose = squares.around(&shared, vec![trial], vec![pose]).poses[0];
            trial = lead.steadily_on(&mut sheet, target, &pose)?;
        }
        let mut state = squares.around(&shared, vec![trial], vec![pose]);
        let mut release = || {
            sheet.release();
            let free = trial_of(&mut sheet, &asked, target.compared())
                .or_else(|_| steadied_trial_of(&mut sheet, &asked, target.compared()))
                .ok()?;
            let free = squares.around(&shared, vec![free], state.poses.clone());
            Some(rms_m(&free.seen[0].rows))
        };
        let released_rms_m = if target.is_held(options) { release() } else { None };
        let (trial, seen) = (state.trials.remove(0), state.seen.remove(0));
        let pose = (state.poses[0], cloth.view());
        Ok(Beside { released_rms_m, ..Beside::of(target, trial, pose, seen, options, rule) })
    };
    targets.par_iter().zip(led).map(beside).collect()
}

/// How often a predicted drape's pose and springs follow each other.
const PREDICTIONS: usize = 2;

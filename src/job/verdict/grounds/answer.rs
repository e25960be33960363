//! The grounds of the estimate and of its drape.

use super::super::super::NotTaken;
use super::super::figures::{Answer, Figures, Fit, Parameter, Refining, Shown};
use super::super::limits::Limits;
use super::super::{Code, Ground, Level};
use crate::base::units::mm;
use crate::refine::FitError;
use crate::sim::Stop;

/// A rim that the network has met no like of, as off centre or on a plate that is not level. A fit
/// to the scan knows of both.
pub(super) fn novel(f: &Figures, answer: &Answer, limits: &Limits) -> Option<Ground> {
    let (level, limit) = limits.novelty.level(answer.novelty_m / answer.novelty_limit_m)?;
    let (level, what_follows) = if f.is_fitted(limits) {
        (Level::Reliable, "values and intervals are those of the fit")
    } else {
        (level, "check the scan; no interval holds for such a rim")
    };
    let (measured_mm, limit_mm) = (mm(answer.novelty_m), limit * mm(answer.novelty_limit_m));
    let text = format!(
        "the rim is {measured_mm:.2} mm (rms) from any drape of the training data (limit {limit_mm:.2} mm; 99 % of \
         them stay below {:.2}): {what_follows}",
        mm(answer.novelty_limit_m)
    );
    Some(Ground::new(Code::NovelRim, level, (measured_mm, limit_mm, "mm"), text))
}

/// A fabric that is like no part of the prior: the network has hardly met any like it. The
/// intervals of one that was refined are those of the fit, and the ground is only a note.
pub(super) fn outside_prior(answer: &Answer, limits: &Limits) -> Option<Ground> {
    let prior = answer.prior.as_ref().filter(|prior| !prior.like)?;
    let (level, factor) = limits.outside_prior.level(prior.distance / prior.limit)?;
    let limit = factor * prior.limit;
    let (level, what_follows) = if prior.network {
        (
            level,
            "the training data has hardly any such cloth, and half of the 90 % intervals do not hold for it: check the scan, \
             the plate and the specimen; without --quick the fabric itself is fitted to the scan",
        )
    } else {
        (
            Level::Reliable,
            "such cloth is rare; values and intervals are those of the fit, but the interval of a stiffness that is hardly \
             visible in the drape is the network's and may not hold",
        )
    };
    let text =
        format!("for its weight the fabric {} (limit {limit:.2}): {what_follows}", prior.words);
    let measured = (prior.distance, limit, "standard deviations");
    Some(Ground::new(Code::OutsidePrior, level, measured, text))
}

/// A stiffness at the end of what the model was trained on, or its interval cut there.
pub(super) fn range_end(p: &Parameter, limits: &Limits) -> Option<Ground> {
    let Parameter { key, unit, value, interval90: [low, high], trained, pinned } = *p;
    let ends = ["lower", "upper"];
    if let Some(end) = pinned {
        // The interval has shrunk to the bound: it lies beyond as a whole.
        let gone = low >= trained[1] || high <= trained[0];
        let (level, beyond) = if gone {
            (Level::DoNotUse, "the fabric lies beyond it, and so does the whole interval")
        } else {
            (Level::Doubtful, "the fabric may lie beyond it, and the interval cannot say so")
        };
        let text = format!(
            "{key} is {value:.0} {unit}, at the {} end of what the model was trained on ({:.0} to {:.0}): {beyond}",
            ends[end], trained[0], trained[1]
        );
        let measured = (value, trained[end], unit);
        return Some(Ground::new(Code::OutOfRange, level, measured, text).about(key));
    }
    // Both are cut at the very number.
    let end = [low <= trained[0], high >= trained[1]].iter().position(|cut| *cut)?;
    // The interval is even about the value in logarithms, before it is cut.
    let (whole, kept) = match end {
        0 => ((high / value).ln(), (value / low).ln()),
        _ => ((value / low).ln(), (high / value).ln()),
    };
    let share = 0.5 * (1.0 - kept / whole).max(0.0);
    let limit = limits.interval_cut;
    let level = if share > limit { Level::Doubtful } else { Level::Reliable };
    let text = format!(
        "the interval of {key} is cut at the {} end of what the model was trained on, {:.0} {unit}, by {:.0} % of its \
         length (limit {:.0} %): the fabric may lie beyond it",
        ends[end],
        trained[end],
        100.0 * share,
        100.0 * limit
    );
    Some(Ground::new(Code::IntervalAtBound, level, (share, limit, ""), text).about(key))
}

pub(super) fn density(answer: &Answer, limits: &Limits) -> Option<Ground> {
    let (density, [least, most]) = answer.density_outside_g_m2?;
    let (level, factor) = limits.density_factor.level((density / most).max(least / density))?;
    let limit = if density > most { most * factor } else { least / factor };
    let text = format!(
        "the density, {} g/m^2, lies outside the {least:.0} to {most:.0} g/m^2 of all fabrics that the \
         model was trained on, and every stiffness is in proportion to it; weigh the specimen again, and give grams a square metre",
        (10.0 * density).round() / 10.0
    );
    let measured = (density, limit, "g/m^2");
    Some(Ground::new(Code::DensityOutsideTraining, level, measured, text))
}

pub(super) fn bending_raised(answer: &Answer) -> Option<Ground> {
    let [from, to] = answer.bending_raised?;
    let unit = crate::base::units::BENDING_UNIT;
    let text = format!(
        "bending_bias was estimated as {from:.0} {unit} and raised to {to:.0}, the least that bending_weft and \
         bending_warp allow"
    );
    Some(Ground::new(Code::BendingProjected, Level::Reliable, (from, to, unit), text))
}

/// The count of folds against that of cloth with the bending length of the answer.
pub(super) fn folds_for_bending(f: &Figures, answer: &Answer, limits: &Limits) -> Option<Ground> {
    let root_m05 = answer.bending_length_m.sqrt();
    let [least, most] = limits.folds_root_m05.map(|limit| limit / root_m05);
    let folds = f.folds as f64;
    let (level, beyond) = limits.folds_beyond.level((folds - most).max(least - folds))?;
    let (level, what_follows) = if f.is_fitted(limits) {
        (Level::Reliable, "the drape of the fit has them")
    } else {
        let why = "the folds are not those of hanging cloth (pleated, creased, held), or the bending stiffness is off";
        (level, why)
    };
    let text = format!(
        "the rim has {folds:.0} folds; cloth with the bending length found, {:.1} mm, makes {least:.1} to {most:.1} \
         (limit {beyond:.1} beyond): {what_follows}",
        mm(answer.bending_length_m)
    );
    let limit = if folds > most { most + beyond } else { least - beyond };
    Some(Ground::new(Code::FoldsForBending, level, (folds, limit, ""), text))
}

/// What refining found.
pub(super) fn refined(refining: &Refining, limits: &Limits) -> Vec<Ground> {
    let (shown, misfit) = match refining {
        Refining::Left(why) => return vec![left(why)],
        Refining::Taken { shown, misfit } => (shown, *misfit),
    };
    let hardly = |s: &&Shown| s.share < limits.shown;
    let ground = |s: &Shown| {
        let text = format!(
            "{} is hardly visible in this drape ({:.0} % of the uncertainty removed): its interval is hardly narrower than the network's",
            s.key,
            100.0 * s.share
        );
        let measured = (s.share, limits.shown, "");
        Ground::new(Code::HardlyVisible, Level::Reliable, measured, text).about(s.key)
    };
    let leaves = limits.refined_misfit.level(misfit).map(|(level, limit)| {
        model_misfit(level, [misfit, limit], "the intervals are wider for it")
    });
    leaves.into_iter().chain(shown.iter().filter(hardly).map(ground)).collect()
}

/// What the fit leaves, in standard deviations, and its limit.
fn model_misfit(level: Level, [misfit, limit]: [f64; 2], what_follows: &str) -> Ground {
    let text = format!(
        "tied to the scan, the fabric that fits best lies {misfit:.2} standard deviations of scan and simulator off (limit \
         {limit:.2}): the cloth has an effect that the six stiffnesses lack, or plate or scan are off; {what_follows}"
    );
    Ground::new(Code::ModelMisfit, level, (misfit, limit, ""), text)
}

/// Why the answer is the network's.
fn left(why: &NotTaken) -> Ground {
    let not_refined = |level, measured, why: String| {
        let text = format!("{why}; the values are the network's quick answer");
        Ground::new(Code::NotRefined, level, measured, text)
    };
    let doubtful = |why| not_refined(Level::Doubtful, (0.0, 0.0, ""), why);
    match why {
        NotTaken::Failed(FitError::Interrupted) => {
            let why = "refining was interrupted".to_owned();
            not_refined(Level::Reliable, (0.0, 0.0, ""), why)
        }
        NotTaken::Failed(error) => doubtful(format!("not refined: {error}")),
        NotTaken::NotConverged(ended) => {
            doubtful(format!("refining did not converge ({})", ended.name()))
        }
        NotTaken::AtBound(key) => doubtful(format!(
            "refining ended with {key} at the end of what it allows: the fabric lies beyond it, or {key} absorbs \
             another effect"
        ))
        .about(key),
        NotTaken::OtherBranch { folds: [scanned, draped], rim_m } => {
            let why = format!(
                "tied to the scan, the fabric that refining found has {draped} folds, {:.1} mm from the scanned rim, which has \
                 {scanned}: another of its stable drapes; lay the specimen again and scan it",
                mm(*rim_m)
            );
            not_refined(Level::Doubtful, (mm(*rim_m), 0.0, "mm"), why)
        }
        NotTaken::Leaves { misfit, most } => {
            let of_both = "neither its values nor the network's are to be used";
            model_misfit(Level::DoNotUse, [*misfit, *most], of_both)
        }
    }
}

/// The released drape of a refined fabric, which is only a note.
fn moved_on(again: &Fit, limits: &Limits) -> Option<Ground> {
    let limit_m = limits.released_far_m;
    let text = format!(
        "released from the scan, the sheet moves to {:.1} mm from the scanned rim on average (up to {:.0} mm \
         are usual): the fabric has several stable drapes, and a simulator may end in another one; the stiffnesses do \
         not depend on it",
        mm(again.mean_m),
        mm(limit_m)
    );
    let measured = (mm(again.mean_m), mm(limit_m), "mm");
    (again.mean_m > limit_m || again.stop != Stop::AtRest)
        .then(|| Ground::new(Code::ReleasedDrapeOff, Level::Reliable, measured, text))
}

/// The released drape compared with the scan.
pub(super) fn released(f: &Figures, again: &Fit, limits: &Limits) -> Vec<Ground> {
    if f.is_taken() {
        return moved_on(again, limits).into_iter().collect();
    }
    let mut grounds = Vec::new();
    let bending_m = f.answer.as_ref().map_or(0.0, |answer| answer.bending_length_m);
    let steps = limits.released_at(bending_m).plus(f.noise_m);
    if let Some((level, limit_m)) = steps.level(again.mean_m) {
        let text = format!(
            "the released drape of these stiffnesses lies {:.1} mm from the scanned rim on average (limit {:.1} \
             mm; valid scans of cloth of this bending length, {:.0} mm, come within {:.1}): the stiffnesses do not \
             reproduce the drape; check the plate and the scan, or lay the specimen again",
            mm(again.mean_m),
            mm(limit_m),
            mm(bending_m),
            mm(steps.doubtful)
        );
        let measured = (mm(again.mean_m), mm(limit_m), "mm");
        grounds.push(Ground::new(Code::ReleasedDrapeOff, level, measured, text));
    }
    let differ = f.folds.abs_diff(again.folds) as f64;
    if let Some((level, limit)) = limits.released_folds.level(differ) {
        let text = format!(
            "the released drape of these stiffnesses has {} folds, the scan {} (limit {limit:.1} apart): it \
             fell into another shape, or the folds are not those of hanging cloth",
            again.folds, f.folds
        );
        grounds.push(Ground::new(Code::FoldsDiffer, level, (differ, limit, ""), text));
    }
    if again.stop != Stop::AtRest {
        let text = format!(
            "the released drape of these stiffnesses did not come to rest ({}; residual force {:.1e} N): its distance from \
             the scan means little",
            again.stop.name(),
            again.residual_n
        );
        let measured = (again.residual_n, 0.0, "N");
        grounds.push(Ground::new(Code::ReleasedDrapeNotAtRest, Level::Doubtful, measured, text));
    }
    if again.intersections > 0 {
        let text = format!(
            "the released drape of these stiffnesses passes through itself in {} pairs of triangles: it is no cloth's; please \
             report it",
            again.intersections
        );
        let measured = (again.intersections as f64, 0.0, "");
        grounds.push(Ground::new(Code::ReleasedDrapeIntersects, Level::Doubtful, measured, text));
    }
    grounds
}

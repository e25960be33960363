//! One fabric: what its drapes show of each other, the fit, the effects, the drapes held out.

use super::options::{CalibrateError, Options, Told};
use crate::calibrate::effect::{EFFECTS, Effect};
use crate::calibrate::explain::{Explained, explain};
use crate::calibrate::fabric_prior::FabricPrior;
use crate::calibrate::fit::{Fit, FitError, Fitted, fit};
use crate::calibrate::floor::{Observed, Pairing, Spread, spreads};
use crate::calibrate::manifest::Role;
use crate::calibrate::measured::Measured;
use crate::calibrate::options::FitOptions;
use crate::calibrate::predict::predict;
use crate::calibrate::result::{After, ComparedDrape, FabricResult, Verdict};
use crate::calibrate::target::{Rim, Target};
use crate::numeric::moments::mean;

/// Calibrates one fabric.
///
/// # Errors
/// When the prior cannot be drawn from.
pub fn fabric(
    name: String,
    measured: Vec<Measured>,
    options: &Options,
    tell: &(dyn Fn(Told<'_>) + Sync),
) -> Result<FabricResult, CalibrateError> {
    tell(Told::Floor(&name));
    let drape_of = drapes_of(&measured);
    let floor = floor_of(&measured, &drape_of);
    let density = measured.iter().find_map(|m| m.entry.density_kg_m2);
    let fabric_prior = FabricPrior::of(&options.prior, density)?;
    let of_role = |role: Role| -> Vec<usize> {
        let own = |k: &usize| measured[*k].entry.role == role && drape_of[*k] == *k;
        (0..measured.len()).filter(own).collect()
    };
    let (to_fit, held_out) = (of_role(Role::Fit), of_role(Role::Holdout));
    let targets =
        |which: &[usize]| -> Vec<Target> { which.iter().map(|&k| measured[k].target()).collect() };
    let count = to_fit.len().max(1) as f64;
    let mean = to_fit.iter().map(|&k| measured[k].measures.drape_coefficient).sum::<f64>() / count;
    let fitting = |progress| tell(Told::Fitting(&name, progress));
    let sensor_edge_m = sensor_edge_m(&measured, options.fit.sensor_edge_m);
    let (rule, fit_options) = (&options.folds, &FitOptions { sensor_edge_m, ..options.fit });
    let own = targets(&to_fit);
    let rows: Vec<&Measured> = to_fit.iter().map(|&k| &measured[k]).collect();
    let fit = fit(&own, &fabric_prior, mean, fit_options, rule, &fitting);
    let (mut fitted, explained) = explained(fit, &floor, &without(options, &rows));
    let predicting = |progress| tell(Told::Predicting(&name, progress));
    let held = targets(&held_out);
    let comparison = |fitted: &mut Fitted| -> Vec<ComparedDrape> {
        let own = to_fit.iter().zip(std::mem::take(&mut fitted.drapes));
        let predicted =
            predict(&held, &fabric_prior, &fitted.cloth, fit_options, rule, &predicting);
        let all = own.chain(held_out.iter().zip(predicted));
        all.map(|(&measured, comparison)| ComparedDrape { measured, comparison }).collect()
    };
    let drapes = fitted.as_mut().map(&comparison).unwrap_or_default();
    let (explanations, fields, added) = explained
        .map(|Explained { explanations, fields, added }| (Some(explanations), fields, added))
        .unwrap_or_default();
    let after = added.map(|(effects, mut fitted)| {
        let drapes = comparison(&mut fitted);
        After { effects, fitted, drapes }
    });
    let mut result = FabricResult {
        name,
        fabric_prior,
        measured,
        floor,
        fitted,
        drapes,
        explanations,
        fields,
        after,
        verdict: Verdict::Undecided,
    };
    result.verdict = result.judge();
    Ok(result)
}

/// The plain fit, and what explains the drapes beyond it; the effects `without` are not looked for.
fn explained(
    fit: Result<Fit<'_>, FitError>,
    floor: &[Spread],
    without: &[&'static Effect],
) -> (Result<Fitted, FitError>, Option<Explained>) {
    match fit {
        Ok(mut fit) => {
            let captures = floor.iter().find(|spread| spread.pairing == Pairing::Captures);
            let usual = fit.usual(captures.map(|spread| spread.median_m));
            let explained = explain(&mut fit, without, usual);
            (Ok(fit.plain()), explained)
        }
        Err(error) => (Err(error), None),
    }
}

/// How well the outlines are known, from those first seen of each drape.
fn floor_of(measured: &[Measured], drape_of: &[usize]) -> Vec<Spread> {
    let first = |m: &Measured| m.entry.observation.is_none_or(|observation| observation == 1);
    let observed = measured.iter().zip(drape_of).filter(|(m, _)| first(m));
    let observed = observed.map(|(m, &drape)| Observed {
        outline: &m.outline,
        unit: (m.entry.specimen.as_deref(), m.entry.face),
        drape,
    });
    spreads(&observed.collect::<Vec<_>>())
}

/// The effects that are not looked for: those asked for, perspective where every camera's height is
/// known, and what these cuts cannot have.
fn without(options: &Options, fitted: &[&Measured]) -> Vec<&'static Effect> {
    let known = fitted.iter().all(|m| m.entry.camera_height_m.is_some());
    let perspective = Effect::named("perspective").filter(|_| known);
    let is_cut = |effect: &&Effect| fitted.iter().all(|m| effect.is_of(m.bench.specimen.outline));
    let of_other_cuts = EFFECTS.iter().filter(|effect| !is_cut(effect));
    options.without.iter().copied().chain(perspective).chain(of_other_cuts).collect()
}

/// The shift of scanned edges, mean and standard deviation \[m\]: as it is known, if it is, and
/// otherwise none with the largest deviation that a scan says of its sensor; both 0 where there is
/// no scan.
fn sensor_edge_m(measured: &[Measured], known: [f64; 2]) -> [f64; 2] {
    let edges = measured.iter().filter_map(|m| m.rim.as_ref()?.edge);
    let sensor_m = edges.map(|edge| edge.sensor_m).fold(0.0, f64::max);
    if sensor_m > 0.0 && known[1] > 0.0 { known } else { [0.0, sensor_m] }
}

/// For each row which drape it shows, as the first row that shows it. Rows of an unknown specimen
/// show one each. Scans of one capture show one drape; of scans without a capture the distance of
/// their rims decides.
pub(super) fn drapes_of(measured: &[Measured]) -> Vec<usize> {
    let unit = |m: &'_ Measured| (m.entry.specimen.clone(), m.entry.face, m.entry.observation);
    let mut drapes: Vec<usize> = Vec::new();
    for (k, own) in measured.iter().enumerate() {
        let shows = |&before: &usize| {
            let other = &measured[before];
            let same_unit = own.entry.specimen.is_some() && unit(own) == unit(other);
            let captures = own.entry.capture.as_ref().zip(other.entry.capture.as_ref());
            let both = own.rim.as_ref().zip(other.rim.as_ref());
            // of scans the user's word comes first, since stiff cloth falls alike
            let is_one = |rims| captures.map_or_else(|| is_one_drape(rims), |(a, b)| a == b);
            same_unit && both.is_none_or(is_one)
        };
        let first = (0..k).filter(|&before| drapes[before] == before).find(shows);
        drapes.push(first.unwrap_or(k));
    }
    drapes
}

/// Whether two rims are of one drape.
fn is_one_drape((a, b): (&Rim, &Rim)) -> bool {
    let both = a.boundary.points().iter().zip(b.boundary.points());
    let seen = both.filter(|(a, b)| a.observed && b.observed);
    let squared: Vec<f64> =
        seen.map(|(a, b)| (a.position_m - b.position_m).norm_squared()).collect();
    squared.is_empty() || mean(&squared).sqrt() < ANEW_M
}

/// Root mean square distance of two rims of a specimen from which on it was dropped anew between
/// them \[m\]: scans of one drape differ by up to two, drapes of two drops mostly by more than ten
/// (`docs/validation/network.md`).
const ANEW_M: f64 = 4e-3;

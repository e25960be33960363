//! A calibration's result for a fabric, as a score reads it.
//!
//! In: a fabric's result. Out: [`Said`], verdict, effects and errors, which files keep with null
//! where a number is none.

use serde::{Deserialize, Deserializer, Serialize};

use scan2params::base::units::M_PER_MM;
use scan2params::calibrate::floor::Pairing;
use scan2params::calibrate::result::FabricResult;
use scan2params::numeric::moments::mean;

/// A calibration's result for a fabric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// `found`, `undecided`, `unexplained` or `none`.
    pub verdict: String,
    /// Names of the effects found.
    pub effects: Vec<String>,
    /// Names of those that the drapes do not tell from the ones found.
    pub group: Vec<String>,
    /// Mean distance of the held-out outlines without any effect \[mm\]; NaN, in files null, where
    /// none came to rest.
    #[serde(deserialize_with = "nan_of_null")]
    pub before_mm: f64,
    /// The same with the effects found \[mm\].
    #[serde(deserialize_with = "nan_of_null")]
    pub after_mm: f64,
    /// The same two of scanned sheets after release \[mm\]; NaN of outlines.
    #[serde(deserialize_with = "nans_of_nulls")]
    pub released_mm: [f64; 2],
    /// What the fits leave, in standard deviations, without any effect and with those found.
    #[serde(deserialize_with = "nans_of_nulls")]
    pub misfit: [f64; 2],
    /// Median distance of two pictures of one drape \[mm\]; NaN without such.
    #[serde(deserialize_with = "nan_of_null")]
    pub floor_mm: f64,
    /// Where the field is strongest that would best explain what the effects leave, as fractions of
    /// the specimen's sides along warp and weft; none if no field predicts anything.
    pub strongest: Option<[f64; 2]>,
}

/// What a fabric's result says; the one place that knows how.
#[must_use]
pub fn said_of(result: &FabricResult) -> Said {
    let pairs = result.pairs();
    let of = |which: usize| -> f64 {
        mean(&pairs.iter().map(|pair| pair.rms_m[which]).collect::<Vec<_>>()) / M_PER_MM
    };
    let plain_mm = mean(&result.held_out_rms_m()) / M_PER_MM;
    let [before_mm, after_mm] =
        if pairs.is_empty() { [plain_mm, plain_mm] } else { [of(0), of(1)] };
    let of_free = |which: usize| -> f64 {
        let own: Vec<f64> =
            pairs.iter().filter_map(|pair| Some(pair.released_rms_m?[which])).collect();
        mean(&own) / M_PER_MM
    };
    let before = result.fitted.as_ref().map_or(f64::NAN, |fitted| fitted.misfit);
    let captures = result.floor.iter().find(|spread| spread.pairing == Pairing::Captures);
    let found = || result.after.iter().flat_map(|after| &after.effects);
    Said {
        verdict: result.verdict.name().to_owned(),
        effects: found().map(|found| found.effect.name.to_owned()).collect(),
        group: found().flat_map(|found| &found.group).map(|&name| name.to_owned()).collect(),
        before_mm,
        after_mm,
        released_mm: [of_free(0), of_free(1)],
        misfit: [before, result.after.as_ref().map_or(before, |after| after.fitted.misfit)],
        floor_mm: captures.map_or(f64::NAN, |spread| spread.median_m / M_PER_MM),
        strongest: strongest(result),
    }
}

/// Where the most probable field is strongest, if it is anything.
fn strongest(result: &FabricResult) -> Option<[f64; 2]> {
    let field = result.fields.iter().find(|field| field.is_something())?;
    Some(field.strongest(&result.measured.first()?.bench.specimen)?.place)
}

/// A number of a file that is null there where it is none.
pub(super) fn nan_of_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// The same of two.
pub(super) fn nans_of_nulls<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 2], D::Error> {
    Ok(<[Option<f64>; 2]>::deserialize(from)?.map(|value| value.unwrap_or(f64::NAN)))
}

//! calibration.json by its types.

mod fit;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::calibrate::cloth_file::Density;
use crate::calibrate::effect::{FieldOf, Layer};
use crate::calibrate::manifest::{Face, Kind, Role};
use crate::calibrate::result::Verdict;
use crate::sim::experiment::CURL_NODES;

pub(super) use self::fit::{Compared, Drape, Fit, Fitted, Found, Parameter, Pose};

/// Version of calibration.json.
pub const SCHEMA_VERSION: u32 = 3;

/// What `scan2params calibrate` found: calibration.json of --out, and stdout with --json.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct File<F> {
    /// Version of the layout \[-\]; raised when a field changes its meaning or goes.
    #[cfg_attr(test, schemars(extend("const" = SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Version of the program that wrote this.
    #[cfg_attr(test, schemars(extend("pattern" = r"^[0-9]+\.[0-9]+\.[0-9]+")))]
    pub version: &'static str,
    /// Each fabric of the manifest, by name.
    pub fabrics: BTreeMap<String, F>,
    /// Files that were not used.
    pub refused: Vec<NotUsed>,
}

/// A file that was not used.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct NotUsed {
    /// Line of the manifest \[count\].
    pub line: usize,
    /// Its file.
    pub file: String,
    /// Why it was not used.
    pub why: String,
}

/// A fabric.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(extend("oneOf" = [{ "required": ["fit"] }, { "required": ["failed"] }])))]
pub(super) struct Fabric {
    /// Areal density.
    pub density: Density,
    /// What was measured.
    pub outlines: Vec<Outline>,
    /// How well outlines are known.
    pub floor: Floor,
    /// Simulated drapes of the plain model.
    pub drapes: Vec<Drape>,
    /// Drapes by role and face.
    pub groups: Vec<Group>,
    /// The plain model; or `failed`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Fit"))]
    pub fit: Option<Fit>,
    /// Why nothing was fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "String"))]
    pub failed: Option<String>,
    /// What was found beyond the plain model.
    pub verdict: Verdict,
    /// A number of an effect that was added.
    pub effects: Vec<Found>,
    /// What explains the drapes, the most probable first; null where a sheet does not say how it
    /// moves.
    pub explanations: Option<Vec<Explanation>>,
    /// What smooth fields on the cloth would explain beside the effects that were found, the most
    /// probable first; empty where no explanation was looked for.
    pub fields: Vec<Field>,
    /// Residual of the drapes, fitted and held out, with the effects that were added or without
    /// any; null: none.
    pub residual: Option<Residual>,
    /// Drapes held out, before and after effects were added; null without any.
    pub holdout: Option<Holdout>,
    /// The same with the effects added; not there without.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "After"))]
    pub after: Option<After>,
}

/// An outline.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Outline {
    /// Its file in the manifest.
    pub file: String,
    /// What kind of file.
    pub kind: Kind,
    /// Its line of the manifest \[count\].
    pub line: usize,
    /// Name of the specimen.
    pub specimen: Option<String>,
    /// Face up; null: not known.
    pub face: Option<Face>,
    /// Name of the capture.
    pub capture: Option<String>,
    /// Which look at one drape that settles, from 1 on \[count\]; null: not said.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub observation: Option<u32>,
    /// What the drape is for.
    pub role: Role,
    /// Drape coefficient \[%\].
    pub drape_coefficient: f64,
    /// Folds \[count\].
    pub folds: usize,
    /// Harmonics 1 to 16 of the distance from the centroid over the bearing \[mm\].
    pub amplitudes_mm: [f64; 16],
    /// Mean distance from the centroid \[mm\].
    pub mean_radius_mm: f64,
}

/// How well outlines are known; a pairing of which there is none is not there.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Floor {
    /// Two captures of one drape.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Spread"))]
    pub captures: Option<Spread>,
    /// Two drops of one specimen with the same face up, told apart by their rims.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Spread"))]
    pub drops: Option<Spread>,
    /// Two faces of one specimen.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Spread"))]
    pub faces: Option<Spread>,
    /// Two specimens of one fabric.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Spread"))]
    pub specimens: Option<Spread>,
}

/// How far pairs of outlines lie apart.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Spread {
    /// Pairs \[count\].
    pub pairs: usize,
    /// Median of the root mean square distance, best translation \[mm\].
    pub median_mm: f64,
    /// Its 10 % quantile \[mm\].
    pub q10_mm: f64,
    /// Its 90 % quantile \[mm\].
    pub q90_mm: f64,
    /// Median at the best rotation too \[mm\].
    pub turned_median_mm: f64,
}

/// Drapes of one role and face.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Group {
    /// What the drape is for.
    pub role: Role,
    /// Face up; null: not known.
    pub face: Option<Face>,
    /// Which look at one drape that settles, from 1 on \[count\]; null: not said.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub observation: Option<u32>,
    /// Drapes \[count\].
    pub drapes: usize,
    /// Drapes that did not come to rest \[count\].
    pub not_at_rest: usize,
    /// Mean distance of measured and simulated outline \[mm\].
    pub rms_mm: Option<f64>,
    /// Its standard error \[mm\]; null of one drape.
    pub rms_se_mm: Option<f64>,
    /// Force of the springs that hold drapes over the hanging cloth's weight \[-\].
    pub springs_share: Option<f64>,
    /// Mean drape coefficient, measured \[%\].
    pub dc_measured: Option<f64>,
    /// The same, simulated \[%\].
    pub dc_simulated: Option<f64>,
    /// Standard error of their difference \[%\]; null of one drape.
    pub dc_difference_se: Option<f64>,
    /// Mean count of folds, measured \[count\].
    pub folds_measured: Option<f64>,
    /// The same, simulated \[count\].
    pub folds_simulated: Option<f64>,
}

/// An explanation.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Explanation {
    /// Names of its effects; `nothing`: the plain model alone; `else`: something that is not on the
    /// list.
    pub cause: Vec<&'static str>,
    /// Its probability; all add up to 1 \[-\].
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub probability: f64,
}

/// A field on the cloth.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Field {
    /// Of what.
    #[cfg_attr(test, schemars(extend("enum" = ["curvature", "weight", "bending"])))]
    pub of: &'static str,
    /// Unit of its numbers.
    #[cfg_attr(test, schemars(extend("enum" = [
        "1/m", "of the cloth's weight", "logarithm of a factor"
    ])))]
    pub unit: &'static str,
    /// Whether it is twenty times as probable as nothing.
    pub is_something: bool,
    /// Logarithm of how many times as probable the drapes are with it as without \[-\].
    pub ln_gain: f64,
    /// Standard deviation by which neighbouring nodes may differ \[`unit`\].
    pub neighbours: f64,
    /// Whether that is the least of what is tried: the same all over the cloth.
    pub is_even: bool,
    /// Its layers.
    pub layers: Vec<FieldLayer>,
    /// Where it is strongest, less two standard errors; null: no place is on the specimen.
    pub strongest: Option<Strongest>,
}

/// A layer of a field.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct FieldLayer {
    /// Of what: the curvature along weft or warp, weight, bending.
    pub of: FieldOf,
    /// Whether it turns over with the specimen, or acts alike with either face up (a curvature:
    /// upwards).
    pub layer: Layer,
    /// Five rows of five nodes: rows along the warp, in each along the weft \[`unit`\].
    pub nodes: [[f64; CURL_NODES]; CURL_NODES],
    /// Standard errors of these \[`unit`\].
    pub se: [[f64; CURL_NODES]; CURL_NODES],
}

/// A place on the cloth.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Strongest {
    /// Of what: the curvature along weft or warp, weight, bending.
    pub of: FieldOf,
    /// Whether it turns over with the specimen, or acts alike with either face up (a curvature:
    /// upwards).
    pub layer: Layer,
    /// Place along the warp from the middle \[mm\].
    pub warp_mm: f64,
    /// Place along the weft from the middle \[mm\].
    pub weft_mm: f64,
    /// The field there \[`unit`\].
    pub value: f64,
    /// Its standard error \[`unit`\].
    pub se: f64,
}

/// A residual.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Residual {
    /// Root mean square distance across the rim \[mm\].
    pub rms_mm: f64,
    /// Length along the rim over which the residual's autocorrelation falls to 1/e \[mm\].
    pub correlation_length_mm: f64,
}

/// Drapes held out.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Holdout {
    /// Mean distance of the outlines held out, plain model \[mm\].
    pub before_mm: f64,
    /// Drapes held out \[count\].
    pub drapes: usize,
    /// Median distance of two captures of one drape \[mm\]; only there with such.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "f64"))]
    pub floor_mm: Option<f64>,
    /// What effects changed; its fields stand in the place of this one.
    #[serde(flatten)]
    pub pairs: Option<Pairs>,
}

/// Drapes held out that came to rest before and after effects were added.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Pairs {
    /// Drapes that came to rest before and after \[count\].
    pub pairs: usize,
    /// Mean distance with the effects \[mm\].
    pub after_mm: f64,
    /// The first of these of scanned sheets once they are released \[mm\]; only there with such.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "f64"))]
    pub released_before_mm: Option<f64>,
    /// The second, likewise \[mm\].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "f64"))]
    pub released_after_mm: Option<f64>,
    /// Standard error of the fall \[mm\]; null of one drape.
    pub se_mm: Option<f64>,
    /// Mean size of the error of the drape coefficient before \[%\].
    pub dc_before: f64,
    /// The same after \[%\].
    pub dc_after: f64,
}

/// A fabric with the effects that were added.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct After {
    /// The fit.
    pub fit: Fit,
    /// Simulated drapes.
    pub drapes: Vec<Drape>,
    /// Drapes by role and face.
    pub groups: Vec<Group>,
}

#[cfg(test)]
#[test]
fn the_schema_of_a_calibration_is_that_of_the_type() {
    crate::base::schema::holds::<File<Fabric>>("calibration", "calibration.json", &[]);
}

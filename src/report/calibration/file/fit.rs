//! What calibration.json says of fits and of simulated drapes.

use serde::Serialize;

use crate::calibrate::cloth_file::EffectNumber;
use crate::calibrate::manifest::Role;
use crate::fabric::Stiffnesses;
use crate::inverse::Ended;

/// A drape beside its measurement: with `failed` and nothing else where it was not simulated.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(extend("oneOf" = [{ "required": ["failed"] }, { "required": [
    "rms_mm", "springs_share", "released_rms_mm", "drape_coefficient", "folds", "amplitudes_mm",
    "pose", "residual_by_bearing_mm"
] }])))]
pub(in crate::report::calibration) struct Drape {
    /// Its file in the manifest.
    pub file: String,
    /// What the drape is for.
    pub role: Role,
    /// Why there is no drape.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "String"))]
    pub failed: Option<String>,
    /// What was simulated; its fields stand in the place of this one.
    #[serde(flatten)]
    pub compared: Option<Compared>,
}

/// A simulated drape beside its measurement.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Compared {
    /// Root mean square distance of the outlines \[mm\].
    pub rms_mm: f64,
    /// Force of the springs that hold it over the hanging cloth's weight \[-\].
    pub springs_share: f64,
    /// Of a scanned sheet held out, the distance of the rims once it is released \[mm\].
    pub released_rms_mm: Option<f64>,
    /// Drape coefficient, simulated \[%\].
    pub drape_coefficient: f64,
    /// Folds, simulated \[count\].
    pub folds: usize,
    /// Harmonics 1 to 16 of the distance from the centroid over the bearing \[mm\].
    pub amplitudes_mm: [f64; 16],
    /// How it lies.
    pub pose: Pose,
    /// How far the measured outline lies outside the simulated one, 24 sectors from the warp
    /// towards the weft \[mm\].
    pub residual_by_bearing_mm: [f64; 24],
}

/// How a drape lies.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Pose {
    /// Plate's axis beside the origin of what was measured, x \[mm\].
    pub offset_x_mm: f64,
    /// The same, z \[mm\].
    pub offset_z_mm: f64,
    /// Bearing of the warp \[deg\].
    pub rotation_deg: f64,
    /// Scale over the one given \[-\].
    pub scale: f64,
    /// Specimen's centre beside the plate's axis along the warp \[mm\].
    pub specimen_x_mm: f64,
    /// The same along the weft \[mm\].
    pub specimen_z_mm: f64,
    /// How far beyond the outline the springs pull \[mm\].
    pub pull_mm: f64,
    /// Height of what was scanned over the simulated \[mm\].
    pub height_mm: f64,
    /// Lean of the scan towards x \[deg\].
    pub lean_x_deg: f64,
    /// Lean of the scan towards z \[deg\].
    pub lean_z_deg: f64,
    /// How far cloth lies beyond the drape's cells, in moves from them to finer ones; 0 where these
    /// are not known \[-\].
    pub cells: f64,
}

/// The fit.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Fit {
    /// The six stiffnesses.
    pub parameters: Stiffnesses<Parameter>,
    /// Numbers beyond them.
    pub effects: Vec<Fitted>,
    /// Root mean square residual in standard deviations \[-\].
    pub misfit: f64,
    /// Why it ended.
    pub ended: Ended,
    /// Drapes simulated \[count\].
    pub simulated_drapes: usize,
}

/// A stiffness.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Parameter {
    /// The value \[`unit`\].
    pub value: f64,
    /// Its unit.
    #[cfg_attr(test, schemars(extend("enum" = ["g/s^2", "g mm^2 s^-2 rad^-1"])))]
    pub unit: &'static str,
    /// 90 % interval \[`unit`\].
    pub interval90: [f64; 2],
    /// Share of what was uncertain that the drapes took away \[-\].
    pub shown: f64,
    /// Whether it is at the end of what is tried.
    pub at_limit: bool,
}

/// A number of an effect in a fit.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Fitted {
    /// The number; its fields stand in the place of this one.
    #[serde(flatten)]
    pub number: EffectNumber,
    /// Whether it is at the end of what is tried.
    pub at_limit: bool,
}

/// A number of an effect that was found.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(in crate::report::calibration) struct Found {
    /// The number; its fields stand in the place of this one.
    #[serde(flatten)]
    pub number: EffectNumber,
    /// Effects that these drapes cannot tell from it.
    pub group: Vec<&'static str>,
}

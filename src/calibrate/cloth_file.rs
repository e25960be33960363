//! A fabric with its effects as a file: what a calibration found, for `simulate --params` and
//! `estimate --effects`.
//!
//! In and out: a params.json ([`crate::fabric::params`]) with one field more, `effects`, a list of
//! `name`, `part`, `value`, `unit` and `interval90` for each number of an effect ([`EFFECTS`]);
//! signs are those of the specimen with its face up. Files without that field are fabrics without
//! effects. A name, a part or a unit that is not known is refused, not passed over.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::effect::{Acts, Cloth, EFFECTS, Effect, Number};
use super::fit::Fitted;
use super::manifest::Face;
use super::result::Doubt;
use crate::base::text;
use crate::base::units::{DENSITY_UNIT, KG_M2_PER_G_M2};
use crate::fabric::params::{self, NOTE, ParamsError};
use crate::fabric::{Fabric, STIFFNESSES, Stiffnesses, TABLE_2};
use crate::sim::Experiment;
use crate::sim::experiment::ExperimentError;

/// Version of the layout of the file.
const SCHEMA_VERSION: u32 = 1;

/// Why a file gives no fabric with effects.
#[derive(Debug, thiserror::Error)]
pub enum ClothFileError {
    /// It gives no fabric.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// Its effects cannot be used.
    #[error("{}: effects: {fault}", path.display())]
    Effects {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to write.
        fault: String,
    },
    /// With its effects nothing can be simulated.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// The fabric that `scan2params calibrate` found, with its effects: `simulate --params`,
/// `estimate --effects` and `export` read it.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ClothFile {
    /// Version of the layout \[-\]; raised when a field changes its meaning or goes.
    #[cfg_attr(test, schemars(extend("const" = SCHEMA_VERSION)))]
    schema_version: u32,
    /// The six stiffnesses.
    parameters: Stiffnesses<Parameter>,
    /// Areal density.
    density: Density,
    /// Effects beyond the seven parameters, a number each.
    effects: Vec<EffectNumber>,
    /// What the fabric is worth.
    verdict: Worth,
    /// Version of the program that wrote this.
    #[cfg_attr(test, schemars(extend("pattern" = r"^[0-9]+\.[0-9]+\.[0-9]+")))]
    version: &'static str,
    /// What the numbers are not.
    #[cfg_attr(test, schemars(extend("const" = NOTE)))]
    note: &'static str,
}

/// A stiffness.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Parameter {
    /// The value \[`unit`\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    value: f64,
    /// Its unit.
    #[cfg_attr(test, schemars(extend("enum" = ["g/s^2", "g mm^2 s^-2 rad^-1"])))]
    unit: &'static str,
    /// 90 % interval \[`unit`\].
    interval90: [f64; 2],
}

/// Areal density.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Density {
    /// The value \[g/m^2\].
    value: f64,
    /// Its unit.
    #[cfg_attr(test, schemars(extend("const" = DENSITY_UNIT)))]
    unit: &'static str,
    /// Whether the manifest gives it; else stiffnesses are those for the one assumed.
    known: bool,
}

impl Density {
    /// Of a density \[kg/m^2\].
    pub(crate) fn of(density_kg_m2: f64, known: bool) -> Self {
        Self { value: density_kg_m2 / KG_M2_PER_G_M2, unit: DENSITY_UNIT, known }
    }
}

/// A number of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EffectNumber {
    /// The effect.
    pub name: String,
    /// Which of its numbers.
    pub part: String,
    /// The value \[`unit`\].
    pub value: f64,
    /// Unit of value and interval.
    pub unit: String,
    /// 90 % interval \[`unit`\].
    #[serde(default)]
    pub interval90: [f64; 2],
}

/// What a calibrated fabric is worth.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Worth {
    /// Doubtful where there is a ground.
    #[cfg_attr(test, schemars(extend("enum" = ["reliable", "doubtful"])))]
    level: &'static str,
    /// Why it is doubtful.
    grounds: Vec<Ground>,
}

/// A ground.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Ground {
    /// Its level.
    #[cfg_attr(test, schemars(extend("const" = "doubtful")))]
    level: &'static str,
    /// Its name.
    #[cfg_attr(test, schemars(extend("enum" = [
        "calibration_undecided", "calibration_unexplained", "cells_too_coarse"
    ])))]
    code: &'static str,
    /// A sentence.
    text: String,
}

impl EffectNumber {
    /// A number and its interval, SI, in the unit of files.
    pub(crate) fn of(number: &Number, value: f64, interval90: [f64; 2]) -> Self {
        let (unit, size) = number.unit();
        Self {
            name: Effect::of(number).map_or("", |effect| effect.name).to_owned(),
            part: number.key.to_owned(),
            value: value / size,
            unit: unit.to_owned(),
            interval90: interval90.map(|end| end / size),
        }
    }

    /// The number that is meant, and its value, SI.
    fn known(&self) -> Result<(&'static Number, f64), String> {
        let Self { name, part, value, unit, .. } = self;
        let effect = Effect::named(name).ok_or_else(|| {
            let known: Vec<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
            format!("no effect `{name}`; known are {}", known.join(", "))
        })?;
        let number = effect.numbers.iter().find(|number| number.key == part).ok_or_else(|| {
            let known: Vec<&str> = effect.numbers.iter().map(|number| number.key).collect();
            format!("{name} has no part `{part}`; known are {}", known.join(", "))
        })?;
        let (meant, size) = number.unit();
        if unit != meant {
            return Err(format!("{name} {part} is in `{meant}`, not in `{unit}`"));
        }
        let ([least, most], value) = (number.limits, value * size);
        if !(least..=most).contains(&value) {
            let [least, most] = [least, most].map(|end| end / size);
            return Err(format!(
                "{name} {part}: give a number from {least:.3} to {most:.3} {unit}"
            ));
        }
        Ok((number, value))
    }
}

/// The text of a fit's fabric, with what makes it doubtful; without a known density its stiffnesses
/// are those for the one that is assumed.
#[must_use]
pub fn text(fitted: &Fitted, density_known: bool, doubts: &[Doubt]) -> Value {
    let values = fitted.cloth.fabric.to_paper_units();
    let si = fitted.cloth.fabric.in_si();
    let parameter = |k: usize| {
        let unit = values[k] / si[k];
        let interval90 = fitted.stiffnesses[k].interval90.map(|v| v * unit);
        Parameter { value: values[k], unit: TABLE_2[k].unit, interval90 }
    };
    let parameters: [Parameter; STIFFNESSES] = std::array::from_fn(parameter);
    // a sensor's edge is the scans', and nothing that can be simulated
    let effects = fitted.cloth.effects.iter().zip(&fitted.intervals90);
    let effects = effects.filter(|((number, _), _)| number.acts != Acts::Edge);
    let grounds = doubts.iter().map(|doubt| Ground {
        level: "doubtful",
        code: doubt.code,
        text: doubt.text.clone(),
    });
    json!(ClothFile {
        schema_version: SCHEMA_VERSION,
        parameters: parameters.into(),
        density: Density::of(fitted.cloth.fabric.density_kg_m2, density_known),
        effects: effects
            .map(|((number, value), ends)| EffectNumber::of(number, *value, *ends))
            .collect(),
        verdict: Worth {
            level: if doubts.is_empty() { "reliable" } else { "doubtful" },
            grounds: grounds.collect(),
        },
        version: env!("CARGO_PKG_VERSION"),
        note: NOTE,
    })
}

/// The fabric of a file with its effects; seven values that are given (paper's order and units) go
/// before the file's.
///
/// # Errors
/// [`ClothFileError`].
pub fn read(path: &Path, given: [Option<f64>; STIFFNESSES + 1]) -> Result<Cloth, ClothFileError> {
    Ok(Cloth { fabric: params::fabric(path, given)?, effects: read_effects(path)? })
}

/// The effects of a file alone.
///
/// # Errors
/// [`ClothFileError`].
pub fn read_effects(path: &Path) -> Result<Vec<(&'static Number, f64)>, ClothFileError> {
    let fault = |fault: String| ClothFileError::Effects { path: path.to_owned(), fault };
    let text = text::read(path).map_err(|error| fault(format!("cannot be read ({error})")))?;
    let file: Value =
        serde_json::from_slice(&text).map_err(|error| fault(format!("not JSON ({error})")))?;
    let Some(list) = file.get("effects").filter(|value| !value.is_null()) else {
        return Ok(Vec::new());
    };
    let list = list.as_array().ok_or_else(|| fault("no list; see docs/formats.md".to_owned()))?;
    let number =
        |entry: &Value| EffectNumber::deserialize(entry).map_err(|e| e.to_string())?.known();
    list.iter()
        .map(|entry| number(entry).map_err(|what| fault(format!("`{entry}`: {what}"))))
        .collect()
}

/// The standard experiment with the effects of a file, the specimen with this face up: what a
/// fabric is looked for in.
///
/// # Errors
/// [`ClothFileError`].
pub fn experiment(path: &Path, face: Face) -> Result<Experiment, ClothFileError> {
    // no fabric is read here: that is what is looked for
    let cloth = Cloth { effects: read_effects(path)?, ..Cloth::plain(Fabric::mean_knit()) };
    let experiment = cloth.experiment(&Experiment::default(), face);
    experiment.check()?;
    Ok(experiment)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::effect::SENSOR_EDGE;
    use crate::inverse::{Ended, RefinedStiffness};

    fn said(effects: &Value) -> Result<Vec<(&'static Number, f64)>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.params.json");
        std::fs::write(&path, json!({ "effects": effects }).to_string()).unwrap();
        read_effects(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn the_schema_of_a_calibrated_fabric_is_that_of_the_type() {
        let title = "FABRIC.params.json of calibrate";
        crate::base::schema::holds::<ClothFile>("calibrated-fabric", title, &[]);
    }

    #[test]
    fn what_is_written_is_read_again_and_a_sensors_edge_is_not_the_cloths() {
        let softening = &Effect::named("softening").unwrap().numbers[1];
        let effects = vec![(&SENSOR_EDGE.numbers[0], -5e-4), (softening, 1.5e-3)];
        let fabric = Fabric::mean_knit();
        let fitted = Fitted {
            cloth: Cloth { effects, ..Cloth::plain(fabric) },
            stiffnesses: std::array::from_fn(|k| {
                RefinedStiffness::of(k, 0.0, [0.1, 1.0], [-1.0, 1.0])
            }),
            intervals90: vec![[-6e-4, -4e-4], [1e-3, 2e-3]],
            at_limit: vec![false; 2],
            drapes: Vec::new(),
            cost: 1.0,
            misfit: 1.0,
            ended: Ended::Converged,
            simulated: 1,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.params.json");
        std::fs::write(&path, text(&fitted, true, &[]).to_string()).unwrap();
        let cloth = read(&path, [None; STIFFNESSES + 1]).unwrap();
        let [(number, value)] = cloth.effects[..] else { panic!("{:?}", cloth.effects) };
        assert_eq!(number, softening);
        assert!((value - 1.5e-3).abs() < 1e-15);
        let off = cloth.ln().into_iter().zip(fitted.cloth.ln()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12);
    }

    #[test]
    fn effects_are_read_in_their_units_and_what_is_not_known_is_refused() {
        let of = |name: &str, part: &str, value: f64, unit: &str| json!([{ "name": name, "part": part, "value": value, "unit": unit }]);
        let read = said(&of("softening", "warp", 1.5, "mm")).unwrap();
        assert_eq!((read.len(), read[0].0.key), (1, "warp"));
        assert!((read[0].1 - 1.5e-3).abs() < 1e-15);
        assert_eq!(said(&Value::Null).unwrap().len(), 0);
        for (entry, part) in [
            (of("stiffening", "warp", 1.0, "mm"), "no effect `stiffening`; known are natural"),
            (of("softening", "wrap", 1.0, "mm"), "no part `wrap`; known are weft, warp, bias"),
            (of("softening", "warp", 1.0, "m"), "is in `mm`, not in `m`"),
            (of("softening", "warp", 99.0, "mm"), "give a number from 0.000 to 12.000 mm"),
            (json!([{ "name": "softening" }]), "missing field `part`"),
            (json!({ "softening": 1.0 }), "no list"),
        ] {
            let error = said(&entry).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}

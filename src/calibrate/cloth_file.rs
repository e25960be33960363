//! A fabric with its effects as a file: what a calibration found, for `simulate --params` and
//! `estimate --effects`.
//!
//! In and out: a params.json ([`crate::fabric::params`]) with one field more, `effects`, a list of
//! `name`, `part`, `value`, `unit` and `interval90` for each number of an effect ([`EFFECTS`]);
//! signs are those of the specimen with its face up. Files without that field are fabrics without
//! effects. A name, a part or a unit that is not known is refused, not passed over.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::effect::{Acts, Cloth, EFFECTS, Effect, Number};
use super::fit::Fitted;
use super::manifest::Face;
use super::result::Doubt;
use crate::base::text;
use crate::base::units::{DENSITY_UNIT, KG_M2_PER_G_M2};
use crate::fabric::params::{self, ParamsError};
use crate::fabric::{Fabric, STIFFNESSES, TABLE_2};
use crate::sim::Experiment;
use crate::sim::experiment::ExperimentError;

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

fn ground(doubt: &Doubt) -> Value {
    json!({ "level": "doubtful", "code": doubt.code, "text": doubt.text })
}

/// The text of a fit's fabric, with what makes it doubtful; without a known density its stiffnesses
/// are those for the one that is assumed.
#[must_use]
pub fn text(fitted: &Fitted, density_known: bool, doubts: &[Doubt]) -> Value {
    let values = fitted.cloth.fabric.to_paper_units();
    let si = fitted.cloth.fabric.in_si();
    let parameters: Map<String, Value> = (0..STIFFNESSES)
        .map(|k| {
            let unit = values[k] / si[k];
            let value = json!({
                "value": values[k],
                "unit": TABLE_2[k].unit,
                "interval90": fitted.stiffnesses[k].interval90.map(|v| v * unit),
            });
            (TABLE_2[k].key.to_owned(), value)
        })
        .collect();
    let effect = |((number, value), ends): (&(&Number, f64), &[f64; 2])| {
        let (unit, size) = number.unit();
        json!({
            "name": Effect::of(number).map_or("", |effect| effect.name),
            "part": number.key,
            "value": value / size,
            "unit": unit,
            "interval90": ends.map(|end| end / size),
        })
    };
    // a sensor's edge is the scans', and nothing that can be simulated
    let effects = fitted.cloth.effects.iter().zip(&fitted.intervals90);
    let effects = effects.filter(|((number, _), _)| number.acts != Acts::Edge).map(effect);
    json!({
        "schema_version": 1,
        "parameters": parameters,
        "density": {
            "value": fitted.cloth.fabric.density_kg_m2 / KG_M2_PER_G_M2,
            "unit": DENSITY_UNIT,
            "known": density_known,
        },
        "effects": effects.collect::<Vec<_>>(),
        "verdict": {
            "level": if doubts.is_empty() { "reliable" } else { "doubtful" },
            "grounds": doubts.iter().map(ground).collect::<Vec<_>>(),
        },
        "version": env!("CARGO_PKG_VERSION"),
        "note": "simulation parameters, not measured mechanical properties",
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
    list.iter().map(|entry| number_of(entry).map_err(fault)).collect()
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

/// One number of an effect, SI.
fn number_of(entry: &Value) -> Result<(&'static Number, f64), String> {
    let word = |key: &str| {
        let found = entry.get(key).and_then(Value::as_str);
        found.ok_or_else(|| format!("`{entry}` has no `{key}`"))
    };
    let (name, part, unit) = (word("name")?, word("part")?, word("unit")?);
    let effect = Effect::named(name).ok_or_else(|| {
        let known: Vec<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
        format!("no effect `{name}`; known are {}", known.join(", "))
    })?;
    let number = effect.numbers.iter().find(|number| number.key == part).ok_or_else(|| {
        let known: Vec<&str> = effect.numbers.iter().map(|number| number.key).collect();
        format!("{name} has no part `{part}`; known are {}", known.join(", "))
    })?;
    if unit != number.unit().0 {
        return Err(format!("{name} {part} is in `{}`, not in `{unit}`", number.unit().0));
    }
    let value = entry.get("value").and_then(Value::as_f64).map(|value| value * number.unit().1);
    let [least, most] = number.limits;
    let value = value.filter(|value| (least..=most).contains(value)).ok_or_else(|| {
        let [least, most] = [least, most].map(|end| end / number.unit().1);
        format!("{name} {part}: give a number from {least:.3} to {most:.3} {unit}")
    })?;
    Ok((number, value))
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
            (json!([{ "name": "softening" }]), "has no `part`"),
            (json!({ "softening": 1.0 }), "no list"),
        ] {
            let error = said(&entry).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}

//! Measured mechanics of a fabric: the physics file of U3M 1.1, as Browzwear's Fabric Analyzer
//! (FAB) writes it.
//!
//! In: a `.u3m`, which names its physics file, or that file itself (JSON). It holds values that the
//! tester gives (bend \[dyn cm\], stretch and shear \[N/m\], mass \[g/m^2\]) and the raw series,
//! pairs of a distance \[cm\] and a force \[gf\]. Out: [`Measured`], each stiffness as given and as
//! [`recompute`] has it from the series. Length is taken for the warp, width for the weft.
//!
//! Source: the schema, the two examples and the two descriptions in `u3m1.1/physics` of
//! `github.com/vizoogmbh/u3m`. They name the tests and no law. [`recompute`] has the laws used here
//! and how far they agree with the examples.
//!
//! Fails for a file that is neither, for series of fewer than two pairs, and for numbers that no
//! test can have. A value that the file does not have stays open.

mod loop_test;
pub mod recompute;
mod series;
mod show;
mod write;

use std::path::{Component, Path, PathBuf};

use serde_json::Value;

use crate::base::text;
use crate::base::units::KG_M2_PER_G_M2;
use crate::exchange::units::NM_PER_DYN_CM;
use crate::fabric::{STIFFNESSES, TABLE_2};
use recompute::Recomputed;
use series::{M_PER_CM, N_PER_GF};

pub use series::{Part, Strip, Test};
pub use write::Take;

/// Given and recomputed values that differ by more than this share get a warning.
pub const DISAGREES: f64 = 0.2;

/// Why a file of a tester cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct FabError {
    path: PathBuf,
    fault: String,
}

/// A stiffness as the tester gives it and as its series have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stiffness {
    /// Name in files and options.
    pub key: &'static str,
    /// As given, SI.
    pub given: Option<f64>,
    /// From the raw series, SI, or why there is none.
    pub recomputed: Result<Recomputed, String>,
}

impl Stiffness {
    /// How much larger the recomputed value is, as a share of the given one.
    #[must_use]
    pub fn difference(&self) -> Option<f64> {
        Some(self.recomputed.as_ref().ok()?.value / self.given? - 1.0)
    }
}

/// What a tester says of a fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The physics file.
    pub path: PathBuf,
    /// The fabric's name; empty where there is none.
    pub name: String,
    /// Serial number of the tester, where series name one.
    pub tester: Option<i64>,
    /// The stiffnesses in the paper's order.
    pub stiffnesses: [Stiffness; STIFFNESSES],
    /// Areal density \[kg/m^2\].
    pub density_kg_m2: Option<f64>,
    /// Thickness \[mm\], for information.
    pub thickness_mm: Option<f64>,
    /// What the program that wrote the file warns of.
    pub warnings: Vec<String>,
}

/// Whether a file is one that [`read`] takes: a U3M, or JSON with a tester's blocks.
#[must_use]
pub fn is_one(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if ending == "u3m" || ending == "u3ma" {
        return true;
    }
    let content = text::read(path).ok().and_then(|text| serde_json::from_slice(&text).ok());
    content.is_some_and(|content: Value| {
        content.get("raw_data").is_some() || content.pointer("/custom/browzwear").is_some()
    })
}

/// Reads what a tester says of a fabric.
///
/// # Errors
/// A file that cannot be read, is no U3M and no physics file, or has impossible numbers.
pub fn read(path: &Path) -> Result<Measured, FabError> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if ending == "u3ma" {
        return Err(fault(path, "an archive; unpack it (it is a zip) and give the .u3m in it"));
    }
    let content = json(path)?;
    if content.get("material").is_none() {
        return physics(path, &content, None);
    }
    let named = content.pointer("/material/physics/devices/fab").and_then(Value::as_str);
    let Some(named) = named.map(Path::new) else {
        let why = "names no physics file (material/physics/devices/fab): it has no measured \
                   mechanics; give one with them";
        return Err(fault(path, why));
    };
    if named.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(fault(path, format!("names {}, outside of its folder", named.display())));
    }
    let weight = content.pointer("/material/physics/weight").and_then(number);
    let companion = path.with_file_name("").join(named);
    physics(&companion, &json(&companion)?, weight)
}

fn fault(path: &Path, fault: impl Into<String>) -> FabError {
    FabError { path: path.to_owned(), fault: fault.into() }
}

fn json(path: &Path) -> Result<Value, FabError> {
    let text =
        text::read(path).map_err(|error| fault(path, format!("cannot be read ({error})")))?;
    serde_json::from_slice(&text).map_err(|error| fault(path, format!("not JSON ({error})")))
}

/// A number, or a text that is one: files have both.
fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.trim().parse().ok())
}

fn physics(path: &Path, content: &Value, weight_g_m2: Option<f64>) -> Result<Measured, FabError> {
    let given_block = content.pointer("/custom/browzwear");
    let raw = content.get("raw_data").filter(|raw| raw.is_object());
    if given_block.is_none() && raw.is_none() {
        let why = "no physics file of U3M 1.1: it has neither raw_data nor custom.browzwear";
        return Err(fault(path, why));
    }
    let of = |pointer: &str| given_block.and_then(|block| block.pointer(pointer));
    let positive = |pointer: &str, unit: f64| -> Result<Option<f64>, FabError> {
        let Some(value) = of(pointer) else { return Ok(None) };
        match number(value) {
            Some(value) if value.is_finite() && value > 0.0 => Ok(Some(value * unit)),
            _ => Err(fault(path, format!("custom.browzwear{pointer} is {value}, not above 0"))),
        }
    };
    let given = [
        positive("/stretch/width", 1.0)?,
        positive("/stretch/length", 1.0)?,
        positive("/shear", 1.0)?,
        positive("/bend/width", NM_PER_DYN_CM)?,
        positive("/bend/length", NM_PER_DYN_CM)?,
        None,
    ];
    let strip = |name: &str| match raw.and_then(|raw| raw.get(name)) {
        Some(block) => strip(path, name, block),
        None => Ok(Strip::default()),
    };
    let recomputed = recompute::all(&strip("W")?, &strip("L")?, &strip("B")?);
    let stiffnesses = std::array::from_fn(|k| Stiffness {
        key: TABLE_2[k].key,
        given: given[k],
        recomputed: recomputed[k].clone(),
    });
    let mass = raw.and_then(|raw| raw.get("M")).and_then(number).filter(|mass| *mass > 0.0);
    let mass = positive("/mass", 1.0)?.or(mass).or(weight_g_m2);
    let warned = raw.and_then(|raw| raw.get("warnings")).and_then(Value::as_object);
    let warned = warned.into_iter().flatten();
    Ok(Measured {
        path: path.to_owned(),
        name: of("/name").and_then(Value::as_str).unwrap_or_default().to_owned(),
        tester: raw.and_then(|raw| raw.pointer("/L/hwSerialNumber")).and_then(Value::as_i64),
        stiffnesses,
        density_kg_m2: mass.map(|mass| mass * KG_M2_PER_G_M2),
        thickness_mm: positive("/thickness", 1.0)?,
        warnings: warned
            .map(|(of, what)| format!("{of}: {}", what.as_str().unwrap_or_default()))
            .collect(),
    })
}

fn strip(path: &Path, name: &str, block: &Value) -> Result<Strip, FabError> {
    let test = |key: &str| {
        let place = format!("raw_data.{name}.{key}");
        block.get(key).map(|block| test(path, &place, block)).transpose()
    };
    Ok(Strip { up_2cm: test("U1")?, stretch_8cm: test("S2")? })
}

fn test(path: &Path, place: &str, block: &Value) -> Result<Test, FabError> {
    let length = |key: &str| match block.get(key).and_then(number) {
        Some(cm) if (0.1..100.0).contains(&cm) => Ok(cm * M_PER_CM),
        _ => Err(fault(path, format!("{place}.{key} is no length from 0.1 to 100 cm"))),
    };
    let (length_m, width_m) = (length("length")?, length("width")?);
    let parts = block.get("samplesTree").and_then(Value::as_array);
    let parts = parts.ok_or_else(|| fault(path, format!("{place} has no samplesTree")))?;
    let part = |(k, part): (usize, &Value)| {
        let numbers: Option<Vec<f64>> =
            part.as_array().and_then(|part| part.iter().map(number).collect());
        let pairs = numbers.as_deref().map(<[f64]>::as_chunks::<2>);
        match pairs {
            Some((pairs, [])) if pairs.len() > 1 => Ok(Part {
                pairs: pairs.iter().map(|[cm, gf]| [cm * M_PER_CM, gf * N_PER_GF]).collect(),
            }),
            _ => {
                let why = "is no list of pairs of distance and force";
                Err(fault(path, format!("{place}.samplesTree[{k}] {why}")))
            }
        }
    };
    let parts = parts.iter().enumerate().map(part).collect::<Result<_, _>>()?;
    Ok(Test { length_m, width_m, parts })
}

#[cfg(test)]
mod tests;

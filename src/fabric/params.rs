//! The seven parameters of a fabric from a params.json, as `estimate` writes it and
//! as the fixtures hold their truth.
//!
//! In: a path. Out: the fabric (SI), and of a whole file ([`read`]) its intervals (the paper's
//! units) and its verdict. Values are in the paper's units; where a file names a unit beside a
//! value, it must be that one. Fails where the file cannot be read, is not JSON, lacks a number
//! or names another unit.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::range::{STIFFNESSES, TABLE_2};
use super::values::Fabric;
use crate::base::text;

/// Why a params.json gives no fabric.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ParamsError {
    path: PathBuf,
    fault: String,
}

/// What a params.json says of a fabric and of how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// The fabric.
    pub fabric: Fabric,
    /// 90 % interval of each stiffness, in the paper's order and units; `None` where the file has
    /// none.
    pub interval90: [Option<[f64; 2]>; STIFFNESSES],
    /// The verdict as the file has it, an object with `level` and `grounds`; `None` of a truth.
    pub verdict: Option<Value>,
    /// The scan that it was found from, as the file names it.
    pub input: Option<String>,
    /// The name of the model that found it.
    pub model: Option<String>,
}

/// The line under which every result goes out.
pub const NOTE: &str = "simulation parameters, not measured mechanical properties";
/// The word for a result that is not to be used, in the files of `estimate`.
pub const DO_NOT_USE: &str = "do_not_use";

impl Params {
    /// A fabric of which nothing else is known.
    #[must_use]
    pub fn of(fabric: Fabric) -> Self {
        let interval90 = [None; STIFFNESSES];
        Self { fabric, interval90, verdict: None, input: None, model: None }
    }

    /// The verdict's level, in the word that files use.
    #[must_use]
    pub fn level(&self) -> Option<&str> {
        self.verdict.as_ref()?.pointer("/level")?.as_str()
    }

    /// Whether the file says that the result is not to be used.
    #[must_use]
    pub fn is_not_to_be_used(&self) -> bool {
        self.level() == Some(DO_NOT_USE)
    }

    /// The texts of the verdict's grounds, worst first.
    #[must_use]
    pub fn grounds(&self) -> Vec<&str> {
        let grounds = self.verdict.as_ref().and_then(|verdict| verdict.pointer("/grounds"));
        let grounds = grounds.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        grounds.iter().filter_map(|ground| ground.pointer("/text")?.as_str()).collect()
    }
}

/// A params.json with its intervals and its verdict.
///
/// # Errors
/// As [`fabric`].
pub fn read(path: &Path) -> Result<Params, ParamsError> {
    let file = File::open(path)?;
    let mut interval90 = [None; STIFFNESSES];
    for (interval, range) in interval90.iter_mut().zip(&TABLE_2) {
        let end = |k: usize| {
            let pointer = format!("/parameters/{}/interval90/{k}", range.key);
            file.content.pointer(&pointer)?.as_f64()
        };
        *interval = end(0).zip(end(1)).map(|(low, high)| [low, high]);
    }
    let text = |pointer: &str| Some(file.content.pointer(pointer)?.as_str()?.to_owned());
    Ok(Params {
        fabric: file.fabric([None; STIFFNESSES + 1])?,
        interval90,
        verdict: file.content.get("verdict").filter(|verdict| verdict.is_object()).cloned(),
        input: text("/input"),
        model: text("/model/id"),
    })
}

/// The fabric of a params.json; values that are given (paper's order and units) go
/// before the file's.
///
/// # Errors
/// A file that cannot be read, is not JSON, lacks a value that is not given, or names another unit.
pub fn fabric(path: &Path, given: [Option<f64>; STIFFNESSES + 1]) -> Result<Fabric, ParamsError> {
    File::open(path)?.fabric(given)
}

/// A params.json that was read as JSON.
struct File<'a> {
    path: &'a Path,
    content: Value,
}

impl<'a> File<'a> {
    fn open(path: &'a Path) -> Result<Self, ParamsError> {
        let fault = |fault: String| ParamsError { path: path.to_owned(), fault };
        let text = text::read(path).map_err(|error| fault(format!("cannot be read ({error})")))?;
        let content = serde_json::from_slice(&text).map_err(|error| {
            fault(format!("not JSON ({error}); give a params.json as `estimate` writes it"))
        })?;
        Ok(Self { path, content })
    }

    fn fabric(&self, given: [Option<f64>; STIFFNESSES + 1]) -> Result<Fabric, ParamsError> {
        let fault = |fault: String| ParamsError { path: self.path.to_owned(), fault };
        let mut values = [0.0; STIFFNESSES + 1];
        for (i, value) in values.iter_mut().enumerate() {
            if let Some(given) = given[i] {
                *value = given;
                continue;
            }
            let place = match TABLE_2.get(i).filter(|_| i < STIFFNESSES) {
                Some(range) => format!("/parameters/{}", range.key),
                None => "/density".to_owned(),
            };
            let of = |key: &str| self.content.pointer(&format!("{place}/{key}"));
            *value = of("value").and_then(Value::as_f64).ok_or_else(|| {
                fault(format!(
                    "no number at {place}/value; give a params.json as `estimate` writes it"
                ))
            })?;
            let (said, meant) = (of("unit").and_then(Value::as_str), TABLE_2[i].unit);
            if let Some(said) = said.filter(|said| *said != meant) {
                let why = format!("{place} is in {said}; give it in {meant}");
                return Err(fault(why));
            }
        }
        Ok(Fabric::from_paper_units(values))
    }
}

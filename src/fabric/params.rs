//! The seven parameters of a fabric from a params.json, as `estimate` writes it and
//! as the fixtures hold their truth.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::range::{STIFFNESSES, TABLE_2};
use super::values::Fabric;

/// Why a params.json gives no fabric.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ParamsError {
    path: PathBuf,
    fault: String,
}

/// The fabric of a params.json; values that are given (paper's order and units) go
/// before the file's.
///
/// # Errors
/// A file that cannot be read, is no JSON, or lacks a value that is not given.
pub fn fabric(path: &Path, given: [Option<f64>; STIFFNESSES + 1]) -> Result<Fabric, ParamsError> {
    let fault = |fault: String| ParamsError { path: path.to_owned(), fault };
    let text = std::fs::read(path).map_err(|error| fault(format!("cannot be read ({error})")))?;
    let file: Value =
        serde_json::from_slice(&text).map_err(|error| fault(format!("no JSON ({error})")))?;
    let mut values = [0.0; STIFFNESSES + 1];
    for (i, value) in values.iter_mut().enumerate() {
        let pointer = match TABLE_2.get(i).filter(|_| i < STIFFNESSES) {
            Some(range) => format!("/parameters/{}/value", range.key),
            None => "/density/value".to_owned(),
        };
        let found = given[i].or_else(|| file.pointer(&pointer).and_then(Value::as_f64));
        *value = found.ok_or_else(|| {
            fault(format!("no number at {pointer}; give a params.json as `estimate` writes it"))
        })?;
    }
    Ok(Fabric::from_paper_units(values))
}

//! params.json files of drapes, as `estimate --out` and `batch` write them.
//!
//! In: paths of files, and folders that are looked through for `*.params.json` (hidden entries and
//! `*.truth.*` are passed over). Out: what combining needs of each. Fails with the file and what it
//! lacks.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::drape::Drape;
use super::error::CombineError;
use crate::base::text;
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::io::boundary_csv;
use crate::job::verdict::Level;
use crate::sim::rim_nodes;

/// The files that are meant: each file itself, each folder's `*.params.json`, in the order of their
/// paths and each once.
///
/// # Errors
/// When a folder cannot be listed, or holds none.
pub fn files(given: &[PathBuf]) -> Result<Vec<PathBuf>, CombineError> {
    let mut all = Vec::new();
    for path in given {
        if !path.is_dir() {
            all.push(path.clone());
            continue;
        }
        let before = all.len();
        list(path, &mut all).map_err(|source| CombineError::Io { path: path.clone(), source })?;
        if all.len() == before {
            return Err(CombineError::NoParams { folder: path.clone() });
        }
    }
    let mut seen = std::collections::HashSet::new();
    all.retain(|path| seen.insert(std::fs::canonicalize(path).unwrap_or_else(|_| path.clone())));
    Ok(all)
}

fn list(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        if entry.file_type()?.is_dir() {
            list(&entry.path(), found)?;
        } else if name.ends_with(".params.json") && !name.ends_with(".truth.params.json") {
            found.push(entry.path());
        }
    }
    Ok(())
}

/// Reads one.
///
/// # Errors
/// When it cannot be read, is not JSON, or is not what `estimate` writes.
pub fn read(path: &Path) -> Result<Drape, CombineError> {
    let text =
        text::read(path).map_err(|source| CombineError::Io { path: path.to_owned(), source })?;
    let fault = |what: String| CombineError::NotParams { path: path.to_owned(), what };
    let json: Value =
        serde_json::from_slice(&text).map_err(|e| fault(format!("not JSON ({e})")))?;
    if json.get("drapes").is_some() {
        return Err(fault("holds drapes that are combined already".to_owned()));
    }
    let field = Fields { json: &json, fault: &fault };
    let mut values = [0.0; STIFFNESSES];
    let mut interval90 = [[0.0; 2]; STIFFNESSES];
    let mut in_range = [true; STIFFNESSES];
    for (k, range) in TABLE_2.iter().take(STIFFNESSES).enumerate() {
        let at = |part: &str| format!("/parameters/{}/{part}", range.key);
        values[k] = field.positive(&at("value"))?;
        interval90[k] =
            [field.positive(&at("interval90/0"))?, field.positive(&at("interval90/1"))?];
        in_range[k] = json.pointer(&at("in_range")).and_then(Value::as_bool).unwrap_or(true);
    }
    let text_at = |pointer: &str| json.pointer(pointer).and_then(Value::as_str).map(str::to_owned);
    let taken = json.pointer("/refinement/taken").and_then(Value::as_bool).unwrap_or(false);
    let with = json.pointer("/refinement/with").and_then(Value::as_array).filter(|_| taken);
    Ok(Drape {
        file: path.to_owned(),
        input: field.text("/input")?,
        values,
        interval90,
        in_range,
        density_g_m2: field.positive("/density/value")?,
        folds: folds(path, &json),
        verdict: field.text("/verdict/level")?,
        grounds: grounds(&json),
        refined: taken,
        with: with
            .into_iter()
            .flatten()
            .filter_map(|scan| scan["file"].as_str().map(str::to_owned))
            .collect(),
        oriented: text_at("/orientation").as_deref() == Some("given"),
        rim_error_mm: json.pointer("/tied_drape/rim_mean_mm").and_then(Value::as_f64),
        model: [field.text("/model/id")?, field.text("/model/sha256")?],
        numerics: json
            .pointer("/simulator/numerics_version")
            .and_then(Value::as_u64)
            .ok_or_else(|| fault("no number at /simulator/numerics_version".to_owned()))?,
        version: field.text("/version")?,
    })
}

/// Folds of the scanned rim: as the file says, or counted on the rim's file next to it.
fn folds(path: &Path, json: &Value) -> Option<usize> {
    let said = ["/boundary/folds"];
    let said = said.iter().find_map(|pointer| json.pointer(pointer).and_then(Value::as_u64));
    if let Some(folds) = said {
        return usize::try_from(folds).ok();
    }
    let name = path.file_name()?.to_str()?.strip_suffix(".params.json")?;
    let rim = boundary_csv::read(path.with_file_name(format!("{name}.boundary.csv"))).ok()?;
    Some(rim_nodes(&rim))
}

fn grounds(json: &Value) -> Vec<String> {
    let mut codes: Vec<String> = Vec::new();
    for ground in json.pointer("/verdict/grounds").and_then(Value::as_array).into_iter().flatten() {
        let against = ground["level"].as_str() != Some(Level::Reliable.name());
        if let Some(code) = ground["code"].as_str().filter(|_| against)
            && !codes.iter().any(|known| known == code)
        {
            codes.push(code.to_owned());
        }
    }
    codes
}

struct Fields<'a, F> {
    json: &'a Value,
    fault: &'a F,
}

impl<F: Fn(String) -> CombineError> Fields<'_, F> {
    fn text(&self, pointer: &str) -> Result<String, CombineError> {
        let found = self.json.pointer(pointer).and_then(Value::as_str);
        found.map(str::to_owned).ok_or_else(|| (self.fault)(format!("no text at {pointer}")))
    }

    fn positive(&self, pointer: &str) -> Result<f64, CombineError> {
        let found = self.json.pointer(pointer).and_then(Value::as_f64);
        let found = found.filter(|v| v.is_finite() && *v > 0.0);
        found.ok_or_else(|| (self.fault)(format!("no positive number at {pointer}")))
    }
}

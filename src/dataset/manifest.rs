//! What a folder of drapes was made with, so that nothing else is mixed into it. Its files say so
//! too, in their metadata ([`Manifest::described`]).
//!
//! Schema 1 had rims as bytes, and `at_rest` true for what is `converged` in schema 2. Folders of
//! both are read; one of schema 1 is not continued.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::columns::FRAME;
use super::error::GenerateError;
use super::options::GenerateOptions;
use super::walk::Walks;
use crate::fabric::PARAMETERS;
use crate::io::part::Part;
use crate::sim::NUMERICS_VERSION;

/// Name of the manifest in its folder.
pub const MANIFEST_FILE: &str = "manifest.json";
const SCHEMA: &str = "scan2params/dataset/2";
/// Of folders that are read but not continued.
const OLDER_SCHEMAS: [&str; 1] = ["scan2params/dataset/1"];
/// This program, with its version.
const PROGRAM: &str = concat!("scan2params ", env!("CARGO_PKG_VERSION"));
/// Begins each key of a file's metadata.
const KEY: &str = "scan2params.";

/// What a folder of `scan2params generate` was made with: what decides the bytes of a dataset.
/// Thread count and shard do not. Written once; another run with other options is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// What the file is. Version 1, in older folders: `boundary_mm` is 2928 bytes, 732
    /// little-endian floats; `at_rest` is what version 2 calls `converged`.
    #[cfg_attr(test, schemars(extend("enum" = [OLDER_SCHEMAS[0], SCHEMA])))]
    pub schema: String,
    /// Version of the program that began the folder; not compared.
    pub program: String,
    /// Version of the simulator's numerics \[-\].
    pub simulator_numerics: u32,
    /// The simulator's options in SI units; src/sim has names and units.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub simulator: serde_json::Value,
    /// Name of the prior.
    pub prior: String,
    /// SHA-256 of the prior's file, in hexadecimal.
    #[cfg_attr(test, schemars(extend("pattern" = "^[0-9a-f]{64}$")))]
    pub prior_sha256: String,
    /// Lower and upper ends of the prior's box: S^u, S^v, H \[g/s^2\], B^u, B^v, B^h
    /// \[g mm^2 s^-2 rad^-1\], density \[g/m^2\].
    pub prior_limits: [[f64; PARAMETERS]; 2],
    /// Seed of the run \[-\].
    pub seed: u64,
    /// Drops of each fabric \[count\].
    pub drops_per_fabric: u64,
    /// Samples per file \[count\].
    pub chunk_rows: u64,
    /// Whether every sheet fell canonically; not there where each fell in its own way.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub canonical: bool,
    /// How sheets were continued from sample to sample; absent if each was dropped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Walks"))]
    pub walks: Option<Walks>,
    /// Samples asked for, the largest of all runs on the folder \[count\]; not compared.
    pub count: u64,
}

impl Manifest {
    pub(super) fn new(options: &GenerateOptions) -> Self {
        Self {
            schema: SCHEMA.into(),
            program: PROGRAM.into(),
            simulator_numerics: NUMERICS_VERSION,
            simulator: options.simulator.clone(),
            prior: options.prior.name().into(),
            prior_sha256: options.prior.sha256().into(),
            prior_limits: options.prior.limits(),
            seed: options.seed,
            drops_per_fabric: options.drops_per_fabric,
            chunk_rows: options.chunk_rows,
            canonical: options.canonical,
            walks: options.walks,
            count: options.count,
        }
    }

    /// Reads the manifest of a folder.
    ///
    /// # Errors
    /// When there is none, or it is not one.
    pub fn read(folder: &Path) -> Result<Self, GenerateError> {
        let path = folder.join(MANIFEST_FILE);
        let text = std::fs::read_to_string(&path).map_err(GenerateError::io(&path))?;
        let manifest: Self = serde_json::from_str(&text).map_err(|error| {
            GenerateError::Manifest { path: path.clone(), fault: error.to_string() }
        })?;
        if manifest.schema != SCHEMA && !manifest.is_older() {
            let fault = format!("schema `{}` is not known to {PROGRAM}", manifest.schema);
            return Err(GenerateError::Manifest { path, fault });
        }
        Ok(manifest)
    }

    /// Whether the folder has an older schema than the one that is written now.
    #[must_use]
    pub fn is_older(&self) -> bool {
        OLDER_SCHEMAS.contains(&self.schema.as_str())
    }

    /// The flags of `generate` that make the same drapes, without folder and count. Those that a
    /// simulator other than the program's would need are not among them.
    #[must_use]
    pub fn flags(&self) -> String {
        let mut flags = format!("--prior {} --seed {}", self.prior, self.seed);
        if self.drops_per_fabric != 1 {
            flags += &format!(" --drops-per-fabric {}", self.drops_per_fabric);
        }
        if let Some(walks) = self.walks {
            flags += &format!(" --walk={}", walks.rows);
        }
        if self.canonical {
            flags += " --canonical";
        }
        for (flag, key) in [("--energy-drop", "energy_drop"), ("--vertices", "vertices")] {
            if let Some(value) = self.simulator.get(key) {
                flags += &format!(" {flag} {value}");
            }
        }
        flags
    }

    /// What the metadata of each file says. Nothing in it depends on the count, so that a folder
    /// can grow without its complete files being made anew.
    pub(super) fn described(&self) -> impl Iterator<Item = (String, String)> {
        let described = [
            ("schema", self.schema.clone()),
            ("program", PROGRAM.to_owned()),
            ("simulator_numerics", self.simulator_numerics.to_string()),
            ("command", format!("scan2params generate {}", self.flags())),
            ("prior", self.prior.clone()),
            ("prior_sha256", self.prior_sha256.clone()),
            ("seed", self.seed.to_string()),
            ("simulator", self.simulator.to_string()),
            ("frame", FRAME.to_owned()),
            ("units", "of each column: `unit` in its field's metadata".to_owned()),
        ];
        described.into_iter().map(|(key, value)| (format!("{KEY}{key}"), value))
    }

    /// Begins a folder, or makes sure that it was begun with the same options.
    pub(super) fn settle(mut self, folder: &Path) -> Result<Self, GenerateError> {
        std::fs::create_dir_all(folder).map_err(GenerateError::io(folder))?;
        if folder.join(MANIFEST_FILE).exists() {
            let found = Self::read(folder)?;
            if found.is_older() {
                let Self { schema, program, .. } = found;
                return Err(GenerateError::Older { folder: folder.into(), schema, program });
            }
            let differing = self.differences(&found);
            if !differing.is_empty() {
                return Err(GenerateError::OtherOptions { folder: folder.into(), differing });
            }
            self.count = self.count.max(found.count);
            self.program.clone_from(&found.program);
            if self == found {
                return Ok(self);
            }
        }
        self.write(folder)?;
        Ok(self)
    }

    fn differences(&self, found: &Self) -> Vec<String> {
        let value = |manifest: &Self| serde_json::to_value(manifest).unwrap_or_default();
        let (mine, theirs) = (value(self), value(found));
        let keys = |value: &serde_json::Value| -> BTreeSet<String> {
            value.as_object().into_iter().flat_map(|object| object.keys().cloned()).collect()
        };
        keys(&mine)
            .union(&keys(&theirs))
            .filter(|key| !matches!(key.as_str(), "count" | "program"))
            .filter(|&key| mine[key] != theirs[key])
            .map(|key| format!("{key}: {} there, {} now", theirs[key], mine[key]))
            .collect()
    }

    fn write(&self, folder: &Path) -> Result<(), GenerateError> {
        let path = folder.join(MANIFEST_FILE);
        // Several shards may begin one folder at once: each writes its own file,
        // all with the same text.
        let part = folder.join(format!("{MANIFEST_FILE}.{}.part", std::process::id()));
        let write = || -> std::io::Result<()> {
            let part = Part::named(part, &path)?;
            let mut file = part.file();
            serde_json::to_writer_pretty(&mut file, self)?;
            file.write_all(b"\n")?;
            part.finish_durably()
        };
        write().map_err(GenerateError::io(&path))
    }
}

#[cfg(test)]
#[test]
fn the_schema_of_a_manifest_is_that_of_the_type() {
    crate::base::schema::holds::<Manifest>("dataset", "manifest.json of generate", &[]);
}

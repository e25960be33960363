//! What a folder of drapes is to hold, and which part of it one run makes.

use std::path::PathBuf;

use super::walk::Walks;
use crate::base::Shard;
use crate::fabric::Mixture;

/// What to make, and where.
#[derive(Clone, Debug)]
pub struct GenerateOptions {
    /// Where the fabrics are drawn from.
    pub prior: Mixture,
    /// Seed of the whole run.
    pub seed: u64,
    /// Samples of the whole run, over all shards.
    pub count: u64,
    /// Drops of each fabric: sample k is of fabric k / `drops_per_fabric`.
    pub drops_per_fabric: u64,
    /// The part of the run to make here.
    pub shard: Shard,
    /// Folder; made if it is not there.
    pub out: PathBuf,
    /// Drapes at once; 0 for one per core.
    pub threads: usize,
    /// Samples per file.
    pub chunk_rows: u64,
    /// Whether every sheet has the canonical drop, as in the paper; else each a perturbed one.
    pub canonical: bool,
    /// How sheets are continued from sample to sample; without it every one is dropped.
    pub walks: Option<Walks>,
    /// Whether each drape's sheet is written, too. The rows do not depend on it.
    pub sheets: bool,
    /// The simulator's options, for the manifest: a folder takes one set only.
    pub simulator: serde_json::Value,
}

impl GenerateOptions {
    /// Defaults: `knit-2020`, seed 1, one drop per fabric, all of the run, all
    /// cores, 64 samples per file (about 200 kB), a perturbed fall for every sample.
    #[must_use]
    pub fn new(out: impl Into<PathBuf>, count: u64) -> Self {
        Self {
            prior: Mixture::knit_2020(),
            seed: 1,
            count,
            drops_per_fabric: 1,
            shard: Shard::default(),
            out: out.into(),
            threads: 0,
            chunk_rows: 64,
            canonical: false,
            walks: None,
            sheets: false,
            simulator: serde_json::Value::Null,
        }
    }
}

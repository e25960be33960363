//! What a folder of drapes is to hold, and which part of it one run makes.

use std::path::PathBuf;

use super::walk::Walks;
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
    /// Whether every sheet falls canonically, as the paper's do; else each in a way of its own.
    pub canonical: bool,
    /// How sheets are led from sample to sample; without it every one falls.
    pub walks: Option<Walks>,
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
            simulator: serde_json::Value::Null,
        }
    }
}

/// Part `index` of `of`: the chunks whose number leaves that remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: u64,
    /// At least 1.
    pub of: u64,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, of: 1 }
    }
}

/// A text that names no part of a run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a shard: give i/N with i from 0 to N-1")]
pub struct ShardError(String);

impl std::str::FromStr for Shard {
    type Err = ShardError;

    /// Reads `i/N` with 0 <= i < N.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parse = |part: &str| part.trim().parse::<u64>().ok();
        text.split_once('/')
            .and_then(|(index, of)| Some(Self { index: parse(index)?, of: parse(of)? }))
            .filter(|shard| shard.index < shard.of)
            .ok_or_else(|| ShardError(text.to_owned()))
    }
}

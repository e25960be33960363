//! What of a run is there already, and what is to be made.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::dataset::error::GenerateError;
use crate::dataset::options::GenerateOptions;
use crate::dataset::row::Row;
use crate::dataset::table;

/// What is there and what is to be made.
pub(super) struct Plan {
    pub(super) chunks: Vec<Chunk>,
    /// (place in `chunks`, sample) of what is to be made, in order.
    pub(super) to_make: Vec<(usize, u64)>,
    /// Files that are complete.
    pub(super) kept: usize,
    /// Files that are there with other rows, and are made again.
    pub(super) remade: Vec<PathBuf>,
}

/// Consecutive samples of one file.
pub(super) struct Chunk {
    pub(super) path: PathBuf,
    samples: Range<u64>,
    /// Those that an earlier run made, in order of their index.
    pub(super) there: Vec<Row>,
}

impl Plan {
    pub(super) fn new(options: &GenerateOptions) -> Result<Self, GenerateError> {
        let mut plan =
            Self { chunks: Vec::new(), to_make: Vec::new(), kept: 0, remade: Vec::new() };
        let chunks = options.count.div_ceil(options.chunk_rows);
        for number in (options.shard.index..chunks).step_by(options.shard.of as usize) {
            let start = number * options.chunk_rows;
            let samples = start..(start + options.chunk_rows).min(options.count);
            let path = options.out.join(format!("drapes-{number:06}.parquet"));
            if table::rows_of_complete_file(&path) == Some(samples.end - samples.start) {
                plan.kept += 1;
                continue;
            }
            if path.exists() {
                plan.remade.push(path.clone());
            }
            let there = rows_there(&path, &samples, options)?;
            let is_there = |index| there.binary_search_by_key(&index, |row| row.index).is_ok();
            let missing = samples.clone().filter(|&index| !is_there(index));
            plan.to_make.extend(missing.map(|index| (plan.chunks.len(), index)));
            plan.chunks.push(Chunk { path, samples, there });
        }
        Ok(plan)
    }
}

impl Chunk {
    pub(super) fn is_complete(&self, rows: &[Row]) -> bool {
        rows.len() as u64 == self.samples.end - self.samples.start
    }
}

/// Where the rows of a file are until it is complete.
pub(super) fn partial(path: &Path) -> PathBuf {
    path.with_extension("partial")
}

/// The rows of an incomplete file that an earlier run made: in its `.partial`, or in a
/// file of another length (of a run with another `count`).
fn rows_there(
    path: &Path,
    samples: &Range<u64>,
    options: &GenerateOptions,
) -> Result<Vec<Row>, GenerateError> {
    // A damaged file has no rows: they are made again.
    let read = |path: &Path| table::read_file(path).unwrap_or_default();
    let mut rows = read(&partial(path));
    rows.extend(read(path));
    rows.retain(|row| {
        samples.contains(&row.index) && row.fabric_index == row.index / options.drops_per_fabric
    });
    rows.sort_by_key(|row| row.index);
    rows.dedup_by_key(|row| row.index);
    for row in &mut rows {
        // Its last bits change on the way through the paper's units.
        row.fabric = options.prior.sample(options.seed, row.fabric_index)?;
    }
    Ok(rows)
}

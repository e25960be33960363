//! What of a run is there already, and what is to be made.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::dataset::error::GenerateError;
use crate::dataset::fabrics::Fabrics;
use crate::dataset::manifest::Manifest;
use crate::dataset::options::GenerateOptions;
use crate::dataset::row::Row;
use crate::dataset::{sheets, table};

/// What is there and what is to be made.
pub(super) struct Plan<'a> {
    pub(super) manifest: Manifest,
    /// Folder of the sheets, if they are wanted.
    pub(super) sheets: Option<PathBuf>,
    pub(super) fabrics: Fabrics<'a>,
    pub(super) chunks: Vec<Chunk>,
    /// What is to be made, in order.
    pub(super) to_make: Vec<Unit>,
    /// Files that are complete.
    pub(super) kept: usize,
    /// Files that are there with other rows, and are made again.
    pub(super) remade: Vec<PathBuf>,
}

/// What one thread makes at a time: a sample that falls, or a walk.
#[derive(Clone)]
pub(super) struct Unit {
    /// Place in the plan's `chunks`.
    pub(super) chunk: usize,
    pub(super) samples: Range<u64>,
}

/// Consecutive samples of one file.
pub(super) struct Chunk {
    pub(super) path: PathBuf,
    samples: Range<u64>,
    /// Those that an earlier run made, in order of their index.
    pub(super) there: Vec<Row>,
}

impl<'a> Plan<'a> {
    pub(super) fn new(
        options: &'a GenerateOptions,
        manifest: Manifest,
    ) -> Result<Self, GenerateError> {
        let fabrics = Fabrics::new(options);
        let (chunks, to_make) = (Vec::new(), Vec::new());
        let sheets = options.sheets.then(|| sheets::begin(&options.out)).transpose()?;
        let remade = Vec::new();
        let mut plan = Self { manifest, sheets, fabrics, chunks, to_make, kept: 0, remade };
        let chunks = options.count.div_ceil(options.chunk_rows);
        for number in (options.shard.index..chunks).step_by(options.shard.of as usize) {
            let start = number * options.chunk_rows;
            let samples = start..(start + options.chunk_rows).min(options.count);
            let path = options.out.join(format!("drapes-{number:06}.parquet"));
            let has_sheet = |index| plan.has_sheet(index);
            if table::rows_of_complete_file(&path) == Some(samples.end - samples.start)
                && samples.clone().all(has_sheet)
            {
                plan.kept += 1;
                continue;
            }
            if path.exists() {
                plan.remade.push(path.clone());
            }
            plan.fabrics.order(&samples)?;
            let (mut there, chunk) =
                (rows_there(&path, &samples, &plan.fabrics)?, plan.chunks.len());
            there.retain(|row| plan.has_sheet(row.index));
            for unit in units(&samples, options) {
                let is_there = |index| there.binary_search_by_key(&index, |row| row.index).is_ok();
                if unit.clone().all(is_there) {
                    continue;
                }
                // A walk that broke off has lost its sheet: it begins again.
                there.retain(|row| !unit.contains(&row.index));
                plan.to_make.push(Unit { chunk, samples: unit });
            }
            plan.chunks.push(Chunk { path, samples, there });
        }
        Ok(plan)
    }

    /// Whether a sample's sheet is there, or not wanted.
    fn has_sheet(&self, index: u64) -> bool {
        self.sheets.as_ref().is_none_or(|folder| sheets::is_there(folder, index))
    }

    /// Samples to make.
    pub(super) fn count(&self) -> u64 {
        self.to_make.iter().map(|unit| unit.samples.end - unit.samples.start).sum()
    }
}

/// A chunk's samples as they are made together.
fn units(
    samples: &Range<u64>,
    options: &GenerateOptions,
) -> impl Iterator<Item = Range<u64>> + use<> {
    let (rows, end) = (options.walks.map_or(1, |walks| walks.rows), samples.end);
    samples.clone().step_by(rows as usize).map(move |start| start..(start + rows).min(end))
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
    fabrics: &Fabrics<'_>,
) -> Result<Vec<Row>, GenerateError> {
    // A damaged file has no rows: they are made again.
    let read = |path: &Path| table::read_file(path).unwrap_or_default();
    let mut rows = read(&partial(path));
    rows.extend(read(path));
    rows.retain(|row| samples.contains(&row.index));
    rows.sort_by_key(|row| row.index);
    rows.dedup_by_key(|row| row.index);
    let mut there = Vec::new();
    for row in rows {
        let sample = fabrics.sample(row.index)?;
        if row.fabric_index == sample.fabric_index {
            // Its last bits change on the way through the paper's units.
            there.push(Row { fabric: sample.fabric, ..row });
        }
    }
    Ok(there)
}

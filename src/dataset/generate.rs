//! Fills a folder with simulated drapes: sharded, resumable, the same bytes every
//! time.
//!
//! Threads take samples one by one in order of index, over the boundaries of
//! chunks, so that no thread waits at the end of a chunk; whoever finishes the
//! last sample of a chunk writes it.

use std::collections::BTreeMap;
use std::io;
use std::ops::{ControlFlow, Range};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use super::error::GenerateError;
use super::manifest::Manifest;
use super::options::{GenerateOptions, Shard};
use super::row::{Row, SimulatedRow};
use super::table;
use crate::fabric::Fabric;
use crate::io::Part;

/// How far a run is; given after every drape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples made by this run.
    pub made: u64,
    /// Samples that this run has to make: what was there already is not in it.
    pub to_make: u64,
    /// Of those made, the ones not at rest.
    pub not_at_rest: u64,
}

/// What a run did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Samples made, written or not.
    pub made: u64,
    /// Of those made, the ones not at rest, by why they stopped.
    pub not_at_rest: BTreeMap<String, u64>,
    /// Files written.
    pub files_written: usize,
    /// Files that were there, complete, and were left alone.
    pub files_kept: usize,
    /// Files that were there under their final name but had other than the
    /// expected rows (a run with a larger `count`, or damage), made again.
    pub files_remade: Vec<PathBuf>,
    /// Whether `progress` ended the run early.
    pub interrupted: bool,
}

/// Makes the samples of a shard that its folder does not have yet.
///
/// `simulate` gets the sample's index, its fabric and the run's seed; it derives
/// the drop from these alone. `progress` is called after every drape and may end
/// the run: the chunks under way are then dropped.
///
/// # Errors
/// When the options make no sense or are not those of the folder, or a file
/// cannot be written. A drape that fails is a row, not an error.
pub fn generate(
    options: &GenerateOptions,
    simulate: impl Fn(u64, &Fabric, u64) -> SimulatedRow + Sync,
    progress: impl Fn(Progress) -> ControlFlow<()> + Sync,
) -> Result<Summary, GenerateError> {
    check(options)?;
    Manifest::new(options).settle(&options.out)?;
    let plan = Plan::new(options);
    let run = Run::new(options, &plan);
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().map_err(|error| {
            GenerateError::Options(format!("threads = {}: {error}", options.threads))
        })?;
    pool.broadcast(|_| run.work(&simulate, &progress));
    run.finish()
}

fn check(options: &GenerateOptions) -> Result<(), GenerateError> {
    let mut faults = Vec::new();
    for (key, value) in [
        ("chunk_rows", options.chunk_rows),
        ("drops_per_fabric", options.drops_per_fabric),
        ("shard count", options.shard.of),
    ] {
        if value == 0 {
            faults.push(format!("{key} is 0: give at least 1"));
        }
    }
    if options.shard.index >= options.shard.of.max(1) {
        let Shard { index, of } = options.shard;
        faults.push(format!("shard {index}/{of}: give i/N with i from 0 to N-1"));
    }
    if i64::try_from(options.count).is_err() {
        faults.push(format!("count = {}: give at most {}", options.count, i64::MAX));
    }
    if faults.is_empty() { Ok(()) } else { Err(GenerateError::Options(faults.join("; "))) }
}

/// What is there and what is to be made.
struct Plan {
    chunks: Vec<Chunk>,
    kept: usize,
    remade: Vec<PathBuf>,
}

/// Consecutive samples of one file.
struct Chunk {
    path: PathBuf,
    samples: Range<u64>,
}

impl Plan {
    fn new(options: &GenerateOptions) -> Self {
        let mut plan = Self { chunks: Vec::new(), kept: 0, remade: Vec::new() };
        let chunks = options.count.div_ceil(options.chunk_rows);
        for number in (options.shard.index..chunks).step_by(options.shard.of as usize) {
            let start = number * options.chunk_rows;
            let samples = start..(start + options.chunk_rows).min(options.count);
            let path = options.out.join(format!("drapes-{number:06}.parquet"));
            match table::rows_of_complete_file(&path) {
                Some(rows) if rows == samples.end - samples.start => plan.kept += 1,
                _ => {
                    if path.exists() {
                        plan.remade.push(path.clone());
                    }
                    plan.chunks.push(Chunk { path, samples });
                }
            }
        }
        plan
    }
}

/// The state that the threads of a run share.
struct Run<'a> {
    options: &'a GenerateOptions,
    plan: &'a Plan,
    /// Rows of each chunk as they come; emptied when the chunk is written.
    rows: Vec<Mutex<Vec<Row>>>,
    /// (chunk, sample) pairs in the order they are handed out.
    next: AtomicU64,
    to_make: u64,
    made: AtomicU64,
    written: AtomicUsize,
    not_at_rest: Mutex<BTreeMap<String, u64>>,
    stop: AtomicBool,
    error: Mutex<Option<GenerateError>>,
}

impl<'a> Run<'a> {
    fn new(options: &'a GenerateOptions, plan: &'a Plan) -> Self {
        Self {
            options,
            plan,
            rows: plan.chunks.iter().map(|_| Mutex::default()).collect(),
            next: AtomicU64::new(0),
            to_make: plan.chunks.iter().map(|c| c.samples.end - c.samples.start).sum(),
            made: AtomicU64::new(0),
            written: AtomicUsize::new(0),
            not_at_rest: Mutex::default(),
            stop: AtomicBool::new(false),
            error: Mutex::default(),
        }
    }

    /// One thread's work: samples until none is left or the run is stopped.
    fn work(
        &self,
        simulate: &(impl Fn(u64, &Fabric, u64) -> SimulatedRow + Sync),
        progress: &(impl Fn(Progress) -> ControlFlow<()> + Sync),
    ) {
        while !self.stop.load(Ordering::Relaxed) {
            let Some((chunk, index)) = self.hand_out() else { return };
            let made = self.make(index, simulate).and_then(|row| {
                let progress_now = self.count(&row);
                self.keep(chunk, row)?;
                Ok(progress(progress_now))
            });
            match made {
                Ok(ControlFlow::Continue(())) => {}
                Ok(ControlFlow::Break(())) => self.stop.store(true, Ordering::Relaxed),
                Err(error) => {
                    self.stop.store(true, Ordering::Relaxed);
                    locked(&self.error).get_or_insert(error);
                }
            }
        }
    }

    fn hand_out(&self) -> Option<(usize, u64)> {
        let n = self.next.fetch_add(1, Ordering::Relaxed);
        // Only the last chunk of a run can be short, and only it is last in the
        // list: position n lies in chunk n / chunk_rows.
        let chunk = usize::try_from(n / self.options.chunk_rows).ok()?;
        let samples = &self.plan.chunks.get(chunk)?.samples;
        let index = samples.start + n % self.options.chunk_rows;
        (index < samples.end).then_some((chunk, index))
    }

    fn make(
        &self,
        index: u64,
        simulate: &(impl Fn(u64, &Fabric, u64) -> SimulatedRow + Sync),
    ) -> Result<Row, GenerateError> {
        let fabric_index = index / self.options.drops_per_fabric;
        let fabric = self.options.prior.sample(self.options.seed, fabric_index)?;
        let drape = simulate(index, &fabric, self.options.seed);
        Ok(Row { index, fabric_index, fabric, drape })
    }

    fn count(&self, row: &Row) -> Progress {
        let mut not_at_rest = locked(&self.not_at_rest);
        if !row.drape.at_rest {
            *not_at_rest.entry(row.drape.stop.clone()).or_default() += 1;
        }
        Progress {
            made: self.made.fetch_add(1, Ordering::Relaxed) + 1,
            to_make: self.to_make,
            not_at_rest: not_at_rest.values().sum(),
        }
    }

    /// Adds a row to its chunk and writes the chunk when it is complete.
    fn keep(&self, chunk: usize, row: Row) -> Result<(), GenerateError> {
        let Chunk { path, samples } = &self.plan.chunks[chunk];
        let mut rows = locked(&self.rows[chunk]);
        rows.push(row);
        if (rows.len() as u64) < samples.end - samples.start {
            return Ok(());
        }
        let mut rows = std::mem::take(&mut *rows);
        rows.sort_unstable_by_key(|row| row.index);
        let part = path.with_extension("parquet.part");
        let _unfinished = Part::begin(&part);
        table::write_file(&part, &rows)
            .map_err(io::Error::other)
            .and_then(|()| std::fs::rename(&part, path))
            .map_err(GenerateError::io(path))?;
        self.written.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn finish(self) -> Result<Summary, GenerateError> {
        if let Some(error) = locked(&self.error).take() {
            return Err(error);
        }
        Ok(Summary {
            made: self.made.load(Ordering::Relaxed),
            not_at_rest: locked(&self.not_at_rest).clone(),
            files_written: self.written.load(Ordering::Relaxed),
            files_kept: self.plan.kept,
            files_remade: self.plan.remade.clone(),
            interrupted: self.written.load(Ordering::Relaxed) < self.plan.chunks.len(),
        })
    }
}

/// The value behind a lock. A thread that panicked while holding it takes the run
/// down anyway (rayon passes the panic on), so its state is not used.
fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests;

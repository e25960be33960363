//! Fills a folder with simulated drapes: sharded, resumable, the same bytes every
//! time.
//!
//! Threads take samples one by one in order of index, over the boundaries of
//! chunks, so that no thread waits at the end of a chunk; whoever finishes the
//! last sample of a chunk writes it. Until then its rows are kept in a file of the same
//! form, `drapes-NNNNNN.partial`, written anew with every row (a chunk takes 200 kB, a
//! drape seconds): a run that ends before its time loses the samples under way, and
//! the next one continues from the rest. Which rows came from there does not show in the
//! file: a boundary of f32 millimetres survives reading, and the fabric is drawn again.
//!
//! Samples of a walk are made one after the other by one thread, and kept when the walk is whole:
//! its sheet is in no file, so that a walk that breaks off begins again.
//!
//! A sheet is on the disk before its row is kept. A row whose sheet is wanted and missing is made
//! again, so that a folder of rims can be given its sheets later: its rows stay as they are.
//!
//! One run at a time makes a shard in a folder; another is told who does.

mod plan;

use std::collections::BTreeMap;
use std::io;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use super::card;
use super::error::GenerateError;
use super::manifest::Manifest;
use super::options::GenerateOptions;
use super::row::{Row, Sample, Simulated};
use super::sheets;
use super::table::{self, Durability};
use super::walk::Walks;
use crate::base::Shard;
use crate::io::{Lock, output};
use plan::{Chunk, Plan, Unit, partial};

/// How far a run is; given after every drape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples made by this run.
    pub made: u64,
    /// Samples that this run has to make: what was there already is not in it.
    pub to_make: u64,
    /// Of those made, the ones not converged.
    pub not_converged: u64,
}

/// What a run did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Samples made, in a file or kept for the next run.
    pub made: u64,
    /// Samples that an earlier run had made of files that it did not complete.
    pub rows_kept: u64,
    /// Of those made, the ones not converged, by why they stopped.
    pub not_converged: BTreeMap<String, u64>,
    /// Files written.
    pub files_written: usize,
    /// Files that were there, complete, and were left alone.
    pub files_kept: usize,
    /// Files that were there under their final name but had other than the
    /// expected rows (a run with a larger `count`, missing sheets, or damage), made again.
    pub files_remade: Vec<PathBuf>,
    /// Whether `progress` ended the run early.
    pub interrupted: bool,
}

/// Makes the samples of a shard that its folder does not have yet.
///
/// `simulate` gets the sample, from which alone it derives the drop, and what it gave with the
/// sample before in a walk (`None` at the beginning of one, and without walks always). `progress`
/// is called after every drape and may end the run: the samples and walks under way are then
/// dropped.
///
/// # Errors
/// When the options make no sense or are not those of the folder, or a file
/// cannot be written. A drape that fails is a row, not an error.
pub fn generate<S>(
    options: &GenerateOptions,
    simulate: impl Fn(&Sample, Option<S>) -> Simulated<S> + Sync,
    progress: impl Fn(Progress) -> ControlFlow<()> + Sync,
) -> Result<Summary, GenerateError> {
    check(options)?;
    output::check_folder(&options.out)?;
    let manifest = Manifest::new(options).settle(&options.out)?;
    card::write(&options.out, &manifest)?;
    let _lock = Lock::take(options.out.join(format!("shard-{}.lock", options.shard)))?;
    let plan = Plan::new(options, manifest)?;
    let run = Run::new(&plan);
    run.write_complete()?;
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
    if let Some(Walks { rows, pool }) = options.walks {
        let GenerateOptions { chunk_rows, drops_per_fabric, .. } = *options;
        if rows == 0 || !chunk_rows.is_multiple_of(rows) {
            faults.push(format!("walks of {rows} rows: give a divisor of {chunk_rows}"));
        }
        if pool == 0 || !pool.is_multiple_of(chunk_rows.max(1)) {
            faults.push(format!("a pool of {pool}: give a multiple of {chunk_rows}"));
        }
        if drops_per_fabric != 1 {
            faults.push(format!("{drops_per_fabric} drops per fabric: a walk has one"));
        }
    }
    if options.canonical && options.drops_per_fabric > 1 {
        let drops = options.drops_per_fabric;
        faults.push(format!("{drops} canonical drops per fabric: they are all the same"));
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

/// The state that the threads of a run share.
struct Run<'a> {
    plan: &'a Plan<'a>,
    /// Rows of each chunk as they come; emptied when the chunk is written.
    rows: Vec<Mutex<Vec<Row>>>,
    /// Place in the plan's `to_make` of what is handed out next.
    next: AtomicUsize,
    /// Samples simulated, ...
    made: AtomicU64,
    /// ... and of these in a file.
    kept: AtomicU64,
    written: AtomicUsize,
    not_converged: Mutex<BTreeMap<String, u64>>,
    stop: AtomicBool,
    error: Mutex<Option<GenerateError>>,
}

impl<'a> Run<'a> {
    fn new(plan: &'a Plan<'a>) -> Self {
        Self {
            plan,
            rows: plan.chunks.iter().map(|chunk| Mutex::new(chunk.there.clone())).collect(),
            next: AtomicUsize::new(0),
            made: AtomicU64::new(0),
            kept: AtomicU64::new(0),
            written: AtomicUsize::new(0),
            not_converged: Mutex::default(),
            stop: AtomicBool::new(false),
            error: Mutex::default(),
        }
    }

    /// Writes the chunks that an earlier run made all samples of.
    fn write_complete(&self) -> Result<(), GenerateError> {
        for (chunk, rows) in self.plan.chunks.iter().zip(&self.rows) {
            let mut rows = locked(rows);
            if chunk.is_complete(&rows) {
                self.write(chunk, &mut rows)?;
            }
        }
        Ok(())
    }

    /// One thread's work: samples until none is left or the run is stopped.
    fn work<S>(
        &self,
        simulate: &(impl Fn(&Sample, Option<S>) -> Simulated<S> + Sync),
        progress: &(impl Fn(Progress) -> ControlFlow<()> + Sync),
    ) {
        while !self.stop.load(Ordering::Relaxed) {
            let next = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(unit) = self.plan.to_make.get(next) else { return };
            let made = self.make(unit, simulate, progress);
            if let Err(error) = made.and_then(|rows| self.keep(unit.chunk, rows)) {
                locked(&self.error).get_or_insert(error);
                self.stop.store(true, Ordering::Relaxed);
            }
        }
    }

    /// The rows of a sample or a walk; none if the run is stopped before its end.
    fn make<S>(
        &self,
        unit: &Unit,
        simulate: &(impl Fn(&Sample, Option<S>) -> Simulated<S> + Sync),
        progress: &(impl Fn(Progress) -> ControlFlow<()> + Sync),
    ) -> Result<Vec<Row>, GenerateError> {
        let (mut rows, mut state) = (Vec::new(), None);
        for index in unit.samples.clone() {
            if !rows.is_empty() && self.stop.load(Ordering::Relaxed) {
                return Ok(Vec::new());
            }
            let sample = self.plan.fabrics.sample(index)?;
            let Simulated { row: drape, sheet, next } = simulate(&sample, state);
            state = next;
            let Sample { fabric_index, fabric, .. } = sample;
            let row = Row { index, fabric_index, fabric, drape };
            if let Some(folder) = &self.plan.sheets {
                sheets::write(folder, &row, &sheet)?;
            }
            if progress(self.count(&row)).is_break() {
                self.stop.store(true, Ordering::Relaxed);
            }
            rows.push(row);
        }
        Ok(rows)
    }

    fn count(&self, row: &Row) -> Progress {
        let mut not_converged = locked(&self.not_converged);
        if !row.drape.ending.is_converged() {
            *not_converged.entry(row.drape.ending.name().to_owned()).or_default() += 1;
        }
        Progress {
            made: self.made.fetch_add(1, Ordering::Relaxed) + 1,
            to_make: self.plan.count(),
            not_converged: not_converged.values().sum(),
        }
    }

    /// Adds rows to their chunk, and writes the chunk: as a file when it is complete,
    /// else for the next run.
    fn keep(&self, chunk: usize, made: Vec<Row>) -> Result<(), GenerateError> {
        if made.is_empty() {
            return Ok(());
        }
        self.kept.fetch_add(made.len() as u64, Ordering::Relaxed);
        let mut rows = locked(&self.rows[chunk]);
        let chunk = &self.plan.chunks[chunk];
        rows.extend(made);
        if chunk.is_complete(&rows) {
            return self.write(chunk, &mut rows);
        }
        let path = partial(&chunk.path);
        let manifest = &self.plan.manifest;
        table::write_file(&path, &rows, manifest, Durability::Kill)
            .map_err(GenerateError::io(&path))
    }

    /// Writes a complete chunk, and forgets its rows.
    fn write(&self, chunk: &Chunk, rows: &mut Vec<Row>) -> Result<(), GenerateError> {
        let mut rows = std::mem::take(rows);
        rows.sort_unstable_by_key(|row| row.index);
        table::write_file(&chunk.path, &rows, &self.plan.manifest, Durability::PowerCut)
            .map_err(GenerateError::io(&chunk.path))?;
        self.written.fetch_add(1, Ordering::Relaxed);
        match std::fs::remove_file(partial(&chunk.path)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(GenerateError::io(&partial(&chunk.path))(error))
            }
            _ => Ok(()),
        }
    }

    fn finish(self) -> Result<Summary, GenerateError> {
        if let Some(error) = locked(&self.error).take() {
            return Err(error);
        }
        Ok(Summary {
            made: self.kept.load(Ordering::Relaxed),
            rows_kept: self.plan.chunks.iter().map(|chunk| chunk.there.len() as u64).sum(),
            not_converged: locked(&self.not_converged).clone(),
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

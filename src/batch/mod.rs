//! A folder of scans: every one estimated, even if others fail.
//!
//! In: a folder, densities, one set of options. Out: one [`Row`] per scan, its
//! refusal or failure included, in the order of the scans' paths; in the folder of
//! results `results.csv`, `results.jsonl`, `journal.jsonl`, `report.html`, and below `files` what
//! `estimate --out` writes of each scan, of a refused one the picture of what was found.
//!
//! Each finished scan is a line of the journal, so that a run
//! can be killed at any time. The next run keeps a row if the scan's bytes, the
//! options, the program and the model are those that the row was made with, and its
//! files are there; scans that failed (as opposed to refused) are tried again.
//!
//! Several machines may share a batch ([`Share`]): each does a shard, with its own journal in the
//! same folder of results, and the tables are made of all journals. The rows do not depend on how
//! many shards there were.
//!
//! Scans run on threads of their own and meet on rayon's pool inside the scan
//! path. Tried and dropped: the scans themselves as rayon tasks; a task that waits
//! takes up another scan, and the memory of many scans is held at once.
//!
//! One run at a time does the whole or a shard; another is told who does.

pub mod calibrations;
mod error;
mod inputs;
mod journal;
mod options;
mod page;
mod row;
mod table;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

pub use error::BatchError;
pub use inputs::{Input, Inputs, check_folder, inputs};
pub use options::{BatchOptions, SCANS, Share};
pub use row::{Row, SCHEMA_VERSION, Status};
pub use table::{csv, overview};

use crate::base::units::KG_M2_PER_G_M2;
use crate::estimate::Estimator;
use crate::fabric::sha256_hex;
use crate::intake::IntakeError;
use crate::io::{self, Lock, OutputError, ReadError, WriteError, output};
use crate::job::verdict::Limits;
use crate::job::{Job, JobError};
use crate::refine::FitOptions;
use crate::report::page::options::Extra;
use crate::report::page::provenance;
use crate::report::{files, json};
use crate::scan::ScanOptions;
use crate::sim::NUMERICS_VERSION;
use journal::Journal;

/// The files of the whole batch in the folder of results.
const RESULTS: [&str; 2] = ["results.csv", "results.jsonl"];

/// How far a run is; given after every scan.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// The scan that ended.
    pub row: &'a Row,
    /// Scans ended by this run.
    pub done: usize,
    /// Scans that this run has to do: what was kept is not in it.
    pub to_do: usize,
    /// Of those ended, the ones without an estimate that may be used.
    pub failed: usize,
    /// Estimated time left \[s\].
    pub left_s: f64,
}

/// What a run did.
#[derive(Clone, Debug)]
pub struct Summary {
    /// One row per scan of the whole or of the shard, in order of their paths.
    pub rows: Vec<Row>,
    /// Rows kept from an earlier run or another shard's.
    pub kept: usize,
    /// Files of the folder that somebody may take for scans and that are none by their names.
    pub passed_over: Vec<String>,
    /// Lines of the journal that were no rows and were passed over.
    pub unreadable_lines: usize,
    /// Bytes of a torn line at the journal's end that were cut off.
    pub torn_bytes: usize,
    /// The tables of the whole batch; none of a shard.
    pub written: Vec<PathBuf>,
    /// Its page, if one was asked for.
    pub page: Option<PathBuf>,
    /// Pictures of refused scans, what was found in each; in the rows' order.
    pub pictures: Vec<PathBuf>,
    /// Answered scans whose files are gone at the end: somebody has removed them while the batch
    /// ran.
    pub lost: Vec<String>,
}

/// Estimates every scan of a folder, or does its share of that.
///
/// # Errors
/// When there is nothing to do, the density table is damaged, the model does not
/// load, or the results cannot be written; of a merge, when a scan has not been done.
/// A scan that fails is a row.
pub fn run(
    options: &BatchOptions,
    progress: impl Fn(Progress<'_>) + Sync,
) -> Result<Summary, BatchError> {
    let Inputs { scans: inputs, passed_over } = inputs(options)?;
    let out = &options.out;
    output::check_folder(out)?;
    std::fs::create_dir_all(out).map_err(|source| WriteError { path: out.clone(), source })?;
    let shard = options.shard();
    let lock = shard.map_or_else(|| "batch.lock".to_owned(), |shard| format!("batch-{shard}.lock"));
    let _lock = Lock::take(out.join(lock))?;
    let journal = Journal::name(shard);
    check_results(options, &journal)?;
    let estimator = Estimator::shipped()?;
    let batch = Batch { options, estimator: &estimator };
    let (mut journal_file, mut held) = Journal::open(&out.join(&journal))?;
    held.read_others(out, &journal)?;
    let rows = parallel(options.threads, inputs.len(), |i| {
        let mut rows = held.rows.get(&inputs[i].file)?.iter();
        let row = rows.find(|row| batch.still_holds(&inputs[i], row))?;
        Some(row.clone().judged(options.strict))
    });
    let kept = rows.iter().flatten().count();
    let rows = batch.finish(&inputs, rows, &mut journal_file, progress)?;
    let (mut written, mut page) = (Vec::new(), None);
    if shard.is_none() {
        written.extend(write(out, &rows)?);
        page = options.pages.then(|| page::write(out, &options.folder, &rows)).transpose()?;
    }
    let (unreadable_lines, torn_bytes) = (held.unreadable_lines, held.torn_bytes);
    let pictures = rows.iter().filter_map(|row| batch.picture(row)).collect();
    let is_lost = |row: &&Row| row.status == Status::Ok && !batch.has_files(row);
    let lost = rows.iter().filter(is_lost).map(|row| row.file.clone()).collect();
    Ok(Summary {
        rows,
        kept,
        passed_over,
        unreadable_lines,
        torn_bytes,
        written,
        page,
        pictures,
        lost,
    })
}

/// Whether the results can be written, and the table of densities is none of them.
fn check_results(options: &BatchOptions, journal: &str) -> Result<(), OutputError> {
    let inputs: Vec<PathBuf> = options.density_csv.iter().cloned().collect();
    let tables = RESULTS.into_iter().chain(options.pages.then_some(page::NAME));
    let tables = tables.filter(|_| options.shard().is_none());
    let mut names = tables.chain([journal]);
    names.try_for_each(|name| output::check_file(&options.out.join(name), &inputs))
}

/// Writes [`RESULTS`].
fn write(out: &Path, rows: &[Row]) -> Result<[PathBuf; 2], WriteError> {
    let paths = RESULTS.map(|name| out.join(name));
    io::atomically(&paths[0], |file| file.write_all(csv(rows).as_bytes()))?;
    io::atomically(&paths[1], |file| {
        for row in rows {
            serde_json::to_writer(&mut *file, row)?;
            writeln!(file)?;
        }
        Ok(())
    })?;
    Ok(paths)
}

/// `count` results in order, made by `threads` threads (0: one per core).
fn parallel<T: Send>(threads: usize, count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if threads == 0 { cores } else { threads }.min(count);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut made = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return made;
            }
            made.push((index, make(index)));
        }
    };
    let mut all: Vec<(usize, T)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = workers.into_iter().map(std::thread::ScopedJoinHandle::join);
        joined.flat_map(|made| made.unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
    });
    all.sort_unstable_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, value)| value).collect()
}

/// What every scan of a run shares.
struct Batch<'a> {
    options: &'a BatchOptions,
    estimator: &'a Estimator,
}

impl Batch<'_> {
    /// The rows of all inputs, of which those that are missing are made and appended to the
    /// journal.
    fn finish(
        &self,
        inputs: &[Input],
        mut rows: Vec<Option<Row>>,
        journal: &mut Journal,
        progress: impl Fn(Progress<'_>) + Sync,
    ) -> Result<Vec<Row>, BatchError> {
        let to_do: Vec<usize> = (0..inputs.len()).filter(|&i| rows[i].is_none()).collect();
        if self.options.share == Share::Merge {
            // what is known to fail takes no time
            let is_left = |&&i: &&usize| inputs[i].fault.is_none();
            let left = to_do.iter().filter(is_left).map(|&i| inputs[i].file.clone());
            let files: Vec<String> = left.collect();
            if !files.is_empty() {
                return Err(BatchError::NotDone { files, of: inputs.len() });
            }
        }
        let start = Instant::now();
        let state = Mutex::new((journal, 0, 0, None::<WriteError>));
        let locked = || state.lock().unwrap_or_else(PoisonError::into_inner);
        let made = parallel(self.options.threads, to_do.len(), |k| {
            if locked().3.is_some() {
                return None;
            }
            let row = self.row(&inputs[to_do[k]]);
            let (journal, done, failed, fault) = &mut *locked();
            if let Err(error) = journal.append(&row) {
                fault.get_or_insert(error);
                return None;
            }
            (*done, *failed) = (*done + 1, *failed + usize::from(row.exit_code != 0));
            let each_s = start.elapsed().as_secs_f64() / *done as f64;
            let left_s = each_s * (to_do.len() - *done) as f64;
            let (done, failed, to_do) = (*done, *failed, to_do.len());
            progress(Progress { row: &row, done, to_do, failed, left_s });
            Some(row)
        });
        if let Some(error) = locked().3.take() {
            return Err(error.into());
        }
        for (&at, row) in to_do.iter().zip(made) {
            rows[at] = row;
        }
        Ok(rows.into_iter().flatten().collect())
    }

    fn scan_options(&self, input: &Input) -> ScanOptions {
        let warp_toward = input.warp_toward.or(self.options.scan.warp_toward);
        ScanOptions { warp_toward, ..self.options.scan.clone() }
    }

    /// SHA-256 over everything but the scan that a row depends on.
    fn settings_sha256(&self, input: &Input) -> String {
        let settings = serde_json::json!({
            "program": env!("CARGO_PKG_VERSION"),
            "numerics": NUMERICS_VERSION,
            "model": self.estimator.model().onnx_sha256,
            "asked_density_g_m2": self.estimator.model().asked_density_g_m2(),
            "density_kg_m2": input.density_kg_m2,
            "read": self.options.read,
            "scan": self.scan_options(input),
            "release": self.options.release,
            "refine": self.options.refine.then(FitOptions::default),
            "verdict": Limits::default(),
        });
        sha256_hex(settings.to_string().as_bytes())
    }

    /// Whether a row of an earlier run is what this run would make; a merge takes failures as they
    /// are.
    fn still_holds(&self, input: &Input, row: &Row) -> bool {
        input.fault.is_none()
            && (row.status.is_final() || self.options.share == Share::Merge)
            && row.settings_sha256.as_ref() == Some(&self.settings_sha256(input))
            && (row.status != Status::Ok || self.has_files(row))
            && row.input_sha256.is_some()
            && sha256_of(&input.path).ok() == row.input_sha256
    }

    /// Whether the files of an answered scan are there, and are this row's: runs with other options
    /// write the same names.
    fn has_files(&self, row: &Row) -> bool {
        let own = |ending| self.files().join(format!("{}.{ending}", row.file));
        let params = io::bytes_of(own("params.json")).ok();
        let params = params.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        own("boundary.csv").is_file() && params.is_some() && params == row.result
    }

    /// The picture of a refused scan, if there is one: a rim from a file has none.
    fn picture(&self, row: &Row) -> Option<PathBuf> {
        let path = self.files().join(files::refused_name(&row.file));
        (row.status == Status::Refused && path.is_file()).then_some(path)
    }

    /// Where the files of the scans go.
    fn files(&self) -> PathBuf {
        self.options.out.join("files")
    }

    /// Does one scan. A panic is a defect of this program, and still not the end
    /// of the batch.
    fn row(&self, input: &Input) -> Row {
        let start = Instant::now();
        let density_g_m2 = input.density_kg_m2.map(|d| d / KG_M2_PER_G_M2);
        let made = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.try_row(input)));
        let row = made.unwrap_or_else(|_| {
            let reason =
                Some(format!("{}: internal error; please report it", input.path.display()));
            Row { reason, ..Row::new(&input.file, Status::Failed) }
        });
        Row { density_g_m2, seconds: start.elapsed().as_secs_f64(), ..row }
    }

    fn try_row(&self, input: &Input) -> Row {
        let ended =
            |status, reason: String| Row { reason: Some(reason), ..Row::new(&input.file, status) };
        let density_kg_m2 = match (&input.fault, input.density_kg_m2) {
            (Some(fault), Some(_)) => return ended(Status::Failed, fault.clone()),
            (Some(fault), None) => return ended(Status::Usage, fault.clone()),
            (None, density) => density.unwrap_or(f64::NAN),
        };
        let input_sha256 = match sha256_of(&input.path) {
            Ok(sha256) => Some(sha256),
            Err(error) => return ended(Status::Failed, error.to_string()),
        };
        let row = self
            .estimate(input, density_kg_m2)
            .unwrap_or_else(|error| ended(error.kind().into(), error.to_string()));
        Row { input_sha256, settings_sha256: Some(self.settings_sha256(input)), ..row }
    }

    fn estimate(&self, input: &Input, density_kg_m2: f64) -> Result<Row, JobError> {
        let job = Job {
            experiment: crate::sim::Experiment::default(),
            input: input.path.clone(),
            density_kg_m2,
            read: self.options.read.clone(),
            scan: self.scan_options(input),
            release: self.options.release,
            refine: self.options.refine,
            with: Vec::new(),
        };
        let (folder, name) = match input.file.rsplit_once('/') {
            Some((folder, name)) => (self.files().join(folder), name),
            None => (self.files(), input.file.as_str()),
        };
        let outcome = match job.run_with(self.estimator) {
            Ok(outcome) => outcome,
            Err(error) => {
                files::write_refused_as(&error, &folder, name)?;
                return Err(error);
            }
        };
        files::write_as(&outcome, &folder, name)?;
        if self.options.pages {
            // the view that turns is as large as a scan: not in each of many
            let inputs = provenance::files_of(&input.path).map_err(IntakeError::from)?;
            let extra = Extra { inputs, ..Extra::default() };
            files::write_page(&outcome, &folder, name, &extra)?;
            files::write_thumbnail(&outcome, &folder, name)?;
        }
        let row = Row::new(&input.file, Status::Ok);
        Ok(Row { result: Some(json::params(&outcome)), ..row }.judged(self.options.strict))
    }
}

/// SHA-256 of a scan's bytes; of a set of views, over those of its files in order.
fn sha256_of(path: &Path) -> Result<String, ReadError> {
    let files = io::files_of(path)?;
    let each: Result<Vec<String>, ReadError> =
        files.iter().map(|file| Ok(sha256_hex(&io::bytes_of(file)?))).collect();
    let each = each?;
    Ok(if let [one] = each.as_slice() { one.clone() } else { sha256_hex(each.concat().as_bytes()) })
}

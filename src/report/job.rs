//! The main job: a scan file to six stiffnesses, and back to a drape.
//!
//! read -> rim -> estimate -> re-simulate. In: a path and what the user knows. Out:
//! an [`Outcome`], which [`super::table`], [`super::json`] and [`super::overlay`]
//! show.

use std::path::{Path, PathBuf};

use crate::estimate::{Estimate, EstimateError, Estimator};
use crate::fabric::{Fault, check_density};
use crate::io::{self, ReadError, ReadNotes, WriteError};
use crate::refine::{Resimulation, resimulate};
use crate::scan::{ScanError, ScanOptions, ScannedBoundary, boundary_from_scan};
use crate::sim::SimOptions;

/// What to do with one scan.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scan.
    pub input: PathBuf,
    /// Areal density of the fabric \[kg/m^2\].
    pub density_kg_m2: f64,
    /// How the scan is read.
    pub scan: ScanOptions,
    /// Whether the estimate is draped again and held against the scan.
    pub resimulate: bool,
}

/// Everything found about one scan.
#[derive(Debug)]
pub struct Outcome {
    /// What was asked.
    pub job: Job,
    /// What the reader left out.
    pub notes: ReadNotes,
    /// The rim.
    pub scanned: ScannedBoundary,
    /// The stiffnesses.
    pub estimate: Estimate,
    /// The drape of the estimate, if asked for.
    pub resimulation: Option<Resimulation>,
    /// Name of the model and the SHA-256 of its file.
    pub model: [String; 2],
}

/// Why a job gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The density is not one of a textile.
    #[error(transparent)]
    Density(#[from] Fault),
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The scan cannot be trusted.
    #[error("{}: scan refused: {source}", path.display())]
    Refused {
        /// The scan.
        path: PathBuf,
        /// What was measured, the limit, the remedy.
        source: ScanError,
    },
    /// The model cannot be used.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A picture cannot be written.
    #[error("{}: {source}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What the encoder says.
        source: image::ImageError,
    },
}

impl Job {
    /// Runs the job.
    ///
    /// # Errors
    /// When the density is none, the file cannot be read, the scan is refused, or
    /// the model does not load.
    pub fn run(self) -> Result<Outcome, JobError> {
        check_density(self.density_kg_m2)?;
        let (scanned, notes) = rim(&self.input, &self.scan)?;
        let estimator = Estimator::shipped()?;
        let known = scanned.orientation == crate::scan::Orientation::Given;
        let estimate = estimator.estimate(&scanned.boundary, self.density_kg_m2, known)?;
        let resimulation = self
            .resimulate
            .then(|| resimulate(&scanned.boundary, &estimate.fabric, &SimOptions::default()));
        let model = [estimator.model().id.clone(), estimator.model().onnx_sha256.clone()];
        Ok(Outcome { job: self, notes, scanned, estimate, resimulation, model })
    }
}

/// Reads a scan and finds its rim.
///
/// # Errors
/// When the file cannot be read or the scan is refused.
pub fn rim(path: &Path, options: &ScanOptions) -> Result<(ScannedBoundary, ReadNotes), JobError> {
    let (cloud, notes) = io::read_scan(path)?;
    let scanned = boundary_from_scan(&cloud, options)
        .map_err(|source| JobError::Refused { path: path.to_owned(), source })?;
    Ok((scanned, notes))
}

impl Outcome {
    /// Writes `<stem>.params.json`, `<stem>.boundary.csv` and `<stem>.boundary.png`
    /// into `folder`, which is made if it is not there. Returns their paths.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, JobError> {
        let stem = self.job.input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let path = |ending: &str| folder.join(format!("{stem}.{ending}"));
        let [json, csv, png] = ["params.json", "boundary.csv", "boundary.png"].map(path);
        std::fs::create_dir_all(folder)
            .map_err(|source| JobError::Write(WriteError { path: folder.to_owned(), source }))?;
        let text = super::json::params(self);
        io::atomically(&json, |out| {
            serde_json::to_writer_pretty(&mut *out, &text)?;
            writeln!(out)
        })?;
        io::boundary_csv::write(&csv, &self.scanned.boundary)?;
        super::overlay::draw(self)
            .save(&png)
            .map_err(|source| JobError::Picture { path: png.clone(), source })?;
        Ok(vec![json, csv, png])
    }
}

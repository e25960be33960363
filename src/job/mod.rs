//! The main job: a scan file to six stiffnesses, and back to a drape.
//!
//! read -> rim -> estimate -> re-simulate. In: a path and what the user knows. Out:
//! an [`Outcome`], which `report` shows.

pub mod rim;

use std::path::PathBuf;

pub use rim::Rim;

use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use crate::base::units::M_PER_MM;
use crate::estimate::{Estimate, EstimateError, Estimator};
use crate::fabric::{Fault, check_density};
use crate::io::{self, ReadError, ReadOptions, WriteError};
use crate::refine::{Resimulation, resimulate};
use crate::scan::{Found, Orientation, ScanError, ScanOptions};
use crate::sim::SimOptions;
use rim::RimError;
use serde::{Deserialize, Serialize};

/// What to do with one scan.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scan, or a rim as `boundary` writes it.
    pub input: PathBuf,
    /// Areal density of the fabric \[kg/m^2\].
    pub density_kg_m2: f64,
    /// What a depth image does not say itself.
    pub read: ReadOptions,
    /// How the scan is taken.
    pub scan: ScanOptions,
    /// Whether the estimate is draped again and held against the scan.
    pub resimulate: bool,
}

/// Everything found about one scan.
#[derive(Debug)]
pub struct Outcome {
    /// What was asked.
    pub job: Job,
    /// The rim.
    pub rim: Rim,
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
        /// What was found until then.
        found: Box<Found>,
    },
    /// The specimen or the plate is another than the model's.
    #[error(
        "the estimate is for a specimen of {:.0} mm on a plate of {:.0} mm radius, not for {side_mm:.0} mm on \
         {radius_mm:.0} mm: the model was trained on that drape alone; inspect and boundary take other sizes",
        SPECIMEN_SIDE_M / M_PER_MM, PLATE_RADIUS_M / M_PER_MM
    )]
    Experiment {
        /// Side of the specimen.
        side_mm: f64,
        /// Radius of the plate.
        radius_mm: f64,
    },
    /// A rim read from a boundary CSV cannot be one.
    #[error("{}: rim refused: {source}", path.display())]
    RimRefused {
        /// The boundary CSV.
        path: PathBuf,
        /// What was measured, the limit, the remedy.
        source: RimError,
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

/// The kinds of failure that a program can act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FailureKind {
    /// A file cannot be read or written.
    Failed,
    /// What was asked cannot be meant.
    Usage,
    /// The scan cannot be trusted.
    Refused,
}

impl FailureKind {
    /// The exit code that stands for it.
    #[must_use]
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Failed => 1,
            Self::Usage => 2,
            Self::Refused => 4,
        }
    }
}

impl JobError {
    /// What kind of failure it is.
    #[must_use]
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Density(_) | Self::Experiment { .. } => FailureKind::Usage,
            Self::Read(error) if matches!(error.fault, io::Fault::NoIntrinsics) => {
                FailureKind::Usage
            }
            Self::Refused { .. } | Self::RimRefused { .. } => FailureKind::Refused,
            _ => FailureKind::Failed,
        }
    }
}

/// Refuses specimens and plates that the model does not know.
///
/// # Errors
/// When they are not those of the modified Cusick drape.
pub fn check_experiment(scan: &ScanOptions) -> Result<(), JobError> {
    if scan.is_modified_cusick() {
        return Ok(());
    }
    let [side_mm, radius_mm] = [scan.specimen_side_m, scan.plate_radius_m].map(|m| m / M_PER_MM);
    Err(JobError::Experiment { side_mm, radius_mm })
}

impl Job {
    /// Runs the job with the model that ships with the package.
    ///
    /// # Errors
    /// When the density is none, the file cannot be read, the scan is refused, or
    /// the model does not load.
    pub fn run(self) -> Result<Outcome, JobError> {
        check_density(self.density_kg_m2)?;
        check_experiment(&self.scan)?;
        self.run_with(&Estimator::shipped()?)
    }

    /// Runs the job with a model that is loaded already.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_with(self, estimator: &Estimator) -> Result<Outcome, JobError> {
        check_density(self.density_kg_m2)?;
        check_experiment(&self.scan)?;
        let rim = rim::of_input(&self.input, &self.read, &self.scan)?;
        let known = rim.orientation() == Orientation::Given;
        let estimate = estimator.estimate(rim.boundary(), self.density_kg_m2, known)?;
        let resimulation = self
            .resimulate
            .then(|| resimulate(rim.boundary(), &estimate.fabric, &SimOptions::default()));
        let model = [estimator.model().id.clone(), estimator.model().onnx_sha256.clone()];
        Ok(Outcome { job: self, rim, estimate, resimulation, model })
    }
}

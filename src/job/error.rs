//! Why a job gave nothing.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use crate::base::units::M_PER_MM;
use crate::estimate::EstimateError;
use crate::fabric::Fault;
use crate::intake::IntakeError;
use crate::io::{self, WriteError};

/// Why a job gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The density is not one of a textile.
    #[error(transparent)]
    Density(#[from] Fault),
    /// There is no rim to estimate from.
    #[error(transparent)]
    Intake(#[from] IntakeError),
    /// The specimen or the plate is another than the model's.
    #[error(
        "the estimate is for a specimen of {:.0} mm on a plate of {:.0} mm radius, not for {side_mm:.0} mm on \
         {radius_mm:.0} mm: the model was trained on that drape alone; inspect and boundary take other sizes",
        SPECIMEN_SIDE_M / M_PER_MM, PLATE_RADIUS_M / M_PER_MM
    )]
    Experiment {
        /// Side of the specimen \[mm\].
        side_mm: f64,
        /// Radius of the plate \[mm\].
        radius_mm: f64,
    },
    /// A scan cannot be refined together with others.
    #[error("{}: {source}", path.display())]
    Companion {
        /// The scan.
        path: PathBuf,
        /// Why not, and the remedy.
        source: CompanionFault,
    },
    /// The model cannot be used.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Why a scan cannot be refined together with others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompanionFault {
    /// Weft and warp are not known.
    #[error(
        "weft and warp are not known, and scans of one fabric are refined together only where they are: \
         mark the corner, or say where the warp points (--warp-toward)"
    )]
    UnknownWarp,
    /// What the scan alone would give is not to be used.
    #[error("not to be refined with others: {0}; leave it out or scan it again")]
    Unusable(String),
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
            Self::Intake(IntakeError::Read(error))
                if matches!(error.fault, io::Fault::NoIntrinsics) =>
            {
                FailureKind::Usage
            }
            Self::Companion { source: CompanionFault::UnknownWarp, .. } => FailureKind::Usage,
            Self::Intake(IntakeError::Refused { .. } | IntakeError::RimRefused { .. })
            | Self::Companion { .. } => FailureKind::Refused,
            _ => FailureKind::Failed,
        }
    }
}

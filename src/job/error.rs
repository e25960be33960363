//! Why a job gave nothing.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use crate::base::units::M_PER_MM;
use crate::estimate::EstimateError;
use crate::fabric::Fault;
use crate::io::{self, ReadError, WriteError};
use crate::scan::{Found, ScanError, WarpSteep};

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
        source: Box<ScanError>,
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
        /// Side of the specimen \[mm\].
        side_mm: f64,
        /// Radius of the plate \[mm\].
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
            Self::Read(error) if matches!(error.fault, io::Fault::NoIntrinsics) => {
                FailureKind::Usage
            }
            Self::Companion { source: CompanionFault::UnknownWarp, .. } => FailureKind::Usage,
            Self::Refused { .. } | Self::RimRefused { .. } | Self::Companion { .. } => {
                FailureKind::Refused
            }
            _ => FailureKind::Failed,
        }
    }
}

/// Why a rim from a file cannot be one. Lines are those of a boundary CSV.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RimError {
    /// Two neighbours too far apart.
    #[error(
        "the points of lines {line} and {next_line} lie {measured_mm:.1} mm apart (limit {limit_mm:.0} mm); \
         correct the one that is off"
    )]
    Jump {
        /// Line of the first point.
        line: usize,
        /// Line of the second.
        next_line: usize,
        /// Their distance \[mm\].
        measured_mm: f64,
        /// Largest accepted \[mm\].
        limit_mm: f64,
    },
    /// The two points of a corner differ.
    #[error(
        "lines {line} and {next_line} are the same corner of the specimen but lie {measured_mm:.1} mm apart \
         (limit {limit_mm:.0} mm); give both the same position"
    )]
    Corner {
        /// Line of the end of a side.
        line: usize,
        /// Line of the start of the next side.
        next_line: usize,
        /// Their distance \[mm\].
        measured_mm: f64,
        /// Largest accepted \[mm\].
        limit_mm: f64,
    },
    /// The direction given for the warp stands nearly upright. The frame is the file's.
    #[error(transparent)]
    WarpSteep(#[from] WarpSteep),
    /// A side of impossible length.
    #[error(
        "side {side} (lines {first_line} to {last_line}) measures {measured_mm:.1} mm, accepted are \
         {min_mm:.0} to {max_mm:.0} mm; check the points' positions and that they are in mm"
    )]
    SideLength {
        /// Side, 0 to 3.
        side: usize,
        /// Line of its first point.
        first_line: usize,
        /// Line of its last point.
        last_line: usize,
        /// Its length \[mm\].
        measured_mm: f64,
        /// Least accepted \[mm\].
        min_mm: f64,
        /// Largest accepted \[mm\].
        max_mm: f64,
    },
    /// The order of the points, or one axis, is mirrored.
    #[error(
        "seen from above (y up) the rim runs counter-clockwise from side 0 to side 3, a mirror image of the specimen; \
         turn the sign of x or z in all lines, or the order of the points"
    )]
    Mirrored,
    /// The rim lies beside the plate.
    #[error(
        "the middle of the rim lies {measured_mm:.0} mm beside the plate's axis (limit {limit_mm:.0} mm): the file's \
         frame has its origin in the middle of the plate's face, y up"
    )]
    BesidePlate {
        /// Horizontal distance of the points' mean from the axis \[mm\].
        measured_mm: f64,
        /// Largest accepted \[mm\].
        limit_mm: f64,
    },
    /// The rim does not hang from the plate.
    #[error(
        "the rim lies between y = {lowest_mm:.0} and {highest_mm:.0} mm; cloth hangs {least_drop_mm:.0} to \
         {most_drop_mm:.0} mm deep from the plate's face at y = 0, y up, and rises nowhere above {most_rise_mm:.0} mm"
    )]
    NotHanging {
        /// Height of its lowest point \[mm\].
        lowest_mm: f64,
        /// Height of its highest point \[mm\].
        highest_mm: f64,
        /// Least accepted depth of the lowest \[mm\].
        least_drop_mm: f64,
        /// Largest accepted depth \[mm\].
        most_drop_mm: f64,
        /// Largest accepted height of the highest \[mm\].
        most_rise_mm: f64,
    },
}

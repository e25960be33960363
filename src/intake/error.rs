//! Why an input gives no rim.

use std::path::PathBuf;

use crate::io::ReadError;
use crate::scan::{Found, ScanError, WarpSteep};

/// Why an input gives no rim.
#[derive(Debug, thiserror::Error)]
pub enum IntakeError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The scan cannot be trusted.
    #[error("{}: scan refused: {source}{}", path.display(), read_as(taken))]
    Refused {
        /// The scan.
        path: PathBuf,
        /// What its reader took where the file does not say it plainly.
        taken: Vec<String>,
        /// What was measured, the limit, the remedy.
        source: Box<ScanError>,
        /// What was found until then.
        found: Box<Found>,
    },
    /// A rim read from a boundary CSV cannot be one.
    #[error("{}: rim refused: {source}", path.display())]
    RimRefused {
        /// The boundary CSV.
        path: PathBuf,
        /// What was measured, the limit, the remedy.
        source: RimError,
    },
}

/// What a reader took, for the end of a message.
fn read_as(taken: &[String]) -> String {
    if taken.is_empty() {
        String::new()
    } else {
        format!(" (as it was read, {})", taken.join("; "))
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

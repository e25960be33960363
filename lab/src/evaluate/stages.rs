//! Where the time of one scan goes, from file to rim, for `evaluate stages`.

use std::path::Path;

use crate::base::clock::{Stage, Stages};
use crate::intake::{IntakeError, rim};
use crate::io::ReadOptions;
use crate::scan::{ScanOptions, ScannedBoundary};

/// Reads a scan and finds its rim; the stages in order, the first is `read`.
///
/// # Errors
/// When the file cannot be read or the scan is refused.
pub fn of_scan(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(ScannedBoundary, Vec<Stage>), IntakeError> {
    let mut stages = Stages::start();
    let (scanned, _) = rim::of_scan_in_stages(path, read, options, &mut stages)?;
    Ok((scanned, stages.noted().to_vec()))
}

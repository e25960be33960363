//! Where the time of one scan goes, from file to rim, for `scan2params-lab stages`.

use std::path::Path;

use scan2params::base::clock::{Stage, Stages};
use scan2params::intake::{IntakeError, rim};
use scan2params::io::ReadOptions;
use scan2params::scan::{ScanOptions, ScannedBoundary};

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

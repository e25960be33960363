//! The files of one result.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::page::options::Extra;
use super::page::{overlay as page_overlay, scan as page_scan};
use super::{inspection, json, overlay};
use crate::intake::IntakeError;
use crate::io::{self, OutputError, WriteError, output};
use crate::job::{JobError, Outcome};

/// Writes `<stem>.params.json`, `<stem>.boundary.csv` and `<stem>.boundary.png` into `folder`,
/// which is made if it is not there; the stem is the input's. Returns their paths.
///
/// # Errors
/// When the system refuses.
pub fn write(outcome: &Outcome, folder: &Path) -> Result<Vec<PathBuf>, JobError> {
    write_as(outcome, folder, &stem(&outcome.job.input))
}

/// Writes `<stem>.report.html`, the page of a scan, into `folder`, which is there. Returns its
/// path.
///
/// # Errors
/// When the system refuses.
pub fn write_page(
    outcome: &Outcome,
    folder: &Path,
    stem: &str,
    extra: &Extra,
) -> Result<PathBuf, WriteError> {
    let path = folder.join(format!("{stem}.{PAGE}"));
    let page = page_scan::page(outcome, extra);
    io::atomically(&path, |out| out.write_all(page.as_bytes()))?;
    Ok(path)
}

/// Writes `<stem>.overlay.svg`, a small drawing of both rims, into `folder`, which is there.
///
/// # Errors
/// When the system refuses.
pub fn write_thumbnail(outcome: &Outcome, folder: &Path, stem: &str) -> Result<(), WriteError> {
    let path = folder.join(format!("{stem}.overlay.svg"));
    let drawing = page_overlay::thumbnail(outcome);
    io::atomically(&path, |out| out.write_all(drawing.as_bytes()))
}

/// Writes `<stem>.inspect.png`, what was found in a scan that was refused, into `folder`, which is
/// made if it is not there; the stem is that scan's. Returns its path; `None` where the job failed
/// for another reason.
///
/// # Errors
/// When the system refuses.
pub fn write_refused(error: &JobError, folder: &Path) -> Result<Option<PathBuf>, WriteError> {
    let JobError::Intake(IntakeError::Refused { path, .. }) = error else { return Ok(None) };
    write_refused_as(error, folder, &stem(path))
}

/// [`write_refused`] with a stem of the caller's.
///
/// # Errors
/// When the system refuses.
pub fn write_refused_as(
    error: &JobError,
    folder: &Path,
    stem: &str,
) -> Result<Option<PathBuf>, WriteError> {
    let JobError::Intake(IntakeError::Refused { source, found, .. }) = error else {
        return Ok(None);
    };
    std::fs::create_dir_all(folder)
        .map_err(|source| WriteError { path: folder.to_owned(), source })?;
    let path = folder.join(refused_name(stem));
    picture(&path, &inspection::draw_refused(found, source))?;
    Ok(Some(path))
}

/// The name of a refused scan's picture.
#[must_use]
pub fn refused_name(stem: &str) -> String {
    format!("{stem}.inspect.png")
}

/// Whether the files of the result of `input` can be written into `folder` without any
/// of `inputs` being lost.
///
/// # Errors
/// When a file would be lost, `folder` is none, or the system refuses.
pub fn check(input: &Path, folder: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
    output::check_folder(folder)?;
    if folder.is_dir() {
        let stem = stem(input);
        let page = folder.join(format!("{stem}.{PAGE}"));
        // Any of the scans may be the one that is refused.
        let scans = inputs.iter().map(PathBuf::as_path).chain([input]);
        let refused = scans.map(|scan| folder.join(refused_name(&self::stem(scan))));
        for path in paths(folder, &stem).into_iter().chain([page]).chain(refused) {
            output::check_file(&path, inputs)?;
        }
    }
    Ok(())
}

/// Ending of a page's name.
const PAGE: &str = "report.html";
/// Ending of a rim's name.
const RIM: &str = "boundary.csv";

/// The name of an input without its ending, of a rim that a result wrote without all of that
/// ending: `x` of `x.ply` and of `x.boundary.csv`; `stdin` for the standard input.
#[must_use]
pub fn stem(input: &Path) -> String {
    if input == Path::new("-") {
        return "stdin".to_owned();
    }
    let name = input.file_name().unwrap_or_default().to_string_lossy();
    match name.strip_suffix(&format!(".{RIM}")) {
        Some(stem) if !stem.is_empty() => stem.to_owned(),
        _ => input.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    }
}

/// params.json, boundary.csv, boundary.png.
fn paths(folder: &Path, stem: &str) -> [PathBuf; 3] {
    ["params.json", RIM, "boundary.png"].map(|ending| folder.join(format!("{stem}.{ending}")))
}

/// [`write()`] with a stem of the caller's.
///
/// # Errors
/// When the system refuses.
pub fn write_as(outcome: &Outcome, folder: &Path, stem: &str) -> Result<Vec<PathBuf>, JobError> {
    let [params, csv, png] = paths(folder, stem);
    std::fs::create_dir_all(folder)
        .map_err(|source| JobError::Write(WriteError { path: folder.to_owned(), source }))?;
    let text = json::params(outcome);
    io::atomically(&params, |out| {
        serde_json::to_writer_pretty(&mut *out, &text)?;
        writeln!(out)
    })?;
    io::boundary_csv::write_oriented(&csv, outcome.rim.boundary(), outcome.rim.orientation())?;
    picture(&png, &overlay::draw(outcome))?;
    Ok(vec![params, csv, png])
}

/// Ending of the pictures that are written.
pub const PICTURE: &str = ".png";

/// Writes a picture as PNG: check a name that a user gave with [`PICTURE`] first.
///
/// # Errors
/// When the system refuses.
pub fn picture(path: &Path, image: &RgbImage) -> Result<(), WriteError> {
    io::write_png(path, image.dimensions().into(), image)
}

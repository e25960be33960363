//! The files of one result.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::{json, overlay};
use crate::io::{self, WriteError};
use crate::job::{JobError, Outcome};

/// Writes `<stem>.params.json`, `<stem>.boundary.csv` and `<stem>.boundary.png` into `folder`,
/// which is made if it is not there; the stem is the input's. Returns their paths.
///
/// # Errors
/// When the system refuses.
pub fn write(outcome: &Outcome, folder: &Path) -> Result<Vec<PathBuf>, JobError> {
    let stem = outcome.job.input.file_stem().unwrap_or_default().to_string_lossy();
    write_as(outcome, folder, &stem)
}

/// [`write`] with a stem of the caller's.
///
/// # Errors
/// When the system refuses.
pub fn write_as(outcome: &Outcome, folder: &Path, stem: &str) -> Result<Vec<PathBuf>, JobError> {
    let path = |ending: &str| folder.join(format!("{stem}.{ending}"));
    let [params, csv, png] = ["params.json", "boundary.csv", "boundary.png"].map(path);
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

/// Writes a picture as PNG, whatever the file's name ends in.
///
/// # Errors
/// When the system refuses.
pub fn picture(path: &Path, image: &RgbImage) -> Result<(), WriteError> {
    io::write_png(path, image.dimensions().into(), image)
}

//! The files of one result.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::{json, overlay};
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

/// Whether the files of the result of `input` can be written into `folder` without any
/// of `inputs` being lost.
///
/// # Errors
/// When a file would be lost, `folder` is none, or the system refuses.
pub fn check(input: &Path, folder: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
    output::check_folder(folder)?;
    if folder.is_dir() {
        for path in paths(folder, &stem(input)) {
            output::check_file(&path, inputs)?;
        }
    }
    Ok(())
}

/// The name of an input without its ending.
fn stem(input: &Path) -> String {
    input.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// params.json, boundary.csv, boundary.png.
fn paths(folder: &Path, stem: &str) -> [PathBuf; 3] {
    ["params.json", "boundary.csv", "boundary.png"]
        .map(|ending| folder.join(format!("{stem}.{ending}")))
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

/// Writes a picture as PNG, whatever the file's name ends in.
///
/// # Errors
/// When the system refuses.
pub fn picture(path: &Path, image: &RgbImage) -> Result<(), WriteError> {
    io::write_png(path, image.dimensions().into(), image)
}

//! What is shown of a calibration: calibration.json, a table, a page, and a picture of each drape.
//!
//! Each fabric by itself is a [`Section`], all of it text, which can be kept; the whole is put
//! together from sections.

mod file;
mod json;
mod picture;
mod table;

pub use file::SCHEMA_VERSION;
pub use json::{json, json_of};
pub use picture::picture;
pub use table::table;

use std::path::{Path, PathBuf};

use crate::calibrate::cloth_file;
use crate::calibrate::result::FabricResult;
use crate::calibrate::run::Refused;
use crate::io::{self, OutputError, WriteError, output};
use crate::report::page;
use crate::report::page::calibration::Source;
use crate::report::section::Section;
use json::of_fabric;
use table::fabric_table;

/// Name of the file that programs read.
pub const JSON: &str = "calibration.json";
/// Name of the page.
pub const PAGE: &str = "report.html";

/// Whether `calibration.json` and the page can be written into `folder` without any of `inputs`
/// being lost.
///
/// # Errors
/// When a file would be lost, `folder` is none, or the system refuses.
pub fn check(folder: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
    output::check_folder(folder)?;
    if folder.is_dir() {
        for name in [JSON, PAGE] {
            output::check_file(&folder.join(name), inputs)?;
        }
    }
    Ok(())
}

/// A fabric's section. Writes its files into `folder`, which is there: `FABRIC.params.json` (the
/// fabric with the effects that were added), `FABRIC_lineN.png` for each simulated drape, and
/// `FABRIC_lineN_after.png` where effects were added.
///
/// # Errors
/// When the system refuses.
pub fn write(fabric: &FabricResult, folder: &Path) -> Result<Section, WriteError> {
    Ok(Section {
        name: fabric.name.clone(),
        json: serde_json::json!(of_fabric(fabric)),
        table: fabric_table(fabric),
        page: page::calibration::section(fabric).into_string(),
        drapes: fabric.drapes.len(),
        fitted: fabric.fitted.is_ok(),
        files: write_files(fabric, folder)?,
    })
}

/// Writes `calibration.json` into `folder`. Returns its path.
///
/// # Errors
/// When the system refuses.
pub fn write_json(
    sections: &[Section],
    refused: &[Refused],
    folder: &Path,
) -> Result<PathBuf, WriteError> {
    let path = folder.join(JSON);
    let text = json(sections, refused);
    io::atomically(&path, |out| {
        serde_json::to_writer_pretty(&mut *out, &text)?;
        writeln!(out)
    })?;
    Ok(path)
}

fn write_files(fabric: &FabricResult, folder: &Path) -> Result<Vec<String>, WriteError> {
    let mut written = Vec::new();
    let found = fabric.after.as_ref().map(|after| &after.fitted);
    if let Some(fitted) = found.or(fabric.fitted.as_ref().ok()) {
        let name = format!("{}.params.json", plain(&fabric.name));
        let text = cloth_file::text(fitted, fabric.fabric_prior.density_known, &fabric.doubts());
        io::atomically(folder.join(&name), |out| {
            serde_json::to_writer_pretty(&mut *out, &text)?;
            writeln!(out)
        })?;
        written.push(name);
    }
    let after = fabric.after.iter().flat_map(|after| &after.drapes);
    let both = fabric.drapes.iter().map(|d| (d, "")).chain(after.map(|d| (d, "_after")));
    for (drape, which) in both {
        let Ok(comparison) = &drape.comparison else { continue };
        let measured = &fabric.measured[drape.measured];
        let name = format!("{}_line{}{which}.png", plain(&fabric.name), measured.entry.line);
        let picture = picture(measured, comparison);
        io::write_png(folder.join(&name), [picture.width(), picture.height()], picture.as_raw())?;
        written.push(name);
    }
    Ok(written)
}

/// Writes `report.html`, the page of a calibration, into `folder`, which is there. Returns its
/// path.
///
/// # Errors
/// When the system refuses.
pub fn write_page(
    sections: &[Section],
    refused: &[Refused],
    source: &Source,
    folder: &Path,
) -> Result<PathBuf, WriteError> {
    let path = folder.join(PAGE);
    let page = page::calibration::page(sections, refused, source);
    io::atomically(&path, |out| out.write_all(page.as_bytes()))?;
    Ok(path)
}

/// A name that any file system takes.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

//! The sheets of a folder of drapes: one mesh per row, with the fabric next to it.
//!
//! In: a row and its mesh. Out: `sheets/drape-NNNNNNNN.ply` (mm, simulation frame, vertices in the
//! order of `simulate`'s OBJ) and `drape-NNNNNNNN.params.json`, the row's fabric and how the drape
//! ended. N is the row's index. Both are on the disk before the row is kept.

use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::error::GenerateError;
use super::manifest::{MANIFEST_FILE, Manifest};
use super::row::Row;
use crate::base::units::M_PER_MM;
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::geom::{Cloud, Mesh};
use crate::io::part::Part;
use crate::io::ply_to;

/// Folder of the sheets in a folder of drapes.
pub const SHEETS_FOLDER: &str = "sheets";
const MESH_ENDING: &str = ".ply";
const PARAMS_ENDING: &str = ".params.json";

/// What a folder of `generate` has for a virtual camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Sheets {
    /// The meshes, in order of index; next to each lies its params.json.
    Here(Vec<PathBuf>),
    /// Rims only; with this command they get their sheets.
    RimsOnly {
        /// A command line.
        command: String,
    },
}

/// Makes the folder of the sheets.
pub(super) fn begin(out: &Path) -> Result<PathBuf, GenerateError> {
    let folder = out.join(SHEETS_FOLDER);
    std::fs::create_dir_all(&folder).map_err(GenerateError::io(&folder))?;
    Ok(folder)
}

fn path(folder: &Path, index: u64, ending: &str) -> PathBuf {
    folder.join(format!("drape-{index:08}{ending}"))
}

/// Whether the sheet of a sample was written.
pub(super) fn is_there(folder: &Path, index: u64) -> bool {
    [MESH_ENDING, PARAMS_ENDING].iter().all(|ending| path(folder, index, ending).is_file())
}

/// Writes the sheet of a row, and its fabric.
pub(super) fn write(folder: &Path, row: &Row, sheet: &Mesh) -> Result<(), GenerateError> {
    let cloud = Cloud {
        points: sheet.vertices.clone(),
        triangles: sheet.triangles.clone(),
        ..Cloud::default()
    };
    write_durably(&path(folder, row.index, MESH_ENDING), |out| {
        ply_to(out, &cloud, 1.0 / M_PER_MM)
    })?;
    write_durably(&path(folder, row.index, PARAMS_ENDING), |out| {
        serde_json::to_writer_pretty(&mut *out, &params(row))?;
        out.write_all(b"\n")
    })
}

fn write_durably(
    path: &Path,
    write: impl FnOnce(&mut dyn std::io::Write) -> std::io::Result<()>,
) -> Result<(), GenerateError> {
    let written = || {
        let part = Part::of(path)?;
        let mut out = BufWriter::new(part.file());
        write(&mut out)?;
        out.flush()?;
        drop(out);
        part.finish_durably()
    };
    written().map_err(GenerateError::io(path))
}

/// The row's fabric as a params.json has it, and how the drape ended.
fn params(row: &Row) -> Value {
    let values = row.fabric.to_paper_units();
    let entry = |k: usize| json!({ "value": values[k], "unit": TABLE_2[k].unit });
    let stiffnesses: Map<String, Value> =
        (0..STIFFNESSES).map(|k| (TABLE_2[k].key.to_owned(), entry(k))).collect();
    json!({
        "parameters": stiffnesses,
        "density": entry(STIFFNESSES),
        "drape": {
            "index": row.index,
            "fabric_index": row.fabric_index,
            "stop": row.drape.ending.name(),
            "converged": row.drape.ending.is_converged(),
        },
    })
}

/// The sheets of a folder of `generate`, or of its folder of sheets; `None` for another folder.
pub(super) fn of_folder(folder: &Path) -> Option<std::io::Result<Sheets>> {
    let manifest = |folder: &Path| {
        let has_one = folder.join(MANIFEST_FILE).is_file();
        has_one.then(|| Manifest::read(folder).ok()).flatten()
    };
    if let Some(manifest) = manifest(folder) {
        return Some(found(folder, &folder.join(SHEETS_FOLDER), &manifest));
    }
    // `drapes/sheets` or, from within it, `.`
    let folder = folder.canonicalize().ok()?;
    let drapes = folder.parent().filter(|_| folder.ends_with(SHEETS_FOLDER))?;
    manifest(drapes).map(|manifest| found(drapes, &folder, &manifest))
}

fn found(drapes: &Path, sheets: &Path, manifest: &Manifest) -> std::io::Result<Sheets> {
    let mut meshes = Vec::new();
    if sheets.is_dir() {
        for entry in std::fs::read_dir(sheets)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with("drape-") && name.ends_with(MESH_ENDING) {
                meshes.push(path);
            }
        }
    }
    if !meshes.is_empty() {
        meshes.sort();
        return Ok(Sheets::Here(meshes));
    }
    let out = drapes.display();
    // A folder of an older schema is not continued.
    let ending = if manifest.is_older() { "-sheets" } else { "" };
    let (flags, count) = (manifest.flags(), manifest.count);
    let command =
        format!("scan2params generate {flags} --count {count} --sheets --out {out}{ending}");
    Ok(Sheets::RimsOnly { command })
}

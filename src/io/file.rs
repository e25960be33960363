//! One file that is one scan, or one view of it.

use std::path::Path;

use super::assemble::{ReadNotes, finish};
use super::bytes::{is_regular, regular_file, standard_input, text_bytes};
use super::error::{At, Fault, shown};
use super::format::{Format, foreign_content};
use super::options::ReadOptions;
use super::{depth, e57, glb, las, obj, pcd, ply, stl, xyz};
use crate::geom::Cloud;

/// Reads a file that is one scan or one view, in the format that its extension names.
pub(super) fn read_file(path: &Path, options: &ReadOptions) -> Result<(Cloud, ReadNotes), At> {
    let Some(named) = Format::of_extension(path) else {
        if is_standard_input(path) {
            let fault = "the standard input needs --format, as in `- --format ply`";
            return Err(Fault::Layout(fault.to_owned()).anywhere());
        }
        // A missing file is that, with any name.
        is_regular(path)?;
        return Err(unsupported(path).anywhere());
    };
    read_bytes(&regular_file(path)?, named, options)
}

/// Reads a file, or for `-` the standard input, as the format that the caller names.
pub(super) fn read_as(
    path: &Path,
    format: Format,
    options: &ReadOptions,
) -> Result<(Cloud, ReadNotes), At> {
    let bytes = if is_standard_input(path) { standard_input() } else { regular_file(path) };
    read_bytes(&bytes?, format, options)
}

/// Whether a path stands for the standard input: no file without an ending can be read.
pub(super) fn is_standard_input(path: &Path) -> bool {
    path == Path::new("-")
}

/// What is wrong with a file of this name.
pub(super) fn unsupported(path: &Path) -> Fault {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    Fault::Extension { found: shown(extension.as_bytes()) }
}

/// Reads the bytes of a file of the format `named` by its extension.
///
/// # Errors
/// As [`super::read_scan`], without the file's name.
pub(super) fn read_bytes(
    bytes: &[u8],
    named: Format,
    options: &ReadOptions,
) -> Result<(Cloud, ReadNotes), At> {
    if bytes.is_empty() {
        return Err(Fault::EmptyFile.anywhere());
    }
    if let Some(what) = foreign_content(bytes) {
        return Err(Fault::Foreign { what }.anywhere());
    }
    // Binary formats begin with a mark of their own, which no UTF-16 has.
    let text = text_bytes(bytes)?;
    let bytes = text.as_ref();
    if let Some(content) = Format::of_content(bytes).filter(|content| *content != named) {
        return Err(Fault::Misnamed { content: content.extension() }.anywhere());
    }
    let raw = match named {
        Format::Ply => ply::read(bytes),
        Format::Obj => obj::read(bytes),
        Format::Pcd => pcd::read(bytes),
        Format::Stl => stl::read(bytes),
        Format::Glb => glb::read(bytes),
        Format::E57 => e57::read(bytes),
        Format::Las => las::read(bytes),
        Format::DepthPng => depth::read(bytes, options),
        Format::Views => return Err(not_a_file()),
        Format::Xyz => xyz::read(bytes),
    }?;
    finish(raw, named)
}

fn not_a_file() -> At {
    let fault = "a set of views names files and is read from its path, not from bytes";
    Fault::Layout(fault.to_owned()).anywhere()
}

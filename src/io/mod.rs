//! Files in and out: scans (PLY, OBJ, PCD, STL, XYZ), meshes, the boundary as CSV.
//!
//! In: a path. Out: a [`Cloud`] in the file's own unit and axes (which nobody
//! can trust: `scan` finds unit and up from the plate and the floor), with
//! [`ReadNotes`] on what was left out. Formats after their published texts:
//! PLY after Turk's "The PLY Polygon File Format", PCD after PCL's file format
//! page, OBJ after Wavefront's, STL after 3D Systems'.
//!
//! Fails with a [`ReadError`] that names the file, the place and the remedy. No
//! input makes a reader panic, and what a reader allocates is bounded by the
//! size of the file, not by what its header announces.
//!
//! Writes go to `<name>.part`, which is renamed when it is complete.

mod assemble;
pub mod boundary_csv;
pub mod density_csv;
mod error;
mod lzf;
mod obj;
mod pcd;
mod ply;
mod ply_header;
mod stl;
mod tokens;
mod write;
mod xyz;

use std::path::Path;

pub use assemble::{LARGEST_COORDINATE, ReadNotes};
pub use error::{Fault, Place, ReadError, WriteError};
pub use write::{atomically, write_obj, write_ply};

use crate::geom::Cloud;
use assemble::finish;
use error::At;

/// The formats that [`read_scan`] reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Polygon file format: ascii, binary of both byte orders.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Point cloud library: ascii, binary, `binary_compressed`.
    Pcd,
    /// Stereolithography: ascii, binary.
    Stl,
    /// Lines of `x y z`, with or without colours.
    Xyz,
}

/// Extensions read, for messages.
pub const SUPPORTED: &str = ".ply, .obj, .pcd, .stl, .xyz, .asc, .pts, .txt, .csv";

impl Format {
    fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "ply" => Self::Ply,
            "obj" => Self::Obj,
            "pcd" => Self::Pcd,
            "stl" => Self::Stl,
            "xyz" | "asc" | "pts" | "txt" | "csv" => Self::Xyz,
            _ => return None,
        })
    }

    /// The format that the first bytes give away; OBJ and XYZ have no mark.
    fn of_content(bytes: &[u8]) -> Option<Self> {
        let starts = |mark: &[u8]| bytes.starts_with(mark);
        if starts(b"ply\n") || starts(b"ply\r") || starts(b"ply ") {
            Some(Self::Ply)
        } else if starts(b"# .PCD") || starts(b"VERSION .7") || starts(b"VERSION 0.7") {
            Some(Self::Pcd)
        } else {
            None
        }
    }

    /// The extension by which the format goes.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => ".ply",
            Self::Obj => ".obj",
            Self::Pcd => ".pcd",
            Self::Stl => ".stl",
            Self::Xyz => ".xyz",
        }
    }
}

/// What a file is known to be when it is none of ours, for the remedy.
fn foreign_content(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 6] = [
        (b"\x1f\x8b", "gzip-compressed data; unpack it first"),
        (b"PK\x03\x04", "a zip archive; unpack it first"),
        (b"\x89PNG", "a PNG image, not a point cloud"),
        (b"\xff\xd8\xff", "a JPEG image, not a point cloud"),
        (b"glTF", "a GLB scene; export it as PLY"),
        (b"version https://git-lfs", "a Git LFS pointer; run `git lfs pull`"),
    ];
    known.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, name)| *name)
}

/// Reads a scan: its points, their colours and triangles if the file has them,
/// in the file's unit and axes.
///
/// # Errors
/// See [`Fault`]: a file that is missing, of another format, cut off, damaged,
/// or without points.
pub fn read_scan(path: impl AsRef<Path>) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = path.as_ref();
    read_unnamed(path).map_err(|at| at.in_file(path))
}

fn read_unnamed(path: &Path) -> Result<(Cloud, ReadNotes), At> {
    let Some(named) = Format::of_extension(path) else {
        // A missing file is that, whatever its name.
        is_regular(path)?;
        return Err(unsupported(path).anywhere());
    };
    read_bytes(&regular_file(path)?, named)
}

/// The bytes of a file.
///
/// # Errors
/// When it is missing, no regular file, or the system refuses.
pub fn bytes_of(path: impl AsRef<Path>) -> Result<Vec<u8>, ReadError> {
    let path = path.as_ref();
    regular_file(path).map_err(|at| at.in_file(path))
}

fn is_regular(path: &Path) -> Result<(), At> {
    let meta = std::fs::metadata(path).map_err(At::opening)?;
    if meta.is_file() { Ok(()) } else { Err(Fault::NotAFile.anywhere()) }
}

fn regular_file(path: &Path) -> Result<Vec<u8>, At> {
    is_regular(path)?;
    std::fs::read(path).map_err(At::opening)
}

fn unsupported(path: &Path) -> Fault {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    Fault::Extension { found: error::shown(extension.as_bytes()) }
}

/// Reads the bytes of a file of the format `named` by its extension.
///
/// # Errors
/// As [`read_scan`], without the file's name.
fn read_bytes(bytes: &[u8], named: Format) -> Result<(Cloud, ReadNotes), At> {
    if bytes.is_empty() {
        return Err(Fault::EmptyFile.anywhere());
    }
    if let Some(what) = foreign_content(bytes) {
        return Err(Fault::Foreign { what }.anywhere());
    }
    // A UTF-8 byte-order mark stands before text of any kind.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if let Some(content) = Format::of_content(bytes).filter(|content| *content != named) {
        return Err(Fault::Misnamed { content: content.extension() }.anywhere());
    }
    let raw = match named {
        Format::Ply => ply::read(bytes),
        Format::Obj => obj::read(bytes),
        Format::Pcd => pcd::read(bytes),
        Format::Stl => stl::read(bytes),
        Format::Xyz => xyz::read(bytes),
    }?;
    finish(raw, named)
}

/// Reads bytes as if from a file with the extension `extension`; for fuzzing.
///
/// # Errors
/// As [`read_scan`]; the path in the error is `bytes.<extension>`.
#[doc(hidden)]
pub fn read_scan_bytes(bytes: &[u8], extension: &str) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = Path::new("bytes").with_extension(extension);
    match Format::of_extension(&path) {
        Some(format) => read_bytes(bytes, format),
        None => Err(unsupported(&path).anywhere()),
    }
    .map_err(|at| at.in_file(&path))
}

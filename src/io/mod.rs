//! Files in and out: scans (PLY, OBJ, PCD, STL, GLB, XYZ, depth images, sets of
//! views), meshes, tables.
//!
//! In: a path, and [`ReadOptions`] for what a depth image does not say itself.
//! Out: a [`Cloud`] in the file's own unit and axes (which nobody can trust: `scan`
//! finds unit and up from the plate and the floor), with [`ReadNotes`] on what was
//! left out. Formats after their published texts: PLY after Turk's "The PLY Polygon
//! File Format", PCD after PCL's file format page, OBJ after Wavefront's, STL after
//! 3D Systems', GLB after Khronos' glTF 2.0. `docs/formats.md` has them for users.
//!
//! Fails with a [`ReadError`] that names the file, the place and the remedy. No
//! input makes a reader panic, and what a reader allocates is bounded by the
//! size of the file, not by what its header announces.
//!
//! Writes go to `<name>.part`, which is renamed when it is complete ([`atomically`]);
//! [`output`] finds out beforehand whether they can be.

mod assemble;
pub mod boundary_csv;
pub mod density_csv;
mod depth;
mod distortion;
mod error;
mod glb;
mod glb_data;
pub mod intrinsics;
mod lock;
mod lzf;
mod obj;
pub mod output;
pub(crate) mod part;
mod pcd;
mod ply;
mod ply_header;
mod sensors;
mod stl;
pub(crate) mod table;
mod tokens;
mod views;
mod write;
mod xyz;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use assemble::{LARGEST_COORDINATE, ReadNotes};
pub use error::{Fault, Place, ReadError, WriteError};
pub use intrinsics::Intrinsics;
pub use lock::{Lock, LockError};
pub use output::OutputError;
pub use part::{abandon_unfinished, atomically};
pub use sensors::DepthSource;
pub use views::{VIEWS_FILE, VIEWS_SCHEMA};
#[cfg(feature = "picture")]
pub use write::write_png;
pub use write::{write_depth_png, write_obj, write_ply};

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
    /// Binary glTF 2.0.
    Glb,
    /// Lines of `x y z`, with or without colours.
    Xyz,
    /// A 16-bit depth image.
    DepthPng,
    /// A `views.json`, or a folder of views.
    Views,
}

/// What a depth image does not say itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReadOptions {
    /// The camera of depth images that no `views.json` says.
    pub intrinsics: Option<Intrinsics>,
    /// Units of depth in a metre.
    pub depth_scale: f64,
    /// Drop pixels of depth images of whose eight neighbours fewer than three lie
    /// within this depth \[m\]: flying pixels between cloth and background. `None`
    /// keeps all.
    pub max_jump_m: Option<f64>,
}

impl Default for ReadOptions {
    /// Millimetres, as most depth cameras write.
    fn default() -> Self {
        Self { intrinsics: None, depth_scale: 1000.0, max_jump_m: None }
    }
}

/// Extensions read, for messages.
pub const SUPPORTED: &str =
    ".ply, .obj, .pcd, .stl, .glb, .xyz, .asc, .pts, .txt, .csv, .png (16-bit depth), views.json";

impl Format {
    fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "ply" => Self::Ply,
            "obj" => Self::Obj,
            "pcd" => Self::Pcd,
            "stl" => Self::Stl,
            "glb" => Self::Glb,
            "png" => Self::DepthPng,
            "json" => Self::Views,
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
        } else if starts(b"glTF") {
            Some(Self::Glb)
        } else if starts(b"\x89PNG") {
            Some(Self::DepthPng)
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
            Self::Glb => ".glb",
            Self::Xyz => ".xyz",
            Self::DepthPng => ".png",
            Self::Views => ".json",
        }
    }
}

/// What a file is known to be when it is none of ours, for the remedy.
fn foreign_content(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 4] = [
        (b"\x1f\x8b", "gzip-compressed data; unpack it first"),
        (b"PK\x03\x04", "a zip archive; unpack it first"),
        (b"\xff\xd8\xff", "a JPEG image, not a point cloud"),
        (b"version https://git-lfs", "a Git LFS pointer; run `git lfs pull`"),
    ];
    known.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, name)| *name)
}

/// Reads a scan: its points, their colours and triangles if the file has them,
/// in the file's unit and axes. Depth images and views: in metres.
///
/// # Errors
/// See [`Fault`]: a file that is missing, of another format, cut off, damaged,
/// or without points.
pub fn read_scan(path: impl AsRef<Path>) -> Result<(Cloud, ReadNotes), ReadError> {
    read_scan_with(path, &ReadOptions::default())
}

/// [`read_scan`] of a file that may be a depth image.
///
/// # Errors
/// As [`read_scan`], and when a depth image's camera is not known.
pub fn read_scan_with(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = path.as_ref();
    match views::list(path) {
        Some(list) => views::read(&list?, options),
        None => read_file(path, options).map_err(|at| at.in_file(path)),
    }
}

/// The files that a scan is made of: itself, or a set of views and what it names.
///
/// # Errors
/// When a set of views cannot be read.
pub fn files_of(path: impl AsRef<Path>) -> Result<Vec<PathBuf>, ReadError> {
    let path = path.as_ref();
    match views::list(path) {
        Some(list) => Ok(list?.files()),
        None => Ok(vec![path.to_owned()]),
    }
}

/// Whether a folder is a scan: a set of views.
#[must_use]
pub fn is_views_folder(path: impl AsRef<Path>) -> bool {
    views::is_folder(path.as_ref())
}

fn read_file(path: &Path, options: &ReadOptions) -> Result<(Cloud, ReadNotes), At> {
    let Some(named) = Format::of_extension(path) else {
        // A missing file is that, whatever its name.
        is_regular(path)?;
        return Err(unsupported(path).anywhere());
    };
    read_bytes(&regular_file(path)?, named, options)
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
fn read_bytes(
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
        Format::Glb => glb::read(bytes),
        Format::DepthPng => depth::read(bytes, options),
        Format::Views => return Err(views::not_a_file()),
        Format::Xyz => xyz::read(bytes),
    }?;
    finish(raw, named)
}

/// Reads bytes as if from a file with the extension `extension`, a depth image as
/// if from a camera of 585 pixels; for fuzzing.
///
/// # Errors
/// As [`read_scan`]; the path in the error is `bytes.<extension>`.
#[doc(hidden)]
pub fn read_scan_bytes(bytes: &[u8], extension: &str) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = Path::new("bytes").with_extension(extension);
    let intrinsics = Intrinsics::pinhole([585.0; 2], [320.0, 240.0]).ok();
    let options = ReadOptions { intrinsics, max_jump_m: Some(0.1), ..ReadOptions::default() };
    match Format::of_extension(&path) {
        Some(format) => read_bytes(bytes, format, &options),
        None => Err(unsupported(&path).anywhere()),
    }
    .map_err(|at| at.in_file(&path))
}

/// Reads bytes as a `views.json`, without the files it names; for fuzzing.
///
/// # Errors
/// What is wrong with it; the path in the error is `views.json`.
#[doc(hidden)]
pub fn read_views_bytes(bytes: &[u8]) -> Result<usize, ReadError> {
    views::parse(bytes, Path::new(VIEWS_FILE)).map(|list| list.files().len())
}

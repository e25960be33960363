//! Files in and out: scans (PLY, OBJ, PCD, STL, GLB, E57, LAS, LAZ, XYZ, depth images,
//! sets of views), meshes, tables.
//!
//! In: a path, and [`ReadOptions`] for what a depth image does not say itself.
//! Out: a [`Cloud`] in the file's own unit and axes (which nobody can trust: `scan`
//! finds unit and up from the plate and the floor), with [`ReadNotes`] on what was
//! left out. Formats after their published texts: PLY after Turk's "The PLY Polygon
//! File Format", PCD after PCL's file format page, OBJ after Wavefront's, STL after
//! 3D Systems', GLB after Khronos' glTF 2.0, E57 after ASTM E2807,
//! LAS after the ASPRS' specification 1.4. `docs/formats.md` has them for users.
//!
//! Fails with a [`ReadError`] that names the file, the place and the remedy. No
//! input makes a reader panic, and what a reader allocates is bounded by the
//! size of the file, not by what its header announces.
//!
//! Writes go to `<name>.part`, which is renamed when it is complete ([`atomically`]);
//! [`output`] finds out beforehand whether they can be.

mod assemble;
pub mod boundary_csv;
mod bytes;
mod cells;
mod columns;
pub mod density_csv;
mod depth;
mod distortion;
mod e57;
mod error;
mod file;
mod format;
mod glb;
mod glb_data;
pub mod intrinsics;
mod las;
mod las_header;
mod laz;
mod lock;
mod lzf;
mod obj;
mod obj_texture;
mod options;
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

pub use assemble::{LARGEST_COORDINATE, ReadNotes, ViewNote, checked};
pub use error::{Fault, Place, ReadError, WriteError};
pub use format::{Format, SUPPORTED};
pub use intrinsics::Intrinsics;
pub use lock::{Lock, LockError};
pub use obj_texture::read_obj_texture;
pub use options::ReadOptions;
pub use output::OutputError;
pub use part::{abandon_unfinished, atomically};
pub use sensors::DepthSource;
pub use views::{
    SeenView, SeenViews, Turntable, VIEWS_FILE, VIEWS_SCHEMA, joined_as_posed, opengl,
};
#[cfg(feature = "dataset")]
pub(crate) use write::ply_to;
#[cfg(feature = "picture")]
pub use write::write_png;
pub use write::{stl_bytes, write_depth_png, write_obj, write_ply};

use crate::geom::Cloud;
use bytes::regular_file;
use error::At;
use file::{read_as, read_bytes, read_file, unsupported};

/// Reads a scan: its points, their colours and triangles if the file has them,
/// in the file's unit and axes. Depth images and views: in metres.
///
/// # Errors
/// See [`Fault`]: a file that is missing, of another format, cut off, damaged,
/// or without points.
pub fn read_scan(path: impl AsRef<Path>) -> Result<(Cloud, ReadNotes), ReadError> {
    read_scan_with(path, &ReadOptions::default())
}

/// [`read_scan`] of a file that may be a depth image, or that does not say its format; the path `-`
/// with a format is the standard input.
///
/// # Errors
/// As [`read_scan`], and when a depth image's camera is not known.
pub fn read_scan_with(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = path.as_ref();
    if let Some(format) = options.format {
        return read_as(path, format, options).map_err(|at| at.in_file(path));
    }
    match views::list(path) {
        Some(list) => {
            let SeenViews { views, turntable } = views::read(&list?, options)?;
            if turntable.is_some() {
                let fault = "its views have no poses; `merge` brings them together".to_owned();
                return Err(Fault::Layout(fault).anywhere().in_file(path));
            }
            joined_as_posed(views).ok_or_else(|| Fault::NoPoints.anywhere().in_file(path))
        }
        None => read_file(path, options).map_err(|at| at.in_file(path)),
    }
}

/// The views of a set, each in its camera's frame; `None` for a path that is no set of views.
///
/// # Errors
/// When the set or one of its files cannot be read.
pub fn read_views(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Option<Result<SeenViews, ReadError>> {
    let listed = options.format.is_none().then(|| views::list(path.as_ref())).flatten()?;
    Some(listed.and_then(|list| views::read(&list, options)))
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

/// The bytes of a file.
///
/// # Errors
/// When it is missing, no regular file, or the system refuses.
pub fn bytes_of(path: impl AsRef<Path>) -> Result<Vec<u8>, ReadError> {
    let path = path.as_ref();
    regular_file(path).map_err(|at| at.in_file(path))
}

/// Reads bytes as if from a file with the extension `extension`, a depth image as
/// if from a camera of 8 x 6 pixels; for fuzzing.
///
/// # Errors
/// As [`read_scan`]; the path in the error is `bytes.<extension>`.
#[doc(hidden)]
pub fn read_scan_bytes(bytes: &[u8], extension: &str) -> Result<(Cloud, ReadNotes), ReadError> {
    let path = Path::new("bytes").with_extension(extension);
    let intrinsics = Intrinsics::pinhole([585.0; 2], [3.5, 2.5]).ok();
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

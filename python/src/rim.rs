//! A rim found in a scan.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::boundary::Boundary;
use crate::given::{Known, intake_error};
use crate::work;

/// Finds the rim of a draped specimen in a scan.
///
/// Parameters
/// ----------
/// scan : array_like of shape (N, 3), str, os.PathLike, Scan or Boundary
///     Points in any frame; the path of a scan or of a rim's table; what `augment` made.
/// triangles : array_like of int, shape (M, 3), optional
///     Indices of the points: the scan is a mesh, whose own edge is the rim.
/// colors : array_like of int, shape (N, 3), optional
///     Red, green, blue of each point, 0 to 255; needed for `mark`.
/// unit : {'m', 'mm', 'cm', 'in', 'guess'}, optional
///     Unit of the coordinates. If not given, metres for arrays; of a file it is guessed from the
///     scene.
/// warp_toward : str or array_like of shape (3,), optional
///     Where the warp points in the scan's frame: ``'+x'``, ``'-y'``, ``'x,y,z'``, a bearing in
///     degrees as text, or a vector. Without it and without `mark`, weft and warp may be exchanged.
/// mark : str, optional
///     Colour of a mark in the middle of the side to which the warp runs: ``'red'``, ... or
///     ``'#rrggbb'``.
/// crop_radius_m : float, optional
///     Look at what lies within this radius of the plate only.
/// crop_box : array_like of shape (2, 3), optional
///     Look at a box only: two opposite corners, in the frame and unit of the coordinates.
/// up : str or array_like of shape (3,), optional
///     Which way is up in the scan's frame, to 20 degrees: ``'z'``, ``'-y'``, or a vector.
/// plate_near : array_like of shape (3,), optional
///     Where the plate is, to 100 mm, in the frame and unit of the coordinates.
/// specimen_side_m, plate_radius_m : float, optional
///     Side of the square specimen and radius of the plate; 0.3 and 0.05 if not given. `estimate`
///     takes these only.
/// seed : int, optional
///     Seed of the plane search.
/// intrinsics : str or os.PathLike, optional
///     File with the camera of a depth image.
/// depth_scale : float, optional
///     Units of depth in a metre, in depth images; 1000 if not given.
/// name : str, optional
///     What stands for an array in messages and results.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// Boundary
///     244 points in the simulation frame, each with a standard deviation and whether it was seen.
///
/// Raises
/// ------
/// ScanRefused
///     The scan cannot be trusted; the message says what was measured, where, and what to do.
/// InvalidInput
///     Arrays or options that cannot be meant.
/// FileError
///     A file that cannot be read.
#[pyfunction]
#[pyo3(signature = (scan, *, triangles=None, colors=None, unit=None, warp_toward=None, mark=None, crop_radius_m=None, crop_box=None, up=None, plate_near=None, specimen_side_m=None, plate_radius_m=None, seed=None, intrinsics=None, depth_scale=None, name=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn boundary(
    scan: &Bound<'_, PyAny>,
    triangles: Option<&Bound<'_, PyAny>>,
    colors: Option<&Bound<'_, PyAny>>,
    unit: Option<&str>,
    warp_toward: Option<&Bound<'_, PyAny>>,
    mark: Option<&str>,
    crop_radius_m: Option<f64>,
    crop_box: Option<&Bound<'_, PyAny>>,
    up: Option<&Bound<'_, PyAny>>,
    plate_near: Option<&Bound<'_, PyAny>>,
    specimen_side_m: Option<f64>,
    plate_radius_m: Option<f64>,
    seed: Option<u64>,
    intrinsics: Option<PathBuf>,
    depth_scale: Option<f64>,
    name: Option<PathBuf>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Boundary> {
    let known = Known {
        triangles,
        colors,
        unit,
        warp_toward,
        mark,
        crop_radius_m,
        crop_box,
        up,
        plate_near,
        specimen_side_m,
        plate_radius_m,
        seed,
        intrinsics,
        depth_scale,
        name,
    };
    let given = known.of(scan)?;
    let (name, file, options) = (given.name(), given.file(), given.scan.clone());
    let in_memory = given.in_memory();
    let rim = work::run(scan.py(), progress, |tell| {
        tell.say("looking for the rim");
        given.rim()
    })?;
    Ok(Boundary::of(name, file, rim.map_err(intake_error(in_memory))?, options))
}

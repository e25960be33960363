//! numpy arrays in and out.

use numpy::ndarray::{Array2, Array3};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use scan2params::{Isometry3, Point3, Vector3};

use crate::errors::invalid;

/// An argument as an array of this type of numbers, from anything: a list, another type, a view.
fn array<'py, T: numpy::Element>(
    name: &str,
    given: &Bound<'py, PyAny>,
    kind: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let py = given.py();
    let options = PyDict::new(py);
    options.set_item("dtype", kind)?;
    let made = py.import("numpy")?.call_method("asarray", (given,), Some(&options));
    let made = made.map_err(|error| invalid(format!("{name}: no array of {kind} ({error})")))?;
    Ok(made.extract::<PyReadonlyArrayDyn<'py, T>>()?)
}

/// `(N, 3)` numbers.
fn rows<T: numpy::Element + Copy>(
    name: &str,
    given: &Bound<'_, PyAny>,
    kind: &str,
) -> PyResult<Vec<[T; 3]>> {
    let array = array::<T>(name, given, kind)?;
    let view = array.as_array();
    if view.ndim() != 2 || view.shape()[1] != 3 {
        return Err(invalid(format!("{name}: shape {}; give (N, 3)", shape(view.shape()))));
    }
    if view.shape()[0] == 0 {
        return Err(invalid(format!("{name}: no rows; give at least one")));
    }
    Ok(view.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// A shape as Python writes it.
fn shape(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        more => {
            format!("({})", more.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
        }
    }
}

/// `(N, 3)` points; NaN are let through, since readers of sensors drop them.
pub(crate) fn points(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Point3>> {
    Ok(rows::<f64>(name, given, "float64")?.into_iter().map(Point3::from).collect())
}

/// `(N, 3)` or `(n, m, 3)` points, row after row; all of them finite.
pub(crate) fn finite_points(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Point3>> {
    let flat = array::<f64>(name, given, "float64")?;
    let view = flat.as_array();
    let [.., 3] = view.shape() else {
        return Err(invalid(format!("{name}: shape {}; give (..., 3)", shape(view.shape()))));
    };
    let numbers: Vec<f64> = view.iter().copied().collect();
    if let Some(at) = numbers.iter().position(|number| !number.is_finite()) {
        return Err(invalid(format!("{name}: point {} is not finite", at / 3)));
    }
    Ok(numbers.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect())
}

/// `(N, 3)` indices of vertices.
pub(crate) fn triangles(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let rows = rows::<i64>(name, given, "int64")?;
    let index = |v: i64| {
        u32::try_from(v).map_err(|_| invalid(format!("{name}: {v} is no index of a vertex")))
    };
    rows.into_iter().map(|[a, b, c]| Ok([index(a)?, index(b)?, index(c)?])).collect()
}

/// `(N, 3)` colours, 0 to 255.
pub(crate) fn colors(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[u8; 3]>> {
    let rows = rows::<f64>(name, given, "float64")?;
    let channel = |v: f64| {
        let fits = (0.0..=255.0).contains(&v) && v.fract() == 0.0;
        fits.then_some(v as u8).ok_or_else(|| {
            invalid(format!(
                "{name}: {v} is none of 0 to 255; give red, green, blue as whole numbers"
            ))
        })
    };
    rows.into_iter().map(|[r, g, b]| Ok([channel(r)?, channel(g)?, channel(b)?])).collect()
}

/// `count` numbers, each at least `least`.
pub(crate) fn numbers(
    name: &str,
    given: &Bound<'_, PyAny>,
    count: usize,
    least: f64,
) -> PyResult<Vec<f64>> {
    let array = array::<f64>(name, given, "float64")?;
    let view = array.as_array();
    if view.shape() != [count] {
        return Err(invalid(format!("{name}: shape {}; give ({count},)", shape(view.shape()))));
    }
    match view.iter().find(|v| !v.is_finite() || **v < least) {
        Some(v) => Err(invalid(format!("{name}: {v}; give finite numbers of at least {least}"))),
        None => Ok(view.iter().copied().collect()),
    }
}

/// Points or moves as `(N, 3)`.
pub(crate) fn of_points<'py>(
    py: Python<'py>,
    points: impl Iterator<Item = [f64; 3]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    of_rows(py, points.collect())
}

/// Rows as `(N, 3)`.
pub(crate) fn of_rows<T: numpy::Element + Copy>(
    py: Python<'_>,
    rows: Vec<[T; 3]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    let flat = rows.into_iter().flatten().collect();
    let array = Array2::from_shape_vec((count, 3), flat).map_err(crate::errors::internal)?;
    Ok(PyArray2::from_owned_array(py, array))
}

/// A square of points as `(n, n, 3)`.
pub(crate) fn of_sheet(
    py: Python<'_>,
    side: usize,
    points: impl Iterator<Item = [f64; 3]>,
) -> PyResult<Bound<'_, PyArray3<f64>>> {
    let flat = points.flatten().collect();
    let array = Array3::from_shape_vec((side, side, 3), flat).map_err(crate::errors::internal)?;
    Ok(PyArray3::from_owned_array(py, array))
}

/// Moves of points with each of several parameters, as `(N, 3, k)`.
pub(crate) fn of_moves<'py>(py: Python<'py>, moves: &[Vec<Vector3>]) -> Bound<'py, PyArray3<f64>> {
    let points = moves.first().map_or(0, Vec::len);
    let at = |(i, c, k): (usize, usize, usize)| moves[k][i][c];
    PyArray3::from_owned_array(py, Array3::from_shape_fn((points, 3, moves.len()), at))
}

/// A rigid motion as a 4 x 4 matrix.
pub(crate) fn of_motion<'py>(py: Python<'py>, motion: &Isometry3) -> Bound<'py, PyArray2<f64>> {
    let matrix = motion.to_homogeneous();
    PyArray2::from_owned_array(py, Array2::from_shape_fn((4, 4), |at| matrix[at]))
}

/// Numbers as `(N,)`.
pub(crate) fn of_numbers<T: numpy::Element>(
    py: Python<'_>,
    numbers: Vec<T>,
) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, numbers)
}

//! Pickling: what a process sends to another, by `__reduce__` of the classes that hold plain data.
//!
//! A class gives `_restored`, a class method, with the arguments that make the same object again.
//! Numbers go as arrays or as JSON, both of which keep every bit.

use numpy::{PyReadonlyArray2, ndarray::ArrayView2};
use pyo3::PyClass;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use scan2params::Point3;
use serde_json::Value;

use crate::errors::internal;

/// What pickle calls to make an object of a class again.
pub(crate) fn restorer<T: PyClass>(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    py.get_type::<T>().getattr("_restored")
}

/// The exception of a class that holds more than plain data.
pub(crate) fn refused(class: &str, instead: &str) -> PyErr {
    PyTypeError::new_err(format!("a {class} holds the whole scan and cannot be pickled; {instead}"))
}

/// Rows of an array.
pub(crate) fn rows<T: numpy::Element + Copy>(array: &PyReadonlyArray2<'_, T>) -> Vec<[T; 3]> {
    let view: ArrayView2<'_, T> = array.as_array();
    view.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect()
}

/// Points of an array.
pub(crate) fn points(array: &PyReadonlyArray2<'_, f64>) -> Vec<Point3> {
    rows(array).into_iter().map(Point3::from).collect()
}

/// A number of a JSON object; what is not finite is null there.
pub(crate) fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or(f64::NAN)
}

/// A count of a JSON object.
pub(crate) fn count(object: &Value, key: &str) -> PyResult<usize> {
    let count = object[key].as_u64().and_then(|count| usize::try_from(count).ok());
    count.ok_or_else(|| internal(format!("no {key} in a pickled object")))
}

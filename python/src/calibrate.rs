//! The function `calibrate`.

use std::path::PathBuf;

use pyo3::prelude::*;
use scan2params::calibrate::manifest::{self, ManifestError};
use scan2params::calibrate::run::{CalibrateError, Options, calibrate as run};
use scan2params::fabric::Mixture;
use scan2params::report::calibration;
use scan2params::report::page::calibration::Source;

use crate::boundary::dict;
use crate::errors::{InvalidInput, file, invalid, of_output, of_read, of_write};
use crate::work;

/// Fits fabrics to measured drapes, looks for effects beyond the plain model, and foretells the drapes held out.
///
/// Parameters
/// ----------
/// manifest : str or os.PathLike
///     Table with a row for each measured drape (silhouette, scan or rim), as the program's ``calibrate`` takes it.
/// out : str or os.PathLike, optional
///     Folder for ``calibration.json``, the fabrics' ``params.json`` with their effects, pictures and ``report.html``;
///     without it nothing is written.
/// prior : {'measured', 'knit-2020', 'union'}
///     What is believed of fabrics.
/// vertices : int
///     Vertices on a side of the drapes, 31 to 201.
/// scale_sigma : float, optional
///     Standard deviation of the pictures' scale as a share, 0 to 0.25; exact if not given.
/// hold_per_m : float, optional
///     How strongly drapes are held across their outlines: share of the hanging cloth's weight for each metre; 150 if not
///     given, 0 lets them go.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// dict
///     The content of ``calibration.json``: units are named there. Files that were not used are under ``refused``.
///
/// Raises
/// ------
/// InvalidInput
///     A manifest or options that cannot be meant.
/// FileError
///     A file that cannot be read or written, or a manifest of which no file can be used.
#[pyfunction]
#[pyo3(signature = (manifest, *, out=None, prior="measured", vertices=61, scale_sigma=None, hold_per_m=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    manifest: PathBuf,
    out: Option<PathBuf>,
    prior: &str,
    vertices: usize,
    scale_sigma: Option<f64>,
    hold_per_m: Option<f64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let entries = manifest::read(&manifest).map_err(|error| match error {
        ManifestError::Io { .. } => file(error),
        other => invalid(other),
    })?;
    if let Some(out) = &out {
        let inputs: Vec<PathBuf> = entries.iter().map(|entry| entry.path.clone()).collect();
        let inputs = [inputs, vec![manifest.clone()]].concat();
        calibration::check(out, &inputs).map_err(|error| of_output(&error))?;
    }
    let mixture = Mixture::named(prior).map_err(invalid)?;
    let mut options = Options { prior: mixture, ..Options::default() };
    options.fit.sim.vertices = within("vertices", vertices, [31, 201])?;
    if let Some(sigma) = scale_sigma {
        options.fit.scale_sigma = within("scale_sigma", sigma, [0.0, 0.25])?;
    }
    if let Some(hold) = hold_per_m {
        options.fit.hold_per_m = within("hold_per_m", hold, [0.0, 1000.0])?;
    }
    let with = options.clone();
    let found = work::run(py, progress, move |tell| {
        run(&entries, &with, &|told| tell.say(told.to_string()))
    })?;
    let found = found.map_err(|error| match error {
        CalibrateError::Nothing { .. } => file(error),
        other => InvalidInput::new_err(other.to_string()),
    })?;
    if let Some(out) = &out {
        let source = Source::of(&manifest, prior, &options).map_err(|error| of_read(&error))?;
        let write = || {
            calibration::write(&found, out)?;
            calibration::write_page(&found, &source, out)
        };
        py.detach(write).map_err(|error| of_write(&error))?;
    }
    dict(py, &calibration::json(&found))
}

/// A number within its ends.
fn within<T: PartialOrd + std::fmt::Display + Copy>(
    key: &str,
    value: T,
    [least, most]: [T; 2],
) -> PyResult<T> {
    if value >= least && value <= most {
        return Ok(value);
    }
    Err(invalid(format!("{key}: {value}; give a number from {least} to {most}")))
}

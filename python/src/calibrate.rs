//! The function `calibrate`.

use std::path::PathBuf;

use pyo3::prelude::*;
use scan2params::batch::calibrations::{self, CalibrationsError};
use scan2params::calibrate::effect::{EFFECTS, Effect};
use scan2params::calibrate::manifest::{self, ManifestError};
use scan2params::calibrate::run::{CalibrateError, Options, Told, calibrate as run};
use scan2params::fabric::Mixture;
use scan2params::report::calibration;
use scan2params::report::page::calibration::Source;

use crate::boundary::dict;
use crate::errors::{file, invalid, of_output, of_read, of_write};
use crate::work;

/// Fits fabrics to measured drapes, looks for effects beyond the plain model, and predicts the
/// held-out drapes.
///
/// Parameters
/// ----------
/// manifest : str or os.PathLike
///     Table with a row for each measured drape (silhouette, scan or rim), as the program's
///     ``calibrate`` takes it.
/// out : str or os.PathLike, optional
///     Folder for ``calibration.json``, the fabrics' ``params.json`` with their effects, pictures
///     and ``report.html``; without it nothing is written. The same call continues an interrupted
///     run.
/// prior : {'measured', 'knit-2020', 'union'}
///     Prior of the fabrics.
/// vertices : int
///     Vertices on a side of the drapes, 31 to 201.
/// scale_sigma : float, optional
///     Standard deviation of the pictures' scale as a share, 0 to 0.25; exact if not given.
/// hold_per_m : float, optional
///     Stiffness of the springs that tie drapes to their outlines: share of the hanging cloth's
///     weight per metre; 150 if not given, 0 releases the drapes.
/// without : sequence of str, optional
///     Effects to leave out, by their names in ``calibration.json``.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// dict
///     The content of ``calibration.json``: units are named there. Files that were not used are
///     under ``refused``.
///
/// Raises
/// ------
/// InvalidInput
///     A manifest or options that cannot be meant.
/// FileError
///     A file that cannot be read or written, or a manifest of which no file can be used.
#[pyfunction]
#[pyo3(signature = (manifest, *, out=None, prior="measured", vertices=61, scale_sigma=None, hold_per_m=None, without=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    manifest: PathBuf,
    out: Option<PathBuf>,
    prior: &str,
    vertices: usize,
    scale_sigma: Option<f64>,
    hold_per_m: Option<f64>,
    without: Option<Vec<String>>,
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
    for name in without.unwrap_or_default() {
        let known = || EFFECTS.map(|effect| effect.name).join(", ");
        let effect = Effect::named(&name);
        let effect = effect
            .ok_or_else(|| invalid(format!("without: no effect `{name}`; they are {}", known())))?;
        options.without.push(effect);
    }
    let (with, into) = (options.clone(), out.clone());
    let found = work::run(py, progress, move |tell| -> Result<_, CalibrationsError> {
        let tell = |told: Told<'_>| tell.say(told.to_string());
        match into {
            Some(out) => {
                let found = calibrations::run(&entries, &with, &out, &tell)?;
                Ok((calibration::json(&found.sections, &found.refused), Some(found)))
            }
            None => Ok((calibration::json_of(&run(&entries, &with, &tell)?), None)),
        }
    })?;
    let (json, found) = found.map_err(|error| match error {
        CalibrationsError::Calibrate(CalibrateError::Nothing { .. })
        | CalibrationsError::Lock(_) => file(error),
        CalibrationsError::Calibrate(error) => invalid(error),
        CalibrationsError::Read(error) => of_read(&error),
        CalibrationsError::Write(error) => of_write(&error),
    })?;
    if let (Some(out), Some(found)) = (&out, &found) {
        let source = Source::of(&manifest, prior, &options).map_err(|error| of_read(&error))?;
        let write = || calibration::write_page(&found.sections, &found.refused, &source, out);
        py.detach(write).map_err(|error| of_write(&error))?;
    }
    dict(py, &json)
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

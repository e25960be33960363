//! The class `Boundary` and the function `boundary`: the scan path.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use scan2params::base::boundary::POINTS;
use scan2params::base::{BoundaryPoint, Surface};
use scan2params::intake::{Rim, rim};
use scan2params::io::boundary_csv::{self, OrientedRim};
use scan2params::job::verdict;
use scan2params::report::json::Quality;
use scan2params::scan::{Orientation, ScanOptions};
use scan2params::sim::rim_nodes;
use serde_json::json;

use crate::errors::{internal, invalid, of_intake, of_write};
use crate::{arrays, messages, pickled, words};

/// The rim of a specimen: 244 points in the simulation frame.
///
/// The simulation frame has its origin in the middle of the plate's face, y up, the warp along x
/// and the weft along z, in metres. The rim runs around the specimen in four sides of 61 points,
/// each with both of its corners, from the corner (+x, -z) on. Made by `boundary` and
/// `Boundary.from_points`.
#[pyclass(frozen, module = "scan2params")]
pub(crate) struct Boundary {
    name: PathBuf,
    file: Option<PathBuf>,
    rim: Arc<Rim>,
    options: ScanOptions,
}

impl Boundary {
    /// A rim with its name, the file that it was found in, and the options that it was found with.
    pub(crate) fn of(name: PathBuf, file: Option<PathBuf>, rim: Rim, options: ScanOptions) -> Self {
        Self { name, file, rim: Arc::new(rim), options }
    }

    /// Its name.
    pub(crate) fn path(&self) -> &Path {
        &self.name
    }

    /// The file that it was found in, if it was in one.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    pub(crate) fn options(&self) -> &ScanOptions {
        &self.options
    }

    pub(crate) fn rim(&self) -> &Rim {
        &self.rim
    }
}

#[pymethods]
impl Boundary {
    /// A rim from 244 points that are known already.
    ///
    /// It is checked as a rim from a file is: neighbours, corners, lengths of the sides, sense,
    /// place over the plate.
    ///
    /// Parameters
    /// ----------
    /// points_m : array_like, shape (244, 3)
    ///     Positions in the simulation frame, in metres, in the order of the class.
    /// sigma_m : array_like, shape (244,), optional
    ///     Standard deviation of each position, per coordinate; the estimate's intervals go by its
    ///     mean. 0 if not given, which is for exact rims.
    /// observed : array_like of bool, shape (244,), optional
    ///     Whether each point was seen, not bridged; true if not given.
    /// warp_known : bool, optional
    ///     Whether x is the warp for sure. If not, `warp_toward` of the points' own frame may say
    ///     it.
    /// warp_toward : str or array_like, shape (3,), optional
    ///     Where the warp points in the frame of the points.
    /// name : str, optional
    ///     What stands for the rim in messages and results.
    ///
    /// Returns
    /// -------
    /// Boundary
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another number of points, or numbers that are not finite.
    /// ScanRefused
    ///     The points can be no rim of the specimen. Lines in the message are those that the points
    ///     would have in a file: their number and 2.
    #[staticmethod]
    #[pyo3(signature = (points_m, sigma_m=None, observed=None, *, warp_known=false, warp_toward=None, name=None))]
    fn from_points(
        points_m: &Bound<'_, PyAny>,
        sigma_m: Option<&Bound<'_, PyAny>>,
        observed: Option<&Bound<'_, PyAny>>,
        warp_known: bool,
        warp_toward: Option<&Bound<'_, PyAny>>,
        name: Option<PathBuf>,
    ) -> PyResult<Self> {
        let positions = arrays::finite_points("points_m", points_m)?;
        let sigmas = sigma_m.map(|given| arrays::numbers("sigma_m", given, POINTS, 0.0));
        let seen = observed.map(|given| arrays::numbers("observed", given, POINTS, 0.0));
        let (sigmas, seen) = (sigmas.transpose()?, seen.transpose()?);
        let point = |(index, position_m)| BoundaryPoint {
            position_m,
            sigma_m: sigmas.as_ref().and_then(|s| s.get(index)).copied().unwrap_or(0.0),
            observed: seen.as_ref().and_then(|s| s.get(index)).is_none_or(|seen| *seen != 0.0),
        };
        let points = positions.into_iter().enumerate().map(point).collect();
        let boundary =
            scan2params::Boundary::new(points).map_err(|e| invalid(format!("points_m: {e}")))?;
        let orientation = warp_known.then_some(Orientation::Given);
        let warp_toward = warp_toward.map(words::warp_toward).transpose()?;
        let options = ScanOptions { warp_toward, ..ScanOptions::default() };
        let name = name.unwrap_or_else(|| "points".into());
        let rim = rim::of_rim(&name, OrientedRim { boundary, orientation }, &options);
        Ok(Self::of(name, None, rim.map_err(|error| of_intake(&error, true))?, options))
    }

    /// numpy.ndarray: The points, shape (244, 3), in metres, simulation frame.
    #[getter]
    fn points_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::of_points(py, self.rim.boundary().positions_m().map(|p| p.coords.into()))
    }

    /// numpy.ndarray: Standard deviation of each point per coordinate, shape (244,), in metres.
    #[getter]
    fn sigma_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let points = self.rim.boundary().points().iter();
        arrays::of_numbers(py, points.map(|point| point.sigma_m).collect())
    }

    /// numpy.ndarray of bool: Whether each point was seen, shape (244,); false where the rim was
    /// bridged.
    #[getter]
    fn observed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let points = self.rim.boundary().points().iter();
        arrays::of_numbers(py, points.map(|point| point.observed).collect())
    }

    /// bool: Whether x is the warp for sure; if not, weft and warp may be exchanged.
    #[getter]
    fn warp_known(&self) -> bool {
        self.rim.orientation() == Orientation::Given
    }

    /// float or None: Angle in radians between the direction given for the warp and the specimen's
    /// axis taken for it.
    #[getter]
    fn warp_off_rad(&self) -> Option<f64> {
        self.rim.warp_off_rad()
    }

    /// int: Number of folds.
    #[getter]
    fn folds(&self) -> usize {
        rim_nodes(self.rim.boundary())
    }

    /// str: The path, or what stands for it.
    #[getter]
    fn name(&self) -> String {
        self.name.display().to_string()
    }

    /// str or None: The unit of the scan's coordinates, given or guessed; None for a rim that was
    /// given.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.rim.scanned().map(|scanned| scanned.unit.name())
    }

    /// numpy.ndarray or None: The motion from the scan's frame to the simulation frame, shape (4,
    /// 4), both in metres: ``points @ m[:3, :3].T + m[:3, 3]``. None for a rim that was given.
    #[getter]
    fn sim_from_scan<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        self.rim.scanned().map(|scanned| arrays::of_motion(py, &scanned.sim_from_scan))
    }

    /// numpy.ndarray or None: The whole sheet, shape (61, 61, 3), in metres, simulation frame;
    /// first index along the warp, second along the weft. None for a rim that was given.
    #[getter]
    fn sheet_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<f64>>>> {
        let sheet = |sheet: &Surface| {
            let points = sheet.points().iter().map(|point| point.position_m.coords.into());
            arrays::of_sheet(py, sheet.side(), points)
        };
        self.rim.sheet().map(sheet).transpose()
    }

    /// numpy.ndarray or None: Smoothed points of the cloth, shape (N, 3), in metres, simulation
    /// frame. None for a rim that was given.
    #[getter]
    fn cloth_points_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let cloth = self.rim.scanned().map(|scanned| &scanned.evidence.cloth);
        cloth.map(|cloth| arrays::of_points(py, cloth.iter().map(|p| p.coords.into()))).transpose()
    }

    /// dict or None: Figures of the scan's quality, as in ``params.json`` (lengths in mm). None for
    /// a rim that was given.
    #[getter]
    fn quality<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let quality = self.rim.scanned().map(|scanned| json!(Quality::of(scanned)));
        quality.map(|quality| dict(py, &quality)).transpose()
    }

    /// dict: What the rim is worth: ``level``, ``not_the_experiment`` and ``grounds``, as in
    /// ``params.json``.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let verdict = verdict::of_rim(&self.rim, &self.options);
        let mut verdict = serde_json::to_value(verdict).map_err(internal)?;
        messages::texts_in_python(&mut verdict, "text");
        dict(py, &verdict)
    }

    /// Writes the rim as a table, in millimetres, which `boundary`, `estimate` and the program
    /// read.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     A name that ends in ``.csv``.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let rim = Arc::clone(&self.rim);
        let write = || boundary_csv::write_oriented(path, rim.boundary(), rim.orientation());
        py.detach(write).map_err(|error| of_write(&error))
    }

    fn __reduce__(&self) -> PyResult<()> {
        let instead =
            "write() it and read it with boundary(), or send points_m, sigma_m and observed";
        Err(pickled::refused("Boundary", instead))
    }

    fn __repr__(&self) -> String {
        let seen = 100.0 * self.rim.observed_fraction();
        let warp = if self.warp_known() { "known" } else { "not known" };
        format!(
            "Boundary({:?}, {} folds, {seen:.0} % observed, warp {warp})",
            self.name(),
            self.folds()
        )
    }
}

/// JSON as Python's own reader makes it.
pub(crate) fn dict<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}

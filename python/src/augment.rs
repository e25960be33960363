//! The class `Scan` and the function `augment`: the virtual depth camera.

use std::path::PathBuf;

use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyType;
use scan2params::Isometry3;
use scan2params::dataset::augment::one;
use scan2params::dataset::drape_file::read_drape;
use scan2params::geom::Cloud;
use scan2params::sensor::{Profile, Truth, VirtualScan};

use crate::drape::Drape;
use crate::errors::{internal, invalid, of_drape_file, of_write};
use crate::{arrays, pickled, words, work};

/// A virtual scan: a fused cloud in the scanner's own frame, and the truth that undoes the frame.
///
/// Made by `augment`. `boundary` and `estimate` take it as a scan.
#[pyclass(frozen, module = "scan2params")]
pub(crate) struct Scan {
    cloud: Cloud,
    truth: Truth,
    profile: &'static str,
}

/// What is pickled of a scan: points, colours, the truth's numbers, the profile.
type State<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u8>>, Vec<f64>, String);

impl Scan {
    pub(crate) fn cloud(&self) -> &Cloud {
        &self.cloud
    }
}

#[pymethods]
impl Scan {
    /// numpy.ndarray: The points, shape (N, 3), in metres, scanner's frame.
    #[getter]
    fn points_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::of_points(py, self.cloud.points.iter().map(|p| p.coords.into()))
    }

    /// numpy.ndarray of uint8: Red, green, blue of each point, shape (N, 3).
    #[getter]
    fn colors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        arrays::of_rows(py, self.cloud.colors.clone())
    }

    /// numpy.ndarray: The true motion from the scanner's frame to the simulation frame, shape (4,
    /// 4), in metres: ``points @ m[:3, :3].T + m[:3, 3]``.
    #[getter]
    fn sim_from_scan<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::of_motion(py, &self.truth.simulation_from_scanner)
    }

    /// str: The sensor's profile.
    #[getter]
    fn profile(&self) -> &'static str {
        self.profile
    }

    /// Writes the cloud as PLY, in metres, and next to it the truth as ``<stem>.truth.json``.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let scan = VirtualScan { views: Vec::new(), cloud: self.cloud.clone(), truth: self.truth };
        py.detach(|| scan.write(path)).map_err(|error| of_write(&error))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, State<'py>)> {
        let motion = self.truth.simulation_from_scanner;
        let mut numbers = motion.rotation.coords.as_slice().to_vec();
        numbers.extend(motion.translation.vector.as_slice());
        numbers.push(self.truth.unit_m);
        let state = (self.points_m(py)?, self.colors(py)?, numbers, self.profile.to_owned());
        Ok((pickled::restorer::<Self>(py)?, state))
    }

    /// The scan that was pickled.
    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        points: PyReadonlyArray2<'_, f64>,
        colors: PyReadonlyArray2<'_, u8>,
        numbers: [f64; 8],
        profile: &str,
    ) -> PyResult<Self> {
        let [i, j, k, w, x, y, z, unit_m] = numbers;
        // a rotation that is normalised again would differ in its last bits
        let mut motion = Isometry3::identity();
        motion.rotation.as_mut_unchecked().coords.copy_from_slice(&[i, j, k, w]);
        motion.translation.vector.copy_from_slice(&[x, y, z]);
        let profile = Profile::named(profile).ok_or_else(|| internal("an unknown profile"))?;
        let cloud = Cloud {
            points: pickled::points(&points),
            colors: pickled::rows(&colors),
            triangles: Vec::new(),
        };
        let truth = Truth { unit_m, simulation_from_scanner: motion };
        Ok(Self { cloud, truth, profile: profile.name })
    }

    fn __len__(&self) -> usize {
        self.cloud.points.len()
    }

    fn __repr__(&self) -> String {
        format!("Scan({} points, {})", self.cloud.points.len(), self.profile)
    }
}

/// Scans a drape with a virtual depth camera: rays, the sensor's errors, fused views.
///
/// The same arguments give the same bytes, and the same cloud as the program's `augment` in metres.
///
/// Parameters
/// ----------
/// drape : Drape, str or os.PathLike
///     A drape, or the path of one as `Drape.write` and the program write it.
/// profile : str
///     The sensor, one of `PROFILES`.
/// seed : int
///     Draws the noise and the scanner's frame.
/// mark : str, optional
///     Colour of a mark in the middle of the side to which the warp runs.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// Scan
///     Points in metres in the scanner's own frame, with colours and the true motion.
///
/// Raises
/// ------
/// InvalidInput
///     An unknown profile, or a drape that makes no scene.
/// FileError
///     A file that cannot be read.
#[pyfunction]
#[pyo3(signature = (drape, profile="structured-light", *, seed=1, mark=None, progress=None))]
pub(crate) fn augment(
    drape: &Bound<'_, PyAny>,
    profile: &str,
    seed: u64,
    mark: Option<&str>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scan> {
    let profile = Profile::named(profile).ok_or_else(|| {
        let names = Profile::ALL.map(|profile| profile.name).join(", ");
        invalid(format!("profile: no sensor `{profile}`; give one of {names}"))
    })?;
    let profile = Profile { unit_m: 1.0, ..profile };
    let mark = mark.map(words::mark).transpose()?;
    let mesh = if let Ok(drape) = drape.cast::<Drape>() {
        drape.get().mesh().clone()
    } else if let Ok(path) = drape.extract::<PathBuf>() {
        read_drape(&path).map_err(|error| of_drape_file(&error))?
    } else {
        return Err(invalid("drape: give a Drape, or the path of one"));
    };
    let name = profile.name;
    let made = work::run(drape.py(), progress, move |tell| {
        tell.say("scanning the drape");
        one(mesh, &profile, mark, seed)
    })?;
    let VirtualScan { cloud, truth, .. } = made.map_err(invalid)?;
    Ok(Scan { cloud, truth, profile: name })
}

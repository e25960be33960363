//! The class `Estimate` and the functions `estimate` and `refine`: the main job.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use scan2params::Estimator;
use scan2params::calibrate::cloth_file;
use scan2params::intake::Rim;
use scan2params::io::files_of;
use scan2params::job::{Job, JobError, Outcome};
use scan2params::refine::ScanFit;
use scan2params::report::page::options::Extra;
use scan2params::report::page::provenance;
use scan2params::report::{files, json};
use scan2params::sim::Experiment;

use crate::boundary::{Boundary, dict};
use crate::drape::Drape;
use crate::errors::{file, internal, invalid, of_intake, of_job, of_output, of_read, of_write};
use crate::fabric::Fabric;
use crate::given::{Given, Input, Known};
use crate::{messages, pickled, words, work};

/// What was found of a fabric: six stiffnesses with their intervals, a verdict, and the rim that
/// they were found from.
///
/// Made by `estimate` and `refine`.
#[pyclass(frozen, module = "scan2params")]
pub(crate) struct Estimate {
    outcome: Arc<Outcome>,
    /// The file of each scan, the first one's first, where it was read from one.
    files: Vec<Option<PathBuf>>,
}

#[pymethods]
impl Estimate {
    /// Fabric: The stiffnesses, with the density that was given.
    #[getter]
    fn fabric(&self) -> Fabric {
        Fabric(self.outcome.estimate.fabric)
    }

    /// tuple of Fabric: The lower and the upper ends of the 90 % interval of each stiffness.
    #[getter]
    fn interval90(&self) -> (Fabric, Fabric) {
        let [low, high] = self.outcome.estimate.interval90;
        (Fabric(low), Fabric(high))
    }

    /// list of Fabric: One reading; two where weft and warp are not known.
    #[getter]
    fn candidates(&self) -> Vec<Fabric> {
        self.outcome.estimate.candidates.iter().map(|c| Fabric(c.fabric)).collect()
    }

    /// dict of str to bool: Whether each stiffness lies inside what the model was trained on.
    #[getter]
    fn in_range<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for parameter in self.outcome.estimate.parameters() {
            dict.set_item(parameter.key, parameter.in_range)?;
        }
        Ok(dict)
    }

    /// str: What the result is worth: ``'reliable'``, ``'doubtful'`` or ``'do_not_use'``.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.outcome.verdict.level.name()
    }

    /// bool: Whether what was scanned is not the experiment at all.
    #[getter]
    fn not_the_experiment(&self) -> bool {
        self.outcome.verdict.not_the_experiment
    }

    /// list of dict: The verdict's grounds, worst first: ``code``, ``level``, ``measured``,
    /// ``limit``, ``unit``, ``text``.
    #[getter]
    fn grounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut grounds = serde_json::to_value(&self.outcome.verdict.grounds).map_err(internal)?;
        messages::texts_in_python(&mut grounds, "text");
        dict(py, &grounds)
    }

    /// list of str: What the user should know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let warnings = self.outcome.estimate.warnings.iter();
        warnings.map(|warning| messages::in_python(&warning.to_string())).collect()
    }

    /// Boundary: The rim that it was found from.
    #[getter]
    fn boundary(&self) -> Boundary {
        let job = &self.outcome.job;
        let file = self.files.first().cloned().flatten();
        Boundary::of(job.input.clone(), file, self.outcome.rim.clone(), job.scan.clone())
    }

    /// Drape or None: The fabric's sheet, tied to the scan by weak springs; None if the answer is
    /// the network's.
    #[getter]
    fn tied_drape(&self) -> Option<Drape> {
        self.tied().map(|tied| Drape::found(tied.tied.clone(), self.outcome.estimate.fabric))
    }

    /// float or None: Mean distance of the tied drape's rim from the scanned one, in metres.
    #[getter]
    fn tied_rim_mean_m(&self) -> Option<f64> {
        self.tied().map(|tied| tied.tied_mean_m)
    }

    /// float or None: The largest distance of the two rims, in metres.
    #[getter]
    fn tied_rim_largest_m(&self) -> Option<f64> {
        self.tied().map(|tied| tied.tied_largest_m)
    }

    /// float or None: Root mean square distance of the tied drape from the scanned sheet, in
    /// standard deviations of scan and simulator.
    #[getter]
    fn misfit(&self) -> Option<f64> {
        self.outcome.taken().map(|taken| taken.refined().misfit)
    }

    /// Drape or None: The released drape, which no spring ties to the scan, if `release` was given.
    #[getter]
    fn released_drape(&self) -> Option<Drape> {
        let released = self.outcome.released.as_ref();
        released.map(|released| Drape::found(released.drape.clone(), self.outcome.estimate.fabric))
    }

    /// float or None: Mean distance of the released drape's rim from the scanned one, in metres.
    #[getter]
    fn released_rim_mean_m(&self) -> Option<f64> {
        self.outcome.released.as_ref().map(|released| released.mean_distance_m)
    }

    /// float or None: The largest distance of those two rims, in metres.
    #[getter]
    fn released_rim_largest_m(&self) -> Option<f64> {
        self.outcome.released.as_ref().map(|released| released.largest_distance_m)
    }

    /// bool: Whether the fabric is a refined one. If not, and ``quick`` was not asked for, the
    /// verdict says why.
    #[getter]
    fn is_refined(&self) -> bool {
        self.outcome.taken().is_some()
    }

    /// dict: The content of ``params.json``: units are named there.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        dict(py, &json::params(&self.outcome))
    }

    /// The text of ``params.json``, as the program writes it.
    ///
    /// Returns
    /// -------
    /// str
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string_pretty(&json::params(&self.outcome)).map_err(internal)
    }

    /// Writes what the program's ``--out`` writes: ``<name>.params.json``, ``<name>.boundary.csv``,
    /// ``<name>.boundary.png`` and ``<name>.report.html``.
    ///
    /// Parameters
    /// ----------
    /// folder : str or os.PathLike
    ///     Made if it is not there.
    ///
    /// Returns
    /// -------
    /// list of pathlib.Path
    ///     The files.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     A result would replace an input.
    /// FileError
    ///     The system refuses.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
        py.detach(|| self.written(&folder))
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pickled::refused("Estimate", "send its fabric, interval90, verdict or params"))
    }

    fn __repr__(&self) -> String {
        let fabric = self.fabric();
        format!("Estimate({}, {})", self.verdict(), fabric.shown())
    }
}

impl Estimate {
    fn tied(&self) -> Option<&ScanFit> {
        self.outcome.taken().map(|taken| taken.first())
    }

    /// Writes the files of a result; those that were read must be there still, since the page names
    /// their hashes.
    fn written(&self, folder: &Path) -> PyResult<Vec<PathBuf>> {
        let Self { outcome, files: scans } = self;
        let scans = || scans.iter().flatten();
        let (mut read, mut inputs) = (Vec::new(), Vec::new());
        for scan in scans() {
            read.extend(files_of(scan).map_err(|error| of_read(&error))?);
        }
        files::check(&outcome.job.input, folder, &read).map_err(|error| of_output(&error))?;
        for scan in scans() {
            inputs.extend(provenance::files_of(scan).map_err(|error| of_read(&error))?);
        }
        let mut paths = files::write(outcome, folder).map_err(|error| of_job(&error))?;
        let extra = Extra { inputs, turning_view: true, ..Extra::default() };
        let stem = files::stem(&outcome.job.input);
        let page = files::write_page(outcome, folder, &stem, &extra);
        paths.push(page.map_err(|error| of_write(&error))?);
        Ok(paths)
    }
}

/// Options of an estimate, apart from the scan.
struct Asked {
    density_kg_m2: f64,
    quick: bool,
    release: bool,
    experiment: Experiment,
}

/// The standard experiment, or that of a file's effects.
fn experiment(effects: Option<PathBuf>, face: &str) -> PyResult<Experiment> {
    let face = words::face(face)?;
    let of_file = effects.map(|path| cloth_file::experiment(&path, face)).transpose();
    Ok(of_file
        .map_err(|error| match error {
            cloth_file::ClothFileError::Experiment(_) => invalid(error),
            other => file(other),
        })?
        .unwrap_or_default())
}

/// Runs the main job: on files as the program does, and where something is in memory on the rims.
fn run(
    py: Python<'_>,
    first: Given,
    with: Vec<Given>,
    asked: Asked,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Estimate> {
    let in_memory = first.in_memory() || with.iter().any(Given::in_memory);
    let files = std::iter::once(&first).chain(&with).map(Given::file).collect();
    let job = Job {
        input: first.name(),
        density_kg_m2: asked.density_kg_m2,
        read: first.read.clone(),
        scan: first.scan.clone(),
        refine: !asked.quick,
        release: asked.release,
        with: with.iter().map(Given::name).collect(),
        experiment: asked.experiment,
    };
    let outcome = work::run(py, progress, move |tell| {
        if !in_memory {
            return job
                .run_telling(|told| tell.say(told.to_string()))
                .map_err(|error| of_job(&error));
        }
        job.check().map_err(|error| of_job(&error))?;
        let rim = |given: Given| -> PyResult<(PathBuf, Rim)> {
            let (name, in_memory) = (given.name(), given.in_memory());
            if !matches!(given.input, Input::Rim(..)) {
                tell.say(format!("looking for the rim of {}", name.display()));
            }
            Ok((name, given.rim().map_err(|error| of_intake(&error, in_memory))?))
        };
        let (_, first) = rim(first)?;
        let with = with.into_iter().map(rim).collect::<PyResult<Vec<_>>>()?;
        let estimator = Estimator::shipped().map_err(|error| of_job(&JobError::from(error)))?;
        let ran = job.run_on(first, with, &estimator, |told| tell.say(told.to_string()));
        ran.map_err(|error| of_job(&error))
    })??;
    Ok(Estimate { outcome: Arc::new(outcome), files })
}

/// Finds the six stiffnesses of the fabric in a scan: the network estimates them, and the simulator
/// fits them to the scan.
///
/// Several scans of one fabric are fitted together; weft and warp must then be known in each.
///
/// Parameters
/// ----------
/// scan : array_like of shape (N, 3), str, os.PathLike, Scan or Boundary
///     As of `boundary`, or what that gave.
/// density_kg_m2 : float
///     Areal density of the fabric in kg/m^2: a square of 100 x 100 mm that weighs 2.14 g has 0.214
///     kg/m^2.
/// triangles, colors, unit, warp_toward, mark, crop_radius_m, crop_box, up, plate_near,
/// specimen_side_m, plate_radius_m, seed, intrinsics, depth_scale, name
///     As of `boundary`; not with a Boundary. The arrays are those of `scan` alone.
/// with_scans : sequence of scans
///     Other scans of the same fabric, in any of these forms. The options given here apply to all
///     of them but a Boundary.
/// quick : bool
///     Only the network's answer, in two seconds: wider intervals, bending off by 5 to 8 %.
/// release : bool
///     Whether to simulate the released drape, which no spring ties to the scan
///     (``released_drape``).
/// effects : str or os.PathLike, optional
///     A ``params.json`` of `calibrate`, whose effects the simulator takes into account.
/// face : {'up', 'down'}
///     Which face of the specimen was up, for the effects.
/// progress : callable, optional
///     Called with a str as each step begins, and after each drape.
///
/// Returns
/// -------
/// Estimate
///     The result with its verdict. A result that must not be used raises no exception.
///
/// Raises
/// ------
/// ScanRefused
///     The scan cannot be trusted.
/// InvalidInput
///     Arrays or options that cannot be meant, a density that no textile has; several scans without
///     a known warp.
/// FileError
///     A file that cannot be read.
#[pyfunction]
#[pyo3(signature = (scan, density_kg_m2, *, triangles=None, colors=None, unit=None, warp_toward=None, mark=None, crop_radius_m=None, crop_box=None, up=None, plate_near=None, specimen_side_m=None, plate_radius_m=None, seed=None, intrinsics=None, depth_scale=None, name=None, with_scans=None, quick=false, release=false, effects=None, face="up", progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn estimate(
    scan: &Bound<'_, PyAny>,
    density_kg_m2: f64,
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
    with_scans: Option<Vec<Bound<'_, PyAny>>>,
    quick: bool,
    release: bool,
    effects: Option<PathBuf>,
    face: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Estimate> {
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
    let density_kg_m2 = words::density_kg_m2(density_kg_m2)?;
    let experiment = experiment(effects, face)?;
    let asked = Asked { density_kg_m2, quick, release, experiment };
    let first = known.of(scan)?;
    let others = known.of_others();
    let other = |(other, number): (&Bound<'_, PyAny>, usize)| others.of_numbered(other, number);
    let with: Vec<Given> =
        with_scans.iter().flatten().zip(2..).map(other).collect::<PyResult<_>>()?;
    if quick && !with.is_empty() {
        let text = "with_scans: the network's answer is of one scan; leave out quick";
        return Err(invalid(text));
    }
    run(scan.py(), first, with, asked, progress)
}

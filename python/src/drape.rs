//! The class `Drape` and the functions `simulate` and `sensitivities`.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyType;
use scan2params::Point3;
use scan2params::base::{BoundaryPoint, Surface, SurfacePoint, Vector3};
use scan2params::calibrate::cloth_file;
use scan2params::calibrate::effect::Cloth;
use scan2params::dataset::sheet_file::read_sheet;
use scan2params::geom::Mesh;
use scan2params::io::write_obj;
use scan2params::sim::sensitivity::{Parameter, SensitivityError};
use scan2params::sim::{
    self, Drop, DropStart, Experiment, Numerics, SimOptions, Stop, drape_with_sensitivities,
    rim_harmonics_m,
};
use serde_json::{Value, json};

use crate::boundary::Boundary;
use crate::errors::{NotAtRest, file, internal, invalid, of_drape_file, of_write};
use crate::fabric::{Fabric, of_si};
use crate::{arrays, pickled, words, work};

/// What a drape was simulated from.
#[derive(Clone)]
struct Recipe {
    fabric: scan2params::Fabric,
    start: DropStart,
    options: SimOptions,
}

/// A simulated drape: the sheet with its rim, and how the search for rest ended.
///
/// Made by `simulate`, and by `estimate` as a drape of what it found. All of it is in the
/// simulation frame (origin in the middle of the plate's face, y up, warp along x, weft along z)
/// and in SI.
#[pyclass(frozen, module = "scan2params")]
pub(crate) struct Drape {
    mesh: Mesh,
    rim: scan2params::Boundary,
    folds: usize,
    stop: Stop,
    residual_n: f64,
    energy_j: f64,
    intersections: usize,
    plate_clearance_m: f64,
    fabric: scan2params::Fabric,
    warnings: Vec<String>,
    recipe: Option<Recipe>,
}

impl Drape {
    /// A drape that was found on the way to something else.
    pub(crate) fn found(drape: sim::Drape, fabric: scan2params::Fabric) -> Self {
        Self::of(drape, fabric, Vec::new(), None)
    }

    fn of(
        drape: sim::Drape,
        fabric: scan2params::Fabric,
        mut warnings: Vec<String>,
        recipe: Option<Recipe>,
    ) -> Self {
        warnings.extend(drape.warnings.iter().map(ToString::to_string));
        Self {
            mesh: drape.mesh(),
            rim: drape.boundary,
            folds: drape.nodes,
            stop: drape.stop,
            residual_n: drape.residual_n,
            energy_j: drape.energy_j,
            intersections: drape.intersections,
            plate_clearance_m: drape.plate_clearance_m,
            fabric,
            warnings,
            recipe,
        }
    }

    pub(crate) fn mesh(&self) -> &Mesh {
        &self.mesh
    }
}

#[pymethods]
impl Drape {
    /// numpy.ndarray: The sheet's vertices, shape (n, 3), in metres. Of a rectangle they are a
    /// square grid, at even steps of the flat specimen, those along the weft fastest.
    #[getter]
    fn vertices_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::of_points(py, self.mesh.vertices.iter().map(|p| p.coords.into()))
    }

    /// numpy.ndarray of uint32: The sheet's triangles, shape (m, 3), as indices of vertices; their
    /// front is the face.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        arrays::of_rows(py, self.mesh.triangles.clone())
    }

    /// numpy.ndarray: The rim, shape (244, 3), in metres, in the order of `Boundary`.
    #[getter]
    fn rim_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::of_points(py, self.rim.positions_m().map(|p| p.coords.into()))
    }

    /// numpy.ndarray: Amplitudes of the rim's distance from the plate's axis, shape (16,), in
    /// metres: orders 1 to 16.
    #[getter]
    fn rim_harmonics_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::of_numbers(py, rim_harmonics_m(&self.rim).to_vec())
    }

    /// int: Number of folds.
    #[getter]
    fn folds(&self) -> usize {
        self.folds
    }

    /// bool: Whether the sheet came to a stable rest.
    #[getter]
    fn at_rest(&self) -> bool {
        self.stop == Stop::AtRest
    }

    /// str: Why the search for rest ended: ``'at_rest'``, ``'unstable'``, ``'slow'`` or
    /// ``'iterations'``.
    #[getter]
    fn stop(&self) -> &'static str {
        self.stop.name()
    }

    /// float: Largest net force on a vertex, in N.
    #[getter]
    fn residual_n(&self) -> f64 {
        self.residual_n
    }

    /// float: Elastic and gravitational energy, in J, zero for the flat sheet.
    #[getter]
    fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// int: Pairs of triangles that intersect; 0 for a sound drape.
    #[getter]
    fn intersections(&self) -> usize {
        self.intersections
    }

    /// float: Least distance of the sheet from the plate's surface, in metres; positive if no cloth
    /// is inside the plate.
    #[getter]
    fn plate_clearance_m(&self) -> f64 {
        self.plate_clearance_m
    }

    /// Fabric: What was draped.
    #[getter]
    fn fabric(&self) -> Fabric {
        Fabric(self.fabric)
    }

    /// list of str: What the user should know of the fabric and of the mesh.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Writes the sheet as OBJ, in millimetres, as the program does.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| write_obj(path, &self.mesh)).map_err(|error| of_write(&error))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, State<'py>)> {
        let start = match self.recipe.as_ref().map(|recipe| &recipe.start) {
            Some(DropStart::Surface(sheet)) => Some(start_state(
                py,
                sheet.points().iter().map(|p| (p.position_m, p.sigma_m, p.observed)),
            )?),
            Some(DropStart::Guided(rim)) => Some(start_state(
                py,
                rim.points().iter().map(|p| (p.position_m, p.sigma_m, p.observed)),
            )?),
            _ => None,
        };
        let facts = self.facts().to_string();
        let state = (self.vertices_m(py)?, self.triangles(py)?, self.rim_m(py)?, start, facts);
        Ok((pickled::restorer::<Self>(py)?, state))
    }

    /// The drape that was pickled.
    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
        rim: PyReadonlyArray2<'_, f64>,
        start: Option<GivenStart<'_>>,
        facts: &str,
    ) -> PyResult<Self> {
        let facts: Value = serde_json::from_str(facts).map_err(internal)?;
        let warnings = facts["warnings"].as_array().into_iter().flatten();
        Ok(Self {
            mesh: Mesh {
                vertices: pickled::points(&vertices),
                triangles: pickled::rows(&triangles),
            },
            rim: scan2params::Boundary::exact(pickled::points(&rim)).map_err(internal)?,
            folds: pickled::count(&facts, "folds")?,
            stop: stop(&facts["stop"])?,
            residual_n: pickled::number(&facts, "residual_n"),
            energy_j: pickled::number(&facts, "energy_j"),
            intersections: pickled::count(&facts, "intersections")?,
            plate_clearance_m: pickled::number(&facts, "plate_clearance_m"),
            fabric: fabric(&facts["fabric"])?,
            warnings: warnings.filter_map(|text| text.as_str().map(str::to_owned)).collect(),
            recipe: Recipe::restored(&facts["recipe"], start)?,
        })
    }

    fn __repr__(&self) -> String {
        let (folds, stop) = (self.folds, self.stop.name());
        format!("Drape({folds} folds, {stop}, {} vertices)", self.mesh.vertices.len())
    }
}

/// What is pickled of a drape: the sheet's vertices and triangles, the rim, what it was laid on or
/// guided to, and the rest as JSON.
type State<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray2<f64>>,
    Option<StartState<'py>>,
    String,
);
/// Positions, standard deviations, and whether points were seen.
type StartState<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>);
/// The same as they come back.
type GivenStart<'py> =
    (PyReadonlyArray2<'py, f64>, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, bool>);

fn start_state<'py>(
    py: Python<'py>,
    points: impl Iterator<Item = (Point3, f64, bool)> + Clone,
) -> PyResult<StartState<'py>> {
    let positions = arrays::of_points(py, points.clone().map(|p| p.0.coords.into()))?;
    let sigmas = arrays::of_numbers(py, points.clone().map(|p| p.1).collect());
    Ok((positions, sigmas, arrays::of_numbers(py, points.map(|p| p.2).collect())))
}

impl Drape {
    /// All but the arrays.
    fn facts(&self) -> Value {
        json!({
            "folds": self.folds,
            "stop": self.stop.name(),
            "residual_n": self.residual_n,
            "energy_j": self.energy_j,
            "intersections": self.intersections,
            "plate_clearance_m": self.plate_clearance_m,
            "fabric": self.fabric.in_si(),
            "warnings": self.warnings,
            "recipe": self.recipe.as_ref().map(Recipe::facts),
        })
    }
}

impl Recipe {
    fn facts(&self) -> Value {
        let (start, seed) = match &self.start {
            DropStart::Perturbed(seed) => ("perturbed", Some(*seed)),
            DropStart::Surface(_) => ("surface", None),
            DropStart::Guided(_) => ("guided", None),
            _ => ("canonical", None),
        };
        json!({
            "fabric": self.fabric.in_si(),
            "start": start,
            "seed": seed,
            "vertices": self.options.vertices,
            "numerics": if self.options.numerics == Numerics::THREE { 3 } else { 4 },
            "iterations": self.options.iterations,
            "experiment": self.options.experiment,
        })
    }

    fn restored(facts: &Value, start: Option<GivenStart<'_>>) -> PyResult<Option<Self>> {
        if facts.is_null() {
            return Ok(None);
        }
        let points = |(positions, sigmas, seen): &GivenStart<'_>| {
            let (sigmas, seen) = (sigmas.as_array().to_vec(), seen.as_array().to_vec());
            let rest = sigmas.into_iter().zip(seen);
            pickled::points(positions).into_iter().zip(rest).collect::<Vec<_>>()
        };
        let start = match (facts["start"].as_str(), facts["seed"].as_u64(), &start) {
            (Some("surface"), _, Some(given)) => {
                let point = |(position_m, (sigma_m, observed))| SurfacePoint {
                    position_m,
                    sigma_m,
                    observed,
                };
                let sheet = Surface::new(points(given).into_iter().map(point).collect());
                DropStart::Surface(Box::new(sheet.map_err(internal)?))
            }
            (Some("guided"), _, Some(given)) => {
                let point = |(position_m, (sigma_m, observed))| BoundaryPoint {
                    position_m,
                    sigma_m,
                    observed,
                };
                let rim =
                    scan2params::Boundary::new(points(given).into_iter().map(point).collect());
                DropStart::Guided(Box::new(rim.map_err(internal)?))
            }
            (_, Some(seed), _) => DropStart::Perturbed(seed),
            _ => DropStart::Canonical,
        };
        let experiment =
            serde_json::from_value::<Experiment>(facts["experiment"].clone()).map_err(internal)?;
        let options = SimOptions {
            vertices: pickled::count(facts, "vertices")?,
            iterations: pickled::count(facts, "iterations")?,
            numerics: if facts["numerics"] == 3 { Numerics::THREE } else { Numerics::FOUR },
            experiment,
            ..SimOptions::default()
        };
        Ok(Some(Self { fabric: fabric(&facts["fabric"])?, start, options }))
    }
}

/// A fabric from its numbers in SI.
fn fabric(numbers: &Value) -> PyResult<scan2params::Fabric> {
    let numbers: [f64; 7] = serde_json::from_value(numbers.clone()).map_err(internal)?;
    Ok(of_si(numbers))
}

/// Why a search ended, by its name.
fn stop(name: &Value) -> PyResult<Stop> {
    let all = [Stop::AtRest, Stop::Unstable, Stop::Slow, Stop::Iterations];
    let stop = all.into_iter().find(|stop| name == stop.name());
    stop.ok_or_else(|| internal("an unknown end in a pickled drape"))
}

/// A fabric, or a file with a fabric and its effects.
fn cloth(given: &Bound<'_, PyAny>) -> PyResult<Cloth> {
    if let Ok(fabric) = given.cast::<Fabric>() {
        return Ok(Cloth::plain(fabric.get().0));
    }
    match given.extract::<PathBuf>() {
        Ok(path) => cloth_file::read(&path, [None; 7]).map_err(file),
        Err(_) => Err(invalid("fabric: give a Fabric, or the path of a params.json")),
    }
}

/// An experiment from a dictionary: the keys of `Experiment`, as `params.json` has them.
fn experiment(given: Option<&Bound<'_, PyAny>>) -> PyResult<Experiment> {
    let Some(given) = given else { return Ok(Experiment::default()) };
    let text = given.py().import("json")?.call_method1("dumps", (given,));
    let text =
        text.map_err(|error| invalid(format!("experiment: {error}")))?.extract::<String>()?;
    serde_json::from_str(&text).map_err(|error| invalid(format!("experiment: {error}")))
}

/// Where a sheet starts.
fn start(
    seed: Option<u64>,
    given: Option<&Bound<'_, PyAny>>,
    experiment: &Experiment,
) -> PyResult<DropStart> {
    let Some(given) = given else {
        return Ok(seed.map_or(DropStart::Canonical, DropStart::Perturbed));
    };
    if seed.is_some() {
        return Err(invalid("seed: a sheet that is given is not dropped; leave the seed out"));
    }
    if let Ok(boundary) = given.cast::<Boundary>() {
        let rim = boundary.get().rim();
        return Ok(match rim.sheet() {
            Some(sheet) => DropStart::Surface(Box::new(sheet.clone())),
            None => DropStart::Guided(Box::new(rim.boundary().clone())),
        });
    }
    let sheet = if let Ok(path) = given.extract::<PathBuf>() {
        let specimen = &experiment.specimen;
        read_sheet(&path, [specimen.warp_m, specimen.weft_m]).map_err(|e| of_drape_file(&e))?
    } else {
        let points = arrays::finite_points("start", given)?;
        Surface::exact(points).map_err(|error| invalid(format!("start: {error}")))?
    };
    Ok(DropStart::Surface(Box::new(sheet)))
}

/// Factorisations of a cycle of the search for rest at most: 20 descents and 20 Newton steps.
const CYCLE: usize = 40;

/// Drapes a specimen of a fabric: drops it on the plate and brings it to rest.
///
/// The same arguments give the same bytes, on any number of threads, and the same drape as the
/// program.
///
/// Parameters
/// ----------
/// fabric : Fabric, str or os.PathLike
///     What is draped, or the path of a ``params.json``, whose effects (of `calibrate`) are
///     simulated too.
/// seed : int, optional
///     Seed of a perturbed drop; different seeds sample the stable shapes of a fabric. If not
///     given, the canonical drop of a level specimen.
/// vertices : int
///     Vertices on a side of the sheet.
/// experiment : dict, optional
///     What differs from the standard experiment: any of the keys ``specimen``, ``plate``,
///     ``tilt``, ``curl``, ``softening``, ``asymmetric_bending``, ``hysteresis``, each with numbers
///     in SI, such as ``{'plate': {'friction': 0.2, 'radius_m': 0.05}}``.
/// face : {'up', 'down'}
///     Which face of the specimen is up; effects of a file are of the specimen with its face up.
/// start : array_like of shape (n, n, 3), Boundary, str or os.PathLike, optional
///     The sheet to start from instead of a drop: vertices of the simulation frame in metres, the
///     sheet of a scan, or a mesh's file in mm.
/// numerics : {3, 4}
///     Version of the numerics.
/// iterations : int, optional
///     Factorisations of the search for rest at most, checked after each cycle of up to 40: 0 for
///     no search, or at least 40. If not given, 600. Fabrics need 40 to 250.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// Drape
///     The drape, whether it came to rest or not: see ``at_rest``.
///
/// Raises
/// ------
/// InvalidInput
///     A fabric or an experiment that cannot be simulated; all faults are named at once.
/// FileError
///     A file that cannot be read.
#[pyfunction]
#[pyo3(signature = (fabric, *, seed=None, vertices=61, experiment=None, face="up", start=None, numerics=4, iterations=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn simulate(
    fabric: &Bound<'_, PyAny>,
    seed: Option<u64>,
    vertices: usize,
    experiment: Option<&Bound<'_, PyAny>>,
    face: &str,
    start: Option<&Bound<'_, PyAny>>,
    numerics: u32,
    iterations: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Drape> {
    let py = fabric.py();
    let cloth = cloth(fabric)?;
    let mut warnings: Vec<String> =
        cloth.fabric.check().map_err(invalid)?.iter().map(ToString::to_string).collect();
    let (fabric, projected) = cloth.fabric.project_bending();
    warnings.extend(projected.map(|warning| warning.to_string()));
    let experiment = cloth.experiment(&self::experiment(experiment)?, words::face(face)?);
    let numerics = match numerics {
        3 => Numerics::THREE,
        4 => Numerics::FOUR,
        other => return Err(invalid(format!("numerics: no version {other}; give 3 or 4"))),
    };
    let mut options = SimOptions { vertices, experiment, numerics, ..SimOptions::default() };
    options.iterations = iterations.unwrap_or(options.iterations);
    if (1..CYCLE).contains(&options.iterations) {
        return Err(invalid(format!(
            "iterations: {}; a cycle of the search takes up to {CYCLE}: give 0 for no search, or at least {CYCLE}",
            options.iterations
        )));
    }
    options.check().map_err(invalid)?;
    let start = self::start(seed, start, &experiment)?;
    let recipe = Recipe { fabric, start, options };
    let (drape, recipe) = work::run(py, progress, move |tell| {
        tell.say("simulating the drape");
        let drop = Drop { start: recipe.start.clone() };
        (sim::drape(&recipe.fabric, &drop, &recipe.options), recipe)
    })?;
    Ok(Drape::of(drape, fabric, warnings, Some(recipe)))
}

/// What is pickled of sensitivities.
type Moves<'py> = (Vec<String>, Vec<String>, Bound<'py, PyArray3<f64>>);

/// How the rim of a drape moves with each of several parameters; made by `sensitivities`.
#[pyclass(frozen, module = "scan2params")]
pub(crate) struct Sensitivities {
    names: Vec<String>,
    units: Vec<String>,
    moves: Vec<Vec<Vector3>>,
}

#[pymethods]
impl Sensitivities {
    /// tuple of str: The parameters, in the order of the last axis of `rim`.
    #[getter]
    fn names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyTuple>> {
        pyo3::types::PyTuple::new(py, &self.names)
    }

    /// tuple of str: The unit of each last index of `rim`: ``'m'`` for a stiffness or the density,
    /// by whose logarithm the derivative is, ``'m / rad'`` and the like for the others.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyTuple>> {
        pyo3::types::PyTuple::new(py, &self.units)
    }

    /// numpy.ndarray: Derivatives of the rim's points, shape (244, 3, k), simulation frame: by the
    /// logarithm of a stiffness or the density (metres), by any other parameter in SI.
    #[getter]
    fn rim<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        arrays::of_moves(py, &self.moves)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Moves<'py>)> {
        let state = (self.names.clone(), self.units.clone(), self.rim(py));
        Ok((pickled::restorer::<Self>(py)?, state))
    }

    /// The sensitivities that were pickled.
    #[classmethod]
    fn _restored(
        _class: &Bound<'_, PyType>,
        names: Vec<String>,
        units: Vec<String>,
        rim: PyReadonlyArray3<'_, f64>,
    ) -> Self {
        let rim = rim.as_array();
        let at = |i: usize, k: usize| Vector3::new(rim[[i, 0, k]], rim[[i, 1, k]], rim[[i, 2, k]]);
        let moves = (0..rim.shape()[2]).map(|k| (0..rim.shape()[0]).map(|i| at(i, k)).collect());
        Self { names, units, moves: moves.collect() }
    }

    fn __repr__(&self) -> String {
        format!("Sensitivities({})", self.names.join(", "))
    }
}

/// How the rim of a drape moves with a small change of what it depends on.
///
/// The drape is simulated again, to the same bytes, with its sensitivities: implicit derivatives at
/// the equilibrium, for changes so small that nothing slips on the plate.
///
/// Parameters
/// ----------
/// drape : Drape
///     A drape that `simulate` made, at rest.
/// parameters : sequence of str, optional
///     Names of `PARAMETERS`; the six stiffnesses and the density if not given.
/// progress : callable, optional
///     Called with a str as each step begins.
///
/// Returns
/// -------
/// Sensitivities
///     ``rim`` of shape (244, 3, k), with ``names`` and ``units``.
///
/// Raises
/// ------
/// NotAtRest
///     The drape is not at a stable rest.
/// InvalidInput
///     An unknown parameter, or a drape that `estimate` fitted to a scan.
#[pyfunction]
#[pyo3(signature = (drape, parameters=None, *, progress=None))]
pub(crate) fn sensitivities(
    drape: &Bound<'_, Drape>,
    parameters: Option<Vec<String>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Sensitivities> {
    let recipe = drape.get().recipe.clone().ok_or_else(|| {
        invalid("drape: it was fitted to a scan; give one that simulate() made, with start=boundary for this scan's branch")
    })?;
    let parameters: Vec<Parameter> = match parameters {
        Some(names) => names.iter().map(|name| parameter(name)).collect::<PyResult<_>>()?,
        None => Parameter::STIFFNESSES.into_iter().chain([Parameter::Density]).collect(),
    };
    let values = recipe.fabric.in_si();
    let asked = parameters.clone();
    let found = work::run(drape.py(), progress, move |tell| {
        tell.say("simulating the drape with its sensitivities");
        let drop = Drop { start: recipe.start };
        drape_with_sensitivities(&recipe.fabric, &drop, &recipe.options, &asked)
    })?;
    let (drape, found) = found.map_err(|error| match error {
        SensitivityError::NotAtRest(_) | SensitivityError::Unstable => {
            NotAtRest::new_err(error.to_string())
        }
        SensitivityError::NoSuchNode { .. } => internal(error),
    })?;
    let moves = found.iter().map(|sensitivity| {
        // d/d ln v = v d/dv
        let scale = sensitivity.parameter.of_fabric().map_or(1.0, |k| values[k]);
        sensitivity.rim_moves(&drape.grid).into_iter().map(|move_m| move_m * scale).collect()
    });
    let unit = |parameter: &Parameter| match (parameter.of_fabric(), parameter.unit()) {
        (Some(_), _) | (None, "") => "m".to_owned(),
        (None, unit) => format!("m / ({unit})"),
    };
    Ok(Sensitivities {
        names: parameters.iter().map(|parameter| parameter.name()).collect(),
        units: parameters.iter().map(unit).collect(),
        moves: moves.collect(),
    })
}

/// A parameter by its name.
fn parameter(name: &str) -> PyResult<Parameter> {
    Parameter::ALL.into_iter().find(|parameter| parameter.name() == name).ok_or_else(|| {
        let known = Parameter::ALL.map(Parameter::name).join(", ");
        invalid(format!("parameters: no parameter `{name}`; known are {known}"))
    })
}

//! From drapes to scans with known truth: the augmentation of training and test data.
//!
//! In: a drape (OBJ), the parameters of one (`*.params.json`, simulated first), a folder of both,
//! or a folder of `generate --sheets`; a sensor profile, a seed, a number of variants. Out, per
//! variant: a fused cloud (PLY), depth images with poses (`views.json`), or the rim that
//! `boundary` finds in the cloud (CSV); and next to it the truth:
//!
//! | file | what it is |
//! |---|---|
//! | `NAME.truth.json` | unit and frame of the scan, see [`crate::sensor::Truth`] |
//! | `NAME.truth.boundary.csv` | the true rim, if the drape is a square grid of vertices |
//! | `NAME.truth.params.json` | the true parameters, if they are known |
//! | `DRAPE.truth.obj` | the drape, if it was simulated here |
//!
//! Variant k of a drape is the same bytes for any other content of the folder: its seed
//! comes from the run's, the drape's name and k. It sets the noise, the scanner's
//! frame, and where the ring of cameras starts.
//!
//! The noise of a rim is that of the whole way through camera and `scan`. Tried and
//! dropped: white noise on the true rim; real errors are smooth along the rim, grow
//! where it is bridged, and are not zero on average where edges erode.

use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt as _;

use super::drape_file::{DrapeFileError, read_drape, rim_of};
use super::setting::{Setting, VIEWS};
use super::sheets::{self, Sheets};
use crate::base::boundary::Orientation;
use crate::base::{Boundary, seed};
use crate::fabric::params::{self, ParamsError};
use crate::geom::Mesh;
use crate::geom::adjacency::area_vector2;
use crate::io::{self, OutputError, WriteError, boundary_csv, output};
use crate::scan::{MarkColor, ScanError, ScanOptions, WarpToward, boundary_from_scan};
use crate::sensor::{
    CameraPose, Profile, Scene, SceneError, VirtualScan, default_ring, draw_views, even, scan,
};
use crate::sim::{Drop, DropStart, SimOptions, drape};

/// What is written of each variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The fused cloud as PLY.
    Ply,
    /// A folder of 16-bit depth images with a `views.json`.
    Depth,
    /// The rim found in the fused cloud, as a boundary CSV.
    Boundary,
}

/// Unit of the clouds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// The profile's own.
    OfProfile,
    /// Metres.
    Metre,
    /// Millimetres.
    Millimetre,
    /// Metres or millimetres, each variant by lot.
    Either,
}

/// What to make, and where.
#[derive(Clone, Debug)]
pub struct AugmentOptions {
    /// A drape, its parameters, a folder of both, or a folder of `generate --sheets`.
    pub input: PathBuf,
    /// Folder of results; made if it is not there.
    pub out: PathBuf,
    /// What is written.
    pub form: Form,
    /// The sensor.
    pub profile: Profile,
    /// What the drapes stand on and among; each variant draws its own.
    pub setting: Setting,
    /// Unit of clouds.
    pub unit: Unit,
    /// Colour of a mark in the middle of the side to which the warp runs.
    pub mark: Option<MarkColor>,
    /// For [`one_ply`]: this many points spread evenly over cloth and floor, with the
    /// profile's axial noise in all directions, in metres and the simulation frame, in
    /// place of what the sensor sees.
    pub even: Option<usize>,
    /// Seed of the run.
    pub seed: u64,
    /// Variants of each drape.
    pub count: u64,
    /// How drapes are simulated whose parameters are given.
    pub simulator: SimOptions,
}

/// How far [`run`] is.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// A variant is begun, or a drape that is simulated first.
    Begun {
        /// Of the variant, or of the drape.
        name: &'a str,
        /// Which of the run's variants comes next, from 1.
        number: u64,
        /// Variants of the run.
        of: u64,
    },
    /// A drape's sheet is too coarse for the scans of it to pass for those of cloth: see
    /// [`COARSEST_CELL_M`].
    Coarse {
        /// Of the drape.
        name: &'a str,
        /// Side of its cells, as [`cell_m`] has it \[m\].
        cell_m: f64,
    },
    /// A variant is there, or will not be.
    Ended(&'a Made),
}

/// Sheets of larger cells are scanned all the same and told of ([`Step::Coarse`]) \[m\]: their
/// facets round off the plate's edge and bend along lines, and `scan` refuses most of them.
/// Observed: drapes of two fabrics with 61 vertices a side (5 mm) pass, with 49 (6.3 mm) one of
/// two, with 41, 37 and 31 none.
pub const COARSEST_CELL_M: f64 = 0.0055;

/// The side of a sheet's cells, of two triangles each, on the average \[m\].
#[must_use]
pub fn cell_m(sheet: &Mesh) -> f64 {
    let faces = sheet.triangles.len();
    let area_m2: f64 = (0..faces).map(|face| 0.5 * area_vector2(sheet, face).norm()).sum();
    (2.0 * area_m2 / faces as f64).sqrt()
}

/// What became of one variant, or of a drape that makes none.
#[derive(Debug)]
pub struct Made {
    /// `DRAPE-K`, or `DRAPE`.
    pub name: String,
    /// What was written for the reader of scans, or why nothing was.
    pub outcome: Result<PathBuf, AugmentError>,
}

/// Why nothing was made.
#[derive(Debug, thiserror::Error)]
pub enum AugmentError {
    /// The input cannot be listed.
    #[error("{}: {fault}; give a drape (.obj), its parameters (.params.json), or a folder of them", path.display())]
    Input {
        /// The input.
        path: PathBuf,
        /// What is wrong.
        fault: String,
    },
    /// A folder of `generate` without sheets.
    #[error(
        "{}: a folder of `generate` with rims only; a camera needs the sheets. This makes them: {command}",
        path.display()
    )]
    RimsOnly {
        /// The folder.
        path: PathBuf,
        /// The command that makes the sheets.
        command: String,
    },
    /// A drape cannot be read.
    #[error(transparent)]
    Drape(#[from] DrapeFileError),
    /// Parameters cannot be read.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// Parameters that cannot be simulated.
    #[error("{}: {fault}", path.display())]
    Fabric {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        fault: String,
    },
    /// The drape makes no scene.
    #[error("{}: {source}", path.display())]
    Scene {
        /// The drape.
        path: PathBuf,
        /// Why.
        source: SceneError,
    },
    /// `scan` finds no rim in the virtual scan.
    #[error("scan refused: {0}")]
    Refused(#[from] ScanError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A result cannot be written where it is asked to be.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// A drape to be scanned.
struct Source {
    name: String,
    path: PathBuf,
    /// The true parameters, if a file holds them.
    params: Option<PathBuf>,
}

/// Makes the variants of every drape; `tell` hears of each. One drape that fails
/// does not stop the others.
///
/// # Errors
/// When the input is none, or the folder of results cannot be made.
pub fn run(
    options: &AugmentOptions,
    mut tell: impl FnMut(Step<'_>),
) -> Result<Vec<Made>, AugmentError> {
    let sources = sources(&options.input)?;
    let out = &options.out;
    output::check_folder(out)?;
    std::fs::create_dir_all(out).map_err(|source| WriteError { path: out.clone(), source })?;
    let of = sources.len() as u64 * options.count;
    let mut all = Vec::new();
    for (source, before) in sources.iter().zip(0..) {
        let number = before * options.count + 1;
        tell(Step::Begun { name: &source.name, number, of });
        let sheet = mesh(source, options);
        if let Ok(sheet) = &sheet {
            tell_if_coarse(sheet, &source.name, &mut tell);
        }
        let made: Vec<Made> = match sheet {
            Ok(mesh) => (0..options.count)
                .map(|index| {
                    let name = format!("{}-{index}", source.name);
                    tell(Step::Begun { name: &name, number: number + index, of });
                    let outcome = variant(source, &mesh, &name, index, options);
                    let made = Made { name, outcome };
                    tell(Step::Ended(&made));
                    made
                })
                .collect(),
            Err(error) => {
                let made = Made { name: source.name.clone(), outcome: Err(error) };
                tell(Step::Ended(&made));
                vec![made]
            }
        };
        all.extend(made);
    }
    Ok(all)
}

fn tell_if_coarse(sheet: &Mesh, name: &str, tell: &mut impl FnMut(Step<'_>)) {
    let cell_m = cell_m(sheet);
    if cell_m > COARSEST_CELL_M {
        tell(Step::Coarse { name, cell_m });
    }
}

/// Makes the PLY of one drape at `path`, with the seed as it is; see [`run`] for
/// variants. Returns the number of its points; `tell` hears of a sheet that is too coarse.
///
/// # Errors
/// When the drape cannot be read, makes no scene, or the file cannot be written.
pub fn one_ply(
    options: &AugmentOptions,
    path: &Path,
    mut tell: impl FnMut(Step<'_>),
) -> Result<usize, AugmentError> {
    let input = &options.input;
    let [source] = sources(input)?.try_into().map_err(|_| AugmentError::Input {
        path: input.clone(),
        fault: "holds other than one drape, and one PLY is to be written".to_owned(),
    })?;
    check_outputs(&path.with_extension(""), &["truth.json"], &source)?;
    output::check_file(path, &source.files())?;
    let mesh = mesh(&source, options)?;
    tell_if_coarse(&mesh, &source.name, &mut tell);
    if let Some(count) = options.even {
        let scene = Scene::modified_cusick(mesh.clone());
        let cloud = even(&scene, count, options.profile.axial_m, options.seed)
            .map_err(|error| AugmentError::Scene { path: source.path.clone(), source: error })?;
        io::write_ply(path, &cloud, 1.0)?;
        truth_beside(&path.with_extension(""), &source, &mesh)?;
        return Ok(cloud.points.len());
    }
    let profile = with_unit(options, options.seed);
    let poses = default_ring();
    let made = seen(mesh.clone(), &profile, options, poses, options.seed)
        .map_err(|error| AugmentError::Scene { path: source.path.clone(), source: error })?;
    made.write(path)?;
    truth_beside(&path.with_extension(""), &source, &mesh)?;
    Ok(made.cloud.points.len())
}

fn sources(input: &Path) -> Result<Vec<Source>, AugmentError> {
    let fault = |fault: String| AugmentError::Input { path: input.to_owned(), fault };
    let unlisted = |error: std::io::Error| fault(format!("cannot be listed ({error})"));
    let generated = match input.is_dir().then(|| sheets::of_folder(input)).flatten() {
        Some(sheets) => Some(sheets.map_err(unlisted)?),
        None => None,
    };
    if let Some(Sheets::Here(meshes)) = &generated {
        return Ok(meshes.iter().map(|path| Source::of_mesh(path)).collect());
    }
    let mut paths = if input.is_dir() {
        let entries =
            std::fs::read_dir(input).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
        entries.map_err(unlisted)?.iter().map(|e| e.path()).collect()
    } else {
        vec![input.to_owned()]
    };
    // What a run on this folder wrote beside its scans is no drape of the next.
    let single = !input.is_dir();
    let name_of = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    paths.retain(|path| single || !name_of(path).contains(".truth."));
    paths.sort();
    let mut sources: Vec<Source> = Vec::new();
    for path in &paths {
        let file = name_of(path);
        if file.ends_with(".obj") {
            sources.push(Source::of_mesh(path));
        } else if let Some(name) = file.strip_suffix(".params.json") {
            if single || !paths.contains(&path.with_file_name(format!("{name}.obj"))) {
                let params = Some(path.clone());
                sources.push(Source { name: name.to_owned(), path: path.clone(), params });
            }
        } else if single {
            // Other drape files by their content.
            sources.push(Source::of_mesh(path));
        }
    }
    if sources.is_empty() {
        if let Some(Sheets::RimsOnly { command }) = generated {
            return Err(AugmentError::RimsOnly { path: input.to_owned(), command });
        }
        return Err(fault("no drapes in it".to_owned()));
    }
    Ok(sources)
}

/// Reads the drape, or simulates it from its parameters with its own drop, and
/// writes it then.
fn mesh(source: &Source, options: &AugmentOptions) -> Result<Mesh, AugmentError> {
    if source.params.as_ref() != Some(&source.path) {
        return Ok(read_drape(&source.path)?);
    }
    let fault = |fault: String| AugmentError::Fabric { path: source.path.clone(), fault };
    let fabric = params::fabric(&source.path, [None; 7])?;
    fabric.check().map_err(|error| fault(error.to_string()))?;
    let start = DropStart::Perturbed(seed_of(options.seed, &source.name, u64::MAX));
    let mesh = drape(&fabric, &Drop { start }, &options.simulator).mesh();
    if options.out.is_dir() {
        io::write_obj(options.out.join(format!("{}.truth.obj", source.name)), &mesh)?;
    }
    Ok(mesh)
}

impl Source {
    /// A mesh, with the parameters that lie next to it.
    fn of_mesh(path: &Path) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let params = path.with_file_name(format!("{name}.params.json"));
        let params = params.is_file().then_some(params);
        Self { name, path: path.to_owned(), params }
    }

    /// The files that are read of it.
    fn files(&self) -> Vec<PathBuf> {
        [Some(self.path.clone()), self.params.clone()].into_iter().flatten().collect()
    }
}

/// Whether `<stem>.<ending>` and the truth can be written without the drape being lost.
fn check_outputs(stem: &Path, endings: &[&str], source: &Source) -> Result<(), OutputError> {
    let inputs = source.files();
    for ending in endings.iter().chain(&["truth.boundary.csv", "truth.params.json"]) {
        output::check_file(&with_ending(stem, ending), &inputs)?;
    }
    Ok(())
}

/// The seed of variant `index` of a drape.
fn seed_of(run_seed: u64, name: &str, index: u64) -> u64 {
    seed::rng(run_seed, &format!("augment {name}"), index).random()
}

fn with_unit(options: &AugmentOptions, seed: u64) -> Profile {
    let either = || if seed::rng(seed, "augment-unit", 0).random() { 1.0 } else { 1e-3 };
    let unit_m = match options.unit {
        Unit::OfProfile => options.profile.unit_m,
        Unit::Metre => 1.0,
        Unit::Millimetre => 1e-3,
        Unit::Either => either(),
    };
    Profile { unit_m, ..options.profile.clone() }
}

/// The ring of cameras, started at a random bearing.
fn turned_ring(seed: u64) -> Vec<CameraPose> {
    let angle = seed::rng(seed, "augment-ring", 0).random_range(0.0..std::f64::consts::TAU);
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    let rotated = |pose: CameraPose| CameraPose {
        simulation_from_camera: rotation * pose.simulation_from_camera,
    };
    default_ring().into_iter().map(rotated).collect()
}

/// Scans a drape on the stand of the experiment from the default ring of cameras, as [`one_ply`]
/// does: `drape` in the simulation frame \[m\], with a mark in the middle of the side to which the
/// warp runs if one is wanted.
///
/// # Errors
/// When the drape makes no scene, or there is a mark but no square grid of vertices.
pub fn one(
    drape: Mesh,
    profile: &Profile,
    mark: Option<MarkColor>,
    seed: u64,
) -> Result<VirtualScan, SceneError> {
    scan(&marked(Scene::modified_cusick(drape), mark)?, &default_ring(), profile, seed)
}

/// A scan of a drape in its setting: from `usual` poses on the bench of the experiment, from drawn
/// ones elsewhere.
fn seen(
    drape: Mesh,
    profile: &Profile,
    options: &AugmentOptions,
    usual: Vec<CameraPose>,
    seed: u64,
) -> Result<VirtualScan, SceneError> {
    let setting = &options.setting;
    let scene = marked(setting.scene(drape, profile, seed), options.mark)?;
    let poses = if setting.is_usual() { usual } else { draw_views(&scene, profile, VIEWS, seed)? };
    scan(&scene, &poses, profile, seed)
}

/// The scene with the mark if one is wanted.
fn marked(mut scene: Scene, mark: Option<MarkColor>) -> Result<Scene, SceneError> {
    if let Some(MarkColor(color)) = mark {
        scene.mark_warp_side(color)?;
    }
    Ok(scene)
}

fn variant(
    source: &Source,
    mesh: &Mesh,
    name: &str,
    index: u64,
    options: &AugmentOptions,
) -> Result<PathBuf, AugmentError> {
    let stem = options.out.join(name);
    let ending = match options.form {
        Form::Ply => &["truth.json", "ply"][..],
        Form::Depth => &["truth.json"],
        Form::Boundary => &["truth.json", "boundary.csv"],
    };
    check_outputs(&stem, ending, source)?;
    let seed = seed_of(options.seed, &source.name, index);
    let profile = with_unit(options, seed);
    let made = seen(mesh.clone(), &profile, options, turned_ring(seed), seed)
        .map_err(|error| AugmentError::Scene { path: source.path.clone(), source: error })?;
    let path = match options.form {
        Form::Ply => {
            let path = with_ending(&stem, "ply");
            made.write(&path)?;
            path
        }
        Form::Depth => {
            let (path, truth) = made.write_views(&stem)?;
            truth.write(&with_ending(&stem, "truth.json"))?;
            path
        }
        Form::Boundary => {
            let path = with_ending(&stem, "boundary.csv");
            boundary_csv::write_oriented(&path, &rim_in(&made)?, Orientation::Given)?;
            made.truth.write(&with_ending(&stem, "truth.json"))?;
            path
        }
    };
    truth_beside(&stem, source, mesh)?;
    Ok(path)
}

/// The rim that `scan` finds, its warp as in truth.
fn rim_in(made: &VirtualScan) -> Result<Boundary, ScanError> {
    let warp = made.truth.simulation_from_scanner.inverse() * Vector3::x();
    let warp_toward = Some(WarpToward::Direction(warp.into()));
    let options = ScanOptions { warp_toward, ..ScanOptions::default() };
    Ok(boundary_from_scan(&made.cloud, &options)?.boundary)
}

fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    name.into()
}

/// The true rim and the true parameters, as far as they are known.
fn truth_beside(stem: &Path, source: &Source, mesh: &Mesh) -> Result<(), AugmentError> {
    if let Some(rim) = rim_of(mesh) {
        let path = with_ending(stem, "truth.boundary.csv");
        boundary_csv::write_oriented(path, &rim, Orientation::Given)?;
    }
    if let Some(params) = &source.params {
        let path = with_ending(stem, "truth.params.json");
        let bytes =
            std::fs::read(params).map_err(|source| WriteError { path: params.clone(), source })?;
        io::atomically(path, |out| out.write_all(&bytes))?;
    }
    Ok(())
}

//! Several views of one scene, each with the pose of its camera, as one cloud in
//! metres.
//!
//! A `views.json` (a folder with one stands for it):
//!
//! ```json
//! {
//!   "schema": "scan2params/views/1",
//!   "intrinsics": "camera.json",
//!   "depth_scale": 1000,
//!   "camera_axes": "opencv",
//!   "views": [
//!     { "file": "view-00.png", "world_from_camera": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] },
//!     { "file": "side.ply", "unit": "mm", "world_from_camera": [1,0,0,0, 0,1,0,0, 0,0,1,0,
//! 0,0,0,1] }
//!   ]
//! }
//! ```
//!
//! Files are named relative to it and lie in its folder or below: a list from elsewhere must not
//! make its reader open the reader's other files. `world_from_camera` is rigid, row by row, its
//! translation in metres. `intrinsics` is a file of [`super::intrinsics`] or such a JSON object; it
//! and `depth_scale` may stand in a view as well. A view is a 16-bit depth PNG, or any other scan
//! file in its camera's frame, in metres or in the `unit` named. `camera_axes`: `opencv` (x right,
//! y down, z forward) or `opengl` (x right, y up, z backward).
//!
//! Views without any `world_from_camera` are those of a turntable before a camera that stands
//! still, in order; `turntable_step_deg` may say by how much it turns from one to the next.
//!
//! A folder with `camera-intrinsics.txt`, `NAME.depth.png` and `NAME.pose.txt`
//! (7-Scenes and the tools after it; millimetres, 65535 for nothing) is read as
//! such a set.
//!
//! The clouds are joined, not downsampled: `scan` weighs and downsamples. `intake` brings them
//! together first.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use nalgebra::{Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion};
use serde::Deserialize;
use serde_json::Value;

use super::assemble::ReadNotes;
use super::bytes::{regular_file, text_bytes};
use super::error::shown;
use super::file::read_file;
use super::tokens::{number, words};
use super::{At, Fault, Format, Intrinsics, ReadError, ReadOptions, intrinsics};
use crate::base::units::M_PER_MM;
use crate::base::{Isometry3, Vector3};
use crate::geom::Cloud;

/// The name that makes a folder a set of views.
pub const VIEWS_FILE: &str = "views.json";
/// What the file says it is.
pub const VIEWS_SCHEMA: &str = "scan2params/views/1";
/// The intrinsics of a folder of the other kind.
const FOLDER_INTRINSICS: &str = "camera-intrinsics.txt";
const FOLDER_DEPTH: &str = ".depth.png";
/// How far a pose's rotation may be from one, per entry of R^T R: poses written to
/// three digits pass, a scale of 1 % does not.
const ROTATION_TOLERANCE: f64 = 5e-3;

/// The note on poses that stood column by column.
const POSES_BY_COLUMNS: &str =
    "world_from_camera is taken column by column, since its last row holds the shift";

/// A set of views, read but not their files.
#[derive(Debug)]
pub(super) struct Views {
    views: Vec<View>,
    /// Files besides the views: the list, cameras, poses.
    others: Vec<PathBuf>,
    /// How the drape turned, where no view has a pose.
    turntable: Option<Turntable>,
}

/// A turntable before a camera that stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turntable {
    /// By how much it turns from one view to the next, either way round \[rad\]; `None` if that is
    /// not said.
    pub step_rad: Option<f64>,
}

#[derive(Debug)]
struct View {
    file: PathBuf,
    /// The identity where no view has a pose.
    world_from_camera: Isometry3,
    /// Whether its pose was written column by column.
    by_columns: bool,
    /// Whether the camera looks along -z, with y up.
    opengl: bool,
    /// Metres in the unit of a file that is no depth image.
    unit_m: f64,
    intrinsics: Option<Intrinsics>,
    depth_scale: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ListFile {
    schema: String,
    #[serde(default)]
    intrinsics: Option<Value>,
    #[serde(default)]
    depth_scale: Option<f64>,
    #[serde(default)]
    camera_axes: Axes,
    #[serde(default)]
    turntable_step_deg: Option<f64>,
    views: Vec<ViewFile>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Axes {
    #[default]
    Opencv,
    Opengl,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewFile {
    file: String,
    #[serde(default)]
    world_from_camera: Option<Value>,
    #[serde(default)]
    unit: Option<String>,
    #[serde(default)]
    intrinsics: Option<Value>,
    #[serde(default)]
    depth_scale: Option<f64>,
}

impl Views {
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let views = self.views.iter().map(|view| view.file.clone());
        self.others.iter().cloned().chain(views).collect()
    }
}

pub(super) fn is_folder(path: &Path) -> bool {
    path.join(VIEWS_FILE).is_file() || path.join(FOLDER_INTRINSICS).is_file()
}

/// The set of views that `path` stands for; `None` if it is none.
pub(super) fn list(path: &Path) -> Option<Result<Views, ReadError>> {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    if named && path.is_file() {
        Some(read_list(path))
    } else if path.join(VIEWS_FILE).is_file() {
        Some(read_list(&path.join(VIEWS_FILE)))
    } else if path.join(FOLDER_INTRINSICS).is_file() {
        Some(of_folder(path))
    } else {
        None
    }
}

fn read_list(path: &Path) -> Result<Views, ReadError> {
    let bytes = regular_file(path).map_err(|at| at.in_file(path))?;
    parse(&bytes, path)
}

/// Reads a list that lies at `path`; of the files that it names, cameras only.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Views, ReadError> {
    let fault = |fault: String| Fault::Layout(fault).anywhere().in_file(path);
    let bytes = text_bytes(bytes).map_err(|at| at.in_file(path))?;
    let list: ListFile = serde_json::from_slice(&bytes).map_err(|error| {
        fault(format!("not a list of views ({error}); see docs/formats.md for its form"))
    })?;
    if list.schema != VIEWS_SCHEMA {
        let found = shown(list.schema.as_bytes());
        return Err(fault(format!("schema is `{found}`, expected `{VIEWS_SCHEMA}`")));
    }
    if list.views.is_empty() {
        return Err(fault("names no views; add one at least".to_owned()));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut others = vec![path.to_owned()];
    let mut camera = |value: &Value| match value {
        Value::String(name) => {
            let file = inside(folder, name).map_err(|e| fault(format!("intrinsics: {e}")))?;
            let found = intrinsics::read(&file)?;
            if !others.contains(&file) {
                others.push(file);
            }
            Ok(found)
        }
        value => intrinsics::of_value(value).map_err(|e| fault(format!("intrinsics: {e}"))),
    };
    let turntable = turntable(&list).map_err(fault)?;
    let shared = list.intrinsics.as_ref().map(&mut camera).transpose()?;
    let mut views = Vec::with_capacity(list.views.len());
    for (index, view) in list.views.iter().enumerate() {
        let at = |text: String| {
            fault(format!("view {index} (`{}`): {text}", shown(view.file.as_bytes())))
        };
        let own = view.intrinsics.as_ref().map(&mut camera).transpose()?;
        let (world_from_camera, by_columns) = match &view.world_from_camera {
            Some(value) => pose(value).map_err(at)?,
            None => (Isometry3::identity(), false),
        };
        views.push(View {
            file: inside(folder, &view.file).map_err(at)?,
            world_from_camera,
            by_columns,
            opengl: matches!(list.camera_axes, Axes::Opengl),
            unit_m: match view.unit.as_deref() {
                None | Some("m") => 1.0,
                Some("mm") => M_PER_MM,
                Some(other) => {
                    let other = shown(other.as_bytes());
                    return Err(at(format!("unit is `{other}`; give m or mm")));
                }
            },
            intrinsics: own.or(shared),
            depth_scale: view.depth_scale.or(list.depth_scale),
        });
    }
    let views = once(views).map_err(fault)?;
    Ok(Views { views, others, turntable })
}

/// The turntable of a list whose views have no poses; `None` of one whose views do.
fn turntable(list: &ListFile) -> Result<Option<Turntable>, String> {
    let posed = list.views.iter().filter(|view| view.world_from_camera.is_some()).count();
    let step_rad = list.turntable_step_deg.map(f64::to_radians);
    match (posed, step_rad) {
        (0, Some(step)) if !(0.0..=std::f64::consts::PI).contains(&step.abs()) || step == 0.0 => {
            Err("turntable_step_deg is none; give degrees up to 180".to_owned())
        }
        (0, _) => Ok(Some(Turntable { step_rad })),
        (posed, None) if posed == list.views.len() => Ok(None),
        (posed, None) => Err(format!(
            "{posed} of {} views have a world_from_camera; give it for all, or for none of a turntable's",
            list.views.len()
        )),
        (_, Some(_)) => {
            Err("turntable_step_deg is for views without poses; leave one out".to_owned())
        }
    }
}

/// The views without those that stand in the list twice. A list is short, and what it names would
/// be read as often as it is named.
fn once(views: Vec<View>) -> Result<Vec<View>, String> {
    let mut poses: HashMap<PathBuf, Isometry3> = HashMap::new();
    let mut kept = Vec::with_capacity(views.len());
    for view in views {
        let file = view.file.canonicalize().unwrap_or_else(|_| view.file.clone());
        match poses.insert(file, view.world_from_camera) {
            None => kept.push(view),
            Some(pose) if pose == view.world_from_camera => {}
            Some(_) => {
                let name = shown(view.file.to_string_lossy().as_bytes());
                return Err(format!(
                    "`{name}` stands there twice, with two poses; leave out the wrong one"
                ));
            }
        }
    }
    Ok(kept)
}

/// The file `name` of a folder, there or not.
fn inside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let outside = |how: &str| {
        let name = shown(name.as_bytes());
        Err(format!("`{name}` {how}; put the file next to the list and name it relative to it"))
    };
    let steps = |step| matches!(step, Component::Normal(_) | Component::CurDir);
    if !Path::new(name).components().all(steps) {
        return outside("leads out of the list's folder");
    }
    let file = folder.join(name);
    let whole = |path: &Path| path.canonicalize();
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (whole(&file), whole(folder)) {
        (Ok(file), Ok(folder)) if !file.starts_with(&folder) => {
            outside("is a link that leads out of the list's folder")
        }
        // Who reads it says that it is not there.
        _ => Ok(file),
    }
}

/// A folder of depth images with poses beside them.
fn of_folder(folder: &Path) -> Result<Views, ReadError> {
    let camera_file = folder.join(FOLDER_INTRINSICS);
    let camera = intrinsics::read(&camera_file)?;
    let in_folder = |at: At| at.in_file(folder);
    let entries = std::fs::read_dir(folder).map_err(|e| in_folder(At::opening(e)))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry.map_err(|e| in_folder(At::opening(e)))?.file_name();
        names.extend(name.to_str().and_then(|n| n.strip_suffix(FOLDER_DEPTH)).map(String::from));
    }
    names.sort();
    let pose_of = |name: &str| folder.join(format!("{name}.pose.txt"));
    let turns = !names.iter().any(|name| pose_of(name).exists());
    if names.is_empty() {
        let fault = format!("has {FOLDER_INTRINSICS} but no *{FOLDER_DEPTH}; add the depth images");
        return Err(in_folder(Fault::Layout(fault).anywhere()));
    }
    let (mut views, mut others) = (Vec::new(), vec![camera_file]);
    for name in names {
        let pose = pose_of(&name);
        let (world_from_camera, by_columns) = match turns {
            true => (Isometry3::identity(), false),
            false => pose_in(&pose)?,
        };
        views.push(View {
            file: folder.join(name + FOLDER_DEPTH),
            world_from_camera,
            by_columns,
            opengl: false,
            unit_m: 1.0,
            intrinsics: Some(camera),
            depth_scale: None,
        });
        others.extend((!turns).then_some(pose));
    }
    Ok(Views { views, others, turntable: turns.then_some(Turntable { step_rad: None }) })
}

/// The pose in a file of sixteen numbers.
fn pose_in(path: &Path) -> Result<(Isometry3, bool), ReadError> {
    let bytes = regular_file(path).map_err(|at| at.in_file(path))?;
    let numbers: Option<Vec<f64>> = words(&bytes).take(17).map(number).collect();
    let found = numbers.ok_or_else(|| "not sixteen numbers".to_owned());
    let found = found.and_then(|numbers| rigid(&numbers));
    found.map_err(|fault| Fault::Layout(fault).anywhere().in_file(path))
}

/// A 4 x 4 matrix of JSON, flat or in rows, as [`rigid`] has it.
fn pose(value: &Value) -> Result<(Isometry3, bool), String> {
    let cells = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let flat = cells
        .iter()
        .flat_map(|cell| cell.as_array().map_or(std::slice::from_ref(cell), Vec::as_slice));
    let numbers: Option<Vec<f64>> = flat.map(Value::as_f64).collect();
    rigid(&numbers.ok_or("world_from_camera holds something that is no number")?)
}

/// Sixteen numbers, row by row, as a rigid motion; and whether they stood column by column, which a
/// last row tells that holds a shift.
fn rigid(numbers: &[f64]) -> Result<(Isometry3, bool), String> {
    let remedy = "give the camera's pose as a rigid 4 x 4 matrix, row by row, in metres";
    if numbers.len() != 16 {
        return Err(format!("the pose has {} numbers, not 16; {remedy}", numbers.len()));
    }
    let by_rows = Matrix4::from_row_slice(numbers);
    let ends = |row: &Matrix4<f64>| {
        row.row(3).iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-9)
    };
    let by_columns = !ends(&by_rows) && ends(&by_rows.transpose());
    let whole = if by_columns { by_rows.transpose() } else { by_rows };
    let turn: Matrix3<f64> = whole.fixed_view::<3, 3>(0, 0).into();
    let off = (turn.transpose() * turn - Matrix3::identity()).abs().max();
    if !numbers.iter().all(|n| n.is_finite()) || !ends(&whole) || off > ROTATION_TOLERANCE {
        return Err(format!("the pose is no rigid motion (off by {off:.3}); {remedy}"));
    }
    if turn.determinant() < 0.0 {
        return Err(format!("the pose mirrors; {remedy}"));
    }
    let shift: Vector3 = whole.fixed_view::<3, 1>(0, 3).into();
    // The nearest rotation, after Arun et al. 1987. (nalgebra's iteration from the
    // identity was tried: it does not leave it for a half turn.)
    let svd = turn.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(format!("the pose has no rotation; {remedy}"));
    };
    let turn = Rotation3::from_matrix_unchecked(u * v_t);
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    Ok((Isometry3::from_parts(Translation3::from(shift), turn), by_columns))
}

/// One view of a set.
#[derive(Clone, Debug)]
pub struct SeenView {
    /// Its file's name, as the set has it.
    pub name: String,
    /// What it sees, in its camera's frame (x right, y down, z forward for a depth image) \[m\].
    pub cloud: Cloud,
    /// The set's frame from the camera's, as the set has it.
    pub pose: Isometry3,
    /// What its reader left out.
    pub notes: ReadNotes,
}

/// The views of a set, read.
#[derive(Clone, Debug)]
pub struct SeenViews {
    /// The views, in order.
    pub views: Vec<SeenView>,
    /// How the drape turned, where the set has no poses: then those of the views are the identity.
    pub turntable: Option<Turntable>,
}

/// Reads the files of all views.
pub(super) fn read(list: &Views, options: &ReadOptions) -> Result<SeenViews, ReadError> {
    let views = list.views.iter().map(|view| view.read(options)).collect::<Result<_, _>>()?;
    Ok(SeenViews { views, turntable: list.turntable })
}

impl View {
    fn read(&self, options: &ReadOptions) -> Result<SeenView, ReadError> {
        let own = ReadOptions {
            intrinsics: self.intrinsics.or(options.intrinsics),
            depth_scale: self.depth_scale.unwrap_or(options.depth_scale),
            max_jump_m: options.max_jump_m,
            ..ReadOptions::default()
        };
        let read = read_file(&self.file, &own).map_err(|at| at.in_file(&self.file));
        let (mut cloud, mut notes) = read?;
        let is_depth = notes.format == Some(Format::DepthPng);
        if !is_depth {
            cloud.points.iter_mut().for_each(|p| *p *= self.unit_m);
        }
        let name = self.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if self.by_columns {
            notes.taken.push(POSES_BY_COLUMNS.to_owned());
        }
        let pose = self.world_from_camera
            * if is_depth && self.opengl { opengl() } else { Isometry3::identity() };
        Ok(SeenView { name, cloud, pose, notes })
    }
}

/// The axes of a camera that looks along -z with y up, in those of one that looks along z with y
/// down.
#[must_use]
pub fn opengl() -> Isometry3 {
    Isometry3::rotation(Vector3::x() * std::f64::consts::PI)
}

/// All views as one cloud, each where its pose puts it; `None` of no views.
#[must_use]
pub fn joined_as_posed(views: Vec<SeenView>) -> Option<(Cloud, ReadNotes)> {
    let colored = views.iter().all(|view| view.cloud.colors.len() == view.cloud.points.len());
    let mut cloud = Cloud::default();
    let mut notes: Option<ReadNotes> = None;
    for SeenView { cloud: mut seen, pose, notes: its, .. } in views {
        let base = cloud.points.len() as u32;
        cloud.points.extend(seen.points.iter().map(|p| pose * p));
        if colored {
            cloud.colors.append(&mut seen.colors);
        }
        cloud.triangles.extend(seen.triangles.iter().map(|t| t.map(|vertex| vertex + base)));
        match &mut notes {
            Some(notes) => notes.add(its),
            None => notes = Some(ReadNotes { format: Some(Format::Views), ..its }),
        }
    }
    notes.map(|notes| (cloud, notes))
}

impl ReadNotes {
    fn add(&mut self, other: Self) {
        self.points_in_file += other.points_in_file;
        self.dropped_non_finite += other.dropped_non_finite;
        self.dropped_jumps += other.dropped_jumps;
        self.dropped_triangles += other.dropped_triangles;
        self.degenerate_triangles += other.degenerate_triangles;
        for name in other.ignored {
            if !self.ignored.contains(&name) {
                self.ignored.push(name);
            }
        }
        for text in other.taken {
            if !self.taken.contains(&text) {
                self.taken.push(text);
            }
        }
    }
}

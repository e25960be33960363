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
//!     { "file": "side.ply", "unit": "mm", "world_from_camera": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] }
//!   ]
//! }
//! ```
//!
//! Files are named relative to it and lie in its folder or below: a list from elsewhere
//! must not make its reader open the reader's other files. `world_from_camera` is rigid, row by row, its
//! translation in metres. `intrinsics` is a file of [`super::intrinsics`] or such a
//! JSON object; it and `depth_scale` may stand in a view as well. A view is a 16-bit
//! depth PNG, or any other scan file in its camera's frame, in metres or in the
//! `unit` named. `camera_axes`: `opencv` (x right, y down, z forward) or `opengl`
//! (x right, y up, z backward).
//!
//! A folder with `camera-intrinsics.txt`, `NAME.depth.png` and `NAME.pose.txt`
//! (7-Scenes and the tools after it; millimetres, 65535 for nothing) is read as
//! such a set.
//!
//! The clouds are joined, not downsampled: `scan` weighs and downsamples.

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

/// A set of views, read but not their files.
#[derive(Debug)]
pub(super) struct Views {
    /// The list, or the folder.
    path: PathBuf,
    views: Vec<View>,
    /// Files besides the views: the list, cameras, poses.
    others: Vec<PathBuf>,
}

#[derive(Debug)]
struct View {
    file: PathBuf,
    world_from_camera: Isometry3,
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
    world_from_camera: Value,
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
    let shared = list.intrinsics.as_ref().map(&mut camera).transpose()?;
    let mut views = Vec::with_capacity(list.views.len());
    for (index, view) in list.views.iter().enumerate() {
        let at = |text: String| {
            fault(format!("view {index} (`{}`): {text}", shown(view.file.as_bytes())))
        };
        let own = view.intrinsics.as_ref().map(&mut camera).transpose()?;
        views.push(View {
            file: inside(folder, &view.file).map_err(at)?,
            world_from_camera: pose(&view.world_from_camera).map_err(at)?,
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
    Ok(Views { path: path.to_owned(), views, others })
}

/// The file `name` of a folder, there or not.
fn inside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let outside = |how: &str| {
        let name = shown(name.as_bytes());
        Err(format!("`{name}` {how}; put the file beside the list and name it relative to it"))
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
    if names.is_empty() {
        let fault = format!("has {FOLDER_INTRINSICS} but no *{FOLDER_DEPTH}; add the depth images");
        return Err(in_folder(Fault::Layout(fault).anywhere()));
    }
    let (mut views, mut others) = (Vec::new(), vec![camera_file]);
    for name in names {
        let path = folder.join(format!("{name}.pose.txt"));
        let bytes = regular_file(&path).map_err(|at| at.in_file(&path))?;
        let numbers: Option<Vec<f64>> = words(&bytes).take(17).map(number).collect();
        let found = numbers.ok_or_else(|| "not sixteen numbers".to_owned());
        let found = found.and_then(|numbers| rigid(&numbers));
        let fault = |fault: String| Fault::Layout(fault).anywhere().in_file(&path);
        views.push(View {
            file: folder.join(name + FOLDER_DEPTH),
            world_from_camera: found.map_err(fault)?,
            opengl: false,
            unit_m: 1.0,
            intrinsics: Some(camera),
            depth_scale: None,
        });
        others.push(path);
    }
    Ok(Views { path: folder.to_owned(), views, others })
}

/// A 4 x 4 matrix of JSON, flat or in rows.
fn pose(value: &Value) -> Result<Isometry3, String> {
    let cells = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let flat = cells
        .iter()
        .flat_map(|cell| cell.as_array().map_or(std::slice::from_ref(cell), Vec::as_slice));
    let numbers: Option<Vec<f64>> = flat.map(Value::as_f64).collect();
    rigid(&numbers.ok_or("world_from_camera holds something that is no number")?)
}

/// Sixteen numbers, row by row, as a rigid motion.
fn rigid(numbers: &[f64]) -> Result<Isometry3, String> {
    let remedy = "give the camera's pose as a rigid 4 x 4 matrix, row by row, in metres";
    if numbers.len() != 16 {
        return Err(format!("the pose has {} numbers, not 16; {remedy}", numbers.len()));
    }
    let whole = Matrix4::from_row_slice(numbers);
    let turn: Matrix3<f64> = whole.fixed_view::<3, 3>(0, 0).into();
    let off = (turn.transpose() * turn - Matrix3::identity()).abs().max();
    let last = whole.row(3).iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-9);
    if !numbers.iter().all(|n| n.is_finite()) || !last || off > ROTATION_TOLERANCE {
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
    Ok(Isometry3::from_parts(Translation3::from(shift), turn))
}

/// Reads the files of all views and joins them.
pub(super) fn read(list: &Views, options: &ReadOptions) -> Result<(Cloud, ReadNotes), ReadError> {
    let mut cloud = Cloud::default();
    let mut notes: Option<ReadNotes> = None;
    let mut colored = true;
    for view in &list.views {
        let own = ReadOptions {
            intrinsics: view.intrinsics.or(options.intrinsics),
            depth_scale: view.depth_scale.unwrap_or(options.depth_scale),
            max_jump_m: options.max_jump_m,
            format: None,
        };
        let (mut seen, its) = read_file(&view.file, &own).map_err(|at| at.in_file(&view.file))?;
        let scale = if its.format == Some(Format::DepthPng) { 1.0 } else { view.unit_m };
        colored &= seen.colors.len() == seen.points.len();
        let base = cloud.points.len() as u32;
        cloud.points.extend(seen.points.iter().map(|p| {
            let mut p = p * scale;
            if view.opengl && its.format == Some(Format::DepthPng) {
                (p.y, p.z) = (-p.y, -p.z);
            }
            view.world_from_camera * p
        }));
        cloud.colors.append(&mut seen.colors);
        cloud.triangles.extend(seen.triangles.iter().map(|t| t.map(|vertex| vertex + base)));
        match &mut notes {
            Some(notes) => notes.add(its),
            None => notes = Some(ReadNotes { format: Some(Format::Views), ..its }),
        }
    }
    if !colored {
        cloud.colors.clear();
    }
    match notes {
        Some(notes) => Ok((cloud, notes)),
        None => Err(Fault::NoPoints.anywhere().in_file(&list.path)),
    }
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

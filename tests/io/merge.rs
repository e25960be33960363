//! Views and passes of one drape, brought together.

use std::path::{Path, PathBuf};

use crate::program;
use scan2params::base::{Isometry3, Point3, Vector3};
use scan2params::geom::Cloud;
use scan2params::intake::joined;
use scan2params::io::{ReadNotes, ReadOptions, read_scan, write_ply};
use scan2params::scan::{ScanOptions, plate_of};
use serde_json::{Value, json};

/// Every third of a fixture's points, enough to bring parts together by, and their unit \[m\].
fn drape(name: &str) -> (Vec<Point3>, f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans").join(name);
    let points: Vec<Point3> = read_scan(path).unwrap().0.points.into_iter().step_by(3).collect();
    let far = points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
    (points, if far > 20.0 { 1e-3 } else { 1.0 })
}

/// Three parts that overlap, in metres: what lies within an angle of each of three directions.
fn parts_within(name: &str, most_deg: f64) -> Vec<Vec<Point3>> {
    let (points, unit_m) = drape(name);
    let points: Vec<Point3> = points.iter().map(|p| p * unit_m).collect();
    let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
    let toward = |k: usize| {
        let angle = k as f64 * std::f64::consts::TAU / 3.0;
        Vector3::new(angle.cos(), angle.sin(), 0.3)
    };
    let part = |k: usize| {
        let seen = |p: &&Point3| {
            (*p - middle).coords.normalize().angle(&toward(k)) < most_deg.to_radians()
        };
        points.iter().filter(seen).copied().collect()
    };
    (0..3).map(part).collect()
}

fn parts(name: &str) -> Vec<Vec<Point3>> {
    parts_within(name, 100.0)
}

/// A miss of 17 mm and 4 degrees about the middle of points.
fn miss(points: &[Point3], k: usize) -> Isometry3 {
    let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
    let to = Isometry3::translation(middle.x, middle.y, middle.z);
    let signs = [[1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]][k];
    let direction = Vector3::from(signs).normalize();
    let turn = Vector3::new(signs[2], signs[0], signs[1]).normalize() * 4.0_f64.to_radians();
    Isometry3::new(direction * 0.017, Vector3::zeros())
        * to
        * Isometry3::rotation(turn)
        * to.inverse()
}

fn read(path: &Path, passes: &[PathBuf]) -> (Cloud, ReadNotes) {
    let options = ReadOptions { passes: passes.to_vec(), ..ReadOptions::default() };
    joined::read(path, &options, &ScanOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// How far parts that were read lie from the true ones in the frame of the first, root mean square
/// \[mm\].
fn off_mm(read: &[Point3], truth: &[Vec<Point3>], frame: &Isometry3) -> f64 {
    let truth: Vec<Point3> = truth.iter().flatten().map(|p| frame * p).collect();
    assert_eq!(read.len(), truth.len());
    let sum: f64 = read.iter().zip(&truth).map(|(a, b)| (a - b).norm_squared()).sum();
    1e3 * (sum / truth.len() as f64).sqrt()
}

fn written(
    folder: &Path,
    parts: &[Vec<Point3>],
    motions: &[Isometry3],
    scale: f64,
) -> Vec<PathBuf> {
    let write = |(k, (part, motion)): (usize, (&Vec<Point3>, &Isometry3))| {
        let path = folder.join(format!("pass-{k}.ply"));
        let points = part.iter().map(|p| motion * p).collect();
        write_ply(&path, &Cloud { points, ..Cloud::default() }, scale).unwrap();
        path
    };
    parts.iter().zip(motions).enumerate().map(write).collect()
}

#[test]
fn passes_that_miss_each_other_are_brought_together() {
    let folder = tempfile::tempdir().unwrap();
    let parts = parts("mean_structured-light.ply");
    let misses: Vec<Isometry3> = (0..3).map(|k| miss(&parts[k], k)).collect();
    let paths = written(folder.path(), &parts, &misses, 1.0);
    let (cloud, notes) = read(&paths[0], &paths[1..]);
    assert!(off_mm(&cloud.points, &parts, &misses[0]) < 0.2);
    assert_eq!(notes.views.len(), 3);
    assert!(notes.views[0].moved_m < 1e-9, "the first stays");
    assert!(notes.views[1].moved_m > 0.01 && notes.views[1].misfit_m < 0.3e-3);
    // In millimetres: of the first's unit again.
    let paths = written(folder.path(), &parts, &misses, 1e3);
    let (mm, _) = read(&paths[0], &paths[1..]);
    let points: Vec<Point3> = mm.points.iter().map(|p| p * 1e-3).collect();
    assert!(off_mm(&points, &parts, &misses[0]) < 0.2);
}

#[test]
fn passes_in_unrelated_frames_are_brought_together_about_their_plates() {
    let folder = tempfile::tempdir().unwrap();
    // Each sees most of the plate.
    let parts = parts_within("woven_structured-light.ply", 130.0);
    let frames = [
        Isometry3::identity(),
        Isometry3::new(Vector3::new(0.7, -0.4, 0.2), Vector3::new(1.0, 2.0, -0.5)),
        Isometry3::new(Vector3::new(-1.0, 0.1, 0.9), Vector3::new(-2.0, 0.3, 0.7)),
    ];
    let paths = written(folder.path(), &parts, &frames, 1.0);
    let (cloud, notes) = read(&paths[0], &paths[1..]);
    assert!(off_mm(&cloud.points, &parts, &frames[0]) < 0.2, "{:?}", notes.views);
}

#[test]
fn passes_of_two_drapes_on_one_stand_are_refused_by_name() {
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans");
    for [one, other] in [["mean", "stiff"], ["woven", "mean"]] {
        let path = |name: &str| scans.join(format!("{name}_structured-light.ply"));
        let options = ReadOptions { passes: vec![path(other)], ..ReadOptions::default() };
        let read = joined::read(&path(one), &options, &ScanOptions::default());
        let said = read.map(|_| ()).unwrap_err().to_string();
        assert!(said.contains("do not lie on one another"), "{said}");
        assert!(said.contains(&format!("{other}_structured-light.ply")), "{said}");
    }
}

/// A `views.json` of parts in their cameras' frames, its poses written by `write`.
fn views(
    folder: &Path,
    parts: &[Vec<Point3>],
    poses: &[Isometry3],
    write: impl Fn(&Isometry3) -> Value,
) {
    let inverses: Vec<Isometry3> = poses.iter().map(Isometry3::inverse).collect();
    written(folder, parts, &inverses, 1.0);
    let view = |(k, pose): (usize, &Isometry3)| json!({ "file": format!("pass-{k}.ply"), "world_from_camera": write(pose) });
    let list: Vec<Value> = poses.iter().enumerate().map(view).collect();
    let document = json!({ "schema": "scan2params/views/1", "views": list });
    std::fs::write(folder.join("views.json"), document.to_string()).unwrap();
}

/// A `views.json` without poses: a fixture that turns by a step before a camera that stands still,
/// and a wall that does not; and the whole turn of each view in the first one's frame.
fn turntable(folder: &Path, step_deg: f64, count: usize) -> Vec<Isometry3> {
    let (points, unit_m) = drape("mean_structured-light.ply");
    let points: Vec<Point3> = points.iter().map(|p| p * unit_m).collect();
    let plate = plate_of(&points, &ScanOptions::default()).unwrap();
    let up = nalgebra::Unit::new_normalize(plate.up);
    let level = up.cross(&Vector3::new(0.3, 0.5, 0.7)).normalize();
    // The plate stands beside the axis.
    let axis = Isometry3::from(plate.centre.coords + 0.012 * level);
    let camera = cameras()[1].inverse();
    let turn = |k: usize| {
        let angle = Vector3::from(*up) * (k as f64 * step_deg).to_radians();
        axis * Isometry3::rotation(angle) * axis.inverse()
    };
    let middle = plate.centre - 0.07 * *up;
    let seen = |p: &Point3| (p - middle).angle(&(level + 0.4 * *up)) < 100_f64.to_radians();
    let wall = (0..10_000).map(|k| {
        let at = [f64::from(k % 100) - 50.0, f64::from(k / 100) - 50.0].map(|steps| 0.01 * steps);
        plate.centre - 0.5 * level + up.cross(&level) * at[0] + *up * at[1]
    });
    for k in 0..count {
        let turned = points.iter().map(|p| turn(k) * p).filter(seen).chain(wall.clone());
        let points = turned.map(|p| camera * p).collect();
        write_ply(folder.join(format!("{k}.ply")), &Cloud { points, ..Cloud::default() }, 1.0)
            .unwrap();
    }
    let list: Vec<Value> = (0..count).map(|k| json!({ "file": format!("{k}.ply") })).collect();
    let document = json!({ "schema": "scan2params/views/1", "views": list });
    std::fs::write(folder.join("views.json"), document.to_string()).unwrap();
    (0..count).map(|k| camera * turn(k).inverse() * camera.inverse()).collect()
}

#[test]
fn a_turntables_views_need_no_poses() {
    let folder = tempfile::tempdir().unwrap();
    let poses = turntable(folder.path(), -24.0, 15);
    let (cloud, notes) = read(folder.path(), &[]);
    let mut truth = Vec::new();
    for (k, pose) in poses.iter().enumerate() {
        let points = read_scan(folder.path().join(format!("{k}.ply"))).unwrap().0.points;
        // The wall comes last.
        truth.extend(points[..points.len() - 10_000].iter().map(|p| pose * p));
    }
    assert!(off_mm(&cloud.points, &[truth], &Isometry3::identity()) < 0.2, "{:?}", notes.views);
    assert!(notes.views.iter().all(|view| view.left_out.is_none()), "{:?}", notes.views);
    let said = notes.taken.iter().find(|said| said.contains("turntable")).unwrap();
    assert!(said.contains("15 of them, turned by -24.0 degrees"), "{said}");
}

#[test]
fn a_turntables_step_may_be_said_and_a_wrong_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    turntable(folder.path(), 40.0, 5);
    let path = folder.path().join("views.json");
    let with = |change: &dyn Fn(&mut Value)| {
        let mut list = json!({ "schema": "scan2params/views/1", "views": [] });
        list["views"] = (0..5).map(|k| json!({ "file": format!("{k}.ply") })).collect();
        change(&mut list);
        std::fs::write(&path, list.to_string()).unwrap();
        joined::read(&path, &ReadOptions::default(), &ScanOptions::default())
            .map(|(_, notes)| notes.taken.join("; "))
            .map_err(|error| error.to_string())
    };
    let said = with(&|list| list["turntable_step_deg"] = json!(40)).unwrap();
    assert!(said.contains("turned by 40.0 degrees"), "{said}");
    let refused = with(&|list| list["turntable_step_deg"] = json!(75)).unwrap_err();
    assert!(refused.contains("a turn of 75.0 degrees"), "{refused}");
    let none = with(&|list| list["turntable_step_deg"] = json!(0)).unwrap_err();
    assert!(none.contains("degrees up to 180"), "{none}");
    let pose = flat(&rows(&Isometry3::identity(), 1.0));
    let mixed = with(&|list| list["views"][2]["world_from_camera"] = pose.clone()).unwrap_err();
    assert!(mixed.contains("1 of 5 views have a world_from_camera"), "{mixed}");
}

fn rows(pose: &Isometry3, shift_scale: f64) -> nalgebra::Matrix4<f64> {
    let mut matrix = pose.to_homogeneous();
    matrix.fixed_view_mut::<3, 1>(0, 3).scale_mut(shift_scale);
    matrix
}

/// `f64`s row by row.
fn flat(matrix: &nalgebra::Matrix4<f64>) -> Value {
    json!(matrix.transpose().as_slice())
}

fn cameras() -> Vec<Isometry3> {
    let camera = |k: usize| {
        let x = k as f64;
        Isometry3::new(Vector3::new(0.5 - x, 0.3 * x, 0.6), Vector3::new(0.8 * x, 0.4, 1.0 - x))
    };
    (0..3).map(camera).collect()
}

#[test]
fn poses_in_another_convention_are_known_by_how_the_views_agree() {
    let parts = parts("mean_structured-light.ply");
    let poses = cameras();
    type Write = fn(&Isometry3) -> Value;
    let ways: [(Write, &str); 5] = [
        (|pose| flat(&rows(pose, 1.0)), ""),
        (|pose| flat(&rows(&pose.inverse(), 1.0)), "as camera_from_world:"),
        (|pose| flat(&rows(pose, 1e3)), "with shifts in mm:"),
        (|pose| flat(&rows(pose, 1.0).transpose()), "column by column"),
        (
            |pose| flat(&rows(&pose.inverse(), 1e3).transpose()),
            "as camera_from_world, with shifts in mm:",
        ),
    ];
    for (write, word) in ways {
        let folder = tempfile::tempdir().unwrap();
        views(folder.path(), &parts, &poses, write);
        let (cloud, notes) = read(folder.path(), &[]);
        assert!(off_mm(&cloud.points, &parts, &Isometry3::identity()) < 0.1, "{word}");
        let said = notes.taken.join("; ");
        assert_eq!(said.is_empty(), word.is_empty(), "{said}");
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn a_view_of_a_drape_that_has_moved_is_left_out_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut seen = parts("mean_structured-light.ply");
    let (points, unit_m) = drape("mean_structured-light.ply");
    let whole: Vec<Point3> = points.iter().map(|p| p * unit_m).collect();
    seen.push(whole);
    // It is 8 % larger, so that no motion brings the view back.
    let middle = seen[1].iter().map(|p| p.coords).sum::<Vector3>() / seen[1].len() as f64;
    for p in &mut seen[1] {
        *p = Point3::from(middle + (p.coords - middle) * 1.08);
    }
    let mut poses = cameras();
    poses.push(Isometry3::identity());
    views(folder.path(), &seen, &poses, |pose| flat(&rows(pose, 1.0)));
    let (_, notes) = read(folder.path(), &[]);
    let left_out: Vec<&str> = notes
        .views
        .iter()
        .filter(|view| view.left_out.is_some())
        .map(|view| view.name.as_str())
        .collect();
    assert_eq!(left_out, ["pass-1.ply"], "{:?}", notes.views);
}

#[test]
fn a_view_stands_in_a_list_once() {
    let folder = tempfile::tempdir().unwrap();
    let parts = parts("mean_structured-light.ply");
    views(folder.path(), &parts, &cameras(), |pose| flat(&rows(pose, 1.0)));
    let path = folder.path().join("views.json");
    let mut list: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let first = list["views"][0].clone();
    list["views"].as_array_mut().unwrap().extend(vec![first.clone(); 3000]);
    std::fs::write(&path, list.to_string()).unwrap();
    let (cloud, _) = read(&path, &[]);
    assert_eq!(cloud.points.len(), parts.iter().map(Vec::len).sum::<usize>());
    list["views"][1]["file"] = first["file"].clone();
    std::fs::write(&path, list.to_string()).unwrap();
    let said = read_scan(&path).unwrap_err().to_string();
    assert!(said.contains("pass-0.ply` stands there twice"), "{said}");
}

#[test]
fn a_pass_that_is_named_twice_is_refused_as_that() {
    let path = Path::new("fixtures/scans/mean_truedepth.ply");
    let again = Path::new("fixtures/../fixtures/scans/mean_truedepth.ply");
    let read_options = ReadOptions { passes: vec![again.to_owned()], ..ReadOptions::default() };
    let error = joined::read(path, &read_options, &ScanOptions::default()).unwrap_err();
    assert!(error.to_string().contains("is named twice; give each pass once"), "{error}");
}

#[test]
fn the_program_merges_passes_and_says_what_it_moved() {
    let folder = tempfile::tempdir().unwrap();
    let parts = parts("stiff_structured-light.ply");
    let misses: Vec<Isometry3> = (0..3).map(|k| miss(&parts[k], k)).collect();
    let paths = written(folder.path(), &parts, &misses, 1.0);
    let out = folder.path().join("merged.ply");
    let run = program::program().arg("merge").args(&paths).arg("--out").arg(&out).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let table = String::from_utf8(run.stdout).unwrap();
    assert_eq!(table.lines().count(), 4, "{table}");
    let merged = read_scan(&out).unwrap().0;
    assert!(off_mm(&merged.points, &parts, &misses[0]) < 0.2);
    let run = program::program().arg("inspect").args(&paths).arg("--json").output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found: Value = serde_json::from_slice(&run.stdout).unwrap();
    let views = found["read"]["views"].as_array().unwrap();
    assert_eq!(views.len(), 3);
    assert!(views[2]["moved_mm"].as_f64().unwrap() > 10.0, "{views:?}");
}

#[test]
fn a_scale_that_is_given_divides_all_lengths_and_is_said() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans/mean_truedepth.ply");
    let options = ReadOptions { rescale: Some(1.02), ..ReadOptions::default() };
    let (cloud, notes) = joined::read(&path, &options, &ScanOptions::default()).unwrap();
    let (as_it_is, _) = read_scan(&path).unwrap();
    assert_eq!(cloud.points.len(), as_it_is.points.len());
    let off = cloud.points.iter().zip(&as_it_is.points).map(|(p, q)| (p * 1.02 - q).norm());
    assert!(off.fold(0.0, f64::max) < 1e-12);
    assert!(notes.taken.iter().any(|said| said.contains("divided by 1.02")), "{:?}", notes.taken);
    let none = ReadOptions { rescale: Some(0.0), ..ReadOptions::default() };
    assert!(joined::read(&path, &none, &ScanOptions::default()).is_err());
    let rim = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/drapes/mean.boundary.csv");
    let refused = scan2params::intake::rim::of_input(&rim, &options, &ScanOptions::default());
    assert!(refused.unwrap_err().to_string().contains("the scale of its scan"));
}

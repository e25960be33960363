//! The main job on the fixtures, from file to parameters, against the truth; and
//! what happens to input that cannot be used.

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use scan2params::base::{Boundary, Point3};
use scan2params::io::{boundary_csv, read_scan};
use scan2params::scan::{ScanOptions, WarpToward, boundary_from_scan};
use scan2params::sensor::Truth;
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The true warp direction of a virtual scan, in the scan's frame.
fn warp_of(scan: &str) -> [f64; 3] {
    let truth: Truth =
        serde_json::from_value(json(&fixture(&format!("scans/{scan}.truth.json")))).unwrap();
    let inverse = truth.simulation_from_scanner.inverse();
    (inverse * nalgebra::Vector3::x()).into()
}

fn scan2params(arguments: &[&str]) -> Output {
    Command::cargo_bin("scan2params").unwrap().args(arguments).output().unwrap()
}

fn rim_error_mm(scan: &str, drape: &str) -> f64 {
    let (cloud, _) = read_scan(fixture(&format!("scans/{scan}.ply"))).unwrap();
    let options = ScanOptions {
        warp_toward: Some(WarpToward::Direction(warp_of(scan))),
        ..ScanOptions::default()
    };
    let found = boundary_from_scan(&cloud, &options).unwrap();
    let truth = boundary_csv::read(fixture(&format!("drapes/{drape}.boundary.csv"))).unwrap();
    1e3 * found.boundary.mean_distance_m(&truth)
}

#[test]
fn rims_of_the_fixtures_are_found() {
    // observed: 0.27, 0.28, 1.01 mm
    for (scan, drape, limit_mm) in [
        ("mean_structured-light", "mean", 0.6),
        ("stiff_structured-light", "stiff", 0.6),
        ("mean_truedepth", "mean", 1.6),
    ] {
        let error = rim_error_mm(scan, drape);
        assert!(error < limit_mm, "{scan}: {error:.2} mm");
    }
}

#[test]
fn from_file_to_parameters() {
    let out = tempfile::tempdir().unwrap();
    for (scan, drape) in [("mean_structured-light", "mean"), ("stiff_structured-light", "stiff")] {
        let truth = json(&fixture(&format!("drapes/{drape}.params.json")));
        let density = truth["density"]["value"].as_f64().unwrap();
        let warp = warp_of(scan).map(|v| v.to_string()).join(",");
        let input = fixture(&format!("scans/{scan}.ply"));
        let given = [
            input.to_str().unwrap(),
            "--density",
            &density.to_string(),
            "--warp-toward",
            &warp,
            "--out",
            out.path().to_str().unwrap(),
        ];
        let run = scan2params(&given);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let result = json(&out.path().join(format!("{scan}.params.json")));
        assert_eq!(result["orientation"], "given");
        let mut covered = 0;
        for (key, parameter) in truth["parameters"].as_object().unwrap() {
            let value = parameter["value"].as_f64().unwrap();
            let found = &result["parameters"][key];
            let [low, high] = [0, 1].map(|end| found["interval90"][end].as_f64().unwrap());
            let ratio = found["value"].as_f64().unwrap() / value;
            assert!((0.1..10.0).contains(&ratio), "{scan} {key}: {ratio}");
            covered += usize::from((low..=high).contains(&value));
        }
        // observed: 6 of 6 on both
        assert!(covered >= 5, "{scan}: {covered} of 6 intervals hold the truth");
        let rim = boundary_csv::read(out.path().join(format!("{scan}.boundary.csv"))).unwrap();
        let truth = boundary_csv::read(fixture(&format!("drapes/{drape}.boundary.csv"))).unwrap();
        assert!(rim.mean_distance_m(&truth) < 2e-3);
        let error = result["boundary"]["mean_error_mm"].as_f64().unwrap();
        // observed: 15.0 and 8.6 mm; two drops of one fabric differ by 17 to 20 mm
        assert!(error < 25.0, "{scan}: re-simulated rim is {error} mm off");
        let picture = image::open(out.path().join(format!("{scan}.boundary.png"))).unwrap();
        assert!(picture.width() > 1000);
    }
}

#[test]
fn without_a_direction_the_answer_is_flagged_as_ambiguous() {
    let input = fixture("scans/mean_structured-light.ply");
    let run = scan2params(&[input.to_str().unwrap(), "--density", "214", "--json"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let result: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(result["orientation"], "ambiguous");
    assert_eq!(result["candidates"].as_array().unwrap().len(), 2);
}

/// Runs the program on a file of this content and gives exit code and message.
fn refusal(name: &str, content: &[u8], density: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    let run = scan2params(&[path.to_str().unwrap(), "--density", density]);
    let message = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.stdout.is_empty(), "a number was given for {name}");
    (run.status.code(), message)
}

#[test]
fn bad_files_get_an_error_that_names_the_file() {
    let whole = std::fs::read(fixture("scans/mean_structured-light.ply")).unwrap();
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n\
                  property float x\nproperty float y\nproperty float z\nend_header\n";
    let empty = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n";
    let nan = format!("{}{}", empty.replace("vertex 0", "vertex 9"), "nan nan nan\n".repeat(9));
    for (name, content) in [
        ("truncated.ply", &whole[..whole.len() / 2]),
        ("absurd.ply", header.as_bytes()),
        ("empty.ply", empty.as_bytes()),
        ("nothing.ply", b"".as_slice()),
        ("nan.ply", nan.as_bytes()),
        ("picture.jpeg", b"\xff\xd8\xff".as_slice()),
    ] {
        let (code, message) = refusal(name, content, "180");
        assert_eq!(code, Some(1), "{name}: {message}");
        assert!(message.contains(name), "{message}");
    }
    let run = scan2params(&["missing.ply", "--density", "180"]);
    assert_eq!(run.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&run.stderr).contains("missing.ply"));
}

#[test]
fn densities_of_no_textile_are_usage_errors() {
    let input = fixture("scans/mean_structured-light.ply");
    for density in ["0", "0.5", "2500", "-3", "nan", "inf"] {
        let flag = format!("--density={density}");
        let run = scan2params(&[input.to_str().unwrap(), &flag]);
        assert_eq!(run.status.code(), Some(2), "{density}");
        assert!(run.stdout.is_empty());
    }
}

#[test]
fn a_cloud_without_a_drape_is_refused() {
    let mut rows = String::new();
    for i in 0..100 {
        for j in 0..100 {
            rows += &format!("{} {} 0\n", f64::from(i) * 0.005, f64::from(j) * 0.005);
        }
    }
    let (code, message) = refusal("floor.xyz", rows.as_bytes(), "180");
    assert_eq!(code, Some(4), "{message}");
    assert!(message.contains("floor.xyz"), "{message}");
}

#[test]
fn real_scans_without_our_drape_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/scans");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {} is absent (see its ORIGIN.md)", folder.display());
        return;
    };
    for entry in entries {
        let path = entry.unwrap().path();
        if path.is_file() {
            let run = scan2params(&[path.to_str().unwrap(), "--density", "180"]);
            let message = String::from_utf8_lossy(&run.stderr);
            assert_eq!(run.status.code(), Some(4), "{}: {message}", path.display());
            assert!(run.stdout.is_empty());
            assert!(message.contains("refused"), "{message}");
        }
    }
}

#[test]
fn the_simulator_drapes_from_flags() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("drape.obj");
    let flags = "simulate --stretch-weft 240000 --stretch-warp 310000 --shear 90000 \
                 --bending-weft 5200 --bending-warp 3600 --bending-bias 4100 --density 260 \
                 --vertices 31 --json --out";
    let mut arguments: Vec<&str> = flags.split_whitespace().collect();
    arguments.push(out.to_str().unwrap());
    let run = scan2params(&arguments);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let report: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(report["stop"], "at_rest");
    let (cloud, _) = read_scan(&out).unwrap();
    assert_eq!(cloud.points.len(), 31 * 31);
    let lowest = cloud.points.iter().map(|p: &Point3| p.y).fold(f64::INFINITY, f64::min);
    assert!((-170.0..-20.0).contains(&lowest), "{lowest} mm");
}

#[test]
fn every_effect_of_the_experiment_has_a_flag() {
    let folder = tempfile::tempdir().unwrap();
    let params = fixture("drapes/stiff.params.json");
    let obj = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let drape = |name: &str, flags: &str| {
        let more = ["simulate", "--params", params.to_str().unwrap(), "--vertices", "31", "--out"];
        let out = obj(name);
        let words: Vec<&str> = flags.split_whitespace().collect();
        let run = scan2params(&[&more[..], &[&out], &words].concat());
        (run.status.code(), String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let points = |name: &str| read_scan(obj(name)).unwrap().0.points;
    assert_eq!(drape("plain.obj", "").0, Some(0));
    for flags in [
        "--size 280,300",
        "--skew -2",
        "--offset -4,3",
        "--rotation 20",
        "--tilt 2,-1",
        "--plate-radius 55",
        "--edge-radius 3",
        "--friction 0.1",
        "--curl -3,0,2",
        "--edge-curl 60,12",
        "--crease -60,10,30,20",
        "--softening 2,2,2",
        "--fold-correction 0.04",
    ] {
        let (code, said) = drape("other.obj", flags);
        assert_eq!(code, Some(0), "{flags}: {said}");
        let [before, after] = ["plain.obj", "other.obj"].map(points);
        let moved = before.iter().zip(&after).map(|(a, b)| (a - b).norm());
        assert!(moved.fold(0.0, f64::max) > 0.05, "{flags} does nothing");
    }
    for (flags, remedy) in [
        ("--crease 1,2", "give 4 with commas"),
        ("--tilt 1,north", "give 2 numbers"),
        ("--edge-curl 60,0", "curl.edge_width"),
    ] {
        let (code, said) = drape("no.obj", flags);
        assert_eq!(code, Some(2), "{flags}: {said}");
        assert!(said.contains(remedy), "{flags}: {said}");
    }
}

#[test]
fn a_boundary_survives_its_file() {
    let truth = boundary_csv::read(fixture("drapes/mean.boundary.csv")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    boundary_csv::write(folder.path().join("again.csv"), &truth).unwrap();
    let again: Boundary = boundary_csv::read(folder.path().join("again.csv")).unwrap();
    assert!(truth.mean_distance_m(&again) < 1e-7);
}

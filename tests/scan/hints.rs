//! What a user says of the scene (`--crop`, `--up`, `--plate-near`), and what a refused scan
//! leaves behind.

use crate::program;
use std::fs;
use std::path::Path;
use std::process::Output;

use crate::scan_support::{Drape, Sampling, scan_where, stiff_knit as drape};
use scan2params::base::{Isometry3, Point3, Vector3};
use scan2params::geom::Cloud;
use scan2params::scan::{
    Crop, LengthUnit, ScanError, ScanOptions, ScannedBoundary, WarpToward, boundary_from_scan,
};
use serde_json::{Value, json};

const RIM: &str = "fixtures/drapes/woven.boundary.csv";
/// Verbs that take a scan, with what else they need before it and after.
const VERBS: [[&str; 2]; 4] = [
    ["estimate --density 180 --quick", ""],
    ["inspect", ""],
    ["boundary", "-o none/rim.csv"],
    ["batch --density 180 --quick", "--out none/results"],
];

/// Two drapes, the second as far from the first along x \[m\].
fn two(apart_m: f64) -> Cloud {
    let at = |x_m: f64| {
        let pose = Isometry3::translation(x_m, 0.0, 0.0);
        scan_where(drape(), &Sampling::thin(), &pose, |_, _| true).points
    };
    Cloud { points: [at(0.0), at(apart_m)].concat(), ..Cloud::default() }
}

fn options() -> ScanOptions {
    ScanOptions { warp_toward: Some(WarpToward::BearingDeg(0.0)), ..ScanOptions::default() }
}

fn error_mm(found: &ScannedBoundary) -> f64 {
    1e3 * found.boundary.mean_distance_m(&drape().rim())
}

/// Which of the two drapes was found.
fn plate_x_m(found: &ScannedBoundary) -> f64 {
    found.found.plate.unwrap().centre.x
}

#[test]
fn one_of_two_drapes_is_answered_once_it_is_said_which() {
    let both = two(0.45);
    let refusal = boundary_from_scan(&both, &options()).unwrap_err();
    let ScanError::SeveralDrapes { centres, .. } = &refusal else { panic!("{refusal}") };
    assert!(refusal.to_string().contains("--plate-near"), "{refusal}");
    assert!(refusal.to_string().contains("--crop"), "{refusal}");
    let first = centres[0];
    for (crop_mm, plate_near) in [(Some(220.0), None), (None, Some(first))] {
        let crop = crop_mm.map(|radius_mm| Crop::Radius { radius_mm });
        let said = ScanOptions { crop, plate_near, ..options() };
        let found = boundary_from_scan(&both, &said).unwrap();
        println!("{crop_mm:?} {plate_near:?}: {} mm", error_mm(&found));
        assert!(error_mm(&found) < 0.5, "{crop_mm:?} {plate_near:?}: {} mm", error_mm(&found));
        assert!((plate_x_m(&found) - first[0]).abs() < 0.01);
    }
}

#[test]
fn a_place_with_a_radius_and_a_box_choose_either_drape_in_any_unit() {
    // each drape in a unit of its own, one by a sphere and one by a box
    for (unit, x_m, by_box) in
        [(LengthUnit::Metre, 0.0, false), (LengthUnit::Centimetre, 0.7, true)]
    {
        let mut both = two(0.7);
        both.points.iter_mut().for_each(|p| *p /= unit.metres());
        let place = [x_m + 0.05, 0.03, -0.04].map(|metres| metres / unit.metres());
        let radius = Some(Crop::Radius { radius_mm: 350.0 });
        let sphere = ScanOptions { crop: radius, plate_near: Some(place), ..options() };
        let [low, high] = [[x_m - 0.3, -1.0, -0.3], [x_m + 0.3, 0.1, 0.3]]
            .map(|corner| corner.map(|metres| metres / unit.metres()));
        let boxed = ScanOptions { crop: Some(Crop::Box { low, high }), ..options() };
        let said = if by_box { boxed } else { sphere };
        let found = boundary_from_scan(&both, &said).unwrap();
        println!("{unit:?} {x_m}: {} mm", error_mm(&found));
        assert!(error_mm(&found) < 0.5, "{said:?}: {} mm", error_mm(&found));
        assert!((plate_x_m(&found) - x_m).abs() < 0.01, "{said:?}");
        assert_eq!(found.quality.points, both.points.len());
    }
}

#[test]
fn a_mesh_is_cropped_by_its_triangles() {
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|v| v as u32));
    let count = drape().vertices.len() as u32;
    let shift = Vector3::new(0.7, 0.0, 0.0);
    let second = drape().vertices.iter().map(|p| p + shift);
    let points: Vec<Point3> = drape().vertices.iter().copied().chain(second).collect();
    let triangles = triangles.clone().chain(triangles.map(|t| t.map(|v| v + count))).collect();
    let both = Cloud { points, triangles, ..Cloud::default() };
    for (x_m, by_box) in [(0.0, true), (0.7, false)] {
        let radius = Some(Crop::Radius { radius_mm: 350.0 });
        let place = Some([x_m, 0.0, 0.0]);
        let sphere = ScanOptions { crop: radius, plate_near: place, ..options() };
        let [low, high] = [[x_m - 0.3, -1.0, -0.3], [x_m + 0.3, 1.0, 0.3]];
        let boxed = ScanOptions { crop: Some(Crop::Box { low, high }), ..options() };
        let said = if by_box { boxed } else { sphere };
        let found = boundary_from_scan(&both, &said).unwrap();
        assert!(error_mm(&found) < 1.0, "{said:?}: {} mm", error_mm(&found));
        assert!((plate_x_m(&found) - x_m).abs() < 0.01, "{said:?}");
    }
}

#[test]
fn a_crop_that_misses_the_scan_is_named() {
    let cloud = two(0.7);
    let beside = Some(Crop::Box { low: [5.0; 3], high: [6.0; 3] });
    let place = ScanOptions {
        crop: Some(Crop::Radius { radius_mm: 300.0 }),
        plate_near: Some([5.0; 3]),
        ..options()
    };
    for said in [ScanOptions { crop: beside, ..options() }, place] {
        let refusal = boundary_from_scan(&cloud, &said).unwrap_err();
        assert!(matches!(refusal, ScanError::TooFewPoints { points: 0, .. }), "{refusal}");
        assert!(refusal.to_string().contains("--crop"), "{refusal}");
    }
}

fn run(line: &str) -> Output {
    let mut program = program::program();
    program.current_dir(env!("CARGO_MANIFEST_DIR")).args(line.split_whitespace());
    program.output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

#[test]
fn every_verb_that_takes_a_scan_takes_the_flags_and_refuses_nonsense() {
    for [verb, more] in VERBS {
        for (flag, part) in [
            ("--crop 300mm", "a radius about the plate in mm"),
            ("--crop 1,2", "two opposite corners of a box"),
            ("--up sideways", "x, -x, y, -y, z, -z"),
            ("--up 90", "x, -x, y, -y, z, -z"),
            ("--up 0,0,0", "x, -x, y, -y, z, -z"),
            ("--plate-near 1,2", "X,Y,Z"),
            ("--plate-near here", "X,Y,Z"),
        ] {
            let run = run(&format!("{verb} fixtures/scans {more} {flag}"));
            assert_eq!(run.status.code(), Some(2), "{verb} {flag}: {}", said(&run));
            assert!(said(&run).contains(part), "{verb} {flag}: {}", said(&run));
        }
    }
    for (flag, part) in [("0.3", "give at least 213 mm"), ("0,0,0,1,0,1", "along y leaves nothing")]
    {
        for line in ["inspect", "estimate --density 180", "batch --dry-run --density 180"] {
            let scan = if line.starts_with("batch") { "fixtures/drapes" } else { RIM };
            let run = run(&format!("{line} {scan} --crop {flag}"));
            assert_eq!(run.status.code(), Some(2), "{line} {flag}: {}", said(&run));
            assert!(said(&run).contains(part), "{line} {flag}: {}", said(&run));
        }
    }
}

#[test]
fn what_was_said_is_written_with_the_result_and_a_file_of_defaults_may_say_it() {
    let of = |line: &str| -> Value {
        let run = run(&format!("{RIM} --density 180 --quick --json {line}"));
        assert_eq!(run.status.code(), Some(0), "{line}: {}", said(&run));
        let params: Value = serde_json::from_slice(&run.stdout).unwrap();
        let options = &params["scan_options"];
        json!([options["crop"], options["up"], options["plate_near"]])
    };
    assert_eq!(of(""), json!([null, null, null]));
    let radius = json!({ "radius": { "radius_mm": 300.0 } });
    assert_eq!(
        of("--crop 300 --up -y --plate-near -0.5,1,2e-1"),
        json!([radius, [0.0, -1.0, 0.0], [-0.5, 1.0, 0.2]])
    );
    let corners = json!({ "box": { "low": [-1.0, 0.0, 2.0], "high": [3.0, 4.0, 5.0] } });
    assert_eq!(of("--crop -1,4,2,3,0,5 --up 0.5,0,-2"), json!([corners, [0.5, 0.0, -2.0], null]));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("own.toml");
    fs::write(&file, "[estimate]\ncrop = 300\nup = \"-y\"\nplate-near = \"1,2,3\"\n").unwrap();
    assert_eq!(
        of(&format!("--config {}", file.display())),
        json!([radius, [0.0, -1.0, 0.0], [1.0, 2.0, 3.0]])
    );
}

/// A grid of points that is no drape.
fn floor(path: &Path) {
    let at = |k: i32| format!("{} {} 0\n", 0.005 * f64::from(k / 100), 0.005 * f64::from(k % 100));
    fs::write(path, (0..10_000).map(at).collect::<String>()).unwrap();
}

#[test]
fn a_refused_scan_leaves_the_picture_of_what_was_found() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let shown = |name: &str| at(name).display().to_string();
    floor(&at("floor.xyz"));
    let scan = shown("floor.xyz");
    let inspected = run(&format!("inspect {scan} --out {}", shown("own.png")));
    assert_eq!(inspected.status.code(), Some(4));
    let picture = fs::read(at("own.png")).unwrap();

    let out = shown("new/out");
    let refused = run(&format!("{scan} --density 180 --quick --out {out}"));
    assert_eq!(refused.status.code(), Some(4), "{}", said(&refused));
    assert!(refused.stdout.is_empty());
    assert!(
        said(&refused).contains(&format!("wrote {out}/floor.inspect.png")),
        "{}",
        said(&refused)
    );
    for flag in ["no drape found", "--crop"] {
        assert!(said(&refused).contains(flag), "{}", said(&refused));
    }
    assert!(fs::read(at("new/out/floor.inspect.png")).unwrap() == picture);
    assert_eq!(fs::read_dir(at("new/out")).unwrap().count(), 1);

    // Without --out, and for what is no refusal of a scan, there is none.
    run(&format!("{scan} --density 180 --quick"));
    run(&format!("{} --density 180 --quick --out {}", shown("none.xyz"), shown("none")));
    assert!(!at("none").exists() && !at("floor.inspect.png").exists());

    fs::create_dir(at("scans")).unwrap();
    floor(&at("scans/floor.xyz"));
    let batch = |more: &str| {
        let (from, to) = (shown("scans"), shown("results"));
        let run = run(&format!(
            "batch {from} --density 180 --quick --no-report --json --out {to} {more}"
        ));
        assert_eq!(run.status.code(), Some(3), "{}", said(&run));
        let path = format!("{to}/files/floor.xyz.inspect.png");
        assert!(said(&run).contains(&format!("wrote {path}")), "{}", said(&run));
        assert!(fs::read(path).unwrap() == picture);
        let row: Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(row["status"], "refused");
        row["settings_sha256"].as_str().unwrap().to_owned()
    };
    // What a row depends on has the flags in it.
    let plain = batch("");
    let others = ["--up z", "--plate-near 0.2,0.2,0", "--crop 2000"].map(batch);
    for (k, other) in others.iter().enumerate() {
        assert!(*other != plain && !others[..k].contains(other));
    }
    assert_eq!(batch(""), plain);
}

#[cfg(unix)]
#[test]
fn the_picture_never_replaces_a_scan() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    floor(&at("floor.xyz"));
    fs::create_dir(at("out")).unwrap();
    std::os::unix::fs::symlink("../floor.xyz", at("out/floor.inspect.png")).unwrap();
    let before = fs::read(at("floor.xyz")).unwrap();
    let (scan, out) = (at("floor.xyz"), at("out"));
    let run = run(&format!("{} --density 180 --quick --out {}", scan.display(), out.display()));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("floor.inspect.png: is the input"), "{}", said(&run));
    assert_eq!(fs::read(at("floor.xyz")).unwrap(), before);
}

//! The verdict from end to end: where it stands, what it says of honest scans and of scans
//! that are wrong in a known way, and the exit codes that follow from it.

use crate::committed::{SCANS, fixture, job};
use crate::program;
use std::path::Path;
use std::process::Output;

use scan2params::base::{Isometry3, Point3};
use scan2params::dataset::drapes::dataset_options;
use scan2params::geom::Cloud;
use scan2params::io::{read_scan, write_obj, write_ply};
use scan2params::scan::{LengthUnit, ScanOptions, boundary_from_scan};
use scan2params::sim::{Drop, SimOptions, drape};
use serde_json::Value;

fn scan2params(arguments: &[&str]) -> Output {
    program::program().args(arguments).output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn json(run: &Output) -> Value {
    serde_json::from_slice(&run.stdout).unwrap_or_else(|_| panic!("no JSON; {}", said(run)))
}

/// Codes of the grounds that speak against a result.
fn against(result: &Value) -> Vec<String> {
    let grounds = result["verdict"]["grounds"].as_array().unwrap();
    let bad = grounds.iter().filter(|ground| ground["level"] != "reliable");
    bad.map(|ground| ground["code"].as_str().unwrap().to_owned()).collect()
}

/// A scan of the stiff drape in metres, in the simulation frame, its heights changed by a factor.
fn stretched(factor: f64, path: &Path) {
    let (cloud, _) = read_scan(fixture("scans/stiff_structured-light.ply")).unwrap();
    let unit = Some(LengthUnit::Millimetre);
    let found =
        boundary_from_scan(&cloud, &ScanOptions { unit, ..ScanOptions::default() }).unwrap();
    let frame: Isometry3 = found.sim_from_scan;
    let points = cloud.points.iter().map(|p| frame * (p * 1e-3));
    let points: Vec<Point3> = points.map(|p| Point3::new(p.x, p.y * factor, p.z)).collect();
    write_ply(path, &Cloud { points, ..Cloud::default() }, 1.0).unwrap();
}

#[test]
fn the_committed_scans_are_reliable_before_and_after_their_drape_is_released() {
    for (scan, _) in SCANS {
        let result = &job(scan).result;
        assert_eq!(result["verdict"]["level"], "reliable", "{scan}: {:#}", result["verdict"]);
        assert!(result["released_drape"]["rim_mean_mm"].is_number());
    }
    // the noisiest of them before its drape is released
    let input = fixture("scans/mean_truedepth.ply");
    let found = json(&scan2params(&["inspect", input.to_str().unwrap(), "--json"]));
    assert_eq!(found["verdict"]["level"], "reliable", "{:#}", found["verdict"]);
}

#[test]
fn the_verdict_is_the_first_line_of_the_table_and_stands_in_every_file() {
    let folder = tempfile::tempdir().unwrap();
    let input = fixture("scans/stiff_structured-light.ply");
    let out = folder.path().join("out");
    let run = scan2params(&[
        input.to_str().unwrap(),
        "--density=900",
        "--quick",
        "--warp-toward=-x",
        "--out",
        out.to_str().unwrap(),
    ]);
    let table = String::from_utf8(run.stdout.clone()).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "verdict          doubtful");
    assert!(lines[1].starts_with("  doubtful       density_outside_training: the density, 900"));
    let text = std::fs::read_to_string(out.join("stiff_structured-light.params.json")).unwrap();
    let params: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(params["verdict"]["level"], "doubtful");
    assert_eq!(params["verdict"]["not_the_experiment"], false);
    let ground = &params["verdict"]["grounds"][0];
    for key in ["code", "level", "measured", "limit", "unit", "text"] {
        assert!(!ground[key].is_null(), "{key}: {ground:#}");
    }
    let picture = image::open(out.join("stiff_structured-light.boundary.png")).unwrap().to_rgb8();
    // The legend's last line is of the colour of doubt, its edges blended with the ground.
    let doubt = |p: &image::Rgb<u8>| p.0.iter().zip([190, 110, 0]).all(|(a, b)| a.abs_diff(b) < 40);
    assert!(picture.pixels().filter(|p| doubt(p)).count() > 100);
    let run = scan2params(&["inspect", input.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&run.stdout).starts_with("verdict          reliable\n"));
}

#[test]
fn a_wrong_vertical_scale_is_not_to_be_used_and_strict_makes_it_a_refusal() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir_all(&scans).unwrap();
    let low = scans.join("low.ply");
    stretched(0.96, &low);
    let job = [low.to_str().unwrap(), "--density=260", "--quick", "--warp-toward=+x"];
    let run = scan2params(&[&job[..], &["--json"]].concat());
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let result = json(&run);
    assert_eq!(result["verdict"]["level"], "do_not_use", "{:#}", result["verdict"]);
    assert!(against(&result).contains(&"width".to_owned()), "{:#}", result["verdict"]);
    // With --strict it is a refusal, and what was found is written all the same.
    let out = folder.path().join("out");
    let strict = ["--strict", "--out", out.to_str().unwrap()];
    let run = scan2params(&[&job[..], &strict].concat());
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    let words = said(&run);
    assert!(words.contains("low.ply: the result is not to be used: along the "), "{words}");
    assert!(out.join("low.params.json").is_file() && !run.stdout.is_empty());

    // In a batch its row says so, and with --strict the batch ends with code 3, also when the
    // row is kept from a run without it.
    let results = folder.path().join("results");
    let batch = |more: &[&str]| {
        let flags = [
            "batch",
            scans.to_str().unwrap(),
            "--density=260",
            "--quick",
            "--warp-toward=+x",
            "--out",
        ];
        let run = scan2params(&[&flags[..], &[results.to_str().unwrap()], more].concat());
        let mut reader = csv::Reader::from_reader(run.stdout.as_slice());
        let titles = reader.headers().unwrap().clone();
        let row = reader.records().next().unwrap().unwrap();
        let cell =
            |name: &str| row[titles.iter().position(|title| title == name).unwrap()].to_owned();
        let cells = ["status", "exit_code", "verdict"].map(cell).join(" ");
        (run.status.code(), cells, cell("grounds"), said(&run))
    };
    let (code, cells, grounds, words) = batch(&[]);
    assert_eq!((code, cells.as_str()), (Some(0), "ok 0 do_not_use"), "{words}");
    assert!(grounds.contains("width"), "{grounds}");
    assert!(words.contains("verdicts: 0 reliable, 0 doubtful, 1 do not use"), "{words}");
    let (code, cells, _, words) = batch(&["--strict"]);
    assert_eq!((code, cells.as_str()), (Some(3), "ok 4 do_not_use"), "{words}");
    assert!(words.contains("1 kept from an earlier run"), "{words}");
    assert!(
        words.contains("0 of 1 scans have no estimate, 1 one that is not to be used"),
        "{words}"
    );
}

#[test]
fn another_plate_is_not_the_experiment_with_and_without_strict() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let fabric =
        scan2params::fabric::params::fabric(&fixture("drapes/stiff.params.json"), [None; 7])
            .unwrap();
    let mut options = SimOptions { vertices: 41, fall_vertices: 25, ..dataset_options() };
    options.experiment.plate.radius_m = 0.058;
    let sheet = drape(&fabric, &Drop::canonical(), &options);
    write_obj(path("wide.obj"), &sheet.mesh()).unwrap();
    let run = scan2params(&["augment", &path("wide.obj"), "--out", &path("wide.ply")]);
    assert!(run.status.success(), "{}", said(&run));
    let out = path("out");
    let run = scan2params(&[&path("wide.ply"), "--density=260", "--quick", "--out", &out]);
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    assert!(
        said(&run).contains("what was scanned is not the experiment: the cloth leaves the plate")
    );
    let table = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(table.starts_with("verdict          do not use (not the experiment)\n"), "{table}");
    let text = std::fs::read_to_string(Path::new(&out).join("wide.params.json")).unwrap();
    let params: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(params["verdict"]["not_the_experiment"], true);
    let run = scan2params(&["inspect", &path("wide.ply"), "--json"]);
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    assert_eq!(json(&run)["verdict"]["not_the_experiment"], true);
    let run = scan2params(&["boundary", &path("wide.ply"), "-o", &path("wide.csv")]);
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    assert!(Path::new(&path("wide.csv")).is_file());
    // A batch says so by itself.
    std::fs::create_dir(path("scans")).unwrap();
    std::fs::rename(path("wide.ply"), path("scans/wide.ply")).unwrap();
    let run = scan2params(&[
        "batch",
        &path("scans"),
        "--density=260",
        "--quick",
        "--out",
        &path("results"),
    ]);
    assert_eq!(run.status.code(), Some(3), "{}", said(&run));
    assert!(said(&run).contains("1 do not use (1 not the experiment)"), "{}", said(&run));
}

#[test]
fn a_warp_that_tells_no_side_is_refused_or_doubted() {
    let scan = fixture("scans/stiff_structured-light.ply");
    let with = |warp: &str| {
        let warp = format!("--warp-toward={warp}");
        scan2params(&[scan.to_str().unwrap(), "--density=260", "--quick", "--json", &warp])
    };
    // Up in this scan.
    let run = with("0.390,-0.265,-0.882");
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    assert!(run.stdout.is_empty());
    assert!(
        said(&run).contains("0 degrees off the vertical")
            && said(&run).contains("(0.39, -0.27, -0.88)")
    );
    // The scan's y axis is 7 degrees from a diagonal of the specimen, its x axis 14.
    let result = json(&with("+y"));
    assert_eq!(against(&result), ["warp_near_diagonal"]);
    assert_eq!(result["verdict"]["level"], "doubtful");
    let measured = result["verdict"]["grounds"][0]["measured"].as_f64().unwrap();
    assert!((measured - 37.8).abs() < 1.0, "{measured}");
    assert!(against(&json(&with("-x"))).is_empty());
}

#[test]
fn cloth_that_is_like_no_part_of_the_prior_is_doubtful_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // Ten times as stiff across as along, and hard to shear: neither a knit nor a woven.
    let fabric = "--stretch-weft=4e5 --stretch-warp=3000 --shear=4e5 --bending-weft=400 \
                  --bending-warp=4000 --bending-bias=2000 --density=200";
    let [sheet, rim] = [path("odd.obj"), path("odd.csv")];
    let mut job = vec!["simulate", "--vertices=41", "--out", &sheet, "--boundary", &rim];
    job.extend(fabric.split_whitespace());
    let run = scan2params(&job);
    assert!(run.status.success(), "{}", said(&run));
    let result = json(&scan2params(&[&rim, "--density=200", "--quick", "--json"]));
    assert_eq!(result["verdict"]["level"], "doubtful", "{:#}", result["verdict"]);
    assert!(against(&result).contains(&"outside_prior".to_owned()), "{:#}", result["verdict"]);
    assert_eq!(result["prior"]["like"].as_array().unwrap().len(), 0, "{:#}", result["prior"]);
    let ground = &result["verdict"]["grounds"];
    let ground = ground.as_array().unwrap().iter().find(|g| g["code"] == "outside_prior").unwrap();
    assert!(ground["measured"].as_f64() > ground["limit"].as_f64(), "{ground:#}");
    assert!(
        ground["text"].as_str().unwrap().contains("resembles neither the knits ("),
        "{ground:#}"
    );
}

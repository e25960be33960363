//! The main job on the fixtures, from file to parameters, against the truth; and
//! what happens to input that cannot be used.

use crate::committed::{SCANS, fixture, job, warp_of};
use crate::program;
use std::path::Path;
use std::process::Output;
use std::sync::OnceLock;

use crate::promises::{hold, promise};
use scan2params::base::boundary::Orientation;
use scan2params::base::{Boundary, Point3};
use scan2params::fabric::{Fabric, Mixture, STIFFNESSES, TABLE_2};
use scan2params::io::{boundary_csv, read_scan};
use scan2params::numeric::robust::quantile;
use scan2params::refine::released_drape;
use scan2params::scan::{ScanOptions, WarpToward, boundary_from_scan};
use scan2params::sim::SimOptions;
use serde_json::Value;

/// Half widths, in sigma, of the intervals that hold 68 and 95 % of a normal distribution.
const INTERVAL_SIGMAS: [f64; 2] = [0.9945, 1.9600];

/// What an estimator says that ignores the scan, of each stiffness: the geometric mean of the
/// prior's fabrics, and the middle 90 % of them.
fn ignoring_the_scan() -> [(f64, [f64; 2]); STIFFNESSES] {
    const FABRICS: u64 = 4096;
    let prior = Mixture::union();
    let fabrics: Vec<_> =
        (0..FABRICS).map(|k| prior.sample(u64::MAX, k).unwrap().to_paper_units()).collect();
    std::array::from_fn(|i| {
        let logarithms: Vec<f64> = fabrics.iter().map(|fabric| fabric[i].ln()).collect();
        let mean = logarithms.iter().sum::<f64>() / FABRICS as f64;
        let end = |share| quantile(logarithms.clone(), share).unwrap().exp();
        (mean.exp(), [end(0.05), end(0.95)])
    })
}

fn scan2params(arguments: &[&str]) -> Output {
    program::program().args(arguments).output().unwrap()
}

fn true_rim(drape: &str) -> Boundary {
    boundary_csv::read(fixture(&format!("drapes/{drape}.boundary.csv"))).unwrap()
}

/// The rim of a committed scan as the library finds it, once for all tests.
fn rim_of(scan: &str) -> &'static Boundary {
    static RIMS: [OnceLock<Boundary>; SCANS.len()] = [const { OnceLock::new() }; SCANS.len()];
    let at = SCANS.iter().position(|(name, _)| *name == scan).unwrap();
    RIMS[at].get_or_init(|| found(scan))
}

fn found(scan: &str) -> Boundary {
    let (cloud, _) = read_scan(fixture(&format!("scans/{scan}.ply"))).unwrap();
    let options = ScanOptions {
        warp_toward: Some(WarpToward::Direction(warp_of(scan))),
        ..ScanOptions::default()
    };
    boundary_from_scan(&cloud, &options).unwrap().boundary
}

#[test]
fn rims_of_the_fixtures_and_their_sigmas_are_as_promised() {
    let rims = SCANS.map(|(scan, drape)| (rim_of(scan), true_rim(drape)));
    let [mean, stiff, truedepth] =
        rims.each_ref().map(|(rim, truth)| 1e3 * rim.mean_distance_m(truth));
    hold("rim.mean_structured-light", mean);
    hold("rim.stiff_structured-light", stiff);
    hold("rim.mean_truedepth", truedepth);
    // what a fault in their order would score: each point one place further
    let (rim, truth) = &rims[1];
    let points = rim.points().iter().cycle().skip(1).map(|p| p.position_m);
    let shifted = Boundary::exact(points.take(rim.points().len())).unwrap();
    let shifted_mm = 1e3 * shifted.mean_distance_m(truth);
    println!("one place along the rim: {shifted_mm:.2} mm");
    assert!(!promise("rim.stiff_structured-light").is_kept_by(shifted_mm));

    let within = |sigmas: f64, factor: f64| {
        let scores = rims.iter().flat_map(|(rim, truth)| {
            let points = rim.points().iter().zip(truth.positions_m());
            points.flat_map(move |(p, q)| {
                let error = p.position_m - q;
                let sigma_m = factor * p.sigma_m;
                [error.x, error.y, error.z].map(|e| e.abs() / sigma_m)
            })
        });
        let scores: Vec<f64> = scores.collect();
        scores.iter().filter(|s| **s <= sigmas).count() as f64 / scores.len() as f64
    };
    let [inner, outer] = INTERVAL_SIGMAS;
    hold("sigma.within_68", within(inner, 1.0));
    hold("sigma.within_95", within(outer, 1.0));
    for factor in [0.67, 1.5] {
        let shares = [within(inner, factor), within(outer, factor)];
        println!("sigmas {factor} times as large: {shares:.2?}");
        let kept = promise("sigma.within_68").is_kept_by(shares[0])
            && promise("sigma.within_95").is_kept_by(shares[1]);
        assert!(!kept, "sigmas {factor} times as large keep both promises: {shares:?}");
    }
}

/// How well intervals and values hold the truth of several results.
#[derive(Default)]
struct Held {
    intervals: usize,
    inside: usize,
    largest_ln_error: f64,
    ln_half_widths: f64,
}

impl Held {
    fn add(&mut self, value: f64, [low, high]: [f64; 2], truth: f64) {
        self.intervals += 1;
        self.inside += usize::from((low..=high).contains(&truth));
        self.largest_ln_error = self.largest_ln_error.max((value / truth).ln().abs());
        self.ln_half_widths += 0.5 * (high / low).ln();
    }

    fn width(&self) -> f64 {
        (self.ln_half_widths / self.intervals as f64).exp()
    }
}

#[test]
fn from_file_to_parameters() {
    let (mut shipped, mut ignoring) = (Held::default(), Held::default());
    let baseline = ignoring_the_scan();
    for (scan, _) in SCANS {
        let job = job(scan);
        let (result, truth) = (&job.result, &job.truth);
        assert_eq!(result["orientation"], "given");
        for (i, range) in TABLE_2.iter().take(STIFFNESSES).enumerate() {
            let number = |value: &Value| value.as_f64().unwrap();
            let found = &result["parameters"][range.key];
            let ends = [0, 1].map(|end| number(&found["interval90"][end]));
            let truth = number(&truth["parameters"][range.key]["value"]);
            println!(
                "{scan} {}: {:.0} in {ends:.0?}, truth {truth:.0}",
                range.key,
                number(&found["value"])
            );
            shipped.add(number(&found["value"]), ends, truth);
            ignoring.add(baseline[i].0, baseline[i].1, truth);
        }
        assert!(job.rim.mean_distance_m(rim_of(scan)) < 1e-6 && job.picture_width > 1000);
        assert_eq!(result["released_drape"]["started_from"], "sheet");
        let error_mm = result["released_drape"]["rim_mean_mm"].as_f64().unwrap();
        match scan {
            "mean_structured-light" => hold("main.released_mean", error_mm),
            "stiff_structured-light" => hold("main.released_stiff", error_mm),
            _ => {}
        }
    }
    assert_eq!(shipped.intervals, 18);
    hold("main.intervals", shipped.inside as f64);
    hold("main.error", shipped.largest_ln_error);
    hold("main.width", shipped.width());
    let (error, width) = (ignoring.largest_ln_error, ignoring.width());
    println!("ignoring the scan: {} of 18, {error:.2}, {width:.2}", ignoring.inside);
    assert!(!promise("main.error").is_kept_by(error) && !promise("main.width").is_kept_by(width));
}

#[test]
fn a_fabric_that_ignores_the_scan_does_not_drape_as_it() {
    let [a, b, c, d, e, f] = ignoring_the_scan().map(|(value, _)| value);
    let (fabric, _) = Fabric::from_paper_units([a, b, c, d, e, f, 260.0]).project_bending();
    let again = released_drape(&true_rim("stiff"), None, &fabric, &SimOptions::default());
    let error_mm = 1e3 * again.mean_distance_m;
    println!("ignoring the scan: {error_mm:.1} mm");
    assert!(!promise("main.released_stiff").is_kept_by(error_mm), "{error_mm} mm");
}

#[test]
fn a_rim_that_was_given_leads_the_drape_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rim.csv");
    boundary_csv::write_oriented(&path, &true_rim("stiff"), Orientation::Given).unwrap();
    let run = scan2params(&[
        path.to_str().unwrap(),
        "--density",
        "260",
        "--quick",
        "--release",
        "--json",
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let result: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(result["released_drape"]["started_from"], "rim");
}

#[test]
fn without_a_direction_the_answer_is_flagged_as_ambiguous() {
    let input = fixture("scans/mean_structured-light.ply");
    let run = scan2params(&[input.to_str().unwrap(), "--density", "214", "--quick", "--json"]);
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
    let run = scan2params(&[path.to_str().unwrap(), "--density", density, "--quick"]);
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
    let run = scan2params(&["missing.ply", "--density", "180", "--quick"]);
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
            let run = scan2params(&[path.to_str().unwrap(), "--density", "180", "--quick"]);
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
        let more = ["simulate", "--params", params.to_str().unwrap(), "--vertices", "21", "--out"];
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
        "--asymmetric-bending -0.3,0.3",
        "--hysteresis 0.1,0.1 --hysteresis-slip 5",
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

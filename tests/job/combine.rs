//! `combine` from end to end: results of the fixtures' scans as `estimate` and `batch` write them.

use crate::committed::job;
use crate::program;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use scan2params::fabric::params;
use serde_json::Value;

fn program(arguments: &[&str]) -> Output {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    command.output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// The estimate of a fixture's scan, as a file in a folder.
fn estimated(scan: &str, folder: &Path) -> PathBuf {
    let path = folder.join(format!("{scan}.params.json"));
    fs::write(&path, job(scan).result.to_string()).unwrap();
    path
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer}: {value}"))
}

#[test]
fn two_scans_of_one_fabric_become_one() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["mean_structured-light", "mean_truedepth"].map(|s| estimated(s, folder.path()));
    let out = folder.path().join("mean.json");
    let paths = files.each_ref().map(|p| p.to_str().unwrap());
    let run = program(&["combine", paths[0], paths[1], "--out", out.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let table = String::from_utf8(run.stdout).unwrap();
    assert!(table.starts_with("drapes           2 of 2, 214.0 g/m^2\n"), "{table}");

    let combined = json(&out);
    let each = files.each_ref().map(|path| json(path));
    for key in ["shear", "bending_warp"] {
        let values = each.each_ref().map(|v| number(v, &format!("/parameters/{key}/value")));
        let [low, high] = [values[0].min(values[1]), values[0].max(values[1])];
        let at = |part: &str| number(&combined, &format!("/parameters/{key}/{part}"));
        assert!(low <= at("value") && at("value") <= high, "{key}");
        // two values: their standard deviation is their difference over the root of two
        assert!((at("sd") / ((high - low) / 2_f64.sqrt()) - 1.0).abs() < 1e-9, "{key}");
        assert!(at("interval90/0") < at("value") && at("value") < at("interval90/1"), "{key}");
    }
    // one fabric, draped once: both scans show the same folds
    let folds = each.each_ref().map(|v| number(v, "/boundary/folds"));
    assert_eq!(folds[0], folds[1]);
    assert_eq!(number(&combined, "/folds/modal"), folds[0]);
    // what is converted has its interval
    let run = program(&["convert", out.to_str().unwrap(), "--json"]);
    let converted: Value = serde_json::from_slice(&run.stdout).unwrap();
    let end = number(&converted, "/shear/paper/interval90/0");
    assert!(
        (end / number(&combined, "/parameters/shear/interval90/0") - 1.0).abs() < 1e-9,
        "{end}"
    );
    // the simulator takes it
    let fabric = params::fabric(&out, [None; 7]).unwrap();
    let shear = number(&combined, "/parameters/shear/value");
    assert!((fabric.to_paper_units()[2] / shear - 1.0).abs() < 1e-12);

    // what is combined is no drape
    let run = program(&["combine", out.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(said(&run).contains("combined already"), "{}", said(&run));
    // nor may the result replace a drape
    let run = program(&["combine", paths[0], "--out", paths[0]]);
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));

    // the verdict is taken into account
    let mut bad = each[1].clone();
    bad["verdict"]["level"] = "do_not_use".into();
    fs::write(&files[1], bad.to_string()).unwrap();
    let run = program(&["combine", folder.path().to_str().unwrap(), "--json"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let combined: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(combined["drapes"].as_array().unwrap().len(), 1);
    assert!(
        combined["left_out"][0]["reason"].as_str().unwrap().contains("do not use"),
        "{combined}"
    );
    assert!(combined["left_out"][0]["file"].as_str().unwrap().contains("truedepth"));
    // one drape keeps its own interval
    let own = number(&each[0], "/parameters/shear/interval90/1");
    assert!((number(&combined, "/parameters/shear/interval90/1") / own - 1.0).abs() < 1e-12);
    let run = program(&["combine", paths[1]]);
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
}

#[test]
fn a_batch_s_folder_is_read_and_other_fabrics_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for name in ["mean", "stiff"] {
        let rim = format!("{name}.boundary.csv");
        fs::copy(format!("fixtures/drapes/{rim}"), scans.join(&rim)).unwrap();
    }
    let table = folder.path().join("d.csv");
    fs::write(&table, "mean.boundary.csv,214\nstiff.boundary.csv,260\n").unwrap();
    let out = folder.path().join("results");
    let [scans, table, results] = [&scans, &table, &out].map(|p| p.to_str().unwrap());
    let run = program(&["batch", scans, "--density-csv", table, "--quick", "--out", results]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let run = program(&["combine", results]);
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(
        said(&run).contains("has 214 g/m^2") && said(&run).contains("has 260"),
        "{}",
        said(&run)
    );
    let one = out.join("files/stiff.boundary.csv.params.json");
    let run = program(&["combine", one.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let table = String::from_utf8(run.stdout).unwrap();
    assert!(table.contains("note: one drape"), "{table}");
    // A fixture's truth is no estimate.
    let run = program(&["combine", "fixtures/drapes/mean.params.json"]);
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(said(&run).contains("interval90"), "{}", said(&run));
    let run = program(&["combine", scans]);
    assert!(said(&run).contains("no *.params.json"), "{}", said(&run));
}

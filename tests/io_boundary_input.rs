//! A boundary CSV as input of `estimate`: the rim that a user corrected by hand.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn scan2params(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_scan2params")).args(arguments).output().unwrap()
}

fn json(run: &Output) -> Value {
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).unwrap()
}

#[test]
fn the_rim_that_boundary_writes_is_estimated_as_the_scan_is() {
    let folder = tempfile::tempdir().unwrap();
    let rim = folder.path().join("rim.csv");
    let scan = fixture("scans/stiff_structured-light.ply");
    let (scan, rim) = (scan.to_str().unwrap(), rim.to_str().unwrap());
    let run = scan2params(&["boundary", scan, "--warp-toward", "+x", "-o", rim]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let of_scan = json(&scan2params(&[scan, "--warp-toward", "+x", "--density", "260", "--json"]));
    let of_rim = json(&scan2params(&[rim, "--warp-toward", "+x", "--density", "260", "--json"]));
    assert_eq!(of_rim["orientation"], "given");
    assert!(of_rim["quality"].is_null() && of_rim["read"].is_null());
    let (a, b) = (&of_scan["boundary"], &of_rim["boundary"]);
    assert_eq!(a["observed_fraction"], b["observed_fraction"]);
    for (key, parameter) in of_scan["parameters"].as_object().unwrap() {
        let [a, b] = [parameter, &of_rim["parameters"][key]].map(|p| p["value"].as_f64().unwrap());
        // The file rounds to 0.1 micrometre.
        assert!((a / b - 1.0).abs() < 1e-3, "{key}: {a} {b}");
    }
    // Without a direction a rim is as ambiguous as a scan, and z exchanges weft and warp.
    let silent = json(&scan2params(&[rim, "--density", "260", "--json"]));
    assert_eq!(silent["orientation"], "ambiguous");
    assert_eq!(silent["candidates"].as_array().unwrap().len(), 2);
    let exchanged = json(&scan2params(&[rim, "--warp-toward", "+z", "--density", "260", "--json"]));
    let value = |run: &Value, key: &str| run["parameters"][key]["value"].as_f64().unwrap();
    let ratio = value(&exchanged, "bending_weft") / value(&of_rim, "bending_warp");
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn true_rims_are_taken_and_typing_errors_are_refused_with_their_line() {
    let out = tempfile::tempdir().unwrap();
    for drape in ["mean", "stiff"] {
        let rim = fixture(&format!("drapes/{drape}.boundary.csv"));
        let folder = out.path().join(drape);
        let run = scan2params(&[
            rim.to_str().unwrap(),
            "--density=214",
            "--warp-toward=+x",
            &format!("--out={}", folder.display()),
        ]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        assert!(String::from_utf8_lossy(&run.stdout).contains("as the boundary file gives it"));
        assert!(folder.join(format!("{drape}.boundary.boundary.png")).is_file());
    }
    let rim = fixture("drapes/mean.boundary.csv");
    let run = scan2params(&["inspect", rim.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(2), "a rim is no scan");
    let text = std::fs::read_to_string(rim).unwrap();
    let path = out.path().join("typed.csv");
    let refused = |text: String, code| {
        std::fs::write(&path, text).unwrap();
        let run = scan2params(&[path.to_str().unwrap(), "--density", "214"]);
        assert_eq!(run.status.code(), Some(code));
        assert!(run.stdout.is_empty());
        String::from_utf8_lossy(&run.stderr).into_owned()
    };
    let rows: Vec<&str> = text.lines().collect();
    let with = |line: usize, edit: &dyn Fn(&str) -> String| {
        let edited = edit(rows[line - 1]);
        let mut rows = rows.clone();
        rows[line - 1] = &edited;
        rows.join("\n")
    };
    let moved = |row: &str| {
        let mut cells: Vec<String> = row.split(',').map(Into::into).collect();
        cells[3] = "12.5".into();
        cells.join(",")
    };
    let said = refused(with(40, &moved), 4);
    assert!(said.contains("typed.csv: rim refused: the points of lines 39 and 40"), "{said}");
    assert_eq!(said.matches("lie").count(), 1, "said once: {said}");
    let said = refused(with(1, &|row| row.replace("x_mm", "x_m")), 1);
    assert!(said.contains("typed.csv:1:") && said.contains("x_mm"), "{said}");
    let said = refused(with(40, &|row| row.replace('.', ",")), 1);
    assert!(said.contains("typed.csv:40:") && said.contains("cells"), "{said}");
}

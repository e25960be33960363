//! A boundary CSV as input of `estimate`: the rim that a user corrected by hand.

use crate::program;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn scan2params(arguments: &[&str]) -> Output {
    program::program().args(arguments).output().unwrap()
}

fn json(run: &Output) -> Value {
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).unwrap()
}

/// The stiffnesses of two results agree: a file rounds to 0.1 micrometre.
fn assert_same_answer(a: &Value, b: &Value) {
    for (key, parameter) in a["parameters"].as_object().unwrap() {
        let [a, b] = [parameter, &b["parameters"][key]].map(|p| p["value"].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-3, "{key}: {a} {b}");
    }
}

/// Codes of the grounds of a result's verdict.
fn codes(result: &Value) -> Vec<&str> {
    let grounds = result["verdict"]["grounds"].as_array().unwrap();
    grounds.iter().map(|ground| ground["code"].as_str().unwrap()).collect()
}

/// A direction of the scan's frame that is the warp's there, and nearer to the weft's if it is
/// taken for one of the boundary's frame.
const WARP_IN_SCAN: &str = "-0.398,-0.856,-1.053";

#[test]
fn the_rim_that_boundary_writes_is_estimated_as_the_scan_is() {
    let folder = tempfile::tempdir().unwrap();
    let rim = folder.path().join("rim.csv");
    let scan = fixture("scans/stiff_structured-light.ply");
    let (scan, rim) = (scan.to_str().unwrap(), rim.to_str().unwrap());
    let flag = ["--warp-toward", WARP_IN_SCAN];
    let run = scan2params(&[&["boundary", scan, "-o", rim], &flag[..]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let job = ["--density", "260", "--quick", "--json"];
    let of_scan = json(&scan2params(&[&[scan], &flag[..], &job].concat()));
    let of_rim = json(&scan2params(&[&[rim], &job[..]].concat()));
    let with_flag = json(&scan2params(&[&[rim], &flag[..], &job].concat()));
    assert!(of_rim["quality"].is_null() && of_rim["read"].is_null());
    let (a, b) = (&of_scan["boundary"], &of_rim["boundary"]);
    assert_eq!(a["observed_fraction"], b["observed_fraction"]);
    for read_back in [&of_rim, &with_flag] {
        assert_eq!(read_back["orientation"], "given");
        assert_same_answer(&of_scan, read_back);
    }
    assert_eq!(codes(&of_rim), ["rim_from_file"]);
    assert_eq!(codes(&with_flag), ["rim_from_file", "warp_from_file"]);

    // The table is read by the names of its columns.
    let mut table = csv::Reader::from_path(rim).unwrap();
    let names: Vec<String> = table.headers().unwrap().iter().map(Into::into).collect();
    let documented = "index,side,x_mm,y_mm,z_mm,sigma_mm,observed";
    assert_eq!(names[..7].join(","), documented);
    assert_eq!((names[7].as_str(), table.records().count()), ("warp_known", 244));

    // A file that does not know it, or does not say it, is as ambiguous as a scan, and takes
    // directions in its own frame: z exchanges weft and warp, y is up.
    let text = std::fs::read_to_string(rim).unwrap();
    let cut = |line: &str| line.rsplit_once(',').unwrap().0.to_owned() + "\n";
    let without: String = text.lines().map(cut).collect();
    let unknown: String = without
        .lines()
        .enumerate()
        .map(|(k, line)| format!("{line},{}\n", if k == 0 { "warp_known" } else { "0" }))
        .collect();
    for text in [without, unknown] {
        std::fs::write(rim, text).unwrap();
        let silent = json(&scan2params(&[&[rim], &job[..]].concat()));
        assert_eq!(silent["orientation"], "ambiguous");
        assert_eq!(silent["candidates"].as_array().unwrap().len(), 2);
        assert!(codes(&silent).contains(&"orientation_ambiguous"));
        let as_is = json(&scan2params(&[&[rim, "--warp-toward", "+x"], &job[..]].concat()));
        assert_same_answer(&of_rim, &as_is);
        let exchanged = json(&scan2params(&[&[rim, "--warp-toward", "+z"], &job[..]].concat()));
        let value = |run: &Value, key: &str| run["parameters"][key]["value"].as_f64().unwrap();
        let ratio = value(&exchanged, "bending_weft") / value(&of_rim, "bending_warp");
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
        let upright = scan2params(&[&[rim, "--warp-toward", "+y"], &job[..]].concat());
        let said = String::from_utf8_lossy(&upright.stderr).into_owned();
        assert_eq!(upright.status.code(), Some(4), "{said}");
        assert!(said.contains("0 degrees off the vertical") && upright.stdout.is_empty(), "{said}");
    }
}

#[test]
fn rows_that_do_not_agree_on_the_warp_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed.csv");
    let text = std::fs::read_to_string(fixture("drapes/mean.boundary.csv")).unwrap();
    let mut rows: Vec<String> = text.lines().map(Into::into).collect();
    assert!(rows[99].ends_with(",1,1"), "{}", rows[99]);
    rows[99].pop();
    for (warp, remedy) in [("0", "write the same in all"), ("maybe", "write 1 or 0")] {
        let mut rows = rows.clone();
        rows[99] += warp;
        std::fs::write(&path, rows.join("\n")).unwrap();
        let run = scan2params(&[path.to_str().unwrap(), "--density", "214", "--quick"]);
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(1), "{said}");
        assert!(said.contains("mixed.csv:100:") && said.contains(remedy), "{said}");
    }
}

#[test]
fn true_rims_are_taken_and_typing_errors_are_refused_with_their_line() {
    let out = tempfile::tempdir().unwrap();
    let rim = fixture("drapes/stiff.boundary.csv");
    let folder = out.path().join("stiff");
    let run = scan2params(&[
        rim.to_str().unwrap(),
        "--density=214",
        "--quick",
        "--warp-toward=+x",
        &format!("--out={}", folder.display()),
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(String::from_utf8_lossy(&run.stdout).contains("as the boundary file gives it"));
    // named as those of the scan: `x.boundary.csv` is the rim of `x`
    for ending in ["params.json", "boundary.csv", "boundary.png", "report.html"] {
        assert!(folder.join(format!("stiff.{ending}")).is_file(), "stiff.{ending}");
    }
    // where they would replace the rim that is read nothing is written, nor lost
    let given = folder.join("stiff.boundary.csv");
    let before = std::fs::read(&given).unwrap();
    let [path, into] = [&given, &folder].map(|path| path.to_str().unwrap());
    let run = scan2params(&[path, "--density=215", "--quick", "--out", into]);
    assert_eq!(run.status.code(), Some(2));
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("would be lost") && said.contains("folder"), "{said}");
    assert_eq!(std::fs::read(&given).unwrap(), before);
    let rim = fixture("drapes/mean.boundary.csv");
    let run = scan2params(&["inspect", rim.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(2), "a rim is no scan");
    let text = std::fs::read_to_string(rim).unwrap();
    let path = out.path().join("typed.csv");
    let refused = |text: String, code| {
        std::fs::write(&path, text).unwrap();
        let run = scan2params(&[path.to_str().unwrap(), "--density", "214", "--quick"]);
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

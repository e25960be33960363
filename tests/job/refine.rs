//! From a scan to the fabric that the simulator finds: the committed scan of a drape on cells finer
//! than the fit's.

use crate::program;
use crate::promises::{hold, root};
use crate::schema_support;
use serde_json::Value;

/// The six true stiffnesses by name.
fn truth() -> Value {
    let path = root().join("fixtures/drapes/woven.params.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn scan2params(arguments: &[&str]) -> std::process::Output {
    program::program().args(arguments).output().unwrap()
}

#[test]
fn a_scan_of_a_finer_drape_is_refined_to_its_fabric() {
    let (folder, scan) =
        (tempfile::tempdir().unwrap(), "fixtures/scans/woven_structured-light.ply");
    let out = folder.path();
    let run = program::program()
        .args([scan, "--density=180", "--warp-toward=-x", "--out", out.to_str().unwrap()])
        .current_dir(root())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{said}");
    let table = String::from_utf8(run.stdout.clone()).unwrap();
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    assert!(
        readme.contains(&format!("```text\n{table}```")),
        "README.md shows another output:\n{table}"
    );
    let text = std::fs::read_to_string(out.join("woven_structured-light.params.json")).unwrap();
    let result: Value = serde_json::from_str(&text).unwrap();
    schema_support::must_fit("params", &result);
    let found = &result["refinement"];
    assert_eq!((&found["taken"], &found["on_branch"]), (&true.into(), &true.into()), "{found:#}");
    assert_eq!(result["verdict"]["level"], "reliable", "{:#}", result["verdict"]);

    let truth = truth();
    let (mut mean, mut network, mut held) = (0.0_f64, 0.0_f64, 0);
    for (key, parameter) in result["parameters"].as_object().unwrap() {
        let exact = truth["parameters"][key]["value"].as_f64().unwrap();
        let [value, low, high] =
            [&parameter["value"], &parameter["interval90"][0], &parameter["interval90"][1]]
                .map(|number| number.as_f64().unwrap());
        println!("{key}: {value:.0} in {low:.0} to {high:.0}, truth {exact}");
        held += usize::from((low..=high).contains(&exact));
        if key.starts_with("bending") {
            mean += (value / exact).ln().abs() / 3.0;
            let before = found["network"][key]["value"].as_f64().unwrap();
            network += (before / exact).ln().abs() / 3.0;
        }
    }
    println!("bending: network {network:.3}, refined {mean:.3}");
    hold("refine.bending", mean);
    hold("refine.held", held as f64);
    let rim_mm = |drape: &str| result[drape]["rim_mean_mm"].as_f64().unwrap();
    hold("refine.tied_rim", rim_mm("tied_drape"));
    hold("refine.rim", rim_mm("released_drape"));
    // what is told beside the values
    assert_eq!(found["correlation_ln"].as_array().unwrap().len(), 6);
    assert_eq!(found["arcs"].as_array().unwrap().len(), 8);
    assert_eq!(found["bench"].as_object().unwrap().len(), 8);
    assert!(found["drapes"].as_u64().unwrap() > 2);
}

#[test]
fn a_rim_from_a_table_is_refined_and_a_batch_keeps_its_rows_apart_from_unrefined_ones() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    let rim = scans.join("woven.csv");
    std::fs::copy(root().join("fixtures/drapes/woven.boundary.csv"), &rim).unwrap();
    let densities = folder.path().join("densities.csv");
    std::fs::write(&densities, "file,density_g_m2\nwoven.csv,180\n").unwrap();
    let results = folder.path().join("results");
    let batch = |more: &[&str]| {
        let [scans, densities, results] =
            [&scans, &densities, &results].map(|p| p.to_str().unwrap());
        let flags = ["batch", scans, "--density-csv", densities, "--out", results, "--json"];
        let run = scan2params(&[&flags[..], more].concat());
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        let out = String::from_utf8(run.stdout).unwrap();
        serde_json::from_str::<Value>(out.lines().next().unwrap()).unwrap()
    };
    let plain = batch(&["--quick"]);
    assert!(plain["result"]["refinement"].is_null());
    // made again, not kept from the run without it
    let refined = batch(&[]);
    schema_support::must_fit("batch-line", &refined);
    let found = &refined["result"]["refinement"];
    assert!(found["wall_s"].as_f64().is_some_and(|s| s > 0.0), "{refined:#}");
    let of = |row: &Value| row["result"]["parameters"]["bending_weft"]["value"].as_f64().unwrap();
    assert_eq!(found["network"]["bending_weft"]["value"].as_f64(), Some(of(&plain)));
    assert_eq!(found["taken"] == true, of(&refined) != of(&plain), "{found:#}");
}

#[test]
fn scans_are_refined_together_only_where_the_warp_is_known() {
    let (scan, rim) = (
        root().join("fixtures/scans/woven_structured-light.ply"),
        root().join("fixtures/drapes/woven.boundary.csv"),
    );
    let [scan, rim] = [&scan, &rim].map(|p| p.to_str().unwrap());
    let run = |more: &[&str]| {
        let run = scan2params(&[&[scan, "--density=180", "--with", rim], more].concat());
        (run.status.code(), String::from_utf8(run.stderr).unwrap())
    };
    let (code, said) = run(&[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("woven_structured-light.ply: weft and warp are not known"), "{said}");
    // a result takes no companion's place
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("woven_structured-light.boundary.csv");
    std::fs::copy(rim, &kept).unwrap();
    let taken = scan2params(&[
        scan,
        "--density=180",
        "--warp-toward=-x",
        "--out",
        folder.path().to_str().unwrap(),
        "--with",
        kept.to_str().unwrap(),
    ]);
    assert!(!taken.status.success(), "{}", String::from_utf8_lossy(&taken.stderr));
    assert_eq!(std::fs::read(&kept).unwrap(), std::fs::read(rim).unwrap());
    // the network's answer is of one scan
    let (code, said) = run(&["--warp-toward=-x", "--quick"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("--quick"), "{said}");
}

#[test]
#[cfg(target_os = "linux")]
fn who_does_not_wait_gets_the_networks_answer_with_a_word_that_it_is_one() {
    use std::io::{BufRead as _, BufReader, Read as _};
    use std::process::{Command, Stdio};
    let scan = root().join("fixtures/scans/woven_structured-light.ply");
    // the test may have been started with the signal ignored
    let mut command = program::shielded("env");
    command.args(["--default-signal=INT", program::PATH, scan.to_str().unwrap()]);
    command.args(["--density=180", "--warp-toward=-x", "--json", "-v"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("refining: ") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it ended before it refined");
    }
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let mut printed = String::new();
    child.stdout.take().unwrap().read_to_string(&mut printed).unwrap();
    said.read_to_string(&mut line).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{line}");
    assert!(line.contains("interrupted; this is the network's quick answer"), "{line}");
    let result: Value = serde_json::from_str(&printed).unwrap();
    schema_support::must_fit("params", &result);
    let ground = &result["verdict"]["grounds"][0];
    assert_eq!((&ground["code"], &ground["level"]), (&"not_refined".into(), &"reliable".into()));
    assert!(result["tied_drape"].is_null() && result["refinement"]["taken"] == false);
}

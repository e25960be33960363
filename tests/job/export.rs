//! `export` and `convert` on the command line: files, verdicts, exit codes.

use crate::program;
use std::path::{Path, PathBuf};
use std::process::Output;

use scan2params::exchange::Target;
use scan2params::fabric::params::DO_NOT_USE;
use scan2params::job::verdict::Level;

const FABRIC: &str = "fixtures/drapes/woven.params.json";

fn scan2params(words: &[&str]) -> Output {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn printed(words: &[&str]) -> String {
    let run = scan2params(words);
    assert_eq!(run.status.code(), Some(0), "{words:?}: {}", said(&run));
    String::from_utf8(run.stdout).unwrap()
}

/// The fixture with the verdict of a result.
fn with_verdict(folder: &Path, level: &str) -> PathBuf {
    let text = std::fs::read_to_string(FABRIC).unwrap();
    let mut file: serde_json::Value = serde_json::from_str(&text).unwrap();
    file["verdict"] = serde_json::json!({
        "level": level,
        "not_the_experiment": false,
        "grounds": [{ "code": "novel_rim", "text": "unlike all rims of the training" }],
    });
    file["parameters"]["bending_weft"]["interval90"] = serde_json::json!([10_000.0, 12_000.0]);
    let path = folder.join(format!("{level}.params.json"));
    std::fs::write(&path, file.to_string()).unwrap();
    path
}

#[test]
fn every_target_is_written_and_says_what_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let params = with_verdict(folder.path(), "doubtful");
    for target in Target::ALL {
        let out = folder.path().join(target.name());
        let [params, out_text] = [&params, &out].map(|path| path.to_str().unwrap());
        let flags = ["export", params, "--to", target.name(), "--out", out_text, "--edge-mm", "5"];
        let run = scan2params(&flags);
        assert_eq!(run.status.code(), Some(0), "{}: {}", target.name(), said(&run));
        let worth = "verdict: doubtful: unlike all rims of the training";
        assert!(said(&run).starts_with(worth), "{}: {}", target.name(), said(&run));
        let text = std::fs::read_to_string(&out).unwrap();
        // the verdict goes along with all of them, and the interval where there is room
        assert!(text.contains("doubtful"), "{}", target.name());
        assert!(text.contains("12000"), "{}: no interval", target.name());
        if !matches!(target, Target::Csv) {
            assert!(text.contains("simulation parameters, not measured"), "{}", target.name());
        }
        let loses = ["blender", "mujoco", "u3m", "usd", "newton"].contains(&target.name());
        assert_eq!(said(&run).contains("lost: "), loses, "{}: {}", target.name(), said(&run));
        assert_eq!(text.contains("bending along"), loses, "{}", target.name());
    }
    assert!(folder.path().join("u3m.fab.json").exists());
}

#[test]
fn what_is_not_to_be_used_is_not_exported_unless_forced() {
    // the word that `estimate` writes is the one that is looked for
    assert_eq!(Level::DoNotUse.name(), DO_NOT_USE);
    let folder = tempfile::tempdir().unwrap();
    let params = with_verdict(folder.path(), DO_NOT_USE);
    let out = folder.path().join("out.json");
    let [params, out_text] = [&params, &out].map(|path| path.to_str().unwrap());
    let run = scan2params(&["export", params, "--to", "json", "--out", out_text]);
    assert_eq!(run.status.code(), Some(4), "{}", said(&run));
    assert!(said(&run).contains("unlike all rims of the training"), "{}", said(&run));
    assert!(!out.exists());
    let run = scan2params(&["export", params, "--to", "json", "--out", out_text, "--force"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let file: serde_json::Value = serde_json::from_slice(&std::fs::read(out).unwrap()).unwrap();
    assert_eq!(file["verdict"]["level"], DO_NOT_USE);
    let interval = &file["systems"]["bending_weft"]["si"]["interval90"][1];
    assert!((interval.as_f64().unwrap() / 12e-6 - 1.0).abs() < 1e-9, "{interval}");
}

#[test]
fn mistakes_are_usage_and_the_input_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let params = with_verdict(folder.path(), "reliable");
    let params = params.to_str().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    for (words, part) in [
        (vec!["export", params, "--to", "blender", "--out", out], "give --edge-mm"),
        (vec!["export", params, "--to", "maya", "--out", out], "clo, blender, newton"),
        (vec!["export", params, "--to", "usd", "--out", out, "--edge-mm", "0"], "0.1 to 100 mm"),
        (vec!["export", params, "--to", "clo", "--out", params], "is the input"),
        (vec!["convert", "1", "N/m", "--to", "N m"], "from N/m go g/s^2"),
        (vec!["convert", "1", "N/m"], "--to"),
        (vec!["convert", "1"], "give the unit"),
        (vec!["convert", "-1", "N/m", "--to", "g/s^2"], "positive"),
        (vec!["convert", "8", "mm", "--to", "uN m"], "--density"),
    ] {
        let run = scan2params(&words);
        assert_eq!(run.status.code(), Some(2), "{words:?}: {}", said(&run));
        assert!(said(&run).contains(part), "{words:?}: {}", said(&run));
        assert!(!Path::new(out).exists(), "{words:?}");
    }
    let kept: serde_json::Value = serde_json::from_slice(&std::fs::read(params).unwrap()).unwrap();
    assert_eq!(kept["verdict"]["level"], "reliable");
}

#[test]
fn a_file_in_another_unit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(FABRIC).unwrap().replace("g/s^2", "N/m");
    let path = folder.path().join("a.json");
    std::fs::write(&path, text).unwrap();
    let run = scan2params(&["convert", path.to_str().unwrap()]);
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(
        said(&run).contains("/parameters/stretch_weft is in N/m; give it in g/s^2"),
        "{}",
        said(&run)
    );
}

/// What is exported for CLO and read back in CLO's units is the fabric.
#[test]
fn round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.jfab");
    printed(&["export", FABRIC, "--to", "clo", "--out", out.to_str().unwrap()]);
    let file: serde_json::Value = serde_json::from_slice(&std::fs::read(out).unwrap()).unwrap();
    let density = file["mapPhysical"]["fDensity"].as_f64().unwrap();
    let back = printed(&["convert", &density.to_string(), "g/mm^2", "--to", "g/m^2"]);
    assert_eq!(back, "180.00 g/m^2\n");
    let stretch = file["mapPhysical"]["fSuK"].as_f64().unwrap().to_string();
    assert_eq!(printed(&["convert", &stretch, "g/s^2", "--to", "N/m"]), "380.00 N/m\n");
    let slider = printed(&["convert", &stretch, "g/s^2", "--to", "clo-slider", "--json"]);
    let slider: serde_json::Value = serde_json::from_str(&slider).unwrap();
    let position = slider["value"].as_f64().unwrap().to_string();
    assert_eq!(printed(&["convert", &position, "clo-slider", "--to", "g/s^2"]), "380000 g/s^2\n");
}

#[test]
fn a_whole_file_in_all_units() {
    let table = printed(&["convert", FABRIC]);
    // six stiffnesses in five units each, the density in four, and the heading
    assert_eq!(table.lines().count(), 35, "{table}");
    assert!(table.contains("gf cm^2/cm") && table.contains("clo-slider"), "{table}");
    let json = printed(&["convert", FABRIC, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let of = |pointer: &str| json.pointer(pointer).unwrap().as_f64().unwrap();
    assert!((of("/bending_weft/textile/value") - 0.114_208).abs() < 1e-5);
    assert!((of("/density/clo/value") / 1.8e-4 - 1.0).abs() < 1e-9);
}

#[test]
fn targets_are_known_in_any_case_and_unknown_ones_told_which_to_take() {
    let out = tempfile::tempdir().unwrap();
    let path = out.path().join("woven.jfab");
    let export =
        |to: &str| scan2params(&["export", FABRIC, "--to", to, "--out", path.to_str().unwrap()]);
    assert_eq!(export("CLO").status.code(), Some(0));
    let run = export("marvelous");
    assert_eq!(run.status.code(), Some(2));
    assert!(said(&run).contains("[possible values: clo, blender,"), "{}", said(&run));
    let help = scan2params(&["export", "--help"]);
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    for part in ["CLO and Marvelous Designer", "Browzwear", "- usd:"] {
        assert!(help.contains(part), "{part}: {help}");
    }
    let wrong = "fixtures/scans/mean_structured-light.ply";
    let run = scan2params(&["export", wrong, "--to", "clo", "--out", path.to_str().unwrap()]);
    assert!(said(&run).contains("give a params.json as `estimate` writes it"), "{}", said(&run));
}

/// What a tester measured becomes a fabric: of the invented file the stiffnesses are known.
#[test]
fn a_measured_fabric_is_printed_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("invented.params.json");
    let out = out.to_str().unwrap();
    let file = "fixtures/formats/invented.u3m";
    let run = scan2params(&["convert", file, "--out", out, "--values", "recomputed"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let table = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(table.starts_with("invented, of Browzwear's Fabric Analyzer"), "{table}");
    assert!(
        said(&run).contains("stretch_warp: the series give a value +25 % off"),
        "{}",
        said(&run)
    );
    let of = |path: &str| {
        let fabric = scan2params::fabric::params::fabric(Path::new(path), [None; 7]).unwrap();
        fabric.to_paper_units()
    };
    let shear = 1e3 / (4.0 / 120.0 - 1.0 / 250.0 - 1.0 / 500.0);
    for (found, made) in of(out).into_iter().zip([250e3, 500e3, shear, 6e3, 9e3, 7e3, 150.0]) {
        assert!((found / made - 1.0).abs() < 1e-3, "{found} {made}");
    }
    let physics = "fixtures/formats/invented.fab.json";
    let run = scan2params(&["convert", physics, "--out", out, "--density", "160"]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    for (found, made) in of(out).into_iter().zip([250e3, 400e3, 40e3, 6e3, 9e3, 7e3, 160.0]) {
        assert!((found / made - 1.0).abs() < 1e-3, "{found} {made}");
    }
    // The written file is a fabric for the other verbs.
    assert_eq!(printed(&["convert", out]).lines().count(), 35);
    for (words, part) in [
        (vec!["convert", file, "--out", file], "is the input"),
        (vec!["convert", FABRIC, "--out", out], "--out is for a measured fabric"),
        (vec!["convert", file, "--values", "given"], "--out"),
    ] {
        let run = scan2params(&words);
        assert_eq!(run.status.code(), Some(2), "{words:?}: {}", said(&run));
        assert!(said(&run).contains(part), "{words:?}: {}", said(&run));
    }
}

/// Whole experiments: XML that a parser takes, and scripts that Python takes where there is one.
#[test]
fn scenes_are_well_formed() {
    let folder = tempfile::tempdir().unwrap();
    for (target, ending) in [("mujoco", "xml"), ("newton", "py"), ("blender", "py")] {
        for scene in ["drape", "cusick"] {
            let out = folder.path().join(format!("{scene}_{target}.{ending}"));
            let path = out.to_str().unwrap();
            let words = ["export", FABRIC, "--to", target, "--scene", scene, "--out", path];
            let run = scan2params(&words);
            assert_eq!(run.status.code(), Some(0), "{words:?}: {}", said(&run));
            assert!(said(&run).contains(&format!("note: scene {scene}: ")), "{}", said(&run));
            let text = std::fs::read_to_string(&out).unwrap();
            if ending == "xml" {
                let file = roxmltree::Document::parse(&text).unwrap();
                let of = |name: &str| file.descendants().filter(|e| e.has_tag_name(name)).count();
                assert_eq!(["mesh", "geom", "flexcomp", "elasticity"].map(of), [1; 4]);
            } else {
                compiles_in_python(&out);
            }
        }
    }
    let out = folder.path().join("a.jfab");
    let words =
        ["export", FABRIC, "--to", "clo", "--scene", "drape", "--out", out.to_str().unwrap()];
    let run = scan2params(&words);
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("clo holds a fabric alone"), "{}", said(&run));
    assert!(!out.exists());
}

/// Nothing where there is no Python.
fn compiles_in_python(script: &Path) {
    let program = "import ast, sys; ast.parse(open(sys.argv[1], encoding='utf-8').read())";
    let run = std::process::Command::new("python3").args(["-c", program]).arg(script).output();
    if let Ok(run) = run {
        assert!(run.status.success(), "{}: {}", script.display(), said(&run));
    }
}

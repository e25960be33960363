//! `augment`: from a drape to scans that read back to its rim.

use crate::program;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

use scan2params::base::Boundary;
use scan2params::base::units::M_PER_MM;
use scan2params::dataset::drapes::dataset_options;
use scan2params::fabric::Fabric;
use scan2params::io::{boundary_csv, read_scan, write_obj};
use scan2params::sensor::Truth;
use scan2params::sim::{Drop, DropStart, drape};

fn scan2params(arguments: &[&str]) -> Output {
    program::program().args(arguments).output().unwrap()
}

fn done(arguments: &[&str]) -> Output {
    let run = scan2params(arguments);
    assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    run
}

/// A folder with `stiff.obj`, a drape of a stiff knit; made once.
fn drapes() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        let knit = [240_000.0, 310_000.0, 90_000.0, 5200.0, 3600.0, 4100.0, 260.0];
        let drop = Drop { start: DropStart::Perturbed(2) };
        let drape = drape(&Fabric::from_paper_units(knit), &drop, &dataset_options());
        write_obj(folder.path().join("stiff.obj"), &drape.mesh()).unwrap();
        folder
    };
    FOLDER.get_or_init(make).path()
}

fn truth_of(stem: &Path) -> (Truth, Boundary) {
    let beside = |ending: &str| PathBuf::from(format!("{}.{ending}", stem.display()));
    let text = std::fs::read(beside("truth.json")).unwrap();
    let rim = boundary_csv::read(beside("truth.boundary.csv")).unwrap();
    (serde_json::from_slice(&text).unwrap(), rim)
}

fn warp_flag(truth: &Truth) -> String {
    let warp = truth.simulation_from_scanner.inverse() * nalgebra::Vector3::x();
    format!("--warp-toward={},{},{}", warp.x, warp.y, warp.z)
}

/// Depth images with the tablet's noise and pose errors, in a turned frame, back to
/// the rim.
#[test]
fn depth_views_read_back_to_the_rim() {
    let out = tempfile::tempdir().unwrap();
    let drape = drapes().join("stiff.obj");
    let (drape, folder) = (drape.to_str().unwrap(), out.path().to_str().unwrap());
    done(&["augment", drape, "--as", "depth", "--profile", "truedepth", "--out", folder]);
    let scan = out.path().join("stiff-0");
    let (truth, rim) = truth_of(&scan);
    assert!((truth.unit_m - 1.0).abs() < 1e-12);
    let csv = out.path().join("found.csv");
    let [scan_flag, csv_flag] = [&scan, &csv].map(|path| path.to_str().unwrap());
    done(&["boundary", scan_flag, &warp_flag(&truth), "-o", csv_flag]);
    let error_mm = boundary_csv::read(&csv).unwrap().mean_distance_m(&rim) / M_PER_MM;
    println!("rim {error_mm:.2} mm off");
    assert!(error_mm < 3.0, "{error_mm:.2} mm");
    // `estimate` takes the folder too
    let run = done(&[scan_flag, "--density=260", "--quick", "--json"]);
    let result: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!(result["parameters"]["shear"]["value"].as_f64().unwrap() > 0.0);
}

/// A mark of the virtual specimen, seen by a virtual camera, in place of the warp's
/// direction.
#[test]
fn a_coloured_mark_tells_the_warp_as_the_truth_does() {
    let out = tempfile::tempdir().unwrap();
    let drape = drapes().join("stiff.obj");
    let file = |name: &str| out.path().join(name).to_str().unwrap().to_owned();
    let (drape, scan) = (drape.to_str().unwrap(), file("marked.ply"));
    let marked = ["--profile", "truedepth", "--mark", "red", "--seed", "4", "--out", &scan];
    done(&[&["augment", drape][..], &marked].concat());
    let (truth, rim) = truth_of(&out.path().join("marked"));
    let found = |flags: &[&str]| {
        let csv = file("found.csv");
        done(&[&["boundary", &scan, "-o", &csv][..], flags].concat());
        boundary_csv::read(&csv).unwrap()
    };
    let [given, marked] = [found(&[&warp_flag(&truth)]), found(&["--mark", "red"])];
    assert_eq!(given, marked);
    assert!(marked.mean_distance_m(&rim) / M_PER_MM < 1.5);
    let green = scan2params(&["boundary", &scan, "--mark", "green", "-o", &file("no.csv")]);
    assert_eq!(green.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&green.stderr).contains("0 points on the cloth"));
    for wrong in ["white", "#12345", "mauve"] {
        let run = scan2params(&["boundary", &scan, "--mark", wrong, "-o", &file("no.csv")]);
        assert_eq!(run.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn a_variant_is_the_same_bytes_whatever_else_is_made() {
    let out = tempfile::tempdir().unwrap();
    let folder = |name: &str| out.path().join(name).to_str().unwrap().to_owned();
    let drape = drapes().join("stiff.obj");
    let flags = ["--profile", "consumer", "--unit", "either", "--seed", "5"];
    let augment = |input: &Path, out: &str, count: &str| {
        let more = ["augment", input.to_str().unwrap(), "--out", out, "--count", count];
        scan2params(&[&more[..], &flags].concat())
    };
    let (alone, many) = (folder("alone"), folder("many"));
    assert!(augment(&drape, &alone, "1").status.success());
    // The same drape in a folder with another that is none, two variants each.
    let drapes = out.path().join("drapes");
    std::fs::create_dir(&drapes).unwrap();
    std::fs::copy(&drape, drapes.join("stiff.obj")).unwrap();
    std::fs::write(drapes.join("broken.obj"), "v 0 0 0\n").unwrap();
    let run = augment(&drapes, &many, "2");
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(3), "{said}");
    assert!(said.contains("broken: ") && said.contains("no faces"), "{said}");
    assert_eq!(String::from_utf8_lossy(&run.stdout).lines().count(), 2);
    let bytes = |folder: &str, file: &str| std::fs::read(Path::new(folder).join(file)).unwrap();
    for file in ["stiff-0.ply", "stiff-0.truth.json", "stiff-0.truth.boundary.csv"] {
        assert_eq!(bytes(&alone, file), bytes(&many, file), "{file}");
    }
    assert_ne!(bytes(&many, "stiff-0.ply"), bytes(&many, "stiff-1.ply"));
}

#[test]
fn rims_with_the_noise_of_a_scan_are_near_the_truth_and_not_it() {
    let out = tempfile::tempdir().unwrap();
    let drape = drapes().join("stiff.obj");
    let folder = out.path().to_str().unwrap();
    let drape = drape.to_str().unwrap();
    done(&["augment", drape, "--as", "boundary", "--count", "2", "--out", folder]);
    let rims = [0, 1].map(|k| {
        let (_, truth) = truth_of(&out.path().join(format!("stiff-{k}")));
        let path = out.path().join(format!("stiff-{k}.boundary.csv"));
        let rim = boundary_csv::read(&path).unwrap();
        let error_mm = rim.mean_distance_m(&truth) / M_PER_MM;
        assert!((0.01..1.5).contains(&error_mm), "{error_mm}");
        done(&[path.to_str().unwrap(), "--density", "260", "--quick", "--warp-toward", "+x"]);
        rim
    });
    assert_ne!(rims[0], rims[1]);
}

#[test]
fn what_cannot_be_augmented_is_said() {
    let out = tempfile::tempdir().unwrap();
    let drape = drapes().join("stiff.obj");
    let drape = drape.to_str().unwrap();
    let ply = out.path().join("a.ply");
    let (ply, folder) = (ply.to_str().unwrap(), out.path().to_str().unwrap());
    for arguments in [
        &["augment", drape, "--out", ply, "--count", "2"][..],
        &["augment", drape, "--out", ply, "--as", "depth"],
        &["augment", drape, "--out", folder, "--profile", "none"],
        &["augment", folder, "--out", folder],
    ] {
        let run = scan2params(arguments);
        assert_eq!(run.status.code(), Some(2), "{arguments:?}");
    }
    let params = out.path().join("x.params.json");
    std::fs::write(&params, "{}").unwrap();
    let run = scan2params(&["augment", params.to_str().unwrap(), "--out", folder]);
    assert_eq!(run.status.code(), Some(3));
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(said.contains("no number at /parameters/stretch_weft/value"), "{said}");
}

#[test]
fn a_sheet_too_coarse_to_pass_for_cloth_is_told_of() {
    let out = tempfile::tempdir().unwrap();
    let path = |name: &str| out.path().join(name).to_str().unwrap().to_owned();
    let params = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/drapes/stiff.params.json");
    let (coarse, cloud) = (path("coarse.obj"), path("cloud.ply"));
    done(&["simulate", "--params", params, "--vertices", "21", "--out", &coarse]);
    let fine = drapes().join("stiff.obj");
    for (drape, told) in [(coarse.as_str(), true), (fine.to_str().unwrap(), false)] {
        for place in [cloud.clone(), path("folder")] {
            let run = done(&["augment", drape, "--profile", "ideal", "--out", &place]);
            let said = String::from_utf8_lossy(&run.stderr).into_owned();
            assert_eq!(said.contains("cells of 15.0 mm are larger"), told, "{place}: {said}");
            assert_eq!(said.contains("warning"), told, "{place}: {said}");
        }
    }
}

/// A folder of `generate` has rims alone: the refusal gives the command that adds the sheets, and
/// that command does. The scans then have the truth of their rows.
#[test]
fn a_folder_of_generate_is_scanned_once_it_has_sheets() {
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name).display().to_string();
    let (drapes, scans) = (at("drapes"), at("scans"));
    done(&["generate", "--prior", "measured", "--count", "1", "--seed", "3", "--out", &drapes]);
    let run = scan2params(&["augment", &drapes, "--out", &scans]);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{said}");
    assert!(said.contains("rims only") && said.contains("needs the sheets"), "{said}");
    let command = said.split("scan2params generate ").nth(1).unwrap().trim();
    let flags: Vec<&str> = command.split_whitespace().collect();
    assert!(flags.contains(&"--sheets") && flags.ends_with(&["--out", &drapes]), "{command}");
    let rims = std::fs::read(Path::new(&drapes).join("drapes-000000.parquet")).unwrap();
    done(&[&["generate"], &flags[..]].concat());
    assert_eq!(std::fs::read(Path::new(&drapes).join("drapes-000000.parquet")).unwrap(), rims);
    let row = &scan2params::dataset::read_folder(Path::new(&drapes)).unwrap()[0];
    for input in [drapes.clone(), format!("{drapes}/sheets")] {
        done(&["augment", &input, "--profile", "structured-light", "--out", &scans]);
        let stem = Path::new(&scans).join("drape-00000000-0");
        let (_, rim) = truth_of(&stem);
        assert!(rim.mean_distance_m(&row.drape.boundary) < 1e-6);
        let truth = Path::new(&scans).join("drape-00000000-0.truth.params.json");
        let fabric = scan2params::fabric::params::fabric(&truth, [None; 7]).unwrap();
        for (found, made) in fabric.to_paper_units().into_iter().zip(row.fabric.to_paper_units()) {
            assert!((found / made - 1.0).abs() < 1e-12);
        }
        assert!(read_scan(stem.with_extension("ply")).unwrap().0.points.len() > 10_000);
        std::fs::remove_dir_all(&scans).unwrap();
    }
}

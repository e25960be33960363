//! The estimator on a small network whose outputs were recorded from Python's
//! ONNX Runtime (tests/estimate_data, trained on made-up rims by
//! `scripts/train.py --cases`). The runtime is chosen once per process: plain
//! `cargo test` checks the embedded one, `ORT_DYLIB_PATH=... cargo test` the
//! native one, against the same numbers.

use std::path::{Path, PathBuf};

use scan2params::base::{Boundary, Point3};
use scan2params::estimate::{Estimate, EstimateError, EstimateWarning, Estimator};
use scan2params::fabric::{Fabric, Fault};
use serde_json::Value;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/estimate_data").join(name)
}

fn json(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(data(name)).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn tiny() -> Estimator {
    Estimator::from_files(&data("tiny.onnx"), &data("tiny.json")).unwrap()
}

struct Case {
    boundary: Boundary,
    density_kg_m2: f64,
    mean: Vec<f64>,
    sigma: Vec<f64>,
    novelty_mm: f64,
}

fn cases() -> Vec<Case> {
    let cases = json("tiny.cases.json");
    let densities = numbers(&cases["density_g_m2"]);
    let boundary = |row: &Value| {
        let mm = numbers(row);
        Boundary::exact(mm.chunks(3).map(|p| Point3::new(p[0], p[1], p[2]) * 1e-3)).unwrap()
    };
    densities
        .iter()
        .enumerate()
        .map(|(i, density)| Case {
            boundary: boundary(&cases["boundary_mm"][i]),
            density_kg_m2: density * 1e-3,
            mean: numbers(&cases["mean"][i]),
            sigma: numbers(&cases["sigma"][i]),
            novelty_mm: cases["novelty_mm"][i].as_f64().unwrap(),
        })
        .collect()
}

/// Relative difference of the stiffnesses, the largest.
fn apart(a: &Fabric, b: &Fabric) -> f64 {
    let pairs = a.to_paper_units().into_iter().zip(b.to_paper_units());
    pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

fn swapped(fabric: &Fabric) -> Fabric {
    let [a, b, c, d, e, f, g] = fabric.to_paper_units();
    Fabric::from_paper_units([b, a, c, e, d, f, g])
}

/// Observed: 2.4e-5, mostly the recorded coordinates, which are rounded to 1e-4 mm.
const SAME: f64 = 1e-4;

#[test]
fn estimates_equal_those_of_python_with_their_intervals() {
    let estimator = tiny();
    eprintln!("runtime: {}", estimator.runtime());
    let sidecar = json("tiny.json");
    let [ln_min, ln_max] = ["ln_min", "ln_max"].map(|key| numbers(&sidecar["output"][key]));
    let quantile = numbers(&sidecar["interval"]["quantile"]);
    let mut worst = 0.0_f64;
    for case in cases() {
        let estimate = estimator.estimate(&case.boundary, case.density_kg_m2, true).unwrap();
        for (i, parameter) in estimate.parameters().iter().enumerate() {
            let value = |normalised: f64| {
                (ln_min[i] + normalised.clamp(0.0, 1.0) * (ln_max[i] - ln_min[i])).exp()
            };
            let half = quantile[i] * case.sigma[i];
            for (found, expected) in [
                (parameter.value, value(case.mean[i])),
                (parameter.interval90[0], value(case.mean[i] - half)),
                (parameter.interval90[1], value(case.mean[i] + half)),
            ] {
                worst = worst.max((found / expected - 1.0).abs());
            }
        }
        assert!((estimate.novelty.rms_m * 1e3 - case.novelty_mm).abs() < 1e-3);
        assert_eq!(estimate.candidates.len(), 1);
    }
    eprintln!("largest relative difference: {worst:.1e}");
    assert!(worst < SAME, "{worst}");
}

#[test]
fn the_native_runtime_was_used_if_it_was_asked_for() {
    let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|path| !path.is_empty()) else {
        eprintln!("skipped: ORT_DYLIB_PATH is not set, the embedded runtime was tested");
        assert_eq!(tiny().runtime(), "tract");
        return;
    };
    assert_eq!(tiny().runtime(), path.to_string_lossy());
}

#[test]
fn a_symmetric_view_gives_the_same_fabric_and_a_quarter_turn_exchanges_weft_and_warp() {
    let estimator = tiny();
    let fabric = |boundary: &Boundary, case: &Case| {
        estimator.estimate(boundary, case.density_kg_m2, true).unwrap().fabric
    };
    for case in cases() {
        let plain = fabric(&case.boundary, &case);
        assert!(apart(&fabric(&case.boundary.rotated(2), &case), &plain) < SAME);
        for quarters in [1, 3] {
            let turned = fabric(&case.boundary.rotated(quarters), &case);
            assert!(apart(&turned, &swapped(&plain)) < SAME);
            assert!(apart(&turned, &plain) > 0.01);
        }
    }
}

#[test]
fn an_unknown_orientation_gives_both_readings_and_intervals_that_cover_them() {
    let estimator = tiny();
    for case in cases() {
        let known = estimator.estimate(&case.boundary, case.density_kg_m2, true).unwrap();
        let both = estimator.estimate(&case.boundary, case.density_kg_m2, false).unwrap();
        assert!(both.warnings.contains(&EstimateWarning::OrientationAmbiguous));
        assert!(!known.warnings.contains(&EstimateWarning::OrientationAmbiguous));
        assert_eq!(both.fabric, known.fabric);
        assert_eq!(both.candidates.len(), 2);
        assert!(apart(&both.candidates[1].fabric, &swapped(&known.fabric)) < 1e-12);
        for candidate in &both.candidates {
            let values = candidate.fabric.to_paper_units();
            for (parameter, value) in both.parameters().iter().zip(values) {
                let [low, high] = parameter.interval90;
                assert!(low <= value && value <= high, "{} {low} {value} {high}", parameter.key);
            }
        }
    }
}

#[test]
fn the_estimated_fabric_can_always_be_simulated() {
    let estimator = tiny();
    let flat = Boundary::exact((0..244).map(|i| {
        let [x, z] = Boundary::flat_xz_m(i, 0.3);
        Point3::new(x, 0.0, z)
    }));
    let boundaries = cases().into_iter().map(|case| case.boundary).chain(flat);
    for boundary in boundaries {
        for density_kg_m2 in [0.001, 0.2, 2.0] {
            let estimate: Estimate = estimator.estimate(&boundary, density_kg_m2, true).unwrap();
            assert!(estimate.fabric.check().is_ok(), "{:?}", estimate.fabric);
        }
    }
}

#[test]
fn density_is_refused_outside_its_limits_and_flagged_outside_the_training() {
    let estimator = tiny();
    let case = &cases()[0];
    for density_kg_m2 in [0.0, -0.1, 0.0009, 2.1, f64::NAN] {
        let error = estimator.estimate(&case.boundary, density_kg_m2, true).unwrap_err();
        assert!(matches!(
            error,
            EstimateError::Density(Fault::Density { .. } | Fault::NotFinite { .. })
        ));
    }
    let inside = estimator.estimate(&case.boundary, case.density_kg_m2, true).unwrap();
    assert!(inside.in_range.iter().any(|known| *known), "{:?}", inside.warnings);
    // the answer is in proportion to the density: one that training did not have is told, and takes
    // nothing out of its range
    let told = |estimate: &Estimate| {
        estimate.warnings.iter().any(|w| w.to_string().contains("density 900"))
    };
    let outside = estimator.estimate(&case.boundary, 0.9, true).unwrap();
    assert_eq!(outside.in_range, inside.in_range);
    assert!(told(&outside) && !told(&inside));
    // a model that is asked for the specimen's own density knows none but those of its training
    let mut sidecar = json("tiny.json");
    let input = sidecar["input"].as_object_mut().unwrap();
    assert!(input.remove("asked_density_g_m2").is_some());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.json");
    std::fs::write(&path, sidecar.to_string()).unwrap();
    let own = Estimator::from_files(&data("tiny.onnx"), &path).unwrap();
    let outside = own.estimate(&case.boundary, 0.9, true).unwrap();
    assert_eq!(outside.in_range, [false; 6]);
    assert!(told(&outside));
}

#[test]
fn a_rim_unlike_any_drape_is_flagged_and_one_that_is_not_finite_refused() {
    let estimator = tiny();
    let case = &cases()[0];
    let zigzag = |size: f64| {
        let points = case.boundary.positions_m().enumerate();
        let moved =
            points.map(|(i, p)| Point3::new(p.x, p.y + size * f64::from(i as u32 % 2), p.z));
        Boundary::exact(moved).unwrap()
    };
    let novel = |estimate: &Estimate| {
        estimate.warnings.iter().any(|w| matches!(w, EstimateWarning::NovelRim { .. }))
    };
    let [plain, crooked] = [0.0, 0.05]
        .map(|size| estimator.estimate(&zigzag(size), case.density_kg_m2, true).unwrap());
    assert!(!novel(&plain) && novel(&crooked), "{:?} {:?}", plain.novelty, crooked.novelty);
    let error = estimator.estimate(&zigzag(f64::NAN), case.density_kg_m2, true).unwrap_err();
    assert!(matches!(error, EstimateError::NotFinite { index: 0 }), "{error}");
}

#[test]
fn files_that_do_not_belong_together_or_to_this_program_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [onnx, sidecar] = ["m.onnx", "m.json"].map(|name| folder.path().join(name));
    let bytes = std::fs::read(data("tiny.onnx")).unwrap();
    let text = std::fs::read_to_string(data("tiny.json")).unwrap();
    let refused = |bytes: &[u8], text: &str| {
        std::fs::write(&onnx, bytes).unwrap();
        std::fs::write(&sidecar, text).unwrap();
        let error = Estimator::from_files(&onnx, &sidecar).err();
        error.map_or_else(|| "taken".to_owned(), |error| error.to_string())
    };
    assert_eq!(refused(&bytes, &text), "taken");
    let mut other = bytes.clone();
    other[1000] ^= 1;
    assert!(refused(&other, &text).contains("SHA-256"));
    assert!(
        refused(&bytes, &text.replace("\"simulator_numerics\": ", "\"simulator_numerics\": 9"))
            .contains("numerics")
    );
    assert!(refused(&bytes, &text.replace("model/1", "model/9")).contains("schema"));
    assert!(refused(&bytes, &text[..text.len() / 2]).contains("m.json"));
    assert!(
        Estimator::from_files(&data("none"), &sidecar).err().unwrap().to_string().contains("none")
    );
}

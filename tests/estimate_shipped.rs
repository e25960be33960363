//! The model in the package: small enough, sound, and better than the baseline.

use scan2params::estimate::Estimator;

const ONNX: &[u8] = include_bytes!("../src/estimate/model/snn.onnx");
const SIDECAR: &str = include_str!("../src/estimate/model/snn.json");

fn metric(path: [&str; 2]) -> f64 {
    let sidecar: serde_json::Value = serde_json::from_str(SIDECAR).unwrap();
    sidecar["metrics"][path[0]][path[1]].as_f64().unwrap()
}

#[test]
fn the_model_file_is_at_most_16_mib() {
    assert!(ONNX.len() <= 16 << 20, "{} bytes", ONNX.len());
}

#[test]
fn the_model_belongs_to_this_simulator() {
    // fails where the model was trained on other numerics, or is a placeholder
    let estimator = Estimator::shipped().unwrap();
    assert_eq!(estimator.model().trained_on, "drapes");
    assert_eq!(estimator.model().simulator_numerics, scan2params::sim::NUMERICS_VERSION);
}

#[test]
fn it_beats_linear_regression_and_its_intervals_cover_nine_in_ten() {
    assert!(metric(["test", "rmse"]) < metric(["linear_regression", "rmse"]));
    assert!(metric(["test_noisy", "r2"]) > 0.5);
    // About 200 test fabrics times six outputs that hang together: one sigma is
    // about 0.015.
    let coverage = metric(["test_noisy", "coverage"]);
    assert!((0.85..=0.95).contains(&coverage), "{coverage}");
}

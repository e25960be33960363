//! Committed scenes with real sensors' errors, stands and surroundings: each is answered, the rim
//! lies on the true one, and cutting the surroundings off moves it by little.

use std::path::{Path, PathBuf};

use scan2params::base::Boundary;
use scan2params::geom::Cloud;
use scan2params::io::{boundary_csv, read_scan};
use scan2params::scan::{Crop, ScanOptions, WarpToward, boundary_from_scan};
use scan2params::sensor::Truth;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes").join(name)
}

/// A scene, and how its warp lies.
fn scene(name: &str) -> (Cloud, ScanOptions) {
    let text = std::fs::read_to_string(fixture(&format!("{name}.truth.json"))).unwrap();
    let truth: Truth = serde_json::from_str(&text).unwrap();
    let warp = truth.simulation_from_scanner.inverse() * nalgebra::Vector3::x();
    let warp_toward = Some(WarpToward::Direction(warp.into()));
    let (cloud, _) = read_scan(fixture(&format!("{name}.ply"))).unwrap();
    (cloud, ScanOptions { warp_toward, ..ScanOptions::default() })
}

/// Answers a scene whole, within a mean distance from the true rim, and cut to the drape and its
/// stand: that moves the rim by at most 0.2 mm.
fn answered(name: &str, off_limit_m: f64) {
    let (cloud, options) = scene(name);
    let rim = |options: &ScanOptions| -> Boundary {
        boundary_from_scan(&cloud, options).unwrap().boundary
    };
    let whole = rim(&options);
    let truth = boundary_csv::read(fixture(&format!("{name}.truth.boundary.csv"))).unwrap();
    let cut = ScanOptions { crop: Some(Crop::Radius { radius_mm: 220.0 }), ..options };
    let (off_m, moved_m) = (truth.mean_distance_m(&whole), whole.mean_distance_m(&rim(&cut)));
    eprintln!("{name}: {off_m:.5} m off, moved by {moved_m:.5} m");
    assert!(off_m < off_limit_m, "{name}: {off_m} m off");
    assert!(moved_m < 0.2e-3, "{name}: moved by {moved_m} m");
}

#[test]
fn a_phones_scan_of_a_drape_on_a_can_among_boxes() {
    answered("phone_can_clutter", 0.9e-3);
}

#[test]
fn a_stereo_cameras_scan_of_a_drape_on_a_box() {
    answered("d435_box_open", 1.2e-3);
}

#[test]
fn a_handheld_scan_of_a_knit_before_a_wall() {
    answered("handheld_post_wall", 0.45e-3);
}

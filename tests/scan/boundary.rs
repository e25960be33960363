//! From scan to rim on drapes whose truth is known.

use crate::promises::hold;
use crate::refusals::whole;
use crate::scan_support::{Drape, Sampling, mean_knit, random_pose, scan, stiff_knit};

use scan2params::base::{Boundary, Isometry3, Point3};
use scan2params::geom::Cloud;
use scan2params::scan::{
    LengthUnit, Orientation, ScanError, ScanOptions, ScannedBoundary, WarpToward,
    boundary_from_scan,
};
use scan2params::sensor::{self, VirtualScan};

/// Warp as the truth has it, in the scan's frame.
fn warp(scan_from_sim: &Isometry3) -> ScanOptions {
    let x = scan_from_sim.rotation * scan2params::base::frame::WARP;
    ScanOptions { warp_toward: Some(WarpToward::Direction(x.into())), ..ScanOptions::default() }
}

fn errors(found: &ScannedBoundary, truth: &Boundary) -> (f64, f64) {
    let d: Vec<f64> = found
        .boundary
        .positions_m()
        .zip(truth.positions_m())
        .map(|(a, b)| (a - b).norm() * 1e3)
        .collect();
    (d.iter().sum::<f64>() / 244.0, d.iter().copied().fold(0.0, f64::max))
}

/// The paper's mean fabric or a stiffer one.
fn drape(stiff: bool) -> &'static Drape {
    if stiff { stiff_knit() } else { mean_knit() }
}

/// Mean and largest error \[mm\] of a scan that is answered.
fn answered(stiff: bool, sampling: &Sampling, pose: &Isometry3) -> (ScannedBoundary, f64, f64) {
    let cloud = scan(drape(stiff), sampling, pose);
    let found = boundary_from_scan(&cloud, &warp(pose)).unwrap();
    let (mean, largest) = errors(&found, &drape(stiff).rim());
    (found, mean, largest)
}

#[test]
fn rims_keep_their_promise_over_noise_pose_and_unit() {
    let mut all_largest = 0.0_f64;
    for (stiff, noise_mm, pose, units, id) in [
        (false, 0.15, 3, 1.0, "rim.even_knit_0.15"),
        (true, 0.15, 4, 1000.0, "rim.even_stiff_0.15"),
        (true, 1.0, 5, 1000.0, "rim.even_stiff_1"),
    ] {
        let sampling = Sampling {
            noise_m: noise_mm * 1e-3,
            units_per_metre: units,
            seed: pose,
            ..Sampling::default()
        };
        let (found, mean, largest) = answered(stiff, &sampling, &random_pose(pose));
        hold(id, mean);
        all_largest = all_largest.max(largest);
        let expected = if units > 1.0 { LengthUnit::Millimetre } else { LengthUnit::Metre };
        assert_eq!(found.unit, expected);
        let noise_found_mm = found.quality.noise_m * 1e3;
        println!("noise {noise_mm} mm, found {noise_found_mm:.3} mm");
        assert!((noise_found_mm / noise_mm - 1.0).abs() < 0.2, "{noise_found_mm:.2}");
    }
    hold("rim.even_largest", all_largest);
}

/// Twice the noise is answered with the uncertainty that goes with it.
#[test]
fn two_millimetres_of_noise_are_within_what_the_rim_states() {
    let sampling = Sampling { noise_m: 2e-3, seed: 6, ..Sampling::default() };
    let (found, mean, largest) = answered(true, &sampling, &random_pose(6));
    let stated = found.boundary.mean_sigma_m() * 1e3;
    println!("2 mm of noise: rim {mean:.2} mm off, {largest:.2} at most, {stated:.2} stated");
    // the mean length of three normal deviates is 1.6 of one
    assert!(mean < 1.6 * 1.5 * stated && mean < 2.0, "{mean} {stated}");
    assert!(stated > 0.3, "{stated}");
}

#[test]
fn rim_does_not_depend_on_the_scans_frame() {
    let rims = [11, 12].map(|seed| answered(true, &Sampling::default(), &random_pose(seed)).0);
    // Voxels fall differently: not zero.
    hold("rim.frame", rims[0].boundary.mean_distance_m(&rims[1].boundary) * 1e3);
}

#[test]
fn a_short_gap_is_bridged_and_a_long_one_refused_with_its_bearing() {
    let run = |from: f64, wide: f64| {
        let missing_deg = Some((from, from + wide));
        let sampling = Sampling { missing_deg, ..Sampling::default() };
        let pose = Isometry3::identity();
        boundary_from_scan(&scan(drape(true), &sampling, &pose), &warp(&pose))
    };
    let (mut worst_mean, mut worst, mut longest_m) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (from, wide) in [(340.0, 10.0), (80.0, 30.0)] {
        let found = run(from, wide).unwrap();
        let (mean, largest) = errors(&found, &drape(true).rim());
        worst_mean = worst_mean.max(mean);
        worst = worst.max(largest);
        longest_m = longest_m.max(found.quality.longest_gap_m);
        assert!(found.quality.observed_fraction < 1.0);
        let sigma = |observed: bool| {
            let points = found.boundary.points().iter().filter(|p| p.observed == observed);
            points.map(|p| p.sigma_m).fold(0.0, f64::max)
        };
        assert!(sigma(false) > 1.2 * sigma(true), "{} {}", sigma(false), sigma(true));
    }
    hold("rim.bridged_arc", 1e3 * longest_m);
    hold("rim.bridged_mean", worst_mean);
    hold("rim.bridged_largest", worst);
    match run(80.0, 40.0) {
        Err(ScanError::Gap { bearing_deg, length_mm, limit_mm }) => {
            assert!((bearing_deg - 95.0).abs() < 15.0, "{bearing_deg}");
            assert!(length_mm > limit_mm);
        }
        other => panic!("{:?}", other.map(|f| f.quality)),
    }
}

#[test]
fn warp_direction_turns_the_boundary_by_quarters_and_its_absence_is_flagged() {
    let cloud = scan(drape(true), &Sampling::thin(), &Isometry3::identity());
    let toward = |warp_toward| {
        boundary_from_scan(&cloud, &ScanOptions { warp_toward, ..ScanOptions::default() }).unwrap()
    };
    // the same cloud, its warp at bearing 0
    let along_x = whole();
    let along_minus_z = toward(Some(WarpToward::Direction([0.0, 0.2, -1.0])));
    let apart = |other: &ScannedBoundary| {
        (0..4)
            .map(|q| along_x.boundary.rotated(q).mean_distance_m(&other.boundary) * 1e3)
            .collect::<Vec<_>>()
    };
    let turned = apart(&along_minus_z);
    assert!(turned[1] < 0.1 || turned[3] < 0.1, "{turned:.2?}");
    assert!(turned[0] > 1.0);
    assert_eq!(along_x.orientation, Orientation::Given);
    let free = toward(None);
    assert_eq!(free.orientation, Orientation::Ambiguous);
    assert!(apart(&free).iter().any(|d| *d < 0.1));
}

#[test]
fn scenes_without_a_drape_are_refused() {
    let grid = |count: usize, at: fn(f64, f64) -> Point3| Cloud {
        points: (0..count * count)
            .map(|k| {
                at((k % count) as f64 / count as f64 - 0.5, (k / count) as f64 / count as f64 - 0.5)
            })
            .collect(),
        ..Cloud::default()
    };
    let run = |cloud: &Cloud| boundary_from_scan(cloud, &ScanOptions::default()).map(|f| f.quality);
    assert!(matches!(run(&Cloud::default()), Err(ScanError::TooFewPoints { points: 0, .. })));
    let nan = grid(80, |_, _| Point3::new(f64::NAN, 0.0, 0.0));
    assert!(matches!(run(&nan), Err(ScanError::TooFewPoints { points: 0, .. })));
    let table = grid(150, |x, z| Point3::new(x, 0.0, z));
    assert!(matches!(run(&table), Err(ScanError::NoPlate { .. })));
    let dome = grid(150, |x, z| Point3::new(0.4 * x, -1.5 * (x * x + z * z), 0.4 * z));
    assert!(run(&dome).is_err());
    // A hat: a disc of the plate's radius with a cylinder below, but no square.
    let hat = grid(250, |x, z| {
        let (r, a) = ((x + 0.5) * 0.15, std::f64::consts::TAU * z);
        Point3::new(r.min(0.05) * a.cos(), -(r - 0.05).max(0.0), r.min(0.05) * a.sin())
    });
    assert!(run(&hat).is_err());
    let huge = grid(80, |x, z| Point3::new(1e9 * x, 0.0, 1e9 * z));
    assert!(matches!(run(&huge), Err(ScanError::Size { .. })));
}

#[test]
fn a_virtual_structured_light_scan_is_answered() {
    let scanned = virtual_scan(drape(true), "structured-light", 5);
    let sim_from_scan = scanned.truth.simulation_from_scanner;
    let options = warp(&sim_from_scan.inverse());
    let found = boundary_from_scan(&scanned.cloud, &options).unwrap();
    hold("rim.virtual_stiff", errors(&found, &drape(true).rim()).0);
}

/// A drape before the virtual depth camera.
fn virtual_scan(drape: &Drape, profile: &str, seed: u64) -> VirtualScan {
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|k| k as u32)).collect();
    let mesh = scan2params::geom::Mesh { vertices: drape.vertices.clone(), triangles };
    let scene = sensor::Scene::modified_cusick(mesh);
    sensor::scan(&scene, &sensor::default_ring(), &sensor::Profile::named(profile).unwrap(), seed)
        .unwrap()
}

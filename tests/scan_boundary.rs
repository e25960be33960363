//! From scan to rim on drapes whose truth is known.

mod scan_support;

use scan_support::{Drape, Sampling, random_pose, scan};
use scan2params::base::{Boundary, Isometry3};
use scan2params::scan::{ScanError, ScanOptions, ScannedBoundary, WarpToward, boundary_from_scan};
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

#[test]
#[ignore = "prints a table; reads OBJ drapes named in DRAPES"]
fn table() {
    let mut drapes: Vec<(String, Drape)> = std::env::var("DRAPES")
        .unwrap_or_default()
        .split_whitespace()
        .map(|p| (p.rsplit('/').next().unwrap().to_owned(), Drape::from_obj(p.as_ref())))
        .collect();
    if drapes.is_empty() {
        for (seed, bend) in [(1, 0.05), (2, 0.2), (3, 0.02)] {
            drapes.push((format!("synthetic-{seed}"), Drape::synthetic(seed, bend)));
        }
    }
    for (name, drape) in &drapes {
        for noise_mm in [0.15, 1.0, 2.0] {
            let sampling = Sampling { noise_m: noise_mm * 1e-3, ..Sampling::default() };
            let pose = random_pose(7);
            let cloud = scan(drape, &sampling, &pose);
            let start = std::time::Instant::now();
            let result = boundary_from_scan(&cloud, &warp(&pose));
            let seconds = start.elapsed().as_secs_f64();
            match result {
                Ok(found) => {
                    let (mean, max) = errors(&found, &drape.rim());
                    let origin = found.sim_from_scan * pose;
                    println!(
                        "{name} noise {noise_mm}: mean {mean:.3} max {max:.3} mm, {seconds:.2} s, observed {:.2}, sides {:.1?}, edges {:.1?}, R {:.2}+-{:.2}, sheet {:.2}, noise {:.2}, origin {:.2?} turn {:.2?} deg, offset {:.2}",
                        found.quality.observed_fraction,
                        found.quality.side_lengths_m.map(|m| m * 1e3),
                        found.quality.edge_m.map(|m| m * 1e3),
                        found.quality.plate_radius_m * 1e3,
                        found.quality.plate_radius_scatter_m * 1e3,
                        found.quality.sheet_rms_m * 1e3,
                        found.quality.noise_m * 1e3,
                        (origin.translation.vector * 1e3).as_slice(),
                        (origin.rotation.scaled_axis().map(f64::to_degrees)).as_slice(),
                        found.quality.centre_offset_m * 1e3,
                    );
                    scan2params::scan::picture::draw(&found)
                        .save(format!("/tmp/scan-{name}-{noise_mm}.png"))
                        .unwrap();
                }
                Err(error) => println!("{name} noise {noise_mm}: refused: {error}"),
            }
        }
    }
}

/// A drape before the virtual depth camera.
fn virtual_scan(drape: &Drape, profile: &str, seed: u64) -> VirtualScan {
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|k| k as u32)).collect();
    let mesh = scan2params::geom::Mesh { vertices: drape.vertices.clone(), triangles };
    let scene = sensor::Scene::modified_cusick(mesh);
    sensor::scan(&scene, &sensor::default_ring(), &sensor::Profile::named(profile).unwrap(), seed)
        .unwrap()
}

/// One line per scan: the error, and its share in the frame.
fn report(name: &str, drape: &Drape, scan: &VirtualScan) {
    let sim_from_scan = scan.truth.simulation_from_scanner;
    let cloud = &scan.cloud;
    let start = std::time::Instant::now();
    let mut options = warp(&sim_from_scan.inverse());
    if std::env::var("LAX").is_ok() {
        options = ScanOptions {
            max_gap_m: 9.0,
            min_observed: 0.0,
            max_misfit_m: 9.0,
            side_range_m: [0.0, 9.0],
            ..options
        };
    }
    let result = boundary_from_scan(cloud, &options);
    let seconds = start.elapsed().as_secs_f64();
    match result {
        Ok(found) => {
            let rim = drape.rim();
            let (mean, max) = errors(&found, &rim);
            let drift = found.sim_from_scan * sim_from_scan.inverse();
            let mut in_truth = found.clone();
            let moved = found.boundary.points().iter().map(|p| drift.inverse() * p.position_m);
            in_truth.boundary = Boundary::exact(moved).unwrap();
            let (shape, shape_max) = errors(&in_truth, &rim);
            let sigma: Vec<f64> = found.boundary.points().iter().map(|p| p.sigma_m * 1e3).collect();
            let chi = in_truth
                .boundary
                .positions_m()
                .zip(rim.positions_m())
                .zip(&sigma)
                .map(|((a, b), s)| ((a - b).norm_squared() / 3.0 * 1e6 / (s * s)).min(1e3))
                .sum::<f64>()
                / 244.0;
            let (mut outward, mut truth_sides) = (0.0, [0.0; 4]);
            for (i, (p, q)) in in_truth.boundary.positions_m().zip(rim.positions_m()).enumerate() {
                outward += (p - q).dot(&drape.outward(i)) * 1e3 / 244.0;
                if i % 61 > 0 {
                    truth_sides[i / 61] += (q - rim.points()[i - 1].position_m).norm() * 1e3;
                }
            }
            println!(
                "{name}: mean {mean:.2} max {max:.2} | in true frame {shape:.2} {shape_max:.2} out {outward:.2} | chi {:.1} | {seconds:.1} s, {}k, obs {:.2}, gap {:.0}, sides {:.1?} true {truth_sides:.1?}, edges {:.1?} widths {:.1?} true {:.1?}, R {:.1}+-{:.1}, sheet {:.2}, noise {:.2}, spacing {:.2}, origin {:.2?} turn {:.2?} deg, offset {:.2}",
                chi.sqrt(),
                cloud.points.len() / 1000,
                found.quality.observed_fraction,
                found.quality.longest_gap_m * 1e3,
                found.quality.side_lengths_m.map(|m| m * 1e3),
                found.quality.edge_m.map(|m| m * 1e3),
                found.quality.widths_m.map(|m| m.unwrap_or(0.0) * 1e3),
                drape.widths_mm(),
                found.quality.plate_radius_m * 1e3,
                found.quality.plate_radius_scatter_m * 1e3,
                found.quality.sheet_rms_m * 1e3,
                found.quality.noise_m * 1e3,
                found.quality.point_spacing_m * 1e3,
                (drift.translation.vector * 1e3).as_slice(),
                (drift.rotation.scaled_axis().map(f64::to_degrees)).as_slice(),
                found.quality.centre_offset_m * 1e3,
            );
            scan2params::scan::picture::draw(&found).save(format!("/tmp/scan-{name}.png")).unwrap();
        }
        Err(error) => println!("{name}: refused ({seconds:.1} s): {error}"),
    }
}

#[test]
#[ignore = "prints a table; scans the OBJ drapes named in DRAPES with PROFILES"]
fn virtual_scans() {
    let list = |key: &str| std::env::var(key).unwrap_or_default();
    for path in list("DRAPES").split_whitespace() {
        let drape = Drape::from_obj(path.as_ref());
        let stem = path.rsplit('/').next().unwrap().trim_end_matches(".obj");
        for profile in list("PROFILES").split_whitespace() {
            report(&format!("{stem}_{profile}"), &drape, &virtual_scan(&drape, profile, 1));
        }
    }
}

#[test]
#[ignore = "reads real sensor files named in SCANS"]
fn real_files() {
    for path in std::env::var("SCANS").unwrap_or_default().split_whitespace() {
        let (cloud, _) = scan2params::io::read_scan(path).unwrap();
        let start = std::time::Instant::now();
        match boundary_from_scan(&cloud, &ScanOptions::default()) {
            Ok(found) => println!("{path}: ANSWERED {:?}", found.quality),
            Err(error) => println!("{path} ({:.1} s): {error}", start.elapsed().as_secs_f64()),
        }
    }
}

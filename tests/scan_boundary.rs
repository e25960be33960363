//! From scan to rim on drapes whose truth is known.

mod scan_support;

use scan_support::{Drape, Sampling, random_pose, scan};
use scan2params::base::{Boundary, Isometry3};
use scan2params::scan::{ScanError, ScanOptions, ScannedBoundary, WarpToward, boundary_from_scan};

/// Warp as the truth has it, in the scan's frame.
fn warp(scan_from_sim: &Isometry3) -> ScanOptions {
    let x = scan_from_sim.rotation * scan2params::base::frame::WARP;
    ScanOptions { warp_toward: Some(WarpToward::Direction(x.into())), ..ScanOptions::default() }
}

fn errors(found: &ScannedBoundary, truth: &Boundary) -> (f64, f64) {
    let d: Vec<f64> =
        found.boundary.positions_m().zip(truth.positions_m()).map(|(a, b)| (a - b).norm() * 1e3).collect();
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

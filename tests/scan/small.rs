//! What is far too little for a drape is refused, never a panic: small meshes, tiny clouds,
//! and scenes that get past the plate with next to nothing behind it.

use rand::RngExt as _;
use scan2params::base::seed::{self, Rng};
use scan2params::base::{Point3, Vector3};
use scan2params::geom::Cloud;
use scan2params::scan::{LengthUnit, ScanError, ScanOptions, WarpToward, boundary_from_scan};

/// Runs a scan that is none; it must be refused.
fn refused(cloud: &Cloud, options: &ScanOptions, what: &str) -> ScanError {
    match boundary_from_scan(cloud, options) {
        Ok(found) => panic!("{what}: answered, {:?}", found.quality),
        Err(refusal) => refusal,
    }
}

/// Without a unit and with a bearing, or the other way round.
fn options(item: u64) -> ScanOptions {
    if item.is_multiple_of(2) {
        let warp_toward = Some(WarpToward::BearingDeg(10.0));
        ScanOptions { warp_toward, ..ScanOptions::default() }
    } else {
        let (unit, mark) = (Some(LengthUnit::Metre), Some("red".parse().unwrap()));
        ScanOptions { unit, mark, ..ScanOptions::default() }
    }
}

fn evenly(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

fn point(rng: &mut Rng, size: f64) -> Point3 {
    Point3::from(Vector3::from_fn(|_, _| evenly(rng, -size, size)))
}

#[test]
fn a_single_triangle_is_no_drape() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for scale in [1e-9, 1e-3, 0.3, 1.0, 300.0, 1e6] {
        let points = corners.map(|c| Point3::from(c) * scale).to_vec();
        let cloud = Cloud { points, triangles: vec![[0, 1, 2]], ..Cloud::default() };
        for item in 0..2 {
            let refusal = refused(&cloud, &options(item), "a triangle").to_string();
            let remedies = ["scan", "unit", "export"];
            assert!(remedies.iter().any(|word| refusal.contains(word)), "{scale}: {refusal}");
        }
    }
}

/// Few triangles, of any size and shape: loose, welded, folded onto each other, without
/// area, with corners that are not there or not finite.
#[test]
fn small_meshes_never_panic() {
    for item in 0..20 {
        let mut rng = seed::rng(1, "small-meshes", item);
        let size = 10_f64.powf(evenly(&mut rng, -3.0, 3.5));
        let corners = 1 + (evenly(&mut rng, 0.0, 30.0) as usize);
        let mut points: Vec<Point3> = (0..corners).map(|_| point(&mut rng, size)).collect();
        match item % 5 {
            0 => points.iter_mut().for_each(|p| p.y = 0.0),
            1 => points.iter_mut().for_each(|p| *p = Point3::new(p.x, 0.0, 0.0)),
            2 => points = vec![points[0]; corners],
            3 if item % 2 == 0 => points[0].x = f64::NAN,
            _ => {}
        }
        let count = 1 + (evenly(&mut rng, 0.0, 40.0) as usize);
        let beyond = u32::from(item % 7 == 0);
        let mut corner = || (rng.random::<f64>() * corners as f64) as u32 + beyond;
        let triangles = (0..count).map(|_| [corner(), corner(), corner()]).collect();
        let colors = if item % 3 == 0 { vec![[200, 30, 30]; corners] } else { Vec::new() };
        refused(&Cloud { points, colors, triangles }, &options(item), &format!("mesh {item}"));
    }
}

/// Points in numbers from none to just enough, on a place, a line, a plane, a sphere, or
/// anywhere.
#[test]
fn tiny_clouds_never_panic() {
    for item in 0..60 {
        let mut rng = seed::rng(2, "tiny-clouds", item);
        let count = [0, 1, 2, 3, 10, 100, 2999, 3000, 3100, 5000][item as usize % 10];
        let size = 10_f64.powf(evenly(&mut rng, -2.0, 3.5));
        let shape = (item / 10 + item) % 6;
        let points = (0..count)
            .map(|_| {
                let p = point(&mut rng, size);
                match shape {
                    0 => Point3::new(size, size, size),
                    1 => Point3::new(p.x, 0.0, 0.0),
                    2 => Point3::new(p.x, 0.1 * size, p.z),
                    3 => Point3::from(p.coords.normalize() * size),
                    4 => Point3::new(p.x, f64::INFINITY, p.z),
                    _ => p,
                }
            })
            .collect();
        refused(&Cloud { points, ..Cloud::default() }, &options(item), &format!("cloud {item}"));
    }
}

/// A disc from which little or much of a surface falls away: past the plate, there is no
/// square, no edge, no rim. As points and as a mesh, with a floor and without.
#[test]
fn discs_with_next_to_nothing_around_them_never_panic() {
    for item in 0..8 {
        let mut rng = seed::rng(3, "discs", item);
        let reach_m = evenly(&mut rng, 0.055, 0.2);
        let steep = evenly(&mut rng, 0.2, 1.5);
        let step_m = evenly(&mut rng, 1.5e-3, 6e-3);
        let gone = evenly(&mut rng, 0.0, 0.9);
        let n = (2.0 * reach_m / step_m) as usize;
        let at = |k: usize| {
            let [x, z] = [k % n, k / n].map(|c| (c as f64 + 0.5) * step_m - reach_m);
            let r = x.hypot(z);
            let out = (r - 0.05).max(0.0);
            let to = (r.min(0.05) + out * steep.cos()) / r;
            Point3::new(x * to, -out * steep.sin(), z * to)
        };
        let mut points: Vec<Point3> = (0..n * n).map(at).collect();
        let mut triangles = Vec::new();
        if item.is_multiple_of(2) {
            points.retain(|_| rng.random::<f64>() > gone);
        } else {
            for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n) {
                let [a, b, c, d] = [k, k + 1, k + n, k + n + 1].map(|v| v as u32);
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
        if item % 3 == 0 && triangles.is_empty() {
            let floor = |k: usize| {
                Point3::new((k % 90) as f64 * 8e-3 - 0.36, -0.3, (k / 90) as f64 * 8e-3 - 0.36)
            };
            points.extend((0..8100).map(floor));
        }
        let colors = vec![[200, 30, 30]; points.len()];
        refused(&Cloud { points, colors, triangles }, &options(item), &format!("disc {item}"));
    }
}

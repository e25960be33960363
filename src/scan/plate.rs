//! The plate: a flat disc of known radius from whose edge the cloth falls away
//! on all sides. The plate itself is hidden under the cloth; this shape of the
//! cloth on top of it gives the origin and "up" without help from the file's
//! axes, and nothing else in a scene has it (tables and floors do not fall away
//! within 90 mm all round).
//!
//! In: points of the scene \[m\], any frame. Out: the plate's centre (on the
//! cloth's surface), up, radius, noise.
//!
//! Centre: on each bearing the cloth leaves the plate tangentially with a
//! curvature k, so its depth below the plane is k (r - R)^2 / 2 and sqrt(depth)
//! is a straight line in r that vanishes at the edge R; the centre is that of the
//! circle through the edges of all bearings. Fails where the cloth is so stiff
//! that it hardly bends (then nothing falls away and the scan is refused).

use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, UnitVector3};
use rayon::prelude::*;

use super::downsample::voxel_downsample;
use super::error::{PlateCandidate, ScanError};
use super::neighbours::Neighbours;
use super::unit::LengthUnit;
use crate::base::{Point3, Vector3};
use crate::numeric::robust;

/// Share of the patch's edge where the surface must fall away.
const FALLING_LIMIT: f64 = 0.35;
/// The flat patch that seeds the search, in plate radii.
const PATCH_RADII: f64 = 0.6;
/// Largest root mean square of a flat patch [m]: cloth wrinkles and thinned noise.
const FLAT_RMS_M: f64 = 3e-3;
/// Share of level points within 1.5 radii above which the patch is a larger plane;
/// a plate of half the sphere's radius has 0.5 or less.
const MOST_LEVEL: f64 = 0.85;
/// Bearings at which the edge is looked at.
const BEARINGS: usize = 36;
/// Points in which the plate is looked for: every 3 mm of a scene of a square metre, and
/// where none is found in these, more: every 2 mm.
const MOST_COARSE: [usize; 2] = [110_000, 250_000];
/// Points that are used around the plate.
const MOST_NEAR: usize = 100_000;
/// Fewest bearings that make a circle.
const LEAST_EDGES: usize = 10;
/// Rings of the search for the edge: ten to a plate radius, out to 2.2 radii.
const RINGS_PER_RADIUS: f64 = 10.0;
const RINGS: usize = 22;
/// Relative error of the radius beyond which it is not the plate.
const RADIUS_TOLERANCE: f64 = 0.25;

/// The plate as the cloth on it shows it.
#[derive(Clone, Debug)]
pub(super) struct Plate {
    /// Centre of the flat disc, on the cloth's surface [m].
    pub centre: Point3,
    /// Up: the disc's normal, away from where the cloth hangs.
    pub up: UnitVector3<f64>,
    /// Radius at which the cloth leaves the plane [m].
    pub radius_m: f64,
    /// Scatter of that radius over the bearings [m].
    pub radius_scatter_m: f64,
    /// Robust standard deviation of the raw points about the disc's plane [m].
    pub noise_m: f64,
    /// Standard error of the centre in the plane, per axis [m].
    pub centre_sigma_m: f64,
    /// Standard error of the disc's tilt [rad].
    pub tilt_sigma_rad: f64,
}

/// Mean, normal (smallest axis) and the three variances of points.
pub(super) fn principal(
    points: impl Iterator<Item = Point3> + Clone,
) -> Option<(Point3, Vector3, [f64; 3])> {
    let count = points.clone().count();
    if count < 3 {
        return None;
    }
    let mean = points.clone().fold(Vector3::zeros(), |s, p| s + p.coords) / count as f64;
    let covariance = points.fold(Matrix3::zeros(), |m, p| {
        let d = p.coords - mean;
        m + d * d.transpose()
    }) / count as f64;
    let eigen = SymmetricEigen::new(covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let normal = eigen.eigenvectors.column(order[0]).into_owned();
    Some((Point3::from(mean), normal, order.map(|k| eigen.eigenvalues[k].max(0.0))))
}

struct Candidate {
    centre: Point3,
    normal: Vector3,
    falling: f64,
    radius_m: f64,
}

/// Finds the plate in a scene of points \[m\].
pub(super) fn find(points: &[Point3], radius_m: f64, unit: LengthUnit) -> Result<Plate, ScanError> {
    let is_plate = |c: &Candidate| {
        c.falling >= FALLING_LIMIT && (c.radius_m / radius_m - 1.0).abs() <= 2.0 * RADIUS_TOLERANCE
    };
    let [few, more] = MOST_COARSE;
    let mut best = best_candidate(points, radius_m, few);
    if points.len() > few && !best.as_ref().is_some_and(is_plate) {
        best = best_candidate(points, radius_m, more);
    }
    let refuse = |best: Option<&Candidate>| ScanError::NoPlate {
        best: best.map(|c| PlateCandidate {
            radius_m: c.radius_m,
            falling: c.falling,
            centre: c.centre,
            up: c.normal,
        }),
        radius_m,
        falling_limit: FALLING_LIMIT,
        unit,
    };
    let best = best.ok_or_else(|| refuse(None))?;
    if !is_plate(&best) {
        return Err(refuse(Some(&best)));
    }
    let plate = refine(points, &best, radius_m).ok_or(ScanError::NoPlateEdge {
        least: LEAST_EDGES,
        bearings: BEARINGS,
        radius_m,
    })?;
    // Where stiff cloth falls away slowly, noise hides the edge: its scatter counts.
    let sigma_m = plate.radius_scatter_m / (BEARINGS as f64 / 4.0).sqrt();
    if (plate.radius_m - radius_m).abs() > RADIUS_TOLERANCE * radius_m + 2.0 * sigma_m {
        let found = Candidate { radius_m: plate.radius_m, ..best };
        return Err(refuse(Some(&found)));
    }
    Ok(plate)
}

/// The flat disc that looks most like a plate of this radius, among `most` of the points.
fn best_candidate(points: &[Point3], radius_m: f64, most: usize) -> Option<Candidate> {
    let stride = points.len().div_ceil(most);
    let some: Vec<Point3> = points.iter().step_by(stride).copied().collect();
    let coarse = voxel_downsample(&some, None, radius_m * 0.1).points;
    let tree = Neighbours::new(&coarse);
    let seeds = voxel_downsample(&coarse, None, radius_m * 0.4).points;
    let candidates: Vec<Candidate> =
        seeds.par_iter().filter_map(|seed| candidate(seed, &coarse, &tree, radius_m)).collect();
    let score = |c: &Candidate| c.falling - 2.0 * (c.radius_m / radius_m - 1.0).abs();
    candidates.into_iter().max_by(|a, b| score(a).total_cmp(&score(b)))
}

/// Looks for a flat disc around `seed`: moves to the middle of the flat patch,
/// then asks on which bearings the surface falls away from it.
fn candidate(
    seed: &Point3,
    points: &[Point3],
    tree: &Neighbours,
    radius_m: f64,
) -> Option<Candidate> {
    let mut centre = *seed;
    let mut normal = Vector3::zeros();
    for step in 0..6 {
        let near = tree.within(&centre, radius_m * PATCH_RADII);
        let (mean, axis, variances) = principal(near.iter().map(|&i| points[i]))?;
        // A filled disc of radius q has variances q^2 / 4 in its plane.
        let filled = variances[1] > 0.3 * (radius_m * PATCH_RADII).powi(2) / 4.0;
        if !filled || flatness(&near, points, &mean, &axis) > FLAT_RMS_M {
            return None;
        }
        normal = axis;
        if step == 5 {
            break;
        }
        let wide = tree.within(&mean, radius_m * 1.5);
        let level = wide
            .iter()
            .filter(|&&i| (points[i] - mean).dot(&axis).abs() < 1.5 * FLAT_RMS_M)
            .count();
        if level as f64 > MOST_LEVEL * wide.len() as f64 {
            return None; // a table: as flat as wide
        }
        let flat = wide
            .iter()
            .map(|&i| points[i])
            .filter(|p| (p - mean).dot(&axis).abs() < 1.5 * FLAT_RMS_M);
        let (flat_mean, ..) = principal(flat)?;
        centre = flat_mean - axis * (flat_mean - mean).dot(&axis);
    }
    let wide = tree.within(&centre, radius_m * 2.2);
    [normal, -normal]
        .into_iter()
        .map(|up| {
            let (falling, radius) =
                falling_edge(&centre, &up, wide.iter().map(|&i| points[i]), radius_m);
            Candidate { centre, normal: up, falling, radius_m: radius }
        })
        .max_by(|a, b| a.falling.total_cmp(&b.falling))
}

/// Robust scatter of points about a plane.
fn flatness(near: &[usize], points: &[Point3], mean: &Point3, axis: &Vector3) -> f64 {
    let heights: Vec<f64> = near.iter().map(|&i| (points[i] - mean).dot(axis)).collect();
    robust::sigma(&heights).unwrap_or(f64::INFINITY)
}

/// Two axes that make `(u, up, v)` right-handed with v = u x up.
pub(super) fn horizontal_axes(up: &Vector3, hint: &Vector3) -> (Vector3, Vector3) {
    let flat = |v: &Vector3| v - up * v.dot(up);
    let u = [*hint, Vector3::x(), Vector3::y(), Vector3::z()]
        .iter()
        .map(flat)
        .find(|v| v.norm() > 0.5)
        .unwrap_or_else(|| flat(&Vector3::x()))
        .normalize();
    (u, u.cross(up))
}

/// Share of the bearings on which the surface leaves the plane downwards before
/// 1.8 radii and nothing stays up there, and the median radius of leaving.
fn falling_edge(
    centre: &Point3,
    up: &Vector3,
    points: impl Iterator<Item = Point3>,
    radius_m: f64,
) -> (f64, f64) {
    let (u, v) = horizontal_axes(up, &Vector3::x());
    let drop = 0.08 * radius_m;
    // Per bearing and ring: points that are level, and points below.
    let mut rings = vec![[[0_u32; 2]; RINGS]; BEARINGS];
    for p in points {
        let d = p - centre;
        let (x, z, height) = (d.dot(&u), d.dot(&v), d.dot(up));
        let ring = ((x * x + z * z).sqrt() / radius_m * RINGS_PER_RADIUS) as usize;
        if ring < RINGS && height < drop {
            let sector = (z.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0) * BEARINGS as f64;
            rings[(sector as usize).min(BEARINGS - 1)][ring][usize::from(height < -drop)] += 1;
        } else if ring < RINGS && height < 10.0 * drop {
            // What rises counts as level: it does not fall away.
            let sector = (z.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0) * BEARINGS as f64;
            rings[(sector as usize).min(BEARINGS - 1)][ring][0] += 1;
        }
    }
    let edges: Vec<f64> = rings.iter().filter_map(sector_edge).map(|r| r * radius_m).collect();
    let radius = robust::median(edges.clone()).unwrap_or(0.0);
    (edges.len() as f64 / BEARINGS as f64, radius)
}

/// Where one bearing's surface leaves the plane, in plate radii: level up to
/// there, and nearly nothing level beyond.
fn sector_edge(rings: &[[u32; 2]; RINGS]) -> Option<f64> {
    let level_until = |r: usize| rings[..r].iter().map(|c| c[0]).sum::<u32>();
    let below_until = |r: usize| rings[..r].iter().map(|c| c[1]).sum::<u32>();
    let all = (level_until(RINGS), below_until(RINGS));
    // The split with the fewest points on the wrong side.
    let wrong = |r: usize| below_until(r) + all.0 - level_until(r);
    let split = (1..RINGS).min_by_key(|&r| wrong(r))?;
    let (level, below) = (level_until(split), all.1 - below_until(split));
    let clear = f64::from(wrong(split)) < 0.15 * f64::from(level + below);
    (clear && level >= 4 && below >= 3 && split < RINGS - 1)
        .then_some(split as f64 / RINGS_PER_RADIUS)
}

/// Plane from the inner disc's raw points, then the circle through the edges.
fn refine(points: &[Point3], rough: &Candidate, radius_m: f64) -> Option<Plate> {
    let mut centre = rough.centre;
    let mut up = rough.normal;
    let mut noise_m = FLAT_RMS_M;
    let mut circle = (0.0, 0.0);
    let mut inner = 0.0;
    let around = || points.iter().copied().filter(|p| (p - centre).norm() < radius_m * 2.2);
    let stride = around().count().div_ceil(MOST_NEAR).max(1);
    let near: Vec<Point3> = around().step_by(stride).collect();
    for _ in 0..6 {
        let disc = |p: &&Point3| {
            let d = **p - centre;
            (d - up * d.dot(&up)).norm() < 0.8 * radius_m
                && d.dot(&up).abs() < (3.0 * noise_m).max(0.3e-3)
        };
        let (mean, axis, variances) = principal(near.iter().filter(disc).copied())?;
        let count = near.iter().filter(disc).count() as f64;
        up = if axis.dot(&up) < 0.0 { -axis } else { axis };
        centre -= up * (centre - mean).dot(&up);
        let heights: Vec<f64> = near
            .iter()
            .map(|p| p - centre)
            .filter(|d| {
                (d - up * d.dot(&up)).norm() < 0.8 * radius_m && d.dot(&up).abs() < 0.2 * radius_m
            })
            .map(|d| d.dot(&up))
            .collect();
        noise_m = robust::sigma(&heights)?;
        inner = variances[0].sqrt() / (0.4 * radius_m) / count.sqrt();
        let (u, v) = horizontal_axes(&up, &Vector3::x());
        let edges = leaving_edges(&near, &centre, &up, &u, &v, radius_m, noise_m);
        let (shift, radius, scatter) = circle_through(&edges)?;
        centre += u * shift[0] + v * shift[1];
        circle = (radius, scatter);
    }
    let (u, v) = horizontal_axes(&up, &Vector3::x());
    Some(Plate {
        centre,
        up: UnitVector3::new_normalize(up),
        radius_m: circle.0,
        radius_scatter_m: circle.1,
        // Each bearing tells one direction; edges of the same fold go together.
        centre_sigma_m: circle.1 / (BEARINGS as f64 / 4.0).sqrt() * 0.5,
        noise_m: noise_over_arch(&near, &centre, [&u, &v, &up], radius_m).unwrap_or(noise_m),
        tilt_sigma_rad: inner,
    })
}

/// Robust scatter of the points on the plate about a quartic surface: stiff cloth
/// arches over the plate, which is not noise.
fn noise_over_arch(
    near: &[Point3],
    centre: &Point3,
    [u, v, up]: [&Vector3; 3],
    radius_m: f64,
) -> Option<f64> {
    const TERMS: usize = 15;
    let powers = (0..=4).flat_map(|degree| (0..=degree).map(move |k| (degree - k, k)));
    let powers: Vec<(i32, i32)> = powers.collect();
    let rows: Vec<(SVector<f64, TERMS>, f64)> = near
        .iter()
        .map(|p| (p - centre) / radius_m)
        .filter(|d| (d - up * d.dot(up)).norm() < 0.8 && d.dot(up).abs() < 0.2)
        .map(|d| {
            let (x, z) = (d.dot(u), d.dot(v));
            let row = SVector::from_fn(|k, _| x.powi(powers[k].0) * z.powi(powers[k].1));
            (row, d.dot(up) * radius_m)
        })
        .collect();
    let mut found = SVector::<f64, TERMS>::zeros();
    let mut scatter_m = f64::INFINITY;
    for _ in 0..3 {
        let mut normal = SMatrix::<f64, TERMS, TERMS>::identity() * 1e-9;
        let mut right = SVector::<f64, TERMS>::zeros();
        for (row, height) in &rows {
            let off = (height - row.dot(&found)).abs();
            let weight = (1.5 * scatter_m / off.max(1e-9)).min(1.0);
            normal += row * row.transpose() * weight;
            right += row * (weight * height);
        }
        found = normal.cholesky()?.solve(&right);
        let off: Vec<f64> = rows.iter().map(|(row, height)| height - row.dot(&found)).collect();
        scatter_m = robust::sigma(&off)?.max(1e-6);
    }
    Some(scatter_m)
}

/// Where the cloth leaves the plane, per bearing, in the plane's axes.
fn leaving_edges(
    near: &[Point3],
    centre: &Point3,
    up: &Vector3,
    u: &Vector3,
    v: &Vector3,
    radius_m: f64,
    noise_m: f64,
) -> Vec<[f64; 2]> {
    // The slope of sqrt(depth) is read between these depths: above the noise,
    // and not so deep that the curvature has changed.
    let depths = [(0.02 * radius_m).max(2.5 * noise_m), (0.16 * radius_m).max(5.0 * noise_m)];
    let mut sectors: Vec<Vec<[f64; 2]>> = vec![Vec::new(); BEARINGS];
    for p in near {
        let d = p - centre;
        let (x, z, depth) = (d.dot(u), d.dot(v), -d.dot(up));
        if depth > depths[0] && depth < depths[1] {
            let sector = (z.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0) * BEARINGS as f64;
            sectors[(sector as usize).min(BEARINGS - 1)].push([x.hypot(z), depth.sqrt()]);
        }
    }
    let mut edges = Vec::new();
    for (sector, samples) in sectors.iter().enumerate() {
        if samples.len() < 6 {
            continue;
        }
        // r = edge + slope * sqrt(depth): the radius is the noisy one where the
        // cloth is steep, so it is regressed on the depth.
        let n = samples.len() as f64;
        let mean = |k: usize| samples.iter().map(|s| s[k]).sum::<f64>() / n;
        let (r, q) = (mean(0), mean(1));
        let (sqq, sqr) = samples.iter().fold((0.0, 0.0), |(a, b), s| {
            (a + (s[1] - q) * (s[1] - q), b + (s[1] - q) * (s[0] - r))
        });
        let edge = r - q * (sqr / sqq.max(1e-12)).max(0.0);
        if edge > 0.5 * radius_m && edge < 1.6 * radius_m {
            let angle = (sector as f64 + 0.5) / BEARINGS as f64 * std::f64::consts::TAU;
            edges.push([edge * angle.cos(), edge * angle.sin()]);
        }
    }
    edges
}

/// Circle through points, robust: centre, radius, scatter of the radii.
fn circle_through(points: &[[f64; 2]]) -> Option<([f64; 2], f64, f64)> {
    if points.len() < LEAST_EDGES {
        return None;
    }
    let mut centre = [0.0, 0.0];
    let mut radius = 0.0;
    let mut scatter = 0.0;
    for _ in 0..30 {
        let polar: Vec<[f64; 2]> = points
            .iter()
            .map(|p| {
                let (x, z) = (p[0] - centre[0], p[1] - centre[1]);
                [x.hypot(z), z.atan2(x)]
            })
            .collect();
        let radii: Vec<f64> = polar.iter().map(|p| p[0]).collect();
        radius = robust::median(radii.clone())?;
        scatter = robust::sigma(&radii)?.max(1e-5);
        // Gauss-Newton on the centre with Huber weights; the radius is the median.
        let mut normal = [[1e-12, 0.0], [0.0, 1e-12]];
        let mut right = [0.0, 0.0];
        for p in &polar {
            let residual = p[0] - radius;
            let weight = (1.5 * scatter / residual.abs().max(1e-9)).min(1.0);
            let direction = [p[1].cos(), p[1].sin()];
            for a in 0..2 {
                right[a] += weight * direction[a] * residual;
                for b in 0..2 {
                    normal[a][b] += weight * direction[a] * direction[b];
                }
            }
        }
        let det = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
        centre[0] += (right[0] * normal[1][1] - right[1] * normal[0][1]) / det;
        centre[1] += (right[1] * normal[0][0] - right[0] * normal[1][0]) / det;
    }
    Some((centre, radius, scatter))
}

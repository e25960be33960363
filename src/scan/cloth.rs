//! The cloth alone: floor, pedestal and background cut away, strays dropped, the
//! layer of noisy points drawn onto a surface without moving its free edge.
//!
//! In: points in the local frame (origin at the plate's centre, y up) \[m\]. Out:
//! the cloth's points as scanned, and thinned surface points with normals.
//!
//! Smoothing moves points along the surface's normal only (moving least squares
//! with a quadric, Alexa et al. 2003), so that the free edge stays where it is;
//! averaging in cells shifts it by less than a quarter of a cell, and the edge is
//! measured on the raw points anyway (`edge`).

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::neighbours::Neighbours;
use super::options::ScanOptions;
use super::plate::{Plate, horizontal_axes, principal};
use super::thin::{Thinned, thin};
use crate::base::clock::Stages;
use crate::base::{Isometry3, Point3, Vector3};
use crate::numeric::robust;

/// The cloth's points, local frame \[m\].
pub(super) struct Cloth {
    /// As scanned, after the cuts.
    pub raw: Vec<Point3>,
    /// Smoothed surface points, about `spacing_m` apart.
    pub surface: Vec<Point3>,
    /// Unit normals of the surface points, sign arbitrary.
    pub normals: Vec<Vector3>,
    /// How badly each point's neighbourhood fits one smooth layer: 1 is usual,
    /// several where two layers touch or cross.
    pub disorder: Vec<f64>,
    /// Distance between surface points \[m\].
    pub spacing_m: f64,
    /// Typical distance between raw neighbours \[m\].
    pub raw_spacing_m: f64,
}

/// The floor below the drape, local frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    /// Height at the origin \[m\], negative.
    pub height_m: f64,
    /// Normal, upwards.
    pub normal: Vector3,
    /// Root mean square of the points about it \[m\].
    pub rms_m: f64,
}

/// Depth under the plate's top within which nothing but the plate is expected
/// inside its edge [m].
const UNDERSIDE_M: f64 = 15e-3;

/// Points in which the floor is looked for.
const MOST_FLOOR: usize = 250_000;
/// Points from which the surface is made: over ten in a cell of [`CELL_M`].
const MOST_SURFACE: usize = 350_000;

/// Cell of the thinned cloth \[m\]: resolves folds of 4 mm radius.
const CELL_M: f64 = 2.0e-3;

/// The lowest large level plane: the best of consensus planes through a few
/// points, among points lower than any cloth can hang high. The points are the
/// scan's, the plane is in the local frame.
pub(super) fn find_floor(
    points: &[Point3],
    local_from_scan: &Isometry3,
    options: &ScanOptions,
    noise_m: f64,
) -> Option<Floor> {
    let half = 0.5 * options.specimen_side_m;
    let stride = points.len().div_ceil(MOST_FLOOR);
    let low: Vec<Point3> = points
        .iter()
        .step_by(stride)
        .map(|p| local_from_scan * p)
        .filter(|p| p.y < -0.3 * half && p.y > -10.0 * half)
        .collect();
    let low = thin(&low, None, 6e-3).points;
    if low.len() < 300 {
        return None;
    }
    let tolerance = (2.0 * noise_m).max(2e-3);
    let mut rng = crate::base::seed::rng(options.seed, "floor", 0);
    let mut pick = || low[(rand::RngExt::random::<f64>(&mut rng) * low.len() as f64) as usize];
    let mut best: (usize, Point3, Vector3) = (0, Point3::origin(), Vector3::y());
    for _ in 0..300 {
        let (a, b, c) = (pick(), pick(), pick());
        let normal = (b - a).cross(&(c - a));
        if normal.norm() < 1e-5 {
            continue;
        }
        let normal = normal.normalize() * normal.y.signum();
        if normal.y < 0.966 {
            continue; // more than 15 degrees off the plate
        }
        let count = low.iter().filter(|p| (*p - a).dot(&normal).abs() < tolerance).count();
        if count > best.0 {
            best = (count, a, normal);
        }
    }
    let (mut at, mut normal) = (best.1, best.2);
    let on = |at: &Point3, normal: &Vector3| -> Vec<Point3> {
        low.iter().copied().filter(|p| (p - at).dot(normal).abs() < 1.5 * tolerance).collect()
    };
    let mut rms_m = 0.0;
    for _ in 0..4 {
        let (mean, axis, variances) = principal(on(&at, &normal).into_iter())?;
        at = mean;
        normal = axis * axis.y.signum();
        rms_m = variances[0].sqrt();
    }
    let support = on(&at, &normal);
    // A floor is wide: cloth hanging level would be narrower than the specimen.
    let wide = support.iter().filter(|p| p.x.hypot(p.z) > half).count();
    (wide > 200 && normal.y > 0.966).then(|| Floor {
        height_m: at.y + (at.x * normal.x + at.z * normal.z) / normal.y,
        normal,
        rms_m,
    })
}

/// Cuts the scene to the cloth and draws it onto a surface.
pub(super) fn isolate(
    points: &[Point3],
    floor: Option<Floor>,
    plate: &Plate,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Cloth {
    let reach = options.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
    let noise = plate.noise_m;
    let above_floor = 5e-3 + 4.0 * noise;
    let column = column_radius(points, floor, options).map_or(0.0, |r| r + 2e-3 + 3.0 * noise);
    let under_plate = options.plate_radius_m - 3e-3 - noise;
    let inside = |p: &&Point3| {
        let radius = (p.x * p.x + p.z * p.z).sqrt();
        let over =
            floor.map_or(f64::INFINITY, |f| p.coords.dot(&f.normal) - f.height_m * f.normal.y);
        // Cloth may swing in below the plate, but not closely under it.
        let stand = p.y < -(2e-3 + 4.0 * noise)
            && (radius < column || (radius < under_plate && p.y > -UNDERSIDE_M));
        radius < 1.05 * reach
            && p.y < 10e-3 + 4.0 * noise
            && p.y > -(reach - options.plate_radius_m) * 1.12
            && over > above_floor
            && !stand
    };
    let mut raw: Vec<Point3> = points.iter().filter(inside).copied().collect();
    raw.shrink_to_fit();
    let raw_spacing_m = spacing(&raw, options);
    let cell = CELL_M.max(1.1 * raw_spacing_m);
    stages.done("cut to the cloth");
    let stride = raw.len().div_ceil(MOST_SURFACE).max(1);
    let some: Vec<Point3> = raw.iter().step_by(stride).copied().collect();
    let thinned = thin(&some, None, cell);
    drop(some);
    stages.done("voxel");
    let thinned = drop_strays(thinned, cell);
    stages.done("strays");
    let reach_m = (2.5 * cell).max(2.5 * noise + 2e-3);
    let points: Vec<Point3> = smooth(&thinned, reach_m).into_iter().map(|p| p.at).collect();
    let again = thin(&points, Some(&thinned.counts), cell);
    let smoothed = smooth(&again, reach_m);
    stages.done("smooth and normals");
    let usual = robust::median(smoothed.iter().map(|p| p.residual_m).collect()).unwrap_or(0.0);
    // Tight folds leave a residual too; crossing layers leave more than that.
    let usual = usual.max(0.08 * cell);
    Cloth {
        raw,
        surface: smoothed.iter().map(|p| p.at).collect(),
        normals: smoothed.iter().map(|p| p.normal).collect(),
        disorder: smoothed.iter().map(|p| p.residual_m / usual).collect(),
        spacing_m: cell,
        raw_spacing_m,
    }
}

/// The points of what stands under the plate: between the floor and the lowest
/// that cloth can hang, near the axis; (x, z) \[m\].
fn pedestal(points: &[Point3], floor: Option<Floor>, options: &ScanOptions) -> Vec<[f64; 2]> {
    let reach = options.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
    let lowest = -(reach - options.plate_radius_m) * 1.08;
    let bottom = floor.map_or(lowest - 0.1, |f| f.height_m + 8e-3);
    points
        .iter()
        .filter(|p| p.y < lowest && p.y > bottom)
        .map(|p| [p.x, p.z])
        .filter(|p| p[0].hypot(p[1]) < 1.2 * options.plate_radius_m)
        .collect()
}

/// Radius around the axis that the pedestal takes; `None` if nothing is seen.
fn column_radius(points: &[Point3], floor: Option<Floor>, options: &ScanOptions) -> Option<f64> {
    let radii: Vec<f64> =
        pedestal(points, floor, options).iter().map(|p| p[0].hypot(p[1])).collect();
    if radii.len() < 30 { None } else { robust::quantile(radii, 0.9) }
}

/// Typical distance between points: the side of the square that each point has
/// to itself on the plate's disc.
fn spacing(points: &[Point3], options: &ScanOptions) -> f64 {
    let radius = 0.9 * options.plate_radius_m;
    let flat = |p: &&Point3| p.y.abs() < 0.2 * radius && p.x * p.x + p.z * p.z < radius * radius;
    let count = points.iter().filter(flat).count().max(1) as f64;
    (std::f64::consts::PI / count).sqrt() * radius
}

/// Statistical outlier removal on thinned points: those whose neighbours are
/// clearly farther than usual, or that stand for far fewer points.
fn drop_strays(thinned: Thinned, cell: f64) -> Thinned {
    let tree = Neighbours::new(&thinned.points);
    let measure: Vec<(f64, f64)> = thinned
        .points
        .par_iter()
        .map(|p| {
            let near = tree.nearest(p, 10);
            let mean = near.iter().map(|n| n.1.sqrt()).sum::<f64>() / near.len().max(1) as f64;
            let weight =
                near.iter().map(|n| thinned.counts[n.0]).sum::<f64>() / near.len().max(1) as f64;
            (mean, weight)
        })
        .collect();
    let usual = robust::median(measure.iter().map(|m| m.0).collect()).unwrap_or(cell);
    let usual_weight = robust::median(measure.iter().map(|m| m.1).collect()).unwrap_or(1.0);
    let keep = |m: &(f64, f64)| m.0 < 2.2 * usual.max(cell) && m.1 > 0.08 * usual_weight;
    let mut out = Thinned::default();
    for (i, m) in measure.iter().enumerate() {
        if keep(m) {
            out.points.push(thinned.points[i]);
            out.counts.push(thinned.counts[i]);
        }
    }
    out
}

/// A point drawn onto the surface through its neighbours.
struct Smoothed {
    at: Point3,
    normal: Vector3,
    /// Root mean square distance of the neighbours to the local quadric [m].
    residual_m: f64,
}

/// Moves each point along its normal onto the quadric through its neighbours
/// within `reach_m`.
fn smooth(thinned: &Thinned, reach_m: f64) -> Vec<Smoothed> {
    let tree = Neighbours::new(&thinned.points);
    thinned
        .points
        .par_iter()
        .map(|p| {
            let near = tree.within(p, reach_m);
            project(p, &near, thinned, reach_m)
        })
        .collect()
}

/// One projection: plane by principal axes, then z = quadric(x, y) over it.
fn project(p: &Point3, near: &[usize], thinned: &Thinned, reach_m: f64) -> Smoothed {
    let lost = |normal| Smoothed { at: *p, normal, residual_m: reach_m };
    let Some((_, normal, _)) = principal(near.iter().map(|&i| thinned.points[i])) else {
        return lost(Vector3::y());
    };
    let hint = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let (a, b) = horizontal_axes(&normal, &hint);
    let mut matrix = Matrix6::<f64>::zeros();
    let mut right = Vector6::<f64>::zeros();
    let mut square = 0.0;
    for &i in near {
        let d = (thinned.points[i] - p) / reach_m;
        let (x, y, z) = (d.dot(&a), d.dot(&b), d.dot(&normal));
        let weight = thinned.counts[i].sqrt() * (-2.0 * d.norm_squared()).exp();
        let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
        matrix += row * row.transpose() * weight;
        right += row * (z * weight);
        square += z * z * weight;
    }
    // A slight pull towards the plane keeps thin neighbourhoods from running off.
    let scale = matrix[(0, 0)];
    let plain = matrix;
    for k in 1..6 {
        matrix[(k, k)] += 1e-3 * scale;
    }
    let Some(q) = matrix.cholesky().map(|c| c.solve(&right)) else { return lost(normal) };
    let residual = (square - 2.0 * q.dot(&right) + q.dot(&(plain * q))).max(0.0) / scale;
    Smoothed {
        at: p + normal * (q[0] * reach_m),
        normal: (normal - a * q[1] - b * q[2]).normalize(),
        residual_m: residual.sqrt() * reach_m,
    }
}

//! The cloth alone: floor, pedestal and background cut away, strays dropped, the
//! layer of noisy points smoothed to a surface without moving its free edge.
//!
//! In: points in the local frame (origin at the plate's centre, y up) \[m\]. Out:
//! the cloth's points as scanned, and downsampled surface points with normals.
//!
//! Smoothing moves points along the surface's normal only (moving least squares
//! with a quadric, Alexa et al. 2003), so that the free edge stays where it is;
//! averaging about centres shifts it by less than a quarter of a cell, and the edge is
//! measured on the raw points anyway (`edge`).

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::downsample::{Downsampled, cluster};
use super::floor::Floor;
use super::options::ScanOptions;
use super::plane::{horizontal_axes, principal};
use super::plate::{Placed, Plate, Skirt};
use super::tuning::ClothTuning;
use crate::base::clock::Stages;
use crate::base::{Point3, Vector3};
use crate::geom::{Neighbour, Neighbours};
use crate::numeric::robust;

/// The cloth's points, local frame \[m\].
pub(super) struct Cloth {
    /// Points after the cuts.
    pub count: usize,
    /// Those, as scanned, of very many a part, until the sheet is registered to them.
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

/// Cuts the scene to the cloth and smooths it to a surface.
pub(super) fn isolate(
    points: &[Point3],
    floor: Option<Floor>,
    plate: &Plate,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Cloth {
    let (raw, raw_spacing_m) = stages.span("cut to the cloth", || {
        let raw = cut(points, floor, plate, options);
        let raw_spacing_m = spacing(&raw, options);
        (raw, raw_spacing_m)
    });
    let tuning = &options.tuning.cloth;
    let cell = cell_m(raw_spacing_m, tuning);
    let count = raw.len();
    let stride = count.div_ceil(tuning.most_points).max(1);
    let raw: Vec<Point3> = raw.into_iter().step_by(stride).collect();
    let downsampled = stages.span("clusters", || cluster(&raw, None, tuning.apart_cells * cell));
    let downsampled = stages.span("strays", || drop_strays(downsampled, cell, tuning));
    stages.span("smooth and normals", || {
        let smoothed = smooth_twice(&downsampled, cell, plate.noise_m, tuning);
        let usual = robust::median(smoothed.iter().map(|p| p.residual_m).collect()).unwrap_or(0.0);
        // Tight folds leave a residual too; crossing layers leave more than that.
        let usual = usual.max(tuning.usual_residual_cells * cell);
        Cloth {
            count,
            raw,
            surface: smoothed.iter().map(|p| p.at).collect(),
            normals: smoothed.iter().map(|p| p.normal).collect(),
            disorder: smoothed.iter().map(|p| p.residual_m / usual).collect(),
            spacing_m: cell,
            raw_spacing_m,
        }
    })
}

/// Distance between surface points: in steps, so that what hardly changes the raw points' distance
/// does not change it.
fn cell_m(raw_spacing_m: f64, tuning: &ClothTuning) -> f64 {
    /// Ratio of a step to the next.
    const STEP: f64 = 1.05;
    let over = tuning.cell_spacings * raw_spacing_m / tuning.cell_m;
    tuning.cell_m * STEP.powf((over.ln() / STEP.ln()).ceil().max(0.0))
}

/// The points that may be cloth: not floor, not pedestal, not farther than it reaches.
fn cut(
    points: &[Point3],
    floor: Option<Floor>,
    plate: &Plate,
    options: &ScanOptions,
) -> Vec<Point3> {
    let tuning = &options.tuning.cloth;
    let reach = options.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
    let noise = plate.noise_m;
    let clear = tuning.clear_noises * noise;
    let above_floor = tuning.above_floor_m + clear;
    let column = column_radius(points, floor, options)
        .map_or(0.0, |r| r + tuning.column_m + tuning.column_noises * noise);
    let under_plate = options.plate_radius_m - tuning.inside_plate_m - noise;
    let highest = tuning.rise_m + clear;
    let clear_below = -(tuning.below_top_m + clear);
    let near_top = |p: &Point3| p.y > -tuning.under_plate_m;
    // Who sees the plate's side sees its underside too, around the column if there is one. The side
    // is told from cloth that hangs down along it by the cloth farther out; where folds go in,
    // that may be another fold's. Along a column as wide as the plate none can.
    let ring = column..under_plate;
    let (mut on, mut under) = (0_usize, 0_usize);
    for p in points.iter().filter(|p| p.y < highest && near_top(p)) {
        if ring.contains(&p.x.hypot(p.z)) {
            *(if p.y < clear_below { &mut under } else { &mut on }) += 1;
        }
    }
    let sees_underside = column > tuning.wide_column * options.plate_radius_m
        || under as f64 > tuning.underside_share * on as f64;
    let side = options.plate_radius_m + tuning.beside_plate_m + noise;
    let placed = |p: &Point3| Placed { xz_m: [p.x, p.z], height_m: p.y };
    let low = points.iter().filter(|p| sees_underside && p.y < highest).map(placed);
    let plate_tuning = &options.tuning.plate;
    let skirt = Skirt::new(low, options.plate_radius_m, plate_tuning);
    let higher = plate_tuning.outside_higher_m + plate_tuning.outside_noises * noise;
    let inside = |p: &&Point3| {
        let radius = (p.x * p.x + p.z * p.z).sqrt();
        let over =
            floor.map_or(f64::INFINITY, |f| p.coords.dot(&f.normal) - f.height_m * f.normal.y);
        // Cloth may swing in below the plate, but not closely under it.
        let stand = p.y < clear_below
            && (radius < column
                || (radius < under_plate && near_top(p))
                || (radius < side && near_top(p) && skirt.is_higher_outside(&placed(p), higher)));
        radius < tuning.reach * reach
            && p.y < highest
            && p.y > -(reach - options.plate_radius_m) * tuning.hang
            && over > above_floor
            && !stand
    };
    let mut raw: Vec<Point3> = points.iter().filter(inside).copied().collect();
    raw.shrink_to_fit();
    raw
}

/// Smooths downsampled points, downsamples what has moved together, and smooths again.
fn smooth_twice(
    downsampled: &Downsampled,
    cell: f64,
    noise_m: f64,
    tuning: &ClothTuning,
) -> Vec<Smoothed> {
    let least_m = tuning.smooth_noises * noise_m + tuning.smooth_m;
    let reach_m = (tuning.smooth_cells * cell).max(least_m);
    let points: Vec<Point3> =
        smooth(downsampled, reach_m, tuning).into_iter().map(|p| p.at).collect();
    let again = cluster(&points, Some(&downsampled.counts), tuning.apart_cells * cell);
    smooth(&again, reach_m, tuning)
}

/// Radius around the axis that the pedestal takes, which stands under the plate below the lowest
/// that cloth can hang; `None` if nothing is seen. The median over heights at which as many points
/// lie as on a wall of that radius: a floor that was not told for one has many more, strays have
/// far fewer.
fn column_radius(points: &[Point3], floor: Option<Floor>, options: &ScanOptions) -> Option<f64> {
    let tuning = &options.tuning.cloth;
    let reach = options.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
    let lowest = -(reach - options.plate_radius_m) * 1.08;
    let bottom = floor.map_or(lowest - 0.1, |f| f.height_m + 8e-3);
    let slices = ((lowest - bottom) / tuning.slice_m).ceil().max(1.0) as usize;
    let mut radii: Vec<Vec<f64>> = vec![Vec::new(); slices];
    for p in points.iter().filter(|p| p.y < lowest && p.y > bottom) {
        let radius = p.x.hypot(p.z);
        if radius < 1.2 * options.plate_radius_m {
            let slice = ((lowest - p.y) / tuning.slice_m) as usize;
            radii[slice.min(slices - 1)].push(radius);
        }
    }
    if radii.iter().map(Vec::len).sum::<usize>() < 30 {
        return None;
    }
    let point_m2 = spacing(points, options).powi(2);
    let [least, most] = tuning.wall_shares;
    let of_walls = radii.into_iter().filter_map(|radii| {
        let seen_m2 = radii.len() as f64 * point_m2;
        let radius_m = robust::quantile(radii, 0.9)?;
        let wall_m2 = std::f64::consts::TAU * radius_m * tuning.slice_m;
        (least * wall_m2..most * wall_m2).contains(&seen_m2).then_some(radius_m)
    });
    robust::median(of_walls.collect())
}

/// Typical distance between points: the side of the square that each point has
/// to itself on what is seen of the plate's disc.
fn spacing(points: &[Point3], options: &ScanOptions) -> f64 {
    /// Parts of the disc, of which those are not seen that have this share of what the fullest has.
    const SECTORS: usize = 24;
    const UNSEEN: f64 = 0.05;
    let radius = 0.9 * options.plate_radius_m;
    let flat = |p: &&Point3| p.y.abs() < 0.2 * radius && p.x * p.x + p.z * p.z < radius * radius;
    let mut counts = [0_usize; SECTORS];
    for p in points.iter().filter(flat) {
        let turn = 0.5 + p.z.atan2(p.x) / std::f64::consts::TAU;
        counts[(turn * SECTORS as f64) as usize % SECTORS] += 1;
    }
    let most = counts.into_iter().max().unwrap_or(0) as f64;
    let seen = counts.iter().filter(|&&count| count as f64 > UNSEEN * most).count();
    let count = counts.iter().sum::<usize>().max(1);
    let share = seen.max(1) as f64 / SECTORS as f64;
    (std::f64::consts::PI * share / count as f64).sqrt() * radius
}

/// Statistical outlier removal on downsampled points: those whose neighbours are
/// clearly farther than usual, or that stand for far fewer points.
fn drop_strays(downsampled: Downsampled, cell: f64, tuning: &ClothTuning) -> Downsampled {
    /// Mean distance of a point's neighbours, and how many points they stand for.
    struct Around {
        distance: f64,
        count: f64,
    }
    let tree = Neighbours::new(&downsampled.points);
    let around: Vec<Around> = downsampled
        .points
        .par_iter()
        .map(|p| {
            let near = tree.nearest(p, tuning.stray_neighbours);
            let number = near.len().max(1) as f64;
            Around {
                distance: near.iter().map(Neighbour::distance).sum::<f64>() / number,
                count: near.iter().map(|n| downsampled.counts[n.index]).sum::<f64>() / number,
            }
        })
        .collect();
    let usual = robust::median(around.iter().map(|a| a.distance).collect()).unwrap_or(cell);
    let usual_count = robust::median(around.iter().map(|a| a.count).collect()).unwrap_or(1.0);
    let keep = |a: &Around| {
        a.distance < tuning.stray_distance * usual.max(cell)
            && a.count > tuning.stray_count * usual_count
    };
    let mut out = Downsampled::default();
    for (i, _) in around.iter().enumerate().filter(|(_, a)| keep(a)) {
        out.points.push(downsampled.points[i]);
        out.counts.push(downsampled.counts[i]);
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
fn smooth(downsampled: &Downsampled, reach_m: f64, tuning: &ClothTuning) -> Vec<Smoothed> {
    let tree = Neighbours::new(&downsampled.points);
    downsampled
        .points
        .par_iter()
        .map(|p| {
            let near = tree.within(p, reach_m);
            project(p, &near, downsampled, reach_m, tuning.smooth_pull)
        })
        .collect()
}

/// One projection: plane by principal axes, then z = quadric(x, y) over it.
fn project(
    p: &Point3,
    near: &[usize],
    downsampled: &Downsampled,
    reach_m: f64,
    pull: f64,
) -> Smoothed {
    let lost = |normal| Smoothed { at: *p, normal, residual_m: reach_m };
    let Some((_, normal, _)) = principal(near.iter().map(|&i| downsampled.points[i])) else {
        return lost(Vector3::y());
    };
    let hint = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let (a, b) = horizontal_axes(&normal, &hint);
    let mut matrix = Matrix6::<f64>::zeros();
    let mut right = Vector6::<f64>::zeros();
    let mut square = 0.0;
    for &i in near {
        let d = (downsampled.points[i] - p) / reach_m;
        let (x, y, z) = (d.dot(&a), d.dot(&b), d.dot(&normal));
        let weight = downsampled.counts[i].sqrt() * (-2.0 * d.norm_squared()).exp();
        let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
        matrix += row * row.transpose() * weight;
        right += row * (z * weight);
        square += z * z * weight;
    }
    // A slight pull towards the plane keeps thin neighbourhoods from running off.
    let scale = matrix[(0, 0)];
    let plain = matrix;
    for k in 1..6 {
        matrix[(k, k)] += pull * scale;
    }
    let Some(q) = matrix.cholesky().map(|c| c.solve(&right)) else { return lost(normal) };
    let residual = (square - 2.0 * q.dot(&right) + q.dot(&(plain * q))).max(0.0) / scale;
    Smoothed {
        at: p + normal * (q[0] * reach_m),
        normal: (normal - a * q[1] - b * q[2]).normalize(),
        residual_m: residual.sqrt() * reach_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_strays_nor_a_floor_that_was_not_told_for_one_widen_a_column() {
        let disc = |height_m: f64, radius_m: f64| {
            let at = |k: usize| [k / 121, k % 121].map(|i| 1e-3 * i as f64 - 0.06);
            let inside = move |[x, z]: &[f64; 2]| x.hypot(*z) < radius_m;
            (0..121 * 121).map(at).filter(inside).map(move |[x, z]| Point3::new(x, height_m, z))
        };
        let around = |k: usize, radius_m: f64, height_m: f64| {
            let (sin, cos) = (0.2 * k as f64).sin_cos();
            Point3::new(radius_m * cos, height_m, radius_m * sin)
        };
        let post = (0..31 * 20).map(|k| around(k, 5e-3, -0.1752 - 1e-3 * (k / 31) as f64));
        let strays = (0..40).map(|k| around(k, 0.05, -0.2 - 1.8e-3 * k as f64));
        let points: Vec<Point3> =
            disc(0.0, 0.05).chain(post).chain(disc(-0.197, 0.06)).chain(strays).collect();
        let radius_m = column_radius(&points, None, &ScanOptions::default()).unwrap();
        assert!((radius_m - 5e-3).abs() < 1e-3, "{radius_m}");
    }
}

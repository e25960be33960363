//! The floor below the drape, which tells gravity better than the plate does.
//!
//! In: points of the scene and a frame whose origin is the plate's centre \[m\]. Out: the
//! plane of the floor, if one is seen. The search is a consensus over planes through three
//! points (Fischler and Bolles 1981), refined by principal axes.

use super::downsample::voxel_downsample;
use super::options::ScanOptions;
use super::plane::principal;
use crate::base::frame::SPECIMEN_SIDE_M;
use crate::base::{Isometry3, Point3, Vector3};

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

/// Bearings on which a floor is looked for.
const SECTORS: usize = 12;

/// The lowest large level plane: the best of consensus planes through a few
/// points, among points lower than any cloth can hang high. The points are the
/// scan's, the plane is in the local frame.
pub(super) fn find(
    points: &[Point3],
    local_from_scan: &Isometry3,
    options: &ScanOptions,
    noise_m: f64,
) -> Option<Floor> {
    let tuning = &options.tuning.frame;
    let half = 0.5 * options.specimen_side_m;
    let stride = points.len().div_ceil(tuning.most_floor_points);
    let low: Vec<Point3> = points
        .iter()
        .step_by(stride)
        .map(|p| local_from_scan * p)
        .filter(|p| p.y < -0.3 * half && p.y > -10.0 * half)
        .collect();
    let low = voxel_downsample(&low, None, tuning.floor_cell_m).points;
    if low.len() < tuning.least_floor_cells {
        return None;
    }
    let tolerance = (tuning.on_floor_noises * noise_m).max(tuning.on_floor_m);
    let mut rng = crate::base::seed::rng(options.seed, "floor", 0);
    let mut pick = || low[(rand::RngExt::random::<f64>(&mut rng) * low.len() as f64) as usize];
    let mut best: (usize, Point3, Vector3) = (0, Point3::origin(), Vector3::y());
    for _ in 0..tuning.planes {
        let (a, b, c) = (pick(), pick(), pick());
        let normal = (b - a).cross(&(c - a));
        if normal.norm() < 1e-5 {
            continue;
        }
        let normal = normal.normalize() * normal.y.signum();
        if normal.y < tuning.least_cosine {
            continue;
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
    // A floor is wide: cloth hanging level would be narrower than the specimen. Under a
    // larger one the table need not be larger.
    let narrow_m = half.min(0.5 * SPECIMEN_SIDE_M);
    let wide = support.iter().filter(|p| p.x.hypot(p.z) > narrow_m).count();
    // It goes round the axis too, as the top of what stands beside the drape does not.
    let mut around = [false; SECTORS];
    for p in
        support.iter().filter(|p| p.x.hypot(p.z) > tuning.around_radii * options.plate_radius_m)
    {
        let share = (p.z.atan2(p.x) / std::f64::consts::TAU).rem_euclid(1.0);
        around[((share * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    let around = around.iter().filter(|seen| **seen).count();
    let is_floor = wide > tuning.least_wide_cells
        && around >= tuning.least_around
        && normal.y > tuning.least_cosine;
    is_floor.then(|| Floor {
        height_m: at.y + (at.x * normal.x + at.z * normal.z) / normal.y,
        normal,
        rms_m,
    })
}

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
    let low = voxel_downsample(&low, tuning.floor_cell_m);
    if low.len() < tuning.least_floor_cells {
        return None;
    }
    let tolerance = (tuning.on_floor_noises * noise_m).max(tuning.on_floor_m);
    let rough = consensus(&low, tolerance, options);
    let (Plane { at, normal }, rms_m) = refined(&low, rough, tolerance)?;
    let plane = Plane { at, normal };
    let support = plane.points_on(&low, 1.5 * tolerance);
    let is_floor = normal.y > tuning.least_cosine
        && is_wide(&support, options)
        && plane.covers(&low, &support, 3.0 * tolerance, options);
    is_floor.then(|| Floor {
        height_m: at.y + (at.x * normal.x + at.z * normal.z) / normal.y,
        normal,
        rms_m,
    })
}

/// A plane through a point.
#[derive(Clone, Copy)]
struct Plane {
    at: Point3,
    normal: Vector3,
}

impl Plane {
    /// Whether a point lies on it.
    fn has(&self, p: &Point3, tolerance_m: f64) -> bool {
        (p - self.at).dot(&self.normal).abs() < tolerance_m
    }

    fn points_on(&self, points: &[Point3], tolerance_m: f64) -> Vec<Point3> {
        points.iter().copied().filter(|p| self.has(p, tolerance_m)).collect()
    }

    /// Whether hardly anything is seen lower than this below it under the drape. Cloth is, where
    /// the plane goes through its folds and something beside them.
    fn covers(
        &self,
        points: &[Point3],
        support: &[Point3],
        lower_m: f64,
        options: &ScanOptions,
    ) -> bool {
        let under = |p: &&Point3| p.x.hypot(p.z) < narrow_m(options);
        let below = |p: &&Point3| (*p - self.at).dot(&self.normal) < -lower_m;
        let below = points.iter().filter(under).filter(below).count() as f64;
        below < options.tuning.frame.most_below * support.iter().filter(under).count() as f64
    }
}

/// Of level planes through three of the points the one that most lie on.
fn consensus(low: &[Point3], tolerance_m: f64, options: &ScanOptions) -> Plane {
    let tuning = &options.tuning.frame;
    let mut rng = crate::base::seed::rng(options.seed, "floor", 0);
    let mut pick = || low[(rand::RngExt::random::<f64>(&mut rng) * low.len() as f64) as usize];
    let (mut most, mut best) = (0, Plane { at: Point3::origin(), normal: Vector3::y() });
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
        let plane = Plane { at: a, normal };
        let count = low.iter().filter(|p| plane.has(p, tolerance_m)).count();
        if count > most {
            (most, best) = (count, plane);
        }
    }
    best
}

/// The plane by principal axes of the points on it, and their root mean square about it \[m\].
fn refined(low: &[Point3], mut plane: Plane, tolerance_m: f64) -> Option<(Plane, f64)> {
    let mut rms_m = 0.0;
    for _ in 0..4 {
        let on = plane.points_on(low, 1.5 * tolerance_m);
        let (mean, axis, variances) = principal(on.into_iter())?;
        plane = Plane { at: mean, normal: axis * axis.y.signum() };
        rms_m = variances[0].sqrt();
    }
    Some((plane, rms_m))
}

/// How far from the axis what hangs is narrower than a floor \[m\]: half the specimen, or half of
/// the usual one's under a larger, whose table need not be larger.
fn narrow_m(options: &ScanOptions) -> f64 {
    0.5 * options.specimen_side_m.min(SPECIMEN_SIDE_M)
}

/// Whether a plane's points are a floor's. It is wide, and it goes round the axis, as
/// the top of what stands beside the drape does not.
fn is_wide(support: &[Point3], options: &ScanOptions) -> bool {
    let tuning = &options.tuning.frame;
    let narrow_m = narrow_m(options);
    let off_m = |p: &&Point3| p.x.hypot(p.z);
    let wide = support.iter().filter(|p| off_m(p) > narrow_m).count();
    let mut around = [false; SECTORS];
    for p in support.iter().filter(|p| off_m(p) > tuning.around_radii * options.plate_radius_m) {
        let share = (p.z.atan2(p.x) / std::f64::consts::TAU).rem_euclid(1.0);
        around[((share * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    let around = around.iter().filter(|seen| **seen).count();
    wide > tuning.least_wide_cells && around >= tuning.least_around
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_through_the_cloth_and_something_beside_it_is_no_floor() {
        let options = ScanOptions::default();
        let level = |height_m: f64, from: [f64; 2], to: [f64; 2]| {
            let at = |k: usize| [(k / 200) as f64 / 200.0, (k % 200) as f64 / 200.0];
            (0..200 * 200).map(at).map(move |[u, v]| {
                let [x, z] = [(u, 0), (v, 1)].map(|(t, k)| from[k] + t * (to[k] - from[k]));
                Point3::new(x, height_m, z)
            })
        };
        // hangs from 50 to 120 mm off the axis, 100 mm deep
        let cloth = (0..60_000).map(|k| {
            let (share, (sin, cos)) = ((k % 100) as f64 / 100.0, (0.01 * f64::from(k)).sin_cos());
            let away_m = 0.05 + 0.07 * share;
            Point3::new(away_m * cos, -0.1 * share, away_m * sin)
        });
        let hand = level(-0.06, [0.16, -0.1], [0.36, 0.1]);
        let mut points: Vec<Point3> = cloth.chain(hand).collect();
        let found = |points: &[Point3]| find(points, &Isometry3::identity(), &options, 0.2e-3);
        assert!(found(&points).is_none(), "{:?}", found(&points));
        points.extend(level(-0.25, [-0.4; 2], [0.4; 2]));
        assert!((found(&points).unwrap().height_m + 0.25).abs() < 1e-3);
    }
}

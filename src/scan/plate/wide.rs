//! Planes wider than the specimen: floors, tables, walls. No drape is one, so they are left
//! out where a drape is looked for.
//!
//! In: downsampled points of a scene \[m\]. Out: which of them lie on such a plane. The search is a
//! consensus over the tangent planes of single points (Fischler and Bolles 1981), refined by
//! principal axes.

use rayon::prelude::*;

use super::super::plane::{horizontal_axes, principal};
use super::super::tuning::PlateTuning;
use crate::base::{Point3, Vector3, seed};
use crate::geom::Neighbours;
use crate::numeric::robust;

/// A plane through a point.
#[derive(Clone, Copy)]
struct Plane {
    at: Point3,
    normal: Vector3,
}

impl Plane {
    fn off_m(&self, p: &Point3) -> f64 {
        (p - self.at).dot(&self.normal).abs()
    }

    /// Whether a tangent plane is a part of it.
    fn has(&self, tangent: &Self, tuning: &PlateTuning) -> bool {
        self.off_m(&tangent.at) < tuning.on_wide_m
            && self.normal.dot(&tangent.normal).abs() > tuning.along_wide
    }
}

/// The planes of a scene.
pub(super) struct WidePlanes {
    /// Which points lie on a plane that is wider than asked for, in both directions.
    pub wide: Vec<bool>,
    /// The share of the points on the fullest plane, wide or not.
    pub fullest_share: f64,
}

/// Finds the planes that are wider than `width_m` in both directions.
pub(super) fn on_wide_planes(
    points: &[Point3],
    tree: &Neighbours,
    width_m: f64,
    run_seed: u64,
    tuning: &PlateTuning,
) -> WidePlanes {
    let mut wide = vec![false; points.len()];
    let mut fullest_share = 0.0_f64;
    // The tangent planes of some points stand for all.
    let stride = points.len().div_ceil(tuning.most_tangents).max(1);
    let tangent = |p: &Point3| {
        let near = tree.within(p, tuning.tangent_m);
        principal(near.iter().map(|&i| points[i])).map(|(at, normal, _)| Plane { at, normal })
    };
    let mut tangents: Vec<Plane> = points.par_iter().step_by(stride).filter_map(tangent).collect();
    let mut rng = seed::rng(run_seed, "wide planes", 0);
    for _ in 0..tuning.most_wide_planes {
        let Some(plane) = fullest(&tangents, &mut rng, tuning) else { break };
        let on = points.iter().filter(|p| plane.off_m(p) < tuning.on_wide_m).count();
        fullest_share = fullest_share.max(on as f64 / points.len().max(1) as f64);
        let along = tangents.iter().filter(|t| plane.has(t, tuning)).map(|t| t.at);
        if is_wide(&plane, &along.collect::<Vec<_>>(), width_m) {
            let on = points.iter().zip(&mut wide);
            let on = on.filter(|(p, _)| plane.off_m(p) < tuning.on_wide_m);
            on.for_each(|(_, wide)| *wide = true);
        }
        tangents.retain(|t| plane.off_m(&t.at) > tuning.on_wide_m);
    }
    WidePlanes { wide, fullest_share }
}

/// The plane with most tangent planes on it; `None` if few are left.
fn fullest(tangents: &[Plane], rng: &mut seed::Rng, tuning: &PlateTuning) -> Option<Plane> {
    let on = |plane: &Plane| {
        let plane = *plane;
        tangents.iter().filter(move |t| plane.has(t, tuning))
    };
    if tangents.is_empty() {
        return None;
    }
    let picks: Vec<usize> = (0..tuning.wide_trials)
        .map(|_| (rand::RngExt::random::<f64>(rng) * tangents.len() as f64) as usize)
        .collect();
    let fullest = picks.into_par_iter().map(|k| (on(&tangents[k]).count(), k)).max()?;
    let mut plane = tangents[fullest.1];
    for _ in 0..2 {
        let (at, normal, _) = principal(on(&plane).map(|t| t.at))?;
        plane = Plane { at, normal };
    }
    (fullest.0 >= tuning.least_tangents).then_some(plane)
}

/// Whether the places of tangent planes on a plane spread over more than `width_m` in all
/// directions.
fn is_wide(plane: &Plane, on: &[Point3], width_m: f64) -> bool {
    let (u, v) = horizontal_axes(&plane.normal, &Vector3::x());
    (0..DIRECTIONS).all(|k| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
        let along: Vec<f64> = on.iter().map(|p| (p - plane.at).dot(&(u * cos + v * sin))).collect();
        let at = |share| robust::quantile(along.clone(), share).unwrap_or(0.0);
        at(0.98) - at(0.02) > width_m
    })
}

/// Directions in which a plane's width is taken.
const DIRECTIONS: u32 = 12;

#[cfg(test)]
mod tests {
    use super::super::super::tuning::Tuning;
    use super::*;

    #[test]
    fn a_table_is_wide_and_a_sheet_of_the_specimens_size_is_not() {
        let grid = |half: i32, at: [f64; 3]| {
            (-half..=half).flat_map(move |i| {
                (-half..=half).map(move |k| {
                    Point3::new(f64::from(i) * 5e-3 + at[0], at[1], f64::from(k) * 5e-3 + at[2])
                })
            })
        };
        let sheet: Vec<Point3> = grid(30, [0.0, 0.2, 0.0]).collect();
        let table: Vec<Point3> = grid(50, [0.1, 0.0, 0.0]).collect();
        let points = [sheet.clone(), table].concat();
        let tree = Neighbours::new(&points);
        let planes = on_wide_planes(&points, &tree, 0.33, 0, &Tuning::default().plate);
        let wide = planes.wide;
        assert!(wide[..sheet.len()].iter().all(|w| !w));
        assert!(wide[sheet.len()..].iter().all(|w| *w));
    }
}

//! The plate: a flat disc of known radius from whose edge the cloth falls away
//! on all sides. The plate itself is hidden under the cloth; this shape of the
//! cloth on top of it gives the origin and "up" without help from the file's
//! axes, and nothing else in a scene has it (tables and floors do not fall away
//! within 90 mm all round).
//!
//! In: points of the scene \[m\], any frame. Out: the plate's centre (on the
//! cloth's surface), up, radius, noise.
//!
//! Where the scan looks from below, the plate's underside lies 4 to 8 mm under the cloth,
//! and a post or a column under that. What is known tells them apart: up is the side from
//! which nothing covers the disc, and beyond its edge the cloth falls. So of what lies above
//! each other within the edge only the uppermost layer counts (`layer`), and of what lies at
//! the edge nothing that the cloth farther out is higher than (`skirt`), both when the disc
//! is sought (`seek`) and when it is measured (`measure`). The back of a fold falls away all
//! round too: of several discs the one with the roundest edge is the plate.
//!
//! Fails where the cloth is so stiff that it hardly bends (then nothing falls away and the
//! scan is refused).

mod layer;
mod measure;
mod placed;
mod seek;
mod skirt;

pub(super) use measure::Plate;
pub(super) use placed::Placed;
pub(super) use skirt::Skirt;

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::error::{PlateCandidate, ScanError};
use super::options::ScanOptions;
use super::plane::horizontal_axes;
use super::unit::LengthUnit;
use crate::base::{Point3, Vector3};
use measure::{Measured, measure};
use seek::{Candidate, candidates};

/// Finds the plate in a scene of points \[m\].
///
/// # Errors
/// When there is no flat disc from which a surface falls away all round, its edge does not
/// show, or its radius is another.
pub(super) fn find(
    points: &[Point3],
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<Plate, ScanError> {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let is_plate = |c: &Candidate| {
        c.falling >= tuning.falling_limit
            && (c.radius_m / radius_m - 1.0).abs() <= 2.0 * tuning.radius_tolerance
    };
    let [few, more] = tuning.most_coarse;
    let mut found = candidates(points, radius_m, few, tuning);
    if points.len() > few && !found.iter().any(is_plate) {
        found = candidates(points, radius_m, more, tuning);
    }
    let refuse = |best: Option<PlateCandidate>, falling_limit: f64| ScanError::NoPlate {
        best,
        radius_m,
        falling_limit,
        unit,
    };
    let shown = |c: &Candidate| PlateCandidate {
        radius_m: c.radius_m,
        falling: c.falling,
        centre: c.centre,
        up: c.up,
    };
    let Some(best) = found.iter().find(|c| is_plate(c)) else {
        return Err(refuse(found.first().map(shown), tuning.falling_limit));
    };
    let Some(plate) = roundest(points, found.iter().filter(|c| is_plate(c)), options) else {
        // Either the disc's edge does not show, or what falls away is none: a column's side.
        return Err(match measure(points, best, radius_m, tuning) {
            Some(measured) => {
                let candidate = PlateCandidate { falling: measured.round, ..shown(best) };
                refuse(Some(candidate), tuning.least_round)
            }
            None => ScanError::NoPlateEdge {
                least: tuning.least_edges,
                bearings: tuning.bearings,
                radius_m,
            },
        });
    };
    // Where stiff cloth falls away slowly, noise hides the edge: its scatter counts.
    let sigma_m = plate.radius_scatter_m / (tuning.bearings as f64 / 4.0).sqrt();
    if (plate.radius_m - radius_m).abs() > tuning.radius_tolerance * radius_m + 2.0 * sigma_m {
        let candidate = PlateCandidate { radius_m: plate.radius_m, ..shown(best) };
        return Err(refuse(Some(candidate), tuning.falling_limit));
    }
    Ok(plate)
}

/// The plate of another drape in the scene, if there is one: found away from the first as that
/// was, with something that hangs deep from its edge on most sides, as it does not from a box or
/// a cup's bottom on a table.
pub(super) fn another(
    points: &[Point3],
    plate: &Plate,
    unit: LengthUnit,
    options: &ScanOptions,
) -> Option<Plate> {
    let tuning = &options.tuning.plate;
    let others = beside(points, plate, options);
    if others.len() < options.tuning.limits.min_points {
        return None;
    }
    let other = find(&others, unit, options).ok()?;
    let (u, v) = horizontal_axes(&other.up, &Vector3::x());
    let mut hangs = vec![false; tuning.bearings];
    for p in &others {
        let placed = Placed::of(p, &other.centre, [&u, &other.up, &v]);
        let depth_radii = -placed.height_m / options.plate_radius_m;
        let reach_m = 0.5 * options.specimen_side_m;
        if (tuning.hanging_radii..3.0).contains(&depth_radii) && placed.radius_m() < reach_m {
            hangs[placed.sector(tuning.bearings)] = true;
        }
    }
    let share = hangs.iter().filter(|hangs| **hangs).count() as f64 / tuning.bearings as f64;
    (share >= tuning.hanging_share).then_some(other)
}

/// What stands beside a drape, without the floor: heights at which much of it lies.
fn beside(points: &[Point3], plate: &Plate, options: &ScanOptions) -> Vec<Point3> {
    let tuning = &options.tuning.plate;
    let apart_m = tuning.apart_sides * options.specimen_side_m;
    let height_m = |p: &Point3| (p - plate.centre).dot(&plate.up);
    let is_beside =
        |p: &&Point3| (*p - plate.centre - plate.up.into_inner() * height_m(p)).norm() > apart_m;
    let mut others: Vec<Point3> = points.par_iter().filter(is_beside).copied().collect();
    let bin = |p: &Point3| (height_m(p) / tuning.floor_bin_m).floor() as i64;
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    others.iter().for_each(|p| *counts.entry(bin(p)).or_default() += 1);
    let most = (tuning.floor_share * others.len() as f64) as usize;
    let floor: BTreeSet<i64> = counts
        .iter()
        .filter(|(_, count)| **count > most)
        .flat_map(|(bin, _)| [bin - 1, *bin, bin + 1])
        .collect();
    others.retain(|p| !floor.contains(&bin(p)));
    others
}

/// The plate with the roundest edge among the first few different ones of `found`; `None` if
/// none has a round one.
fn roundest<'a>(
    points: &[Point3],
    found: impl Iterator<Item = &'a Candidate>,
    options: &ScanOptions,
) -> Option<Plate> {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let mut different: Vec<&Candidate> = Vec::new();
    let mut best: Option<Measured> = None;
    for candidate in found {
        if different.iter().any(|other| other.is_near(candidate, radius_m)) {
            continue;
        }
        different.push(candidate);
        if let Some(measured) = measure(points, candidate, radius_m, tuning)
            && best.as_ref().is_none_or(|best| measured.round > best.round)
        {
            best = Some(measured);
        }
        let enough = best.as_ref().is_some_and(|best| best.round >= tuning.round_enough);
        if enough || different.len() == tuning.most_measured {
            break;
        }
    }
    best.filter(|best| best.round >= tuning.least_round).map(|best| best.plate)
}

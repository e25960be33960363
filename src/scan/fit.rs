//! From the parameterised cloth to the sheet that the rim is read from: a first fit to
//! the smoothed surface (`sheet`), then its registration to the raw points
//! (`registration`).
//!
//! In: the cloth, parameterised, and its square, local frame \[m\]. Out: the sheet, and
//! the places of the surface points and of the raw points near its edge.

use rayon::prelude::*;

use super::edge;
use super::options::ScanOptions;
use super::parameterisation::Parameterisation;
use super::registration::{Mean, Priors, Registration};
use super::sheet::{self, Sheet};
use super::square::Square;
use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;

/// A sheet and the surface points' places on it.
pub(super) struct Fitted {
    /// The sheet.
    pub sheet: Sheet,
    /// Material coordinates of the surface points \[m\].
    pub material: Vec<[f64; 2]>,
}

/// A raw point of the cloth and the surface point that is nearest to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RawPoint {
    /// The point, local frame \[m\].
    pub at: Point3,
    /// The surface point's number.
    pub surface: u32,
    /// Distance between the two \[m\].
    pub distance_m: f32,
}

impl RawPoint {
    /// What the surface point nearest to it has, of a list with one for each.
    pub fn of_nearest<T: Copy>(&self, all: &[T]) -> T {
        all[self.surface as usize]
    }
}

/// The raw points of the cloth near its parameterised surface.
pub(super) struct Raw {
    /// The points.
    pub points: Vec<RawPoint>,
    /// Distance between the surface points \[m\].
    pub spacing_m: f64,
    /// Noise of single points \[m\].
    pub noise_m: f64,
}

/// A raw point on the sheet near its edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePoint {
    /// The point, local frame \[m\].
    pub at: Point3,
    /// Its material coordinates \[m\].
    pub material: [f64; 2],
}

/// The first sheet, through the smoothed surface; `None` if too few points carry it.
pub(super) fn fit_sheet(
    surface: &Parameterisation,
    square: &Square,
    noise_m: f64,
    options: &ScanOptions,
) -> Option<Fitted> {
    let half_m = 0.5 * options.specimen_side_m;
    let tuning = &options.tuning.sheet;
    let settings = sheet::SheetSettings {
        half_m: tuning.cover * half_m,
        point_sigma_m: tuning.point_sigma_m + noise_m,
        tuning,
    };
    let mut material: Vec<[f64; 2]> = surface.flat.iter().map(|&p| square.material(p)).collect();
    let sheet = sheet::fit(&surface.points, &surface.disorder, &mut material, &settings)?;
    Some(Fitted { sheet, material })
}

/// Finds the raw points near surface points of such a spacing.
pub(super) fn on_surface(
    raw: Vec<Point3>,
    spacing_m: f64,
    surface: &[Point3],
    noise_m: f64,
    options: &ScanOptions,
) -> Raw {
    let tuning = &options.tuning.sheet;
    let near_m = tuning.near_cells * spacing_m + tuning.on_sheet_noises * noise_m;
    let tree = Neighbours::new(surface);
    let near = raw.into_par_iter().filter_map(|at| {
        let near = tree.one(&at)?;
        let (surface, distance_m) = (near.index as u32, near.distance() as f32);
        (near.distance() < near_m).then_some(RawPoint { at, surface, distance_m })
    });
    Raw { points: near.collect(), spacing_m, noise_m }
}

/// Raw points that lie on the sheet near its edge, with their material coordinates.
pub(super) fn edge_points(
    raw: &Raw,
    material: &[[f64; 2]],
    sheet: &Sheet,
    options: &ScanOptions,
) -> Vec<EdgePoint> {
    let (half_m, tuning) = (0.5 * options.specimen_side_m, &options.tuning.sheet);
    let on_sheet = tuning.on_sheet_m + tuning.on_sheet_noises * raw.noise_m;
    raw.points
        .par_iter()
        .filter_map(|p| {
            let m = p.of_nearest(material);
            if m[0].abs().max(m[1].abs()) < half_m - tuning.near_edge_m {
                return None;
            }
            let foot = sheet.nearest(&p.at, m, tuning.slide * half_m);
            (foot.off_m < on_sheet).then_some(EdgePoint { at: p.at, material: foot.material })
        })
        .collect()
}

/// The means of the raw points within `near_m` of each of the surface points, which have these
/// material coordinates. One that is farther from all of them stands for itself: where a fold is
/// tight, surface points are missing.
fn means(raw: &[RawPoint], material: &[[f64; 2]], near_m: f64) -> Vec<Mean> {
    let mut sums = vec![(Vector3::zeros(), 0.0); material.len()];
    let mut all = Vec::new();
    for p in raw {
        if f64::from(p.distance_m) < near_m {
            let (sum, count) = &mut sums[p.surface as usize];
            *sum += p.at.coords;
            *count += 1.0;
        } else {
            all.push(Mean { at: p.at, place: p.of_nearest(material), count: 1.0 });
        }
    }
    let seen = sums.into_iter().zip(material).filter(|((_, count), _)| *count > 0.0);
    all.extend(seen.map(|((sum, count), &place)| Mean {
        at: Point3::from(sum / count),
        place,
        count,
    }));
    all
}

/// Registers the sheet to the raw points, without changing its lengths, and measures the free edge
/// on it, alternately; the surface points' places follow. `None` if too few points carry it.
///
/// Where there are many points, the sheet is drawn to their means about each surface point. A
/// choice among them would depend on what else is in the file.
pub(super) fn register_sheet<'a>(
    sheet: Sheet,
    raw: &Raw,
    surface: &Parameterisation,
    material: &mut [[f64; 2]],
    options: &'a ScanOptions,
) -> Option<Registration<'a>> {
    let half_m = 0.5 * options.specimen_side_m;
    let (of_sheet, tuning) = (&options.tuning.sheet, &options.tuning.registration);
    let reach_m = of_sheet.slide * half_m;
    let priors = Priors {
        half_m,
        reach_m,
        plate_radius_m: options.plate_radius_m,
        point_sigma_m: of_sheet.point_sigma_m + raw.noise_m,
        sheet: of_sheet,
        tuning,
    };
    let near_m = raw.spacing_m + tuning.near_noises * raw.noise_m;
    let means = means(&raw.points, material, near_m);
    let mut registration = Registration::new(sheet, &means, priors);
    for steps in tuning.steps {
        let near_edge = edge_points(raw, material, &registration.sheet, options);
        let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.material).collect();
        let edges = edge::measure_sides(&flat, half_m, raw.noise_m, &options.tuning.edge);
        registration.draw(&edges, steps)?;
        let sheet = &registration.sheet;
        surface.points.par_iter().zip(&mut *material).for_each(|(p, m)| {
            for _ in 0..2 {
                *m = sheet.nearest(p, *m, reach_m).material;
            }
        });
    }
    Some(registration)
}

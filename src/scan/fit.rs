//! From the parameterised cloth to the sheet that the rim is read from: a first fit to
//! the smoothed surface (`sheet`), then its registration to the raw points
//! (`registration`).
//!
//! In: the cloth, parameterised, and its square, local frame \[m\]. Out: the sheet, and
//! the places of the surface points and of the raw points near its edge.

use rayon::prelude::*;

use super::cloth::Cloth;
use super::edge;
use super::options::ScanOptions;
use super::parameterisation::Parameterisation;
use super::registration::{Priors, Registration};
use super::sheet::{self, Sheet};
use super::square::Square;
use crate::base::Point3;
use crate::geom::Neighbours;

/// A sheet and the surface points' places on it.
pub(super) struct Fitted {
    /// The sheet.
    pub sheet: Sheet,
    /// Material coordinates of the surface points \[m\].
    pub material: Vec<[f64; 2]>,
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

/// Raw points, of at most `most` of the cloth's, that lie on the sheet near its edge, with
/// their material coordinates.
pub(super) fn edge_points(
    cloth: &Cloth,
    surface: &[Point3],
    material: &[[f64; 2]],
    sheet: &Sheet,
    noise_m: f64,
    most: usize,
    options: &ScanOptions,
) -> Vec<EdgePoint> {
    let (half_m, tuning) = (0.5 * options.specimen_side_m, &options.tuning.sheet);
    let tree = Neighbours::new(surface);
    let on_sheet = tuning.on_sheet_m + tuning.on_sheet_noises * noise_m;
    let near_m = tuning.near_cells * cloth.spacing_m + tuning.on_sheet_noises * noise_m;
    let stride = cloth.raw.len().div_ceil(most);
    cloth
        .raw
        .par_iter()
        .step_by(stride)
        .filter_map(|p| {
            let near = tree.one(p)?;
            let m = material[near.index];
            let far = near.distance() > near_m;
            if far || m[0].abs().max(m[1].abs()) < half_m - tuning.near_edge_m {
                return None;
            }
            let foot = sheet.nearest(p, m, tuning.slide * half_m);
            (foot.off_m < on_sheet).then_some(EdgePoint { at: *p, material: foot.material })
        })
        .collect()
}

/// Registers the sheet to the raw points, without changing its lengths, and measures the free edge
/// on it, alternately; the surface points' places follow. `None` if too few points carry it.
pub(super) fn register_sheet<'a>(
    sheet: Sheet,
    cloth: &Cloth,
    surface: &Parameterisation,
    material: &mut [[f64; 2]],
    noise_m: f64,
    options: &'a ScanOptions,
) -> Option<Registration<'a>> {
    let half_m = 0.5 * options.specimen_side_m;
    let (of_sheet, tuning) = (&options.tuning.sheet, &options.tuning.registration);
    let reach_m = of_sheet.slide * half_m;
    let priors = Priors {
        half_m,
        reach_m,
        plate_radius_m: options.plate_radius_m,
        point_sigma_m: of_sheet.point_sigma_m + noise_m,
        sheet: of_sheet,
        tuning,
    };
    let tree = Neighbours::new(&surface.points);
    let stride = cloth.raw.len().div_ceil(tuning.most_points);
    let near = of_sheet.near_cells * cloth.spacing_m + of_sheet.on_sheet_noises * noise_m;
    let points = cloth.raw.par_iter().step_by(stride).filter_map(|p| {
        let found = tree.one(p)?;
        (found.distance() < near).then_some((*p, material[found.index]))
    });
    let mut registration = Registration::new(sheet, points.collect(), priors);
    for steps in tuning.steps {
        let sheet = &registration.sheet;
        let most = tuning.most_first_candidates;
        let near_edge =
            edge_points(cloth, &surface.points, material, sheet, noise_m, most, options);
        let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.material).collect();
        let edges = edge::measure_sides(&flat, half_m, noise_m, &options.tuning.edge);
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

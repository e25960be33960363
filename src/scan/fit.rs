//! From the parameterised cloth to the sheet that the rim is read from: a first fit to
//! the smoothed surface (`sheet`), then its registration to the raw points
//! (`registration`).
//!
//! In: the cloth, parameterised, and its square, local frame \[m\]. Out: the sheet, and
//! the places of the surface points and of the raw points near its edge.

use rayon::prelude::*;

use super::cloth::Cloth;
use super::edge;
use super::measured::Misfit;
use super::neighbours::Neighbours;
use super::options::ScanOptions;
use super::parameterisation::Parameterisation;
use super::registration::{Priors, Registration};
use super::sheet::{self, Sheet};
use super::square::Square;
use crate::base::Point3;

/// Raw points that are tried for the edge: every 0.7 mm of a cloth's surface,
pub(super) const MOST_EDGE_CANDIDATES: usize = 200_000;
/// and while the sheet is not yet registered, every 1.3 mm.
const MOST_FIRST_CANDIDATES: usize = 50_000;
/// Raw points that the sheet is registered to: every 1.5 mm of a cloth's surface.
const MOST_REGISTERED: usize = 40_000;

/// Most steps in which the sheet is drawn after each measurement of its edge; the first is
/// made on a sheet that still lies off.
const REGISTRATION_STEPS: [usize; 3] = [2, 5, 5];

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
    let settings = sheet::SheetSettings {
        half_m: 1.1 * half_m,
        knot_m: 6e-3,
        point_sigma_m: 0.1e-3 + noise_m,
        curvature_sigma: 100.0,
        strain_sigma: 0.05,
        rounds: 6,
    };
    let mut material: Vec<[f64; 2]> = surface.flat.iter().map(|&p| square.material(p)).collect();
    let sheet = sheet::fit(&surface.points, &surface.disorder, &mut material, &settings)?;
    Some(Fitted { sheet, material })
}

/// Distances of the surface points to the sheet.
pub(super) fn misfit(
    sheet: &Sheet,
    surface: &Parameterisation,
    material: &[[f64; 2]],
    square: &Square,
) -> Misfit {
    let off: Vec<f64> =
        surface.points.iter().zip(material).map(|(p, &m)| (p - sheet.at(m)).norm()).collect();
    let rms_m = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    let worst = (0..off.len()).max_by(|&a, &b| off[a].total_cmp(&off[b]));
    let worst_bearing_deg = worst.map_or(0.0, |worst| square.bearing_deg(material[worst]));
    Misfit { rms_m, worst_bearing_deg }
}

/// Raw points, of at most `most` of the cloth's, that lie on the sheet near its edge, with
/// their material coordinates.
pub(super) fn edge_points(
    cloth: &Cloth,
    surface: &[Point3],
    material: &[[f64; 2]],
    sheet: &Sheet,
    noise_m: f64,
    half_m: f64,
    most: usize,
) -> Vec<EdgePoint> {
    let tree = Neighbours::new(surface);
    let on_sheet = 0.4e-3 + 3.0 * noise_m;
    let stride = cloth.raw.len().div_ceil(most);
    cloth
        .raw
        .par_iter()
        .step_by(stride)
        .filter_map(|p| {
            let near = tree.one(p)?;
            let m = material[near.index];
            let far = near.distance() > 4.0 * cloth.spacing_m + 3.0 * noise_m;
            if far || m[0].abs().max(m[1].abs()) < half_m - 20e-3 {
                return None;
            }
            let foot = sheet.nearest(p, m, 1.09 * half_m);
            (foot.off_m < on_sheet).then_some(EdgePoint { at: *p, material: foot.material })
        })
        .collect()
}

/// Registers the sheet to the raw points, without changing its lengths, and measures
/// the free edge on it, alternately; the surface points' places follow. `None` if too few points carry it.
pub(super) fn register_sheet(
    sheet: Sheet,
    cloth: &Cloth,
    surface: &Parameterisation,
    material: &mut [[f64; 2]],
    noise_m: f64,
    options: &ScanOptions,
) -> Option<Registration> {
    let half_m = 0.5 * options.specimen_side_m;
    let priors = Priors {
        half_m,
        plate_radius_m: options.plate_radius_m,
        point_sigma_m: 0.1e-3 + noise_m,
        curvature_sigma: 100.0,
        strain_sigma: 0.02,
    };
    let tree = Neighbours::new(&surface.points);
    let stride = cloth.raw.len().div_ceil(MOST_REGISTERED);
    let near = 4.0 * cloth.spacing_m + 3.0 * noise_m;
    let points = cloth.raw.par_iter().step_by(stride).filter_map(|p| {
        let found = tree.one(p)?;
        (found.distance() < near).then_some((*p, material[found.index]))
    });
    let mut registration = Registration::new(sheet, points.collect(), priors);
    for steps in REGISTRATION_STEPS {
        let sheet = &registration.sheet;
        let most = MOST_FIRST_CANDIDATES;
        let near_edge = edge_points(cloth, &surface.points, material, sheet, noise_m, half_m, most);
        let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.material).collect();
        registration.draw(&edge::measure_sides(&flat, half_m, noise_m), steps)?;
        let sheet = &registration.sheet;
        surface.points.par_iter().zip(&mut *material).for_each(|(p, m)| {
            for _ in 0..2 {
                *m = sheet.nearest(p, *m, 1.09 * half_m).material;
            }
        });
    }
    Some(registration)
}

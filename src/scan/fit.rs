//! From unrolled points to the sheet that the rim is read from: a first fit to the
//! smoothed surface (`sheet`), then drawn onto the raw points (`conform`).
//!
//! In: the cloth, unrolled, and its square, local frame \[m\]. Out: the sheet, and
//! the places of the surface points and of the raw points near its edge.

use rayon::prelude::*;

use super::error::ScanError;
use super::neighbours::Neighbours;
use super::options::ScanOptions;
use super::square::Square;
use super::{MIN_POINTS, cloth, conform, rim, sheet, unroll};
use crate::base::Point3;

/// Raw points that are tried for the edge: every 0.7 mm of a cloth's surface,
pub(super) const MOST_EDGE_CANDIDATES: usize = 200_000;
/// and while the sheet is not yet drawn, every 1.3 mm.
const MOST_FIRST_CANDIDATES: usize = 50_000;
/// Raw points that the sheet is drawn onto: every 1.5 mm of a cloth's surface.
const MOST_CONFORMED: usize = 40_000;

/// Most steps in which the sheet is drawn after each measurement of its edge; the first is
/// made on a sheet that still lies off.
const CONFORM_STEPS: [usize; 3] = [2, 5, 5];

/// A sheet and the surface points' places on it.
type Fitted = (sheet::Sheet, Vec<[f64; 2]>);

/// The first sheet, through the smoothed surface.
pub(super) fn fit_sheet(
    unrolled: &unroll::Unrolled,
    square: &Square,
    cloth: &cloth::Cloth,
    noise_m: f64,
    options: &ScanOptions,
) -> Result<Fitted, ScanError> {
    let half_m = 0.5 * options.specimen_side_m;
    let settings = sheet::SheetSettings {
        half_m: 1.1 * half_m,
        knot_m: 6e-3,
        point_sigma_m: 0.1e-3 + noise_m,
        curvature_sigma: 100.0,
        strain_sigma: 0.05,
        rounds: 6,
    };
    let mut material: Vec<[f64; 2]> = unrolled.flat.iter().map(|&p| square.material(p)).collect();
    let too_few = ScanError::TooFewPoints { points: cloth.raw.len(), limit: MIN_POINTS };
    let sheet = sheet::fit(&unrolled.points, &unrolled.disorder, &mut material, &settings)
        .ok_or(too_few)?;
    Ok((sheet, material))
}

/// Root mean square distance of the surface points to the sheet \[m\]. An error where it
/// is more than the noise explains.
pub(super) fn misfit(
    sheet: &sheet::Sheet,
    unrolled: &unroll::Unrolled,
    material: &[[f64; 2]],
    square: &Square,
    noise_m: f64,
    options: &ScanOptions,
) -> Result<f64, ScanError> {
    let off: Vec<f64> =
        unrolled.points.iter().zip(material).map(|(p, &m)| (p - sheet.at(m)).norm()).collect();
    let rms_m = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    let limit_m = options.max_misfit_m + options.max_misfit_per_noise * noise_m;
    if rms_m > limit_m {
        let worst = (0..off.len()).max_by(|&a, &b| off[a].total_cmp(&off[b])).unwrap_or(0);
        return Err(ScanError::Misfit {
            rms_mm: rms_m * 1e3,
            limit_mm: limit_m * 1e3,
            bearing_deg: square.bearing_deg(material[worst]),
        });
    }
    Ok(rms_m)
}

/// Raw points, of at most `most` of the cloth's, that lie on the sheet near its edge, with
/// their material coordinates.
pub(super) fn edge_points(
    cloth: &cloth::Cloth,
    surface: &[Point3],
    material: &[[f64; 2]],
    sheet: &sheet::Sheet,
    noise_m: f64,
    half_m: f64,
    most: usize,
) -> Vec<(Point3, [f64; 2])> {
    let tree = Neighbours::new(surface);
    let on_sheet = 0.4e-3 + 3.0 * noise_m;
    let stride = cloth.raw.len().div_ceil(most);
    cloth
        .raw
        .par_iter()
        .step_by(stride)
        .filter_map(|p| {
            let &(i, squared) = tree.nearest(p, 1).first()?;
            let m = material[i];
            let far = squared.sqrt() > 4.0 * cloth.spacing_m + 3.0 * noise_m;
            if far || m[0].abs().max(m[1].abs()) < half_m - 20e-3 {
                return None;
            }
            let (m, off) = sheet.nearest(p, m, 1.09 * half_m);
            (off < on_sheet).then_some((*p, m))
        })
        .collect()
}

/// Draws the sheet onto the raw points, without changing its lengths, and measures
/// the free edge on it, in turns; the surface points' places follow.
pub(super) fn conform_sheet(
    sheet: sheet::Sheet,
    cloth: &cloth::Cloth,
    unrolled: &unroll::Unrolled,
    material: &mut [[f64; 2]],
    noise_m: f64,
    options: &ScanOptions,
) -> Result<conform::Conformed, ScanError> {
    let half_m = 0.5 * options.specimen_side_m;
    let priors = conform::Priors {
        half_m,
        plate_radius_m: options.plate_radius_m,
        point_sigma_m: 0.1e-3 + noise_m,
        curvature_sigma: 100.0,
        strain_sigma: 0.02,
    };
    let tree = Neighbours::new(&unrolled.points);
    let stride = cloth.raw.len().div_ceil(MOST_CONFORMED);
    let near = 4.0 * cloth.spacing_m + 3.0 * noise_m;
    let points = cloth.raw.par_iter().step_by(stride).filter_map(|p| {
        let &(i, squared) = tree.nearest(p, 1).first()?;
        (squared.sqrt() < near).then_some((*p, material[i]))
    });
    let mut conformed = conform::Conformed::new(sheet, points.collect(), priors);
    for steps in CONFORM_STEPS {
        let sheet = &conformed.sheet;
        let most = MOST_FIRST_CANDIDATES;
        let near_edge =
            edge_points(cloth, &unrolled.points, material, sheet, noise_m, half_m, most);
        let flat: Vec<[f64; 2]> = near_edge.iter().map(|e| e.1).collect();
        let too_few = ScanError::TooFewPoints { points: cloth.raw.len(), limit: MIN_POINTS };
        conformed.draw(&rim::edges(&flat, half_m, noise_m), steps).ok_or(too_few)?;
        let sheet = &conformed.sheet;
        unrolled.points.par_iter().zip(&mut *material).for_each(|(p, m)| {
            for _ in 0..2 {
                *m = sheet.nearest(p, *m, 1.09 * half_m).0;
            }
        });
    }
    Ok(conformed)
}

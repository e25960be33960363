//! The plate under the fitted sheet: where its axis and its face are.
//!
//! `plate` reads the plate's edge from raw points, bearing by bearing, and must
//! extrapolate below their noise. Here the sheet gives it free of noise. On every
//! bearing the cloth bends over the same round edge: the radius at which it is
//! 1 mm below the plate's face is nearly the same all round (within 1 mm, while
//! folds make it vary by 20 mm a little lower), and what is left of the variation
//! goes with the slope there, which the sheet knows too. So
//!
//!   r_1(t) = R + x cos t + z sin t + c (r_4(t) - r_1(t))
//!
//! with r_d the radius at depth d \[mm\], is fitted robustly for R, x, z and c. Cloth lies on the
//! plate's middle. Stiff cloth arches over it by 1 mm and more and touches the plate near its edge
//! only, where folds pull it down steeply: the face is then taken from there.
//!
//! In: the sheet and its square, local frame \[m\]. Out: the plate's axis and face
//! in that frame. Fails (`None`) if the sheet does not fall away all round.

use nalgebra::{SMatrix, SVector};

use super::options::ScanOptions;
use super::sheet::Sheet;
use super::square::Square;
use super::tuning::OriginTuning;
use crate::base::Point3;
use crate::numeric::robust;

/// The plate in the local frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// Its axis, (x, z) \[m\].
    pub axis: [f64; 2],
    /// Standard error of the axis, per coordinate \[m\].
    pub axis_sigma_m: f64,
    /// Height of the cloth where it touches the face \[m\].
    pub face_y_m: f64,
    /// Its radius: where the cloth is 1 mm below the face. Of stiff cloth too, whose top is
    /// plane only to 10 to 20 mm farther in.
    pub radius_m: f64,
    /// Robust scatter of that over the bearings \[m\].
    pub radius_scatter_m: f64,
}

/// One bearing of the sheet.
struct Ray {
    bearing_rad: f64,
    /// Horizontal distance from the local origin at the two depths \[m\].
    radii_m: [f64; 2],
    /// Least height above the flat part of the face \[m\].
    face_m: f64,
}

/// The cloth's height on the plate's middle is read on a circle of so many plate's radii.
const MIDDLE_RADII: f64 = 0.2;
/// The cloth is followed outward from here on, in the plate's radii.
const FROM_RADII: f64 = 0.6;

/// Finds the plate: from the face at the height where it should be, or where the cloth is about the
/// axis, which may be another one where stiff cloth arches.
pub(super) fn find(sheet: &Sheet, square: &Square, options: &ScanOptions) -> Option<Origin> {
    from_face(options.cloth_height_m, sheet, square, options).or_else(|| {
        let about_m = height_about([0.0; 2], FROM_RADII, sheet, square, options)?;
        from_face(about_m, sheet, square, options)
    })
}

/// Finds the plate, first with its face at a height \[m\].
fn from_face(
    face_y_m: f64,
    sheet: &Sheet,
    square: &Square,
    options: &ScanOptions,
) -> Option<Origin> {
    let mut origin = Origin {
        axis: [0.0; 2],
        axis_sigma_m: f64::INFINITY,
        face_y_m,
        radius_m: options.plate_radius_m,
        radius_scatter_m: 0.0,
    };
    for _ in 0..3 {
        let tuning = &options.tuning.origin;
        let trace = |k| ray(sheet, square, &origin, k, options);
        let rays: Vec<Ray> = (0..tuning.bearings).filter_map(trace).collect();
        if rays.len() < tuning.least_bearings {
            return None;
        }
        let (axis, axis_sigma_m) = axis(&rays, tuning)?;
        let middle_y_m = height_about(axis, MIDDLE_RADII, sheet, square, options)?;
        let radii_m: Vec<f64> = rays.iter().map(|ray| ray.radius_from(axis)).collect();
        origin = Origin {
            axis,
            axis_sigma_m,
            face_y_m: face(middle_y_m, &rays, tuning)?,
            radius_scatter_m: robust::sigma(&radii_m)?,
            radius_m: robust::median(radii_m)?,
        };
    }
    Some(origin)
}

/// Follows the sheet outward from the plate's axis on bearing `k`.
fn ray(
    sheet: &Sheet,
    square: &Square,
    from: &Origin,
    k: usize,
    options: &ScanOptions,
) -> Option<Ray> {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.origin);
    let bearing_rad = std::f64::consts::TAU * k as f64 / tuning.bearings as f64;
    let at = |s: f64| {
        let flat = [from.axis[0] + s * bearing_rad.cos(), from.axis[1] + s * bearing_rad.sin()];
        sheet.at(square.material(flat))
    };
    let from_axis = |p: &Point3| (p.x - from.axis[0]).hypot(p.z - from.axis[1]);
    let step = 0.01 * radius_m;
    let mut crossed: [Option<Point3>; 2] = [None; 2];
    let mut face_m = f64::INFINITY;
    let mut before = at(FROM_RADII * radius_m);
    for j in 1..100 {
        let now = at(FROM_RADII * radius_m + f64::from(j) * step);
        if from_axis(&now) < tuning.face_radii * radius_m.min(from.radius_m) {
            face_m = face_m.min(now.y);
        }
        for (crossed, depth_m) in crossed.iter_mut().zip(tuning.depths_m) {
            let level = from.face_y_m - depth_m;
            if crossed.is_none() && now.y <= level && before.y > level {
                let share = (before.y - level) / (before.y - now.y);
                *crossed = Some(before + (now - before) * share);
            }
        }
        if crossed[1].is_some() {
            break;
        }
        before = now;
    }
    let [upper, lower] = [crossed[0]?, crossed[1]?];
    Some(Ray {
        bearing_rad: upper.z.atan2(upper.x),
        radii_m: [upper, lower].map(|p| p.x.hypot(p.z)),
        face_m,
    })
}

/// Unknowns of the fit: radius, slope, and the axis. (Tried: also the second to fourth harmonics,
/// which folds have. Cloth with one fold to a side then drew the axis 0.7 mm off, and 0.3 without.)
const UNKNOWNS: usize = 4;
type Unknowns = SVector<f64, UNKNOWNS>;

impl Ray {
    /// Distance of the upper crossing from an axis \[m\].
    fn radius_from(&self, [x, z]: [f64; 2]) -> f64 {
        let [upper, _] = self.radii_m;
        (upper * self.bearing_rad.cos() - x).hypot(upper * self.bearing_rad.sin() - z)
    }

    fn row(&self) -> Unknowns {
        let [upper, lower] = self.radii_m;
        let (sin, cos) = self.bearing_rad.sin_cos();
        Unknowns::new(1.0, lower - upper, cos, sin)
    }
}

/// The axis and its standard error, robustly.
fn axis(rays: &[Ray], tuning: &OriginTuning) -> Option<([f64; 2], f64)> {
    let rows: Vec<(Unknowns, f64)> = rays.iter().map(|ray| (ray.row(), ray.radii_m[0])).collect();
    let mut found = Unknowns::zeros();
    found[0] = robust::median(rows.iter().map(|r| r.1).collect())?;
    let mut scatter_m = f64::INFINITY;
    for _ in 0..10 {
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::identity() * 1e-12;
        let mut right = Unknowns::zeros();
        for (row, radius) in &rows {
            let off = (radius - row.dot(&found)).abs();
            let weight = (1.5 * scatter_m / off.max(1e-9)).min(1.0);
            normal += row * row.transpose() * weight;
            right += row * (weight * radius);
        }
        found = normal.cholesky()?.solve(&right);
        let off: Vec<f64> = rows.iter().map(|(row, radius)| radius - row.dot(&found)).collect();
        scatter_m = robust::sigma(&off)?.max(1e-6);
    }
    let free = rays.len() as f64 / tuning.together;
    let rows = rays.len() as f64;
    let inflated = scatter_m * (rows / (rows - UNKNOWNS as f64)).sqrt();
    let sigma_m = tuning.folds_share * inflated * (2.0 / free).sqrt();
    Some(([found[2], found[3]], sigma_m.hypot(tuning.least_sigma_m)))
}

/// Height of the cloth where it lies on the face: on the plate's middle, or where stiff cloth that
/// arches over it touches. In between, part of either.
fn face(middle_y_m: f64, rays: &[Ray], tuning: &OriginTuning) -> Option<f64> {
    let touched_y_m =
        robust::quantile(rays.iter().map(|ray| ray.face_m).collect(), tuning.touching)?;
    let (higher_m, [lies_m, arches_m]) = (middle_y_m - touched_y_m, tuning.arch_m);
    let arched = ((higher_m - lies_m) / (arches_m - lies_m)).clamp(0.0, 1.0);
    Some(middle_y_m - arched * higher_m)
}

/// Height of the sheet on a circle of so many plate's radii about an axis \[m\].
fn height_about(
    axis: [f64; 2],
    radii: f64,
    sheet: &Sheet,
    square: &Square,
    options: &ScanOptions,
) -> Option<f64> {
    let (bearings, away_m) = (options.tuning.origin.bearings, radii * options.plate_radius_m);
    let heights = (0..bearings).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / bearings as f64).sin_cos();
        sheet.at(square.material([axis[0] + away_m * cos, axis[1] + away_m * sin])).y
    });
    robust::median(heights.collect())
}

#[cfg(test)]
mod tests {
    use super::super::sheet::{self, SheetSettings};
    use super::*;

    /// Cloth over a plate about this axis whose face is at a height.
    fn sheet(axis: [f64; 2], radius_m: f64, face_y_m: f64, options: &ScanOptions) -> Sheet {
        const BEND_M: f64 = 15e-3;
        let places = (0..101 * 101).map(|k| [k / 101, k % 101].map(|i| 3e-3 * i as f64 - 0.15));
        let mut material: Vec<[f64; 2]> = places.collect();
        let at = |&[u, v]: &[f64; 2]| {
            let (x, z) = (u - axis[0], v - axis[1]);
            let away = x.hypot(z).max(1e-9);
            let turned = ((away - radius_m) / BEND_M).clamp(0.0, 1.4);
            let hangs = (away - radius_m - 1.4 * BEND_M).max(0.0);
            let out = away.min(radius_m) + BEND_M * turned.sin() + hangs * 1.4_f64.cos();
            let down = BEND_M * (1.0 - turned.cos()) + hangs * 1.4_f64.sin();
            Point3::new(axis[0] + x / away * out, face_y_m - down, axis[1] + z / away * out)
        };
        let points: Vec<Point3> = material.iter().map(at).collect();
        let settings =
            SheetSettings { half_m: 0.15, point_sigma_m: 1e-4, tuning: &options.tuning.sheet };
        sheet::fit(&points, &vec![0.0; points.len()], &mut material, &settings).unwrap()
    }

    #[test]
    fn a_plate_is_found_off_centre_and_at_any_height() {
        let options = ScanOptions::default();
        let square = Square { rotation_rad: 0.0, centre: [0.0; 2] };
        for face_y_m in [options.cloth_height_m, options.cloth_height_m - 4e-3] {
            let axis = [8e-3, -5e-3];
            let found = find(&sheet(axis, 0.048, face_y_m, &options), &square, &options).unwrap();
            let off_m = (found.axis[0] - axis[0]).hypot(found.axis[1] - axis[1]);
            assert!(off_m < 0.5e-3, "{found:?}");
            assert!((found.face_y_m - face_y_m).abs() < 0.5e-3, "{found:?}");
            assert!((found.radius_m - 0.053).abs() < 3e-3, "{found:?}");
        }
    }
}

//! What a scan says of the sheet, place by place, and how surely.
//!
//! In: a rim and, where there is one, the scanned sheet. Out: [`Datum`]s, each with a place of the
//! flat specimen, where it lies in space and the information on it (the inverse of its covariance).
//!
//! A scanned surface is sure across itself and not along itself: cloth that slides in its own
//! surface looks the same, and where a place of the flat specimen lies on it was found by
//! flattening, within some tenths of a millimetre. Inside the sheet the covariance is therefore
//! wide along the surface; on the free edge, which was seen, only along the edge. Errors of
//! neighbouring places, of the scan and of the model alike, are one and the same: of all places
//! within a patch only one counts.

use nalgebra::Matrix3;

use crate::base::boundary::{POINTS, POINTS_PER_SIDE};
use crate::base::{Boundary, Surface, Vector3};
use crate::inverse::scanned;
use crate::sim::Experiment;

/// One scan of the fabric that is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// The rim, simulation frame.
    pub rim: &'a Boundary,
    /// The whole sheet, simulation frame; without it the rim alone is fitted.
    pub sheet: Option<&'a Surface>,
    /// Specimen and plate.
    pub experiment: Experiment,
}

/// How sure a scan and the model are.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DataOptions {
    /// Standard deviation of a place along the surface \[m\].
    pub along_m: f64,
    /// Standard deviation by which a drape of the true fabric lies off: cells, contact's
    /// memory, neighbouring minima \[m\].
    pub model_m: f64,
    /// Distance on the cloth over which errors are alike \[m\]: of the places in a square with this
    /// side one counts.
    pub correlation_length_m: f64,
    /// Distance, in standard deviations, from which on a place pulls no harder.
    pub outlier: f64,
}

impl Default for DataOptions {
    /// By `scan2params-lab refine`; where the numbers come from is in `docs/design/refinement.md`.
    fn default() -> Self {
        let (along_m, model_m) = (scanned::ALONG_M, scanned::MODEL_M);
        Self { along_m, model_m, correlation_length_m: 22e-3, outlier: 3.0 }
    }
}

/// What is known of one place of the flat specimen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Datum {
    /// Index of the place in the order of [`Surface`].
    pub place: usize,
    /// Where it lies \[m\].
    pub position_m: Vector3,
    /// Inverse of the covariance of its position, as if it stood alone \[1/m^2\].
    pub information: Matrix3<f64>,
    /// Share of an independent place that it is.
    pub counts: f64,
}

/// Places on a side.
pub(super) const SIDE: usize = Surface::SIDE;

/// The data of a scan: the observed places of its sheet, or of its rim alone.
pub(super) fn data_of(scan: &Scan<'_>, options: &DataOptions) -> Vec<Datum> {
    let step_m = scan.experiment.specimen.weft_m / (SIDE - 1) as f64;
    // as many places as lie in a patch, and along an edge
    let alike = (options.correlation_length_m / step_m).max(1.0);
    match scan.sheet {
        Some(sheet) => of_sheet(sheet, alike, options),
        None => of_rim(scan.rim, alike, options),
    }
}

fn of_sheet(sheet: &Surface, alike: f64, options: &DataOptions) -> Vec<Datum> {
    let points = sheet.points();
    let at = |i: usize, j: usize| points[i * SIDE + j].position_m.coords;
    let last = SIDE - 1;
    let along = |k: usize| (k.saturating_sub(1), (k + 1).min(last));
    let datum = |place: usize| {
        let point = &points[place];
        let (i, j) = (place / SIDE, place % SIDE);
        let ((i0, i1), (j0, j1)) = (along(i), along(j));
        let (warp, weft) = (at(i1, j) - at(i0, j), at(i, j1) - at(i, j0));
        let sigma_m = point.sigma_m.hypot(options.model_m);
        let wide_m = options.along_m.hypot(sigma_m);
        let (edge_i, edge_j) = (i == 0 || i == last, j == 0 || j == last);
        let (information, counts) = match (edge_i, edge_j) {
            // a corner is sure in all directions, and stands for the edges' ends
            (true, true) => (isotropic(sigma_m), 1.0 / alike),
            (true, false) => (wide_along(weft, sigma_m, wide_m), 1.0 / alike),
            (false, true) => (wide_along(warp, sigma_m, wide_m), 1.0 / alike),
            (false, false) => {
                (sure_across(warp.cross(&weft), sigma_m, wide_m), 1.0 / (alike * alike))
            }
        };
        Datum { place, position_m: point.position_m.coords, information, counts }
    };
    (0..SIDE * SIDE).filter(|&place| points[place].observed).map(datum).collect()
}

fn of_rim(rim: &Boundary, alike: f64, options: &DataOptions) -> Vec<Datum> {
    let points: Vec<_> = rim.points().iter().collect();
    let datum = |index: usize| {
        let point = points[index];
        let next = points[(index + 1) % POINTS].position_m
            - points[(index + POINTS - 1) % POINTS].position_m;
        let sigma_m = point.sigma_m.hypot(options.model_m);
        let information = wide_along(next, sigma_m, options.along_m.hypot(sigma_m));
        let position_m = point.position_m.coords;
        Datum { place: place_of(index), position_m, information, counts: 1.0 / alike }
    };
    (0..POINTS).filter(|&index| points[index].observed).map(datum).collect()
}

/// The place of a rim point on the sheet.
pub(super) fn place_of(index: usize) -> usize {
    let flat = Boundary::flat_xz_m(index, 1.0);
    let [i, j] = flat.map(|share| ((share + 0.5) * (POINTS_PER_SIDE - 1) as f64).round() as usize);
    i * SIDE + j
}

fn isotropic(sigma_m: f64) -> Matrix3<f64> {
    Matrix3::identity() / (sigma_m * sigma_m)
}

/// `wide_m` along `direction`, `sigma_m` across it.
fn wide_along(direction: Vector3, sigma_m: f64, wide_m: f64) -> Matrix3<f64> {
    let (sure, unsure) = (1.0 / (sigma_m * sigma_m), 1.0 / (wide_m * wide_m));
    match direction.try_normalize(0.0) {
        Some(t) => Matrix3::identity() * sure + t * t.transpose() * (unsure - sure),
        None => isotropic(sigma_m),
    }
}

/// `sigma_m` along `normal`, `wide_m` across it.
fn sure_across(normal: Vector3, sigma_m: f64, wide_m: f64) -> Matrix3<f64> {
    wide_along(normal, wide_m, sigma_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Point3, SurfacePoint};

    fn flat(sigma_m: f64) -> Surface {
        let point = |k: usize| {
            let [x, z] = [k / SIDE, k % SIDE].map(|c| c as f64 * 5e-3 - 0.15);
            let position_m = Point3::new(x, 0.0, z);
            SurfacePoint { position_m, sigma_m, observed: !k.is_multiple_of(7) || k < SIDE }
        };
        Surface::new((0..SIDE * SIDE).map(point).collect()).unwrap()
    }

    #[test]
    fn a_sheet_is_sure_across_itself_its_edges_across_the_edge_and_holes_say_nothing() {
        let options =
            DataOptions { model_m: 0.3e-3, correlation_length_m: 20e-3, ..DataOptions::default() };
        let (sheet, rim) = (
            flat(0.4e-3),
            Boundary::exact((0..POINTS).map(|i| {
                let [x, z] = Boundary::flat_xz_m(i, 0.3);
                Point3::new(x, 0.0, z)
            }))
            .unwrap(),
        );
        let scan = Scan { rim: &rim, sheet: Some(&sheet), experiment: Experiment::default() };
        let data = data_of(&scan, &options);
        let observed = sheet.points().iter().filter(|p| p.observed).count();
        assert_eq!(data.len(), observed);
        let of = |i: usize, j: usize| data.iter().find(|d| d.place == i * SIDE + j).unwrap();
        let sd = |d: &Datum| [0, 1, 2].map(|c| d.information[(c, c)].sqrt().recip() * 1e3);
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        let wide = 0.5_f64.hypot(0.7);
        assert!(near(sd(of(30, 31)), [wide, 0.5, wide]), "{:?}", sd(of(30, 31)));
        // i = 0 runs along z
        assert!(near(sd(of(0, 31)), [0.5, 0.5, wide]) && near(sd(of(0, 0)), [0.5; 3]));
        assert!(
            (of(0, 31).counts - 0.25).abs() < 1e-12 && (of(30, 31).counts - 0.0625).abs() < 1e-12
        );
        let rim_alone = data_of(&Scan { sheet: None, ..scan }, &options);
        assert_eq!(rim_alone.len(), POINTS);
        for (index, datum) in rim_alone.iter().enumerate() {
            let on_sheet = sheet.points()[datum.place].position_m.coords;
            assert!((datum.position_m - on_sheet).norm() < 1e-12, "{index}");
        }
    }
}

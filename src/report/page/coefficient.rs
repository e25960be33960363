//! The drape coefficient of the square: the part of the cloth beyond the plate that is seen from
//! above.
//!
//! In: a scanned and a simulated drape. Out: (A_projected - A_plate) / (A_specimen - A_plate) in
//! per cent. The area is what the sheet's triangles and the rim's polygon cover, by a picture
//! without errors: folds that hide each other count once. A rim that was read from a file has no
//! sheet; what hangs out beyond it is then not counted.

use super::super::simulated::SimulatedDrape;
use crate::base::{Boundary, Surface};
use crate::geom::Mesh;
use crate::job::Outcome;
use crate::sensor::silhouette::{SilhouetteCamera, SilhouetteErrors, silhouette};

/// Pixels of a millimetre, each of 4 x 4 samples: an area to 0.02 %.
const PIXEL_M: f64 = 1e-3;

/// A drape coefficient and what it was taken of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coefficient {
    /// Its value \[%\].
    pub percent: f64,
    /// What the area is of.
    pub source: &'static str,
}

/// Of the scanned drape, and of the simulated one if there is one.
pub(super) fn of(outcome: &Outcome) -> (Coefficient, Option<Coefficient>) {
    let (side_m, plate_m) = (outcome.job.scan.specimen_side_m, outcome.job.scan.plate_radius_m);
    let percent = |sheet: &Mesh, rim: &Boundary| {
        let plate = std::f64::consts::PI * plate_m * plate_m;
        100.0 * (area_m2(sheet, rim, side_m) - plate) / (side_m * side_m - plate)
    };
    let scanned = match outcome.rim.sheet() {
        Some(sheet) => (mesh_of(sheet), "the sheet fitted to the scan"),
        None => (Mesh { vertices: Vec::new(), triangles: Vec::new() }, "the rim alone"),
    };
    let own =
        Coefficient { percent: percent(&scanned.0, outcome.rim.boundary()), source: scanned.1 };
    let again = SimulatedDrape::of(outcome).map(|shown| Coefficient {
        percent: percent(&shown.drape.mesh(), &shown.drape.boundary),
        source: shown.name,
    });
    (own, again)
}

fn mesh_of(sheet: &Surface) -> Mesh {
    let n = sheet.side();
    let cells = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i * n + j) as u32));
    let n = n as u32;
    Mesh {
        vertices: sheet.points().iter().map(|p| p.position_m).collect(),
        triangles: cells.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect(),
    }
}

/// Area seen from above \[m^2\].
fn area_m2(sheet: &Mesh, rim: &Boundary, side_m: f64) -> f64 {
    // a flat specimen in any direction fits, with a margin
    let half_px = (0.75 * side_m / PIXEL_M).ceil();
    let camera = SilhouetteCamera {
        size_px: [2 * half_px as u32; 2],
        pixel_m: PIXEL_M,
        axis_px: [half_px; 2],
        rotation_rad: 0.0,
        per_height: 0.0,
        errors: SilhouetteErrors::none(),
    };
    let picture = silhouette(sheet, rim, &camera, 0);
    let covered: f64 = picture.greys.iter().map(|&grey| f64::from(grey) / 255.0).sum();
    covered * PIXEL_M * PIXEL_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Point3;
    use crate::base::boundary::POINTS;

    #[test]
    fn a_square_covers_its_area_and_a_folded_one_half_of_it() {
        let place = |x: f64, z: f64| Point3::new(x, 0.0, z);
        let rim = |fold: fn(f64) -> f64| {
            let at = |k: usize| {
                let [x, z] = Boundary::flat_xz_m(k, 0.3);
                place(fold(x), z)
            };
            Boundary::exact((0..POINTS).map(at)).unwrap()
        };
        let sheet = |fold: fn(f64) -> f64| {
            let at = |k: usize| (k as f64 / 60.0 - 0.5) * 0.3;
            Surface::exact((0..61 * 61).map(|k| place(fold(at(k / 61)), at(k % 61)))).unwrap()
        };
        let [flat, folded]: [fn(f64) -> f64; 2] = [|x| x, f64::abs];
        for (fold, want) in [(flat, 0.09), (folded, 0.045)] {
            let found = area_m2(&mesh_of(&sheet(fold)), &rim(fold), 0.3);
            assert!((found / want - 1.0).abs() < 4e-3, "{found}");
        }
        let none = Mesh { vertices: Vec::new(), triangles: Vec::new() };
        assert!((area_m2(&none, &rim(flat), 0.3) / 0.09 - 1.0).abs() < 4e-3);
    }
}

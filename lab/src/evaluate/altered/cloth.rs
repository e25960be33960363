//! Cloth that is altered: smoothed, slit, folded, cut, or a surface that no cloth has.
//!
//! In: a drape on a square grid of vertices (simulation frame \[m\]). Out: the same grid, moved or
//! with fewer triangles.

use rand::RngExt as _;

use scan2params::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use scan2params::base::{Point3, Vector3, seed};
use scan2params::geom::Mesh;

/// A folded layer lies this far off the other \[m\].
const LAYERS_M: f64 = 0.8e-3;
/// A slit gapes by this \[m\].
const SLIT_M: f64 = 3e-3;

/// The grid of a mesh: vertices a side, and their distance on the flat specimen \[m\].
fn grid(mesh: &Mesh) -> (usize, f64) {
    let n = mesh.vertices.len().isqrt();
    (n, SPECIMEN_SIDE_M / (n - 1) as f64)
}

/// Where a vertex lies on the flat specimen (x, z) \[m\].
fn flat(k: usize, (n, cell_m): (usize, f64)) -> [f64; 2] {
    [k / n, k % n].map(|i| i as f64 * cell_m - 0.5 * SPECIMEN_SIDE_M)
}

/// Smooths the sheet with a Gaussian of this standard deviation \[m\].
pub(super) fn smooth(mesh: &mut Mesh, sigma_m: f64) {
    let (n, cell_m) = grid(mesh);
    // Half a step to the mean of the neighbours adds a quarter of a cell's square.
    let rounds = (4.0 * (sigma_m / cell_m).powi(2)).ceil() as usize;
    for _ in 0..rounds {
        let from = mesh.vertices.clone();
        for (k, p) in mesh.vertices.iter_mut().enumerate() {
            let (i, j) = (k / n, k % n);
            let around = [(i.wrapping_sub(1), j), (i + 1, j), (i, j.wrapping_sub(1)), (i, j + 1)];
            let inside = around.iter().filter(|(i, j)| *i < n && *j < n);
            let (sum, count) = inside.fold((Vector3::zeros(), 0.0), |(sum, count), (i, j)| {
                (sum + from[i * n + j].coords, count + 1.0)
            });
            *p += 0.5 * (sum / count - p.coords);
        }
    }
}

/// Leaves out the triangles whose middle on the flat specimen fits.
fn leave_out(mesh: &mut Mesh, fits: impl Fn([f64; 2]) -> bool) {
    let of = grid(mesh);
    mesh.triangles.retain(|corners| {
        let places = corners.map(|v| flat(v as usize, of));
        let middle = |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / 3.0;
        !fits([middle(0), middle(1)])
    });
}

/// A random side: from a place on the flat specimen, its distance from the side, and the place
/// along it \[m\].
fn side(rng: &mut seed::Rng) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
    let (axis, sign) = (rng.random_range(0..2), if rng.random() { 1.0 } else { -1.0 });
    move |place: [f64; 2]| [0.5 * SPECIMEN_SIDE_M - sign * place[axis], place[1 - axis]]
}

/// A slit of this length from an edge, away from the corners.
pub(super) fn slit(mesh: &mut Mesh, length_m: f64, rng: &mut seed::Rng) {
    let (side, at) = (side(rng), rng.random_range(-0.1..0.1));
    leave_out(mesh, |place| {
        let [deep, along] = side(place);
        deep < length_m && (along - at).abs() < 0.5 * SLIT_M
    });
}

/// A strip of this width along one edge is missing.
pub(super) fn cut_edge(mesh: &mut Mesh, width_m: f64, rng: &mut seed::Rng) {
    let side = side(rng);
    leave_out(mesh, |place| side(place)[0] < width_m);
}

/// Folds one corner over or under the cloth, along a line this far from the corner.
pub(super) fn fold_corner(mesh: &mut Mesh, deep_m: f64, rng: &mut seed::Rng) {
    let [sx, sz, face] = [(); 3].map(|()| if rng.random() { 1.0 } else { -1.0 });
    let toward = [sx, sz].map(|sign: f64| sign * std::f64::consts::FRAC_1_SQRT_2);
    let line_m = SPECIMEN_SIDE_M * std::f64::consts::FRAC_1_SQRT_2 - deep_m;
    let (before, of) = (mesh.vertices.clone(), grid(mesh));
    for (k, p) in mesh.vertices.iter_mut().enumerate() {
        let place = flat(k, of);
        let beyond = place[0] * toward[0] + place[1] * toward[1] - line_m;
        if beyond > 0.0 {
            let onto = [0, 1].map(|axis| place[axis] - 2.0 * beyond * toward[axis]);
            let (under, normal) = on_sheet(&before, of, onto);
            *p = under + normal * (face * LAYERS_M);
        }
    }
}

/// Point and normal of a sheet at a place on the flat specimen.
fn on_sheet(vertices: &[Point3], (n, cell_m): (usize, f64), place: [f64; 2]) -> (Point3, Vector3) {
    let [(i, u), (j, v)] = place.map(|at| {
        let cells = ((at + 0.5 * SPECIMEN_SIDE_M) / cell_m).clamp(0.0, (n - 1) as f64 - 1e-9);
        (cells as usize, cells.fract())
    });
    let at = |i: usize, j: usize| vertices[i * n + j].coords;
    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
    let along_x = (b - a) * (1.0 - v) + (d - c) * v;
    let along_z = (c - a) * (1.0 - u) + (d - b) * u;
    let point = a + (b - a) * u + along_z * v;
    (point.into(), along_z.cross(&along_x).try_normalize(0.0).unwrap_or_else(Vector3::y))
}

/// Lays the sheet on a surface of revolution over the plate: the slope grows to `steepest_rad`
/// within about `over_m` beyond the plate.
pub(super) fn bell(mesh: &mut Mesh, steepest_rad: f64, over_m: f64) {
    const STEPS: usize = 200;
    let of = grid(mesh);
    for (k, p) in mesh.vertices.iter_mut().enumerate() {
        let [x, z] = flat(k, of);
        let away = x.hypot(z);
        let beyond = (away - PLATE_RADIUS_M).max(0.0);
        let step = beyond / STEPS as f64;
        let slope = |s: f64| steepest_rad * (1.0 - (-s / over_m).exp());
        let slopes = (0..STEPS).map(|i| slope((i as f64 + 0.5) * step));
        let (out, down) =
            slopes.fold((0.0, 0.0), |(out, down), a| (out + a.cos() * step, down + a.sin() * step));
        let radius = away.min(PLATE_RADIUS_M) + out;
        let share = if away > 0.0 { radius / away } else { 0.0 };
        *p = Point3::new(x * share, -down, z * share);
    }
}

/// A bell with so many even pleats, the first of them at a phase.
pub(super) fn pleats(mesh: &mut Mesh, count: f64, phase_rad: f64, rng: &mut seed::Rng) {
    const FULL_M: f64 = 60e-3;
    let (depth, steepest) = (rng.random_range(0.1..0.3), rng.random_range(65.0..85.0_f64));
    bell(mesh, steepest.to_radians(), 15e-3);
    let of = grid(mesh);
    for (k, p) in mesh.vertices.iter_mut().enumerate() {
        let [x, z] = flat(k, of);
        let grown = ((x.hypot(z) - PLATE_RADIUS_M) / FULL_M).clamp(0.0, 1.0);
        let share = 1.0 + depth * grown * (count * z.atan2(x) + phase_rad).cos();
        *p = Point3::new(p.x * share, p.y, p.z * share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> Mesh {
        crate::evaluate::scenes::tests::kept().swap_remove(0).mesh
    }

    fn area_m2(mesh: &Mesh) -> f64 {
        (0..mesh.triangles.len())
            .map(|k| 0.5 * scan2params::geom::adjacency::area_vector2(mesh, k).norm())
            .sum()
    }

    #[test]
    fn cuts_take_their_area_and_folds_none() {
        let whole = area_m2(&plain());
        let of = |alter: &dyn Fn(&mut Mesh)| {
            let mut mesh = plain();
            alter(&mut mesh);
            area_m2(&mesh) / whole
        };
        let rng = || seed::rng(1, "test", 0);
        let cut = of(&|mesh| cut_edge(mesh, 0.02, &mut rng()));
        assert!((cut - 14.0 / 15.0).abs() < 0.02, "{cut}");
        let slit = of(&|mesh| slit(mesh, 0.06, &mut rng()));
        assert!((0.99..1.0).contains(&slit), "{slit}");
        let fold = of(&|mesh| fold_corner(mesh, 0.04, &mut rng()));
        assert!((fold - 1.0).abs() < 0.01, "{fold}");
        let smooth = of(&|mesh| smooth(mesh, 0.01));
        assert!(smooth < 0.99, "{smooth}");
    }

    #[test]
    fn a_cone_has_its_slope_and_pleats_their_number() {
        let mut cone = plain();
        bell(&mut cone, 0.6, 1e-4);
        let (n, _) = grid(&cone);
        let corner = cone.vertices[0];
        let slope = (-corner.y).atan2(corner.x.hypot(corner.z) - PLATE_RADIUS_M);
        assert!((slope - 0.6).abs() < 0.01, "{slope}");
        assert!(cone.vertices[n * n / 2].y.abs() < 1e-12);
        let mut pleated = plain();
        pleats(&mut pleated, 8.0, 0.0, &mut seed::rng(1, "test", 0));
        let of = grid(&pleated);
        // Round the specimen at 120 mm from its middle.
        let radius = |turn: f64| {
            let (p, _) = on_sheet(&pleated.vertices, of, [0.12 * turn.cos(), 0.12 * turn.sin()]);
            p.x.hypot(p.z)
        };
        let step = std::f64::consts::TAU / 720.0;
        let rises = (0..720).map(|k| radius((k + 1) as f64 * step) > radius(k as f64 * step));
        let rises: Vec<bool> = rises.collect();
        let crests = (0..720).filter(|&k| rises[k] && !rises[(k + 1) % 720]).count();
        assert_eq!(crests, 8);
    }
}

//! Energies against their difference quotients: what the tests of several energies share.

use std::sync::Arc;

use rand::RngExt as _;

use crate::base::{Vector3, seed};
use crate::sim::energy::Energy;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// Even square cells, cells rotated against the yarns, and uneven ones, some rotated.
pub(super) fn grids() -> [Arc<Grid>; 4] {
    [
        Grid::shared(7, 0.03),
        Grid::strip(6, 8, 0.005, 0.5),
        Grid::uneven_strip(7, 8, 0.005, 0.0),
        Grid::uneven_strip(7, 8, 0.005, 0.5),
    ]
}

/// The flat sheet, rotated, with each vertex moved by up to `part` of a cell either way.
pub(super) fn flat_with_noise(grid: &Grid, part: f64) -> Vec<Vector3> {
    let mut rng = seed::rng(9, "difference", 0);
    let rotation = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.7);
    (0..grid.vertices())
        .map(|v| {
            let noise = Vector3::from_fn(|_, _| rng.random_range(-part..part));
            rotation * (grid.flat(v) + noise * grid.spacing_m)
        })
        .collect()
}

/// The flat sheet bent to a cylinder of curvature `k` about a line at an angle from the warp.
pub(super) fn cylinder(grid: &Grid, degrees: f64, k: f64) -> Vec<Vector3> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let bent = |v: usize| {
        let p = grid.flat(v);
        let (along, across) = (p.z * cos + p.x * sin, p.x * cos - p.z * sin);
        let (up, on) = if k == 0.0 {
            (0.0, along)
        } else {
            ((1.0 - (k * along).cos()) / k, (k * along).sin() / k)
        };
        Vector3::new(across, up, on)
    };
    (0..grid.vertices()).map(bent).collect()
}

/// The largest errors of gradient and exact Hessian along five directions at `x`: of the work over
/// its size, and of a vertex's change of force over the largest.
pub(super) fn errors(grid: &Grid, x: &[Vector3], energy: &dyn Energy) -> [f64; 2] {
    let gradient = |x: &[Vector3]| {
        let mut g = vec![Vector3::zeros(); x.len()];
        energy.add_gradient(grid, x, &mut g);
        g
    };
    let g = gradient(x);
    let pattern = grid.analysis.pattern();
    let mut values = vec![0.0; pattern.nonzeros()];
    energy.add_constant_hessian(grid, &mut values);
    energy.add_hessian(grid, x, HessianForm::Exact, &mut values);
    let mut rng = seed::rng(10, "difference", 0);
    let (mut of_gradient, mut of_hessian) = (0.0_f64, 0.0_f64);
    for _ in 0..5 {
        let d: Vec<_> =
            x.iter().map(|_| Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        let step = 2e-6 * grid.spacing_m;
        let at = |by: f64| -> Vec<_> { x.iter().zip(&d).map(|(p, d)| p + d * by).collect() };
        let (plus, minus) = (at(step), at(-step));
        let work: f64 = g.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
        let numeric = (energy.energy_j(grid, &plus) - energy.energy_j(grid, &minus)) / (2.0 * step);
        let size: f64 = g.iter().zip(&d).map(|(g, d)| g.dot(d).abs()).sum();
        of_gradient = of_gradient.max((numeric - work).abs() / size);
        let mut product = vec![Vector3::zeros(); x.len()];
        pattern.multiply(&values, &d, &mut product);
        let scale = product.iter().map(Vector3::norm).fold(0.0, f64::max);
        let (above, below) = (gradient(&plus), gradient(&minus));
        let error = (0..x.len())
            .map(|v| ((above[v] - below[v]) / (2.0 * step) - product[v]).norm())
            .fold(0.0, f64::max);
        of_hessian = of_hessian.max(error / scale);
    }
    [of_gradient, of_hessian]
}

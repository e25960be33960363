//! Natural curvature: a sheet that curls when it is weightless.
//!
//! The plate energy of `bending.rs` measured from the curvatures k0 instead of zero,
//! `|x_ab - k0_ab n|^2` for `|x_ab|^2` with n the sheet's unit normal on its face. What
//! that adds, up to a constant that is left out, is linear in the curvature:
//!
//! `E = - sum over a, b of integral m_ab (x_ab . n)`,
//! `m_uu = B^u k0_uu + D12 k0_vv`, `m_vv = B^v k0_vv + D12 k0_uu`, `m_uv = 4 D66 k0_uv`  \[J\]
//!
//! Second differences and n at vertices, the twist and n at cells. At a vertex on the
//! border n comes from the one-sided difference. Positions enter n nonlinearly: the
//! Hessian is exact and indefinite, and is left out of the projected Hessian.
//!
//! Fails: where a cell collapses to a line n has no direction.

use nalgebra::Matrix3;

use super::bending::{PlateRigidity, twist_of};
use super::stencil::Stencil;
use crate::base::Vector3;
use crate::numeric::sparse::BlockPattern;
use crate::sim::experiment;
use crate::sim::grid::Grid;

/// One place: `E = -a . n`, n the direction of `p x q`; a, p, q are linear in the
/// positions.
#[derive(Clone, Debug)]
struct Place {
    stencil: Stencil,
    /// Moment times area times second difference \[J/m\].
    a: Vec<f64>,
    /// Difference along j.
    p: Vec<f64>,
    /// Difference along i.
    q: Vec<f64>,
}

/// The energy of natural curvature on a grid.
#[derive(Clone, Debug)]
pub struct CurlEnergy {
    places: Vec<Place>,
}

impl CurlEnergy {
    /// Of a sheet with the natural curvature `curl`; `None` if that is off.
    #[must_use]
    pub fn new(grid: &Grid, rigidity: &PlateRigidity, curl: &experiment::Curl) -> Option<Self> {
        if curl.is_off() {
            return None;
        }
        let n = grid.n;
        let [[ui, uj], [vi, vj]] = grid.lay.derivatives();
        // moments on the second differences along i, along j and mixed
        let moments = |row: f64, column: f64| {
            let [weft, warp, twist] =
                curl.at(row / (grid.rows - 1) as f64, column / (n - 1) as f64);
            let uu = rigidity.weft_nm * weft + rigidity.coupling_nm * warp;
            let vv = rigidity.warp_nm * warp + rigidity.coupling_nm * weft;
            let uv = 4.0 * rigidity.twist_nm * twist;
            [
                uu * ui * ui + vv * vi * vi + uv * ui * vi,
                uu * uj * uj + vv * vj * vj + uv * uj * vj,
                2.0 * uu * ui * uj + 2.0 * vv * vi * vj + uv * (ui * vj + uj * vi),
            ]
        };
        let unit = grid.lay.area(); // area over spacing^2
        let mut places = Vec::new();
        for v in 0..grid.vertices() {
            let (i, j) = (v / n, v % n);
            let [along_i, along_j, _] = moments(i as f64, j as f64);
            let mut a = Vec::new();
            for (step, moment) in [(n, along_i), (1, along_j)] {
                if moment != 0.0 && grid.has_second(v, step) {
                    let weight = moment * unit * grid.share(v);
                    a.extend([(v - step, weight), (v, -2.0 * weight), (v + step, weight)]);
                }
            }
            if !a.is_empty() {
                places.push(Place::new(grid, &a, &difference(grid, v, 1), &difference(grid, v, n)));
            }
        }
        for (cell, fill) in grid.cells.iter().zip(&grid.fill) {
            let [first, _, _, _] = cell.map(|v| v as usize);
            let (i, j) = ((first / n) as f64 + 0.5, (first % n) as f64 + 0.5);
            let [_, _, mixed] = moments(i, j);
            if mixed != 0.0 {
                let a = twist_of(cell).map(|(v, w)| (v, w * mixed * unit * fill));
                let [c00, c10, c01, c11] = cell.map(|v| v as usize);
                let p = [(c01, 0.5), (c11, 0.5), (c00, -0.5), (c10, -0.5)];
                let q = [(c10, 0.5), (c11, 0.5), (c00, -0.5), (c01, -0.5)];
                places.push(Place::new(grid, &a, &p, &q));
            }
        }
        Some(Self { places })
    }

    /// Energy \[J\], zero for a flat sheet.
    #[must_use]
    pub fn energy_j(&self, x: &[Vector3]) -> f64 {
        self.places.iter().map(|place| -place.at(x).part).sum()
    }

    /// Adds the gradient \[N\].
    pub fn add_gradient(&self, x: &[Vector3], gradient: &mut [Vector3]) {
        for place in &self.places {
            let state = place.at(x);
            for (k, &v) in place.stencil.vertices.iter().enumerate() {
                let turn = state.q.cross(&state.slope) * place.p[k]
                    - state.p.cross(&state.slope) * place.q[k];
                gradient[v as usize] -= state.normal * place.a[k] + turn;
            }
        }
    }

    /// Adds the exact Hessian \[N/m\].
    pub fn add_hessian(&self, pattern: &BlockPattern, x: &[Vector3], values: &mut [f64]) {
        for place in &self.places {
            let state = place.at(x);
            let across =
                (Matrix3::identity() - state.normal * state.normal.transpose()) / state.length;
            let (px, qx) = (state.p.cross_matrix(), state.q.cross_matrix());
            let slope = state.slope.cross_matrix();
            let bend = state.second_by_area();
            // area vector by vertex
            let turns: Vec<Matrix3<f64>> =
                place.p.iter().zip(&place.q).map(|(p, q)| px * *q - qx * *p).collect();
            place.stencil.add_blocks(pattern, values, |r, s| {
                let both = across * turns[s] * place.a[r]
                    + turns[r].transpose() * across * place.a[s]
                    + turns[r].transpose() * bend * turns[s]
                    + slope * (place.p[s] * place.q[r] - place.p[r] * place.q[s]);
                -both
            });
        }
    }
}

/// Difference of positions along j (`step` 1) or i (`step` n) at a vertex, one-sided on
/// the border; only its direction matters.
fn difference(grid: &Grid, v: usize, step: usize) -> [(usize, f64); 2] {
    let (at, count) = if step == 1 { (v % grid.n, grid.n) } else { (v / grid.n, grid.rows) };
    let there = |inside: bool, v: usize| inside && grid.share(v) > 0.0;
    let after = if at + 1 < count && there(true, v + step) { v + step } else { v };
    let before = if at > 0 && there(true, v - step) { v - step } else { v };
    [(after, 1.0), (before, -1.0)]
}

/// A place's vectors at given positions.
struct State {
    p: Vector3,
    q: Vector3,
    a: Vector3,
    normal: Vector3,
    /// Length of p x q.
    length: f64,
    /// a . n.
    part: f64,
    /// Derivative of a . n by p x q.
    slope: Vector3,
}

impl Place {
    fn new(grid: &Grid, a: &[(usize, f64)], p: &[(usize, f64)], q: &[(usize, f64)]) -> Self {
        let stencil = Stencil::new(grid, a.iter().chain(p).chain(q).map(|(v, _)| *v));
        Self { a: stencil.weights(a), p: stencil.weights(p), q: stencil.weights(q), stencil }
    }

    fn at(&self, x: &[Vector3]) -> State {
        let sum = |weights: &[f64]| -> Vector3 {
            self.stencil.vertices.iter().zip(weights).map(|(&v, w)| x[v as usize] * *w).sum()
        };
        let (a, p, q) = (sum(&self.a), sum(&self.p), sum(&self.q));
        let area = p.cross(&q);
        let length = area.norm().max(f64::MIN_POSITIVE);
        let normal = area / length;
        let part = a.dot(&normal);
        State { p, q, a, normal, length, part, slope: (a - normal * part) / length }
    }
}

impl State {
    /// Second derivative of a . n by p x q.
    fn second_by_area(&self) -> Matrix3<f64> {
        let (a, n) = (&self.a, &self.normal);
        let sum = a * n.transpose() + n * a.transpose() + Matrix3::identity() * self.part
            - n * n.transpose() * (3.0 * self.part);
        -sum / (self.length * self.length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::seed;
    use crate::fabric::Fabric;
    use crate::sim::experiment::{Curl, Specimen};
    use rand::RngExt as _;
    use std::sync::Arc;

    fn uneven() -> Curl {
        let mut curl = Curl::default();
        let mut rng = seed::rng(8, "curl", 0);
        for k in curl.nodes.iter_mut().flatten().flatten() {
            *k = rng.random_range(-30.0..30.0);
        }
        curl
    }

    fn scene(grid: &Arc<Grid>) -> (CurlEnergy, Vec<Vector3>) {
        let fabric = Fabric::from_paper_units([1e5, 1e5, 1e5, 1000.0, 1500.0, 400.0, 200.0]);
        let curl = CurlEnergy::new(grid, &PlateRigidity::new(&fabric), &uneven()).unwrap();
        let mut rng = seed::rng(9, "curl", 0);
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.7);
        let x = (0..grid.vertices())
            .map(|v| {
                let noise = Vector3::from_fn(|_, _| rng.random_range(-0.2..0.2));
                turn * (grid.flat(v) + noise * grid.spacing_m)
            })
            .collect();
        (curl, x)
    }

    fn grids() -> [Arc<Grid>; 3] {
        let skewed = Specimen { skew_rad: 0.1, warp_m: 0.31, ..Specimen::default() };
        [Grid::shared(7, 0.03), Grid::strip(6, 8, 0.005, 0.5), Grid::of(&skewed, 6)]
    }

    #[test]
    fn gradient_is_the_difference_quotient_of_the_energy() {
        for grid in grids() {
            let (curl, x) = scene(&grid);
            let mut g = vec![Vector3::zeros(); x.len()];
            curl.add_gradient(&x, &mut g);
            let norm = g.iter().map(Vector3::norm).fold(0.0, f64::max);
            for v in 0..x.len() {
                for c in 0..3 {
                    let step = 1e-7 * grid.spacing_m / 0.005;
                    let moved = |by: f64| {
                        let mut y = x.clone();
                        y[v][c] += by;
                        curl.energy_j(&y)
                    };
                    let numeric = (moved(step) - moved(-step)) / (2.0 * step);
                    let error = (numeric - g[v][c]).abs() / norm;
                    // observed floor 2e-8; a wrong sign of the turn scores 0.9
                    assert!(error < 1e-6, "{v} {c}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn hessian_is_the_difference_quotient_of_the_gradient() {
        for grid in grids() {
            let (curl, x) = scene(&grid);
            let pattern = grid.analysis.pattern();
            let mut values = vec![0.0; pattern.nonzeros()];
            curl.add_hessian(pattern, &x, &mut values);
            let mut rng = seed::rng(10, "curl", 0);
            for _ in 0..5 {
                let direction: Vec<_> = x
                    .iter()
                    .map(|_| Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)))
                    .collect();
                let step = 1e-7 * grid.spacing_m / 0.005;
                let at = |by: f64| {
                    let y: Vec<_> = x.iter().zip(&direction).map(|(p, d)| p + d * by).collect();
                    let mut g = vec![Vector3::zeros(); x.len()];
                    curl.add_gradient(&y, &mut g);
                    g
                };
                let (plus, minus) = (at(step), at(-step));
                let mut product = vec![Vector3::zeros(); x.len()];
                pattern.multiply(&values, &direction, &mut product);
                let scale = product.iter().map(Vector3::norm).fold(0.0, f64::max);
                let error = (0..x.len())
                    .map(|v| ((plus[v] - minus[v]) / (2.0 * step) - product[v]).norm())
                    .fold(0.0, f64::max);
                // observed floor 2e-8
                assert!(error < 1e-6 * scale, "{error:e} of {scale:e}");
            }
        }
    }

    #[test]
    fn rigid_motion_changes_nothing_and_off_is_none() {
        let grid = Grid::shared(7, 0.03);
        let (curl, x) = scene(&grid);
        let motion =
            nalgebra::Isometry3::new(Vector3::new(0.3, -0.2, 5.0), Vector3::new(1.0, 2.0, 0.5));
        let moved: Vec<_> =
            x.iter().map(|&p| (motion * nalgebra::Point3::from(p)).coords).collect();
        let (before, after) = (curl.energy_j(&x), curl.energy_j(&moved));
        // the lever of the 5 m times the rounding of second differences
        assert!((before - after).abs() < 1e-9 * before.abs(), "{before:e} {after:e}");
        let rigidity = PlateRigidity::new(&Fabric::mean_knit());
        assert!(CurlEnergy::new(&grid, &rigidity, &Curl::default()).is_none());
    }

    #[test]
    fn a_cylinder_of_the_natural_curvature_has_shed_its_bending_energy() {
        // 1/2 B k^2 - m k with m = B k is -1/2 B k^2, up to the missing border stencils
        let fabric = Fabric::from_paper_units([1e5, 1e5, 1e5, 1000.0, 1500.0, 1250.0, 200.0]);
        let (n, h, k) = (41, 0.0025, 20.0);
        let grid = Grid::shared(n, h * (n - 1) as f64);
        let curl = Curl::uniform([k, 0.0, 0.0]);
        let curl = CurlEnergy::new(&grid, &PlateRigidity::new(&fabric), &curl).unwrap();
        let x: Vec<_> = (0..grid.vertices())
            .map(|v| {
                let p = grid.flat(v);
                Vector3::new(p.x, (1.0 - (k * p.z).cos()) / k, (k * p.z).sin() / k)
            })
            .collect();
        let columns = (n - 2) as f64 * (n - 1) as f64;
        let nominal = -fabric.bending_weft_nm * k * k * columns * h * h;
        let error = curl.energy_j(&x) / nominal - 1.0;
        // second difference and normal of a circle: -(k h)^2 / 12
        assert!(error.abs() < (k * h).powi(2) / 5.0, "{error:e}");
    }
}

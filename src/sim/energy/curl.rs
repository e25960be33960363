//! Natural curvature: a sheet that curls when it is weightless.
//!
//! The plate energy of `bending.rs` measured from the curvatures k0 instead of zero,
//! `|x_ab - k0_ab n|^2` for `|x_ab|^2` with n the sheet's unit normal on its face. What
//! that adds, up to a constant that is left out, is linear in the curvature:
//!
//! `E = - sum over a, b of integral m_ab (x_ab . n)`,
//! `m_uu = B^u k0_uu + D12 k0_vv`, `m_vv = B^v k0_vv + D12 k0_uu`, `m_uv = 4 D66 k0_uv`  \[J\]
//!
//! with `x_ab . n` of `signed.rs`: second differences and n at vertices, the twist and n at cells.
//! At a vertex on the border n comes from the one-sided difference. Positions enter n nonlinearly:
//! the Hessian is exact and indefinite, and is left out of the projected Hessian.
//!
//! Fails: where a cell collapses to a line n has no direction.

use super::Energy;
use super::bending::{PlateRigidity, twist_of};
use super::signed::Signed;
use crate::base::Vector3;
use crate::sim::experiment;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// The energy of natural curvature on a grid.
#[derive(Clone, Debug)]
pub struct CurlEnergy {
    places: Vec<Signed>,
}

impl CurlEnergy {
    /// The energy of a sheet with the natural curvature `curl`; `None` if that is off.
    #[must_use]
    pub fn new(grid: &Grid, rigidity: &PlateRigidity, curl: &experiment::Curl) -> Option<Self> {
        if curl.is_off() {
            return None;
        }
        let n = grid.n;
        let [[ui, uj], [vi, vj]] = grid.frame.derivatives();
        // moments on the second differences along i, along j and mixed
        let moments = |spot: Spot, across: Option<usize>| {
            let [row, column] = [0, 1].map(|axis| spot.along(grid, axis).0);
            let field = curl.at(row / (grid.rows - 1) as f64, column / (n - 1) as f64);
            let bands = bands(grid, curl, spot, across);
            let [weft, warp, twist] = std::array::from_fn(|k| field[k] + bands[k]);
            let uu = rigidity.weft_nm * weft + rigidity.coupling_nm * warp;
            let vv = rigidity.warp_nm * warp + rigidity.coupling_nm * weft;
            let uv = 4.0 * rigidity.twist_nm * twist;
            [
                uu * ui * ui + vv * vi * vi + uv * ui * vi,
                uu * uj * uj + vv * vj * vj + uv * uj * vj,
                2.0 * uu * ui * uj + 2.0 * vv * vi * vj + uv * (ui * vj + uj * vi),
            ]
        };
        let unit = grid.frame.area(); // area over spacing^2
        let mut places = Vec::new();
        for v in 0..grid.vertices() {
            let spot = Spot { at: [v / n, v % n], cell: false };
            let along = |axis: usize| moments(spot, Some(axis))[axis];
            let mut a = Vec::new();
            for (step, moment) in [(n, along(0)), (1, along(1))] {
                if let Some(second) = grid.second(v, step).filter(|_| moment != 0.0) {
                    let weight = moment * unit * grid.share(v);
                    a.extend(second.map(|(v, w)| (v, w * weight)));
                }
            }
            if !a.is_empty() {
                places.push(Signed::at_vertex(grid, &a, v));
            }
        }
        for (k, (cell, fraction)) in grid.cells.iter().zip(&grid.volume_fraction).enumerate() {
            let first = cell[0] as usize;
            let [_, _, mixed] = moments(Spot { at: [first / n, first % n], cell: true }, None);
            if mixed != 0.0 {
                let material = fraction * grid.cell_size(k);
                let a = twist_of(grid, k).map(|(v, w)| (v, w * mixed * unit * material));
                let [c00, c10, c01, c11] = cell.map(|v| v as usize);
                let p = [(c01, 0.5), (c11, 0.5), (c00, -0.5), (c10, -0.5)];
                let q = [(c10, 0.5), (c11, 0.5), (c00, -0.5), (c01, -0.5)];
                places.push(Signed::new(grid, &a, &p, &q));
            }
        }
        Some(Self { places })
    }
}

impl Energy for CurlEnergy {
    /// Zero for a flat sheet.
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        self.places.iter().map(|place| -place.at(x).part).sum()
    }

    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for place in &self.places {
            place.add_gradient(&place.at(x), -1.0, gradient);
        }
    }

    /// The projected form is nothing.
    fn add_hessian(&self, grid: &Grid, x: &[Vector3], form: HessianForm, values: &mut [f64]) {
        if form == HessianForm::Exact {
            for place in &self.places {
                place.add_hessian(&place.at(x), [-1.0, 0.0], grid.analysis.pattern(), values);
            }
        }
    }
}

/// A vertex, or the middle of the cell after it along both axes.
#[derive(Clone, Copy)]
struct Spot {
    at: [usize; 2],
    cell: bool,
}

impl Spot {
    /// Its place along an axis and a cell's reach around it, in steps from the first line.
    fn along(self, grid: &Grid, axis: usize) -> (f64, [f64; 2]) {
        grid.extent(axis, self.at[axis], self.cell)
    }

    /// Whether it is a line on the border across an axis or next to that, from either end.
    fn is_outermost(self, grid: &Grid, axis: usize) -> [bool; 2] {
        let last = [grid.rows, grid.n][axis] - 1;
        [self.at[axis] <= 1, last - self.at[axis] <= 1]
    }
}

/// Curvature of edges and line along the weft, along the warp, and twist \[1/m\], mean over a
/// cell around a spot. A second difference `across` an edge, along that axis
/// of the grid, has the half cell at the edge added to its own: the outermost vertices have
/// none.
fn bands(grid: &Grid, curl: &experiment::Curl, spot: Spot, across: Option<usize>) -> [f64; 3] {
    let (edge, frame, h) = (&curl.edge, &grid.frame, grid.spacing_m);
    let lines =
        [&curl.line, &curl.cross_line].into_iter().filter(|line| line.curvature_per_m != 0.0);
    let mut sum = [0.0; 3];
    if edge.curvature_per_m == 0.0 && lines.clone().next().is_none() {
        return sum;
    }
    let places = [0, 1].map(|axis| spot.along(grid, axis));
    // In the order weft, warp; the flat place from the specimen's centre.
    let (sin, cos) = frame.warp_rad.sin_cos();
    let yarns = |[x, z]: [f64; 2]| [z * cos - x * sin, x * cos + z * sin];
    let last = [grid.rows - 1, grid.n - 1].map(|count| count as f64);
    let steps = [0, 1].map(|axis| places[axis].0 - 0.5 * last[axis]);
    let flat = [0, 1].map(|c| h * (steps[0] * frame.step_i[c] + steps[1] * frame.step_j[c]));
    let sides = places.map(|(_, [low, high])| high - low);
    // a cell's side in any direction
    let side = h * (sides[0] * sides[1]).sqrt();
    let mut add = |[weft, warp]: [f64; 2], curvature: f64| {
        let square = weft * weft + warp * warp;
        for (own, part) in sum.iter_mut().zip([weft * weft, warp * warp, weft * warp]) {
            *own += curvature * part / square;
        }
    };
    let of_edge = |low: f64, high: f64, side: f64| {
        let until = |d: f64| faded_m(d, edge.width_m);
        edge.curvature_per_m * (until(high) - until(low.max(0.0))) / side
    };
    if let Some(radius_m) = grid.disc_radius_m() {
        let r = flat[0].hypot(flat[1]);
        if r > 0.0 {
            let (low, high) = (radius_m - r - 0.5 * side, radius_m - r + 0.5 * side);
            add(yarns(flat), of_edge(low, high, side));
        }
    } else {
        for (axis, along) in [(0, frame.step_j), (1, frame.step_i)] {
            // Rows lie this far apart, in steps.
            let height = frame.area() / along[0].hypot(along[1]);
            let (_, [from, to]) = places[axis];
            let outermost = spot.is_outermost(grid, axis);
            for (end, reach) in
                [[from, to], [last[axis] - to, last[axis] - from]].iter().enumerate()
            {
                let first = across == Some(axis) && outermost[end];
                let low = if first { 0.0 } else { reach[0] };
                let [low, high] = [low, reach[1]].map(|steps| steps * height * h);
                add(yarns([-along[1], along[0]]), of_edge(low, high, h * sides[axis]) / height);
            }
        }
    }
    for line in lines {
        let (line_sin, line_cos) = line.angle_rad.sin_cos();
        let [weft, warp] = yarns(flat);
        let off = weft * line_cos - warp * line_sin - line.offset_m;
        let until = |d: f64| faded_m(d.abs(), line.width_m).copysign(d);
        let mean = (until(off + 0.5 * side) - until(off - 0.5 * side)) / side;
        add([line_cos, -line_sin], line.curvature_per_m * mean);
    }
    sum
}

/// Natural curvature along the weft and along the warp at a vertex \[1/m\], as the second
/// differences there see it.
pub(super) fn natural_at(grid: &Grid, curl: &experiment::Curl, vertex: usize) -> [f64; 2] {
    let spot = Spot { at: [vertex / grid.n, vertex % grid.n], cell: false };
    let [row, column] = [0, 1].map(|axis| spot.along(grid, axis).0);
    let field = curl.at(row / (grid.rows - 1) as f64, column / (grid.n - 1) as f64);
    // across an edge the outermost difference has the half cell at the edge added to its own
    let [by_weft, _] = grid.frame.derivatives();
    let weft_axis = usize::from(by_weft[0] == 0.0);
    [0, 1].map(|k| {
        let axis = if k == 0 { weft_axis } else { 1 - weft_axis };
        field[k] + bands(grid, curl, spot, grid.frame.along_yarns().then_some(axis))[k]
    })
}

/// Integral of `1 - t / width` from 0 to d >= 0, no further than the width \[m\].
fn faded_m(d: f64, width_m: f64) -> f64 {
    let d = d.min(width_m);
    d - 0.5 * d * d / width_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::seed;
    use crate::fabric::Fabric;
    use crate::sim::energy::difference::{cylinder, errors, flat_with_noise};
    use crate::sim::experiment::{Curl, Experiment, Specimen};
    use crate::sim::numerics::Grading;
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
        (curl, flat_with_noise(grid, 0.2))
    }

    fn grids() -> [Arc<Grid>; 4] {
        let skewed = Specimen { skew_rad: 0.1, warp_m: 0.31, ..Specimen::default() };
        let uneven = Grid::uneven_strip(7, 6, 0.005, 0.5);
        [Grid::shared(7, 0.03), Grid::strip(6, 8, 0.005, 0.5), Grid::of(&skewed, 6), uneven]
    }

    #[test]
    fn gradient_and_hessian_are_difference_quotients() {
        for grid in grids() {
            let (curl, x) = scene(&grid);
            let [gradient, hessian] = errors(&grid, &x, &curl);
            // observed floors 5e-11 and 2e-10
            assert!(gradient < 5e-10 && hessian < 2e-9, "{gradient:e} {hessian:e}");
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
        let (before, after) = (curl.energy_j(&grid, &x), curl.energy_j(&grid, &moved));
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
        let x = cylinder(&grid, 0.0, k);
        let columns = (n - 2) as f64 * (n - 1) as f64;
        let nominal = -fabric.bending_weft_nm * k * k * columns * h * h;
        let error = curl.energy_j(&grid, &x) / nominal - 1.0;
        // second difference and normal of a circle: -(k h)^2 / 12
        assert!(error.abs() < (k * h).powi(2) / 5.0, "{error:e}");
    }

    /// Energy of a cylinder of curvature k along the warp with this natural curvature.
    fn of_cylinder(grid: &Grid, fabric: &Fabric, curl: &Curl, k: f64) -> f64 {
        let x: Vec<_> = (0..grid.vertices())
            .map(|v| {
                let p = grid.flat(v);
                Vector3::new((k * p.x).sin() / k, (1.0 - (k * p.x).cos()) / k, p.z)
            })
            .collect();
        CurlEnergy::new(grid, &PlateRigidity::new(fabric), curl).unwrap().energy_j(grid, &x)
    }

    #[test]
    fn edges_and_a_line_do_the_work_of_their_bands_on_a_cylinder() {
        // D12 = 0 for this set, so that only what bends along the warp counts
        let fabric = Fabric::from_paper_units([1e5, 1e5, 1e5, 1500.0, 1500.0, 1500.0, 200.0]);
        let rigidity = PlateRigidity::new(&fabric);
        let (side, k, c, width) = (0.3, 5.0, 30.0, 0.02);
        let usual = Experiment::default();
        let grids = [
            Grid::shared(31, side),
            Grid::shared(61, side),
            Grid::graded(&usual, 61, &Grading::EDGE),
        ];
        for grid in grids {
            let n = grid.n;
            let mut edge = Curl::default();
            (edge.edge.curvature_per_m, edge.edge.width_m) = (c, width);
            // two bands across the warp, two along it that only couple; each width / 2 on average
            let nominal = -(rigidity.warp_nm + rigidity.coupling_nm) * k * c * width * side;
            let error = of_cylinder(&grid, &fabric, &edge, k) / nominal - 1.0;
            assert!(error.abs() < 0.02, "edge, {n}: {error:e}");
            for degrees in [90.0_f64, 60.0, 45.0] {
                let crease = experiment::LineCurl {
                    curvature_per_m: c,
                    width_m: width,
                    angle_rad: degrees.to_radians(),
                    offset_m: 0.01,
                };
                let line = Curl { line: crease, ..Curl::default() };
                // along the line bending counts by the square of the sine
                let (sin, cos) = line.line.angle_rad.sin_cos();
                let length = chord_m(side, sin, cos, 0.01);
                let bending = rigidity.warp_nm * sin * sin + rigidity.coupling_nm * cos * cos;
                let nominal = -bending * k * c * width * length;
                let error = of_cylinder(&grid, &fabric, &line, k) / nominal - 1.0;
                assert!(error.abs() < 0.04, "line at {degrees}, {n}: {error:e}");
                // two lines are the sum of both
                let twice = Curl { cross_line: crease, ..line };
                let [both, one] = [twice, line].map(|curl| of_cylinder(&grid, &fabric, &curl, k));
                assert!((both / one - 2.0).abs() < 1e-12, "{both:e} {one:e}");
            }
        }
    }

    /// Length of the line `weft cos - warp sin = offset` inside a square.
    fn chord_m(side: f64, sin: f64, cos: f64, offset: f64) -> f64 {
        let steps = 100_000;
        let at = |k: i32| {
            let t = (f64::from(k) / f64::from(steps) - 0.5) * 2.0 * side;
            [offset * cos + t * sin, -offset * sin + t * cos]
        };
        let inside = (0..steps).filter(|&k| at(k).iter().all(|c| c.abs() < 0.5 * side)).count();
        inside as f64 * 2.0 * side / f64::from(steps)
    }

    #[test]
    fn a_weightless_band_curls_towards_the_face_all_round() {
        // on a flat sheet the force of an edge's curl lifts the edge and presses what is inside it
        let fabric = Fabric::mean_knit();
        let grid = Grid::shared(31, 0.3);
        let mut curl = Curl::default();
        curl.edge.curvature_per_m = 20.0;
        let energy = CurlEnergy::new(&grid, &PlateRigidity::new(&fabric), &curl).unwrap();
        let x: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
        let mut force = vec![Vector3::zeros(); x.len()];
        energy.add_gradient(&grid, &x, &mut force);
        for middle in [15, 30 * 31 + 15, 15 * 31, 15 * 31 + 30] {
            assert!(-force[middle].y > 0.0, "{middle}: {}", -force[middle].y);
        }
    }
}

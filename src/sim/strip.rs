//! Small specimens with known answers: a cantilever, a hanging strip, a sliding piece.
//!
//! In: a fabric (SI), a cut, a mesh. Out: where the strip's end comes to rest, or how far
//! the piece slid. They run on the drape's own grid, energies and Newton iterations; what is
//! theirs is how the specimen is held. Known answers: `elastica.rs`, and the formulas at the
//! functions.
//!
//! A clamp holds two rows of vertices. The strip begins in the middle between them: the
//! edge between the rows is level, which is theta = 0 there, and the second difference at
//! the second row then sees the bend from s = 0 to s = h. Tried and dropped: beginning at
//! the first free row, which is half a cell too short and of first order.

use std::sync::Arc;

use crate::base::Vector3;
use crate::base::frame::GRAVITY_M_S2;
use crate::fabric::Fabric;
use crate::sim::energy::plate::{PlateContact, resting_depth_m};
use crate::sim::experiment::{Experiment, Specimen, Tilt};
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;
use crate::sim::newton::{Inertia, Memory, Newton};
use crate::sim::plate::Plate;

/// How a strip is cut from the cloth, and its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Angle between the strip and the warp \[rad\]: 0 for a strip along the warp, pi/2 for one
    /// along the weft.
    pub angle_rad: f64,
    /// Side of a square cell of the mesh \[m\].
    pub cell_m: f64,
    /// Number of cells along the strip.
    pub along: usize,
    /// Number of cells across the strip.
    pub across: usize,
}

impl Cut {
    fn grid(&self) -> Arc<Grid> {
        // the grid's i runs along the strip; seen from there the warp is rotated back
        Grid::strip(self.along + 1, self.across + 1, self.cell_m, -self.angle_rad)
    }

    /// Length of the strip that is free of the clamp \[m\].
    #[must_use]
    pub fn clamped_length_m(&self) -> f64 {
        (self.along as f64 - 0.5) * self.cell_m
    }
}

/// A strip that is held at one end, after the search for rest.
#[derive(Clone, Debug)]
pub struct Strip {
    /// The grid that the strip was simulated on.
    pub grid: Arc<Grid>,
    /// Position of each vertex of the grid \[m\]; the strip leaves its clamp along x.
    pub positions_m: Vec<Vector3>,
    /// Largest net force on a vertex at the end of the search \[N\].
    pub residual_n: f64,
    /// Whether the strip came to rest in a stable equilibrium.
    pub at_rest: bool,
    /// Number of Cholesky factorisations that the search took.
    pub factorisations: usize,
}

impl Strip {
    /// Mean position of the vertices of row `i`, which runs across the strip \[m\].
    #[must_use]
    pub fn row_m(&self, i: usize) -> Vector3 {
        let row = &self.positions_m[i * self.grid.n..(i + 1) * self.grid.n];
        row.iter().sum::<Vector3>() / row.len() as f64
    }

    /// Where the free end is, from the clamp's middle \[m\]: how far it reaches along x, how far it
    /// droops below, and how far it has gone sideways along z.
    #[must_use]
    pub fn end_m(&self) -> [f64; 3] {
        let from = (self.row_m(0) + self.row_m(1)) * 0.5;
        let end = self.row_m(self.grid.rows - 1) - from;
        [end.x, -end.y, end.z]
    }
}

/// Lets a strip of `fabric` that is clamped level at one end bend under its weight, with the
/// effects of `experiment`; the experiment's specimen and plate do not matter. The known answer for
/// a strip along a yarn is the heavy elastica, [`crate::sim::elastica`].
#[must_use]
pub fn cantilever(fabric: &Fabric, cut: &Cut, experiment: &Experiment) -> Strip {
    let mut model = clamped(fabric, cut, experiment);
    let x = flat(&model.grid);
    rest(&mut model, x, fabric, RESIDUAL)
}

/// The strip of [`cantilever`], and the same after its weight has been taken away. Without
/// hysteresis it is flat again (or as its natural curvature has it); the known answer with
/// hysteresis is the curvature at which friction, from that under weight on, balances bending.
#[must_use]
pub fn unloaded(fabric: &Fabric, cut: &Cut, experiment: &Experiment) -> [Strip; 2] {
    let mut model = clamped(fabric, cut, experiment);
    let x = flat(&model.grid);
    let loaded = rest(&mut model, x, fabric, RESIDUAL);
    model.remember(&loaded.positions_m);
    model.weight.up = Vector3::zeros();
    let unloaded = rest(&mut model, loaded.positions_m.clone(), fabric, RESIDUAL);
    [loaded, unloaded]
}

fn clamped(fabric: &Fabric, cut: &Cut, experiment: &Experiment) -> Model {
    let grid = cut.grid();
    let mut model = without_plate(&grid, fabric, experiment);
    model.held = (0..2 * grid.n).collect();
    model
}

fn flat(grid: &Grid) -> Vec<Vector3> {
    (0..grid.vertices()).map(|v| grid.flat(v)).collect()
}

/// Lets a strip of `fabric` that is held along its first row hang along x under its own weight.
/// In a strip along a yarn the end sinks by `rho g L^2 / (2 S)`; at 45 degrees to it, by the
/// same with 4 / (1/S^u + 1/S^v + 1/H) for S while strains are small.
#[must_use]
pub fn hanging(fabric: &Fabric, cut: &Cut) -> Strip {
    let grid = cut.grid();
    let mut model = without_plate(&grid, fabric, &Experiment::default());
    model.held = (0..grid.n).collect();
    model.weight.up = -Vector3::x();
    let x = flat(&grid);
    rest(&mut model, x, fabric, RESIDUAL)
}

/// The model of `fabric` on a grid in still air, with nothing below it.
pub(super) fn without_plate(grid: &Arc<Grid>, fabric: &Fabric, experiment: &Experiment) -> Model {
    let mut model = Model::new(grid, fabric, experiment, SELF_GAP_CELLS);
    model.plate = PlateContact::none();
    model
}

/// Reach of self-contact in cells, as at a drape's rest.
const SELF_GAP_CELLS: f64 = 0.2;
/// A strip is at rest when no vertex feels more than this part of a cell's weight ...
const RESIDUAL: f64 = 1e-6;
/// ... or of the largest force with which a vertex is pulled, below which rounding hides
/// the rest, and the last Newton step moved no vertex more than this \[m\].
const ROUNDING: f64 = 1e-10;
const STEP_M: f64 = 1e-7;
/// Rounds of descent and Newton steps before it is given up.
const ROUNDS: usize = 60;

/// Lets a held specimen come to rest from `x`, until no vertex feels more than the part `residual`
/// of a cell's weight: descents by quasi-Newton until the residual
/// is small, then Newton steps on the exact Hessian. Hysteresis keeps its anchors, so that the way
/// there does not matter: each place counts as bent from its anchor in one go.
pub(super) fn rest(
    model: &mut Model,
    mut x: Vec<Vector3>,
    fabric: &Fabric,
    residual: f64,
) -> Strip {
    let grid = Arc::clone(&model.grid);
    let mut newton = Newton::new(model);
    let stretch = fabric.stretch_weft_n_m.max(fabric.stretch_warp_n_m);
    let weight_n = fabric.density_kg_m2 * grid.cell_area_m2() * GRAVITY_M_S2;
    let limit_n = (residual * weight_n).max(ROUNDING * stretch * grid.spacing_m);
    let mut memory = Memory::default();
    let (mut residual_n, mut at_rest) = (f64::INFINITY, false);
    'rounds: for _ in 0..ROUNDS {
        model.membrane.forget_lagged_stress();
        model.self_contact.update(&x, 0.0);
        let near_n = NEAR_REST * limit_n;
        residual_n = newton.quasi_newton(model, &mut x, &mut memory, 15, near_n).residual_n;
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        for _ in 0..NEWTON_STEPS {
            model.self_contact.update(&x, 0.0);
            let done = newton.iterate(model, &mut x, still, HessianForm::Exact);
            residual_n = done.residual_n;
            if !done.definite || done.fraction < 0.05 {
                break;
            }
            memory.clear();
            if residual_n < limit_n && done.step_m < STEP_M {
                at_rest = newton.is_stable(model, &x);
                break 'rounds;
            }
        }
    }
    let factorisations = newton.effort.factorisations;
    Strip { grid, positions_m: x, residual_n, at_rest, factorisations }
}

/// Residual, in limits, down to which the descent goes.
const NEAR_REST: f64 = 1e3;
/// Newton steps in a row.
const NEWTON_STEPS: usize = 12;

/// How far a piece of cloth slid down a tilted plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// Distance that the piece's centre went down the slope \[m\].
    pub distance_m: f64,
    /// Distance by Coulomb's law, 0 up to a slope of mu \[m\].
    pub expected_m: f64,
}

/// Lays a square of `fabric` with sides of 40 mm on a wide plate, tilts the plate from level to
/// `slope` (the tangent of its angle) within [`TILTING_S`], and leaves it so for `seconds`. The
/// known answer is a block with the acceleration g (sin - mu cos) of the slope's angle, once that
/// is positive. If the plate were tilted at once, the piece would gather speed while friction grows
/// over its first 0.1 mm.
#[must_use]
pub fn slide(fabric: &Fabric, friction: f64, slope: f64, seconds: f64) -> Slide {
    let specimen = Specimen { warp_m: 0.04, weft_m: 0.04, ..Specimen::default() };
    let plate = Plate { radius_m: 0.5, friction, ..Plate::default() };
    let experiment = Experiment { specimen, plate, ..Experiment::default() };
    let grid = Grid::of(&specimen, 9);
    let mut model = Model::new(&grid, fabric, &experiment, SELF_GAP_CELLS);
    let mut newton = Newton::new(&model);
    let height = plate.gap_m - resting_depth_m(&plate);
    let mut x: Vec<_> =
        (0..grid.vertices()).map(|v| grid.flat(v) + Vector3::new(0.0, height, 0.0)).collect();
    let centre = |x: &[Vector3]| x.iter().map(|p| p.x).sum::<f64>() / x.len() as f64;
    let (start_m, mut velocity) = (centre(&x), vec![Vector3::zeros(); x.len()]);
    let (mut block_m, mut block_m_s) = (0.0, 0.0_f64);
    let steps = ((seconds + TILTING_S) / SLIDE_STEP_S).round() as usize;
    for step in 0..steps {
        let now = slope * ((step + 1) as f64 * SLIDE_STEP_S / TILTING_S).min(1.0);
        model.weight.up = Tilt { down_x_rad: now.atan(), down_z_rad: 0.0 }.up();
        let pull = GRAVITY_M_S2 * now.atan().cos() * (now - friction);
        block_m_s = (block_m_s + pull * SLIDE_STEP_S).max(0.0);
        block_m += block_m_s * SLIDE_STEP_S;
        let free: Vec<_> = x.iter().zip(&velocity).map(|(p, u)| p + u * SLIDE_STEP_S).collect();
        let before = x.clone();
        model.plate.renew(&grid, &x);
        for _ in 0..3 {
            let inertia = Inertia { dt_s: SLIDE_STEP_S, free_flight: Some(&free) };
            model.membrane.forget_lagged_stress();
            newton.iterate(&mut model, &mut x, inertia, HessianForm::Projected);
        }
        for ((u, p), q) in velocity.iter_mut().zip(&x).zip(&before) {
            *u = (p - q) / SLIDE_STEP_S;
        }
    }
    Slide { distance_m: centre(&x) - start_m, expected_m: block_m }
}

/// Time in which [`slide`] tilts the plate \[s\].
pub const TILTING_S: f64 = 0.3;
/// Time step of a slide \[s\].
const SLIDE_STEP_S: f64 = 5e-3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::elastica::Elastica;

    #[test]
    fn a_cantilever_on_uneven_lines_follows_the_elastica() {
        let (cell_m, along) = (5e-3, 29);
        let fabric = Fabric::from_paper_units([1e6, 1e6, 1e6, 56e3, 56e3, 56e3, 200.0]);
        // even cells score 1.1e-3
        for (rotation_rad, most) in [(0.0, 2e-3), (0.25 * std::f64::consts::PI, 2e-3)] {
            let grid = Grid::uneven_strip(along + 1, 7, cell_m, rotation_rad);
            let mut model = without_plate(&grid, &fabric, &Experiment::default());
            model.held = (0..2 * grid.n).collect();
            let x = flat(&grid);
            let strip = rest(&mut model, x, &fabric, RESIDUAL);
            assert!(strip.at_rest);
            let first_m = grid.flat(grid.n).x - grid.flat(0).x;
            let length_m = along as f64 * cell_m - 0.5 * first_m;
            let weight = fabric.density_kg_m2 * GRAVITY_M_S2;
            let gamma = weight * length_m.powi(3) / fabric.bending_warp_nm;
            let exact = Elastica { gamma, natural: 0.0, softening: 0.0 }.end().unwrap();
            let [reach, droop, _] = strip.end_m().map(|m| m / length_m);
            let error = (droop - exact.droop).hypot(reach - exact.reach);
            println!("gamma {gamma:.0}, rotated by {rotation_rad:.2}: {error:.1e} of the length");
            assert!(error < most, "{rotation_rad}: {error}");
        }
    }
}

//! Springs that guide a sheet to a branch, or tie it there.
//!
//! `E = k/2 sum w |x - p|^2`, or `k/2 sum w (n . (x - p) - o)^2` for a spring that acts along a
//! unit vector n alone, with one distance o by which all of these pull outwards \[J\].

use nalgebra::Matrix3;

use crate::base::Vector3;
use crate::sim::energy::Energy;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// The place that a spring pulls a vertex to.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The vertex.
    pub vertex: usize,
    /// The place, simulation frame \[m\].
    pub position_m: Vector3,
    /// The unit vector along which alone the spring acts; `None` for one that acts along all.
    pub along: Option<Vector3>,
    /// Share of the springs' stiffness that this one has.
    pub weight: f64,
}

/// Weight of a spring to a place with this standard deviation \[m\].
pub(super) fn known(sigma_m: f64) -> f64 {
    1.0 / (1.0 + (sigma_m / HALF_WEIGHT_SIGMA_M).powi(2))
}

/// Standard deviation of a place at which its spring has half the stiffness \[m\]: well above
/// that of an observed place, well below that of a wide bridge.
const HALF_WEIGHT_SIGMA_M: f64 = 0.3e-3;

/// Springs that pull some vertices to places in space.
#[derive(Clone, Debug, Default)]
pub struct Guide {
    /// Where each spring pulls.
    pub targets: Vec<Target>,
    /// Stiffness of a spring of weight 1 \[N/m\].
    pub stiffness_n_m: f64,
    /// How far beyond their places the springs with one direction pull along it \[m\].
    pub outwards_m: f64,
    /// By how much farther from the frame's origin than their places the springs without a
    /// direction pull, as a share \[-\].
    pub farther: f64,
}

impl Guide {
    /// Moves the places that the springs pull to \[m\].
    pub(super) fn move_places(&mut self, by_m: Vector3) {
        self.targets.iter_mut().for_each(|target| target.position_m += by_m);
    }

    /// From where a spring pulls to where its vertex is \[m\].
    fn gap(&self, target: &Target, x: &[Vector3]) -> Vector3 {
        let off = x[target.vertex] - target.position_m;
        match target.along {
            Some(along) => along * (along.dot(&off) - self.outwards_m),
            None => off - target.position_m * self.farther,
        }
    }
}

impl Energy for Guide {
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        let square = |t: &Target| t.weight * self.gap(t, x).norm_squared();
        0.5 * self.stiffness_n_m * self.targets.iter().map(square).sum::<f64>()
    }

    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for target in &self.targets {
            gradient[target.vertex] += self.gap(target, x) * (target.weight * self.stiffness_n_m);
        }
    }

    fn add_hessian(&self, grid: &Grid, _: &[Vector3], _: HessianForm, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        for target in &self.targets {
            let stiffness_n_m = target.weight * self.stiffness_n_m;
            let shape = target.along.map_or_else(Matrix3::identity, |n| n * n.transpose());
            pattern.add_diagonal(values, target.vertex, &(shape * stiffness_n_m));
        }
    }
}

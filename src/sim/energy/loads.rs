//! Loads that do not change with the positions: weight and a draught.
//!
//! `E = sum m g up . x` and `E = - sum f . x` over the vertices \[J\], zero at the origin. Both
//! are linear in the positions and have no Hessian.

use super::Energy;
use crate::base::Vector3;
use crate::base::frame::GRAVITY_M_S2;
use crate::sim::grid::Grid;

/// The weight of the sheet.
#[derive(Clone, Debug)]
pub struct Weight {
    /// The mass that each vertex carries \[kg\].
    pub mass_kg: Vec<f64>,
    /// The unit vector against gravity; it is not y if the plate is tilted.
    pub up: Vector3,
}

impl Energy for Weight {
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        x.iter().zip(&self.mass_kg).map(|(p, m)| m * GRAVITY_M_S2 * self.up.dot(p)).sum()
    }

    fn add_gradient(&self, _: &Grid, _: &[Vector3], gradient: &mut [Vector3]) {
        for (g, m) in gradient.iter_mut().zip(&self.mass_kg) {
            *g += self.up * (m * GRAVITY_M_S2);
        }
    }
}

/// The load of a draught.
#[derive(Clone, Debug)]
pub struct DraughtLoad {
    /// The load on each vertex \[N\]; empty in still air.
    pub load_n: Vec<Vector3>,
}

impl Energy for DraughtLoad {
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        -self.load_n.iter().zip(x).map(|(load, p)| load.dot(p)).sum::<f64>()
    }

    fn add_gradient(&self, _: &Grid, _: &[Vector3], gradient: &mut [Vector3]) {
        for (g, load) in gradient.iter_mut().zip(&self.load_n) {
            *g -= load;
        }
    }
}

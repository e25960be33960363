//! Stretch and shear of all cells (`membrane.rs`), each times its fraction of cloth, with a
//! geometric stiffness that may lag behind the positions.

use super::Energy;
use super::membrane::{Corners, Membrane, Stress};
use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::numeric::sparse::BlockPattern;
use crate::sim::grid::{CELL_PAIRS, Grid};
use crate::sim::hessian_form::HessianForm;

/// The membrane energy on a grid, and the stress of the next Hessian's geometric stiffness.
#[derive(Clone, Debug)]
pub struct MembraneEnergy {
    cells: Vec<Membrane>,
    /// One a cell; empty where it is that of the positions.
    lagged_stress: Vec<Stress>,
}

fn corners(x: &[Vector3], cell: &[u32; 4]) -> Corners {
    cell.map(|v| x[v as usize])
}

impl MembraneEnergy {
    /// The energy of `fabric` on `grid`; `twist_hold` as in [`Membrane::of_cells`].
    #[must_use]
    pub fn new(grid: &Grid, fabric: &Fabric, twist_hold: f64) -> Self {
        Self { cells: Membrane::of_cells(grid, fabric, twist_hold), lagged_stress: Vec::new() }
    }

    /// Sets the stress of the next Hessian's geometric stiffness to that which the linearisation
    /// at `x` predicts after `fraction` of the move `dx`: the geometric stiffness lags one step
    /// behind. See [`Membrane::linearised_stress`].
    pub fn lag_linearised_stress(
        &mut self,
        grid: &Grid,
        x: &[Vector3],
        dx: &[Vector3],
        fraction: f64,
    ) {
        self.lagged_stress.clear();
        for (cell, membrane) in grid.cells.iter().zip(&self.cells) {
            let move_ = corners(dx, cell).map(|d| d * fraction);
            self.lagged_stress.push(membrane.linearised_stress(&corners(x, cell), &move_));
        }
    }

    /// Sets the stress of the next Hessian's geometric stiffness to that at `x`, with `weight`
    /// times the tension that the strain of second order of the last move `dx` would add: the
    /// geometric stiffness lags one step behind. See [`Membrane::second_order_stress`].
    pub fn lag_second_order_stress(
        &mut self,
        grid: &Grid,
        x: &[Vector3],
        dx: &[Vector3],
        weight: f64,
    ) {
        self.lagged_stress.clear();
        for (cell, membrane) in grid.cells.iter().zip(&self.cells) {
            let (corners, move_) = (corners(x, cell), corners(dx, cell));
            self.lagged_stress.push(membrane.second_order_stress(&corners, &move_, weight));
        }
    }

    /// Keeps this part of the compression and of the shear in the next Hessian's geometric
    /// stiffness: of the lagged stress, or of that at `x`.
    pub fn relieve_compression(&mut self, grid: &Grid, x: &[Vector3], kept: f64) {
        if self.lagged_stress.is_empty() {
            for (membrane, cell) in self.cells.iter().zip(&grid.cells) {
                self.lagged_stress.push(membrane.stress(&corners(x, cell)));
            }
        }
        for stress in &mut self.lagged_stress {
            *stress = stress.relieved(kept);
        }
    }

    /// Lets the next Hessian's geometric stiffness be that of the positions it is computed at, so
    /// that the Hessian is the exact one again.
    pub fn forget_lagged_stress(&mut self) {
        self.lagged_stress.clear();
    }
}

impl Energy for MembraneEnergy {
    fn energy_j(&self, grid: &Grid, x: &[Vector3]) -> f64 {
        let cells = grid.cells.iter().zip(&grid.volume_fraction).zip(&self.cells);
        cells.map(|((c, fraction), membrane)| membrane.energy_j(&corners(x, c)) * fraction).sum()
    }

    fn add_gradient(&self, grid: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        let cells = grid.cells.iter().zip(&grid.volume_fraction).zip(&self.cells);
        for ((cell, fraction), membrane) in cells {
            let mut local = [Vector3::zeros(); 4];
            membrane.add_gradient(&corners(x, cell), &mut local);
            for (&v, g) in cell.iter().zip(local) {
                gradient[v as usize] += g * *fraction;
            }
        }
    }

    fn add_hessian(&self, grid: &Grid, x: &[Vector3], form: HessianForm, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        for (index, (cell, slots)) in grid.cells.iter().zip(&grid.cell_slots).enumerate() {
            let mut k = 0;
            let corners = corners(x, cell);
            let membrane = &self.cells[index];
            let lagged = self.lagged_stress.get(index).copied();
            let stress = lagged.unwrap_or_else(|| membrane.stress(&corners));
            let fraction = grid.volume_fraction[index];
            membrane.hessian(&corners, &stress, form, &CELL_PAIRS, |r, c, block| {
                let block = &(block * fraction);
                if r == c {
                    pattern.add_diagonal(values, cell[r] as usize, block);
                } else {
                    BlockPattern::add_block(values, slots[k], block);
                    k += 1;
                }
            });
        }
    }
}

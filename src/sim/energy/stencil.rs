//! A few vertices that an energy couples, with their places in the tangent.

use nalgebra::Matrix3;

use crate::numeric::sparse::{BlockPattern, BlockSlot};
use crate::sim::grid::Grid;

/// Vertices in rising order and the slots of their pairs.
#[derive(Clone, Debug)]
pub(super) struct Stencil {
    pub(super) vertices: Vec<u32>,
    slots: Vec<BlockSlot>,
}

impl Stencil {
    /// Of the given vertices.
    ///
    /// # Panics
    /// If two of them do not couple in the grid's pattern.
    pub(super) fn new(grid: &Grid, vertices: impl IntoIterator<Item = usize>) -> Self {
        let vertices: std::collections::BTreeSet<usize> = vertices.into_iter().collect();
        let vertices: Vec<u32> = vertices.into_iter().map(|v| v as u32).collect();
        let mut slots = Vec::new();
        for (r, &row) in vertices.iter().enumerate() {
            for &column in &vertices[..r] {
                match grid.analysis.pattern().slot(row as usize, column as usize) {
                    Some(slot) => slots.push(slot),
                    None => panic!("vertices {row} and {column} do not couple"),
                }
            }
        }
        Self { vertices, slots }
    }

    /// The weights of a linear combination in the stencil's order.
    pub(super) fn weights(&self, combination: &[(usize, f64)]) -> Vec<f64> {
        let of = |v: u32| {
            combination.iter().filter(|(at, _)| *at == v as usize).map(|(_, weight)| weight).sum()
        };
        self.vertices.iter().map(|&v| of(v)).collect()
    }

    /// Adds `block(r, s)`, r >= s in the stencil's order, to the tangent's values.
    pub(super) fn add_blocks(
        &self,
        pattern: &BlockPattern,
        values: &mut [f64],
        block: impl Fn(usize, usize) -> Matrix3<f64>,
    ) {
        let mut slots = self.slots.iter();
        for (r, &row) in self.vertices.iter().enumerate() {
            for s in 0..r {
                if let Some(slot) = slots.next() {
                    BlockPattern::add_block(values, *slot, &block(r, s));
                }
            }
            pattern.add_diagonal(values, row as usize, &block(r, r));
        }
    }
}

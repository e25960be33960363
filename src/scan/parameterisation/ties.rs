//! Ties between the free edge and the square: points near the edge are pulled so that each
//! side of the parameterised cloth becomes straight.

use super::super::edge;
use super::super::options::ScanOptions;
use super::super::sides::{from_side, to_side};
use super::system::Tie;
use crate::base::boundary::SIDES;

/// Ties that pull points at the free edge so that each side becomes straight.
pub(super) fn to_straight_sides(
    material: &[[f64; 2]],
    half_m: f64,
    options: &ScanOptions,
) -> Vec<Tie> {
    let tuning = &options.tuning.parameterisation;
    let band = -tuning.tied_outward_m..tuning.tied_inward_m;
    let mut ties = Vec::new();
    for side in 0..SIDES {
        let points: Vec<[f64; 2]> = material.iter().map(|&m| to_side(side, m)).collect();
        let edge = edge::measure_bent(&points, half_m, &options.tuning.edge);
        let line = edge.mean_m();
        for (point, p) in points.iter().enumerate() {
            let inward = edge.outward_at(p[0]) - p[1];
            if p[0].abs() < half_m && edge.observed_at(p[0]) && band.contains(&inward) {
                let target = from_side(side, [p[0], line - inward]);
                let coordinate = side % 2;
                ties.push(Tie { point, coordinate, target_m: target[coordinate], weight: 1.0 });
            }
        }
    }
    ties
}

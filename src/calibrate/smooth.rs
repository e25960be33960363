//! How smooth a field on the cloth is expected to be: each number near nothing, and neighbours near
//! each other.

use nalgebra::DMatrix;

use super::effect::{FieldOf, LAYER_NODES, Layers};
use crate::sim::experiment::CURL_NODES;

/// Standard deviations between neighbouring nodes that are tried, in units of [`unit_of`].
pub(super) const STEPS: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0];
/// Standard deviation of a number with any neighbours, in the same units.
const SIGMA: f64 = 1.2;
/// The same of the mean over the cloth of weight and of bending, which are the cloth's own.
const MEAN: f64 = 0.01;

/// A large number of a field: curvature \[1/m\], share of the weight, logarithm of a factor on
/// bending.
pub(super) fn unit_of(of: FieldOf) -> f64 {
    match of {
        FieldOf::CurvatureWeft | FieldOf::CurvatureWarp => 50.0,
        FieldOf::Weight => 0.5,
        FieldOf::Bending => 1.0,
    }
}

/// The precisions of a field's numbers for each of the steps between neighbours that are tried.
pub(super) fn smoothness_of(layers: Layers) -> impl Iterator<Item = DMatrix<f64>> {
    let unit = unit_of(layers[0].0);
    STEPS.into_iter().map(move |step| {
        let mut smooth = smoothness(layers.len(), step * unit, SIGMA * unit);
        if matches!(layers[0].0, FieldOf::Weight | FieldOf::Bending) {
            smooth.add_scalar_mut((MEAN * LAYER_NODES as f64).powi(-2));
        }
        smooth
    })
}

/// The precision of a field's numbers: each from nothing, and neighbours from each other.
fn smoothness(layers: usize, step: f64, sigma: f64) -> DMatrix<f64> {
    let numbers = layers * LAYER_NODES;
    let mut precision = DMatrix::from_diagonal_element(numbers, numbers, sigma.powi(-2));
    let stiff = step.powi(-2);
    let mut spring = |a: usize, b: usize| {
        for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            precision[(row, column)] += sign * stiff;
        }
    };
    for k in 0..numbers {
        if k % CURL_NODES + 1 < CURL_NODES {
            spring(k, k + 1);
        }
        if k / CURL_NODES % CURL_NODES + 1 < CURL_NODES {
            spring(k, k + CURL_NODES);
        }
    }
    precision
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_field_costs_nothing_but_its_size() {
        let even = nalgebra::DVector::from_element(2 * LAYER_NODES, 3.0);
        let cost = even.dot(&(smoothness(2, 0.5, 60.0) * &even));
        assert!((cost - 2.0 * LAYER_NODES as f64 * 9.0 / 60_f64.powi(2)).abs() < 1e-9);
        // one node that stands out pulls at its four neighbours
        let mut node = nalgebra::DVector::zeros(2 * LAYER_NODES);
        node[12] = 2.0;
        let cost = node.dot(&(smoothness(2, 0.5, 60.0) * &node));
        assert!((cost - (4.0 * 4.0 / 0.25 + 4.0 / 60_f64.powi(2))).abs() < 1e-9);
    }
}

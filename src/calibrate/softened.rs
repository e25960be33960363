//! Where the fit of a cloth that softens begins, from the balance of forces on the plain fit's
//! sheets.
//!
//! A plain cloth that was fitted to the drapes of one that softens is too soft to bend by then: its
//! moment is the other's where the sheets are bent, `B' k = B k (1 - s k)`. From there the way to
//! the truth is long and crooked in ln B and s. But the forces on a sheet as it lies are linear in
//! B and in s B, and how a sheet answers forces is known of the plain fit's. So for some s the
//! factors on the three bending stiffnesses under which its sheets come nearest to what was scanned
//! are one linear solution, of any size.
//!
//! In: the least squares around the plain fit's sheets with the three numbers of softening, which
//! are nothing there. Out: shared unknowns.
//!
//! Where it fails: a sheet that would move far answers otherwise, and a curvature beyond the
//! measured ones follows another law ([`crate::sim::experiment::Softening`]); it is a start and no
//! answer.

use nalgebra::{DMatrix, DVector};

use super::effect::{Acts, Number};
use crate::fabric::STIFFNESSES;
use crate::inverse::State;
use crate::sim::sensitivity::Parameter;

/// Softening that is tried, the same in all directions \[m\]; of 618 measured fabrics half have
/// less than 2.7 mm and one of twenty more than 6.
const TRIED_M: [f64; 6] = [1e-3, 2e-3, 3e-3, 4e-3, 5.5e-3, 7e-3];
/// Least and largest logarithm of a factor on bending.
const FACTORS: [f64; 2] = [-0.5, 2.0];
/// Largest change of the other unknowns.
const BESIDE: f64 = 1.0;

/// The softening of each bending stiffness, in their order.
const OF_BENDING: [(usize, Parameter); 3] =
    [(3, Parameter::SofteningWeft), (4, Parameter::SofteningWarp), (5, Parameter::SofteningBias)];

/// A bending stiffness and its softening: their places among the unknowns.
type Pair = (usize, usize);

/// Shared unknowns of a cloth that softens, from those of a state in which it does not; `None`
/// where softening is not among `numbers`, or nothing is nearer with it. `limits` are those of the
/// unknowns.
pub(super) fn softened<D>(
    at: &State<D>,
    numbers: &[&'static Number],
    limits: &[[f64; 2]],
) -> Option<Vec<f64>> {
    let number_of = |parameter: Parameter| {
        let acts = |number: &&'static Number| matches!(number.acts, Acts::Sheet(own) if own.contains(&parameter));
        Some(STIFFNESSES + numbers.iter().position(acts)?)
    };
    let mut pairs: [Pair; 3] = Default::default();
    for (pair, (bending, parameter)) in pairs.iter_mut().zip(OF_BENDING) {
        *pair = (bending, number_of(parameter)?);
    }
    let tried = TRIED_M.into_iter().filter_map(|s_m| {
        let sizes = pairs.map(|(_, own)| s_m / numbers[own - STIFFNESSES].sigma);
        let (change, cost) = softer(at, &pairs, sizes)?;
        Some((cost, change, sizes))
    });
    let (cost, change, sizes) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if cost >= 0.0 {
        return None;
    }
    let step = |k: usize| {
        let is_own = |(bending, own): &Pair| k == *bending || k == *own;
        match pairs.iter().position(is_own) {
            Some(p) if k == pairs[p].0 => {
                (1.0 + change[k]).max(0.1).ln().clamp(FACTORS[0], FACTORS[1])
            }
            Some(p) => sizes[p],
            None => change[k].clamp(-BESIDE, BESIDE),
        }
    };
    let both = at.shared.iter().zip(limits).enumerate();
    Some(both.map(|(k, (value, [low, high]))| (value + step(k)).clamp(*low, *high)).collect())
}

/// The change of all unknowns, of bending as a share of it, beside which softening of these sizes
/// costs least, and by how much the cost changes.
fn softer<D>(at: &State<D>, pairs: &[Pair; 3], sizes: [f64; 3]) -> Option<(DVector<f64>, f64)> {
    let State { normal, priors, right, .. } = at;
    let unknowns = right.len();
    // B (1 + b) k (1 - s k) is linear in b and in (1 + b) s
    let mut into = DMatrix::identity(unknowns, unknowns);
    let mut moved = DVector::zeros(unknowns);
    for ((bending, own), size) in pairs.iter().zip(sizes) {
        into[(*own, *bending)] = size;
        into[(*own, *own)] = 0.0;
        moved[*own] = size;
    }
    let mut matrix = into.tr_mul(&(normal * &into)) + priors;
    let mut cost = moved.dot(&(normal * &moved)) - 2.0 * right.dot(&moved);
    let right = into.tr_mul(&(right - normal * &moved));
    for (_, own) in pairs {
        cost += priors[(*own, *own)] * moved[*own].powi(2);
        matrix[(*own, *own)] = 1.0;
    }
    let change = matrix.clone().cholesky()?.solve(&right);
    cost += change.dot(&(&matrix * &change)) - 2.0 * right.dot(&change);
    Some((change, cost))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::SharedPrior;

    /// Moments of three strips at some curvatures, each with another B and s, seen from plain
    /// strips: unknown are the logarithms of B and s.
    #[test]
    fn strips_that_soften_are_found_from_plain_ones_at_one_go() {
        let curvatures: Vec<f64> = (1..40).map(|k| f64::from(k) * 2.0).collect();
        let (truth, s_m, plain) = ([5.0, 7.0, 6.0], 3e-3, [3.0, 3.5, 4.0]);
        let pairs = [(0, 3), (1, 4), (2, 5)];
        let (mut normal, mut right) = (DMatrix::zeros(6, 6), DVector::zeros(6));
        let mut left = 0.0;
        for strip in 0..3 {
            for k in &curvatures {
                let mut row = DVector::zeros(6);
                // d/d ln B, d/ds
                row[strip] = plain[strip] * k;
                row[3 + strip] = -plain[strip] * k * k;
                let off = truth[strip] * k * (1.0 - s_m * k) - plain[strip] * k;
                normal.ger(1.0, &row, &row, 1.0);
                right.axpy(off, &row, 1.0);
                left += off * off;
            }
        }
        let (precision, none) = (DMatrix::identity(6, 6) * 1e-9, Vec::<()>::new());
        let prior = SharedPrior { precision, right, cost: 0.0 };
        let state = State { normal, ..State::around(vec![0.0; 6], &prior, none, Vec::new()) };
        let (change, cost) = softer(&state, &pairs, [s_m; 3]).unwrap();
        for strip in 0..3 {
            let factor = 1.0 + change[strip];
            assert!((factor * plain[strip] / truth[strip] - 1.0).abs() < 1e-6, "{factor}");
        }
        assert!((cost / left + 1.0).abs() < 1e-6, "{cost} {left}");
        // another softening explains less
        for other in [1e-3, 5e-3] {
            assert!(softer(&state, &pairs, [other; 3]).unwrap().1 > 0.99 * cost);
        }
    }
}

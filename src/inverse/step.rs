//! A damped step of least squares (Marquardt 1963) within limits.

use nalgebra::{DMatrix, DVector};

/// Where a damped step of least squares leads from `at`, the first of its unknowns (the others
/// follow them and have no limits), within their `limits`, and by how much the cost is predicted to
/// fall. `whole` is the normal matrix of data and priors, `right` its right-hand side; the largest
/// change of one of the first unknowns is `longest`.
///
/// An unknown whose step leads beyond a limit goes that far, and the others are solved again with
/// it fixed: a step that is only cut off there predicts nothing of the rest, and a fit would end at
/// its first limit.
pub(super) fn damped_step(
    (whole, right): (&DMatrix<f64>, &DVector<f64>),
    at: &[f64],
    limits: &[[f64; 2]],
    damping: f64,
    longest: f64,
) -> Option<(Vec<f64>, f64)> {
    let mut damped = whole.clone();
    for k in 0..at.len() {
        damped[(k, k)] *= 1.0 + damping;
    }
    let mut held: Vec<Option<f64>> = vec![None; at.len()];
    let mut step = DVector::zeros(right.len());
    for _ in 0..=at.len() {
        step = beside_held((&damped, right), &held)?;
        let largest = step.rows(0, at.len()).amax();
        step *= (longest / largest).min(1.0);
        let is_beyond = |k: &usize| {
            let [low, high] = limits[*k];
            held[*k].is_none() && !(low..=high).contains(&(at[*k] + step[*k]))
        };
        let beyond: Vec<usize> = (0..at.len()).filter(is_beyond).collect();
        let end = |k: usize| (at[k] + step[k]).clamp(limits[k][0], limits[k][1]) - at[k];
        beyond.iter().for_each(|&k| held[k] = Some(end(k)));
        if beyond.is_empty() {
            break;
        }
    }
    let next: Vec<f64> = at
        .iter()
        .zip(limits)
        .enumerate()
        .map(|(k, (value, [low, high]))| (value + step[k]).clamp(*low, *high))
        .collect();
    (0..at.len()).for_each(|k| step[k] = next[k] - at[k]);
    let predicted = 2.0 * right.dot(&step) - step.dot(&(whole * &step));
    Some((next, predicted))
}

/// The step of least squares in which some unknowns change by what is given.
fn beside_held(
    (damped, right): (&DMatrix<f64>, &DVector<f64>),
    held: &[Option<f64>],
) -> Option<DVector<f64>> {
    let is_free = |k: &usize| held.get(*k).is_none_or(|change| change.is_none());
    let free: Vec<usize> = (0..right.len()).filter(is_free).collect();
    if free.len() == right.len() {
        return Some(damped.clone().cholesky()?.solve(right));
    }
    let mut step = DVector::zeros(right.len());
    held.iter().enumerate().for_each(|(k, change)| step[k] = change.unwrap_or(0.0));
    let left = (right - damped * &step).select_rows(&free);
    let own = damped.select_rows(&free).select_columns(&free).cholesky()?.solve(&left);
    free.iter().zip(own.iter()).for_each(|(&k, value)| step[k] = *value);
    Some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_meets_a_limit_goes_on_along_it() {
        // the least of (x - 2)^2 + (x + y - 3)^2 + (y + z - 2)^2 / 4 + z^2 / 9, where z has no
        // limits and x ends at 1
        let rows = [([1.0, 0.0, 0.0], 2.0), ([1.0, 1.0, 0.0], 3.0), ([0.0, 0.5, 0.5], 1.0)];
        let (mut whole, mut right) = (DMatrix::zeros(3, 3), DVector::zeros(3));
        for (row, value) in rows {
            let row = DVector::from_row_slice(&row);
            whole += &row * row.transpose();
            right += row * value;
        }
        whole[(2, 2)] += 1.0 / 9.0;
        let cost = |x: f64, y: f64| {
            // the best z
            let z = 0.25 * (2.0 - y) / (0.25 + 1.0 / 9.0);
            let squares = [(x - 2.0), (x + y - 3.0), 0.5 * (y + z - 2.0), z / 3.0];
            squares.iter().map(|v| v * v).sum::<f64>()
        };
        let limits = [[-9.0, 1.0], [-9.0, 9.0]];
        let (next, predicted) =
            damped_step((&whole, &right), &[0.0, 0.0], &limits, 0.0, 9.0).unwrap();
        assert_eq!(next[0], 1.0);
        let least = (0..=4000)
            .map(|k| f64::from(k) * 1e-3)
            .min_by(|a, b| cost(1.0, *a).total_cmp(&cost(1.0, *b)));
        assert!((next[1] - least.unwrap()).abs() < 1e-3, "{next:?} {least:?}");
        // from zero, z zero too
        let from = 4.0 + 9.0 + 1.0;
        assert!((from - predicted - cost(1.0, next[1])).abs() < 1e-9, "{predicted}");
        // at the limit already, the rest still moves
        let right = &right - &whole * DVector::from_row_slice(&[1.0, 0.0, 0.0]);
        let (next, predicted) =
            damped_step((&whole, &right), &[1.0, 0.0], &limits, 0.0, 9.0).unwrap();
        assert!(next[0] == 1.0 && next[1] > 1.5 && predicted > 1.0, "{next:?} {predicted}");
    }
}

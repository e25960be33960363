//! The residual between drapes and what was measured: its size, and its correlation length.
//!
//! In: drapes compared with their outlines or rims. Out: [`ResidualSize`]. The fit counts one point
//! of a rim on every [`super::options::FitOptions::correlation_length_m`]. Where the residual
//! correlates over more, the fit's intervals are too narrow.

use super::comparison::Comparison;

/// The residual of some drapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualSize {
    /// Root mean square distance, level and across the rim \[m\].
    pub rms_m: f64,
    /// Length along the rim over which its autocorrelation falls to 1/e \[m\].
    pub correlation_length_m: f64,
}

/// The residual of some drapes, each taken around its own mean; `None` where there is none.
#[must_use]
pub fn residual_size<'a>(drapes: impl IntoIterator<Item = &'a Comparison>) -> Option<ResidualSize> {
    let all = drapes.into_iter().map(|comparison| {
        let off_m: Vec<f64> = comparison.rows.iter().map(|row| row.outwards_m).collect();
        (off_m, comparison.measured.length_m() / comparison.rows.len().max(1) as f64)
    });
    of(&all.collect::<Vec<_>>())
}

/// Share of the squares below which what is not the mean is rounding.
const ROUNDING: f64 = 1e-20;

/// Distances at even steps around closed curves, and these steps \[m\].
fn of(curves: &[(Vec<f64>, f64)]) -> Option<ResidualSize> {
    let count: usize = curves.iter().map(|(off_m, _)| off_m.len()).sum();
    let around: Vec<Vec<f64>> = curves
        .iter()
        .map(|(off_m, _)| {
            let mean = off_m.iter().sum::<f64>() / off_m.len().max(1) as f64;
            off_m.iter().map(|m| m - mean).collect()
        })
        .collect();
    let at_lag = |lag: usize| -> f64 {
        let of = |own: &Vec<f64>| -> f64 {
            (0..own.len()).map(|k| own[k] * own[(k + lag) % own.len()]).sum()
        };
        around.iter().map(of).sum()
    };
    let whole = at_lag(0);
    let squares: f64 = curves.iter().flat_map(|(off_m, _)| off_m).map(|m| m * m).sum();
    if whole <= ROUNDING * squares {
        return None;
    }
    let step_m = curves.iter().map(|(_, step_m)| step_m).sum::<f64>() / curves.len() as f64;
    let shortest = curves.iter().map(|(off_m, _)| off_m.len()).min().unwrap_or(0);
    let mut before = 1.0;
    let mut correlation_length_m = step_m * shortest as f64 / 2.0;
    for lag in 1..=shortest / 2 {
        let now = at_lag(lag) / whole;
        let fallen = (-1.0_f64).exp();
        if now <= fallen {
            correlation_length_m = step_m * (lag as f64 - (fallen - now) / (before - now));
            break;
        }
        before = now;
    }
    Some(ResidualSize { rms_m: (squares / count as f64).sqrt(), correlation_length_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_correlates_over_part_of_its_waves() {
        // a wave's autocorrelation is its cosine: 1/e at 0.19 of its length
        let wave = |waves: f64| -> (Vec<f64>, f64) {
            let at = |k: i32| (waves * f64::from(k) / 240.0 * std::f64::consts::TAU).sin();
            ((0..240).map(|k| 2e-3 * at(k)).collect(), 5e-3)
        };
        let found = of(&[wave(4.0), wave(4.0)]).unwrap();
        let expected = (-1.0_f64).exp().acos() / std::f64::consts::TAU * 240.0 * 5e-3 / 4.0;
        assert!((found.rms_m - 2e-3 / 2.0_f64.sqrt()).abs() < 1e-9);
        assert!(
            (found.correlation_length_m / expected - 1.0).abs() < 0.01,
            "{} {expected}",
            found.correlation_length_m
        );
        assert!(of(&[wave(12.0)]).unwrap().correlation_length_m < 0.5 * found.correlation_length_m);
        assert_eq!(of(&[(vec![1e-3; 240], 5e-3)]), None);
        assert_eq!(of(&[]), None);
    }
}

//! Means and their standard errors.

/// Quantile of the standard normal beyond which 5 % lie on each side.
pub const Z90: f64 = 1.6449;

/// Mean; NaN of no values.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean and its standard error; the latter is NaN of fewer than two values.
#[must_use]
pub fn mean_and_error(values: &[f64]) -> [f64; 2] {
    let (count, mean) = (values.len() as f64, mean(values));
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    [mean, (squares / (count - 1.0) / count).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_the_error_of_its_values_and_of_one_value_none() {
        let [mean, error] = mean_and_error(&[1.0, 2.0, 3.0, 6.0]);
        // variance 14 / 3 of four values
        assert!((mean - 3.0).abs() < 1e-15 && (error - (14.0_f64 / 12.0).sqrt()).abs() < 1e-15);
        assert!(mean_and_error(&[2.0])[1].is_nan());
    }
}

//! Medians and the scatter that strays do not inflate.

/// The median of some values; `None` if there are none.
#[must_use]
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The quantile at `share`, 0 to 1, of some values, by the nearest rank; `None` if there are none.
#[must_use]
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let rank = ((values.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// The standard deviation of some values, estimated by 1.4826 times their median absolute
/// deviation, which is the ratio of the two for a normal distribution; `None` if there are no
/// values.
#[must_use]
pub fn sigma(values: &[f64]) -> Option<f64> {
    let middle = median(values.to_vec())?;
    median(values.iter().map(|v| (v - middle).abs()).collect()).map(|mad| 1.4826 * mad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_do_not_move_the_median_nor_the_scatter() {
        let mut values: Vec<f64> = (0..1001).map(|k| f64::from(k) / 1000.0).collect();
        assert!((median(values.clone()).unwrap() - 0.5).abs() < 1e-12);
        let before = sigma(&values).unwrap();
        values.extend([1e9; 5]);
        assert!((sigma(&values).unwrap() - before).abs() < 0.01);
        assert_eq!(quantile(values, 0.0), Some(0.0));
        assert!(median(Vec::new()).is_none() && sigma(&[]).is_none());
    }
}

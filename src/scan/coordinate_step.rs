//! The step in which a file's coordinates are stored, where it is a coarse one.
//!
//! Files store whole numbers of a step (LAS, E57), few digits (text), or single precision with the
//! offsets of a map. All leave coordinates that are multiples of a step.

use crate::base::Point3;
use crate::numeric::robust;

/// Fewer points than this do not show a step.
const LEAST_POINTS: usize = 500;
/// Coordinates with a step take each value several times.
const LEAST_REPEATS: usize = 4;
/// How near the gaps between values are to multiples of the step, as a share of it.
const SLACK: f64 = 0.05;
/// The share of the gaps that are.
const MOST_GAPS: f64 = 0.95;

/// The smallest step of the three axes, in the points' unit; `None` where one of them shows none:
/// points in rows and columns have coordinates of their own across.
pub(super) fn coordinate_step(points: &[Point3]) -> Option<f64> {
    let of_axis = |axis: usize| step(points.iter().map(|p| p[axis]).collect());
    let steps = [of_axis(0)?, of_axis(1)?, of_axis(2)?];
    steps.into_iter().min_by(f64::total_cmp)
}

fn step(mut values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    values.sort_by(f64::total_cmp);
    values.dedup();
    if count < LEAST_POINTS || LEAST_REPEATS * values.len() > count {
        return None;
    }
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = robust::quantile(gaps.clone(), 0.1)?;
    let is_multiple = |gap: &&f64| (**gap / step - (**gap / step).round()).abs() < SLACK;
    let multiples = gaps.iter().filter(is_multiple).count();
    (multiples as f64 >= MOST_GAPS * gaps.len() as f64).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl, in metres.
    fn bowl() -> Vec<Point3> {
        let at = |k: u32| {
            let [x, y] = [0.618_034, 0.754_877].map(|share| (f64::from(k) * share).fract());
            Point3::new(0.4 * x, 0.4 * y, 0.3 * x * x + 0.1 * y * y)
        };
        (0..9409).map(at).collect()
    }

    #[test]
    fn the_step_is_that_of_the_file() {
        assert_eq!(coordinate_step(&bowl()), None);
        let on_grid = |c: f64| (c / 3e-3).round() * 3e-3;
        let rows: Vec<Point3> =
            bowl().iter().map(|p| Point3::new(on_grid(p.x), on_grid(p.y), p.z)).collect();
        assert_eq!(coordinate_step(&rows), None, "points in rows and columns");
        for step in [1e-3, 0.01] {
            let on = |c: f64| (c / step).round() * step + 512_345.25;
            let points: Vec<Point3> =
                bowl().iter().map(|p| Point3::new(on(p.x), on(p.y), on(p.z))).collect();
            let found = coordinate_step(&points).unwrap();
            assert!((found / step - 1.0).abs() < 1e-3, "{found} for {step}");
        }
        let single: Vec<Point3> = bowl()
            .iter()
            .map(|p| Point3::from([p.x, p.y, p.z].map(|c| f64::from((c + 3e5) as f32))))
            .collect();
        assert_eq!(coordinate_step(&single), Some(0.03125));
    }
}

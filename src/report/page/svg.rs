//! What the drawings of a page are made of: paths, scales, ticks.
//!
//! In: numbers in the drawing's own units (CSS pixels of its view box). Out: texts for attributes,
//! with a tenth of a pixel, so that pages stay small and the same numbers give the same bytes.

use super::number::fixed;

/// A coordinate with one decimal, none where it is whole.
#[must_use]
pub fn c(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A path through points.
#[must_use]
pub fn path(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut out = String::new();
    for (k, [x, y]) in points.into_iter().enumerate() {
        out.push(if k == 0 { 'M' } else { 'L' });
        out += &c(x);
        out.push(' ');
        out += &c(y);
    }
    out
}

/// A closed path through points.
#[must_use]
pub fn closed(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    path(points) + "Z"
}

/// Runs of neighbours for which `pick` holds, each with the point before and after it, as one path;
/// `closed` says whether the last point is followed by the first.
#[must_use]
pub fn runs(points: &[[f64; 2]], closed: bool, pick: impl Fn(usize) -> bool) -> String {
    let n = points.len();
    let mut out = String::new();
    let segments = if closed { n } else { n.saturating_sub(1) };
    let mut last = None;
    for k in 0..segments {
        let next = (k + 1) % n;
        if !(pick(k) && pick(next)) {
            continue;
        }
        if last != Some(k) {
            out += &path([points[k]]);
        }
        out += &format!("L{} {}", c(points[next][0]), c(points[next][1]));
        last = Some(next);
    }
    out
}

/// From values to pixels, straight.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Two values.
    pub values: [f64; 2],
    /// Where they lie.
    pub pixels: [f64; 2],
}

impl Scale {
    /// Where a value lies.
    #[must_use]
    pub fn at(&self, value: f64) -> f64 {
        let [a, b] = self.values;
        let [p, q] = self.pixels;
        p + (value - a) / (b - a) * (q - p)
    }
}

/// A round step (1, 2 or 5 times a power of ten) that makes at most `most` parts of `extent`.
#[must_use]
pub fn step(extent: f64, most: usize) -> f64 {
    let least = extent / most.max(1) as f64;
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let power = 10f64.powi(least.log10().floor() as i32);
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    steps.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// Multiples of a round step within two values.
#[must_use]
pub fn ticks([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let step = step(high - low, most);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// [`ticks`] with their labels, all with the decimals that the step needs.
#[must_use]
pub fn labelled(values: [f64; 2], most: usize) -> Vec<(f64, String)> {
    const MOST: usize = 9;
    let step = step(values[1] - values[0], most);
    let is_whole = |decimals: &usize| {
        let units = step * 10f64.powi(*decimals as i32);
        units > 0.5 && (units - units.round()).abs() < 1e-6 * units
    };
    let decimals = (0..MOST).find(is_whole).unwrap_or(MOST);
    ticks(values, most).into_iter().map(|tick| (tick, fixed(tick, decimals))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_short_and_runs_leave_gaps() {
        let square = [[0.0, 0.0], [10.04, 0.0], [10.0, -0.01], [0.0, 10.25]];
        assert_eq!(closed(square), "M0 0L10 0L10 0L0 10.2Z");
        let points: Vec<[f64; 2]> = (0..6).map(|k| [f64::from(k), 0.0]).collect();
        assert_eq!(runs(&points, false, |k| k != 3), "M0 0L1 0L2 0M4 0L5 0");
        assert_eq!(runs(&points, true, |k| k != 3), "M0 0L1 0L2 0M4 0L5 0L0 0");
        assert_eq!(runs(&points, true, |_| false), "");
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([0.0, 14.3], 4), [0.0, 5.0, 10.0]);
        assert_eq!(ticks([-3.0, 3.0], 6), [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]);
        let labels = |values, most| {
            labelled(values, most).into_iter().map(|(_, label)| label).collect::<Vec<_>>()
        };
        assert_eq!(labels([0.0, 2.1], 6), ["0.0", "0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(labels([10.0, 11.6], 6), ["10.0", "10.5", "11.0", "11.5"]);
        assert_eq!(labels([0.0, 14.3], 4), ["0", "5", "10"]);
        assert_eq!(labels([0.0, 0.11], 5), ["0.00", "0.05", "0.10"]);
        assert_eq!(
            labels([-2e-3, 2e-3], 4),
            ["\u{2212}0.002", "\u{2212}0.001", "0.000", "0.001", "0.002"]
        );
        assert_eq!(step(0.7, 4), 0.2);
        assert_eq!(step(0.0, 4), 1.0);
        let scale = Scale { values: [0.0, 10.0], pixels: [100.0, 0.0] };
        assert_eq!(scale.at(2.5), 75.0);
    }
}

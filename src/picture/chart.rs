//! Charts.
//!
//! In: series of numbers. Out: an image. Text is ASCII.

use image::{Rgb, RgbImage};

use super::draw::{line, text};

const WHITE: Rgb<u8> = Rgb([255, 255, 255]);
const INK: Rgb<u8> = Rgb([40, 40, 40]);
const FAINT: Rgb<u8> = Rgb([228, 228, 228]);
/// Colours of series, in order.
pub const COLOURS: [Rgb<u8>; 6] = [
    Rgb([20, 90, 200]),
    Rgb([200, 30, 30]),
    Rgb([30, 140, 60]),
    Rgb([230, 140, 0]),
    Rgb([130, 60, 170]),
    Rgb([110, 110, 110]),
];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Joined by lines.
    Line,
    /// Crosses.
    Cross,
    /// Upright bars: each pair of points is one bar from the first to the second.
    Bar,
}

/// One series.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points in the axes' units.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub mark: Mark,
    /// Colour.
    pub colour: Rgb<u8>,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with the unit.
    pub label: String,
    /// Whether it is logarithmic.
    pub log: bool,
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub series: Vec<Series>,
}

const SIZE: [f64; 2] = [860.0, 560.0];
const LEFT: f64 = 80.0;
const TOP: f64 = 40.0;
const RIGHT: f64 = 20.0;
const BOTTOM: f64 = 56.0;

impl Chart {
    /// Draws it; points that are not finite, or not positive on a logarithmic axis, are
    /// left out.
    #[must_use]
    pub fn draw(&self) -> RgbImage {
        let mut image = RgbImage::from_pixel(SIZE[0] as u32, SIZE[1] as u32, WHITE);
        let x = self.range(0, &self.x);
        let y = self.range(1, &self.y);
        let at = |p: &[f64; 2]| -> Option<[f32; 2]> {
            let (a, b) = (x.part(p[0])?, y.part(p[1])?);
            let px = LEFT + a * (SIZE[0] - LEFT - RIGHT);
            Some([px as f32, (SIZE[1] - BOTTOM - b * (SIZE[1] - TOP - BOTTOM)) as f32])
        };
        for tick in x.ticks() {
            if let (Some(a), Some(b)) = (at(&[tick, y.low]), at(&[tick, y.high])) {
                line(&mut image, a, b, FAINT);
                text(&mut image, a[0] as i32 - 14, a[1] as i32 + 8, &number(tick), INK);
            }
        }
        for tick in y.ticks() {
            if let (Some(a), Some(b)) = (at(&[x.low, tick]), at(&[x.high, tick])) {
                line(&mut image, a, b, FAINT);
                let label = number(tick);
                let left = a[0] as i32 - 9 * label.len() as i32 - 4;
                text(&mut image, left, a[1] as i32 - 4, &label, INK);
            }
        }
        for series in &self.series {
            let points: Vec<_> = series.points.iter().filter_map(at).collect();
            draw_series(&mut image, &points, series);
        }
        for (k, series) in self.series.iter().enumerate() {
            let y = TOP as i32 + 8 + 14 * k as i32;
            text(&mut image, LEFT as i32 + 12, y, &series.name, series.colour);
        }
        text(&mut image, LEFT as i32, 12, &self.title, INK);
        text(&mut image, LEFT as i32, SIZE[1] as i32 - 22, &self.x.label, INK);
        text(&mut image, 8, 26, &self.y.label, INK);
        image
    }

    fn range(&self, coordinate: usize, axis: &Axis) -> Range {
        let values = || {
            self.series
                .iter()
                .flat_map(|s| s.points.iter().map(|p| p[coordinate]))
                .filter(|v| v.is_finite() && (!axis.log || *v > 0.0))
        };
        let (mut low, mut high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if axis.log {
            (low, high) = (low / 1.3, high * 1.3);
        } else {
            let margin = 0.06 * (high - low).max(1e-12);
            (low, high) = (low - margin, high + margin);
        }
        Range { low, high, log: axis.log }
    }
}

fn draw_series(image: &mut RgbImage, points: &[[f32; 2]], series: &Series) {
    match series.mark {
        Mark::Line => {
            for pair in points.windows(2) {
                line(image, pair[0], pair[1], series.colour);
                let below = [pair[0], pair[1]].map(|p| [p[0], p[1] + 1.0]);
                line(image, below[0], below[1], series.colour);
            }
        }
        Mark::Cross => {
            for &[x, y] in points {
                line(image, [x - 4.0, y - 4.0], [x + 4.0, y + 4.0], series.colour);
                line(image, [x - 4.0, y + 4.0], [x + 4.0, y - 4.0], series.colour);
            }
        }
        Mark::Bar => {
            for pair in points.chunks_exact(2) {
                for side in [-1.0, 0.0, 1.0] {
                    let [a, b] = [pair[0], pair[1]].map(|p| [p[0] + side, p[1]]);
                    line(image, a, b, series.colour);
                }
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
    log: bool,
}

impl Range {
    fn part(&self, value: f64) -> Option<f64> {
        let scale = |v: f64| if self.log { v.ln() } else { v };
        let part = (scale(value) - scale(self.low)) / (scale(self.high) - scale(self.low));
        part.is_finite().then_some(part)
    }

    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let first = self.low.log10().floor() as i32;
            let last = self.high.log10().ceil() as i32;
            return (first..=last)
                .flat_map(|k| [1.0, 2.0, 5.0].map(|m| m * 10.0_f64.powi(k)))
                .filter(|t| (self.low..=self.high).contains(t))
                .filter(|t| last - first < 3 || t.log10().fract().abs() < 1e-9)
                .collect();
        }
        let raw = (self.high - self.low) / 6.0;
        let power = 10.0_f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= raw);
        let step = step.unwrap_or(raw);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last).map(|k| k as f64 * step).collect()
    }
}

fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.0e}");
    }
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_draws_its_points_and_survives_bad_ones() {
        let series = |mark| Series {
            name: "s".into(),
            points: vec![[1.0, 1.0], [10.0, f64::NAN], [100.0, 1000.0], [-1.0, 2.0]],
            mark,
            colour: COLOURS[0],
        };
        for mark in [Mark::Line, Mark::Cross, Mark::Bar] {
            let axis = |log| Axis { label: "x".into(), log };
            let image = Chart {
                title: "t".into(),
                x: axis(true),
                y: axis(false),
                series: vec![series(mark)],
            }
            .draw();
            assert!(image.pixels().any(|p| *p == COLOURS[0]), "{mark:?}");
        }
    }
}

//! Charts, drawn by `plotters`.
//!
//! In: series of numbers. Out: an image.

use std::convert::Infallible;
use std::ops::Range;

use image::{Rgb, RgbImage};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::canvas::{Canvas, FINE};
use super::draw::{TEXT_HEIGHT, text, text_width};

const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
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

/// Where the legend stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// In the upper left corner.
    Left,
    /// In the upper right corner.
    Right,
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
    /// Where the legend stands: in the corner that is emptier.
    pub legend: Legend,
}

/// Charts side by side, so many to a row.
///
/// # Panics
/// If there are none to a row.
#[must_use]
pub fn grid(charts: &[Chart], columns: usize) -> RgbImage {
    let rows = charts.len().div_ceil(columns);
    let [width, height] = SIZE;
    let size = [columns as u32 * width, rows as u32 * height];
    let mut all = RgbImage::from_pixel(size[0], size[1], PAPER);
    for (k, chart) in charts.iter().enumerate() {
        let at =
            [(k % columns) as i64 * i64::from(width), (k / columns) as i64 * i64::from(height)];
        image::imageops::replace(&mut all, &chart.draw(), at[0], at[1]);
    }
    all
}

/// Width and height of a chart in pixels.
const SIZE: [u32; 2] = [860, 560];
/// Room above the axes for the title and the vertical axis' label, in pixels.
const TOP: i32 = 56;
/// Room for the axes' numbers, in pixels.
const NUMBERS: [i32; 2] = [64, 30];
/// Room below for the horizontal axis' label, and on the right, in pixels.
const MARGIN: i32 = 26;
/// Half the width of a cross, in pixels.
const CROSS: i32 = 4;

type Area<'a> = DrawingArea<Canvas<'a>, Shift>;
type Fault = DrawingAreaErrorKind<Infallible>;

impl Chart {
    /// Draws it; points that are not finite, or not positive on a logarithmic axis, are
    /// left out.
    ///
    /// # Panics
    /// Never: drawing on an image in memory cannot fail.
    #[must_use]
    pub fn draw(&self) -> RgbImage {
        let mut image = RgbImage::from_pixel(SIZE[0], SIZE[1], PAPER);
        let (x, y) = (self.range(0, &self.x), self.range(1, &self.y));
        let area = Canvas(&mut image).into_drawing_area();
        let drawn = match (self.x.log, self.y.log) {
            (false, false) => self.plot(&area, x, y),
            (true, false) => self.plot(&area, x.log_scale(), y),
            (false, true) => self.plot(&area, x, y.log_scale()),
            (true, true) => self.plot(&area, x.log_scale(), y.log_scale()),
        };
        drop(area);
        drawn.expect("drawing on an image in memory cannot fail");
        let [width, height] = SIZE.map(|v| v as i32);
        text(&mut image, NUMBERS[0], 8, &self.title, INK);
        text(&mut image, 10, 8 + TEXT_HEIGHT as i32 + 4, &self.y.label, INK);
        let label = text_width(&self.x.label) as i32;
        text(&mut image, width - MARGIN - label, height - MARGIN, &self.x.label, INK);
        image
    }

    fn plot<X, Y>(&self, area: &Area<'_>, x: X, y: Y) -> Result<(), Fault>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let spans = [self.range(0, &self.x), self.range(1, &self.y)].map(|r| r.end - r.start);
        let mut chart = ChartBuilder::on(area)
            .margin_top(TOP * FINE)
            .margin_right(MARGIN * FINE)
            .margin_bottom(MARGIN * FINE)
            .set_label_area_size(LabelAreaPosition::Left, NUMBERS[0] * FINE)
            .set_label_area_size(LabelAreaPosition::Bottom, NUMBERS[1] * FINE)
            .build_cartesian_2d(x, y)?;
        let font = ("sans-serif", TEXT_HEIGHT * FINE as f32).into_font();
        chart
            .configure_mesh()
            .x_labels(9)
            .y_labels(9)
            .x_label_formatter(&|v| number(*v, if self.x.log { v.abs() } else { spans[0] }))
            .y_label_formatter(&|v| number(*v, if self.y.log { v.abs() } else { spans[1] }))
            .label_style(font.clone().color(&paint(INK)))
            .axis_style(pen(INK, 1))
            .bold_line_style(pen(FAINT, 1))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(4 * FINE)
            .draw()?;
        for series in &self.series {
            let pen = pen(series.colour, 2);
            let points = self.drawable(series);
            let points = points.iter().map(|[x, y]| (*x, *y));
            let drawn = match series.mark {
                Mark::Line => chart.draw_series(LineSeries::new(points, pen))?,
                Mark::Cross => {
                    chart.draw_series(points.map(|at| Cross::new(at, CROSS * FINE, pen)))?
                }
                Mark::Bar => {
                    let ends: Vec<_> = points.collect();
                    let pairs = ends.chunks_exact(2).map(<[_]>::to_vec);
                    chart.draw_series(pairs.map(|pair| PathElement::new(pair, pen)))?
                }
            };
            let mark = series.mark;
            drawn.label(&series.name).legend(move |at| key(mark, at, pen));
        }
        chart
            .configure_series_labels()
            .position(match self.legend {
                Legend::Left => SeriesLabelPosition::UpperLeft,
                Legend::Right => SeriesLabelPosition::UpperRight,
            })
            .margin(8 * FINE)
            .legend_area_size(24 * FINE)
            .label_font(font.color(&paint(INK)))
            .background_style(paint(PAPER))
            .border_style(pen(FAINT, 1))
            .draw()
    }

    /// The points of a series that its axes can show.
    fn drawable(&self, series: &Series) -> Vec<[f64; 2]> {
        let shows = |v: f64, axis: &Axis| v.is_finite() && (!axis.log || v > 0.0);
        let points = series.points.iter().copied();
        points.filter(|[x, y]| shows(*x, &self.x) && shows(*y, &self.y)).collect()
    }

    /// What an axis shows: all points, and a margin.
    fn range(&self, coordinate: usize, axis: &Axis) -> Range<f64> {
        let values = || {
            let points = self.series.iter().flat_map(|s| self.drawable(s));
            points.map(|p| p[coordinate])
        };
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return 1.0..10.0;
        }
        if axis.log {
            return low / 1.3..high * 1.3;
        }
        let margin = 0.06 * (high - low).max(1e-12);
        low - margin..high + margin
    }
}

fn paint(colour: Rgb<u8>) -> RGBColor {
    let [r, g, b] = colour.0;
    RGBColor(r, g, b)
}

/// A series' mark in the legend, beside its name.
fn key<B: DrawingBackend>(
    mark: Mark,
    (x, y): (i32, i32),
    pen: ShapeStyle,
) -> DynElement<'static, B, (i32, i32)> {
    let line = |ends| PathElement::new(ends, pen).into_dyn();
    let middle = x + 9 * FINE;
    match mark {
        Mark::Line => line(vec![(x, y), (middle + 9 * FINE, y)]),
        Mark::Cross => Cross::new((middle, y), CROSS * FINE, pen).into_dyn(),
        Mark::Bar => line(vec![(middle, y - 6 * FINE), (middle, y + 6 * FINE)]),
    }
}

/// A line of this many pixels.
fn pen(colour: Rgb<u8>, width: u32) -> ShapeStyle {
    paint(colour).stroke_width(width * FINE as u32)
}

/// A number of an axis with all digits that it needs, where the axis spans `span`.
fn number(value: f64, span: f64) -> String {
    const MOST: usize = 9;
    let (size, off) = (value.abs(), 1e-6 * span);
    if size <= off {
        return "0".to_owned();
    }
    let plain = (1e-3..1e5).contains(&size);
    let written = |digits: usize| {
        if plain { format!("{value:.digits$}") } else { format!("{value:.digits$e}") }
    };
    let is_near = |text: &String| text.parse::<f64>().is_ok_and(|v| (v - value).abs() <= off);
    (0..MOST).map(written).find(is_near).unwrap_or_else(|| written(MOST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_draws_its_points_and_survives_bad_ones() {
        let series = |mark, points: &[[f64; 2]]| Series {
            name: "s".into(),
            points: points.to_vec(),
            mark,
            colour: COLOURS[0],
        };
        let axis = |log| Axis { label: "x".into(), log };
        let chart = |mark, points: &[[f64; 2]], log| Chart {
            title: "t".into(),
            x: axis(log),
            y: axis(false),
            series: vec![series(mark, points)],
            legend: Legend::Left,
        };
        let inked = |image: &RgbImage| image.pixels().filter(|p| **p == COLOURS[0]).count();
        let points = [[1.0, 1.0], [10.0, f64::NAN], [100.0, 1000.0], [-1.0, 2.0]];
        for mark in [Mark::Line, Mark::Cross, Mark::Bar] {
            for log in [false, true] {
                // the legend alone, then the points
                let empty = inked(&chart(mark, &[], log).draw());
                let full = inked(&chart(mark, &points, log).draw());
                assert!(full > empty + 10, "{mark:?} {empty} {full}");
            }
        }
    }

    #[test]
    fn charts_stand_side_by_side_row_by_row() {
        let chart = |colour: usize| Chart {
            title: "t".into(),
            x: Axis { label: "x".into(), log: false },
            y: Axis { label: "y".into(), log: false },
            series: vec![Series {
                name: "s".into(),
                points: vec![[0.0, 0.0], [1.0, 1.0]],
                mark: Mark::Line,
                colour: COLOURS[colour],
            }],
            legend: Legend::Right,
        };
        let all = grid(&[chart(0), chart(1), chart(2)], 2);
        assert_eq!([all.width(), all.height()], [2 * SIZE[0], 2 * SIZE[1]]);
        let of = |colour: usize| {
            let inked = all.enumerate_pixels().filter(|(.., p)| **p == COLOURS[colour]);
            inked.map(|(x, y, _)| [x / SIZE[0], y / SIZE[1]]).collect::<Vec<_>>()
        };
        for (colour, place) in [[0, 0], [1, 0], [0, 1]].into_iter().enumerate() {
            let found = of(colour);
            assert!(found.len() > 100 && found.iter().all(|at| *at == place), "{colour}");
        }
    }

    #[test]
    fn numbers_have_the_digits_that_they_need() {
        let of = |values: &[f64], span: f64| {
            values.iter().map(|value| number(*value, span)).collect::<Vec<_>>()
        };
        assert_eq!(of(&[0.0, -1e-17, 0.5, 1.0], 1.0), ["0", "0", "0.5", "1"]);
        assert_eq!(of(&[10.0, 10.5, 11.0, 0.1 + 0.2], 1.2), ["10", "10.5", "11", "0.3"]);
        assert_eq!(of(&[0.001, 0.0015, 0.0005], 2e-3), ["0.001", "0.0015", "5e-4"]);
        assert_eq!(of(&[250_000.0, 300_000.0, 100.0], 1e5), ["2.5e5", "3e5", "100"]);
    }
}

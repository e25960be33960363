//! Charts and pictures of `evaluate physics`.
//!
//! In: series of numbers, or a mesh in metres. Out: an image. Text is ASCII.

use image::{Rgb, RgbImage};

use super::overlay::{line, text};
use crate::geom::Mesh;

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

/// A shaded picture of a mesh, looked at from `azimuth_rad` around the vertical (0: along
/// -x) and `elevation_rad` above the horizon, without perspective. Faces are blue, backs
/// ochre.
#[must_use]
pub fn picture(mesh: &Mesh, azimuth_rad: f64, elevation_rad: f64) -> RgbImage {
    const PIXELS: u32 = 560;
    let (sin_a, cos_a) = azimuth_rad.sin_cos();
    let (sin_e, cos_e) = elevation_rad.sin_cos();
    let view: Vec<[f64; 3]> = mesh
        .vertices
        .iter()
        .map(|p| {
            let (right, toward) = (p.x * sin_a - p.z * cos_a, p.x * cos_a + p.z * sin_a);
            [right, p.y * cos_e - toward * sin_e, p.y * sin_e + toward * cos_e]
        })
        .collect();
    let used = || mesh.triangles.iter().flatten().map(|&v| view[v as usize]);
    let bound = |c: usize, f: fn(f64, f64) -> f64, from: f64| used().map(|p| p[c]).fold(from, f);
    let (low, high) = ([0, 1], f64::INFINITY);
    let [left, bottom] = low.map(|c| bound(c, f64::min, high));
    let [right, top] = low.map(|c| bound(c, f64::max, -high));
    let scale = 0.92 * f64::from(PIXELS) / (right - left).max(top - bottom);
    let middle = 0.5 * f64::from(PIXELS);
    let pixel = |p: [f64; 3]| {
        let x = middle + (p[0] - 0.5 * (left + right)) * scale;
        [x, middle - (p[1] - 0.5 * (bottom + top)) * scale, p[2]]
    };
    let mut image = RgbImage::from_pixel(PIXELS, PIXELS, WHITE);
    let mut depth = vec![f64::NEG_INFINITY; (PIXELS * PIXELS) as usize];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| pixel(view[v as usize]));
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal = (b - a).cross(&(c - a));
        fill(&mut image, &mut depth, &corners, normal / normal.norm().max(1e-300));
    }
    image
}

fn fill(
    image: &mut RgbImage,
    depth: &mut [f64],
    corners: &[[f64; 3]; 3],
    normal: crate::base::Vector3,
) {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 {
        return;
    }
    let light = crate::base::Vector3::new(0.45, 0.75, 0.49);
    let shade = 0.35 + 0.65 * normal.dot(&light).abs();
    // counter-clockwise towards the eye is clockwise on the screen
    let base = if area < 0.0 { [150.0, 180.0, 225.0] } else { [225.0, 195.0, 140.0] };
    let colour = Rgb(base.map(|c: f64| (c * shade).min(255.0) as u8));
    let (width, height) = (image.width() as usize, image.height() as usize);
    let span = |k: usize, limit: usize| {
        let low = corners.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min).floor().max(0.0);
        let high = corners.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max).ceil();
        low as usize..(high.max(0.0) as usize + 1).min(limit)
    };
    for y in span(1, height) {
        for x in span(0, width) {
            let p = [x as f64, y as f64];
            let part = |q: &[f64; 3], r: &[f64; 3]| {
                ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / area
            };
            let (u, v, w) = (part(b, c), part(c, a), part(a, b));
            let z = u * a[2] + v * b[2] + w * c[2];
            if u >= -1e-9 && v >= -1e-9 && w >= -1e-9 && z > depth[y * width + x] {
                depth[y * width + x] = z;
                image.put_pixel(x as u32, y as u32, colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Point3;

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

    #[test]
    fn a_picture_shows_the_face_from_above_and_the_back_from_below() {
        let vertices = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
        let mesh = Mesh {
            vertices: vertices.map(|[x, z]| Point3::new(x, 0.0, z)).to_vec(),
            triangles: vec![[0, 1, 2]],
        };
        let bluish = |elevation: f64| {
            let image = picture(&mesh, 0.0, elevation);
            image.pixels().filter(|p| **p != WHITE).all(|p| p[2] > p[0])
        };
        assert!(bluish(1.2) && !bluish(-1.2));
    }
}

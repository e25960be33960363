//! One view of a picture: points of space on a square of pixels, with scale and bearings.

use image::{Rgb, RgbImage};

use crate::base::{Point3, Vector3};
use crate::picture::draw::{TEXT_HEIGHT, line, polygon, stroke, text, text_width};

/// Width of lines of the scene, and of what marks a place \[pixels\].
const WIDTH: f32 = 1.8;
const MARK_WIDTH: f32 = 7.0;
/// Length of the arrows that show the axes, and of an arrow's head \[pixels\].
const AXIS: f32 = 46.0;
const HEAD: f32 = 9.0;

/// How space is looked at, without perspective.
pub(super) struct View {
    /// The direction that is to the right.
    pub right: Vector3,
    /// The direction that is down.
    pub down: Vector3,
    /// Half of what the pane is wide, in the points' unit.
    pub half: f64,
}

/// The axis that is upright in a view, with its name.
pub(super) enum Upright<'a> {
    /// It points up.
    Up(&'a str),
    /// It points down.
    Down(&'a str),
}

/// A square part of an image with a view.
pub(super) struct Pane<'a> {
    image: &'a mut RgbImage,
    corner: [u32; 2],
    pixels: u32,
    view: View,
    /// What is added to the view's coordinates.
    shift: [f64; 2],
}

impl<'a> Pane<'a> {
    /// The pane with its upper left corner at `corner` of the image, `pixels` wide.
    pub fn new(image: &'a mut RgbImage, corner: [u32; 2], pixels: u32, view: View) -> Self {
        Self { image, corner, pixels, view, shift: [0.0; 2] }
    }

    /// Moves what is shown to the right and down, in the points' unit.
    pub fn shift(&mut self, right_and_down: [f64; 2]) {
        self.shift = right_and_down;
    }

    /// Where a point falls in the image; `None` outside of the pane.
    fn pixel(&self, p: &Point3) -> Option<[f32; 2]> {
        let half = self.view.half;
        let place = |axis: &Vector3, shift: f64| (p.coords.dot(axis) + shift + half) / (2.0 * half);
        let at = [place(&self.view.right, self.shift[0]), place(&self.view.down, self.shift[1])];
        let inside = at.iter().all(|share| (0.0..1.0).contains(share));
        inside.then(|| {
            [0, 1].map(|c| (f64::from(self.corner[c]) + at[c] * f64::from(self.pixels)) as f32)
        })
    }

    /// A square dot of `size` pixels.
    pub fn dot(&mut self, p: &Point3, size: u32, color: Rgb<u8>) {
        let Some([x, y]) = self.pixel(p) else { return };
        for (dx, dy) in (0..size).flat_map(|dx| (0..size).map(move |dy| (dx, dy))) {
            let (x, y) = (x as u32 + dx, y as u32 + dy);
            if x < self.image.width() && y < self.image.height() {
                self.image.put_pixel(x, y, color);
            }
        }
    }

    /// A straight line, if both ends are in the pane.
    pub fn line(&mut self, a: &Point3, b: &Point3, color: Rgb<u8>) {
        if let (Some(a), Some(b)) = (self.pixel(a), self.pixel(b)) {
            stroke(self.image, a, b, WIDTH, color);
        }
    }

    /// An arrow with a name beyond its head, if both ends are in the pane.
    pub fn arrow(&mut self, a: &Point3, b: &Point3, name: &str, color: Rgb<u8>) {
        if let (Some(a), Some(b)) = (self.pixel(a), self.pixel(b)) {
            self.pointer(a, b, name, color);
        }
    }

    /// An arrow between two places of the image \[pixels\].
    fn pointer(&mut self, a: [f32; 2], b: [f32; 2], name: &str, color: Rgb<u8>) {
        let [x, y] = [b[0] - a[0], b[1] - a[1]];
        let length = x.hypot(y).max(1.0);
        let along = [x / length, y / length];
        let from_tip = |back: f32, aside: f32| {
            [b[0] - back * along[0] - aside * along[1], b[1] - back * along[1] + aside * along[0]]
        };
        stroke(self.image, a, from_tip(HEAD, 0.0), WIDTH, color);
        let head = [b, from_tip(HEAD, 0.45 * HEAD), from_tip(HEAD, -0.45 * HEAD)];
        polygon(self.image, &head, color);
        let reach = 0.5 * (text_width(name) * along[0].abs() + TEXT_HEIGHT * along[1].abs()) + 4.0;
        self.centred(from_tip(-reach, 0.0), name, color);
    }

    /// A text about a place of the image \[pixels\], on a white ground: it may lie on points.
    fn centred(&mut self, [x, y]: [f32; 2], words: &str, color: Rgb<u8>) {
        let (left, top) = (x - 0.5 * text_width(words), y - 0.5 * TEXT_HEIGHT);
        let [right, bottom] = [x + x - left + 2.0, y + y - top];
        let ground = [[left - 2.0, top], [right, top], [right, bottom], [left - 2.0, bottom]];
        polygon(self.image, &ground, Rgb([255; 3]));
        text(self.image, left as i32, top as i32, words, color);
    }

    /// A circle in the plane of two axes of unit length.
    pub fn circle(&mut self, centre: &Point3, [u, v]: [&Vector3; 2], radius: f64, color: Rgb<u8>) {
        let at = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k) / 96.0;
            centre + (u * angle.cos() + v * angle.sin()) * radius
        };
        (0..96).for_each(|k| self.line(&at(k), &at(k + 1), color));
    }

    /// A place at a share of the pane's half width from its middle, on a bearing seen from
    /// above: counter-clockwise from the right.
    fn on_ring(&self, share: f64, bearing_deg: f64) -> [f32; 2] {
        let middle = 0.5 * f64::from(self.pixels);
        let (sin, cos) = bearing_deg.to_radians().sin_cos();
        let x = f64::from(self.corner[0]) + middle + share * middle * cos;
        let y = f64::from(self.corner[1]) + middle - share * middle * sin;
        [x as f32, y as f32]
    }

    /// Marks and names every thirty degrees of bearing.
    pub fn bearings(&mut self, share: f64, color: Rgb<u8>) {
        for bearing_deg in (0..360).step_by(30) {
            let degrees = f64::from(bearing_deg);
            let [a, b] = [share - 0.02, share].map(|share| self.on_ring(share, degrees));
            line(self.image, a, b, color);
            let at = self.on_ring(share - 0.065, degrees);
            self.centred(at, &format!("{bearing_deg}\u{b0}"), color);
        }
    }

    /// Marks an arc of bearings, its middle and width in degrees, and the way to its middle
    /// unless that is all round; one without width is a thick tick.
    pub fn arc(&mut self, share: f64, [middle_deg, width_deg]: [f64; 2], color: Rgb<u8>) {
        let half_deg = 0.5 * width_deg.max(4.0);
        let steps = (2.0 * half_deg).ceil() as u32;
        let at = |k: u32| middle_deg - half_deg + 2.0 * half_deg * f64::from(k) / f64::from(steps);
        for k in 0..steps {
            let (a, b) = (self.on_ring(share, at(k)), self.on_ring(share, at(k + 1)));
            stroke(self.image, a, b, MARK_WIDTH, color);
        }
        if width_deg < 180.0 {
            let (a, b) = (self.on_ring(0.0, middle_deg), self.on_ring(share, middle_deg));
            stroke(self.image, a, b, WIDTH, color);
        }
    }

    /// The pane's border and title.
    pub fn frame(&mut self, title: &str, color: Rgb<u8>) {
        let [left, top] = self.corner.map(|c| c as f32);
        let [right, bottom] = [left, top].map(|c| c + self.pixels as f32 - 1.0);
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        for k in 0..4 {
            line(self.image, corners[k], corners[(k + 1) % 4], color);
        }
        text(self.image, left as i32 + 12, top as i32 + 10, title, color);
    }

    /// A bar of this length in the lower left corner.
    pub fn scale_bar(&mut self, length: f64, label: &str, color: Rgb<u8>) {
        let [left, top] = self.corner.map(|c| c as f32);
        let y = top + self.pixels as f32 - 18.0;
        let long = (length / (2.0 * self.view.half) * f64::from(self.pixels)) as f32;
        let [a, b] = [left + 16.0, left + 16.0 + long];
        stroke(self.image, [a, y], [b, y], 3.0, color);
        [a, b].iter().for_each(|&x| line(self.image, [x, y - 6.0], [x, y + 6.0], color));
        self.centred([0.5 * (a + b).max(2.0 * a + text_width(label)), y - 16.0], label, color);
    }

    /// Arrows in the lower right corner: what is to the right, and what is up or down.
    pub fn axes(&mut self, right: &str, upright: Upright, color: Rgb<u8>) {
        let [left, top] = self.corner.map(|c| c as f32);
        let pixels = self.pixels as f32;
        let (name, way) = match upright {
            Upright::Up(name) => (name, -1.0),
            Upright::Down(name) => (name, 1.0),
        };
        let start = [left + pixels - 100.0, top + pixels - if way < 0.0 { 22.0 } else { 84.0 }];
        self.pointer(start, [start[0] + AXIS, start[1]], right, color);
        self.pointer(start, [start[0], start[1] + way * AXIS], name, color);
    }
}

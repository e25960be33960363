//! One view of a picture: points of space on a square of pixels, with scale and bearings.

use image::{Rgb, RgbImage};

use crate::base::{Point3, Vector3};
use crate::picture::draw::{line, text};

/// How space is looked at, without perspective.
pub(super) struct View {
    /// The direction that is to the right.
    pub right: Vector3,
    /// The direction that is down.
    pub down: Vector3,
    /// Half of what the pane is wide, in the points' unit.
    pub half: f64,
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
            line(self.image, a, b, color);
            line(self.image, [a[0], a[1] + 1.0], [b[0], b[1] + 1.0], color);
        }
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
            let [x, y] = self.on_ring(share - 0.06, degrees);
            text(self.image, x as i32 - 12, y as i32 - 6, &bearing_deg.to_string(), color);
        }
    }

    /// Marks an arc of bearings, its middle and width in degrees; one without width as a
    /// thick tick.
    pub fn arc(&mut self, share: f64, [middle_deg, width_deg]: [f64; 2], color: Rgb<u8>) {
        let half_deg = 0.5 * width_deg.max(4.0);
        let steps = (2.0 * half_deg).ceil() as u32;
        for ring in 0..8 {
            let share = share + 0.004 * f64::from(ring);
            let at =
                |k: u32| middle_deg - half_deg + 2.0 * half_deg * f64::from(k) / f64::from(steps);
            for k in 0..steps {
                let (a, b) = (self.on_ring(share, at(k)), self.on_ring(share, at(k + 1)));
                line(self.image, a, b, color);
            }
        }
        let (a, b) = (self.on_ring(0.0, middle_deg), self.on_ring(share, middle_deg));
        line(self.image, a, b, color);
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
        let [a, b] = [left + 14.0, left + 14.0 + long];
        for dy in [0.0, 1.0, 2.0] {
            line(self.image, [a, y + dy], [b, y + dy], color);
        }
        [a, b].iter().for_each(|&x| line(self.image, [x, y - 5.0], [x, y + 7.0], color));
        text(self.image, a as i32, y as i32 - 24, label, color);
    }
}

//! A drawing, once: what `svg` and `pdf` write at 1:1.
//!
//! Frame: millimetres of paper from the upper left corner, x to the right, y down. Texts are ASCII
//! in Helvetica, which every PDF reader has and for which browsers take Arial.

/// A colour: red, green, blue.
pub type Ink = [u8; 3];

/// Lines that are cut, and what is read.
pub const BLACK: Ink = [0; 3];
/// Lines that help.
pub const GREY: Ink = [130; 3];
/// The warp.
pub const BLUE: Ink = [30, 80, 190];

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Its width \[mm\].
    pub width_mm: f64,
    /// Its colour.
    pub ink: Ink,
    /// Whether it is dashed.
    pub dashed: bool,
}

impl Pen {
    /// What is cut along, or an outline.
    pub const CUT: Self = Self { width_mm: 0.35, ink: BLACK, dashed: false };
    /// What helps.
    pub const THIN: Self = Self { width_mm: 0.18, ink: GREY, dashed: false };
    /// What is not there, or not to be cut.
    pub const DASHED: Self = Self { width_mm: 0.25, ink: GREY, dashed: true };
}

/// A line or a circle \[mm\].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Straight from point to point, and back to the first if closed.
    Line {
        /// The points.
        points: Vec<[f64; 2]>,
        /// Whether the last is joined to the first.
        closed: bool,
    },
    /// A circle.
    Circle {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius.
        radius: f64,
    },
}

/// Which point of a text is where it is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
}

/// A thing on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A shape.
    Shape {
        /// Its name in the file, for what a reader looks up.
        id: Option<&'static str>,
        /// What it is.
        shape: Shape,
        /// The line, if any.
        pen: Option<Pen>,
        /// What fills it, if anything.
        fill: Option<Ink>,
    },
    /// A line of text.
    Text {
        /// Where its anchor lies on the baseline.
        at: [f64; 2],
        /// Size of the font \[mm\].
        size_mm: f64,
        /// Which point lies there.
        anchor: Anchor,
        /// Whether it runs upwards.
        upwards: bool,
        /// Its colour.
        ink: Ink,
        /// The words.
        text: String,
    },
}

/// A drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Name of its file, without ending.
    pub name: &'static str,
    /// What it is, in a line.
    pub title: String,
    /// Width and height \[mm\].
    pub size_mm: [f64; 2],
    /// What is drawn, in this order.
    pub items: Vec<Item>,
}

impl Sheet {
    /// An empty one.
    #[must_use]
    pub fn new(name: &'static str, title: impl Into<String>, size_mm: [f64; 2]) -> Self {
        Self { name, title: title.into(), size_mm, items: Vec::new() }
    }

    /// Adds a shape that has a name in the file.
    pub fn named(&mut self, id: &'static str, shape: Shape, pen: Pen) {
        self.items.push(Item::Shape { id: Some(id), shape, pen: Some(pen), fill: None });
    }

    /// Adds a line.
    pub fn line(&mut self, points: &[[f64; 2]], pen: Pen) {
        let shape = Shape::Line { points: points.to_vec(), closed: false };
        self.items.push(Item::Shape { id: None, shape, pen: Some(pen), fill: None });
    }

    /// Adds a filled polygon, which may have a name.
    pub fn filled(&mut self, id: Option<&'static str>, points: &[[f64; 2]], ink: Ink) {
        let shape = Shape::Line { points: points.to_vec(), closed: true };
        self.items.push(Item::Shape { id, shape, pen: None, fill: Some(ink) });
    }

    /// Adds a circle.
    pub fn circle(&mut self, centre: [f64; 2], radius: f64, pen: Pen) {
        let shape = Shape::Circle { centre, radius };
        self.items.push(Item::Shape { id: None, shape, pen: Some(pen), fill: None });
    }

    /// Adds a text that begins at a place.
    pub fn text(&mut self, at: [f64; 2], size_mm: f64, text: impl Into<String>) {
        self.words(at, size_mm, Anchor::Start, false, BLACK, text.into());
    }

    /// Adds a text whose middle is at a place.
    pub fn middle(&mut self, at: [f64; 2], size_mm: f64, ink: Ink, text: impl Into<String>) {
        self.words(at, size_mm, Anchor::Middle, false, ink, text.into());
    }

    /// Adds a text that runs upwards, its middle at a place.
    pub fn upwards(&mut self, at: [f64; 2], size_mm: f64, text: impl Into<String>) {
        self.words(at, size_mm, Anchor::Middle, true, BLACK, text.into());
    }

    fn words(
        &mut self,
        at: [f64; 2],
        size_mm: f64,
        anchor: Anchor,
        upwards: bool,
        ink: Ink,
        text: String,
    ) {
        debug_assert!(text.is_ascii(), "{text}");
        self.items.push(Item::Text { at, size_mm, anchor, upwards, ink, text });
    }

    /// Adds a cross with arms of `arm_mm`.
    pub fn cross(&mut self, [x, y]: [f64; 2], arm_mm: f64, pen: Pen) {
        self.line(&[[x - arm_mm, y], [x + arm_mm, y]], pen);
        self.line(&[[x, y - arm_mm], [x, y + arm_mm]], pen);
    }

    /// Adds an arrow.
    pub fn arrow(&mut self, from: [f64; 2], to: [f64; 2], head_mm: f64, pen: Pen) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        let [ux, uy] = along.map(|v| v / length);
        let neck = [to[0] - head_mm * ux, to[1] - head_mm * uy];
        let half = 0.35 * head_mm;
        self.line(&[from, neck], pen);
        let barb = |sign: f64| [neck[0] - sign * half * uy, neck[1] + sign * half * ux];
        self.filled(None, &[to, barb(1.0), barb(-1.0)], pen.ink);
    }

    /// Adds a dimension between two places on one level or one above the other: arrows both ways,
    /// and its text.
    pub fn dimension(&mut self, from: [f64; 2], to: [f64; 2], text: &str) {
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        let pen = Pen { width_mm: 0.18, ink: BLACK, dashed: false };
        self.arrow(middle, from, 2.2, pen);
        self.arrow(middle, to, 2.2, pen);
        if (from[0] - to[0]).abs() > (from[1] - to[1]).abs() {
            self.middle([middle[0], middle[1] - 1.0], 3.0, BLACK, text);
        } else {
            self.upwards([middle[0] - 1.0, middle[1]], 3.0, text);
        }
    }

    /// Adds a ruler of 100 mm and one of an inch, from a place to the right: what a print is
    /// checked with. Takes 144 by 8 mm.
    pub fn ruler(&mut self, [x, y]: [f64; 2]) {
        let pen = Pen { width_mm: 0.2, ink: BLACK, dashed: false };
        let shape =
            |to: f64, from: f64| Shape::Line { points: vec![[from, y], [to, y]], closed: false };
        self.named("ruler-100-mm", shape(x + 100.0, x), pen);
        for step in 0..=20 {
            let at = x + 5.0 * f64::from(step);
            let high = if step % 2 == 0 { 3.0 } else { 1.6 };
            self.line(&[[at, y], [at, y - high]], pen);
        }
        self.text([x, y + 3.6], 2.8, "100 mm: measure it. If it is not 100, print again at 100 %");
        let inch = x + 112.0;
        self.named("ruler-1-inch", shape(inch + 25.4, inch), pen);
        for step in 0..=4 {
            let at = inch + 6.35 * f64::from(step);
            self.line(&[[at, y], [at, y - if step % 4 == 0 { 3.0 } else { 1.6 }]], pen);
        }
        self.text([inch, y + 3.6], 2.8, "1 inch");
    }
}

/// Widths of Helvetica's glyphs from the space on, thousandths of the font's size (Adobe's metrics
/// of the 14 base fonts).
const HELVETICA: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

/// Length of a text \[mm\].
#[must_use]
pub fn length_mm(text: &str, size_mm: f64) -> f64 {
    let width =
        |byte: u8| HELVETICA.get(usize::from(byte).wrapping_sub(32)).copied().unwrap_or(556);
    text.bytes().map(|byte| f64::from(width(byte))).sum::<f64>() * size_mm / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_have_their_printed_length() {
        // W 944, i 222, space 278
        assert!((length_mm("W i", 10.0) - 14.44).abs() < 1e-12);
        assert!((length_mm("~0", 1.0) - 1.14).abs() < 1e-12);
    }
}

//! Lines, dots and text on an image, anti-aliased.
//!
//! Places are in pixels, x to the right and y down, and need not be whole: the centre of
//! the upper left pixel is (0.5, 0.5). Shapes are filled by their exact coverage of each
//! pixel (the rasteriser of `ab_glyph`). The font is DejaVu Sans, which is embedded: it has
//! Latin, Greek, Cyrillic and many signs. What it lacks is drawn as a box; text that runs
//! from right to left or joins its letters is not shaped.

use std::sync::LazyLock;

use ab_glyph::{Font as _, FontRef, GlyphId, PxScaleFont, ScaleFont as _, point};
use ab_glyph_rasterizer::Rasterizer;
use image::{Rgb, RgbImage};

/// The height of a line of ordinary text, from the highest ascender to the lowest descender,
/// in pixels.
pub const TEXT_HEIGHT: f32 = 15.0;

/// How wide a line is unless it is said, in pixels.
pub const LINE_WIDTH: f32 = 1.2;

/// Larger shapes are left out: no picture here is as large.
const LARGEST: f32 = 16_384.0;

static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(dejavu::sans::regular()).expect("the embedded font can be read")
});

/// Draws a line of the ordinary width between two places in pixels.
pub fn line(image: &mut RgbImage, a: [f32; 2], b: [f32; 2], color: Rgb<u8>) {
    stroke(image, a, b, LINE_WIDTH, color);
}

/// Draws a line `width` pixels wide between two places in pixels.
pub fn stroke(image: &mut RgbImage, a: [f32; 2], b: [f32; 2], width: f32, color: Rgb<u8>) {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = along[0].hypot(along[1]);
    if length > 0.0 {
        let half = 0.5 * width / length;
        let [x, y] = [-along[1] * half, along[0] * half];
        let corner = |p: [f32; 2], side: f32| [p[0] + side * x, p[1] + side * y];
        polygon(image, &[corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)], color);
    }
}

/// Draws a line through places in pixels, its joints rounded.
pub fn polyline(image: &mut RgbImage, points: &[[f32; 2]], width: f32, color: Rgb<u8>) {
    for pair in points.windows(2) {
        stroke(image, pair[0], pair[1], width, color);
    }
    if width > 1.0 {
        for &joint in points.iter().skip(1).take(points.len().saturating_sub(2)) {
            dot(image, joint, 0.5 * width, color);
        }
    }
}

/// Draws a filled disc of `radius` pixels around a place in pixels.
pub fn dot(image: &mut RgbImage, centre: [f32; 2], radius: f32, color: Rgb<u8>) {
    let corners = (8.0 + 2.0 * radius.clamp(0.0, 100.0)) as usize;
    let corner = |k: usize| {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / corners as f32).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin]
    };
    polygon(image, &(0..corners).map(corner).collect::<Vec<_>>(), color);
}

/// Fills the polygon with these corners, places in pixels; either way round.
pub fn polygon(image: &mut RgbImage, corners: &[[f32; 2]], color: Rgb<u8>) {
    let bound = |k: usize, fold: fn(f32, f32) -> f32, from: f32| {
        corners.iter().map(|p| p[k]).fold(from, fold)
    };
    let low = [0, 1].map(|k| bound(k, f32::min, f32::INFINITY).floor());
    let high = [0, 1].map(|k| bound(k, f32::max, f32::NEG_INFINITY).ceil());
    // also when a place is not finite, or there is none
    if !(low.iter().chain(&high).all(|v| v.abs() <= LARGEST)) {
        return;
    }
    let [width, height] = [0, 1].map(|k| (high[k] - low[k]) as usize);
    let mut raster = Rasterizer::new(width, height);
    let inside = |p: &[f32; 2]| point(p[0] - low[0], p[1] - low[1]);
    for (k, p) in corners.iter().enumerate() {
        raster.draw_line(inside(p), inside(&corners[(k + 1) % corners.len()]));
    }
    let [left, top] = low.map(|v| v as i32);
    raster.for_each_pixel_2d(|x, y, share| {
        blend(image, left + x as i32, top + y as i32, share, color);
    });
}

/// Writes `text` with its upper left corner at (x, y) in pixels, in the ordinary height.
pub fn text(image: &mut RgbImage, x: i32, y: i32, text: &str, color: Rgb<u8>) {
    write(image, [x as f32, y as f32], TEXT_HEIGHT, text, color);
}

/// How wide `text` is in the ordinary height, in pixels.
#[must_use]
pub fn text_width(text: &str) -> f32 {
    width_of(TEXT_HEIGHT, text)
}

/// Writes `text`, `height` pixels high, with its upper left corner at a place in pixels.
pub fn write(image: &mut RgbImage, at: [f32; 2], height: f32, text: &str, color: Rgb<u8>) {
    let font = FONT.as_scaled(height);
    let baseline = at[1] + font.ascent();
    for (glyph, x) in laid_out(&font, text) {
        let glyph = glyph.with_scale_and_position(height, point(at[0] + x, baseline));
        if let Some(outlined) = font.outline_glyph(glyph) {
            let corner = outlined.px_bounds().min;
            let (left, top) = (corner.x as i32, corner.y as i32);
            outlined.draw(|x, y, share| {
                blend(image, left + x as i32, top + y as i32, share, color);
            });
        }
    }
}

/// How wide `text` is if it is `height` pixels high, in pixels.
#[must_use]
pub fn width_of(height: f32, text: &str) -> f32 {
    let font = FONT.as_scaled(height);
    laid_out(&font, text).last().map_or(0.0, |(glyph, x)| x + font.h_advance(glyph))
}

/// Each character's glyph and where it starts, in pixels from the text's left end.
fn laid_out<'a>(
    font: &'a PxScaleFont<&FontRef<'static>>,
    text: &'a str,
) -> impl Iterator<Item = (GlyphId, f32)> + 'a {
    let mut end = 0.0;
    let mut before = None;
    text.chars().map(move |character| {
        let glyph = font.glyph_id(character);
        let x = end + before.map_or(0.0, |before| font.kern(before, glyph));
        end = x + font.h_advance(glyph);
        before = Some(glyph);
        (glyph, x)
    })
}

/// Lays `share` of a colour over a pixel; nothing outside the image.
fn blend(image: &mut RgbImage, x: i32, y: i32, share: f32, color: Rgb<u8>) {
    let inside = |v: i32, limit: u32| u32::try_from(v).ok().filter(|v| *v < limit);
    let (Some(x), Some(y)) = (inside(x, image.width()), inside(y, image.height())) else { return };
    let share = share.clamp(0.0, 1.0);
    let pixel = image.get_pixel_mut(x, y);
    for (old, new) in pixel.0.iter_mut().zip(color.0) {
        *old = (f32::from(*old) + (f32::from(new) - f32::from(*old)) * share).round() as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Rgb<u8> = Rgb([255; 3]);
    const BLACK: Rgb<u8> = Rgb([0; 3]);

    fn white() -> RgbImage {
        RgbImage::from_pixel(60, 40, WHITE)
    }

    /// How much ink is on a picture, in black pixels.
    fn ink(image: &RgbImage) -> f64 {
        image.pixels().map(|p| f64::from(255 - p[0]) / 255.0).sum()
    }

    #[test]
    fn shapes_have_their_area_wherever_they_lie() {
        for shift in [0.0, 0.25, 0.7] {
            let mut image = white();
            dot(&mut image, [20.0 + shift, 20.0 - shift], 6.0, BLACK);
            let area = std::f64::consts::PI * 36.0;
            assert!((ink(&image) / area - 1.0).abs() < 0.03, "{} {area}", ink(&image));
            let mut image = white();
            stroke(&mut image, [10.0, 5.0 + shift], [50.0, 35.0], 2.0, BLACK);
            let area = f64::from(2.0 * (40.0_f32).hypot(30.0 - shift));
            assert!((ink(&image) / area - 1.0).abs() < 0.01, "{} {area}", ink(&image));
        }
    }

    #[test]
    fn what_lies_outside_is_cut_off_and_what_is_not_finite_left_out() {
        let mut image = white();
        stroke(&mut image, [-30.0, 20.0], [90.0, 20.0], 2.0, BLACK);
        assert!((ink(&image) - 120.0).abs() < 1.0, "{}", ink(&image));
        for place in [[f32::NAN, 5.0], [f32::INFINITY, 5.0], [1e9, 5.0], [-500.0, 5.0]] {
            let mut image = white();
            dot(&mut image, place, 3.0, BLACK);
            line(&mut image, place, place, BLACK);
            assert_eq!(ink(&image), 0.0, "{place:?}");
        }
    }

    #[test]
    fn every_letter_of_a_name_is_drawn_and_takes_its_width() {
        let mut before = 0.0;
        for (k, name) in ["S", "Sä", "Säл", "Säлω", "Säлωß"].into_iter().enumerate() {
            let width = text_width(name);
            assert!(width > before + 4.0, "{name} {width}");
            let mut image = white();
            text(&mut image, 2, 2, name, BLACK);
            let reached = image.enumerate_pixels().filter(|(_, _, p)| p[0] < 128).map(|(x, ..)| x);
            let reached = reached.max().unwrap() as f32;
            assert!(reached > 2.0 + before && reached < 4.0 + width, "{name} {k} {reached}");
            before = width;
        }
    }

    #[test]
    fn a_text_stays_within_its_height() {
        let mut image = white();
        text(&mut image, 2, 10, "Ågjy|", BLACK);
        let rows = image.enumerate_pixels().filter(|(_, _, p)| **p != WHITE).map(|(_, y, _)| y);
        let (top, bottom) = (rows.clone().min().unwrap(), rows.max().unwrap());
        assert!(top >= 10 && bottom as f32 <= 10.0 + TEXT_HEIGHT, "{top} {bottom}");
    }
}

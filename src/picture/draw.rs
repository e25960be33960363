//! Lines and text on an image.

use font8x8::UnicodeFonts as _;
use image::{Rgb, RgbImage};
use imageproc::drawing::draw_antialiased_line_segment_mut;
use imageproc::pixelops::interpolate;

/// Draws a line between two places in pixels.
pub fn line(image: &mut RgbImage, a: [f32; 2], b: [f32; 2], color: Rgb<u8>) {
    let ends = |p: [f32; 2]| (p[0].round() as i32, p[1].round() as i32);
    draw_antialiased_line_segment_mut(image, ends(a), ends(b), color, interpolate);
}

/// Writes `text` with its upper left corner at (x, y) in pixels; what the font lacks is left out.
pub fn text(image: &mut RgbImage, x: i32, y: i32, text: &str, color: Rgb<u8>) {
    for (k, character) in text.chars().enumerate() {
        let Some(glyph) = font8x8::BASIC_FONTS.get(character) else { continue };
        for (row, bits) in glyph.iter().enumerate() {
            for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                let (px, py) = (x + 9 * k as i32 + column, y + row as i32);
                if px >= 0 && py >= 0 && (px as u32) < image.width() && (py as u32) < image.height()
                {
                    image.put_pixel(px as u32, py as u32, color);
                }
            }
        }
    }
}

//! An image as `plotters` draws on it.
//!
//! `plotters` counts in whole units: there are [`FINE`] of them to a pixel, so that curves
//! are smooth.

use std::convert::Infallible;

use image::{Rgb, RgbImage};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

use super::draw::{dot, polygon, polyline, width_of, write};

/// Units of `plotters` in a pixel.
pub(super) const FINE: i32 = 16;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// An image that is drawn on. Everything is opaque or not drawn.
pub(super) struct Canvas<'a>(pub &'a mut RgbImage);

fn pixel((x, y): BackendCoord) -> [f32; 2] {
    [x, y].map(|v| v as f32 / FINE as f32)
}

/// The colour, unless nothing is to be seen of it.
fn seen(color: BackendColor) -> Option<Rgb<u8>> {
    (color.alpha > 0.0).then(|| Rgb(color.rgb.into()))
}

fn width(style: &impl BackendStyle) -> f32 {
    style.stroke_width() as f32 / FINE as f32
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width() * FINE as u32, self.0.height() * FINE as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        let whole = pixel(at).map(|v| v.floor() + 0.5);
        seen(color).into_iter().for_each(|color| dot(self.0, whole, 0.5, color));
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        if fill { self.fill_polygon(corners, style) } else { self.draw_path(corners, style) }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        if let Some(color) = seen(style.color()) {
            let points: Vec<_> = path.into_iter().map(pixel).collect();
            polyline(self.0, &points, width(style), color);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        _fill: bool,
    ) -> Drawn {
        let radius = radius as f32 / FINE as f32;
        seen(style.color()).into_iter().for_each(|color| dot(self.0, pixel(centre), radius, color));
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Drawn {
        if let Some(color) = seen(style.color()) {
            polygon(self.0, &corners.into_iter().map(pixel).collect::<Vec<_>>(), color);
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let height = style.size() as f32 / FINE as f32;
        let [x, y] = pixel(at);
        let left = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => 0.5,
            HPos::Right => 1.0,
        };
        let top = match style.anchor().v_pos {
            VPos::Top => 0.0,
            VPos::Center => 0.5,
            VPos::Bottom => 1.0,
        };
        if let Some(color) = seen(style.color()) {
            let corner = [x - left * width_of(height, text), y - top * height];
            write(self.0, corner, height, text, color);
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let height = style.size() as f32;
        Ok((width_of(height, text).ceil() as u32, height.ceil() as u32))
    }
}

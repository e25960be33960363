//! Sheets as pages of a PDF at 1:1.
//!
//! In: pages of given sizes, each with the parts of sheets that show on it. Out: the file's bytes.
//! One millimetre is 72 / 25.4 points by the first matrix of each page; print dialogues are asked
//! not to scale. Content is not compressed, so that its lengths can be read. Helvetica is not
//! embedded: it is one of the fonts that every reader has.

use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Finish as _, Name, Pdf, Rect, Ref, Str, TextStr};

use super::sheet::{Anchor, Ink, Item, Pen, Shape, length_mm};

/// Points in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// Cubic arcs that a circle is written as; eight are within 4e-6 of its radius.
const ARCS: usize = 8;

/// A page.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Width and height \[mm\].
    pub size_mm: [f64; 2],
    /// What shows on it.
    pub parts: Vec<Placed>,
}

/// Part of a sheet on a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// What is drawn, in the sheet's frame.
    pub items: Vec<Item>,
    /// Where the sheet's upper left corner lies on the page \[mm\].
    pub at_mm: [f64; 2],
    /// Left, top, width and height on the page of what shows; all if not given \[mm\].
    pub clip_mm: Option<[f64; 4]>,
}

/// The pages as a PDF.
#[must_use]
pub fn document(title: &str, pages: &[Page]) -> Vec<u8> {
    let (catalog, tree, font, info) = (Ref::new(1), Ref::new(2), Ref::new(3), Ref::new(4));
    let page_ref = |k: usize| Ref::new(5 + 2 * i32::try_from(k).unwrap_or(0));
    let content_ref = |k: usize| Ref::new(6 + 2 * i32::try_from(k).unwrap_or(0));
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(tree);
    root.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    root.finish();
    pdf.pages(tree)
        .kids((0..pages.len()).map(page_ref))
        .count(i32::try_from(pages.len()).unwrap_or(0));
    pdf.document_info(info).title(TextStr(title)).creator(TextStr("scan2params"));
    pdf.type1_font(font)
        .base_font(Name(b"Helvetica"))
        .encoding_predefined(Name(b"WinAnsiEncoding"));
    for (k, page) in pages.iter().enumerate() {
        let [width, height] = page.size_mm.map(|mm| (mm * POINTS_PER_MM) as f32);
        let mut written = pdf.page(page_ref(k));
        written.media_box(Rect::new(0.0, 0.0, width, height)).parent(tree).contents(content_ref(k));
        written.resources().fonts().pair(Name(b"F"), font);
        written.finish();
        pdf.stream(content_ref(k), &content(page));
    }
    pdf.finish()
}

fn content(page: &Page) -> Vec<u8> {
    let scale = POINTS_PER_MM as f32;
    let mut out = Content::new();
    // From here on millimetres, y down.
    out.transform([scale, 0.0, 0.0, -scale, 0.0, (page.size_mm[1] * POINTS_PER_MM) as f32]);
    out.set_line_cap(LineCapStyle::ButtCap).set_line_join(LineJoinStyle::MiterJoin);
    for part in &page.parts {
        out.save_state();
        if let Some([x, y, width, height]) = part.clip_mm.map(|clip| clip.map(|v| v as f32)) {
            out.rect(x, y, width, height).clip_nonzero().end_path();
        }
        let [x, y] = part.at_mm.map(|v| v as f32);
        out.transform([1.0, 0.0, 0.0, 1.0, x, y]);
        part.items.iter().for_each(|item| draw(&mut out, item));
        out.restore_state();
    }
    out.finish().to_vec()
}

fn draw(out: &mut Content, item: &Item) {
    match item {
        Item::Shape { shape, pen, fill, .. } => {
            if let Some(Pen { width_mm, ink, dashed }) = *pen {
                let [r, g, b] = share(ink);
                out.set_stroke_rgb(r, g, b).set_line_width(width_mm as f32);
                let dashes: &[f32] = if dashed { &[3.0, 1.5] } else { &[] };
                out.set_dash_pattern(dashes.iter().copied(), 0.0);
            }
            if let Some(ink) = *fill {
                let [r, g, b] = share(ink);
                out.set_fill_rgb(r, g, b);
            }
            match shape {
                Shape::Line { points, closed } => {
                    for (k, [x, y]) in points.iter().map(|p| p.map(|v| v as f32)).enumerate() {
                        if k == 0 {
                            out.move_to(x, y)
                        } else {
                            out.line_to(x, y)
                        };
                    }
                    if *closed {
                        out.close_path();
                    }
                }
                Shape::Circle { centre, radius } => circle(out, *centre, *radius),
            }
            match (pen, fill) {
                (Some(_), Some(_)) => out.fill_nonzero_and_stroke(),
                (Some(_), None) => out.stroke(),
                (None, Some(_)) => out.fill_nonzero(),
                (None, None) => out.end_path(),
            };
        }
        Item::Text { at: [x, y], size_mm, anchor, upwards, ink, text } => {
            let back = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => 0.5 * length_mm(text, *size_mm),
            };
            let [r, g, b] = share(*ink);
            out.begin_text().set_font(Name(b"F"), *size_mm as f32).set_fill_rgb(r, g, b);
            // The page's y runs down; letters stand up.
            let matrix = if *upwards {
                [0.0, -1.0, -1.0, 0.0, *x, y + back]
            } else {
                [1.0, 0.0, 0.0, -1.0, x - back, *y]
            };
            out.set_text_matrix(matrix.map(|v| v as f32)).show(Str(text.as_bytes())).end_text();
        }
    }
}

fn circle(out: &mut Content, [cx, cy]: [f64; 2], radius: f64) {
    let step = std::f64::consts::TAU / ARCS as f64;
    let handle = 4.0 / 3.0 * (step / 4.0).tan();
    let place = |angle: f64, along: f64| {
        let (sin, cos) = angle.sin_cos();
        [cx + radius * (cos - along * sin), cy + radius * (sin + along * cos)].map(|v| v as f32)
    };
    let [x, y] = place(0.0, 0.0);
    out.move_to(x, y);
    for k in 0..ARCS {
        let (from, to) = (step * k as f64, step * (k + 1) as f64);
        let ([a, b], [c, d], [x, y]) = (place(from, handle), place(to, -handle), place(to, 0.0));
        out.cubic_to(a, b, c, d, x, y);
    }
    out.close_path();
}

/// Shares of red, green and blue.
fn share(ink: Ink) -> [f32; 3] {
    ink.map(|channel| f32::from(channel) / 255.0)
}

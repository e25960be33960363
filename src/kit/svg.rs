//! A [`Sheet`] as SVG at 1:1: width and height in mm, the user unit a millimetre.

use std::fmt::Write as _;

use super::sheet::{Anchor, Ink, Item, Pen, Shape, Sheet};

/// The drawing as an SVG document.
#[must_use]
pub fn document(sheet: &Sheet) -> String {
    let [width, height] = sheet.size_mm.map(number);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} \
         {height}\" font-family=\"Helvetica, Arial, sans-serif\">\n<title>{}</title>\n<rect width=\"{width}\" \
         height=\"{height}\" fill=\"#fff\"/>\n",
        escaped(&sheet.title)
    );
    for item in &sheet.items {
        out += &written(item);
    }
    out + "</svg>\n"
}

fn written(item: &Item) -> String {
    match item {
        Item::Shape { id, shape, pen, fill } => {
            let id = id.map(|id| format!(" id=\"{id}\"")).unwrap_or_default();
            let style = style(*pen, *fill);
            match shape {
                Shape::Circle { centre: [x, y], radius } => format!(
                    "<circle{id} cx=\"{}\" cy=\"{}\" r=\"{}\"{style}/>\n",
                    number(*x),
                    number(*y),
                    number(*radius)
                ),
                Shape::Line { points, closed } => {
                    let mut path = String::new();
                    for (k, [x, y]) in points.iter().enumerate() {
                        let command = if k == 0 { "M" } else { " L" };
                        // Writing to a string cannot fail.
                        let _ = write!(path, "{command}{} {}", number(*x), number(*y));
                    }
                    let close = if *closed { " Z" } else { "" };
                    format!("<path{id} d=\"{path}{close}\"{style}/>\n")
                }
            }
        }
        Item::Text { at: [x, y], size_mm, anchor, upwards, ink, text } => {
            let [x, y] = [x, y].map(|v| number(*v));
            let anchor = match anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
            };
            let turned = if *upwards {
                format!(" transform=\"rotate(-90 {x} {y})\"")
            } else {
                String::new()
            };
            format!(
                "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"{anchor}{turned}>{}</text>\n",
                number(*size_mm),
                colour(*ink),
                escaped(text)
            )
        }
    }
}

fn style(pen: Option<Pen>, fill: Option<Ink>) -> String {
    let mut style = format!(" fill=\"{}\"", fill.map_or_else(|| "none".to_owned(), colour));
    if let Some(Pen { width_mm, ink, dashed }) = pen {
        let dashes = if dashed { " stroke-dasharray=\"3 1.5\"" } else { "" };
        let width = number(width_mm);
        style += &format!(" stroke=\"{}\" stroke-width=\"{width}\"{dashes}", colour(ink));
    }
    style
}

fn colour([r, g, b]: Ink) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A length to a tenth of a micrometre, without trailing zeros.
fn number(mm: f64) -> String {
    let text = format!("{mm:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

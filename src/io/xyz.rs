//! Lines of `x y z`, as scanners' programs export them (.xyz, .asc, .pts, .txt, .csv).
//!
//! Separated by blanks, commas or semicolons. Lines that start with `#`, `//` or
//! `;` are comments; lines before the first row of numbers may be column titles,
//! and a line with one integer there is a count (.pts). Columns 4 to 6 are a
//! colour if they are integers from 0 to 255 in the first row, 5 to 7 likewise
//! (.pts has an intensity before); else they are normals and left out.

use super::assemble::Raw;
use super::error::shown;
use super::tokens::{lines, number};
use super::{At, Fault};
use crate::base::Point3;

/// Title lines before the first row; more, and the file is something else.
const MOST_TITLES: usize = 32;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let mut raw = Raw::default();
    let mut color_at = None;
    let mut titles = 0;
    for (line, text) in lines(bytes) {
        if text.is_empty() || [&b"#"[..], b"//", b";"].iter().any(|mark| text.starts_with(mark)) {
            continue;
        }
        let words: Vec<&[u8]> = text
            .split(|b| b.is_ascii_whitespace() || matches!(b, b',' | b';'))
            .filter(|word| !word.is_empty())
            .collect();
        let row: Option<Vec<f64>> = words.iter().take(7).map(|word| number(word)).collect();
        match row.as_deref() {
            Some([x, y, z, rest @ ..]) => {
                if raw.points.is_empty() {
                    color_at = color_column(rest);
                }
                if let Some(color) = color_at.and_then(|at| rest.get(at..at + 3)) {
                    raw.colors.push([color[0] as u8, color[1] as u8, color[2] as u8]);
                }
                raw.points.push(Point3::new(*x, *y, *z));
            }
            _ if raw.points.is_empty() && titles < MOST_TITLES => titles += 1,
            _ => {
                let fault = format!(
                    "`{}` is no row of three numbers; export as x y z, one point a line",
                    shown(text)
                );
                return Err(Fault::Layout(fault).at_line(line));
            }
        }
    }
    if raw.colors.len() != raw.points.len() {
        raw.colors.clear();
    }
    Ok(raw)
}

/// Where, after x y z, a colour starts.
fn color_column(rest: &[f64]) -> Option<usize> {
    let is_color = |at: usize| {
        let channels = rest.get(at..at + 3)?;
        channels.iter().all(|c| (0.0..=255.0).contains(c) && c.fract() == 0.0).then_some(at)
    };
    match rest.len() {
        3 => is_color(0),
        4.. => is_color(1),
        _ => None,
    }
}

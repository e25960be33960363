//! Wavefront OBJ: vertices in the file's order, their colours, faces.
//!
//! `v x y z [w] [r g b]` and `f` with `i`, `i/t`, `i//n`, `i/t/n`, negative
//! (relative) indices and polygons; every other statement is left out.
//!
//! Read here and not by `tobj`, which is the oracle of the tests: `tobj` keeps
//! only vertices that a face uses, in the order of their first use, so that a
//! bare cloud is empty and a 61 x 61 drape loses its grid; it holds `f32`; and
//! its errors have no line.

use super::assemble::Raw;
use super::error::shown;
use super::tokens::{lines, number_for, words};
use super::{At, Fault, Place};
use crate::base::Point3;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let mut raw = Raw::default();
    let mut colors = Vec::new();
    let mut corners = Vec::new();
    for (line, text) in lines(bytes) {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => read_vertex(words, line, &mut raw, &mut colors)?,
            Some(b"f") => {
                corners.clear();
                for word in words {
                    corners.push(corner(word, line, &raw)?);
                }
                raw.faces.push(&corners);
            }
            _ => {}
        }
    }
    if raw.points.is_empty() && bytes.contains(&0) {
        let fault = "this is no OBJ text (it has zero bytes); export it again as OBJ or PLY";
        return Err(Fault::Layout(fault.to_owned()).anywhere());
    }
    if colors.len() == raw.points.len() {
        // Colours count from 0 to 1, or from 0 to 255 in some scanners' files.
        let scale = if colors.iter().flatten().any(|c| *c > 1.0) { 1.0 } else { 255.0 };
        raw.colors = colors.iter().map(|c| c.map(|c| (c * scale).round() as u8)).collect();
    }
    Ok(raw)
}

fn read_vertex<'a>(
    words: impl Iterator<Item = &'a [u8]>,
    line: usize,
    raw: &mut Raw,
    colors: &mut Vec<[f32; 3]>,
) -> Result<(), At> {
    let mut values = [0.0; 7];
    let mut count = 0;
    for word in words.take(values.len()) {
        let vertex = raw.points.len() + 1;
        values[count] = number_for(word, Place::Line(line), || format!("vertex {vertex}"))?;
        count += 1;
    }
    let [x, y, z, a, b, c, d] = values;
    if count < 3 {
        let fault = format!("a vertex with {count} of 3 coordinates; export the file again");
        return Err(Fault::Layout(fault).at_line(line));
    }
    match count {
        6 => colors.push([a, b, c].map(|v| v as f32)),
        7 => colors.push([b, c, d].map(|v| v as f32)),
        _ => {}
    }
    raw.points.push(Point3::new(x, y, z));
    Ok(())
}

/// The vertex of a face's corner, counted from 0.
fn corner(word: &[u8], line: usize, raw: &Raw) -> Result<u32, At> {
    let index = word.split(|&b| b == b'/').next().unwrap_or_default();
    let parsed = std::str::from_utf8(index).ok().and_then(|text| text.parse::<i64>().ok());
    let Some(parsed) = parsed else {
        let what = format!("a corner of face {}", raw.faces.next_number());
        return Err(Fault::Number { what, token: shown(word) }.at_line(line));
    };
    let from_zero = if parsed < 0 { parsed + raw.points.len() as i64 } else { parsed - 1 };
    u32::try_from(from_zero).ok().filter(|&index| index != u32::MAX).ok_or_else(|| {
        let (face, vertices) = (raw.faces.next_number(), raw.points.len());
        Fault::FaceIndex { face, index: parsed, vertices }.at_line(line)
    })
}

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
    let joined = joined(bytes);
    for (line, text) in lines(joined.as_deref().unwrap_or(bytes)) {
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
    if is_cut(bytes, &corners, &raw) {
        let fault = "the file ends inside its faces: its last line has no end, and its last face or many vertices are \
                     left over; copy or export it again";
        return Err(Fault::Layout(fault.to_owned()).anywhere());
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

/// Whether a file was cut off inside its faces: it ends within a line, after faces that leave
/// vertices over. `last` has the corners of the last face.
fn is_cut(bytes: &[u8], last: &[u32], raw: &Raw) -> bool {
    /// The share of the vertices that whole meshes leave over at most.
    const LEFT_OVER: f64 = 0.01;
    if last.is_empty() || bytes.ends_with(b"\n") || bytes.ends_with(b"\r") {
        return false;
    }
    let mut used = vec![false; raw.points.len()];
    for &vertex in raw.faces.corners() {
        if let Some(used) = used.get_mut(vertex as usize) {
            *used = true;
        }
    }
    let unused = used.iter().filter(|used| !**used).count() as f64;
    last.len() < 3 || unused > LEFT_OVER * used.len() as f64
}

/// The text with each backslash at a line's end, and that end, as blanks; lines after count on
/// as if they were one, since as many empty lines follow. `None` if there is none.
pub(super) fn joined(bytes: &[u8]) -> Option<Vec<u8>> {
    let continues = |at: usize| {
        let rest = bytes.get(at + 1..).unwrap_or_default();
        (bytes[at] == b'\\' && (rest.starts_with(b"\n") || rest.starts_with(b"\r")))
            .then(|| 1 + usize::from(rest.starts_with(b"\r\n")) + 1)
    };
    if !bytes.contains(&b'\\') {
        return None;
    }
    let (mut text, mut at, mut owed) = (Vec::with_capacity(bytes.len()), 0, 0);
    while let Some(&byte) = bytes.get(at) {
        if let Some(length) = continues(at) {
            text.push(b' ');
            owed += 1;
            at += length;
            continue;
        }
        text.push(byte);
        if byte == b'\n' {
            text.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut owed)));
        }
        at += 1;
    }
    Some(text)
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

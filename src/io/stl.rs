//! STL, binary and ascii: triangles, whose equal corners become one vertex.

use std::collections::HashMap;

use super::assemble::Raw;
use super::tokens::{Tokens, number_for};
use super::{At, Fault};
use crate::base::Point3;

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    // Binary files may start with "solid" too, so the length decides.
    let count =
        bytes.get(80..HEADER_BYTES).and_then(|b| b.first_chunk()).map(|b| u32::from_le_bytes(*b));
    let body = bytes.get(HEADER_BYTES..).unwrap_or_default();
    let whole = count.is_some_and(|n| n as u64 * TRIANGLE_BYTES as u64 == body.len() as u64);
    if whole {
        return Ok(read_binary(body));
    }
    let start = bytes.trim_ascii_start();
    if start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return read_ascii(bytes);
    }
    let needs = u128::from(count.unwrap_or(1)) * TRIANGLE_BYTES as u128;
    let (element, count, has) = ("triangle".to_owned(), u64::from(count.unwrap_or(1)), body.len());
    if needs > has as u128 {
        return Err(Fault::Count { element, count, needs, has }.anywhere());
    }
    let fault = format!("{count} triangles end before the file does; export it again");
    Err(Fault::Layout(fault).at_byte(HEADER_BYTES + needs as usize))
}

/// Corners by their bits.
#[derive(Default)]
struct Weld {
    raw: Raw,
    index_of: HashMap<[u64; 3], u32>,
}

impl Weld {
    fn vertex(&mut self, corner: [f64; 3]) -> u32 {
        // Adding 0 makes the negative zero positive.
        let key = corner.map(|c| (c + 0.0).to_bits());
        let next = u32::try_from(self.raw.points.len()).unwrap_or(u32::MAX);
        *self.index_of.entry(key).or_insert_with(|| {
            self.raw.points.push(Point3::from(corner));
            next
        })
    }
}

fn read_binary(body: &[u8]) -> Raw {
    let mut weld = Weld::default();
    for triangle in body.chunks_exact(TRIANGLE_BYTES) {
        let (floats, _) = triangle.as_chunks::<4>();
        let value = |i: usize| f64::from(f32::from_le_bytes(floats[i]));
        // The first three numbers are the normal.
        let corners = [3, 6, 9].map(|i| weld.vertex([value(i), value(i + 1), value(i + 2)]));
        weld.raw.faces.push(&corners);
    }
    weld.raw
}

fn read_ascii(bytes: &[u8]) -> Result<Raw, At> {
    let mut weld = Weld::default();
    let mut tokens = Tokens::new(bytes, 0, 1);
    let mut corners = Vec::with_capacity(3);
    while let Some(token) = tokens.next() {
        if token.eq_ignore_ascii_case(b"endfacet") {
            weld.raw.faces.push(&corners);
            corners.clear();
        } else if token.eq_ignore_ascii_case(b"vertex") {
            let mut corner = [0.0; 3];
            for value in &mut corner {
                let what = || format!("a corner of facet {}", weld.raw.faces.next_number());
                let token = tokens.next().ok_or_else(|| {
                    let fault = format!("the file ends inside {}; export it again", what());
                    Fault::Layout(fault).at(tokens.place())
                })?;
                *value = number_for(token, tokens.place(), what)?;
            }
            corners.push(weld.vertex(corner));
        }
    }
    Ok(weld.raw)
}

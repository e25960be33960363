//! PLY: ascii and binary of both byte orders.
//!
//! After G. Turk, "The PLY Polygon File Format" (1994), and what sensors make
//! of it: carriage returns, blank or indented header lines, names outside the
//! grammar (CloudCompare), unknown elements and lists, ascii vertices spread
//! over several lines (RealSense), NaN rows, polygons, faces before vertices.
//!
//! `ply-rs-bw` parses the header (cleaned by [`super::ply_header`], for it takes one
//! spelling only). The payload is read here, because that crate reads an ascii
//! element per line, so that RealSense's files fail; it keeps each element as a
//! hash map of its properties, about a kilobyte per vertex; and it has no say
//! over an element's count before it reads. Here each count is held against the
//! bytes that are left before anything is allocated for it.
//!
//! Not read: range grids (listed in [`ReadNotes::ignored`](super::ReadNotes::ignored)); their
//! points are.

use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType};

use super::assemble::Raw;
use super::error::shown;
use super::format::SPLATS;
use super::ply_header::read_header;
use super::tokens::{Tokens, number_for};
use super::{At, Fault, Place};
use crate::base::Point3;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let (header, payload) = read_header(bytes)?;
    match header.encoding {
        Encoding::Ascii => {
            let line = bytes[..payload].iter().filter(|&&b| b == b'\n').count() + 1;
            read_elements(&header, Ascii(Tokens::new(bytes, payload, line)))
        }
        Encoding::BinaryLittleEndian => {
            read_elements(&header, Binary { bytes, position: payload, little: true })
        }
        Encoding::BinaryBigEndian => {
            read_elements(&header, Binary { bytes, position: payload, little: false })
        }
    }
}

/// Where the numbers of a payload come from, one after another.
trait Payload {
    /// The next scalar of type `kind`; `None` at the end of the file.
    fn scalar(&mut self, kind: &ScalarType, element: &str) -> Option<Result<f64, At>>;
    /// Leaves out `count` scalars of type `kind`; `None` at the end of the file.
    fn skip(&mut self, kind: &ScalarType, count: usize) -> Option<()>;
    /// The fewest bytes that a scalar of type `kind` takes.
    fn least_bytes(kind: &ScalarType) -> usize;
    fn remaining(&self) -> usize;
    fn place(&self) -> Place;
}

struct Ascii<'a>(Tokens<'a>);

impl Payload for Ascii<'_> {
    fn scalar(&mut self, _: &ScalarType, element: &str) -> Option<Result<f64, At>> {
        let token = self.0.next()?;
        Some(number_for(token, self.0.place(), || {
            format!("a value of `{}`", shown(element.as_bytes()))
        }))
    }

    fn skip(&mut self, _: &ScalarType, count: usize) -> Option<()> {
        (0..count).try_for_each(|_| self.0.next().map(|_| ()))
    }

    fn least_bytes(_: &ScalarType) -> usize {
        2
    }

    fn remaining(&self) -> usize {
        // The last token needs no blank after it.
        self.0.remaining() + 1
    }

    fn place(&self) -> Place {
        self.0.place()
    }
}

struct Binary<'a> {
    bytes: &'a [u8],
    position: usize,
    little: bool,
}

impl Binary<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut array: [u8; N] = *self.bytes[self.position..].first_chunk()?;
        self.position += N;
        if !self.little {
            array.reverse();
        }
        Some(array)
    }
}

impl Payload for Binary<'_> {
    fn scalar(&mut self, kind: &ScalarType, _: &str) -> Option<Result<f64, At>> {
        Some(Ok(match kind {
            ScalarType::Char => f64::from(i8::from_le_bytes(self.take()?)),
            ScalarType::UChar => f64::from(u8::from_le_bytes(self.take()?)),
            ScalarType::Short => f64::from(i16::from_le_bytes(self.take()?)),
            ScalarType::UShort => f64::from(u16::from_le_bytes(self.take()?)),
            ScalarType::Int => f64::from(i32::from_le_bytes(self.take()?)),
            ScalarType::UInt => f64::from(u32::from_le_bytes(self.take()?)),
            ScalarType::Float => f64::from(f32::from_le_bytes(self.take()?)),
            ScalarType::Double => f64::from_le_bytes(self.take()?),
        }))
    }

    fn skip(&mut self, kind: &ScalarType, count: usize) -> Option<()> {
        let bytes = count.checked_mul(Self::least_bytes(kind))?;
        if bytes > self.remaining() {
            return None;
        }
        self.position += bytes;
        Some(())
    }

    fn least_bytes(kind: &ScalarType) -> usize {
        match kind {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        }
    }

    fn remaining(&self) -> usize {
        self.bytes.len() - self.position
    }

    fn place(&self) -> Place {
        Place::Byte(self.position)
    }
}

fn read_elements<P: Payload>(header: &Header, mut payload: P) -> Result<Raw, At> {
    let mut raw = Raw::default();
    let mut has_vertices = false;
    for element in header.elements.values() {
        check_count::<P>(element, &payload)?;
        match element.name.as_str() {
            "vertex" => {
                has_vertices = true;
                read_vertices(element, &mut payload, &mut raw)?;
            }
            "face" => read_faces(element, &mut payload, &mut raw, Faces::Polygons)?,
            "tristrips" => read_faces(element, &mut payload, &mut raw, Faces::Strips)?,
            _ => {
                raw.ignored.push(element.name.clone());
                skip_element(element, &mut payload)?;
            }
        }
    }
    if has_vertices {
        return Ok(raw);
    }
    let found = header.elements.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    Err(Fault::Layout(format!(
        "the PLY header has no element `vertex` (it has: {}); export the points as vertices",
        shown(found.as_bytes())
    ))
    .anywhere())
}

/// Refuses a count that the rest of the file cannot hold.
fn check_count<P: Payload>(element: &ElementDef, payload: &P) -> Result<(), At> {
    let least: usize = element.properties.values().map(|p| least_bytes::<P>(p)).sum();
    let needs = element.count as u128 * least as u128;
    let has = payload.remaining();
    if needs <= has as u128 {
        return Ok(());
    }
    let (element, count) = (shown(element.name.as_bytes()), element.count as u64);
    Err(Fault::Count { element, count, needs, has }.at(payload.place()))
}

fn least_bytes<P: Payload>(property: &PropertyDef) -> usize {
    match &property.data_type {
        PropertyType::Scalar(kind) | PropertyType::List(kind, _) => P::least_bytes(kind),
    }
}

/// What a property of a vertex is for.
#[derive(Clone, Copy)]
enum Use {
    /// x, y or z.
    Position(usize),
    /// Red, green or blue.
    Color(usize),
    Nothing,
}

impl Use {
    fn of(property: &PropertyDef) -> Self {
        if matches!(property.data_type, PropertyType::List(..)) {
            return Self::Nothing;
        }
        match property.name.as_str() {
            "x" | "X" => Self::Position(0),
            "y" | "Y" => Self::Position(1),
            "z" | "Z" => Self::Position(2),
            "red" | "r" | "diffuse_red" => Self::Color(0),
            "green" | "g" | "diffuse_green" => Self::Color(1),
            "blue" | "b" | "diffuse_blue" => Self::Color(2),
            _ => Self::Nothing,
        }
    }
}

fn read_vertices<P: Payload>(
    element: &ElementDef,
    payload: &mut P,
    raw: &mut Raw,
) -> Result<(), At> {
    let uses: Vec<Use> = element.properties.values().map(Use::of).collect();
    let has_all = |want: fn(&Use) -> Option<usize>| {
        (0..3).all(|axis| uses.iter().any(|used| want(used) == Some(axis)))
    };
    if !has_all(|used| if let Use::Position(axis) = used { Some(*axis) } else { None }) {
        let names = element.properties.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        return Err(Fault::Layout(format!(
            "element `vertex` lacks x, y or z (it has: {}); export positions",
            shown(names.as_bytes())
        ))
        .anywhere());
    }
    let has = |name: &str| element.properties.contains_key(name);
    if has("f_dc_0") && has("rot_0") && has("opacity") {
        return Err(Fault::Layout(format!("the vertices are no points: {SPLATS}")).anywhere());
    }
    let colored = has_all(|used| if let Use::Color(axis) = used { Some(*axis) } else { None });
    let unused = element.properties.values().zip(&uses);
    let unused = unused.filter(|(_, used)| matches!(used, Use::Nothing));
    raw.ignored.extend(unused.map(|(property, _)| property.name.clone()));
    raw.points.reserve_exact(element.count);
    if colored {
        raw.colors.reserve_exact(element.count);
    }
    for number in 0..element.count {
        let mut position = [0.0; 3];
        let mut color = [0; 3];
        for (property, used) in element.properties.values().zip(&uses) {
            match (used, &property.data_type) {
                (Use::Position(axis), PropertyType::Scalar(kind)) => {
                    position[*axis] = scalar(payload, kind, element, number)?;
                }
                (Use::Color(axis), PropertyType::Scalar(kind)) => {
                    color[*axis] = byte(scalar(payload, kind, element, number)?, kind);
                }
                (_, kind) => skip(payload, kind, element, number)?,
            }
        }
        raw.points.push(Point3::from(position));
        if colored {
            raw.colors.push(color);
        }
    }
    Ok(())
}

/// A colour channel as a byte: floats count from 0 to 1, wide integers to 65535.
fn byte(value: f64, kind: &ScalarType) -> u8 {
    let scale = match kind {
        ScalarType::Float | ScalarType::Double => 255.0,
        ScalarType::UShort | ScalarType::Short => 255.0 / 65535.0,
        _ => 1.0,
    };
    (value * scale).round() as u8
}

/// What a list of vertices is.
#[derive(Clone, Copy)]
enum Faces {
    Polygons,
    /// Each vertex makes a triangle with the two before; -1 ends a strip.
    Strips,
}

fn read_faces<P: Payload>(
    element: &ElementDef,
    payload: &mut P,
    raw: &mut Raw,
    faces: Faces,
) -> Result<(), At> {
    let is_corners = |p: &PropertyDef| {
        matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
            && matches!(p.data_type, PropertyType::List(..))
    };
    let mut corners = Vec::new();
    for number in 0..element.count {
        for property in element.properties.values() {
            match &property.data_type {
                PropertyType::List(count, kind) if is_corners(property) => {
                    let count = list_count(payload, count, kind, element, number)?;
                    corners.clear();
                    for _ in 0..count {
                        let index = scalar(payload, kind, element, number)?;
                        if matches!(faces, Faces::Strips) && index == -1.0 {
                            push_strip(&corners, raw);
                            corners.clear();
                        } else {
                            corners.push(vertex_index(index, raw, payload.place())?);
                        }
                    }
                    match faces {
                        Faces::Polygons => raw.faces.push(&corners),
                        Faces::Strips => push_strip(&corners, raw),
                    }
                }
                kind => skip(payload, kind, element, number)?,
            }
        }
    }
    if !element.properties.values().any(is_corners) && element.count > 0 {
        raw.ignored.push(element.name.clone());
    }
    Ok(())
}

/// The triangles of a strip; every second one runs the other way round.
fn push_strip(corners: &[u32], raw: &mut Raw) {
    for (at, three) in corners.windows(3).enumerate() {
        let [a, b, c] = [three[0], three[1], three[2]];
        raw.faces.push(&if at % 2 == 0 { [a, b, c] } else { [b, a, c] });
    }
}

fn vertex_index(index: f64, raw: &Raw, place: Place) -> Result<u32, At> {
    if index >= 0.0 && index < f64::from(u32::MAX) && index.fract() == 0.0 {
        return Ok(index as u32);
    }
    let (face, vertices) = (raw.faces.next_number(), raw.points.len());
    Err(Fault::FaceIndex { face, index: index as i64, vertices }.at(place))
}

fn skip_element<P: Payload>(element: &ElementDef, payload: &mut P) -> Result<(), At> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for number in 0..element.count {
        for property in element.properties.values() {
            skip(payload, &property.data_type, element, number)?;
        }
    }
    Ok(())
}

fn truncated<P: Payload>(payload: &P, element: &ElementDef, number: usize) -> At {
    let (name, count) = (shown(element.name.as_bytes()), element.count);
    Fault::Truncated { element: name, number: number + 1, count }.at(payload.place())
}

fn scalar<P: Payload>(
    payload: &mut P,
    kind: &ScalarType,
    element: &ElementDef,
    number: usize,
) -> Result<f64, At> {
    match payload.scalar(kind, &element.name) {
        Some(value) => value,
        None => Err(truncated(payload, element, number)),
    }
}

fn skip<P: Payload>(
    payload: &mut P,
    kind: &PropertyType,
    element: &ElementDef,
    number: usize,
) -> Result<(), At> {
    let (kind, count) = match kind {
        PropertyType::Scalar(kind) => (kind, 1),
        PropertyType::List(count, kind) => {
            (kind, list_count(payload, count, kind, element, number)?)
        }
    };
    payload.skip(kind, count).ok_or_else(|| truncated(payload, element, number))
}

/// The length of a list, held against the rest of the file.
fn list_count<P: Payload>(
    payload: &mut P,
    count: &ScalarType,
    kind: &ScalarType,
    element: &ElementDef,
    number: usize,
) -> Result<usize, At> {
    let place = payload.place();
    let count = scalar(payload, count, element, number)?;
    let most = payload.remaining() / P::least_bytes(kind);
    if count >= 0.0 && count <= most as f64 && count.fract() == 0.0 {
        return Ok(count as usize);
    }
    let name = shown(element.name.as_bytes());
    Err(Fault::Layout(format!(
        "a list of `{name}` {} announces {count} entries, but at most {most} are left; \
         the file is cut off or damaged: copy or export it again",
        number + 1
    ))
    .at(place))
}

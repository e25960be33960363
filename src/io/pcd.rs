//! PCD (Point Cloud Library), versions .5 to .7: ascii, binary, `binary_compressed`.
//!
//! After PCL's "The PCD file format". Fields x, y, z of any type and size, and a
//! colour packed in `rgb` or `rgba` (0x00RRGGBB, also when its type says float).
//! Organised clouds lose their grid: their holes are NaN, which is dropped. The
//! `VIEWPOINT` is left out, since up is found from the scene.

use super::assemble::Raw;
use super::error::shown;
use super::lzf;
use super::tokens::{Tokens, lines, number, number_for, words};
use super::{At, Fault};
use crate::base::Point3;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let header = Header::read(bytes)?;
    let mut raw = Raw { ignored: header.ignored(), ..Raw::default() };
    match header.encoding {
        Encoding::Ascii => read_ascii(&header, bytes, &mut raw)?,
        Encoding::Binary => {
            let body = &bytes[header.payload..];
            header.check(body.len(), header.stride()?, header.payload)?;
            let stride = header.stride()?;
            read_rows(&header, &mut raw, |field, row| body.get(row * stride + field.offset..));
        }
        Encoding::Compressed => {
            let body = unpack(&header, bytes)?;
            let at = |field: &Field, row: usize| {
                body.get(field.offset * header.points + row * field.bytes()..)
            };
            read_rows(&header, &mut raw, at);
        }
    }
    Ok(raw)
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

/// One field of a point.
struct Field {
    name: String,
    /// Bytes of one value.
    size: usize,
    /// `F`, `I` or `U`.
    kind: u8,
    /// Values of this field per point.
    count: usize,
    /// Bytes of a point before this field.
    offset: usize,
    /// Values of a point before this field.
    column: usize,
}

impl Field {
    fn bytes(&self) -> usize {
        self.size * self.count
    }

    /// The first value of the field, at the start of `bytes`.
    fn value(&self, bytes: &[u8]) -> Option<f64> {
        Some(match (self.kind, self.size) {
            (b'F', 4) => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            (b'F', 8) => f64::from_le_bytes(*bytes.first_chunk()?),
            (b'U', 1) => f64::from(*bytes.first()?),
            (b'U', 2) => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            (b'U', 4) => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            (b'I', 1) => f64::from(*bytes.first()? as i8),
            (b'I', 2) => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            (b'I', 4) => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            (_, 8) if self.kind == b'U' => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            (_, 8) => i64::from_le_bytes(*bytes.first_chunk()?) as f64,
            _ => return None,
        })
    }
}

struct Header {
    fields: Vec<Field>,
    points: usize,
    encoding: Encoding,
    /// Where the payload starts.
    payload: usize,
    /// The payload's first line.
    line: usize,
}

fn layout(line: usize, text: impl Into<String>) -> At {
    Fault::Layout(text.into() + "; export the file again from PCL or convert it to PLY")
        .at_line(line)
}

/// The entries of a header line as numbers.
fn counts(rest: &[&[u8]], line: usize) -> Result<Vec<u64>, At> {
    let parse = |word: &&[u8]| {
        let number = std::str::from_utf8(word).ok().and_then(|text| text.parse::<u64>().ok());
        number.ok_or_else(|| layout(line, format!("`{}` is no count", shown(word))))
    };
    rest.iter().map(parse).collect()
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, At> {
        let mut names = Vec::new();
        let (mut sizes, mut kinds, mut per_point) = (Vec::new(), Vec::new(), Vec::new());
        let (mut points, mut grid) = (None, [None, None]);
        let mut payload = 0;
        for (line, text) in bytes.split_inclusive(|&b| b == b'\n').zip(1..).map(|(t, l)| (l, t)) {
            payload += text.len();
            let words: Vec<&[u8]> = words(text).collect();
            let Some((&key, rest)) = words.split_first() else { continue };
            let one = |rest: &[&[u8]]| counts(rest, line).map(|all| all.first().copied());
            match key {
                b"FIELDS" | b"COLUMNS" => names = rest.iter().map(|n| shown(n)).collect(),
                b"SIZE" => sizes = counts(rest, line)?,
                b"TYPE" => kinds = rest.iter().map(|w| w[0]).collect(),
                b"COUNT" => per_point = counts(rest, line)?,
                b"WIDTH" => grid[0] = one(rest)?,
                b"HEIGHT" => grid[1] = one(rest)?,
                b"POINTS" => points = one(rest)?,
                b"DATA" => {
                    let encoding = match rest.first() {
                        Some(&b"ascii") => Encoding::Ascii,
                        Some(&b"binary") => Encoding::Binary,
                        Some(&b"binary_compressed") => Encoding::Compressed,
                        _ => return Err(layout(line, "DATA is neither ascii nor binary")),
                    };
                    let fields = fields(names, &sizes, &kinds, &per_point, line)?;
                    let on_grid = grid[0].unwrap_or(0).checked_mul(grid[1].unwrap_or(1));
                    let points = points.or(on_grid).and_then(|n| usize::try_from(n).ok());
                    let points =
                        points.ok_or_else(|| layout(line, "POINTS is beyond all bounds"))?;
                    return Ok(Self { fields, points, encoding, payload, line: line + 1 });
                }
                b"VERSION" | b"VIEWPOINT" => {}
                key if key.starts_with(b"#") => {}
                key => return Err(layout(line, format!("`{}` is no PCD header line", shown(key)))),
            }
        }
        Err(layout(lines(bytes).count(), "the PCD header has no DATA line"))
    }

    /// Bytes of a point.
    fn stride(&self) -> Result<usize, At> {
        Ok(self.fields.last().map_or(0, |field| field.offset + field.bytes()))
    }

    /// The first field of one of these names; one without values is none.
    fn field(&self, names: &[&str]) -> Option<&Field> {
        self.fields.iter().find(|field| field.count > 0 && names.contains(&field.name.as_str()))
    }

    fn color(&self) -> Option<&Field> {
        self.field(&["rgb", "rgba"]).filter(|field| field.size == 4)
    }

    fn positions(&self) -> [Option<&Field>; 3] {
        [self.field(&["x"]), self.field(&["y"]), self.field(&["z"])]
    }

    fn ignored(&self) -> Vec<String> {
        let used = ["x", "y", "z", "rgb", "rgba"];
        let names = self.fields.iter().map(|field| field.name.clone());
        names.filter(|name| !used.contains(&name.as_str())).collect()
    }

    /// Refuses a count of points that `has` bytes cannot hold.
    fn check(&self, has: usize, least: usize, at: usize) -> Result<(), At> {
        let (needs, count) = (self.points as u128 * least as u128, self.points as u64);
        if needs <= has as u128 {
            return Ok(());
        }
        Err(Fault::Count { element: "point".to_owned(), count, needs, has }.at_byte(at))
    }
}

fn fields(
    names: Vec<String>,
    sizes: &[u64],
    kinds: &[u8],
    per_point: &[u64],
    line: usize,
) -> Result<Vec<Field>, At> {
    let ones = vec![1; names.len()];
    let per_point = if per_point.is_empty() { &ones } else { per_point };
    if [sizes.len(), kinds.len(), per_point.len()].iter().any(|&len| len != names.len()) {
        return Err(layout(line, "FIELDS, SIZE, TYPE and COUNT differ in length"));
    }
    let (mut offset, mut column) = (0_usize, 0_usize);
    let mut fields = Vec::with_capacity(names.len());
    for (i, name) in names.into_iter().enumerate() {
        let (size, kind) = (sizes[i] as usize, kinds[i]);
        let allowed: &[usize] = if kind == b'F' { &[4, 8] } else { &[1, 2, 4, 8] };
        // A count may be large (descriptors), but not so large that sums overflow.
        let count = usize::try_from(per_point[i]).ok().filter(|&n| n <= 1 << 20);
        let (true, true, Some(count)) = (b"FIU".contains(&kind), allowed.contains(&size), count)
        else {
            return Err(layout(
                line,
                format!("field `{name}` has an impossible SIZE, TYPE or COUNT"),
            ));
        };
        fields.push(Field { name, size, kind, count, offset, column });
        offset += size * count;
        column += count;
    }
    for axis in ["x", "y", "z"] {
        if !fields.iter().any(|field| field.name == axis && field.count > 0) {
            return Err(layout(line, format!("there is no field `{axis}`")));
        }
    }
    Ok(fields)
}

/// Red, green, blue of 0x00RRGGBB.
fn unpacked(color: u32) -> [u8; 3] {
    let [_, red, green, blue] = color.to_be_bytes();
    [red, green, blue]
}

/// Fills `raw` from binary rows; `at` finds the bytes of a field of a row.
fn read_rows<'a>(header: &Header, raw: &mut Raw, at: impl Fn(&Field, usize) -> Option<&'a [u8]>) {
    let color = header.color();
    raw.points.reserve_exact(header.points);
    for row in 0..header.points {
        let value = |field: &Field| at(field, row).and_then(|bytes| field.value(bytes));
        let position = header.positions().map(|field| field.and_then(value).unwrap_or(f64::NAN));
        raw.points.push(Point3::from(position));
        if let Some(field) = color {
            let bytes = at(field, row).and_then(|bytes| bytes.first_chunk());
            raw.colors.push(unpacked(bytes.map_or(0, |b| u32::from_le_bytes(*b))));
        }
    }
}

/// The payload of `binary_compressed`: field after field, each for all points.
fn unpack(header: &Header, bytes: &[u8]) -> Result<Vec<u8>, At> {
    let body = &bytes[header.payload..];
    let damaged = |text: &str| {
        let fault = format!("{text}; the file is cut off or damaged: copy or export it again");
        Fault::Layout(fault).at_byte(header.payload)
    };
    let size = |at: usize| {
        let bytes = body.get(at..).and_then(|b| b.first_chunk()).map(|b| u32::from_le_bytes(*b));
        bytes.map(|n| n as usize).ok_or_else(|| damaged("the compressed data has no sizes"))
    };
    let (packed, length) = (size(0)?, size(4)?);
    let stream = body.get(8..).and_then(|rest| rest.get(..packed));
    let stream = stream.ok_or_else(|| {
        damaged(&format!(
            "{packed} compressed bytes announced, {} left",
            body.len().saturating_sub(8)
        ))
    })?;
    header.check(length, header.stride()?, header.payload)?;
    lzf::unpack(stream, length).ok_or_else(|| damaged("the compressed data does not unpack"))
}

fn read_ascii(header: &Header, bytes: &[u8], raw: &mut Raw) -> Result<(), At> {
    let columns = header.fields.last().map_or(0, |field| field.column + field.count);
    // A token takes two bytes, save for the last one.
    header.check(bytes.len() - header.payload + 1, 2 * columns, header.payload)?;
    if header.points == 0 {
        // Nothing bounds the columns then.
        return Ok(());
    }
    let positions = header.positions();
    let color = header.color();
    let mut tokens = Tokens::new(bytes, header.payload, header.line);
    raw.points.reserve_exact(header.points);
    let mut row = vec![&b""[..]; columns];
    for number in 1..=header.points {
        for value in &mut row {
            *value = tokens.next().ok_or_else(|| {
                let (element, count) = ("point".to_owned(), header.points);
                Fault::Truncated { element, number, count }.at(tokens.place())
            })?;
        }
        let mut position = [f64::NAN; 3];
        for (value, field) in position.iter_mut().zip(positions) {
            let Some(field) = field else { continue };
            let what = || format!("{} of point {number}", field.name);
            *value = number_for(row[field.column], tokens.place(), what)?;
        }
        raw.points.push(Point3::from(position));
        if let Some(field) = color {
            raw.colors.push(unpacked(ascii_color(field, row[field.column])));
        }
    }
    Ok(())
}

/// A packed colour as text: an integer, or the float that has the same bits.
fn ascii_color(field: &Field, token: &[u8]) -> u32 {
    let text = std::str::from_utf8(token).unwrap_or_default();
    if let Ok(packed) = text.parse::<u32>() {
        return packed;
    }
    match (field.kind, number(token)) {
        (b'F', Some(value)) => (value as f32).to_bits(),
        _ => 0,
    }
}

//! LAS, versions 1.0 to 1.4, and LAZ, the same with its points compressed by LASzip.
//!
//! After the ASPRS' "LAS specification 1.4 - R15". In: a file's bytes. Out: each
//! point's whole numbers times the header's scale plus its offset, in f64, so that the
//! offsets of a map's projection cost no digits; colours of the formats that have
//! them. Points that the file withholds (its mark for deleted ones) become NaN,
//! which is dropped.
//!
//! Fails where the header contradicts itself or the file, and where points are damaged
//! (`laz.rs`).

use super::assemble::Raw;
use super::las_header::{Header, field};
use super::{At, laz};
use crate::base::Point3;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let header = Header::read(bytes)?;
    let mut rows = Rows { header: &header, points: Vec::new(), colors: Vec::new() };
    if header.packed {
        laz::unpack(bytes, &header, |record| rows.push(record))?;
    } else {
        let body = &bytes[header.payload..];
        let needs = u128::from(header.points) * header.record as u128;
        header.check(needs, body.len())?;
        // What is left fits into memory, so the count does.
        let records = body.chunks_exact(header.record).take(header.points as usize);
        rows.points.reserve_exact(header.points as usize);
        records.for_each(|record| rows.push(record));
    }
    let colors = eight_bits(&rows.colors);
    Ok(Raw { points: rows.points, colors, ignored: ignored(&header), ..Raw::default() })
}

/// What the points so far are.
struct Rows<'a> {
    header: &'a Header,
    points: Vec<Point3>,
    /// Of 16 bits each.
    colors: Vec<[u16; 3]>,
}

impl Rows<'_> {
    /// Adds a point, of the header's length.
    fn push(&mut self, record: &[u8]) {
        let Header { scale, offset, .. } = self.header;
        let axis = |k: usize| {
            let whole = i32::from_le_bytes(field(record, 4 * k));
            // What does not fit is written as the least number by some programs.
            if whole == i32::MIN { f64::NAN } else { f64::from(whole) * scale[k] + offset[k] }
        };
        let gone = withheld(self.header, record);
        let point = if gone { [f64::NAN; 3] } else { [0, 1, 2].map(axis) };
        self.points.push(Point3::from(point));
        if let Some(at) = self.header.color {
            self.colors.push([0, 2, 4].map(|k| u16::from_le_bytes(field(record, at + k))));
        }
    }
}

/// Colours of 16 bits as the standard wants them, or of 8 where none is larger, as many programs
/// write them.
fn eight_bits(colors: &[[u16; 3]]) -> Vec<[u8; 3]> {
    let wide = colors.iter().flatten().any(|&c| c > 255);
    let shift = if wide { 8 } else { 0 };
    colors.iter().map(|color| color.map(|c| (c >> shift) as u8)).collect()
}

/// Whether the file marks the point as deleted.
fn withheld(header: &Header, record: &[u8]) -> bool {
    let bit = if header.format < 6 { 7 } else { 2 };
    // In 1.0 the whole byte is the class.
    header.minor > 0 && record[15] >> bit & 1 == 1
}

/// The names of what is not read of a point.
fn ignored(header: &Header) -> Vec<String> {
    let with = |formats: &[u8], name: &'static str| {
        formats.contains(&header.format).then(|| name.to_owned())
    };
    let everywhere = ["intensity", "returns", "classification", "scan angle", "user data"];
    let mut names: Vec<String> = everywhere.map(str::to_owned).into();
    names.push("point source".to_owned());
    names.extend(with(&[1, 3, 4, 5, 6, 7, 8, 9, 10], "GPS time"));
    names.extend(with(&[8, 10], "near infrared"));
    names.extend(with(&[4, 5, 9, 10], "waveform"));
    names.extend((header.record > header.least).then(|| "extra bytes".to_owned()));
    names
}

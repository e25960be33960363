//! The boundary vector as a table: `index,side,x_mm,y_mm,z_mm,sigma_mm,observed`, and behind
//! these `warp_known`.
//!
//! 244 rows in the order of [`crate::base::boundary`]; side 0 to 3, `observed`
//! 1 or 0. `warp_known` is the same in all rows: 1 if x is the warp for sure, 0 if weft and warp
//! may be exchanged. It is a column rather than a comment so that programs that read tables by
//! the names of their columns still work; a file without it is taken too, and says
//! nothing. People correct such files by hand, so the reader names the line and
//! takes blanks, and `true` and `false`, but no other order and no other unit.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use csv::ByteRecord;

use super::bytes::text_bytes;
use super::error::shown;
use super::table::{Layout, Rows};
use super::{At, Fault, ReadError, WriteError, atomically};
use crate::base::boundary::{Orientation, POINTS, POINTS_PER_SIDE};
use crate::base::text;
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, BoundaryPoint, Point3};

/// A point that is known no better than this tells nothing: the specimen hangs as deep.
const LARGEST_SIGMA_MM: f64 = 50.0;
/// The first line of a table that does not say whether weft and warp are known.
pub const HEADER: &str = "index,side,x_mm,y_mm,z_mm,sigma_mm,observed";
/// The column that says it.
pub const WARP_COLUMN: &str = "warp_known";

/// A rim from a table, and what the table says of its weft and warp.
#[derive(Clone, Debug, PartialEq)]
pub struct OrientedRim {
    /// The rim, simulation frame.
    pub boundary: Boundary,
    /// Whether x is the warp for sure; `None` if the table does not say.
    pub orientation: Option<Orientation>,
}

/// The table as text, without a word on weft and warp.
#[must_use]
pub fn to_text(boundary: &Boundary) -> String {
    text_of(boundary, None)
}

/// The table as text; with the column [`WARP_COLUMN`] if `orientation` is given.
fn text_of(boundary: &Boundary, orientation: Option<Orientation>) -> String {
    let warp = orientation.map(|known| u8::from(known == Orientation::Given));
    let mut text = HEADER.to_owned();
    if warp.is_some() {
        let _ = write!(text, ",{WARP_COLUMN}");
    }
    text.push('\n');
    for (index, point) in boundary.points().iter().enumerate() {
        let [x, y, z] = (point.position_m / M_PER_MM).coords.into();
        let (side, sigma) = (index / POINTS_PER_SIDE, point.sigma_m / M_PER_MM);
        let observed = u8::from(point.observed);
        // Writing to a string cannot fail.
        let _ = write!(text, "{index},{side},{x:.4},{y:.4},{z:.4},{sigma:.4},{observed}");
        let _ = match warp {
            Some(known) => writeln!(text, ",{known}"),
            None => writeln!(text),
        };
    }
    text
}

/// Writes the table without a word on weft and warp.
///
/// # Errors
/// When the system refuses.
pub fn write(path: impl AsRef<Path>, boundary: &Boundary) -> Result<(), WriteError> {
    atomically(path, |out| out.write_all(to_text(boundary).as_bytes()))
}

/// Writes the table, with whether x is the warp for sure.
///
/// # Errors
/// When the system refuses.
pub fn write_oriented(
    path: impl AsRef<Path>,
    boundary: &Boundary,
    orientation: Orientation,
) -> Result<(), WriteError> {
    atomically(path, |out| out.write_all(text_of(boundary, Some(orientation)).as_bytes()))
}

/// Reads the table back.
///
/// # Errors
/// A missing file, other columns, a cell that is no number, a wrong number or
/// order of rows.
pub fn read(path: impl AsRef<Path>) -> Result<Boundary, ReadError> {
    read_oriented(path).map(|rim| rim.boundary)
}

/// Reads the table back, with what it says of weft and warp.
///
/// # Errors
/// As [`read`], and rows that do not agree on `warp_known`.
pub fn read_oriented(path: impl AsRef<Path>) -> Result<OrientedRim, ReadError> {
    let path = path.as_ref();
    let text = std::fs::read(path).map_err(At::opening);
    text.and_then(|text| parse(&text)).map_err(|at| at.in_file(path))
}

/// Reads the table from bytes; for fuzzing.
///
/// # Errors
/// As [`read`]; the path in the error is `bytes.csv`.
#[doc(hidden)]
pub fn read_bytes(bytes: &[u8]) -> Result<Boundary, ReadError> {
    let rim = parse(bytes).map_err(|at| at.in_file(Path::new("bytes.csv")))?;
    Ok(rim.boundary)
}

/// Whether a file is meant as such a table: a `.csv` that starts with `index,side`.
/// One that cannot be read is none here; who reads it next says why.
#[must_use]
pub fn is_one(path: &Path) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let mut head = [0; 64];
    let mut read = || std::fs::File::open(path)?.read(&mut head);
    named && read().is_ok_and(|length| starts_like_one(&head[..length]))
}

fn starts_like_one(head: &[u8]) -> bool {
    let Ok(head) = text::utf8(head) else { return false };
    let plain: Vec<u8> =
        head.iter().filter(|b| b.is_ascii_graphic() && **b != b'"').copied().collect();
    let starts =
        |title: &[u8]| plain.get(..title.len()).is_some_and(|t| t.eq_ignore_ascii_case(title));
    starts(b"index,side") || starts(b"index;side")
}

fn parse(text: &[u8]) -> Result<OrientedRim, At> {
    let text = text_bytes(text)?;
    let mut rows = Rows::new(&text, Layout::PLAIN);
    let header: Vec<Vec<u8>> = rows
        .next()
        .map(|(_, cells)| cells.iter().map(<[u8]>::to_vec).collect())
        .unwrap_or_default();
    let says_warp = says_warp(&header.join(&b','))?;
    let mut points = Vec::with_capacity(POINTS);
    let mut orientation = None;
    while let Some((line, row)) = rows.next() {
        if points.len() == POINTS {
            let fault = format!("more than {POINTS} rows; remove what was added");
            return Err(Fault::Layout(fault).at_line(line));
        }
        let (point, warp) = parse_row(row, points.len(), line, says_warp)?;
        if !points.is_empty() && warp != orientation {
            let fault =
                format!("{WARP_COLUMN} differs from the rows before; write the same in all");
            return Err(Fault::Layout(fault).at_line(line));
        }
        orientation = warp;
        points.push(point);
    }
    let boundary = Boundary::new(points).map_err(|error| {
        let found = error.found;
        let fault = format!("{found} rows, but a boundary has {POINTS}; restore the missing rows");
        Fault::Layout(fault).anywhere()
    })?;
    Ok(OrientedRim { boundary, orientation })
}

/// Whether the table with this first line has the column [`WARP_COLUMN`].
fn says_warp(header: &[u8]) -> Result<bool, At> {
    let more = header.strip_prefix(HEADER.as_bytes());
    match more.map(|more| more.strip_prefix(b",").unwrap_or(more)) {
        Some(b"") => Ok(false),
        Some(column) if column == WARP_COLUMN.as_bytes() => Ok(true),
        _ => {
            let fault = format!(
                "the first line is `{}`; it must be `{HEADER}`, with or without `,{WARP_COLUMN}` behind it",
                shown(header)
            );
            Err(Fault::Layout(fault).at_line(1))
        }
    }
}

fn parse_row(
    row: &ByteRecord,
    index: usize,
    line: usize,
    says_warp: bool,
) -> Result<(BoundaryPoint, Option<Orientation>), At> {
    let cells: Vec<&[u8]> = row.iter().collect();
    let columns = 7 + usize::from(says_warp);
    let ([number, side, x, y, z, sigma, observed], warp) = (match cells.as_slice() {
        [known @ .., warp] if says_warp => (known, Some(*warp)),
        known => (known, None),
    }) else {
        let fault =
            format!("{} cells instead of {columns}; use commas, decimal points", cells.len());
        return Err(Fault::Layout(fault).at_line(line));
    };
    let value = |what: &str, cell: &[u8]| {
        let parsed = super::tokens::number(cell).filter(|value| value.is_finite());
        let fault = || Fault::Number { what: what.to_owned(), token: shown(cell) };
        parsed.ok_or_else(|| fault().at_line(line))
    };
    let flag = |what: &str, cell: &[u8]| match cell {
        b"1" | b"true" => Ok(true),
        b"0" | b"false" => Ok(false),
        other => {
            let fault = format!("{what} is `{}`; write 1 or 0", shown(other));
            Err(Fault::Layout(fault).at_line(line))
        }
    };
    let want = [index, index / POINTS_PER_SIDE].map(|n| n as f64);
    if [value("index", number)?, value("side", side)?] != want {
        let fault =
            format!("row {}, side {} belongs here; keep the rows in order", want[0], want[1]);
        return Err(Fault::Layout(fault).at_line(line));
    }
    let sigma_mm = value("sigma_mm", sigma)?;
    if sigma_mm > LARGEST_SIGMA_MM {
        let fault = format!(
            "sigma_mm is {sigma_mm}: with more than {LARGEST_SIGMA_MM} nothing is known of the point; write the \
             standard deviation of its coordinates, 0.5 if you do not know it"
        );
        return Err(Fault::Layout(fault).at_line(line));
    }
    if sigma_mm < 0.0 {
        let fault = format!("sigma_mm is {sigma_mm}; a standard deviation is not negative");
        return Err(Fault::Layout(fault).at_line(line));
    }
    let observed = flag("observed", observed)?;
    let orientation = warp
        .map(|cell| flag(WARP_COLUMN, cell))
        .transpose()?
        .map(|known| if known { Orientation::Given } else { Orientation::Ambiguous });
    let position_mm = Point3::new(value("x_mm", x)?, value("y_mm", y)?, value("z_mm", z)?);
    let position_m = position_mm * M_PER_MM;
    Ok((BoundaryPoint { position_m, sigma_m: sigma_mm * M_PER_MM, observed }, orientation))
}

//! The boundary vector as a table: `index,side,x_mm,y_mm,z_mm,sigma_mm,observed`.
//!
//! 244 rows in the order of [`crate::base::boundary`]; side 0 to 3, `observed`
//! 1 or 0. People correct such files by hand, so the reader names the line and
//! takes blanks, and `true` and `false`, but no other order and no other unit.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use csv::ByteRecord;

use super::error::shown;
use super::table::{Layout, Rows};
use super::{At, Fault, ReadError, WriteError, atomically};
use crate::base::boundary::{POINTS, POINTS_PER_SIDE};
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, BoundaryPoint, Point3};

/// The first line.
pub const HEADER: &str = "index,side,x_mm,y_mm,z_mm,sigma_mm,observed";

/// The table as text.
#[must_use]
pub fn to_text(boundary: &Boundary) -> String {
    let mut text = format!("{HEADER}\n");
    for (index, point) in boundary.points().iter().enumerate() {
        let [x, y, z] = (point.position_m / M_PER_MM).coords.into();
        let (side, sigma) = (index / POINTS_PER_SIDE, point.sigma_m / M_PER_MM);
        let observed = u8::from(point.observed);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{index},{side},{x:.4},{y:.4},{z:.4},{sigma:.4},{observed}");
    }
    text
}

/// Writes the table.
///
/// # Errors
/// When the system refuses.
pub fn write(path: impl AsRef<Path>, boundary: &Boundary) -> Result<(), WriteError> {
    atomically(path, |out| out.write_all(to_text(boundary).as_bytes()))
}

/// Reads the table back.
///
/// # Errors
/// A missing file, other columns, a cell that is no number, a wrong number or
/// order of rows.
pub fn read(path: impl AsRef<Path>) -> Result<Boundary, ReadError> {
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
    parse(bytes).map_err(|at| at.in_file(Path::new("bytes.csv")))
}

/// Whether a file is meant as such a table: a `.csv` that starts with `index`.
/// One that cannot be read is none here; who reads it next says why.
#[must_use]
pub fn is_one(path: &Path) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let mut head = [0; 16];
    let mut read = || std::fs::File::open(path)?.read(&mut head);
    named && read().is_ok_and(|length| starts_like_one(&head[..length]))
}

fn starts_like_one(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let head = head.strip_prefix(b"\"").unwrap_or(head);
    head.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"index"))
}

fn parse(text: &[u8]) -> Result<Boundary, At> {
    let mut rows = Rows::new(text, Layout::PLAIN);
    let header: Vec<Vec<u8>> = rows
        .next()
        .map(|(_, cells)| cells.iter().map(<[u8]>::to_vec).collect())
        .unwrap_or_default();
    let header = header.join(&b',');
    if header != HEADER.as_bytes() {
        let fault = format!("the first line is `{}`; it must be `{HEADER}`", shown(&header));
        return Err(Fault::Layout(fault).at_line(1));
    }
    let mut points = Vec::with_capacity(POINTS);
    while let Some((line, row)) = rows.next() {
        if points.len() == POINTS {
            let fault = format!("more than {POINTS} rows; remove what was added");
            return Err(Fault::Layout(fault).at_line(line));
        }
        points.push(parse_row(row, points.len(), line)?);
    }
    let found = points.len();
    Boundary::new(points).ok_or_else(|| {
        let fault = format!("{found} rows, but a boundary has {POINTS}; restore the missing rows");
        Fault::Layout(fault).anywhere()
    })
}

fn parse_row(row: &ByteRecord, index: usize, line: usize) -> Result<BoundaryPoint, At> {
    let cells: Vec<&[u8]> = row.iter().collect();
    let [number, side, x, y, z, sigma, observed] = cells.as_slice() else {
        let fault = format!("{} cells instead of 7; use commas, decimal points", cells.len());
        return Err(Fault::Layout(fault).at_line(line));
    };
    let value = |what: &str, cell: &[u8]| {
        let parsed = super::tokens::number(cell).filter(|value| value.is_finite());
        let fault = || Fault::Number { what: what.to_owned(), token: shown(cell) };
        parsed.ok_or_else(|| fault().at_line(line))
    };
    let want = [index, index / POINTS_PER_SIDE].map(|n| n as f64);
    if [value("index", number)?, value("side", side)?] != want {
        let fault =
            format!("row {}, side {} belongs here; keep the rows in order", want[0], want[1]);
        return Err(Fault::Layout(fault).at_line(line));
    }
    let sigma_mm = value("sigma_mm", sigma)?;
    if sigma_mm < 0.0 {
        let fault = format!("sigma_mm is {sigma_mm}; a standard deviation is not negative");
        return Err(Fault::Layout(fault).at_line(line));
    }
    let observed = match *observed {
        b"1" | b"true" => true,
        b"0" | b"false" => false,
        other => {
            let fault = format!("observed is `{}`; write 1 or 0", shown(other));
            return Err(Fault::Layout(fault).at_line(line));
        }
    };
    let position_mm = Point3::new(value("x_mm", x)?, value("y_mm", y)?, value("z_mm", z)?);
    Ok(BoundaryPoint { position_m: position_mm * M_PER_MM, sigma_m: sigma_mm * M_PER_MM, observed })
}

//! The densities of a batch as a table: `file,density_g_m2` and, if wanted,
//! `warp_toward`.
//!
//! As spreadsheets save it: columns in any order, other columns left out, commas,
//! semicolons or tabs, quoted cells, a byte-order mark; a decimal comma where
//! commas do not separate. `scan`, `path` and `filename` also name the first
//! column, `density` the second, and without a title line the columns are those
//! above. Fails with the line: a cell that is no number, a file named twice.

use std::collections::HashMap;
use std::path::Path;

use super::bytes::text_bytes;
use super::error::shown;
use super::table::{Layout, Rows};
use super::{At, Fault, Place, ReadError};

/// One file's row.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityRow {
    /// Line, counted from 1.
    pub line: usize,
    /// The file, as it is written.
    pub file: String,
    /// Areal density \[g/m^2\]: a finite number, not held against any limit.
    pub density_g_m2: f64,
    /// Where the warp points, as it is written; `None` if the cell is empty.
    pub warp_toward: Option<String>,
}

/// Reads the table.
///
/// # Errors
/// A missing file, no column of files or densities, a cell that is no number, a
/// file without a name or named twice.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<DensityRow>, ReadError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(At::opening);
    bytes.and_then(|bytes| parse(&bytes)).map_err(|at| at.in_file(path))
}

/// Reads the table from bytes; for fuzzing.
///
/// # Errors
/// As [`read`]; the path in the error is `bytes.csv`.
#[doc(hidden)]
pub fn read_bytes(bytes: &[u8]) -> Result<Vec<DensityRow>, ReadError> {
    parse(bytes).map_err(|at| at.in_file(Path::new("bytes.csv")))
}

/// Where the columns are.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Columns {
    file: usize,
    density: usize,
    warp_toward: Option<usize>,
}

fn parse(bytes: &[u8]) -> Result<Vec<DensityRow>, At> {
    let bytes = text_bytes(bytes)?;
    let bytes = bytes.as_ref();
    if let Err(error) = std::str::from_utf8(bytes) {
        let fault = "not UTF-8 text; save it as `CSV UTF-8`";
        return Err(Fault::Layout(fault.to_owned()).at_byte(error.valid_up_to()));
    }
    let delimiter = delimiter(bytes);
    let mut table = Rows::new(bytes, Layout { delimiter, comment: Some(b'#') });
    let (mut rows, mut columns) = (Vec::new(), None);
    let mut seen: HashMap<String, usize> = HashMap::new();
    while let Some((line, record)) = table.next() {
        let cells: Vec<&str> = record.iter().map(text_of).collect();
        let Some(columns) = columns else {
            let (found, is_title) = columns_of(&cells, delimiter, line)?;
            columns = Some(found);
            if !is_title {
                rows.push(row(&cells, found, delimiter, line)?);
            }
            continue;
        };
        rows.push(row(&cells, columns, delimiter, line)?);
    }
    for row in &rows {
        if let Some(first) = seen.insert(row.file.clone(), row.line) {
            let fault = format!(
                "`{}` was named in line {first} already; keep one of both",
                shown(row.file.as_bytes())
            );
            return Err(Fault::Layout(fault).at_line(row.line));
        }
    }
    if rows.is_empty() {
        let fault = "no rows; write `file,density_g_m2` and one row per scan";
        return Err(Fault::Layout(fault.to_owned()).anywhere());
    }
    Ok(rows)
}

/// A cell of a text that is known to be UTF-8.
fn text_of(cell: &[u8]) -> &str {
    std::str::from_utf8(cell).unwrap_or_default()
}

/// The separator: the one of the first line with anything in it.
fn delimiter(bytes: &[u8]) -> u8 {
    let first = super::tokens::lines(bytes)
        .find(|(_, line)| !line.is_empty() && !line.starts_with(b"#"))
        .map_or(&b""[..], |(_, line)| line);
    [b';', b'\t'].into_iter().find(|mark| first.contains(mark)).unwrap_or(b',')
}

fn columns_of(cells: &[&str], delimiter: u8, line: usize) -> Result<(Columns, bool), At> {
    let find = |names: &[&str]| {
        cells.iter().position(|cell| names.contains(&cell.to_ascii_lowercase().as_str()))
    };
    let file = find(&["file", "scan", "path", "filename"]);
    let density = find(&["density_g_m2", "density"]);
    if let (Some(file), Some(density)) = (file, density) {
        return Ok((Columns { file, density, warp_toward: find(&["warp_toward"]) }, true));
    }
    if cells.get(1).and_then(|cell| value(cell, delimiter)).is_some() {
        return Ok((Columns { file: 0, density: 1, warp_toward: Some(2) }, false));
    }
    let cells = cells.join(", ");
    let fault = format!(
        "the title line names no {} (it has: {}); write `file,density_g_m2` or \
         `file,density_g_m2,warp_toward`",
        if file.is_none() { "column `file`" } else { "column `density_g_m2`" },
        shown(cells.as_bytes())
    );
    Err(Fault::Layout(fault).at_line(line))
}

fn row(cells: &[&str], columns: Columns, delimiter: u8, line: usize) -> Result<DensityRow, At> {
    let cell = |column: usize| cells.get(column).copied().unwrap_or_default();
    let file = cell(columns.file);
    if file.is_empty() {
        let fault = "the row names no file; write the scan's path in the folder";
        return Err(Fault::Layout(fault.to_owned()).at_line(line));
    }
    let text = cell(columns.density);
    let Some(density_g_m2) = value(text, delimiter) else {
        let (what, token) = (format!("density_g_m2 of `{}`", shown(file.as_bytes())), text);
        let token = shown(token.as_bytes());
        return Err(Fault::Number { what, token }.at(Place::Line(line)));
    };
    let warp = columns.warp_toward.map(cell).filter(|text| !text.is_empty());
    Ok(DensityRow { line, file: file.to_owned(), density_g_m2, warp_toward: warp.map(Into::into) })
}

/// A finite number; with a decimal comma if commas do not separate cells.
fn value(text: &str, delimiter: u8) -> Option<f64> {
    let parsed = match text.split_once(',') {
        Some((whole, rest)) if delimiter != b',' => format!("{whole}.{rest}").parse(),
        _ => text.parse(),
    };
    parsed.ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Vec<DensityRow> {
        parse(text.as_bytes()).unwrap_or_else(|at| panic!("{}", at.in_file(Path::new("a.csv"))))
    }

    fn fault(text: &str) -> String {
        parse(text.as_bytes()).unwrap_err().in_file(Path::new("a.csv")).to_string()
    }

    #[test]
    fn spreadsheets_tables_are_read() {
        let want = |line, warp: Option<&str>| DensityRow {
            line,
            file: "sub/a, b.ply".into(),
            density_g_m2: 214.5,
            warp_toward: warp.map(Into::into),
        };
        let quoted = "\u{feff}file,density_g_m2\r\n\r\n\"sub/a, b.ply\", 214.5\r\n";
        assert_eq!(read_text(quoted), [want(3, None)]);
        let german = "note;Density;Scan;warp_toward\n# a note\nx;214,5;sub/a, b.ply;-x\n";
        assert_eq!(read_text(german), [want(3, Some("-x"))]);
        assert_eq!(read_text("sub/a, b.ply\t214.5\t\n"), [want(1, None)]);
        assert_eq!(read_text("\"sub/a, b.ply\",214.5,35\n"), [want(1, Some("35"))]);
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        for (text, part) in [
            ("", "no rows"),
            ("file,density_g_m2\n", "no rows"),
            (
                "file,density_kg_m2\na.ply,0.2\n",
                "a.csv:1: the title line names no column `density_g",
            ),
            (
                "file,density_g_m2\na.ply,200\nb.ply,heavy\n",
                "a.csv:3: density_g_m2 of `b.ply`: `heavy`",
            ),
            ("file,density_g_m2\na.ply\n", "a.csv:2: density_g_m2 of `a.ply`: ``"),
            ("file,density_g_m2\na.ply,nan\n", "a.csv:2"),
            ("file,density_g_m2\n,200\n", "a.csv:2: the row names no file"),
            ("a.ply,200\n\nb.ply,1\na.ply,210\n", "a.csv:4: `a.ply` was named in line 1 already"),
        ] {
            let said = fault(text);
            assert!(said.contains(part), "{said:?} lacks {part:?}");
        }
        let latin = parse(b"file,density_g_m2\n\xe9.ply,200\n").unwrap_err();
        assert!(latin.in_file(Path::new("a.csv")).to_string().contains("at byte 18"));
    }
}

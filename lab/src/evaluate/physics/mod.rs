//! The simulator against known answers and measured drapes, for `scan2params-lab physics` and
//! docs/validation: strips ([`strips`]), drapes on several meshes and of measured fabrics
//! ([`drapes`]), with effects beyond the seven parameters ([`effects`]), next to a real drape's
//! sections ([`mod@sections`]).
//!
//! In: nothing, or a folder of measured data. Out: [`Table`]s of numbers with their known
//! answers, charts, pictures.

pub mod drapes;
pub mod effects;
pub mod sections;
pub mod strips;

use std::path::Path;

use csv::{ReaderBuilder, Trim};

/// A table of results.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What was measured.
    pub title: String,
    /// Columns with their units.
    pub columns: Vec<&'static str>,
    /// Rows of formatted numbers.
    pub rows: Vec<Vec<String>>,
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "# {}", self.title)?;
        writeln!(f, "{}", self.columns.join(", "))?;
        for row in &self.rows {
            writeln!(f, "{}", row.join(", "))?;
        }
        Ok(())
    }
}

/// Why a file of measured data was not used.
#[derive(Debug, thiserror::Error)]
pub enum DataError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] std::io::Error),
    /// A line is not of the kind expected.
    #[error("line {line}: {fault}")]
    Line {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        fault: String,
    },
}

/// A line of a comma-separated file.
pub(super) struct TextRow {
    line: usize,
    cells: Vec<String>,
}

impl TextRow {
    pub(super) fn fault(&self, fault: String) -> DataError {
        DataError::Line { line: self.line, fault }
    }

    pub(super) fn cell(&self, column: usize) -> Result<&str, DataError> {
        let missing = || self.fault(format!("no column {}", column + 1));
        self.cells.get(column).map(String::as_str).ok_or_else(missing)
    }

    pub(super) fn number(&self, column: usize) -> Result<f64, DataError> {
        let cell = self.cell(column)?;
        cell.trim().parse().map_err(|_| self.fault(format!("{cell} is no number")))
    }

    pub(super) fn numbers(&self) -> Result<Vec<f64>, DataError> {
        (0..self.cells.len()).map(|column| self.number(column)).collect()
    }
}

/// The rows below one line of heads.
pub(super) fn text_rows(path: &Path) -> Result<Vec<TextRow>, DataError> {
    let bytes = std::fs::read(path)?;
    let mut reader =
        ReaderBuilder::new().flexible(true).trim(Trim::All).from_reader(bytes.as_slice());
    let mut all = Vec::new();
    for record in reader.byte_records() {
        let record = record.map_err(std::io::Error::other)?;
        if record.iter().all(<[u8]>::is_empty) {
            continue;
        }
        let line = record.position().map_or(0, |at| at.line() as usize);
        let cells = record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
        all.push(TextRow { line, cells });
    }
    Ok(all)
}

//! Lines of coordinates, as scanners' programs export them (.xyz, .asc, .pts, .txt, .csv).
//!
//! Cells are cut as [`super::cells`] finds: at blanks, commas, semicolons or tabs, with points
//! or commas in the numbers. Lines that start with `#`, `//` or `;` are comments. The last line
//! before the rows, or a comment before them, may have the columns' titles, by which x, y, z
//! and a colour are found in any place ([`super::columns`]). Without titles they are found by
//! what the columns hold; what was taken is noted.

use super::assemble::Raw;
use super::cells::Cut;
use super::columns::{Columns, SAMPLE_ROWS, Titles, without_brackets};
use super::error::shown;
use super::tokens::lines;
use super::{At, Fault};
use crate::base::Point3;

/// Lines before the first row of numbers; more, and the file is something else.
const MOST_TITLES: usize = 32;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    let table = Table::of(bytes)?;
    let mut taken = Vec::new();
    let columns = table.columns(&mut taken)?;
    if table.cut.decimal_comma() {
        taken.push("numbers are read with decimal commas".to_owned());
    }
    let mut raw = Raw { taken, ..Raw::default() };
    let mut colors: Vec<[f32; 3]> = Vec::new();
    let last = columns.color.iter().flatten().chain(&columns.position).max().copied().unwrap_or(0);
    let mut row = vec![f64::NAN; last + 1];
    for (line, text) in table.rows() {
        let mut at = 0;
        let mut read = 0_usize;
        table.cut.each_cell(text, |cell| {
            if let Some(value) = row.get_mut(at) {
                let used = columns.position.contains(&at);
                let number = table.cut.number(cell);
                read += usize::from(used && number.is_some());
                *value = number.unwrap_or(f64::NAN);
            }
            at += 1;
        });
        if read < 3 {
            return Err(no_row(text).at_line(line));
        }
        row.get_mut(at..).unwrap_or_default().fill(f64::NAN);
        raw.points.push(Point3::from(columns.position.map(|k| row[k])));
        if let Some(color) = columns.color {
            colors.push(color.map(|k| row[k] as f32));
        }
    }
    raw.colors = bytes_of(&colors);
    Ok(raw)
}

fn no_row(text: &[u8]) -> Fault {
    Fault::Layout(format!(
        "`{}` is no row of three numbers; export as x y z, one point a line, without signs between thousands",
        shown(text)
    ))
}

/// Colours as bytes: of 0 to 1, 0 to 255 or 0 to 65535. None if one of them is no number.
fn bytes_of(colors: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let all = colors.iter().flatten();
    if all.clone().any(|c| !c.is_finite()) {
        return Vec::new();
    }
    let most = all.clone().copied().fold(0.0, f32::max);
    let fractions = all.clone().any(|c| c.fract() != 0.0);
    let scale = match most {
        m if m <= 1.0 && fractions => 255.0,
        m if m > 255.0 => 255.0 / 65535.0,
        _ => 1.0,
    };
    colors.iter().map(|color| color.map(|c| (c * scale).round() as u8)).collect()
}

/// A text of rows.
struct Table<'a> {
    bytes: &'a [u8],
    cut: Cut,
    /// The line of the first row, and how many cells it has.
    first: usize,
    cells: usize,
    /// Lines before it that may be titles, the likeliest first: line, text, whether a comment.
    titles: Vec<(usize, &'a [u8], bool)>,
}

impl<'a> Table<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, At> {
        let content = || lines(bytes).filter(|(_, text)| !text.is_empty());
        let plain = || content().map(|(_, text)| text).filter(|text| comment(text).is_none());
        let named: Vec<usize> = plain()
            .take(MOST_TITLES)
            .filter(|text| text.iter().any(u8::is_ascii_alphabetic))
            .map(|text| text.split(|b| *b == b',').count())
            .collect();
        let cut = Cut::of(plain(), &named);
        let mut titles = Vec::new();
        let mut before = 0;
        for (line, text) in content() {
            if let Some(inner) = comment(text) {
                titles.push((line, inner, true));
                continue;
            }
            let cells = cut.cells(text);
            let numbers = cells.iter().filter(|cell| cut.number(cell).is_some()).count();
            if numbers >= 3 {
                // A title stands nearest to the rows, and rather plain than in a comment.
                titles.reverse();
                titles.sort_by_key(|(.., comment)| *comment);
                let count = cells.iter().rposition(|c| !c.is_empty()).map_or(0, |at| at + 1);
                return Ok(Self { bytes, cut, first: line, cells: count, titles });
            }
            before += 1;
            if before > MOST_TITLES {
                return Err(no_row(text).at_line(line));
            }
            titles.push((line, text, false));
        }
        match titles.iter().find(|(.., comment)| !comment) {
            Some((line, text, _)) => Err(no_row(text).at_line(*line)),
            None => Err(Fault::NoPoints.anywhere()),
        }
    }

    /// The rows, with their lines.
    fn rows(&self) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        let first = self.first;
        lines(self.bytes)
            .skip(first - 1)
            .filter(|(_, text)| !text.is_empty() && comment(text).is_none())
    }

    /// The columns to read, by titles or else by content.
    fn columns(&self, taken: &mut Vec<String>) -> Result<Columns, At> {
        for (at, (line, text, in_comment)) in self.titles.iter().enumerate() {
            let names = self.names(text);
            match Titles::read(&names, self.cells) {
                Titles::Understood(columns) => {
                    if columns.position != [0, 1, 2] {
                        taken.push(format!("{}, as line {line} names them", columns.words()));
                    }
                    return Ok(columns);
                }
                Titles::NotUnderstood if at == 0 && !in_comment => {
                    let fault = format!(
                        "the titles `{}` do not say which of the {} columns are x, y and z; name these x, y, z, \
                         or delete the line if columns 1, 2, 3 are",
                        shown(names.join(", ").as_bytes()),
                        self.cells
                    );
                    return Err(Fault::Layout(fault).at_line(*line));
                }
                Titles::NotUnderstood | Titles::Remark => {}
            }
        }
        let columns = self.by_content()?;
        if self.cells > 3 {
            taken.push(format!("{}, by what they hold: no line names them", columns.words()));
        }
        Ok(columns)
    }

    /// The titles of a line, cut as rows are, or else so that each column has one.
    fn names(&self, text: &[u8]) -> Vec<String> {
        let text = String::from_utf8_lossy(text);
        let text = without_brackets(&text);
        let cut = |at: &dyn Fn(char) -> bool, empty: bool| -> Vec<String> {
            let cells = text.split(at).map(|cell| cell.trim().trim_matches('"').to_owned());
            cells.filter(|cell| empty || !cell.is_empty()).collect()
        };
        let ways = [
            cut(&|c| c == ';', true),
            cut(&|c| c == '\t', true),
            cut(&|c| c == ',', true),
            cut(&|c: char| c.is_whitespace() || c == ',' || c == ';', false),
        ];
        let fitting = ways.iter().find(|names| names.len() == self.cells);
        let understood =
            |names: &&Vec<String>| matches!(Titles::read(names, self.cells), Titles::Understood(_));
        let widest = ways.iter().max_by_key(|names| names.len());
        let best = fitting.or_else(|| ways.iter().find(understood)).or(widest);
        best.cloned().unwrap_or_default()
    }

    fn by_content(&self) -> Result<Columns, At> {
        let count = self.rows().count();
        let stride = count.div_ceil(SAMPLE_ROWS).max(1);
        let mut sample = vec![Vec::new(); self.cells];
        let mut rows = Vec::new();
        for (row, (_, text)) in self.rows().enumerate().step_by(stride) {
            let cells = self.cut.cells(text);
            for (at, column) in sample.iter_mut().enumerate() {
                let value = cells.get(at).and_then(|cell| self.cut.number(cell));
                column.push(value.unwrap_or(f64::NAN));
            }
            rows.push(row);
        }
        Columns::by_content(&sample, &rows).ok_or_else(|| {
            let fault = format!(
                "which of the {} columns are x, y and z is not clear from their numbers; write their names \
                 into the line before, as in `x y z`",
                self.cells
            );
            Fault::Layout(fault).at_line(self.first)
        })
    }
}

/// What a comment says; `None` for any other line.
fn comment(text: &[u8]) -> Option<&[u8]> {
    let marks: [&[u8]; 3] = [b"#", b"//", b";"];
    marks.iter().find_map(|mark| text.strip_prefix(*mark)).map(|rest| {
        let more = rest.iter().take_while(|b| matches!(b, b'#' | b'/' | b';')).count();
        rest[more..].trim_ascii()
    })
}

//! How the rows of a text are cut into cells, and how its numbers are written.
//!
//! In: lines of a text. Out: a [`Cut`], found from the rows themselves: what stands between
//! cells, and whether numbers have decimal commas.

use super::tokens::number;

/// Rows that are looked at.
const SAMPLE: usize = 200;
/// Cells of a row that are looked at; scanners write fewer columns.
const MOST_CELLS: usize = 64;

/// What stands between cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    /// This byte, once: cells may be empty.
    One(u8),
    /// Any run of blanks, commas and semicolons.
    Any,
    /// Any run of blanks and semicolons; a comma at a cell's end is one too.
    NoComma,
    /// A comma, and a comma is in each number too: two pieces make a number.
    Pairs,
}

/// How rows are cut, and how their numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cut {
    separator: Separator,
    decimal_comma: bool,
}

impl Cut {
    /// What fits the rows of a text. `titles` is how many columns its titles name, if it has them.
    pub(super) fn of<'a>(lines: impl Iterator<Item = &'a [u8]>, titles: &[usize]) -> Self {
        let lines: Vec<&[u8]> = lines.filter(|line| starts_like_a_row(line)).take(SAMPLE).collect();
        let most = |fits: &dyn Fn(&[u8]) -> bool| {
            let count = lines.iter().filter(|line| fits(line)).count();
            2 * count > lines.len()
        };
        let with = |separator, decimal_comma| Self { separator, decimal_comma };
        let rows = |cut: Self| most(&|line: &[u8]| cut.numbers(line) >= 3);
        let commas = |cut: Self| {
            let fits = |line: &[u8]| {
                let cells = cut.cells(line);
                let several = |cell: &&[u8]| cell.iter().filter(|b| **b == b',').count() > 1;
                cells.iter().any(|cell| has_comma(cell)) && !cells.iter().any(several)
            };
            rows(cut) && most(&fits)
        };
        let quoted = with(Separator::One(b','), true);
        if lines.iter().any(|line| line.contains(&b'"')) && commas(quoted) {
            return quoted;
        }
        for separator in [Separator::One(b';'), Separator::One(b'\t'), Separator::NoComma] {
            if commas(with(separator, true)) {
                return with(separator, true);
            }
        }
        if are_pairs(&lines, titles) {
            return with(Separator::Pairs, true);
        }
        for byte in *b";\t," {
            let cut = with(Separator::One(byte), false);
            if rows(cut) && most(&|line: &[u8]| cut.cells(line).iter().all(|c| is_one_word(c))) {
                return cut;
            }
        }
        // Numbers with signs between thousands are none, and their commas part no cells.
        let parted = |line: &[u8]| line.split(|b| *b == b';').filter(|c| !c.is_empty()).count();
        if most(&|line: &[u8]| parted(line) >= 3) {
            return with(Separator::One(b';'), false);
        }
        with(Separator::Any, false)
    }

    /// Whether numbers have decimal commas.
    pub(super) fn decimal_comma(self) -> bool {
        self.decimal_comma
    }

    /// The cells of a row, without blanks and quotes around them.
    pub(super) fn cells(self, line: &[u8]) -> Vec<&[u8]> {
        let mut cells = Vec::with_capacity(8);
        self.each_cell(line, |cell| cells.push(cell));
        cells
    }

    /// Hands on the first cells of a row, one after another.
    pub(super) fn each_cell<'a>(self, line: &'a [u8], mut cell: impl FnMut(&'a [u8])) {
        let mut cell = |piece: &'a [u8]| cell(bare(piece));
        let filled = |piece: &&[u8]| !piece.is_empty();
        match self.separator {
            Separator::One(byte) => {
                let mut quoted = false;
                let pieces = line.split(|&b| {
                    quoted ^= b == b'"';
                    b == byte && !quoted
                });
                pieces.take(MOST_CELLS).for_each(cell);
            }
            Separator::Any => {
                let pieces = line.split(|b| b.is_ascii_whitespace() || matches!(b, b',' | b';'));
                pieces.filter(filled).take(MOST_CELLS).for_each(cell);
            }
            Separator::NoComma => {
                let pieces = line.split(|b| b.is_ascii_whitespace() || *b == b';');
                let pieces = pieces.map(|piece| piece.strip_suffix(b",").unwrap_or(piece));
                pieces.filter(filled).take(MOST_CELLS).for_each(cell);
            }
            Separator::Pairs => {
                let mut start = 0;
                let commas = line.iter().enumerate().filter(|(_, b)| **b == b',');
                let ends = commas.map(|(at, _)| at).skip(1).step_by(2).chain([line.len()]);
                for end in ends.take(MOST_CELLS) {
                    cell(line.get(start..end).unwrap_or_default());
                    start = end + 1;
                }
            }
        }
    }

    /// A cell as a number; `None` if it is none.
    pub(super) fn number(self, cell: &[u8]) -> Option<f64> {
        if !self.decimal_comma || !cell.contains(&b',') {
            return number(cell);
        }
        if cell.contains(&b'.') {
            return None;
        }
        let comma = cell.iter().position(|&b| b == b',')?;
        let mut pointed = [0; 64];
        let pointed = pointed.get_mut(..cell.len())?;
        pointed.copy_from_slice(cell);
        pointed[comma] = b'.';
        number(pointed)
    }

    /// How many cells of a row are numbers.
    fn numbers(self, line: &[u8]) -> usize {
        self.cells(line).iter().filter(|cell| self.number(cell).is_some()).count()
    }
}

/// Whether a line may be a row: it has digits enough for three numbers.
fn starts_like_a_row(line: &[u8]) -> bool {
    line.iter().filter(|b| b.is_ascii_digit()).count() >= 3
}

fn bare(cell: &[u8]) -> &[u8] {
    let cell = cell.trim_ascii();
    match cell {
        [b'"' | b'\'', inner @ .., b'"' | b'\''] => inner.trim_ascii(),
        _ => cell,
    }
}

/// Whether a cell has a comma between digits.
fn has_comma(cell: &[u8]) -> bool {
    cell.windows(3).any(|w| w[0].is_ascii_digit() && w[1] == b',' && w[2].is_ascii_digit())
}

fn is_one_word(cell: &[u8]) -> bool {
    !cell.iter().any(u8::is_ascii_whitespace)
}

/// Whether commas stand in the numbers and between them: twice as many pieces as titles, or
/// second pieces that begin with a zero, as no whole number does.
fn are_pairs(lines: &[&[u8]], titles: &[usize]) -> bool {
    let mut count = None;
    let mut leading_zero = false;
    for line in lines {
        let pieces: Vec<&[u8]> = line.split(|&b| b == b',').map(<[u8]>::trim_ascii).collect();
        let whole = |piece: &[u8]| {
            let digits = piece.strip_prefix(b"-").unwrap_or(piece);
            !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
        };
        let even = pieces.len() >= 6 && pieces.len().is_multiple_of(2);
        let same = *count.get_or_insert(pieces.len()) == pieces.len();
        let fractions = pieces.iter().skip(1).step_by(2);
        let unsigned = fractions.clone().all(|piece| !piece.starts_with(b"-"));
        if !(even && same && unsigned && pieces.iter().all(|piece| whole(piece))) {
            return false;
        }
        leading_zero |= fractions.clone().any(|piece| piece.len() > 1 && piece.starts_with(b"0"));
    }
    count.is_some_and(|count| titles.contains(&(count / 2)) || leading_zero)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_and_the_decimal_sign_are_found_from_the_rows() {
        for (text, titles, want) in [
            ("1.5 2 -3e-1", 0, vec![1.5, 2.0, -0.3]),
            ("1.5, 2, -3", 0, vec![1.5, 2.0, -3.0]),
            ("1.5;2;-3;", 0, vec![1.5, 2.0, -3.0]),
            ("1.5\t2\t\t-3", 0, vec![1.5, 2.0, -3.0]),
            ("12,5;6,7;8", 0, vec![12.5, 6.7, 8.0]),
            ("12,5 6,7 -8,25", 0, vec![12.5, 6.7, -8.25]),
            ("12,5\t6,7\t8,0e1", 0, vec![12.5, 6.7, 80.0]),
            ("12,5, 6,7, 8,9", 0, vec![12.5, 6.7, 8.9]),
            ("\"12,5\",\"6,7\",\"8,9\"", 0, vec![12.5, 6.7, 8.9]),
            ("12,05,6,70,8,90", 0, vec![12.05, 6.7, 8.9]),
            ("12,5,6,7,8,9", 3, vec![12.5, 6.7, 8.9]),
            ("12,5,6,7,8,9", 0, vec![12.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
            ("1,2,3 255 0 1", 0, vec![1.0, 2.0, 3.0, 255.0, 0.0, 1.0]),
        ] {
            let cut = Cut::of([text.as_bytes()].into_iter(), &[titles]);
            let cells = cut.cells(text.as_bytes());
            let numbers: Vec<f64> = cells.iter().filter_map(|c| cut.number(c)).collect();
            assert_eq!(numbers, want, "{text} {cut:?}");
        }
    }
}

//! Rows of a delimited text, each with its line.
//!
//! After RFC 4180 and what spreadsheets make of it: quoted cells, blanks around them,
//! blank lines between rows, any line end, a byte-order mark. Reading is linear in the
//! bytes.

use csv::{ByteRecord, Reader, ReaderBuilder, Trim};

/// How a text is cut into cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Between cells.
    pub(crate) delimiter: u8,
    /// What a line starts with that is passed over.
    pub(crate) comment: Option<u8>,
}

impl Layout {
    /// Commas, no comments.
    pub(crate) const PLAIN: Self = Self { delimiter: b',', comment: None };
}

/// The rows of a text.
pub(crate) struct Rows<'a> {
    bytes: &'a [u8],
    comment: Option<u8>,
    reader: Reader<&'a [u8]>,
    record: ByteRecord,
    /// Up to where lines are counted, and the line of that byte, from 1.
    counted: (usize, usize),
}

impl<'a> Rows<'a> {
    pub(crate) fn new(bytes: &'a [u8], layout: Layout) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .comment(layout.comment)
            .delimiter(layout.delimiter)
            .from_reader(bytes);
        let (comment, record) = (layout.comment, ByteRecord::new());
        Self { bytes, comment, reader, record, counted: (0, 1) }
    }

    /// The next row that is not blank, and the line on which it starts, from 1; `None`
    /// at the end.
    pub(crate) fn next(&mut self) -> Option<(usize, &ByteRecord)> {
        loop {
            let before = self.reader.position().byte() as usize;
            // Bytes in memory, of rows of any length: there is nothing to fail.
            if !self.reader.read_byte_record(&mut self.record).unwrap_or(false) {
                return None;
            }
            if self.record.iter().any(|cell| !cell.is_empty()) {
                let line = self.line_at(before);
                return Some((line, &self.record));
            }
        }
    }

    /// The line of the first row at or after byte `from`. (The line that the crate gives
    /// a row is that of the blank lines and comments before it.)
    fn line_at(&mut self, from: usize) -> usize {
        let (mut at, mut line) = self.counted;
        let mut start_of_line = true;
        while let Some(&byte) = self.bytes.get(at) {
            let ends_line = byte == b'\n' || byte == b'\r';
            let in_comment = start_of_line && at >= from && Some(byte) == self.comment;
            if at >= from && !ends_line && !in_comment {
                break;
            }
            if in_comment {
                let rest = &self.bytes[at..];
                at += rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
                continue;
            }
            at += 1;
            start_of_line = ends_line;
            // A carriage return and a newline end one line together.
            let pair = byte == b'\r' && self.bytes.get(at) == Some(&b'\n');
            line += usize::from(ends_line && !pair);
        }
        self.counted = (at, line);
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str, layout: Layout) -> Vec<(usize, Vec<String>)> {
        let mut rows = Rows::new(text.as_bytes(), layout);
        let mut all = Vec::new();
        while let Some((line, record)) = rows.next() {
            let cells = record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned());
            all.push((line, cells.collect()));
        }
        all
    }

    #[test]
    fn rows_know_their_lines_whatever_ends_them() {
        let layout = Layout { delimiter: b';', comment: Some(b'#') };
        for (text, lines) in [
            ("a;1\nb;2\n", [1, 2]),
            ("\u{feff}a;1\r\n\r\n\r\nb;2", [1, 4]),
            ("# title\n\n#\na;1\n# note; with\n\n  \n;\nb;2\n\n", [4, 9]),
            ("\n\"a\";1\r\r\rb ; 2\r", [2, 5]),
            ("a;1\n \n\t\n ; \n b;\"2\"\n", [1, 5]),
        ] {
            let want = [(lines[0], ["a", "1"]), (lines[1], ["b", "2"])]
                .map(|(line, cells)| (line, cells.map(String::from).to_vec()));
            assert_eq!(rows(text, layout), want, "{text:?}");
        }
        assert_eq!(rows("#a,\"x\ny\"\nb\n", Layout::PLAIN).len(), 2);
        assert_eq!(rows("\"a\nb\",1\nc,2\n", Layout::PLAIN)[1].0, 3);
        assert!(rows("\n\n \n", Layout::PLAIN).is_empty());
    }

    #[test]
    fn the_time_to_read_grows_with_the_bytes_and_not_with_their_square() {
        // Quadratic reading of so many blank or commented lines takes hours.
        let many = 1_500_000;
        for filler in [" \n", "\n", "#\n", "a\n"] {
            let text = filler.repeat(many) + "b\n";
            let layout = Layout { delimiter: b',', comment: Some(b'#') };
            let mut rows = Rows::new(text.as_bytes(), layout);
            let mut last = None;
            while let Some((line, record)) = rows.next() {
                last = Some((line, record.get(0) == Some(b"b".as_slice())));
            }
            assert_eq!(last, Some((many + 1, true)), "{filler:?}");
        }
    }
}

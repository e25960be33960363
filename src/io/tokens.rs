//! Tokens of an ascii payload, wherever the lines break, with line numbers.

use super::error::shown;
use super::{At, Fault, Place};

/// Walks over the tokens of a text.
#[derive(Clone, Debug)]
pub(super) struct Tokens<'a> {
    bytes: &'a [u8],
    position: usize,
    /// Line of the next token's start, counted from 1.
    line: usize,
}

impl<'a> Tokens<'a> {
    /// Starts at `position` of `bytes`, which lies in line `line`.
    pub(super) fn new(bytes: &'a [u8], position: usize, line: usize) -> Self {
        Self { bytes, position: position.min(bytes.len()), line }
    }

    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.position
    }

    pub(super) fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// The next token; `None` at the end.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        while let Some(&byte) = self.bytes.get(self.position) {
            if !byte.is_ascii_whitespace() {
                break;
            }
            self.line += usize::from(byte == b'\n');
            self.position += 1;
        }
        let rest = &self.bytes[self.position..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.position += length;
        (length > 0).then(|| &rest[..length])
    }
}

/// A number as sensors' exporters write it; `None` if it is none.
///
/// Besides Rust's syntax: the not-a-number spellings of C libraries
/// (`-nan(ind)`, `1.#QNAN`, `-1.#IND`, `1.#INF`), all read as NaN.
pub(super) fn number(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    let lower = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    (lower.starts_with("nan(") || lower.starts_with("1.#")).then_some(f64::NAN)
}

/// [`number`], or the fault that names `what` was to be read.
pub(super) fn number_for(
    token: &[u8],
    place: Place,
    what: impl FnOnce() -> String,
) -> Result<f64, At> {
    number(token).ok_or_else(|| Fault::Number { what: what(), token: shown(token) }.at(place))
}

/// The lines of a text, numbered from 1, without their ends; a lone carriage
/// return ends a line too, if the text has no newline at all.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    bytes.split(move |&byte| byte == end).enumerate().map(|(i, line)| (i + 1, line.trim_ascii()))
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_cross_lines_and_know_them() {
        let mut tokens = Tokens::new(b"  1 2\r\n\n3\t4", 0, 7);
        let mut seen = Vec::new();
        while let Some(token) = tokens.next() {
            seen.push((token, tokens.place()));
        }
        let lines = [(b"1", 7), (b"2", 7), (b"3", 9), (b"4", 9)];
        let want: Vec<_> = lines.iter().map(|(t, l)| (&t[..], Place::Line(*l))).collect();
        assert_eq!(seen, want);
        assert_eq!(tokens.remaining(), 0);
    }

    #[test]
    fn every_spelling_of_not_a_number_is_one() {
        for text in ["nan", "NaN", "-nan", "nan(0x1)", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#INF"]
        {
            assert!(number(text.as_bytes()).is_some_and(f64::is_nan), "{text}");
        }
        assert_eq!(number(b"-inf"), Some(f64::NEG_INFINITY));
        assert_eq!(number(b"+1.5e-3"), Some(1.5e-3));
        for text in ["", "1,5", "0x10", "one", "1.2.3", "--1"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
    }
}

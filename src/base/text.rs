//! The bytes of a text file in the one encoding that readers take.

use std::borrow::Cow;
use std::io;
use std::path::Path;

/// What a file holds instead of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotText {
    /// gzip.
    #[error("the content is gzip-compressed data; unpack it first")]
    Gzip,
    /// UTF-16 with half a character.
    #[error("the content is UTF-16 text that is damaged; save it as UTF-8")]
    Utf16,
}

/// Bytes as they are, without a byte-order mark; UTF-16 text as UTF-8.
///
/// # Errors
/// When they are compressed, or UTF-16 that is damaged.
pub fn utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, NotText> {
    if bytes.starts_with(b"\x1f\x8b") {
        return Err(NotText::Gzip);
    }
    let unit = match utf16(bytes) {
        Some(unit) => unit,
        None => return Ok(Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))),
    };
    let (pairs, rest) = bytes.as_chunks::<2>();
    let text = char::decode_utf16(pairs.iter().map(|pair| unit(*pair)));
    let text: Result<String, _> = text.filter(|c| !matches!(c, Ok('\u{feff}'))).collect();
    match text {
        Ok(text) if rest.is_empty() => Ok(Cow::Owned(text.into_bytes())),
        _ => Err(NotText::Utf16),
    }
}

/// A text file's bytes, as [`utf8`] has them.
///
/// # Errors
/// When the system refuses, or the content is no text.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = std::fs::read(path).map_err(|error| match error.kind() {
        io::ErrorKind::IsADirectory => io::Error::new(error.kind(), "is a folder, not a file"),
        _ => error,
    })?;
    let text = utf8(&bytes).map_err(|what| io::Error::new(io::ErrorKind::InvalidData, what))?;
    Ok(text.into_owned())
}

/// A text file.
///
/// # Errors
/// As [`read`], and when it is not UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|what| io::Error::new(io::ErrorKind::InvalidData, what))
}

/// How a pair of bytes makes a unit of UTF-16, by its mark or by zeros in every second byte; `None`
/// if the bytes are other text.
fn utf16(bytes: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    /// Characters that are looked at where there is no mark.
    const HEAD: usize = 64;
    let head = bytes.get(..2 * HEAD).unwrap_or(bytes).as_chunks::<2>().0;
    let all = |which: usize| {
        head.len() > 1 && head.iter().all(|pair| pair[which] != 0 && pair[1 - which] == 0)
    };
    match bytes {
        [0xff, 0xfe, ..] => Some(u16::from_le_bytes),
        [0xfe, 0xff, ..] => Some(u16::from_be_bytes),
        _ if all(0) => Some(u16::from_le_bytes),
        _ if all(1) => Some(u16::from_be_bytes),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_of_a_text_reads_alike() {
        let text = "x;y;Höhe\n1,5;2;3\n";
        let units = || text.encode_utf16();
        let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
        let marked = |mark: &[u8], body: &[u8]| [mark, body].concat();
        for bytes in [
            text.as_bytes().to_vec(),
            marked(b"\xef\xbb\xbf", text.as_bytes()),
            little.clone(),
            big.clone(),
            marked(b"\xff\xfe", &little),
            marked(b"\xfe\xff", &big),
        ] {
            assert_eq!(utf8(&bytes).unwrap().as_ref(), text.as_bytes());
        }
        assert_eq!(utf8(b"\xff\xfe1"), Err(NotText::Utf16));
        assert_eq!(utf8(b"\x1f\x8b\x08"), Err(NotText::Gzip));
        assert_eq!(utf8(b"").unwrap().as_ref(), b"");
    }
}

//! The bytes of a file.

use std::borrow::Cow;
use std::io::Read as _;
use std::path::Path;

use super::error::{At, Fault};
use crate::base::text;

/// Whether there is a regular file.
pub(super) fn is_regular(path: &Path) -> Result<(), At> {
    let meta = std::fs::metadata(path).map_err(At::opening)?;
    if meta.is_file() { Ok(()) } else { Err(Fault::NotAFile.anywhere()) }
}

/// All bytes of a regular file.
pub(super) fn regular_file(path: &Path) -> Result<Vec<u8>, At> {
    is_regular(path)?;
    std::fs::read(path).map_err(At::opening)
}

/// The bytes of a text as UTF-8.
pub(super) fn text_bytes(bytes: &[u8]) -> Result<Cow<'_, [u8]>, At> {
    text::utf8(bytes).map_err(|what| Fault::Layout(what.to_string()).anywhere())
}

/// All bytes of the standard input.
pub(super) fn standard_input() -> Result<Vec<u8>, At> {
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(At::opening)?;
    Ok(bytes)
}

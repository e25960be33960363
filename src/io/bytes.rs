//! The bytes of a file.

use std::io::Read as _;
use std::path::Path;

use super::error::{At, Fault};

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

/// All bytes of the standard input.
pub(super) fn standard_input() -> Result<Vec<u8>, At> {
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(At::opening)?;
    Ok(bytes)
}

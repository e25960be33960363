//! The journal of a batch: one line of JSON per finished input, only ever appended
//! to, each line with one write.
//!
//! A run that is killed leaves at most one line without its end. Opening the
//! journal cuts that off; whole lines that are no rows (an edit, a damaged disk)
//! are counted and passed over, so that their inputs are done again. The last row
//! of a file counts.
//!
//! A shard has its own journal, and every run reads those of the others, as far as they are
//! written.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, read_dir};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use super::{BatchError, Row};
use crate::base::Shard;
use crate::io::{WriteError, bytes_of};

/// An open journal.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

/// What journals held when they were read.
#[derive(Debug, Default)]
pub(super) struct Held {
    /// The last row of each file in each journal.
    pub(super) rows: HashMap<String, Vec<Row>>,
    /// Whole lines that are no rows.
    pub(super) unreadable_lines: usize,
    /// Bytes of a torn last line that were cut off.
    pub(super) torn_bytes: usize,
}

impl Journal {
    /// The name of the journal of a whole batch, and of a shard's.
    pub(super) fn name(shard: Option<Shard>) -> String {
        shard.map_or_else(|| "journal.jsonl".to_owned(), |part| format!("journal-{part}.jsonl"))
    }

    /// Opens the journal, or makes it; cuts off a torn last line.
    pub(super) fn open(path: &Path) -> Result<(Self, Held), WriteError> {
        let fault = |source| WriteError { path: path.to_owned(), source };
        let mut file =
            OpenOptions::new().read(true).append(true).create(true).open(path).map_err(fault)?;
        let bytes = std::fs::read(path).map_err(fault)?;
        let whole = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
        let mut held = Held::default();
        held.take_all(&bytes[..whole]);
        let tail = &bytes[whole..];
        if serde_json::from_slice::<Row>(tail).is_ok() {
            // Only the newline is missing.
            held.take_all(tail);
            file.write_all(b"\n").map_err(fault)?;
        } else if !tail.is_empty() {
            held.torn_bytes = tail.len();
            file.set_len(whole as u64).map_err(fault)?;
        }
        Ok((Self { path: path.to_owned(), file }, held))
    }

    /// Appends a row, and has the system put it on the disk.
    pub(super) fn append(&mut self, row: &Row) -> Result<(), WriteError> {
        let write = |file: &mut File| -> io::Result<()> {
            let mut line = serde_json::to_vec(row)?;
            line.push(b'\n');
            file.write_all(&line)?;
            file.sync_data()
        };
        write(&mut self.file).map_err(|source| WriteError { path: self.path.clone(), source })
    }
}

impl Held {
    /// Reads the journals of a folder of results but the one named `own`. Another run may be
    /// writing them: a line without its end is left alone.
    pub(super) fn read_others(&mut self, out: &Path, own: &str) -> Result<(), BatchError> {
        let listed = |source| BatchError::Folder { path: out.to_owned(), source };
        for entry in read_dir(out).map_err(listed)? {
            let entry = entry.map_err(listed)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with("journal") && name.ends_with(".jsonl") && name != own {
                let bytes = bytes_of(entry.path())?;
                let whole = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
                self.take_all(&bytes[..whole]);
            }
        }
        Ok(())
    }

    /// Takes the lines of one journal.
    fn take_all(&mut self, lines: &[u8]) {
        let mut last = HashMap::new();
        for line in lines.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
            match serde_json::from_slice::<Row>(line) {
                Ok(row) if row.schema_version == super::SCHEMA_VERSION => {
                    last.insert(row.file.clone(), row);
                }
                _ => self.unreadable_lines += 1,
            }
        }
        for (file, row) in last {
            self.rows.entry(file).or_default().push(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Row, Status};
    use super::*;

    fn row(file: &str, reason: &str) -> Row {
        Row { reason: Some(reason.into()), ..Row::new(file, Status::Refused) }
    }

    #[test]
    fn whatever_byte_a_kill_stops_at_no_whole_row_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let (mut journal, held) = Journal::open(&path).unwrap();
        assert!(held.rows.is_empty());
        for (file, reason) in [("a.ply", "old"), ("b.ply", "no\nplate"), ("a.ply", "new")] {
            journal.append(&row(file, reason)).unwrap();
        }
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let ends: Vec<usize> = (0..whole.len()).filter(|&i| whole[i] == b'\n').collect();
        assert_eq!(ends.len(), 3);
        for length in 0..=whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (mut journal, held) = Journal::open(&path).unwrap();
            // A row whose newline alone is missing is whole.
            let rows = ends.iter().filter(|&&end| length >= end).count();
            assert_eq!(held.rows.len(), rows.min(2), "{length}");
            assert_eq!(held.unreadable_lines, 0);
            journal.append(&row("c.ply", "next")).unwrap();
            let (_, again) = Journal::open(&path).unwrap();
            assert_eq!((again.unreadable_lines, again.torn_bytes), (0, 0), "{length}");
            assert!(again.rows.contains_key("c.ply"));
            let a = again.rows.get("a.ply").and_then(|rows| rows[0].reason.as_deref());
            assert_eq!(a, [None, Some("old"), Some("old"), Some("new")][rows]);
        }
    }

    #[test]
    fn lines_that_are_no_rows_are_counted_and_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal.jsonl");
        let (mut journal, _) = Journal::open(&path).unwrap();
        journal.append(&row("a.ply", "x")).unwrap();
        let mut text = std::fs::read(&path).unwrap();
        text.extend(b"{\"file\":\"b.ply\"}\n\0\0\0\n{}\n");
        std::fs::write(&path, &text).unwrap();
        let (_, held) = Journal::open(&path).unwrap();
        assert_eq!((held.rows.len(), held.unreadable_lines), (1, 3));
    }
}

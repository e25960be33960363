//! Unfinished files: which are being written, so that an interrupted program can remove
//! them.
//!
//! A writer holds a [`Part`] while its `.part` file is there; what handles the interrupt calls
//! [`abandon`] and ends the program. From then on no writer begins or ends, so that nothing
//! is left behind and nothing half done takes its name.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A file that is being written; dropped when it has taken its name or is gone.
pub(crate) struct Part {
    path: PathBuf,
}

impl Part {
    /// Takes note of a file that is about to be made.
    pub(crate) fn begin(path: &Path) -> Self {
        unfinished().insert(path.to_owned());
        Self { path: path.to_owned() }
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        unfinished().remove(&self.path);
    }
}

/// Removes every file that is being written. Who holds the result keeps all writers from
/// beginning another and from finishing; it is meant to be held until the program ends.
pub fn abandon() -> Abandoned {
    let files = unfinished();
    for path in files.iter() {
        // One that is not there yet, or not any more, is as good as removed.
        let _ = std::fs::remove_file(path);
    }
    Abandoned { _files: files }
}

/// All writers wait while this is held.
#[must_use]
pub struct Abandoned {
    _files: MutexGuard<'static, BTreeSet<PathBuf>>,
}

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A panic elsewhere leaves the set of paths whole.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unfinished_is_removed_and_what_has_its_name_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [half, done] = ["half.part", "done.part"].map(|name| folder.path().join(name));
        let part = Part::begin(&half);
        std::fs::write(&half, "half").unwrap();
        drop(Part::begin(&done));
        std::fs::write(&done, "done").unwrap();
        drop(abandon());
        assert!(!half.exists() && done.exists());
        drop(part);
        assert!(!unfinished().contains(&half));
    }
}

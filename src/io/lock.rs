//! A folder that one process fills at a time.
//!
//! The lock is the system's on a file in the folder, so that it ends with its process,
//! however that ends. The file says who holds it; it is removed when the lock is given
//! up. Where the file system knows no locks there is none.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::WriteError;
use super::part::unfinished;

/// Why a lock was not got.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process has it.
    #[error(
        "{}: {holder} is filling this folder already; wait for it, end it, or give another folder",
        path.display()
    )]
    Held {
        /// The lock.
        path: PathBuf,
        /// The process and how long it has it, as far as it said so.
        holder: String,
    },
    /// The file cannot be made.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A lock that is held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Keeps the system's lock.
    _file: File,
}

impl Lock {
    /// Takes the lock `path`, a file in the folder that is to be filled.
    ///
    /// # Errors
    /// When another process holds it, or the file cannot be made.
    pub fn take(path: impl Into<PathBuf>) -> Result<Self, LockError> {
        let path = path.into();
        let fault = |source| WriteError { path: path.clone(), source };
        loop {
            let mut open = OpenOptions::new();
            let open = open.read(true).write(true).create(true).truncate(false);
            let mut file = open.open(&path).map_err(fault)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let holder = holder(&mut file);
                    return Err(LockError::Held { path, holder });
                }
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(error)) => return Err(fault(error).into()),
            }
            // Its last holder may have removed it between the opening and the locking.
            if is_at(&file, &path) {
                say_who(&mut file).map_err(fault)?;
                unfinished().insert(path.clone());
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        unfinished.remove(&self.path);
        // While it is still held: see `is_at`.
        let _ = fs::remove_file(&self.path);
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let held = file.try_clone().and_then(same_file::Handle::from_file);
    held.and_then(|held| Ok(held == same_file::Handle::from_path(path)?)).unwrap_or(false)
}

/// Process number and second since 1970, for whoever finds the lock held.
fn say_who(file: &mut File) -> io::Result<()> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    file.set_len(0)?;
    writeln!(file, "{} {}", std::process::id(), now.as_secs())
}

fn holder(file: &mut File) -> String {
    let mut text = String::new();
    // What cannot be read is not said.
    let _ = file.read_to_string(&mut text);
    let numbers: Vec<u64> = text.split_whitespace().filter_map(|n| n.parse().ok()).collect();
    let &[process, since_s] = numbers.as_slice() else {
        return "another process".to_owned();
    };
    let since = UNIX_EPOCH.checked_add(Duration::from_secs(since_s));
    let for_s = since.and_then(|since| SystemTime::now().duration_since(since).ok());
    match for_s.map(|time| time.as_secs()) {
        Some(seconds) if seconds >= 120 => format!("process {process} (for {} min)", seconds / 60),
        Some(seconds) => format!("process {process} (for {seconds} s)"),
        None => format!("process {process}"),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn one_holds_it_and_the_other_is_told_who() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("batch.lock");
        let lock = Lock::take(&path).unwrap();
        let said = Lock::take(&path).unwrap_err().to_string();
        assert!(said.contains(&format!("process {} (for ", std::process::id())), "{said}");
        drop(lock);
        assert!(!path.exists());
        // What a killed process leaves is no lock.
        fs::write(&path, "4242 0\n").unwrap();
        let lock = Lock::take(&path).unwrap();
        assert!(fs::read_to_string(&path).unwrap().starts_with(&std::process::id().to_string()));
        drop(lock);
    }

    #[test]
    fn of_many_at_once_one_holds_it_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("batch.lock");
        let holders = AtomicUsize::new(0);
        let hold_often = || {
            for _ in 0..100 {
                let lock = loop {
                    match Lock::take(&path) {
                        Ok(lock) => break lock,
                        Err(LockError::Held { .. }) => std::thread::yield_now(),
                        Err(error) => panic!("{error}"),
                    }
                };
                assert_eq!(holders.fetch_add(1, Ordering::SeqCst), 0);
                holders.fetch_sub(1, Ordering::SeqCst);
                drop(lock);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(hold_often);
            }
        });
        assert!(!path.exists());
    }
}

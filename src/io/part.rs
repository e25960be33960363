//! Where what is written goes, and how it appears there whole or not at all.
//!
//! In: a path and bytes. A file is written to `<name>.part` next to it, which takes the
//! name when it is complete; what a symbolic link leads to is replaced, not the link,
//! and a file that was there keeps its permissions. Devices, named pipes and the
//! descriptors of this process (`/dev/null`, `/dev/stdout`, `/dev/fd/63`) cannot be
//! replaced by a file and are written to as they are.
//!
//! Fails with what the system says. A program that is interrupted calls
//! [`abandon_unfinished`] before it ends, so that no part is left behind; one that is
//! killed leaves parts, which the next run overwrites.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::WriteError;

/// Symbolic links followed before a path is taken for a circle; Linux stops there too.
const MOST_LINKS: usize = 40;

/// Writes a file: it appears under its name when `write` is done, or not at all.
/// Devices and pipes are written to as they are.
///
/// # Errors
/// When the system refuses; nothing is left of a file then.
pub fn atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    let buffered = |file: &File| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()
    };
    let written = Destination::of(path).and_then(|destination| match destination {
        Destination::File(target) => {
            let part = Part::of(&target)?;
            buffered(part.file())?;
            part.finish()
        }
        Destination::Stream(stream) => buffered(&stream.open()?),
    });
    written.map_err(|source| WriteError { path: path.to_owned(), source })
}

/// Where a path leads when it is written to.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Destination {
    /// A regular file, there or not: the end of the path's symbolic links.
    File(PathBuf),
    /// What cannot be replaced by a file.
    Stream(Stream),
}

/// What is written to as it is.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Stream {
    /// The standard output of this process.
    Stdout,
    /// The standard error of this process.
    Stderr,
    /// A device, a named pipe, a socket, another descriptor of this process.
    Other(PathBuf),
}

impl Destination {
    /// Follows the symbolic links of `path`, one after another: what is behind a
    /// descriptor of this process has no path.
    pub(super) fn of(path: &Path) -> io::Result<Self> {
        let mut path = path.to_owned();
        for _ in 0..MOST_LINKS {
            if let Some(stream) = own_descriptor(&path) {
                return Ok(Self::Stream(stream));
            }
            let special = |meta: fs::Metadata| !meta.is_file() && !meta.is_dir();
            let is_special = fs::metadata(&path).is_ok_and(special);
            let next =
                fs::read_link(&path).map(|to| path.parent().unwrap_or(Path::new("")).join(to));
            path = match next {
                // The link of another process's descriptor need not lead to a path.
                Ok(next) if !is_special || fs::symlink_metadata(&next).is_ok() => next,
                _ if is_special => return Ok(Self::Stream(Stream::Other(path))),
                _ => return Ok(Self::File(path)),
            };
        }
        Err(io::Error::other("too many symbolic links, one after another"))
    }
}

/// The stream that a path like `/proc/self/fd/1` or `/dev/fd/1` names.
fn own_descriptor(path: &Path) -> Option<Stream> {
    let folder = fs::canonicalize(path.parent()?).ok()?;
    let of_process = format!("/proc/{}", std::process::id());
    if folder != Path::new("/dev/fd") && !(folder.starts_with(of_process) && folder.ends_with("fd"))
    {
        return None;
    }
    let number: u32 = path.file_name()?.to_str()?.parse().ok()?;
    Some(match number {
        1 => Stream::Stdout,
        2 => Stream::Stderr,
        _ => Stream::Other(path.to_owned()),
    })
}

impl Stream {
    #[cfg(unix)]
    fn open(&self) -> io::Result<File> {
        use std::os::fd::AsFd as _;
        // A second description of a redirected file would start at its first byte and
        // overwrite what is printed.
        Ok(match self {
            Self::Stdout => {
                io::stdout().flush()?;
                io::stdout().as_fd().try_clone_to_owned()?.into()
            }
            Self::Stderr => io::stderr().as_fd().try_clone_to_owned()?.into(),
            Self::Other(path) => OpenOptions::new().write(true).open(path)?,
        })
    }

    #[cfg(not(unix))]
    fn open(&self) -> io::Result<File> {
        match self {
            Self::Stdout | Self::Stderr => Err(io::ErrorKind::Unsupported.into()),
            Self::Other(path) => OpenOptions::new().write(true).open(path),
        }
    }
}

/// Files that are to be removed if the program ends now: parts, and locks that are held.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

pub(super) fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every file that is half written, for a program that was interrupted and is
/// about to end: from here on, threads that begin or finish a file wait forever.
pub fn abandon_unfinished() {
    let unfinished = unfinished();
    remove(&unfinished);
    std::mem::forget(unfinished);
}

fn remove(files: &BTreeSet<PathBuf>) {
    for file in files {
        // One that is gone, or that the system keeps, must not hold up the others.
        let _ = fs::remove_file(file);
    }
}

/// A file that is being written under a provisional name; dropped, it is removed.
#[derive(Debug)]
pub(crate) struct Part {
    path: PathBuf,
    target: PathBuf,
    file: File,
}

/// The provisional name of a file.
pub(super) fn part_of(target: &Path) -> PathBuf {
    let mut name = target.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

impl Part {
    /// Begins the file `target`, which is no link, as `<target>.part`.
    pub(crate) fn of(target: &Path) -> io::Result<Self> {
        Self::named(part_of(target), target)
    }

    /// Begins the file `target` under the name `path`.
    pub(crate) fn named(path: PathBuf, target: &Path) -> io::Result<Self> {
        let mut unfinished = unfinished();
        let file = File::create(&path)?;
        unfinished.insert(path.clone());
        Ok(Self { path, target: target.to_owned(), file })
    }

    /// The file, to be written.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Gives the file its name, and the permissions of the one that it replaces.
    pub(crate) fn finish(self) -> io::Result<()> {
        let mut unfinished = unfinished();
        if let Ok(meta) = fs::metadata(&self.target) {
            self.file.set_permissions(meta.permissions())?;
        }
        fs::rename(&self.path, &self.target)?;
        unfinished.remove(&self.path);
        Ok(())
    }

    /// [`Self::finish`], with the content on the disk first.
    #[cfg(feature = "dataset")]
    pub(crate) fn finish_durably(self) -> io::Result<()> {
        self.file.sync_all()?;
        self.finish()
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        if unfinished.remove(&self.path) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path, text: &str) -> Result<(), WriteError> {
        atomically(path, |out| out.write_all(text.as_bytes()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, "old").unwrap();
        let halfway = atomically(&path, |out| {
            out.write_all(b"half")?;
            assert_eq!(names(folder.path()), ["a.txt", "a.txt.part"]);
            Err(io::Error::other("stopped"))
        });
        assert!(halfway.unwrap_err().to_string().contains("a.txt: cannot be written (stopped"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
        assert!(!unfinished().iter().any(|part| part.starts_with(folder.path())));
    }

    #[test]
    fn what_is_unfinished_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("whole.txt"), "x").unwrap();
        let part = Part::of(&folder.path().join("half.txt")).unwrap();
        assert_eq!(names(folder.path()), ["half.txt.part", "whole.txt"]);
        let of_here = |path: &&PathBuf| path.starts_with(folder.path());
        let mine: BTreeSet<PathBuf> = unfinished().iter().filter(of_here).cloned().collect();
        remove(&mine);
        assert_eq!(names(folder.path()), ["whole.txt"]);
        assert!(part.finish().is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_kept() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("sub/target.txt"), "old").unwrap();
        fs::set_permissions(at("sub/target.txt"), fs::Permissions::from_mode(0o640)).unwrap();
        symlink("sub/target.txt", at("link.txt")).unwrap();
        symlink("link.txt", at("second.txt")).unwrap();
        write(&at("second.txt"), "new").unwrap();
        assert_eq!(fs::read_link(at("second.txt")).unwrap(), Path::new("link.txt"));
        assert_eq!(fs::read_to_string(at("sub/target.txt")).unwrap(), "new");
        let mode = fs::metadata(at("sub/target.txt")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        // A link to what is not there yet makes it.
        symlink("sub/later.txt", at("dangling.txt")).unwrap();
        write(&at("dangling.txt"), "made").unwrap();
        assert_eq!(fs::read_to_string(at("sub/later.txt")).unwrap(), "made");
        symlink("circle.txt", at("circle.txt")).unwrap();
        assert!(write(&at("circle.txt"), "x").is_err());
        assert_eq!(
            names(folder.path()),
            ["circle.txt", "dangling.txt", "link.txt", "second.txt", "sub"]
        );
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_no_files() {
        // Not written to: if they were taken for files, root would replace them.
        for name in ["/dev/null", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/2"] {
            let path = Path::new(name);
            if !Path::new(name).parent().is_some_and(Path::is_dir) {
                continue; // no such thing on this system
            }
            assert!(
                matches!(Destination::of(path), Ok(Destination::Stream(_))),
                "{name}: {:?}",
                Destination::of(path)
            );
        }
    }
}

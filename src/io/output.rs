//! Whether results can be written where they are asked to be, found out before the
//! work whose results they are.
//!
//! In: the path of a result, and the files that are read. A result must not be one of
//! these, by any link or spelling; a file must not lie where a folder is needed,
//! nor a folder where a file is; and the system must let it be written, which is tried
//! out with a file that is removed again.
//!
//! Limit: what happens between the trial and the writing is seen by the writing only.

use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use same_file::is_same_file;

use super::WriteError;
use super::part::{Destination, Part, part_of};

/// Why a result cannot be written where it is asked to be.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// It would replace what is read.
    #[error(
        "{}: is the input {}, which would be lost; give the result another name or folder",
        path.display(), input.display()
    )]
    IsInput {
        /// The result.
        path: PathBuf,
        /// The file read.
        input: PathBuf,
    },
    /// Two results have one name.
    #[error("{}: named for two results; give each its own name", path.display())]
    Twice {
        /// The name.
        path: PathBuf,
    },
    /// Its name ends as something else that is not written there.
    #[error(
        "{}: cannot be written as {ending}; give a name that ends in {endings}",
        path.display()
    )]
    Ending {
        /// The result.
        path: PathBuf,
        /// The ending of its name.
        ending: String,
        /// The endings of what is written there.
        endings: String,
    },
    /// A folder where a file is needed.
    #[error("{}: is a folder; give the name of a file", path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// A file where a folder is needed.
    #[error("{}: is a file; give a folder", path.display())]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// The system refuses.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl OutputError {
    /// Whether another path is what helps, as opposed to a permission or space.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::Write(_))
    }
}

/// Whether a file can be written at `path` without any of `inputs` being lost.
///
/// # Errors
/// When it is one of them, a folder, or the system refuses.
pub fn check_file(path: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
    let refused = |source| WriteError { path: path.to_owned(), source };
    let target = match Destination::of(path).map_err(refused)? {
        Destination::File(target) => target,
        // Opening a pipe for a trial would end it for its reader.
        Destination::Stream(_) => return Ok(()),
    };
    if target.is_dir() {
        return Err(OutputError::IsFolder { path: path.to_owned() });
    }
    // Also the file that it is written through.
    for written in [&target, &part_of(&target)] {
        // What is not there yet is none of them.
        let same = |input: &&PathBuf| is_same_file(written, input).unwrap_or(false);
        if let Some(input) = inputs.iter().find(same) {
            return Err(OutputError::IsInput { path: path.to_owned(), input: input.clone() });
        }
    }
    let may_write = || {
        if target.exists() {
            OpenOptions::new().write(true).open(&target)?;
        }
        try_folder(target.parent().unwrap_or(Path::new("")))
    };
    may_write().map_err(|source| refused(source).into())
}

/// [`check_file`] of a file in the format of one of `endings`, such as `.png`: a name that ends
/// otherwise would mislead whoever opens it. Capitals count for nothing; a name without an ending
/// says nothing, and may stand; a device or a pipe has none.
///
/// # Errors
/// Those of [`check_file`], and when the name ends otherwise.
pub fn check_named(path: &Path, endings: &[&str], inputs: &[PathBuf]) -> Result<(), OutputError> {
    check_file(path, inputs)?;
    let is_file = matches!(Destination::of(path), Ok(Destination::File(_)));
    let Some(ending) = path.extension().filter(|_| is_file) else { return Ok(()) };
    let ending = format!(".{}", ending.to_string_lossy());
    if endings.iter().any(|own| own.eq_ignore_ascii_case(&ending)) {
        return Ok(());
    }
    Err(OutputError::Ending { path: path.to_owned(), ending, endings: endings.join(" or ") })
}

/// Makes a file in a folder, and removes it.
fn try_folder(folder: &Path) -> io::Result<()> {
    // A name of this process's own: another may be writing here.
    let trial = folder.join(format!(".scan2params-{}", std::process::id()));
    Part::of(&trial).map(drop)
}

/// Whether files can be written into the folder `path`, which need not be there yet.
///
/// # Errors
/// When it is no folder, or the system refuses.
pub fn check_folder(path: &Path) -> Result<(), OutputError> {
    let refused = |source| WriteError { path: path.to_owned(), source }.into();
    let here = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    match fs::metadata(here) {
        Ok(meta) if !meta.is_dir() => Err(OutputError::NotAFolder { path: path.to_owned() }),
        Ok(_) => try_folder(here).map_err(refused),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(refused(error)),
        // A link that leads nowhere is no folder, and none can be made in its place.
        Err(error) if fs::symlink_metadata(here).is_ok() => Err(refused(error)),
        Err(error) => match here.parent() {
            Some(parent) => check_folder(parent),
            None => Err(refused(error)),
        },
    }
}

/// Whether two paths lead to one file, which only one result can be written to; both
/// may lead to one device.
///
/// # Errors
/// When they do.
pub fn check_distinct(one: &Path, other: &Path) -> Result<(), OutputError> {
    let file = |path: &Path| match Destination::of(path) {
        Ok(Destination::File(target)) => Some(whole(&target)),
        _ => None,
    };
    match (file(one), file(other)) {
        (Some(a), Some(b)) if a == b || is_same_file(&a, &b).unwrap_or(false) => {
            Err(OutputError::Twice { path: one.to_owned() })
        }
        _ => Ok(()),
    }
}

/// The path of a file that need not be there, from the root.
fn whole(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).unwrap_or_default();
    folder.join(path.file_name().unwrap_or_default())
}

/// Whether what is written to `path` goes to this program's standard output.
#[must_use]
pub fn is_stdout(path: &Path) -> bool {
    Destination::of(path).is_ok_and(|to| to == Destination::Stream(super::part::Stream::Stdout))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_input(path: &Path, inputs: &[PathBuf]) -> bool {
        matches!(check_file(path, inputs), Err(OutputError::IsInput { .. }))
    }

    #[test]
    fn an_input_is_known_by_whatever_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("in.ply"), "points").unwrap();
        fs::hard_link(at("in.ply"), at("hard.ply")).unwrap();
        let inputs = [at("other.ply"), at("in.ply")];
        for name in ["in.ply", "hard.ply", "./in.ply", "sub/../in.ply"] {
            assert!(is_input(&at(name), &inputs), "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../in.ply", at("sub/link.ply")).unwrap();
            std::os::unix::fs::symlink("sub/link.ply", at("twice.ply")).unwrap();
            assert!(is_input(&at("sub/link.ply"), &inputs));
            assert!(is_input(&at("twice.ply"), &inputs));
        }
        // A result is written through `<name>.part`.
        fs::write(at("out.ply.part"), "points").unwrap();
        assert!(is_input(&at("out.ply"), &[at("out.ply.part")]));
        for name in ["new.ply", "sub/in.ply", "other.ply"] {
            check_file(&at(name), &inputs).unwrap();
            assert!(!at(name).exists(), "a trial left {name} behind");
        }
        assert_eq!(fs::read_to_string(at("in.ply")).unwrap(), "points");
        assert_eq!(fs::read_to_string(at("out.ply.part")).unwrap(), "points");
    }

    #[test]
    fn a_name_that_ends_as_another_format_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let check = |name: &str| check_named(&folder.path().join(name), &[".usda", ".usd"], &[]);
        for name in ["a.usda", "a.usd", "A.USD", "a", "b.c.usda"] {
            check(name).unwrap();
        }
        for name in ["a.jpg", "a.usda.gz", "a.usdz"] {
            let refused = check(name).unwrap_err();
            assert!(refused.is_usage());
            assert!(
                refused.to_string().ends_with("a name that ends in .usda or .usd"),
                "{refused}"
            );
        }
        #[cfg(unix)]
        check_named(Path::new("/dev/null"), &[".png"], &[]).unwrap();
    }

    #[test]
    fn files_and_folders_are_not_taken_for_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "x").unwrap();
        let is_usage = |checked: Result<(), OutputError>| checked.unwrap_err().is_usage();
        assert!(is_usage(check_file(folder.path(), &[])));
        assert!(is_usage(check_folder(&file)));
        // Below a file, or in a folder that is not there, the system refuses.
        assert!(!is_usage(check_folder(&file.join("sub"))));
        assert!(!is_usage(check_file(&folder.path().join("none/file"), &[])));
        check_folder(&folder.path().join("new/and/newer")).unwrap();
        check_file(&file, &[]).unwrap();
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!((left.len(), fs::read_to_string(&file).unwrap()), (1, "x".to_owned()));
    }

    #[test]
    fn two_results_need_two_files() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        assert!(check_distinct(&at("a"), &at("./a")).is_err());
        check_distinct(&at("a"), &at("b")).unwrap();
        fs::write(at("a"), "x").unwrap();
        fs::hard_link(at("a"), at("b")).unwrap();
        assert!(check_distinct(&at("a"), &at("b")).is_err());
        if cfg!(unix) {
            check_distinct(Path::new("/dev/null"), Path::new("/dev/null")).unwrap();
        }
    }
}

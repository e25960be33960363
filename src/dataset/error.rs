//! Why a folder of drapes could not be filled.

use std::io;
use std::path::{Path, PathBuf};

use crate::fabric::MixtureError;
use crate::io::{LockError, OutputError};

/// Why a folder could not be filled.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// An option makes no sense.
    #[error("{0}")]
    Options(String),
    /// The folder was made with other options.
    #[error(
        "{folder} was made with other options ({differing}): give those, or another folder",
        folder = folder.display(), differing = differing.join("; ")
    )]
    OtherOptions {
        /// The folder.
        folder: PathBuf,
        /// Each option with its value there and now.
        differing: Vec<String>,
    },
    /// The folder has an older schema.
    #[error(
        "{folder} was made by {program} and has schema `{schema}`, which is read but not continued: give another folder",
        folder = folder.display()
    )]
    Older {
        /// The folder.
        folder: PathBuf,
        /// Its schema.
        schema: String,
        /// The program that began it.
        program: String,
    },
    /// The manifest cannot be understood.
    #[error("{path}: {fault}: this folder was not made by this program, give another", path = path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A file cannot be read or written.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The prior cannot be sampled.
    #[error(transparent)]
    Prior(#[from] MixtureError),
    /// The folder cannot be written where it is asked to be.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Another run makes this shard.
    #[error(transparent)]
    Locked(#[from] LockError),
}

impl GenerateError {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }
}

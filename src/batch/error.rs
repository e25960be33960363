//! Why a batch cannot be run.

use std::path::PathBuf;

use super::options::SCANS;
use crate::estimate::EstimateError;
use crate::fabric::Fault;
use crate::io::{LockError, OutputError, ReadError, WriteError};
use crate::job::FailureKind;

/// Why a batch cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// The density for all is not one of a textile.
    #[error(transparent)]
    Density(#[from] Fault),
    /// The table of densities or a journal cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A row of that table cannot be meant.
    #[error("{}:{line}: {fault}", path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong and what to do.
        fault: String,
    },
    /// A file in place of a folder.
    #[error("{}: is a file; give the folder that it is in, or `estimate` the one scan", path.display())]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// Nothing there.
    #[error("{}: no such folder; check the path", path.display())]
    NoFolder {
        /// The path.
        path: PathBuf,
    },
    /// The folder cannot be listed.
    #[error("{}: cannot be listed ({source}); give a folder of scans", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Nothing to do.
    #[error(
        "{}: no scans in it, neither files that end in one of .{} nor folders of views; tables and \
         images count if --density-csv names them",
        folder.display(), SCANS.join(", .")
    )]
    NoScans {
        /// The folder.
        folder: PathBuf,
    },
    /// Scans that no run has done with these options.
    #[error(
        "{} of {of} scans have not been done with these options: {}{}; run their shards to the end with the same flags, or \
         leave --merge away, which does them here",
        files.len(), files[..files.len().min(3)].join(", "), if files.len() > 3 { ", ..." } else { "" }
    )]
    NotDone {
        /// They, by their path in the folder.
        files: Vec<String>,
        /// Scans of the batch.
        of: usize,
    },
    /// The model cannot be used.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A result cannot be written where it is asked to be.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Another run fills the folder of results.
    #[error(transparent)]
    Locked(#[from] LockError),
}

impl BatchError {
    /// What kind of failure it is.
    #[must_use]
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Density(_)
            | Self::Table { .. }
            | Self::NoScans { .. }
            | Self::NotAFolder { .. } => FailureKind::Usage,
            Self::Read(error) if error.is_content() => FailureKind::Usage,
            Self::Output(error) if error.is_usage() => FailureKind::Usage,
            _ => FailureKind::Failed,
        }
    }
}

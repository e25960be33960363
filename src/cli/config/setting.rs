//! One setting of a file, and what becomes of it.

use std::ffi::OsString;

/// A setting of the file.
pub(crate) struct Setting {
    /// Whether it stands above the tables, for every verb.
    pub(super) of_all: bool,
    /// The flag's name in clap.
    pub(super) id: String,
    /// The flag, two hyphens included.
    pub(super) flag: String,
    /// What it adds to the command line: nothing where it is `false`.
    pub(super) words: Vec<OsString>,
    /// Its line in the file, from 1.
    pub(super) line: usize,
    /// What has become of it.
    pub(super) fate: Fate,
}

/// What becomes of a setting beside a command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    /// It holds.
    Holds,
    /// The command line gives the flag itself.
    Given,
    /// The command line gives a flag that excludes it.
    Against(String),
}

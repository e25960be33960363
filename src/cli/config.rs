//! Defaults from a file: `scan2params.toml`.
//!
//! In: the words of a command line. Out: the same words with the file's settings put behind their
//! verb as flags, less those that the command line gives itself or that go against what it gives.
//! So every flag can be set, clap checks the values, and what is written with a result is what
//! held. Which flags there are, which take a value, several or none, which are paths and which
//! exclude each other comes from clap: there is no list here.
//!
//! A flag without a value is switched off again on the command line by `--strict=false`.

mod expand;
mod file;
mod setting;
mod show;

pub(crate) use expand::with_defaults;
pub(crate) use show::run;

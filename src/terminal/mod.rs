//! What the command lines of this repository share: printing, failures with their exit codes, the
//! line of progress, Ctrl-C, and the flags that both have.
//!
//! In: what a user typed. Out: options of the library, and what is printed. The programs are
//! `scan2params` (`src/cli`) and `scan2params-lab` (`lab/src/command`). This room is for them: what
//! is in it may change with any version.

// First: its macros stand in for the standard library's in the modules below.
#[macro_use]
pub mod print;

mod ended;
pub mod experiment;
pub mod failure;
pub mod flags;
pub mod interrupt;
pub mod names;
pub mod progress;
pub mod value;
pub mod version;

pub use ended::ended;
pub use failure::{Failure, Outcome};

//! The `scan2params` program: see [`cli`].

// What prints is `cli::print`, which a full disk or a closed pipe does not make panic.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run(std::env::args_os())
}

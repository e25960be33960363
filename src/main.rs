//! The `scan2params` program: see [`cli`].

// What prints is `terminal::print`, which a full disk or a closed pipe does not make panic.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use(eprint, eprintln, print, println, warning)]
extern crate scan2params;

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run(std::env::args_os())
}

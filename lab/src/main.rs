//! The `scan2params-lab` program: see [`command`].

// What prints is `scan2params::terminal::print`, which a full disk or a closed pipe does not make
// panic.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use(eprintln, println)]
extern crate scan2params;

mod command;

use std::process::ExitCode;

fn main() -> ExitCode {
    command::run(std::env::args_os())
}

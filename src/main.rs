//! The `scan2params` program: see [`scan2params::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    scan2params::cli::run(std::env::args_os())
}

//! The program as tests start it: without any file of defaults, whoever runs them and wherever.
//!
//! A `scan2params.toml` in the working directory or the user's `config.toml` changes flags, and
//! with them what a test sees. The empty `SCAN2PARAMS_CONFIG` names no file (docs/config.md).
//! `tests/cli/config.rs` holds that every test starts the program from here.

#![allow(dead_code, reason = "shared by many test programs, each of which uses a part")]

use std::process::Command;

/// Where the program is, for what starts it in its turn: a shell, `script`, `env`.
pub const PATH: &str = env!("CARGO_BIN_EXE_scan2params");

/// The program, without a file of defaults.
pub fn program() -> Command {
    shielded(PATH)
}

/// Any program, whose children read no file of defaults.
pub fn shielded(name: &str) -> Command {
    let mut command = Command::new(name);
    command.env("SCAN2PARAMS_CONFIG", "");
    command
}

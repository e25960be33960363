//! The command line: defaults, outputs, the shell, streams, and what every verb shares.

#[path = "../program/mod.rs"]
mod program;

mod config;
mod outputs;
mod shell;
mod streams;
mod verbs;

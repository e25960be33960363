//! Files in and out: readers, what damaged files do to them, virtual scans and rims as files.

#[path = "../program/mod.rs"]
mod program;

mod augment;
mod boundary_input;
mod e57_las;
mod fuzz;
mod merge;
mod read;
mod views;

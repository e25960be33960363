//! What the laboratory measures, held to its promises; its command line and its page.

#[path = "../../../tests/promises/mod.rs"]
mod promises;
#[path = "../../../tests/scan_support/mod.rs"]
mod scan_support;

mod command_line;
mod held_out;
mod stands;
mod strips;

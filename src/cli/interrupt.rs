//! Ctrl-C: what is half written is removed, and the exit code is 130.
//!
//! What is finished stays: rows of a batch and of a run of `generate` are on the disk as
//! they come, and the same command goes on from there. A program that was started with
//! the signal ignored (in the background of a script) goes on ignoring it.

use std::io::IsTerminal as _;

use scan2params::io::abandon_unfinished;

/// The exit code of a program that a user interrupted.
const INTERRUPTED: i32 = 130;

/// Takes Ctrl-C over, from here to the end of the program.
pub(super) fn watch() {
    // Where it cannot be taken over the system ends the program, as it does without.
    let _ = ctrlc::try_set_handler(|| {
        abandon_unfinished();
        // A terminal has shown `^C` at the end of a line.
        let line_break = if std::io::stderr().is_terminal() { "\n" } else { "" };
        warning!("{line_break}scan2params: interrupted");
        std::process::exit(INTERRUPTED);
    });
}

//! How a program ends: its last message and its exit code.

use std::process::ExitCode;

use super::{Outcome, print};

/// The exit code of what a verb ended with, and its message.
pub fn ended(outcome: Outcome) -> ExitCode {
    let code = match outcome {
        Ok(()) => 0,
        Err(failure) if failure.is_end_of_pipe() => 0,
        Err(failure) => {
            warning!("error: {}", message(&failure.error));
            failure.code
        }
    };
    ExitCode::from(print::finish(code))
}

/// An error with its causes, each once: most errors of the library name theirs.
fn message(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        if text.is_empty() {
            cause
        } else if text.contains(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

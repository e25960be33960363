//! The command line: parses, resolves, calls the library, prints.
//!
//! stdout is for data, stderr for people. Exit codes: 0 ok, 1 failure, 2 usage,
//! 3 some of a batch failed, 4 scan refused or not the experiment, 130 interrupted.

mod args;
mod augment;
mod batch;
mod estimate;
mod evaluate;
mod experiment;
mod failure;
mod generate;
mod inspect;
mod simulate;

use std::ffi::OsString;
use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser as _;

use failure::{Failure, Outcome};

/// Runs the program with `arguments`, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = args::with_default_verb(arguments);
    let parsed = match args::Arguments::try_parse_from(arguments) {
        Ok(parsed) => parsed,
        Err(error) => {
            // help and version go to stdout with code 0, faults to stderr with 2
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    on_interrupt();
    let outcome = match parsed.command {
        args::Command::Estimate(given) => estimate::run(&given),
        args::Command::Inspect(given) => inspect::inspect(&given),
        args::Command::Boundary(given) => inspect::boundary(&given),
        args::Command::Batch(given) => batch::run(&given),
        args::Command::Augment(given) => augment::run(&given),
        args::Command::Evaluate(given) => evaluate::run(&given),
        args::Command::Simulate(given) => simulate::run(&given),
        args::Command::Generate(given) => generate::run(&given),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("scan2params: {}", message(&failure.error));
            ExitCode::from(failure.code)
        }
    }
}

/// Exit code of a program that was interrupted from the keyboard: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

/// Ends the program on an interrupt (control-C): removes what is written half, and exits with
/// code 130. Where the system has no such signal, or refuses, it ends as it always did.
fn on_interrupt() {
    let set = ctrlc::set_handler(|| {
        let _writers_wait = scan2params::io::abandon();
        // The terminal may be gone.
        let _ = writeln!(std::io::stderr(), "scan2params: interrupted");
        std::process::exit(INTERRUPTED);
    });
    if let Err(error) = set {
        eprintln!("scan2params: an interrupt may leave .part files behind ({error})");
    }
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

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
mod generate;
mod inspect;
mod simulate;

use std::ffi::OsString;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser as _;

use scan2params::job::{FailureKind, JobError, Verdict};

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

/// What went wrong, with the exit code that says which kind it is.
pub(crate) struct Failure {
    code: u8,
    error: anyhow::Error,
}

impl Failure {
    /// A mistake in what the user asked for: exit code 2.
    pub(crate) fn usage(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 2, error: error.into() }
    }

    /// A batch of which some failed: exit code 3.
    pub(crate) fn partial(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 3, error: error.into() }
    }

    /// A failure of this kind.
    pub(crate) fn of_kind(kind: FailureKind, error: impl Into<anyhow::Error>) -> Self {
        Self { code: kind.exit_code(), error: error.into() }
    }

    /// A result that was written and is not to be used: exit code 4. Nothing otherwise.
    pub(crate) fn of_verdict(input: &Path, verdict: &Verdict, strict: bool) -> Outcome {
        if !verdict.is_refusal(strict) {
            return Ok(());
        }
        let (input, why) = (input.display(), verdict.refusal());
        Err(Self::of_kind(FailureKind::Refused, anyhow::anyhow!("{input}: {why}")))
    }

    /// The exit code that a job's error stands for.
    pub(crate) fn of_job(error: JobError) -> Self {
        Self::of_kind(error.kind(), error)
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { code: 1, error: error.into() }
    }
}

pub(crate) type Outcome = Result<(), Failure>;

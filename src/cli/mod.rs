//! The command line: parses, resolves, calls the library, prints.
//!
//! stdout is for data, stderr for people. Exit codes: 0 ok, 1 failure, 2 usage,
//! 3 some of a batch failed, 4 scan refused or not the experiment, 130 interrupted.

// First: its macros stand in for the standard library's in the modules below.
#[macro_use]
mod print;

mod args;
mod augment;
mod batch;
mod estimate;
mod evaluate;
mod experiment;
mod generate;
mod inspect;
mod interrupt;
mod progress;
mod simulate;
mod verb;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser as _;

use scan2params::io::OutputError;
use scan2params::job::{FailureKind, JobError, Verdict};

/// Runs the program with `arguments`, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    interrupt::watch();
    let arguments = verb::with_default_verb(arguments);
    let parsed = match arguments.and_then(args::Arguments::try_parse_from) {
        Ok(parsed) => parsed,
        Err(error) => return print::of_clap(&error),
    };
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
    let code = match outcome {
        Ok(()) => 0,
        Err(failure) if failure.is_end_of_pipe() => 0,
        Err(failure) => {
            eprintln!("scan2params: {}", message(&failure.error));
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

    /// A result that cannot be written where it is asked to be.
    pub(crate) fn of_output(error: OutputError) -> Self {
        Self { code: if error.is_usage() { 2 } else { 1 }, error: error.into() }
    }

    /// Whether a result went to a pipe whose reader had enough, as `| head` does.
    fn is_end_of_pipe(&self) -> bool {
        let mut causes = self.error.chain().filter_map(|cause| cause.downcast_ref());
        causes.any(print::reader_has_gone)
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { code: 1, error: error.into() }
    }
}

pub(crate) type Outcome = Result<(), Failure>;

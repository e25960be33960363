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
mod calibrate;
mod combine;
mod config;
mod estimate;
mod evaluate;
mod experiment;
mod export;
mod failure;
mod generate;
mod inspect;
mod interrupt;
mod kit;
mod merge;
mod names;
mod progress;
mod shell;
mod simulate;
mod usage;
mod verb;
mod version;

use std::ffi::OsString;
use std::process::ExitCode;

use failure::{Failure, Outcome};

/// Runs the program with `arguments`, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    interrupt::watch();
    let words = match verb::with_default_verb(arguments) {
        Ok(words) => words,
        Err(error) => return print::of_clap(&error),
    };
    let expanded = match config::with_defaults(words) {
        Ok(expanded) => expanded,
        Err(failure) => return ended(Err(failure)),
    };
    let parsed = match usage::parse(&expanded.words) {
        Ok(parsed) => parsed,
        Err(error) => {
            let code = print::of_clap(&error);
            if let Some(places) = expanded.places().filter(|_| error.use_stderr()) {
                warning!("{places}");
            }
            return code;
        }
    };
    print::talk(parsed.talk.quiet, parsed.talk.verbose);
    if let Some(told) = expanded.told() {
        eprintln!("{told}");
    }
    if let Err(failure) = use_threads(parsed.command.threads()) {
        return ended(Err(failure));
    }
    if print::is_verbose() {
        let threads = rayon::current_num_threads();
        eprintln!("{} on {threads} threads", version::long().replace('\n', ", "));
    }
    let keeps_its_work = matches!(
        parsed.command,
        args::Command::Batch(_) | args::Command::Generate(_) | args::Command::Calibrate(_)
    );
    if keeps_its_work {
        interrupt::continues();
    }
    let outcome = match parsed.command {
        args::Command::Estimate(given) => estimate::run(&given),
        args::Command::Inspect(given) => inspect::inspect(&given),
        args::Command::Merge(given) => merge::merge(&given),
        args::Command::Boundary(given) => inspect::boundary(&given),
        args::Command::Batch(given) => batch::run(&given),
        args::Command::Calibrate(given) => calibrate::run(&given),
        args::Command::Augment(given) => augment::run(&given),
        args::Command::Combine(given) => combine::run(&given),
        args::Command::Kit(given) => kit::run(&given),
        args::Command::Evaluate(given) => evaluate::run(&given.what),
        args::Command::Simulate(given) => simulate::run(&given),
        args::Command::Generate(given) => generate::run(&given),
        args::Command::Export(given) => export::export(&given),
        args::Command::Convert(given) => export::convert(&given),
        args::Command::Config(given) => config::run(&given, parsed.talk.config.as_deref()),
        args::Command::Completions(given) => shell::completions(&given),
        args::Command::Man(given) => shell::man(&given),
        args::Command::Version => version::print(),
    };
    ended(outcome)
}

/// Limits what runs on rayon's pool, which all computing does; 0 leaves one thread per core.
fn use_threads(threads: usize) -> Outcome {
    if threads > 0 {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    Ok(())
}

/// The exit code of what a verb ended with, and its message.
fn ended(outcome: Outcome) -> ExitCode {
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

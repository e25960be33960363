//! The command line: parses, resolves, calls the library, prints.
//!
//! stdout is for data, stderr for people. Exit codes: 0 ok, 1 failure, 2 usage,
//! 3 some of a batch failed, 4 scan refused or not the experiment, 130 interrupted.

mod args;
mod augment;
mod batch;
mod calibrate;
mod combine;
mod config;
mod estimate;
mod export;
mod generate;
mod inspect;
mod kit;
mod merge;
mod shell;
mod simulate;
mod usage;
mod verb;
mod version;

use std::ffi::OsString;
use std::process::ExitCode;

use scan2params::terminal::{Failure, Outcome, ended, interrupt, print, progress};

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
    parsed.talk.apply();
    if let Some(told) = expanded.told() {
        eprintln!("{told}");
    }
    if let Err(failure) = parsed.command.use_threads() {
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
        args::Command::Simulate(given) => simulate::run(&given),
        args::Command::Generate(given) => generate::run(&given),
        args::Command::Export(given) => export::export(&given),
        args::Command::Convert(given) => export::convert(&given),
        args::Command::Config(given) => config::run(&given, parsed.config.as_deref()),
        args::Command::Completions(given) => shell::completions(&given),
        args::Command::Man(given) => shell::man(&given),
        args::Command::Version => version::print(),
    };
    ended(outcome)
}

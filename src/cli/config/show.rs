//! `config`: the file that is found, and what a command line comes to with it.

use std::ffi::{OsStr, OsString};

use anyhow::anyhow;
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, CommandFactory as _};

use super::expand::{Expanded, NAME, VARIABLE, of_user, verb_of, with_defaults};
use super::file;
use super::setting::Fate;
use crate::cli::args::{self, Arguments};
use crate::cli::verb;
use scan2params::terminal::{Failure, Outcome};

/// Prints where defaults come from; with a command line the value of each of its flags, too.
pub(crate) fn run(given: &args::Config, file: Option<&OsStr>) -> Outcome {
    let mut words = vec![OsString::from("scan2params")];
    if let Some(name) = file {
        words.extend([OsString::from("--config"), name.to_owned()]);
    }
    words.extend(given.line.iter().cloned());
    if given.line.is_empty() {
        // Any verb: all of the file is checked.
        words.push("config".into());
    } else {
        words = match verb::with_default_verb(words) {
            Ok(words) => words,
            Err(error) => return Err(Failure::usage(anyhow!("{error}"))),
        };
    }
    let expanded = with_defaults(words)?;
    match &expanded.file {
        Some(file) => println!("file  {}", file.display()),
        None => println!("file  none"),
    }
    if given.line.is_empty() {
        println!("looked for: --config FILE, {VARIABLE}, {NAME} in this folder, {}", user());
        return Ok(());
    }
    // What has to be given may still be missing here.
    if let Err(error) = Arguments::command().try_get_matches_from(&expanded.words)
        && error.use_stderr()
        && error.kind() != ErrorKind::MissingRequiredArgument
    {
        let said = error.to_string();
        return Err(Failure::usage(anyhow!("{}", said.trim_start_matches("error: ").trim_end())));
    }
    let mut program = Arguments::command();
    program.build();
    let parsed = Arguments::command().ignore_errors(true).try_get_matches_from(&expanded.words);
    let (Some(verb), Ok(parsed)) = (verb_of(&program, &expanded.words), parsed) else {
        return Ok(());
    };
    let mut matches = &parsed;
    while let Some((_, below)) = matches.subcommand() {
        matches = below;
    }
    for arg in file::flags(verb) {
        let (value, origin) = resolved(arg, matches, &expanded);
        println!("{:22}  {value:20}  {origin}", file::named(arg));
    }
    Ok(())
}

/// The user's file, whether it is there or not.
fn user() -> String {
    of_user().map_or_else(|| "no folder of the user".to_owned(), |path| path.display().to_string())
}

/// The value of a flag, and where it comes from.
fn resolved(arg: &Arg, matches: &ArgMatches, expanded: &Expanded) -> (String, String) {
    let id = arg.get_id().as_str();
    let setting = expanded.settings.iter().find(|setting| setting.id == id);
    let file = expanded.file.as_ref().map(|file| file.display().to_string()).unwrap_or_default();
    let place = setting.map(|setting| format!("{file}:{}", setting.line)).unwrap_or_default();
    let is_known = matches.ids().any(|known| known.as_str() == id);
    let source = if is_known { matches.value_source(id) } else { None };
    let value = match matches.try_get_raw(id) {
        _ if file::is_switch(arg) => {
            let on = matches.try_get_one::<bool>(id).ok().flatten().copied();
            on.unwrap_or(false).to_string()
        }
        Ok(Some(raw)) => raw.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" "),
        _ => "-".to_owned(),
    };
    let origin = match (setting.map(|setting| &setting.fate), source) {
        (Some(Fate::Holds), _) => place,
        (Some(Fate::Given), _) => format!("the command line, not {place}"),
        (Some(Fate::Against(flag)), _) => format!("not {place}: {flag} is given"),
        (None, Some(ValueSource::CommandLine)) => "the command line".to_owned(),
        (None, Some(_)) => "default".to_owned(),
        (None, None) if arg.is_required_set() => "must be given".to_owned(),
        (None, None) => "not given".to_owned(),
    };
    (value, origin)
}

//! A command line with the defaults of a file.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command, CommandFactory as _};

use super::file;
use super::setting::{Fate, Setting};
use crate::cli::args::Arguments;
use crate::cli::verb;
use scan2params::terminal::Failure;

/// Name of the file in the folder that the program is started in.
pub(super) const NAME: &str = "scan2params.toml";
/// The variable that names a file; empty: none.
pub(super) const VARIABLE: &str = "SCAN2PARAMS_CONFIG";

/// A command line with its defaults.
pub(crate) struct Expanded {
    /// What is parsed.
    pub(crate) words: Vec<OsString>,
    /// The file that the settings are of.
    pub(crate) file: Option<PathBuf>,
    /// The file's settings for this verb.
    pub(crate) settings: Vec<Setting>,
}

impl Expanded {
    /// What the file adds, as a sentence for people; `None` where it adds nothing.
    pub(crate) fn told(&self) -> Option<String> {
        let file = self.file.as_ref()?;
        let words: Vec<_> = self.in_force().flat_map(|s| &s.words).collect();
        let words: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
        (!words.is_empty()).then(|| format!("with {} ({})", words.join(" "), file.display()))
    }

    /// Where the file's part of a command line that cannot be used stands.
    pub(crate) fn places(&self) -> Option<String> {
        let file = self.file.as_ref()?.display();
        let holds = self.in_force().filter(|setting| !setting.words.is_empty());
        let places: Vec<_> =
            holds.map(|s| format!("note: {} is from {file}:{}", s.flag, s.line)).collect();
        (!places.is_empty()).then(|| places.join("\n"))
    }

    fn in_force(&self) -> impl Iterator<Item = &Setting> {
        self.settings.iter().filter(|setting| setting.fate == Fate::Holds)
    }
}

/// The command line with the defaults of the file that is found.
///
/// # Errors
/// A file that cannot be read (exit code 1), or that says what no flag means (2).
pub(crate) fn with_defaults(mut words: Vec<OsString>) -> Result<Expanded, Failure> {
    let mut program = Arguments::command();
    program.build();
    let without = |words| Ok(Expanded { words, file: None, settings: Vec::new() });
    let Some(verb) = verb_of(&program, &words) else { return without(words) };
    let off = take_switched_off(&mut words, verb);
    // Help and versions need no file.
    let given = Arguments::command().ignore_errors(true).try_get_matches_from(&words);
    let (Some(path), Ok(given)) = (find(&words), given) else { return without(words) };
    let mut settings = file::read(&path, &program, verb)?;
    for setting in &mut settings {
        setting.fate = fate(setting, &given, verb, &off);
    }
    let new = settings.iter().filter(|setting| setting.fate == Fate::Holds);
    let new: Vec<OsString> = new.flat_map(|setting| setting.words.clone()).collect();
    let after = verb::place(&words) + 1;
    words.splice(after..after, new);
    Ok(Expanded { words, file: Some(path), settings })
}

/// The verb of a command line; `None` without one, and for `help`.
pub(super) fn verb_of<'a>(program: &'a Command, words: &[OsString]) -> Option<&'a Command> {
    let verb = program.find_subcommand(words.get(verb::place(words))?)?;
    (verb.get_name() != "help").then_some(verb)
}

/// Takes `--strict=false` and its kin out of a command line, and makes `--strict` of
/// `--strict=true`. Returns the names of the flags that are switched off.
fn take_switched_off(words: &mut Vec<OsString>, verb: &Command) -> Vec<String> {
    let mut off = Vec::new();
    let end = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let mut place = 0;
    words.retain_mut(|word| {
        place += 1;
        let switch = word.to_str().filter(|_| place <= end).and_then(|word| {
            let (flag, value) = word.strip_prefix("--")?.split_once('=')?;
            let on: bool = value.parse().ok()?;
            let arg = file::flag(verb, flag)?;
            file::is_switch(arg).then(|| (arg.get_id().to_string(), format!("--{flag}"), on))
        });
        match switch {
            Some((_, flag, true)) => *word = flag.into(),
            Some((id, _, false)) => {
                off.push(id);
                return false;
            }
            None => {}
        }
        true
    });
    off
}

/// The file: of the flag, of the variable, of this folder, of the user.
fn find(words: &[OsString]) -> Option<PathBuf> {
    let named = |name: OsString| (!name.is_empty()).then(|| PathBuf::from(name));
    if let Some(name) = of_flag(words) {
        return named(name);
    }
    if let Some(name) = std::env::var_os(VARIABLE) {
        return named(name);
    }
    let here = PathBuf::from(NAME);
    if here.is_file() {
        return Some(here);
    }
    of_user().filter(|path| path.is_file())
}

/// What `--config` names; `Some("")`: no file.
fn of_flag(words: &[OsString]) -> Option<OsString> {
    let end = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let words = &words[..end];
    words.iter().enumerate().find_map(|(k, word)| {
        if word == "--config" {
            return words.get(k + 1).cloned();
        }
        word.to_str()?.strip_prefix("--config=").map(OsString::from)
    })
}

/// The user's own file, as the XDG base directory specification has it: relative folders do not
/// count.
pub(super) fn of_user() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|p| p.is_absolute());
    let config = folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?;
    Some(config.join("scan2params").join("config.toml"))
}

/// What becomes of a setting beside what the command line gives.
fn fate(setting: &Setting, given: &ArgMatches, verb: &Command, off: &[String]) -> Fate {
    let on_line = |id: &str| {
        let mut matches = Some(given);
        while let Some(of) = matches {
            let is_known = of.ids().any(|known| known.as_str() == id);
            if is_known && of.value_source(id) == Some(ValueSource::CommandLine) {
                return true;
            }
            matches = of.subcommand().map(|(_, below)| below);
        }
        false
    };
    if off.contains(&setting.id) || on_line(&setting.id) {
        return Fate::Given;
    }
    let Some(own) = verb.get_arguments().find(|arg| arg.get_id() == &setting.id) else {
        return Fate::Holds;
    };
    // Either of two flags may be the one that says that they exclude each other.
    let excludes = |a: &clap::Arg, b: &clap::Arg| {
        verb.get_arg_conflicts_with(a).iter().any(|arg| arg.get_id() == b.get_id())
    };
    let against = verb
        .get_arguments()
        .find(|arg| on_line(arg.get_id().as_str()) && (excludes(own, arg) || excludes(arg, own)));
    against.map_or(Fate::Holds, |arg| Fate::Against(file::named(arg)))
}

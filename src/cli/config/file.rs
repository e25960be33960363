//! What a file of defaults says: each key a flag of its verb.
//!
//! In: TOML. Keys above the first table are flags that every verb takes (`threads`, `quiet`,
//! `verbose`); a table is a verb. A key is a flag's name, hyphens or underscores. Faults are told
//! with file, line and column, and a name that is not known with the nearest that is.

use std::any::TypeId;
use std::ffi::{OsStr, OsString};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::{Arg, ArgAction, Command};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::setting::{Fate, Setting};
use crate::cli::verb;
use scan2params::terminal::Failure;

/// A file while it is read.
struct Reading<'a> {
    path: &'a Path,
    text: &'a str,
    /// The verb of the command line.
    verb: &'a Command,
    settings: Vec<Setting>,
}

/// The settings of a file for a verb; all of the file is checked.
///
/// # Errors
/// A file that cannot be read, or that says what no flag means.
pub(super) fn read(
    path: &Path,
    program: &Command,
    verb: &Command,
) -> Result<Vec<Setting>, Failure> {
    let text = scan2params::base::text::read_to_string(path)
        .map_err(|error| anyhow!("{}: cannot be read ({error})", path.display()))?;
    let mut reading = Reading { path, text: &text, verb, settings: Vec::new() };
    let parsed = DeTable::parse(&text);
    let table = parsed.map_err(|error| {
        reading.fault(error.span().unwrap_or(0..0), &format!("no TOML: {}", error.message()))
    })?;
    reading.top(table.get_ref(), program)?;
    Ok(reading.settings)
}

/// The flag of a name, two hyphens less, that a file may set.
pub(super) fn flag<'a>(verb: &'a Command, name: &str) -> Option<&'a Arg> {
    flags(verb).find(|arg| arg.get_long() == Some(name))
}

/// The flags of a verb that a file may set.
pub(super) fn flags(verb: &Command) -> impl Iterator<Item = &Arg> {
    verb.get_arguments().filter(|arg| {
        let asks = matches!(
            arg.get_action(),
            ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong | ArgAction::Version
        );
        arg.get_long().is_some_and(|long| long != "config") && !asks
    })
}

/// A flag without a value.
pub(super) fn is_switch(arg: &Arg) -> bool {
    matches!(arg.get_action(), ArgAction::SetTrue)
}

/// A flag as it is typed.
pub(super) fn named(arg: &Arg) -> String {
    arg.get_long().map_or_else(|| arg.get_id().to_string(), |long| format!("--{long}"))
}

impl Reading<'_> {
    /// What is wrong, with its place.
    fn fault(&self, span: Range<usize>, what: &str) -> Failure {
        let before = &self.text[..span.start.min(self.text.len())];
        let column = before.rsplit('\n').next().map_or(0, |line| line.chars().count()) + 1;
        let (path, line) = (self.path.display(), self.line(span.start));
        Failure::usage(anyhow!("{path}:{line}:{column}: {what}"))
    }

    fn line(&self, at: usize) -> usize {
        self.text[..at.min(self.text.len())].matches('\n').count() + 1
    }

    /// The keys above the first table, and the tables.
    fn top(&mut self, table: &DeTable<'_>, program: &Command) -> Result<(), Failure> {
        let verbs = || program.get_subcommands().filter(|verb| verb.get_name() != "help");
        let all = || verbs().flat_map(flags).filter(|arg| arg.is_global_set());
        let mut seen = Vec::new();
        for (key, value) in table {
            self.only_once(key, &mut seen)?;
            let name = key.get_ref().as_ref();
            if let Some(verb) = verbs().find(|verb| verb.get_name() == name) {
                self.verb(key, value, verb)?;
                continue;
            }
            let long = name.replace('_', "-");
            let Some(arg) = all().find(|arg| arg.get_long() == Some(&long)) else {
                let flags = verbs().flat_map(flags).filter_map(Arg::get_long);
                let known = verbs().map(Command::get_name).chain(flags);
                let of = verbs().find(|verb| flag(verb, &long).is_some());
                let why = match of {
                    Some(of) => format!(
                        "`{name}` is a flag of single verbs: write it below `[{}]`",
                        of.get_name()
                    ),
                    None => unknown(name, "verb, nor a flag of all of them", known),
                };
                return Err(self.fault(key.span(), &why));
            };
            // Of the verb that is run, if it takes it.
            let is_taken = flag(self.verb, &long).is_some();
            self.set(key, value, arg, is_taken, true)?;
        }
        Ok(())
    }

    /// The table of a verb.
    fn verb(
        &mut self,
        key: &Spanned<impl AsRef<str>>,
        value: &Spanned<DeValue<'_>>,
        verb: &Command,
    ) -> Result<(), Failure> {
        let DeValue::Table(table) = value.get_ref() else {
            let why =
                format!("`{0}` is a verb: write its flags below `[{0}]`", key.get_ref().as_ref());
            return Err(self.fault(key.span(), &why));
        };
        let is_run = self.verb.get_name() == verb.get_name();
        let mut seen = Vec::new();
        for (key, value) in table {
            self.only_once(key, &mut seen)?;
            let name = key.get_ref().as_ref();
            let Some(arg) = flag(verb, &name.replace('_', "-")) else {
                let of = format!("flag of `{}`", verb.get_name());
                let known = flags(verb).filter_map(Arg::get_long);
                return Err(self.fault(key.span(), &unknown(name, &of, known)));
            };
            self.set(key, value, arg, is_run, false)?;
        }
        Ok(())
    }

    /// Checks a setting, and takes it where it is of the verb that is run: what stands in the table
    /// of a verb before what stands above all tables.
    fn set(
        &mut self,
        key: &Spanned<impl AsRef<str>>,
        value: &Spanned<DeValue<'_>>,
        arg: &Arg,
        is_taken: bool,
        of_all: bool,
    ) -> Result<(), Failure> {
        let words = self.words(value, arg)?;
        if !is_taken {
            return Ok(());
        }
        let (flag, id) = (named(arg), arg.get_id().to_string());
        let line = self.line(key.span().start);
        let new = Setting { of_all, id, flag, words, line, fate: Fate::Holds };
        match self.settings.iter_mut().find(|old| old.id == new.id) {
            Some(old) if old.of_all && !new.of_all => *old = new,
            Some(_) => {}
            None => self.settings.push(new),
        }
        Ok(())
    }

    /// Refuses the second of two spellings of a key in one table.
    fn only_once(
        &self,
        key: &Spanned<impl AsRef<str>>,
        seen: &mut Vec<(String, usize)>,
    ) -> Result<(), Failure> {
        let name = key.get_ref().as_ref();
        let (long, line) = (name.replace('_', "-"), self.line(key.span().start));
        if let Some((_, first)) = seen.iter().find(|(other, _)| *other == long) {
            let why = format!("`{name}` is set in line {first} already");
            return Err(self.fault(key.span(), &why));
        }
        seen.push((long, line));
        Ok(())
    }

    /// What a value adds to a command line.
    fn words(&self, value: &Spanned<DeValue<'_>>, arg: &Arg) -> Result<Vec<OsString>, Failure> {
        let flag = named(arg);
        let takes = arg.get_num_args().unwrap_or_else(|| 1.into());
        if let DeValue::Boolean(on) = value.get_ref() {
            if is_switch(arg) || takes.min_values() == 0 {
                return Ok(on.then(|| flag.into()).into_iter().collect());
            }
            return Err(
                self.fault(value.span(), &format!("{flag} takes a value, not true or false"))
            );
        }
        if is_switch(arg) {
            return Err(self.fault(value.span(), &format!("{flag} is true or false")));
        }
        let takes_several = matches!(arg.get_action(), ArgAction::Append)
            || takes.max_values() > 1
            || arg.get_value_delimiter().is_some();
        match value.get_ref() {
            DeValue::Array(entries) if takes_several => {
                entries.iter().map(|entry| self.word(entry, arg)).collect()
            }
            DeValue::Array(_) => {
                Err(self.fault(value.span(), &format!("{flag} takes one value, not a list")))
            }
            _ => Ok(vec![self.word(value, arg)?]),
        }
    }

    /// A flag with one value.
    fn word(&self, value: &Spanned<DeValue<'_>>, arg: &Arg) -> Result<OsString, Failure> {
        let text: OsString = match value.get_ref() {
            DeValue::String(text) => text.as_ref().into(),
            // As it is written, less the strokes that TOML allows in a number.
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.text[value.span()].replace('_', "").into()
            }
            _ => {
                let why = format!("{} takes a text or a number", named(arg));
                return Err(self.fault(value.span(), &why));
            }
        };
        let is_path = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
        let text = if is_path { from_folder(self.path, &text) } else { text };
        let mut word = OsString::from(named(arg));
        word.push("=");
        word.push(text);
        Ok(word)
    }
}

/// That a name is not known, with the nearest that is.
fn unknown<'a>(name: &str, what: &str, known: impl Iterator<Item = &'a str>) -> String {
    let nearest = verb::nearest(&name.replace('_', "-"), known);
    let hint = nearest.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!("`{name}` is no {what}{hint}")
}

/// A path as the file means it: from the folder in which it lies.
fn from_folder(file: &Path, path: &OsStr) -> OsString {
    match file.parent() {
        Some(folder) if path != "-" => folder.join(path).into_os_string(),
        _ => path.to_owned(),
    }
}

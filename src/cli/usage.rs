//! A command line parsed, and what is said of one that cannot be.
//!
//! Two things beyond clap's own: a negative number is a number wherever a flag takes a value, so that it is refused as what it is
//! and not as an unknown flag; and a flag that another verb has is answered with where it belongs.

use std::ffi::OsString;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, CommandFactory as _, FromArgMatches as _};

use super::args::Arguments;
use super::verb;

/// The arguments of a command line whose verb is written out.
///
/// # Errors
/// What clap finds wrong, with a tip.
pub(crate) fn parse(words: &[OsString]) -> Result<Arguments, clap::Error> {
    let mut program = with_negative_numbers(Arguments::command());
    let parsed = program.try_get_matches_from_mut(words);
    parsed
        .and_then(|matches| Arguments::from_arg_matches(&matches))
        .map_err(|error| with_tip(error, words))
}

/// The program, with negative numbers taken for values by every flag of its verbs.
fn with_negative_numbers(program: Command) -> Command {
    let verbs: Vec<String> =
        program.get_subcommands().map(|verb| verb.get_name().to_owned()).collect();
    let program = program.mut_args(|arg| {
        let takes_value = arg.get_action().takes_values();
        if takes_value && arg.get_long().is_some() { arg.allow_negative_numbers(true) } else { arg }
    });
    verbs.iter().fold(program, |program, verb| program.mut_subcommand(verb, with_negative_numbers))
}

/// An unknown word with where it belongs, in place of a flag that is spelled a little like it.
fn with_tip(mut error: clap::Error, words: &[OsString]) -> clap::Error {
    let unknown = match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (ErrorKind::UnknownArgument, Some(ContextValue::String(unknown))) => unknown.clone(),
        _ => return error,
    };
    let verb = words.get(verb::place(words)).and_then(|word| word.to_str()).unwrap_or_default();
    let Some(tip) = tip(&unknown, verb) else { return error };
    // a usage line would be that of the flag which is spelled alike
    error.remove(ContextKind::SuggestedArg);
    error.remove(ContextKind::Usage);
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(tip)]));
    error
}

fn tip(unknown: &str, verb: &str) -> Option<String> {
    let flag = unknown.strip_prefix("--")?;
    let program = Arguments::command();
    let has = |verb: &&Command| verb.get_arguments().any(|arg| arg.get_long() == Some(flag));
    let verbs: Vec<&str> = program.get_subcommands().filter(has).map(Command::get_name).collect();
    (!verbs.is_empty())
        .then(|| format!("`--{flag}` is a flag of {}, not of {verb}", verbs.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(line: &str) -> String {
        let words: Vec<OsString> = line.split_whitespace().map(OsString::from).collect();
        parse(&words).unwrap_err().to_string()
    }

    #[test]
    fn a_negative_number_is_a_value_of_every_flag() {
        for line in [
            "s estimate a.ply --density -214",
            "s batch a --density -1.5",
            "s simulate --params a.json --bending-weft -5 --out b.obj",
            "s augment a.obj --even -3 --out b.ply",
        ] {
            let words: Vec<OsString> = line.split_whitespace().map(OsString::from).collect();
            if let Err(error) = parse(&words) {
                let said = error.to_string();
                assert!(!said.contains("unexpected argument '-"), "{line}: {said}");
            }
        }
        let words = ["s", "estimate", "a.ply", "--density", "-214"].map(OsString::from);
        let super::super::args::Command::Estimate(given) = parse(&words).unwrap().command else {
            panic!("another verb");
        };
        assert_eq!(given.density, -214.0);
    }

    #[test]
    fn what_another_verb_takes_is_named_with_that_verb() {
        let said = fault("s inspect a.ply --density 214");
        assert!(said.contains("`--density` is a flag of estimate, batch"), "{said}");
        assert!(!said.contains("--unit"), "{said}");
        assert!(fault("s estimate a.ply --densty 214").contains("'--density'"));
        assert!(!fault("s combine --frobnicate").contains("is a flag of"));
    }

    #[test]
    fn a_density_that_is_no_number_is_told_how_to_be_one() {
        for given in ["214,5", "6.3oz/yd2", "scan.ply", "214g/m2", ""] {
            let said = fault(&format!("s estimate a.ply --density={given}"));
            assert!(given.is_empty() || said.contains("decimal point"), "{given}: {said}");
            assert!(given.is_empty() || said.contains("scan2params convert"), "{given}: {said}");
        }
    }
}

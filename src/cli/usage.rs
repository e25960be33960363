//! A command line parsed, and the error of one that cannot be.
//!
//! Beyond clap's own: a negative number is a value for every flag that takes one, so that it is not
//! refused as an unknown flag; a flag of another verb is answered with that verb; a missing density
//! with how to weigh; and paths are checked that the system cannot have, or that are `-`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgMatches, Command, CommandFactory as _, FromArgMatches as _};

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
        .and_then(|matches| {
            check_paths(&program, &matches)?;
            Arguments::from_arg_matches(&matches)
        })
        .map_err(|error| with_tip(error, words))
}

/// Refuses paths that are too long for the system, and `-` where the standard input is not read.
fn check_paths(command: &Command, matches: &ArgMatches) -> Result<(), clap::Error> {
    // Only a scan has a format, which the standard input needs.
    let reads_scan = command.get_arguments().any(|arg| arg.get_id() == "format");
    for arg in command.get_arguments() {
        let Ok(Some(paths)) = matches.try_get_many::<PathBuf>(arg.get_id().as_str()) else {
            continue;
        };
        for path in paths {
            let takes_stdin = reads_scan && arg.get_id() == "input";
            if let Some(fault) = path_fault(path, takes_stdin) {
                // without a usage line, which would be that of the whole program
                let fault = format!("{arg}: {fault}\n");
                return Err(clap::Error::raw(ErrorKind::ValueValidation, fault));
            }
        }
    }
    let Some((name, below)) = matches.subcommand() else { return Ok(()) };
    command.find_subcommand(name).map_or(Ok(()), |command| check_paths(command, below))
}

/// What is wrong with a path before anything is done with it.
fn path_fault(path: &Path, takes_stdin: bool) -> Option<String> {
    const SHOWN: usize = 60;
    if path.as_os_str() == "-" && !takes_stdin {
        let why = "`-` is the standard input, which only INPUT of estimate, inspect and boundary can be; \
                   give the path of a file (./- for one of that name)";
        return Some(why.to_owned());
    }
    let error = path.symlink_metadata().err()?;
    (error.kind() == std::io::ErrorKind::InvalidFilename).then(|| {
        let head: String = path.to_string_lossy().chars().take(SHOWN).collect();
        let bytes = path.as_os_str().len();
        format!("the path or a name in it is too long for this system ({bytes} bytes: {head}...); give a shorter one")
    })
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

/// How a density is measured.
const WEIGH: &str = "cut a square of 100 x 100 mm and weigh it in g; times 100 is g/m^2";

/// Where a whole fabric comes from, of which flags give single numbers.
const WHOLE_FABRIC: &str =
    "--params FILE takes all seven from a params.json, as `estimate --out` writes it";

/// An error with a tip: where an unknown flag belongs, what is there in place of missing ones.
fn with_tip(mut error: clap::Error, words: &[OsString]) -> clap::Error {
    let missing = if lacks(&error, "--bending-bias") {
        Some(WHOLE_FABRIC)
    } else {
        lacks(&error, "--density").then_some(WEIGH)
    };
    if let Some(tip) = missing {
        let tip = StyledStr::from(tip);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
        return error;
    }
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

/// Whether a flag is what is missing, or one of them.
fn lacks(error: &clap::Error, flag: &str) -> bool {
    error.kind() == ErrorKind::MissingRequiredArgument
        && matches!(
            error.get(ContextKind::InvalidArg),
            Some(ContextValue::Strings(missing)) if missing.iter().any(|arg| arg.contains(flag))
        )
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
    fn paths_that_cannot_be_are_told() {
        let long = "a".repeat(5000);
        for line in [
            format!("s inspect {long}.ply"),
            format!("s estimate a.ply --density 1 --out {long}"),
            format!("s combine a.json {}", "b/".repeat(4000)),
            format!("s merge {long} -o b.ply"),
        ] {
            let said = fault(&line);
            assert!(said.contains("too long for this system") && said.len() < 1000, "{said}");
        }
        for line in [
            "s estimate a.ply - --density 1",
            "s estimate a.ply --density 1 --with -",
            "s estimate a.ply --density 1 -o -",
            "s batch - --density 1",
            "s augment - -o b.ply",
        ] {
            assert!(fault(line).contains("`-` is the standard input, which only INPUT"), "{line}");
        }
        let words = ["s", "estimate", "-", "--format", "ply", "--density", "1"];
        parse(&words.map(OsString::from)).unwrap();
    }

    #[test]
    fn a_missing_density_is_told_how_to_be_weighed() {
        for line in ["s estimate a.ply", "s batch a"] {
            let said = fault(line);
            assert!(
                said.contains("100 x 100 mm") && said.contains("--density <G_PER_M2>"),
                "{said}"
            );
        }
        // one of two is enough, and the error names both
        assert!(fault("s batch a").contains("--density-csv <FILE.csv>"));
        for line in ["s batch a --density 200", "s batch a --density-csv b.csv"] {
            let words: Vec<OsString> = line.split_whitespace().map(OsString::from).collect();
            parse(&words).unwrap();
        }
        assert!(!fault("s merge a.ply").contains("weigh"));
    }

    /// In the order of the help: positions first, then required flags, then the others.
    #[test]
    fn required_flags_stand_first_in_help() {
        let mut program = Arguments::command();
        program.build();
        for verb in program.get_subcommands() {
            let help = verb.clone().render_long_help().to_string();
            let lines: Vec<&str> =
                help.lines().map(str::trim_start).filter(|line| line.starts_with('-')).collect();
            let place = |arg: &clap::Arg| {
                let flag = format!("--{}", arg.get_long()?);
                lines.iter().position(|line| line.split([' ', ',']).any(|word| word == flag))
            };
            let flags = || verb.get_arguments().filter(|arg| arg.get_long().is_some());
            let required = flags().filter(|arg| arg.is_required_set()).filter_map(place).max();
            let others = flags().filter(|arg| !arg.is_required_set()).filter_map(place).min();
            if let (Some(required), Some(others)) = (required, others) {
                assert!(required < others, "{}: {help}", verb.get_name());
            }
        }
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

//! Which verb is meant by a command line: the first word, or `estimate` where that is
//! an input.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::CommandFactory as _;
use clap::error::ErrorKind;

use super::args::Arguments;

/// Verbs: anything else in the first place is the input of `estimate`.
const VERBS: [&str; 18] = [
    "estimate",
    "inspect",
    "boundary",
    "merge",
    "batch",
    "simulate",
    "generate",
    "augment",
    "calibrate",
    "combine",
    "kit",
    "completions",
    "man",
    "export",
    "convert",
    "config",
    "version",
    "help",
];

/// Flags that may stand before a verb.
const BEFORE: [&str; 4] = ["-q", "--quiet", "-v", "--verbose"];

/// Verbs, `help` among them.
pub(super) fn all() -> impl Iterator<Item = &'static str> {
    VERBS.into_iter()
}

/// Puts the verb `estimate` in front of an input file given without a verb.
///
/// # Errors
/// A first word that is no file and nearly a verb.
pub(crate) fn with_default_verb(
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<Vec<OsString>, clap::Error> {
    let mut arguments: Vec<_> = arguments.into_iter().collect();
    let info = ["-h", "--help", "-V", "--version"];
    let at = place(&arguments);
    let Some(first) = arguments.get(at) else {
        return Ok(arguments);
    };
    if VERBS.iter().chain(&info).any(|known| first.as_os_str() == *known) {
        return Ok(arguments);
    }
    if let Some(verb) = meant_verb(first) {
        let word = first.to_string_lossy();
        let fault = format!("no file and no command `{word}`; did you mean `{verb}`?");
        return Err(Arguments::command().error(ErrorKind::InvalidSubcommand, fault));
    }
    arguments.insert(at, "estimate".into());
    Ok(arguments)
}

/// The place of the first word behind the program's name that is no flag which may stand before a
/// verb.
pub(crate) fn place(arguments: &[OsString]) -> usize {
    let mut at = 1;
    while let Some(word) = arguments.get(at) {
        at += match word.to_str() {
            Some(word) if BEFORE.contains(&word) || word.starts_with("--config=") => 1,
            Some("--config") => 2,
            _ => break,
        };
    }
    at
}

/// The verb that a word nearly is, if it is no file: nor named like one.
fn meant_verb(word: &OsStr) -> Option<&'static str> {
    let path = Path::new(word);
    let text = word.to_str()?;
    let may_be_a_file = text.starts_with('-')
        || path.components().count() > 1
        || path.extension().is_some()
        || path.exists();
    if may_be_a_file {
        return None;
    }
    nearest(text, VERBS.into_iter())
}

/// The known word that a word nearly is: as near as clap asks of a subcommand. Of several the one
/// that begins alike.
pub(crate) fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const NEAR: f64 = 0.7;
    let word = word.to_lowercase();
    let begins_alike = |known: &str| strsim::jaro_winkler(&word, known);
    let near = known.filter(|known| strsim::jaro(&word, known) > NEAR);
    near.max_by(|a, b| begins_alike(a).total_cmp(&begins_alike(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_without_a_verb_is_estimated() {
        let given = |words: &[&str]| {
            let words = words.iter().map(OsString::from);
            with_default_verb(words)
                .unwrap()
                .into_iter()
                .map(|w| w.into_string().unwrap())
                .collect::<Vec<_>>()
        };
        assert_eq!(given(&["s", "a.ply", "--density", "180"])[1], "estimate");
        assert_eq!(given(&["s", "simulate"])[1], "simulate");
        assert_eq!(given(&["s", "--help"]), ["s", "--help"]);
        assert_eq!(given(&["s"]), ["s"]);
        assert_eq!(given(&["s", "-q", "a.ply", "--density", "1"])[..3], ["s", "-q", "estimate"]);
        assert_eq!(given(&["s", "--verbose", "inspect", "a.ply"])[2], "inspect");
        assert_eq!(given(&["s", "--config", "c.toml", "-q", "inspect", "a.ply"])[4], "inspect");
        assert_eq!(given(&["s", "--config=c.toml", "a.ply"])[2], "estimate");
        // Words that may name a scan, and one that is near no verb.
        for word in
            ["estimates.ply", "batch.ply", "./estimat", "scans/simulat", "--densty", "drape7"]
        {
            assert_eq!(given(&["s", word])[1], "estimate", "{word}");
        }
        // A folder that is there is an input, with any name.
        assert_eq!(given(&["s", "src"])[1], "estimate");
    }

    #[test]
    fn a_word_that_is_nearly_a_verb_is_not_taken_for_a_file() {
        for (word, verb) in [
            ("estimte", "estimate"),
            ("Estimate", "estimate"),
            ("esimate", "estimate"),
            ("simulat", "simulate"),
            ("genrate", "generate"),
            ("bacth", "batch"),
            ("inspekt", "inspect"),
            ("boundry", "boundary"),
            ("augement", "augment"),
        ] {
            let error = with_default_verb(["s", word].map(OsString::from)).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(&format!("did you mean `{verb}`")), "{error}");
        }
    }

    #[test]
    fn every_verb_is_known_to_the_default_verb() {
        for verb in Arguments::command().get_subcommands() {
            assert!(VERBS.contains(&verb.get_name()), "{}", verb.get_name());
        }
        Arguments::command().debug_assert();
    }
}

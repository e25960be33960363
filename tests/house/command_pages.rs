//! docs/commands: a page for each verb, with the help that the program prints. Title, text and
//! example of a page are written by hand. Options that `estimate` has in the same words stand on
//! its page alone; the others name them. `UPDATE=1 cargo test --release --test house command_pages`
//! writes the help.

use crate::program;
use crate::promises::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

const MARK: &str = "<!-- help -->\n```text\n";
const END: &str = "```\n";

/// The page of the laboratory's program, which `lab/tests/lab/command_line.rs` compares.
const LAB: &str = "lab.md";

fn folder() -> PathBuf {
    root().join("docs/commands")
}

fn help(path: &[&str]) -> String {
    let mut program = program::program();
    let run = program.args(path).arg("--help").env("COLUMNS", "100").output().unwrap();
    assert!(run.status.success(), "{path:?}");
    let text = String::from_utf8(run.stdout).unwrap();
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// The names under `Commands:` of a help text.
fn verbs(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let entries = lines.take_while(|line| !line.is_empty());
    let entries = entries.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = entries.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// The verb whose page has the options that many verbs share.
const SHARED: &str = "estimate";

/// The help of a verb without the options of [`SHARED`], and of those below it.
fn whole_help(verb: &str) -> String {
    let all = help(&[verb]);
    if verb == SHARED {
        return all;
    }
    let mut text = own(&all);
    for below in verbs(&all) {
        let part = own(&help(&[verb, &below]));
        text += &format!("\n\n$ scan2params {verb} {below} --help\n\n{part}");
    }
    text
}

/// The entries of a help text that begin with a flag, as lines.
fn entries(help: &str) -> Vec<Vec<&str>> {
    let mut entries: Vec<Vec<&str>> = Vec::new();
    for line in help.lines() {
        let begins = line.starts_with("  ") && line.trim_start().starts_with('-');
        match entries.last_mut() {
            Some(entry) if !begins && line.starts_with("          ") => entry.push(line),
            _ => entries.push(vec![line]),
        }
    }
    entries
}

/// A help text in which the options that [`SHARED`] has in the same words are only named.
fn own(help_text: &str) -> String {
    let words = |entry: &Vec<&str>| entry.join(" ").split_whitespace().map(str::to_owned).collect();
    let shared_help = help(&[SHARED]);
    let shared: BTreeSet<Vec<String>> = entries(&shared_help).iter().map(words).collect();
    let is_shared = |entry: &Vec<&str>| {
        entry[0].trim_start().starts_with('-') && shared.contains(&words(entry))
    };
    let (named, kept): (Vec<_>, Vec<_>) = entries(help_text).into_iter().partition(is_shared);
    let flag = |entry: &Vec<&str>| {
        let long = entry[0].split_whitespace().find(|word| word.starts_with("--"));
        long.map(|long| long.trim_end_matches(',').to_owned())
    };
    let mut lines: Vec<String> = kept.concat().iter().map(|line| (*line).to_owned()).collect();
    let flags: Vec<String> = named.iter().filter_map(flag).collect();
    if !flags.is_empty() {
        let mut line = format!("  As in `{SHARED}`:");
        for flag in flags {
            if line.len() + flag.len() > 98 {
                lines.push(std::mem::replace(&mut line, " ".repeat(4)));
            }
            line += &format!(" {flag}");
        }
        lines.push(line);
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

#[test]
fn options_in_the_same_words_are_named_and_others_are_shown() {
    let page = own(&help(&["inspect"]));
    let (own, named) = page.split_once("As in `estimate`:").unwrap();
    assert!(own.contains("--out <FILE.png>") && !own.contains("--crop"), "{own}");
    assert!(named.contains("--crop") && named.contains("--config") && !named.contains("--out"));
}

#[test]
fn every_verb_has_a_page_with_its_help_and_no_page_is_of_nothing() {
    let verbs = verbs(&help(&[]));
    assert!(verbs.len() > 14, "{verbs:?}");
    let pages = fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name());
    let pages: BTreeSet<String> = pages.map(|name| name.into_string().unwrap()).collect();
    let expected = verbs.iter().map(|verb| format!("{verb}.md")).chain([LAB.to_owned()]);
    assert_eq!(pages, expected.collect());
    for verb in &verbs {
        let path = folder().join(format!("{verb}.md"));
        let page = fs::read_to_string(&path).unwrap();
        let parts = page.split_once(MARK).and_then(|(head, rest)| {
            let (held, tail) = rest.split_at(rest.rfind(END)?);
            Some((head, held, tail))
        });
        let (head, held, tail) = parts.unwrap_or_else(|| panic!("{verb}.md has no {MARK}"));
        assert!(head.starts_with(&format!("# scan2params {verb}\n\n")), "{verb}.md: its title");
        let prose =
            head.lines().filter(|line| !line.starts_with(['#', '<', '`'])).collect::<String>();
        assert!(prose.len() > 100, "{verb}.md says too little of when to use it");
        assert!(head.contains("<!-- run -->\n```sh\n"), "{verb}.md has no example that is run");
        let now = whole_help(verb);
        if held != now && std::env::var_os("UPDATE").is_some() {
            fs::write(&path, format!("{head}{MARK}{now}{tail}")).unwrap();
            continue;
        }
        assert!(held == now, "{verb}.md is not what --help says: UPDATE=1 writes it anew");
    }
}

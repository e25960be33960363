//! docs/commands: a page for each verb, with the help that the program prints. Title, text and
//! example of a page are written by hand.
//! `UPDATE=1 cargo test --release --test house command_pages` writes the help.

use crate::program;
use crate::promises::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

const MARK: &str = "<!-- help -->\n```text\n";
const END: &str = "```\n";

/// The developers' verb: it has a page, and the program's own help does not list it.
const HIDDEN: &str = "evaluate";

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

/// The help of a verb, and of those below it; the laboratory's parts print theirs themselves.
fn whole_help(verb: &str) -> String {
    let mut text = help(&[verb]);
    if verb == HIDDEN {
        return text;
    }
    for below in verbs(&text.clone()) {
        text += &format!("\n\n$ scan2params {verb} {below} --help\n\n{}", help(&[verb, &below]));
    }
    text
}

#[test]
fn every_verb_has_a_page_with_its_help_and_no_page_is_of_nothing() {
    let mut verbs = verbs(&help(&[]));
    assert!(verbs.len() > 14 && !verbs.contains(&HIDDEN.to_owned()), "{verbs:?}");
    verbs.push(HIDDEN.to_owned());
    let pages = fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name());
    let pages: BTreeSet<String> = pages.map(|name| name.into_string().unwrap()).collect();
    assert_eq!(pages, verbs.iter().map(|verb| format!("{verb}.md")).collect());
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

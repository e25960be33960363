//! The table of promises itself: the pages of docs/validation show it, every row names a test
//! that asks for it or a command, limits stand near what was observed, and no number of
//! README.md or docs/validation is without its command.

use crate::promises;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::promises::{MARGIN, Promise, promise, root, shown, table};

const BEGIN: &str = "<!-- promises -->";
const END: &str = "<!-- /promises -->";
/// The tests of the laboratory.
const LAB: &str = "lab/tests/lab/";
/// Set to write the tables into docs/validation instead of comparing them.
const WRITE: &str = "SCAN2PARAMS_WRITE_PROMISES";
/// The pages of docs/validation that show promises: those whose names begin so.
const AREAS: &[(&str, &[&str])] = &[
    ("refine", &["main", "refine"]),
    ("scan", &["mesh", "rim", "rims", "scan", "sigma", "size"]),
    ("network", &["estimate", "model", "repeats"]),
    ("simulator", &["elastica", "follow", "friction", "sim", "start", "strips"]),
];

fn text(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The pages of docs/validation, by path from the root.
fn pages() -> Vec<String> {
    let folder = std::fs::read_dir(root().join("docs/validation")).unwrap();
    let names = folder.map(|page| page.unwrap().file_name().into_string().unwrap());
    let mut pages: Vec<String> = names.map(|name| format!("docs/validation/{name}")).collect();
    pages.retain(|page| page.ends_with(".md"));
    pages.sort();
    pages
}

/// The page that shows a promise, without its ending.
fn area(p: &Promise) -> Option<&'static str> {
    let kind = p.id.split('.').next()?;
    AREAS.iter().find(|(_, kinds)| kinds.contains(&kind)).map(|(page, _)| *page)
}

/// A page's table as markdown.
fn rendered(page: &str) -> String {
    let mut out = String::from(
        "| what | limit | observed | a planted fault scores | measured with |\n|---|---|---|---|---|\n",
    );
    for p in table().promise.iter().filter(|p| area(p) == Some(page)) {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        let limit = p.limit();
        let Promise { claim, planted, .. } = p;
        let observed = shown(p.observed);
        let command = command_of(p);
        out += &format!("| {claim} | {limit}{unit} | {observed}{unit} | {planted} | {command} |\n");
    }
    out
}

/// What to run to measure a promise: a command, or what stands after `cargo test --release`.
fn command_of(p: &Promise) -> String {
    match (&p.command, &p.test) {
        (Some(command), _) => format!("`{command}`"),
        (None, Some(test)) => {
            let (file, name) = test.split_once("::").unwrap_or((test, ""));
            let command = match file.split_once('/') {
                Some(_) if file.starts_with(LAB) => {
                    let module = file.trim_start_matches(LAB).trim_end_matches(".rs");
                    format!("-p scan2params-lab --test lab {module}::{name}")
                }
                _ if file.ends_with(".rs") => format!("--lib {name}"),
                Some((program, module)) => format!("--test {program} {module}::{name}"),
                None => format!("--test {file} {name}"),
            };
            format!("`{command}`")
        }
        (None, None) => String::new(),
    }
}

#[test]
fn the_pages_show_the_table_as_it_is() {
    let write = std::env::var_os(WRITE).is_some();
    for (page, _) in AREAS {
        let path = format!("docs/validation/{page}.md");
        let before = text(&path);
        let (head, rest) = before.split_once(BEGIN).unwrap_or_else(|| panic!("{path}: no {BEGIN}"));
        let (_, tail) = rest.split_once(END).unwrap_or_else(|| panic!("{path}: no {END}"));
        let now = format!("{head}{BEGIN}\n\n{}\n{END}{tail}", rendered(page));
        if write {
            std::fs::write(root().join(&path), &now).unwrap();
        }
        assert!(
            write || now == before,
            "{path} does not show docs/promises.toml as it is: run \
             `{WRITE}=1 cargo test --release --test house promise_table`"
        );
    }
    let homeless = table().promise.iter().find(|p| area(p).is_none());
    assert!(homeless.is_none(), "no page shows {}", homeless.unwrap().id);
}

#[test]
fn every_promise_is_sound() {
    let mut ids = BTreeSet::new();
    let mut faults = Vec::new();
    for p in &table().promise {
        let mut fault = |what: &str| faults.push(format!("{}: {what}", p.id));
        if !ids.insert(&p.id) {
            fault("stands twice");
        }
        if p.at_most.is_none() && p.at_least.is_none() {
            fault("has no limit");
        }
        if p.test.is_none() && p.command.is_none() {
            fault("names neither a test nor a command");
        }
        if p.planted.is_empty() || p.claim.contains('|') || p.planted.contains('|') {
            fault("says nothing of a planted fault, or has a bar in it");
        }
        if p.margin.is_none() && !is_near(p) {
            fault("its limit is far from what was observed: bring it near, or say why (`margin`)");
        }
        if !p.is_kept_by(p.observed) && p.margin.is_none() {
            fault("what was observed breaks it");
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a limit stands near what was observed: an upper one at most [`MARGIN`] times it, a
/// lower one at least one part in that; limits on a share that is best at 1 are held by what
/// is missing to 1.
fn is_near(p: &Promise) -> bool {
    let share = p.unit.is_empty() && (0.5..=1.0).contains(&p.observed);
    let most = p.at_most.is_none_or(|most| most <= MARGIN * p.observed);
    let least = p.at_least.is_none_or(|least| {
        let missing = |value: f64| (1.0 - value).max(0.02);
        if share {
            missing(least) <= 2.0 * missing(p.observed)
        } else {
            least * MARGIN >= p.observed
        }
    });
    most && least
}

/// Sources below a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// All sources with tests, by path from the root.
fn all_sources() -> BTreeMap<String, String> {
    let mut found = Vec::new();
    for folder in ["tests", "src", "benches", "lab/tests", "lab/src"] {
        sources(&root().join(folder), &mut found);
    }
    let named = found.into_iter().map(|path| {
        let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        (name, std::fs::read_to_string(&path).unwrap())
    });
    named.collect()
}

/// The body of the test `name`, to the next function at its own depth; `None` where there
/// is no test of this name.
fn test_body<'a>(source: &'a str, name: &str) -> Option<&'a str> {
    let start = source.find(&format!("fn {name}()"))?;
    let before = source[..start].trim_end();
    if !before.ends_with("#[test]") {
        return None;
    }
    let line = source[..start].rfind('\n').map_or(0, |at| at + 1);
    let indent: String = source[line..start].chars().take_while(|c| *c == ' ').collect();
    let end = source[start..].find(&format!("\n{indent}}}\n"))?;
    Some(&source[start..start + end])
}

/// The file of a test: below tests/ without more words, or as it is.
fn path_of(file: &str) -> String {
    if file.ends_with(".rs") { file.to_owned() } else { format!("tests/{file}.rs") }
}

#[test]
fn every_promise_names_a_test_that_asks_for_it() {
    let sources = all_sources();
    let mut faults = Vec::new();
    for p in &table().promise {
        let Some(test) = &p.test else { continue };
        let (file, name) = test.split_once("::").expect("a test is `file::name`");
        let path = path_of(file);
        let body = sources.get(&path).and_then(|source| test_body(source, name));
        // A test may leave the asking to a table or a helper of its own file; unit tests of
        // the library cannot ask and state the limit themselves.
        let asks = p.in_test.clone().unwrap_or_else(|| format!("\"{}\"", p.id));
        if body.is_none() {
            faults.push(format!("{}: there is no test {test}", p.id));
        } else if !sources[&path].contains(&asks) {
            faults.push(format!("{}: {path} does not have {asks}", p.id));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_promise_that_a_test_asks_for_says_so() {
    let known: BTreeMap<&str, &Promise> =
        table().promise.iter().map(|p| (p.id.as_str(), p)).collect();
    let mut faults = Vec::new();
    for (path, source) in all_sources() {
        let own = path == "tests/house/promise_table.rs";
        for (at, _) in source.match_indices("hold(\"").filter(|_| !own) {
            let id = source[at + 6..].split('"').next().unwrap_or_default();
            let Some(p) = known.get(id) else {
                faults.push(format!("{path}: no promise `{id}`"));
                continue;
            };
            let named = p.test.as_deref().is_some_and(|test| {
                test.split_once("::").is_some_and(|(file, _)| path_of(file) == path)
            });
            if (path.starts_with("tests/") || path.starts_with(LAB))
                && !path.contains("promise")
                && !named
            {
                faults.push(format!("{path} holds `{id}`, which names {:?}", p.test));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Markdown without what is no prose: fenced and indented code, code spans, link targets,
/// comments and headings; line breaks stay.
fn prose(markdown: &str) -> String {
    let mut out = String::new();
    let (mut fenced, mut comment) = (false, false);
    for line in markdown.lines() {
        let trimmed = line.trim_start();
        if trimmed.starts_with("```") {
            fenced = !fenced;
        } else if !fenced && !line.starts_with("    ") && !line.starts_with('#') {
            comment |= trimmed.starts_with("<!--");
            if !comment {
                out += &without_code(line);
            }
            comment &= !line.contains("-->");
        }
        out.push('\n');
    }
    out
}

/// A line without code spans and link targets.
fn without_code(line: &str) -> String {
    let mut out = String::new();
    for (k, part) in line.split('`').enumerate() {
        if k % 2 == 0 {
            out += part;
        } else {
            out.push('`');
        }
    }
    let mut kept = String::new();
    let mut rest = out.as_str();
    while let Some((before, after)) = rest.split_once("](") {
        kept += before;
        kept.push(']');
        rest = after.split_once(')').map_or("", |(_, after)| after);
    }
    kept + rest
}

/// Whether a word has a number in it.
fn has_number(word: &str) -> bool {
    word.chars().any(|c| c.is_ascii_digit())
}

/// The numbers of a text, with the count of their decimals.
fn numbers(text: &str) -> Vec<(f64, usize)> {
    let joined = text.replace(',', "");
    let mut found = Vec::new();
    for word in joined.split(|c: char| !(c.is_ascii_digit() || c == '.')) {
        let word = word.trim_matches('.');
        if let Ok(value) = word.parse::<f64>() {
            found.push((value, word.split_once('.').map_or(0, |(_, decimals)| decimals.len())));
        }
    }
    found
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn every_number_of_the_readme_is_in_the_table() {
    let mut left = one_line(&prose(&text("README.md")));
    let mut faults = Vec::new();
    for said in &table().readme {
        let words = one_line(&said.words);
        if left.contains(&words) {
            left = left.replace(&words, " ");
        } else {
            faults.push(format!("README.md does not say `{words}` (any more)"));
        }
        if said.given.is_none() == said.promises.is_empty() {
            faults.push(format!("`{words}`: name its promises, or what else it is (`given`)"));
        }
        let of: Vec<&Promise> = said.promises.iter().map(|id| promise(id)).collect();
        for (value, decimals) in numbers(&words) {
            let scale = 10_f64.powi(i32::try_from(decimals).unwrap());
            // Shown in a part in a hundred where the words say so.
            let same = |a: f64| {
                [1.0, 100.0].iter().any(|k| (a * k * scale).round() == (value * scale).round())
            };
            let from = |p: &&Promise| {
                let limits = [Some(p.observed), p.at_most, p.at_least];
                limits.into_iter().flatten().any(same)
                    || numbers(&p.claim).iter().chain(&numbers(&p.unit)).any(|n| same(n.0))
            };
            if !of.is_empty() && !of.iter().any(from) {
                faults.push(format!("`{words}`: {value} is no number of {:?}", said.promises));
            }
        }
    }
    for word in left.split(' ').filter(|word| has_number(word)) {
        let at = left.find(word).unwrap_or(0);
        let [from, to] = [at.saturating_sub(40), at + 40];
        let around: String = left.chars().skip(from).take(to - from).collect();
        faults.push(format!("`{word}` in `... {around} ...` is no number of docs/promises.toml"));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a piece of code is a command that measures.
fn is_command(code: &str) -> bool {
    ["cargo ", "scan2params ", "scan2params-lab", "scripts/", "python ", "fuzz/"]
        .iter()
        .any(|c| code.contains(c))
}

#[test]
fn every_section_of_validation_with_a_number_names_its_command() {
    let mut sections: Vec<(String, String)> = Vec::new();
    for page in pages() {
        sections.push((page.clone(), String::new()));
        for line in text(&page).lines() {
            if line.starts_with('#') {
                sections.push((format!("{page}: {line}"), String::new()));
            } else if let Some(last) = sections.last_mut() {
                last.1 += line;
                last.1.push('\n');
            }
        }
    }
    assert!(sections.len() > 10, "only {} sections", sections.len());
    for (heading, body) in sections {
        let numbers = prose(&body).split_whitespace().any(has_number);
        let indented = body.lines().filter(|line| line.starts_with("    "));
        let spans = body.split('`').skip(1).step_by(2);
        let commands = indented.chain(spans).filter(|code| is_command(code)).count();
        // A table of promises says what stands before its commands.
        let commands = commands + usize::from(body.contains(BEGIN));
        assert!(!numbers || commands > 0, "{heading}: has numbers and no command");
    }
}

#[test]
fn every_test_that_the_documents_name_is_there() {
    let sources = all_sources();
    let mut named = 0;
    let others = [
        "README.md",
        "docs/design/scan.md",
        "docs/design/simulator.md",
        "docs/design/estimation.md",
        "ARCHITECTURE.md",
        "fixtures/README.md",
    ];
    for file in pages().into_iter().chain(others.map(str::to_owned)) {
        let text = text(&file);
        for (k, code) in text.split('`').enumerate() {
            let is_name = code.matches('_').count() >= 2
                && code.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
            if k % 2 == 1 && is_name {
                named += 1;
                // A function, a field, or the code of a ground.
                let kinds =
                    [format!("fn {code}("), format!("pub {code}: "), format!("= \"{code}\",")];
                let is_there = |source: &String| kinds.iter().any(|kind| source.contains(kind));
                let found = sources.values().any(is_there);
                assert!(found, "{file} names `{code}`, which is not there");
            }
            let path = code.split_whitespace().next().unwrap_or_default();
            if k % 2 == 1 && path.starts_with("tests/") && !path.contains('*') {
                named += 1;
                assert!(root().join(path).exists(), "{file} names {path}, which is not there");
            }
        }
    }
    assert!(named >= 5, "only {named} names found");
}

/// A test that has nothing to work on says "skipped" before it ends.
#[test]
fn no_test_ends_early_without_a_word() {
    let mut looked = 0;
    for (path, source) in all_sources() {
        let lines: Vec<&str> = source.lines().collect();
        let starts = (0..lines.len()).filter(|&k| lines[k].trim() == "#[test]");
        for start in starts {
            let indent = lines[start].len() - lines[start].trim_start().len();
            let end = format!("{}}}", " ".repeat(indent));
            let body = lines[start..].iter().position(|line| *line == end).unwrap_or(0);
            looked += 1;
            for k in start..start + body {
                let words = lines[k].trim();
                let ends = words == "return;" || words.contains(concat!("else { ", "return }"));
                let said = lines[k.saturating_sub(4)..k].iter().any(|l| l.contains("skipped: "));
                assert!(!ends || said, "{path}:{}: a test ends without a word", k + 1);
            }
        }
    }
    assert!(looked > 200, "only {looked} tests found");
}

#[test]
fn missing_ids_and_broken_promises_fail() {
    let caught = |run: fn()| std::panic::catch_unwind(run).is_err();
    assert!(caught(|| promises::hold("no.such.promise", 0.0)));
    let first = &table().promise[0];
    let beyond = first.at_most.map_or_else(|| first.at_least.unwrap() - 1.0, |most| most + 1.0);
    assert!(!first.is_kept_by(beyond) && !first.is_kept_by(f64::NAN));
    assert!(first.is_kept_by(first.observed));
}

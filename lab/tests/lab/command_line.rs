//! The command line of the laboratory: its verbs, its page in docs/commands, its outputs.
//! `UPDATE=1 cargo test --release -p scan2params-lab --test lab command_line` writes the help into
//! the page.

use std::process::{Command, Output};

use crate::promises::root;

const MARK: &str = "<!-- help -->\n```text\n";
const END: &str = "```\n";

fn run(line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_scan2params-lab"));
    command.current_dir(root()).env("COLUMNS", "100").args(line.split_whitespace());
    command.output().unwrap()
}

fn told(run: &Output) -> String {
    String::from_utf8_lossy(&run.stdout).into_owned()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

#[test]
fn the_page_has_the_help_that_the_program_prints() {
    let help = told(&run("--help"));
    let now: String = help.lines().map(|line| format!("{}\n", line.trim_end())).collect();
    let path = root().join("docs/commands/lab.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(MARK).unwrap_or_else(|| panic!("lab.md has no {MARK}"));
    let (held, tail) = rest.split_at(rest.rfind(END).unwrap());
    assert!(head.starts_with("# scan2params-lab\n\n"), "its title");
    if held != now && std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, format!("{head}{MARK}{now}{tail}")).unwrap();
    }
    let is_written = std::env::var_os("UPDATE").is_some();
    assert!(is_written || held == now, "lab.md is not what --help says: UPDATE=1 writes it anew");
}

#[test]
fn every_verb_has_its_help_and_takes_threads() {
    let help = told(&run("--help"));
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let entries = lines.take_while(|line| !line.is_empty());
    let entries = entries.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let verbs: Vec<&str> = entries.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(verbs.len() > 15 && verbs.contains(&"physics"), "{verbs:?}");
    for verb in verbs.into_iter().filter(|verb| *verb != "help") {
        let run = run(&format!("{verb} --help"));
        assert_eq!(run.status.code(), Some(0), "{verb}: {}", said(&run));
        assert!(told(&run).contains("--threads"), "{verb}");
    }
    let version = told(&run("--version"));
    assert!(version.starts_with("scan2params-lab ") && version.contains("simulator numerics"));
}

#[test]
fn the_times_of_a_scan_are_printed_stage_by_stage() {
    let run = run("stages fixtures/scans/stiff_structured-light.ply --repeat 1 --threads 1");
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let told = told(&run);
    assert!(told.starts_with("stage,cpu_s,wall_s\nread,"), "{told}");
    assert!(told.lines().count() > 10 && told.lines().last().unwrap().starts_with("total,"));
}

#[test]
fn what_cannot_be_is_usage_and_prints_no_table() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let to_a_file = format!("physics friction --out {}", file.display());
    for (line, part) in [
        (to_a_file.as_str(), "is a file; give a folder"),
        ("physic friction", "physics"),
        ("physics friction --threads 5000", "give 0 to 1024"),
        ("views --drapes nowhere --sensors nothing", "no sensor profile `nothing`"),
        ("-q -v stages a.ply", "cannot be used with"),
    ] {
        let run = run(line);
        assert_eq!(run.status.code(), Some(2), "{line}: {}", said(&run));
        assert!(said(&run).contains(part), "{line}: {}", said(&run));
        assert!(run.stdout.is_empty(), "{line}");
    }
    let missing = run("stages missing.ply");
    assert_eq!(missing.status.code(), Some(1), "{}", said(&missing));
    assert!(said(&missing).contains("missing.ply"), "{}", said(&missing));
}

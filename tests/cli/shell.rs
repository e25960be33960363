//! What a shell user expects: version, completions, manual, quiet and verbose, threads, colours,
//! standard input.

use crate::program;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCAN: &str = "fixtures/scans/stiff_structured-light.ply";
/// Estimated in a fifth of the time of a scan.
const RIM: &str = "fixtures/drapes/stiff.boundary.csv --density 260 --quick";
const COMPUTING: [&str; 9] = [
    "estimate",
    "inspect",
    "boundary",
    "merge",
    "batch",
    "calibrate",
    "augment",
    "simulate",
    "generate",
];
const OTHERS: [&str; 7] = ["combine", "kit", "export", "convert", "config", "completions", "man"];

fn program(line: &str) -> Command {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(line.split_whitespace());
    command
}

fn run(line: &str) -> Output {
    program(line).output().unwrap()
}

fn told(run: &Output) -> String {
    String::from_utf8_lossy(&run.stdout).into_owned()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// The program with a file on its standard input.
fn piped(line: &str, file: &str) -> Output {
    let mut command = program(line);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let bytes = fs::read(file).unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // A program that does not read ends the pipe.
    let writer = std::thread::spawn(move || drop(stdin.write_all(&bytes)));
    let run = child.wait_with_output().unwrap();
    writer.join().unwrap();
    run
}

#[test]
fn the_version_names_model_numerics_and_commit() {
    let short = told(&run("-V"));
    assert_eq!(short.trim(), format!("scan2params {}", env!("CARGO_PKG_VERSION")));
    let long = told(&run("--version"));
    let lines: Vec<&str> = long.lines().collect();
    assert_eq!(lines[0], short.trim());
    let [id, sha256] = scan2params::estimate::shipped_model();
    assert!(
        !id.is_empty() && lines[1] == format!("model {id} (SHA-256 {})", &sha256[..12]),
        "{long}"
    );
    let model = scan2params::Estimator::shipped().unwrap();
    assert_eq!([&model.model().id, &model.model().onnx_sha256], [&id, &sha256]);
    assert_eq!(lines[2], format!("simulator numerics {}", scan2params::sim::NUMERICS_VERSION));
    // From a checkout the commit; without git nothing is said.
    let head =
        Command::new("git").args(["-C", env!("CARGO_MANIFEST_DIR"), "rev-parse", "HEAD"]).output();
    let is_checkout = head.as_ref().is_ok_and(|head| head.status.success());
    match lines.get(3) {
        Some(line) => {
            let commit = line.strip_prefix("commit ").unwrap();
            let hex = commit.split('-').next().unwrap();
            assert!(
                is_checkout && hex.len() == 12 && hex.chars().all(|c| c.is_ascii_hexdigit()),
                "{long}"
            );
        }
        None => assert!(!is_checkout, "{long}"),
    }
}

#[test]
fn shells_complete_every_verb() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let run = run(&format!("completions {shell}"));
        assert_eq!(run.status.code(), Some(0), "{}", said(&run));
        let script = told(&run);
        for verb in COMPUTING.into_iter().chain(OTHERS) {
            assert!(script.contains(verb), "{shell}: {verb}");
        }
        assert!(script.contains("--density-csv") || script.contains("density-csv"), "{shell}");
        if shell == "bash" {
            let mut bash = match Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn() {
                Ok(bash) => bash,
                Err(_) => continue,
            };
            bash.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
            assert!(bash.wait().unwrap().success(), "bash does not take it");
        }
    }
    assert_eq!(run("completions tcsh").status.code(), Some(2));
}

/// What bash offers for the last word of a command line; `None` without bash.
fn offered(script: &Path, line: &str) -> Option<Vec<String>> {
    // a line that ends with a blank has an empty last word
    let words: Vec<&str> = line.split(' ').collect();
    let call = "source \"$1\"; shift; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); \
                _scan2params scan2params \"${COMP_WORDS[$COMP_CWORD]}\" \"${COMP_WORDS[$COMP_CWORD - 1]}\"; \
                printf '%s\\n' \"${COMPREPLY[@]}\"";
    let mut bash = Command::new("bash");
    let run = bash.args(["-c", call, "bash"]).arg(script).args(words).output().ok()?;
    Some(told(&run).lines().map(str::to_owned).filter(|word| !word.is_empty()).collect())
}

#[test]
fn values_are_completed_and_flags_where_the_verb_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("completion.bash");
    fs::write(&script, run("completions bash").stdout).unwrap();
    for (line, words) in [
        ("scan2params export p.json --to bl", vec!["blender"]),
        ("scan2params generate --prior ", vec!["knit-2020", "measured", "union"]),
        ("scan2params augment drape.obj --profile str", vec!["structured-light"]),
        ("scan2params scan.ply --dens", vec!["--density"]),
        ("scan2params scan.ply --format pc", vec!["pcd"]),
        ("scan2params batch scans --dens", vec!["--density", "--density-csv"]),
        ("scan2params inspect scan.ply --dens", vec![]),
    ] {
        let Some(offered) = offered(&script, line) else {
            eprintln!("skipped: no bash");
            return;
        };
        assert_eq!(offered, words, "{line}");
    }
    // The other shells' scripts: values, and a case for a first word that is no verb.
    let zsh = told(&run("completions zsh"));
    let fish = told(&run("completions fish"));
    assert!(zsh.contains("local verb=estimate") && zsh.contains("case $verb in"), "{zsh}");
    assert!(fish.contains("not __fish_seen_subcommand_from estimate inspect"), "{fish}");
    for script in [&zsh, &fish] {
        for name in ["blender", "knit-2020", "structured-light"] {
            assert!(script.contains(name), "{name}");
        }
    }
}

#[test]
fn the_version_is_a_verb_too() {
    let [verb, flag] = ["version", "--version"].map(run);
    assert_eq!((verb.status.code(), told(&verb)), (Some(0), told(&flag)));
}

#[test]
fn the_manual_has_a_page_for_each_verb() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man1");
    let first = told(&run("man"));
    assert!(
        first.contains(".TH scan2params 1") && first.contains("scan2params\\-combine(1)"),
        "{first}"
    );
    let run = run(&format!("man --out {}", out.display()));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    for verb in COMPUTING.into_iter().chain(OTHERS) {
        let page = fs::read_to_string(out.join(format!("scan2params-{verb}.1"))).unwrap();
        assert!(page.contains(&format!(".TH scan2params-{verb} 1")), "{page}");
    }
    let page = fs::read_to_string(out.join("scan2params-batch.1")).unwrap();
    assert!(page.contains("density\\-csv"), "{page}");
}

#[test]
fn quiet_leaves_errors_and_verbose_tells_the_steps() {
    let folder = tempfile::tempdir().unwrap();
    let rim = folder.path().join("rim.csv").display().to_string();
    let usual = run(&format!("boundary {SCAN} -o {rim}"));
    assert!(said(&usual).contains("wrote"), "{}", said(&usual));
    for line in [format!("estimate {RIM} --quiet"), format!("-q boundary {SCAN} -o {rim}")] {
        let quiet = run(&line);
        assert_eq!((quiet.status.code(), said(&quiet)), (Some(0), String::new()), "{line}");
    }
    // before an input without a verb too; stdout is not touched
    let quiet = run(&format!("-q {SCAN} --density 260 --quick"));
    assert_eq!((quiet.status.code(), said(&quiet)), (Some(0), String::new()));
    assert!(told(&quiet).starts_with("verdict"), "{}", told(&quiet));
    let fails = run("--quiet inspect missing.ply");
    assert_eq!(fails.status.code(), Some(1));
    assert!(said(&fails).contains("missing.ply: no such file"), "{}", said(&fails));
    let refused = folder.path().join("few.xyz");
    fs::write(&refused, "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    let refused = run(&format!("-q inspect {}", refused.display()));
    assert_eq!(
        (refused.status.code(), said(&refused).lines().count()),
        (Some(4), 1),
        "{}",
        said(&refused)
    );

    let verbose = run(&format!("-v {SCAN} --density 260 --quick"));
    assert_eq!(told(&verbose), told(&quiet));
    for step in ["simulator numerics", " s  looking for the rim", " s  estimating the stiffnesses"]
    {
        assert!(said(&verbose).contains(step), "{step}: {}", said(&verbose));
    }
    assert_eq!(run(&format!("-q -v inspect {SCAN}")).status.code(), Some(2));
}

#[test]
fn every_verb_that_computes_takes_threads() {
    for verb in COMPUTING {
        assert!(told(&run(&format!("{verb} --help"))).contains("--threads"), "{verb}");
    }
    for verb in OTHERS {
        assert!(!told(&run(&format!("{verb} --help"))).contains("--threads"), "{verb}");
    }
    let [one, three] = ["1", "3"].map(|n| run(&format!("-v inspect {SCAN} --json --threads {n}")));
    assert_eq!(told(&one), told(&three));
    assert!(
        said(&one).contains("on 1 threads") && said(&three).contains("on 3 threads"),
        "{}",
        said(&one)
    );
    assert_eq!(run(&format!("inspect {SCAN} --threads 5000")).status.code(), Some(2));
}

/// Whether a line in a terminal, that of `script` (util-linux), sets colours or weights (`ESC [ ...
/// m`).
fn is_styled(line: &str, no_color: bool) -> Option<bool> {
    let command = format!("{} {line}", program::PATH);
    let mut script = program::shielded("script");
    script.args(["-q", "-c", &command, "/dev/null"]).env("TERM", "xterm-256color");
    script.env_remove("NO_COLOR").env_remove("CLICOLOR").env_remove("CLICOLOR_FORCE");
    if no_color {
        script.env("NO_COLOR", "1");
    }
    let shown = script.current_dir(env!("CARGO_MANIFEST_DIR")).output().ok()?;
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(!shown.is_empty(), "{line}");
    Some(shown.split('\u{1b}').skip(1).any(|code| {
        let end = code.find(|c: char| c.is_ascii_alphabetic());
        end.is_some_and(|end| code[end..].starts_with('m'))
    }))
}

#[test]
fn no_color_is_respected_everywhere() {
    for line in ["--help", "estimate --help", "estimate", "inspct x", "man", "--version", RIM] {
        let Some(plain) = is_styled(line, true) else {
            eprintln!("skipped: no `script` to make a terminal with");
            return;
        };
        assert!(!plain, "{line} is coloured in spite of NO_COLOR");
    }
    // The test sees colours where there are any.
    assert_eq!(is_styled("--help", false), Some(true));
}

#[test]
fn a_scan_comes_from_standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rims = ["file", "pipe"].map(|name| at(&format!("{name}.csv")));
    run(&format!("boundary {SCAN} -o {}", rims[0].display()));
    let pipe = piped(&format!("boundary - --format PLY -o {}", rims[1].display()), SCAN);
    assert_eq!(pipe.status.code(), Some(0), "{}", said(&pipe));
    assert_eq!(fs::read(&rims[0]).unwrap(), fs::read(&rims[1]).unwrap());

    let out = at("out");
    let line = format!("- --format ply --density 260 --quick --json --out {}", out.display());
    let pipe = piped(&line, SCAN);
    assert_eq!(pipe.status.code(), Some(0), "{}", said(&pipe));
    assert!(out.join("stdin.params.json").is_file());
    let [file, pipe] = [run(&format!("{RIM} --json")), pipe]
        .map(|run| serde_json::from_slice::<serde_json::Value>(&run.stdout).unwrap());
    assert_eq!((&pipe["input"], &pipe["read_options"]["format"]), (&"-".into(), &"ply".into()));
    assert_eq!(file["read_options"].get("format"), None);

    // Without its format, in another one, and nothing at all.
    let pipe = piped("inspect -", SCAN);
    assert_eq!(pipe.status.code(), Some(2), "{}", said(&pipe));
    assert!(said(&pipe).contains("- --format ply"), "{}", said(&pipe));
    let pipe = piped("inspect - --format obj", SCAN);
    assert_eq!(pipe.status.code(), Some(1), "{}", said(&pipe));
    assert!(said(&pipe).contains("content is that of a .ply"), "{}", said(&pipe));
    let empty = at("empty");
    fs::write(&empty, "").unwrap();
    let pipe = piped("inspect - --format ply", empty.to_str().unwrap());
    assert!(said(&pipe).contains("empty"), "{}", said(&pipe));
    assert_eq!(piped("inspect - --format json", SCAN).status.code(), Some(2));

    // A file whose name says nothing, and the same from standard input.
    let odd = at("scan.dat");
    fs::copy(SCAN, &odd).unwrap();
    assert_eq!(run(&format!("inspect {}", odd.display())).status.code(), Some(1));
    let file = run(&format!("inspect {} --format ply --json", odd.display()));
    let pipe = piped("inspect - --format ply --json", SCAN);
    assert_eq!((pipe.status.code(), told(&pipe)), (Some(0), told(&file)), "{}", said(&pipe));
}

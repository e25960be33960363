//! Defaults from a file: where it is found, what wins, what is refused and with which place, and
//! that results say what held.

use crate::program;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const RIM: &str = "fixtures/drapes/woven.boundary.csv";

/// A folder with a file of defaults and `fixtures`; the user's own files are out of reach.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new(defaults: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
        std::os::unix::fs::symlink(fixtures, folder.path().join("fixtures")).unwrap();
        if !defaults.is_empty() {
            fs::write(folder.path().join("scan2params.toml"), defaults).unwrap();
        }
        Self(folder)
    }

    fn write(&self, path: &str, text: &str) {
        let path = self.0.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = program::program();
        command.args(words).current_dir(self.0.path()).env_remove("SCAN2PARAMS_CONFIG");
        command.env("XDG_CONFIG_HOME", self.0.path().join("user")).env_remove("HOME");
        command
    }

    fn run(&self, line: &str) -> Output {
        self.command(&line.split_whitespace().collect::<Vec<_>>()).output().unwrap()
    }

    /// What an estimate of the rim says.
    fn estimate(&self, flags: &str) -> Value {
        let run = self.run(&format!("{RIM} --quick --json {flags}"));
        assert_eq!(run.status.code(), Some(0), "{flags}: {}", said(&run));
        serde_json::from_slice(&run.stdout).unwrap()
    }

    /// Value and origin of a flag as `config LINE` prints them.
    fn resolved(&self, flag: &str, line: &str) -> (String, String) {
        let run = self.run(&format!("config {line}"));
        assert_eq!(run.status.code(), Some(0), "{line}: {}", said(&run));
        let text = told(&run);
        let row = text.lines().find(|row| row.split_whitespace().next() == Some(flag));
        let row = row.unwrap_or_else(|| panic!("no {flag} in {text}"));
        let mut cells = row[flag.len()..].split("  ").map(str::trim).filter(|c| !c.is_empty());
        (cells.next().unwrap().to_owned(), cells.next().unwrap().to_owned())
    }
}

fn told(run: &Output) -> String {
    String::from_utf8_lossy(&run.stdout).into_owned()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

#[test]
fn a_file_sets_defaults_and_the_command_line_wins() {
    let bench =
        Bench::new("threads = 1\n[estimate]\ndensity = 1_80.5\nseed = 7\n[inspect]\nseed = 9\n");
    let of_file = bench.estimate("");
    // What is written with a result is what held.
    assert_eq!((&of_file["density"]["value"], &of_file["seed"]), (&180.5.into(), &7.into()));
    assert_eq!(of_file["scan_options"]["seed"], 7);
    let of_line = bench.estimate("--density 190 --seed=8");
    assert_eq!((&of_line["density"]["value"], &of_line["seed"]), (&190.0.into(), &8.into()));
    // With and without the verb, and said to people.
    let run = bench.run(&format!("estimate {RIM} --quick"));
    assert!(told(&run).contains("180.5  g/m^2 (given)"), "{}", told(&run));
    let line = "with --density=180.5 --seed=7 --threads=1 (scan2params.toml)";
    assert!(said(&run).lines().any(|l| l == line), "{}", said(&run));
    assert_eq!(said(&bench.run(&format!("-q {RIM} --quick"))), "");
    // A verb that has no such flag.
    let run = bench.run("convert 1 N/m --to g/s^2");
    assert_eq!((told(&run).trim(), said(&run)), ("1000.0 g/s^2", String::new()));
}

#[test]
fn flags_without_values_and_flags_that_exclude_each_other_can_be_taken_back() {
    let bench = Bench::new(
        "quiet = true\n[estimate]\ndensity = 180\nstrict = true\nwarp-toward = \"-x\"\nno_report = false\n",
    );
    let of = |flag: &str, line: &str| bench.resolved(flag, line);
    assert_eq!(of("--strict", "scan.ply"), ("true".into(), "scan2params.toml:4".into()));
    let (value, origin) = of("--strict", "estimate scan.ply --strict=false");
    assert_eq!(
        (value.as_str(), origin.as_str()),
        ("false", "the command line, not scan2params.toml:4")
    );
    assert_eq!(of("--no-report", "scan.ply"), ("false".into(), "scan2params.toml:6".into()));
    assert_eq!(of("--warp-toward", "scan.ply").0, "-x");
    let (value, origin) = of("--warp-toward", "scan.ply --mark red");
    assert_eq!((value.as_str(), origin.as_str()), ("-", "not scan2params.toml:5: --mark is given"));
    assert_eq!(of("--quiet", "scan.ply -v").1, "not scan2params.toml:1: --verbose is given");
    assert_eq!(of("--depth-scale", "scan.ply"), ("1000".into(), "default".into()));
    assert_eq!(of("--out", "scan.ply").1, "not given");
    // And so they run: the file says --quiet, which -v excludes.
    let run = bench.run(&format!("{RIM} -v --quick --strict=false --release=false"));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert!(said(&run).contains("estimating the stiffnesses"), "{}", said(&run));
    // Without a file too; and only of flags without values.
    let none = Bench::new("");
    let run = none.run(&format!("{RIM} --quick --density 180 --strict=false --release=false"));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert_eq!(none.run(&format!("{RIM} --quick --density=false")).status.code(), Some(2));
}

#[test]
fn the_file_is_that_of_the_flag_else_the_variable_else_the_folder_else_the_user() {
    let density = |value: u32| format!("[estimate]\ndensity = {value}\n");
    let bench = Bench::new(&density(130));
    for (file, value) in
        [("flag.toml", 110), ("variable.toml", 120), ("user/scan2params/config.toml", 140)]
    {
        bench.write(file, &density(value));
    }
    let found = |words: &[&str], variable: Option<&str>| {
        let mut command = bench.command(words);
        if let Some(file) = variable {
            command.env("SCAN2PARAMS_CONFIG", file);
        }
        let run = command.output().unwrap();
        let json: Option<Value> = serde_json::from_slice(&run.stdout).ok();
        json.map_or(-1.0, |json| json["density"]["value"].as_f64().unwrap())
    };
    let flag = ["--config", "flag.toml", RIM, "--quick", "--json"];
    assert_eq!(found(&flag, Some("variable.toml")), 110.0);
    assert_eq!(
        found(&["-q", "--config=flag.toml", "estimate", RIM, "--quick", "--json"], None),
        110.0
    );
    assert_eq!(
        found(&["estimate", RIM, "--quick", "--json", "--config", "flag.toml"], None),
        110.0
    );
    assert_eq!(found(&[RIM, "--quick", "--json"], Some("variable.toml")), 120.0);
    assert_eq!(found(&[RIM, "--quick", "--json"], None), 130.0);
    // An empty name is no file, which leaves the density to the command line.
    assert_eq!(found(&[RIM, "--quick", "--json"], Some("")), -1.0);
    assert_eq!(found(&["--config", "", RIM, "--quick", "--json", "--density", "150"], None), 150.0);
    fs::remove_file(bench.0.path().join("scan2params.toml")).unwrap();
    assert_eq!(found(&[RIM, "--quick", "--json"], None), 140.0);
    let run = bench.run("config");
    assert!(
        told(&run).starts_with("file  ") && told(&run).contains("user/scan2params/config.toml"),
        "{}",
        told(&run)
    );
    // A file that was asked for and is not there is a failure; help is help.
    let run = bench.run(&format!("--config none.toml {RIM}"));
    assert_eq!(run.status.code(), Some(1));
    assert!(said(&run).contains("none.toml: cannot be read"), "{}", said(&run));
    assert_eq!(bench.run("--config none.toml estimate --help").status.code(), Some(0));
}

#[test]
fn paths_are_meant_from_the_file_s_folder_and_lists_give_a_flag_several_times() {
    let bench = Bench::new("");
    bench.write("project/lab.toml", "operator = \"<A. B.>\"\n");
    bench.write(
        "project/c.toml",
        "[estimate]\ndensity = 180\nlab = \"lab.toml\"\nout = \"results\"\n",
    );
    let run = bench.run(&format!("--config project/c.toml {RIM} --quick"));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let page = bench.0.path().join("project/results/woven.report.html");
    assert!(fs::read_to_string(page).unwrap().contains("&lt;A. B.&gt;"));
    bench.write("with.toml", "[estimate]\ndensity = 180\nwith = [\"a.ply\", \"b.ply\"]\n");
    let (value, _) = bench.resolved("--with", "--config with.toml estimate scan.ply");
    assert_eq!(value, "a.ply b.ply");
    bench.write("below.toml", "threads = 3\n[inspect]\nthreads = 2\n[merge]\nthreads = 4\n");
    let of = |flag: &str| bench.resolved(flag, "--config below.toml inspect scan.ply").0;
    assert_eq!(of("--threads"), "2");
}

#[test]
fn what_no_flag_means_is_refused_with_its_place_and_the_nearest_name() {
    for (text, expected) in [
        (
            "[estimate]\ndensty = 180",
            "2:1: `densty` is no flag of `estimate`; did you mean `density`?",
        ),
        (
            "[estimat]\ndensity = 1",
            "1:2: `estimat` is no verb, nor a flag of all of them; did you mean `estimate`?",
        ),
        ("density = 180", "1:1: `density` is a flag of single verbs: write it below `[estimate]`"),
        (
            "thread = 2",
            "1:1: `thread` is no verb, nor a flag of all of them; did you mean `threads`?",
        ),
        (
            "[batch]\n  densitycsv = 1",
            "2:3: `densitycsv` is no flag of `batch`; did you mean `density-csv`?",
        ),
        // of another verb than the one that is run, all the same
        (
            "[simulate]\nvertice = 3",
            "2:1: `vertice` is no flag of `simulate`; did you mean `vertices`?",
        ),
        ("[estimate]\ninput = \"a.ply\"", "2:1: `input` is no flag of `estimate`"),
        ("[estimate]\nconfig = \"a\"", "2:1: `config` is no flag of `estimate`"),
        ("[estimate]\ndensity = true", "2:11: --density takes a value, not true or false"),
        ("[estimate]\nstrict = 1", "2:10: --strict is true or false"),
        ("[estimate]\ndensity = [1, 2]", "2:11: --density takes one value, not a list"),
        ("[estimate]\ndensity = {}", "2:11: --density takes a text or a number"),
        ("estimate = 1", "1:1: `estimate` is a verb: write its flags below `[estimate]`"),
        (
            "[estimate]\nwarp-toward = \"+x\"\nwarp_toward = \"-x\"",
            "3:1: `warp_toward` is set in line 2 already",
        ),
        ("[estimate\n", "no TOML"),
    ] {
        let bench = Bench::new(text);
        let run = bench.run(&format!("{RIM} --quick --density 180"));
        assert_eq!(run.status.code(), Some(2), "{text}: {}", said(&run));
        assert!(said(&run).contains("scan2params.toml:"), "{}", said(&run));
        assert!(said(&run).contains(expected), "{text}: {}", said(&run));
        assert_eq!(bench.run("config").status.code(), Some(2), "{text}");
    }
    // A value that its flag does not take is refused by the flag; the place is told.
    let bench = Bench::new("[estimate]\ndensity = \"heavy\"\n");
    let run = bench.run(RIM);
    assert_eq!(run.status.code(), Some(2));
    assert!(said(&run).contains("invalid value 'heavy' for '--density"), "{}", said(&run));
    assert!(said(&run).contains("note: --density is from scan2params.toml:2"), "{}", said(&run));
    assert_eq!(bench.run(&format!("{RIM} --quick --density 180")).status.code(), Some(0));
    // A mistake on the command line is told as one, by `config` too.
    let run = bench.run("config scan.ply --density abc");
    assert_eq!(run.status.code(), Some(2), "{}", told(&run));
    assert!(said(&run).contains("invalid value 'abc'"), "{}", said(&run));
}

#[test]
fn every_flag_of_every_verb_can_be_set() {
    let bench = Bench::new("");
    let verbs = [
        "estimate",
        "inspect",
        "boundary",
        "merge",
        "batch",
        "calibrate",
        "augment",
        "combine",
        "kit",
        "simulate",
        "generate",
        "export",
        "convert",
    ];
    let mut all = 0;
    for verb in verbs {
        let help = told(&bench.run(&format!("{verb} --help")));
        for line in help.lines() {
            let Some(at) = line.find("--").filter(|at| *at <= 6) else { continue };
            let flag: String =
                line[at + 2..].chars().take_while(|c| c.is_alphanumeric() || *c == '-').collect();
            if ["help", "version", "config"].contains(&flag.as_str()) {
                continue;
            }
            // A table is no flag's value: that it is refused as a value says that the key is known.
            bench.write("c.toml", &format!("[{verb}]\n{flag} = {{}}\n"));
            let run = bench.run("--config c.toml config");
            let told = said(&run);
            assert!(
                told.contains("takes a text or a number") || told.contains("is true or false"),
                "{verb} --{flag}: {told}"
            );
            all += 1;
        }
    }
    assert!(all > 120, "{all}");
}

/// Where tests take the program from.
const PROGRAM: &str = "tests/program/mod.rs";

/// A test that starts the program by itself would see what whoever runs it has set.
#[test]
fn every_test_starts_the_program_without_a_file_of_defaults() {
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")];
    let mut starters = 0;
    while let Some(path) = folders.pop() {
        if path.is_dir() {
            folders.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        if path.extension().is_none_or(|ending| ending != "rs") || path.ends_with(PROGRAM) {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        // put together here, so that this file does not name them
        for name in [["CARGO_BIN", "_EXE"].concat(), ["cargo", "_bin("].concat()] {
            assert!(!text.contains(&name), "{}: {name}; use tests/program", path.display());
        }
        starters += usize::from(text.contains("use crate::program"));
    }
    assert!(starters >= 20, "{starters} tests start the program");

    let bench = Bench::new("[estimate]\nno_such_flag = 1\n");
    assert_eq!(
        bench.run(&format!("{RIM} --quick --density 180")).status.code(),
        Some(2),
        "it is read"
    );
    let mut shielded = program::program();
    let run = shielded
        .args([RIM, "--quick", "--density", "180"])
        .current_dir(bench.0.path())
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
}

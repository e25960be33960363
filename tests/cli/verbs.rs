//! What the words of a command line mean, and what is shown of long work.

use crate::program;
use std::process::Output;

const DRAPE: &str = "simulate --params fixtures/drapes/stiff.params.json --vertices 21";

fn scan2params(line: &str) -> Output {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(line.split_whitespace());
    command.output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

#[test]
fn a_mistyped_verb_is_told_which_was_meant() {
    for (line, verb) in [
        ("estimte scan.ply --density 180 --quick", "estimate"),
        ("simulat --params p.json", "simulate"),
        ("inspct scan.ply", "inspect"),
    ] {
        let run = scan2params(line);
        assert_eq!(run.status.code(), Some(2), "{line}: {}", said(&run));
        assert!(said(&run).contains(&format!("did you mean `{verb}`?")), "{}", said(&run));
    }
    // What is named like a file is one, though it is missing.
    let run = scan2params("batch.ply --density 180 --quick");
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(said(&run).contains("batch.ply: no such file"), "{}", said(&run));
}

#[test]
fn numbers_that_cannot_be_meant_are_usage() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    for line in [
        "generate --drops-per-fabric 0 --out",
        "generate --count 0 --out",
        "generate --threads 100000 --out",
        "generate --threads -1 --out",
        &format!("{DRAPE} --threads 5000 --out"),
        &format!("{DRAPE} --threads two --out"),
    ] {
        let run = scan2params(&format!("{line} {out}"));
        assert_eq!(run.status.code(), Some(2), "{line}: {}", said(&run));
        assert!(!std::path::Path::new(out).exists(), "{line}");
    }
}

#[test]
fn a_folder_of_other_drapes_is_usage() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    std::fs::write(folder.path().join("manifest.json"), "{}").unwrap();
    let run = scan2params(&format!("generate --count 1 --out {out}"));
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    let manifest = scan2params_manifest();
    std::fs::write(folder.path().join("manifest.json"), manifest).unwrap();
    let run = scan2params(&format!("generate --count 1 --seed 7 --out {out}"));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("give those, or another folder"), "{}", said(&run));
}

fn scan2params_manifest() -> String {
    use scan2params::dataset::{GenerateOptions, drapes, generate};
    let folder = tempfile::tempdir().unwrap();
    let options = GenerateOptions::new(folder.path(), 0);
    let simulate = |sample: &_, _: Option<()>| drapes::simulate(sample, &drapes::dataset_options());
    generate(&options, simulate, |_| std::ops::ControlFlow::Continue(())).unwrap();
    std::fs::read_to_string(folder.path().join("manifest.json")).unwrap()
}

/// What a new user mistypes gets an answer that says what to type.
#[test]
fn usual_mistakes_are_answered_with_what_to_do() {
    let fabric = "fixtures/drapes/woven.params.json";
    for (line, code, part) in [
        ("simulate --out x.obj", 2, "--params FILE takes all seven from a params.json"),
        ("export fixtures/drapes --to csv --out x.csv", 1, "is a folder, not a file"),
        ("calibrate fixtures/drapes --out x", 1, "is a folder, not a file"),
        (&format!("convert {fabric} --to N/m"), 2, "--to is for a number"),
        ("convert 5 --to N/m", 2, "give the unit of 5 as well"),
        ("esimate scan.ply", 2, "did you mean `estimate`"),
    ] {
        let run = scan2params(line);
        assert_eq!(run.status.code(), Some(code), "{line}: {}", said(&run));
        assert!(said(&run).contains(part), "{line}: {}", said(&run));
    }
}

/// One drape is computed on one thread: the flag changes neither a byte nor the time, and
/// the program says so.
#[test]
fn threads_change_nothing_of_a_drape_and_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let drape = |threads: &str| {
        let out = folder.path().join(format!("{threads}.obj"));
        let run = scan2params(&format!("{DRAPE} --threads {threads} --out {}", out.display()));
        assert_eq!(run.status.code(), Some(0), "{}", said(&run));
        (std::fs::read(out).unwrap(), said(&run))
    };
    let [(one, quiet), (four, told)] = ["1", "4"].map(drape);
    assert!(one == four, "threads change the drape");
    assert!(!quiet.contains("thread"), "{quiet}");
    assert!(told.contains("computed on one thread; --threads 4 changes nothing"), "{told}");
    let help = scan2params("simulate --help");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    let help: String = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("one drape is computed on one"), "{help}");
}

/// On a terminal a batch prints a short table, elsewhere CSV with all columns.
#[test]
fn a_batch_prints_a_short_table_to_people() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    std::fs::copy("fixtures/drapes/stiff.boundary.csv", scans.join("stiff.csv")).unwrap();
    std::fs::write(scans.join("table.txt"), "file,density_g_m2\nstiff.csv,260\n").unwrap();
    let [scans, out] = [scans.clone(), folder.path().join("out")].map(|p| p.display().to_string());
    let line =
        format!("batch {scans} --density-csv {scans}/table.txt --quick --no-report --out {out}");
    let piped = scan2params(&line);
    let csv = String::from_utf8_lossy(&piped.stdout).into_owned();
    assert!(csv.starts_with("file,status,exit_code,"), "{csv}");
    let command = format!("{} {line}", program::PATH);
    let mut script = program::shielded("script");
    script.args(["-q", "-e", "-c", &command, "/dev/null"]).current_dir(env!("CARGO_MANIFEST_DIR"));
    let Ok(shown) = script.output() else {
        eprintln!("skipped: no `script` to make a terminal with");
        return;
    };
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(shown.contains("scan       verdict") && shown.contains("weft and warp"), "{shown}");
    assert!(!shown.contains("input_sha256"), "{shown}");
}

/// On a terminal a line tells what is being done; elsewhere there is none. The terminal
/// is that of `script` (util-linux).
#[test]
fn long_work_shows_that_it_goes_on_and_only_to_people() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("drape.obj").display().to_string();
    let scan = "fixtures/scans/stiff_structured-light.ply";
    let drape = format!("{DRAPE} --out {out}");
    let scans = format!("augment {out} --out {}", folder.path().join("scans").display());
    let estimate = format!("{scan} --density 260 --quick --release");
    for (line, doing) in [
        (&drape, "simulating the drape"),
        (&scans, "scan 1 of 1: drape-0"),
        (&estimate, "simulating the released drape"),
    ] {
        let run = scan2params(line);
        assert_eq!(run.status.code(), Some(0), "{line}: {}", said(&run));
        assert!(!said(&run).contains(doing), "{line}: {}", said(&run));
        assert!(!said(&run).contains('\r') && !said(&run).contains('\u{1b}'), "{}", said(&run));
        let command = format!("{} {line}", program::PATH);
        let mut script = program::shielded("script");
        script.args(["-q", "-e", "-c", &command, "/dev/null"]).env("TERM", "xterm");
        script.current_dir(env!("CARGO_MANIFEST_DIR"));
        let Ok(shown) = script.output() else {
            eprintln!("skipped: no `script` to make a terminal with");
            return;
        };
        let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
        assert!(shown.contains(doing), "{line}: {shown:?}");
        // No colour, whatever NO_COLOR says: colours are set with `ESC [ ... m`.
        let has_colour = shown.split('\u{1b}').skip(1).any(|code| {
            let end = code.find(|c: char| c.is_ascii_alphabetic());
            end.is_some_and(|end| code[end..].starts_with('m'))
        });
        assert!(!has_colour, "{line}: {shown:?}");
    }
}

#[test]
fn a_manifest_at_fault_is_usage_and_says_every_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let title = "file,kind,fabric,face,experiment,mm_per_pixel,role\n";
    let bad =
        format!("{title}a.png,photo,2,up,cusick,1.39,fit\nb.png,silhouette,2,left,cusick,,fit\n");
    std::fs::write(at("bad.csv"), bad).unwrap();
    let line =
        |name: &str| format!("calibrate {} --out {}", at(name).display(), at("out").display());
    let run = scan2params(&line("bad.csv"));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    for part in ["bad.csv:2: kind: `photo`", "bad.csv:3: face: `left`", "bad.csv:3: mm_per_pixel:"]
    {
        assert!(said(&run).contains(part), "{}", said(&run));
    }
    std::fs::write(at("gone.csv"), format!("{title}a.png,silhouette,2,up,cusick,1.39,fit\n"))
        .unwrap();
    let run = scan2params(&line("gone.csv"));
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(said(&run).contains("line 2: a.png:"), "{}", said(&run));
    // a scanner's edge where nothing was scanned
    let run = scan2params(&format!("{} --sensor-edge-mm=-0.5", line("gone.csv")));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("no row has kind scan; leave it out"), "{}", said(&run));
    assert!(!at("out").exists());
}

#[test]
fn a_result_or_a_folder_is_not_taken_for_a_scan() {
    let run = scan2params("fixtures --density 180 --quick");
    assert_eq!(run.status.code(), Some(1), "{}", said(&run));
    assert!(said(&run).contains("`batch FOLDER` estimates every scan"), "{}", said(&run));
    for verb in ["estimate --density 180", "inspect"] {
        let run = scan2params(&format!("{verb} fixtures/drapes/woven.params.json"));
        assert_eq!(run.status.code(), Some(2), "{}", said(&run));
        assert!(said(&run).contains("no scan; `export`, `convert`"), "{}", said(&run));
    }
}

#[test]
fn a_file_in_place_of_a_folder_and_paths_that_cannot_be_are_usage() {
    let long = "a".repeat(300);
    for (line, part) in [
        (
            "batch fixtures/scans/stiff_structured-light.ply --density 260",
            "`estimate` the one scan",
        ),
        ("batch fixtures/scans", "100 x 100 mm"),
        ("fixtures/scans/stiff_structured-light.ply", "100 x 100 mm"),
        ("fixtures/drapes/woven.boundary.csv - --density 180", "`-` is the standard input"),
        (&format!("inspect {long}.ply"), "too long for this system (304 bytes"),
    ] {
        let run = scan2params(line);
        assert_eq!(run.status.code(), Some(2), "{line}: {}", said(&run));
        assert!(said(&run).starts_with("error: "), "{line}: {}", said(&run));
        assert!(said(&run).contains(part), "{line}: {}", said(&run));
    }
    // all errors begin alike, those of the arguments and those of the work
    let run = scan2params("batch fixtures/none --density 260");
    assert!(said(&run).starts_with("error: fixtures/none: no such folder"), "{}", said(&run));
    let run = scan2params("inspect none.ply");
    assert_eq!((run.status.code(), said(&run).starts_with("error: none.ply: ")), (Some(1), true));
}

#[test]
fn a_density_that_cannot_be_is_told_what_to_give() {
    for (density, code, part) in [
        ("-214", 2, "-214 g/m^2 is outside"),
        ("0", 2, "0 g/m^2 is outside"),
        ("0.214", 2, "0.214 kg/m^2 are 214"),
        ("214,5", 2, "decimal point"),
        ("6.3oz/yd2", 2, "scan2params convert"),
        ("scan.ply", 2, "a number of g/m^2 alone"),
    ] {
        let run =
            scan2params(&format!("fixtures/drapes/woven.boundary.csv --density {density} --quick"));
        assert_eq!(run.status.code(), Some(code), "{density}: {}", said(&run));
        assert!(said(&run).contains(part), "{density}: {}", said(&run));
    }
}

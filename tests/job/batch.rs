//! `batch`: one bad file never stops it, and a kill loses nothing.

use crate::program;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use scan2params::batch::{self, BatchOptions, Progress, Share};
use scan2params::io::ReadOptions;
use scan2params::scan::ScanOptions;
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn program() -> Command {
    program::program()
}

fn run_batch(folder: &Path, out: &Path, more: &[&str]) -> Output {
    program().arg("batch").arg(folder).arg("--out").arg(out).args(more).output().unwrap()
}

fn lines(path: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

fn csv(bytes: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(bytes);
    reader.deserialize().map(Result::unwrap).collect()
}

/// A grid of points that is no drape.
fn floor() -> String {
    (0..10_000)
        .map(|k| format!("{} {} 0\n", 0.005 * f64::from(k / 100), 0.005 * f64::from(k % 100)))
        .collect()
}

/// Two good scans, one in a folder below; a refused one; a damaged one; one that
/// no row of the table names; and a row that names none.
fn mixed(folder: &Path) -> PathBuf {
    let scans = folder.join("scans");
    std::fs::create_dir_all(scans.join("sub")).unwrap();
    let good = fixture("scans/stiff_structured-light.ply");
    std::fs::copy(&good, scans.join("b good.ply")).unwrap();
    std::fs::copy(&good, scans.join("sub/a.ply")).unwrap();
    std::fs::write(scans.join("floor.xyz"), floor()).unwrap();
    std::fs::write(scans.join("damaged.ply"), &std::fs::read(&good).unwrap()[..5000]).unwrap();
    std::fs::write(scans.join("nameless.xyz"), floor()).unwrap();
    std::fs::write(scans.join("notes.txt"), "not a scan").unwrap();
    let table = "file,density_g_m2,warp_toward\n\"b good.ply\",260,+x\na.ply,260,\nfloor.xyz,180,\n\
                 damaged.ply,180,\nmissing.ply,200,\n";
    std::fs::write(scans.join("density.csv"), table).unwrap();
    scans
}

#[test]
fn one_bad_file_never_stops_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let scans = mixed(folder.path());
    let (out, table) = (folder.path().join("out"), scans.join("density.csv"));
    let flags = ["--density-csv", table.to_str().unwrap(), "--quick"];
    let run = run_batch(&scans, &out, &flags);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(3), "{said}");
    let rows = csv(&run.stdout);
    let status: Vec<_> =
        rows.iter().map(|r| (r["file"].as_str(), r["exit_code"].as_str())).collect();
    assert_eq!(
        status,
        [
            ("b good.ply", "0"),
            ("damaged.ply", "1"),
            ("floor.xyz", "4"),
            ("missing.ply", "1"),
            ("nameless.xyz", "2"),
            ("sub/a.ply", "0")
        ]
    );
    assert_eq!(
        (rows[0]["orientation"].as_str(), rows[5]["orientation"].as_str()),
        ("given", "ambiguous")
    );
    assert!(rows[0]["shear_g_s2"].parse::<f64>().unwrap() > 0.0);
    for (file, part) in [
        ("damaged.ply", "copy or export it again"),
        ("floor.xyz", "no drape found"),
        ("missing.ply", "line 6"),
        ("nameless.xyz", "has no row for `nameless.xyz`"),
    ] {
        let row = rows.iter().find(|r| r["file"] == file).unwrap();
        assert!(row["reason"].contains(part), "{row:?}");
        assert!(said.contains(file), "{said}");
        assert_eq!(row["shear_g_s2"], "");
    }
    assert!(said.contains("passed over") && said.contains(": notes.txt;"), "{said}");
    assert!(said.contains("4 of 6 scans have no estimate") && said.contains("left"), "{said}");
    assert!(said.contains("weft and warp unknown in 1 of 2 estimated scans"), "{said}");
    let results = lines(&out.join("results.jsonl"));
    assert_eq!(results.len(), 6);
    assert_eq!(results[0]["result"]["density"]["value"], 260.0);
    assert!(out.join("files/sub/a.ply.params.json").is_file());
    assert!(out.join("files/b good.ply.boundary.csv").is_file());
    assert_eq!(run.stdout, std::fs::read(out.join("results.csv")).unwrap());

    // Again: what ended is kept, what failed is tried again, what changed is done anew.
    let journal = out.join("journal.jsonl");
    let count = |file: &str| lines(&journal).iter().filter(|row| row["file"] == file).count();
    let again = run_batch(&scans, &out, &flags);
    assert_eq!(again.stdout, run.stdout);
    assert_eq!((count("b good.ply"), count("floor.xyz"), count("damaged.ply")), (1, 1, 2));
    std::fs::write(scans.join("floor.xyz"), floor() + "9 9 9\n").unwrap();
    std::fs::remove_file(scans.join("damaged.ply")).unwrap();
    std::fs::remove_file(out.join("files/sub/a.ply.params.json")).unwrap();
    let table_text =
        std::fs::read_to_string(&table).unwrap().replace("good.ply\",260", "good.ply\",250");
    std::fs::write(&table, table_text).unwrap();
    run_batch(&scans, &out, &flags);
    assert_eq!((count("b good.ply"), count("floor.xyz"), count("sub/a.ply")), (2, 2, 2));
    assert!(out.join("files/sub/a.ply.params.json").is_file());
}

/// Rims in the folder of the run that is killed: enough that it has not ended by then.
const SCANS: usize = 8;

#[test]
fn a_killed_run_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    let mut table = "file,density_g_m2\n".to_owned();
    for k in 0..SCANS {
        std::fs::copy(fixture("drapes/stiff.boundary.csv"), scans.join(format!("{k}.csv")))
            .unwrap();
        table += &format!("{k}.csv,260\n");
    }
    let densities = folder.path().join("densities.csv");
    std::fs::write(&densities, table).unwrap();
    let table = densities.to_str().unwrap();
    let (out, flags) =
        (folder.path().join("out"), ["--density-csv", table, "--quick", "--threads", "1"]);
    let journal = out.join("journal.jsonl");
    let mut child = program()
        .arg("batch")
        .arg(&scans)
        .arg("--out")
        .arg(&out)
        .args(flags)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while lines(&journal).is_empty() {
        assert!(start.elapsed() < Duration::from_secs(120), "no row in two minutes");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!out.join("results.csv").exists(), "killed before its end");
    let done = lines(&journal);
    assert!((1..SCANS).contains(&done.len()));
    // A line that a kill tore.
    let mut text = std::fs::read(&journal).unwrap();
    text.extend(br#"{"schema_version":1,"file":"7.cs"#);
    std::fs::write(&journal, text).unwrap();

    let run = run_batch(&scans, &out, &flags);
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{said}");
    assert!(said.contains("torn line (32 bytes)"), "{said}");
    assert!(said.contains(&format!("{SCANS} scans, {} kept", done.len())), "{said}");
    let after = lines(&journal);
    assert_eq!(after[..done.len()], done, "nothing lost, nothing done again");
    assert_eq!(after.len(), SCANS);

    let uninterrupted = run_batch(&scans, &folder.path().join("whole"), &flags);
    assert_eq!(uninterrupted.stdout, run.stdout);
}

#[test]
fn results_that_are_removed_while_the_batch_runs_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    std::fs::create_dir(&scans).unwrap();
    for name in ["a.csv", "b.csv"] {
        std::fs::copy(fixture("drapes/stiff.boundary.csv"), scans.join(name)).unwrap();
    }
    let densities = folder.path().join("densities.csv");
    std::fs::write(&densities, "file,density_g_m2\na.csv,260\nb.csv,260\n").unwrap();
    let options = BatchOptions {
        folder: scans,
        out: out.clone(),
        share: Share::All,
        density_csv: Some(densities),
        density_kg_m2: None,
        read: ReadOptions::default(),
        scan: ScanOptions::default(),
        refine: false,
        release: false,
        strict: false,
        threads: 1,
        pages: false,
    };
    let remove = |progress: Progress<'_>| {
        if progress.row.file == "a.csv" {
            std::fs::remove_file(out.join("files/a.csv.params.json")).unwrap();
        }
    };
    assert_eq!(batch::run(&options, remove).unwrap().lost, ["a.csv"]);
    let again = batch::run(&options, |_| ()).unwrap();
    assert_eq!((again.lost.len(), again.kept), (0, 1));
}

#[test]
fn what_cannot_be_meant_is_said_before_anything_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    let table = folder.path().join("d.csv");
    let refused = |text: &str, more: &[&str]| {
        std::fs::write(&table, text).unwrap();
        let flags = [&["--density-csv", table.to_str().unwrap(), "--quick"], more].concat();
        let run = run_batch(&scans, &folder.path().join("out"), &flags);
        assert!(run.stdout.is_empty() || more.contains(&"--dry-run"));
        (run.status.code(), String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let (code, said) = refused("# none\nx.ply,200\n", &["--density", "0", "--quick"]);
    assert_eq!(code, Some(2), "{said}");
    std::fs::write(scans.join("a.xyz"), floor()).unwrap();
    std::fs::create_dir(scans.join("sub")).unwrap();
    std::fs::write(scans.join("sub/b.xyz"), floor()).unwrap();
    std::fs::write(scans.join("b.xyz"), floor()).unwrap();
    for (text, part) in [
        ("file,density_g_m2\na.xyz,heavy\n", "d.csv:2: density_g_m2 of `a.xyz`"),
        ("file,density_g_m2\na.xyz,200\nsub/b.xyz,20000\n", "d.csv:3"),
        ("file,density_g_m2,warp_toward\na.xyz,200,up\n", "d.csv:2: warp_toward"),
        (
            "file,density_g_m2\na.xyz,200\n./a.xyz,210\n",
            "d.csv:3: `./a.xyz` is the scan that line 2",
        ),
    ] {
        let (code, said) = refused(text, &[]);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(part), "{said}");
    }
    let (code, said) =
        refused("file,density_g_m2\na.xyz,200\nb.xyz,200\n", &["--dry-run", "--density", "1"]);
    assert_eq!(code, Some(0), "{said}");
    // A folder of views is one scan, and what `augment` writes beside scans is none.
    let views = scans.join("set");
    std::fs::create_dir(&views).unwrap();
    for file in ["views.json", "a.png", "b.ply"] {
        std::fs::write(views.join(file), "").unwrap();
    }
    std::fs::write(scans.join("drape.truth.obj"), "").unwrap();
    std::fs::write(&table, "set/views.json;200\na.xyz;201,5\n").unwrap();
    let flags = ["--density-csv", table.to_str().unwrap(), "--dry-run"];
    let run = run_batch(&scans, &folder.path().join("out"), &flags);
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 4, "{said}");
    assert_eq!((lines[0], lines[2]), ("a.xyz: 201.5 g/m^2", "set: 200 g/m^2"));
    assert!(lines[1].starts_with("b.xyz: no density: "), "{said}");
    let run = run_batch(
        &folder.path().join("none"),
        &folder.path().join("out"),
        &["--density", "200", "--quick"],
    );
    assert_eq!(run.status.code(), Some(1));
    let run = program().arg("batch").arg(&scans).output().unwrap();
    assert_eq!(run.status.code(), Some(2), "no density at all");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_row_that_names_a_scan_without_its_ending_is_told_the_whole_name() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    std::fs::write(scans.join("linen7.xyz"), floor()).unwrap();
    let table = folder.path().join("d.csv");
    std::fs::write(&table, "file;density_g_m2\nlinen7;180,4\n").unwrap();
    let flags = ["--dry-run", "--density-csv", table.to_str().unwrap()];
    let run = run_batch(&scans, &folder.path().join("out"), &flags);
    let told = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(told.contains("`linen7.xyz` is there: write its name whole"), "{told}");
}

#[test]
fn shards_of_any_number_merge_into_what_one_run_gives() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    std::fs::create_dir(&scans).unwrap();
    let mut table = "file,density_g_m2\nmissing.csv,200\n".to_owned();
    for (name, density) in [("mean", 214), ("stiff", 260), ("woven", 180)] {
        let file = format!("{name}.boundary.csv");
        std::fs::copy(fixture("drapes").join(&file), scans.join(&file)).unwrap();
        table += &format!("{file},{density}\n");
    }
    std::fs::write(scans.join("damaged.ply"), "ply").unwrap();
    table += "damaged.ply,200\n";
    std::fs::write(scans.join("density.csv"), table).unwrap();
    let table = scans.join("density.csv");
    let run = |out: &str, more: &[&str]| {
        let flags = ["--density-csv", table.to_str().unwrap(), "--quick"];
        let run = run_batch(&scans, &folder.path().join(out), &[&flags, more].concat());
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        (run.status.code(), run.stdout, said)
    };
    let whole = run("whole", &[]);
    assert_eq!((whole.0, csv(&whole.1).len()), (Some(3), 5), "{}", whole.2);

    let tables = || {
        let out = folder.path().join("shared");
        ["results.csv", "results.jsonl", "report.html"].map(|name| out.join(name).exists())
    };
    // The places are 0 damaged, 1 mean, 2 missing, 3 stiff, 4 woven.
    let (code, printed, _) = run("shared", &["--shard", "1/2"]);
    let files: Vec<String> = csv(&printed).iter().map(|row| row["file"].clone()).collect();
    assert_eq!((code, files.join(" ").as_str()), (Some(0), "mean.boundary.csv stiff.boundary.csv"));
    let (code, printed, said) = run("shared", &["--merge"]);
    assert_eq!((code, printed.len(), tables()), (Some(1), 0, [false; 3]), "{said}");
    assert!(said.contains("2 of 5 scans have not been done"), "{said}");
    assert!(said.contains("damaged.ply, woven.boundary.csv; run"), "{said}");
    assert_eq!(run("shared", &["--shard", "0/2"]).0, Some(3));
    // Again in three: only what failed is tried again, and a line that another run is writing stays
    // whole.
    let torn = folder.path().join("shared/journal-1-of-2.jsonl");
    let mut text = std::fs::read(&torn).unwrap();
    text.extend(br#"{"schema"#);
    std::fs::write(&torn, &text).unwrap();
    for (shard, kept) in [("0/3", 1), ("1/3", 2), ("2/3", 0)] {
        let (_, _, said) = run("shared", &["--shard", shard]);
        assert!(said.contains(&format!(" {kept} kept")), "{shard}: {said}");
    }
    assert_eq!(std::fs::read(&torn).unwrap(), text);
    assert_eq!(tables(), [false; 3]);
    let (code, printed, said) = run("shared", &["--merge"]);
    assert_eq!((code, printed), (Some(3), whole.1), "{said}");
    assert_eq!(tables(), [true; 3]);
    for name in ["results.csv", "report.html", "files/mean.boundary.csv.params.json"] {
        let of = |out: &str| std::fs::read(folder.path().join(out).join(name)).unwrap();
        assert_eq!(of("shared"), of("whole"), "{name}");
    }
    // Of other options nothing has been done, and what these write does not pass for the first's.
    let (code, _, said) = run("shared", &["--merge", "--warp-toward", "+x"]);
    assert!(code == Some(1) && said.contains("4 of 5 scans"), "{said}");
    let (_, _, said) = run("shared", &["--shard", "1/2", "--warp-toward", "+x"]);
    assert!(said.contains(" 0 kept"), "{said}");
    let (code, _, said) = run("shared", &["--merge"]);
    assert!(code == Some(1) && said.contains("2 of 5 scans"), "{said}");
    assert_eq!(run("shared", &["--shard", "2/2"]).0, Some(2));
    assert_eq!(run("shared", &["--shard", "0/2", "--merge"]).0, Some(2));
}

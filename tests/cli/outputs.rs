//! Where results go: never over what is read, never after work that was for nothing.

use crate::program;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const SCAN: &str = "fixtures/scans/stiff_structured-light.ply";

fn program(arguments: &[&str]) -> Command {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    command
}

fn run(line: &str, paths: &[&Path]) -> Output {
    let mut paths = paths.iter();
    let words: Vec<&str> = line
        .split_whitespace()
        .map(|word| if word == "PATH" { paths.next().unwrap().to_str().unwrap() } else { word })
        .collect();
    program(&words).output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// Runs what must be refused as a mistake of usage, and must change nothing in `folder`.
fn refused(line: &str, paths: &[&Path], folder: &Path) -> String {
    let before = contents(folder);
    let run = run(line, paths);
    assert_eq!(run.status.code(), Some(2), "{line}: {}", said(&run));
    assert!(run.stdout.is_empty(), "{line}");
    assert_eq!(contents(folder), before, "{line} changed the folder");
    said(&run)
}

/// Every file of a folder, with its bytes.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(contents(&path));
        } else {
            let bytes = fs::read(&path).unwrap();
            all.push((path, bytes));
        }
    }
    all.sort();
    all
}

#[test]
fn a_result_never_replaces_what_it_is_made_from() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scan = at("own.ply");
    fs::copy(SCAN, &scan).unwrap();
    fs::hard_link(&scan, at("hard.ply")).unwrap();
    fs::create_dir(at("sub")).unwrap();
    fs::copy("fixtures/drapes/stiff.params.json", at("p.json")).unwrap();
    let camera = r#"{"fx":585,"fy":585,"cx":320,"cy":240}"#;
    fs::write(at("camera.json"), camera).unwrap();
    let mut spellings = vec![scan.clone(), at("sub/../own.ply"), at("hard.ply")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../own.ply", at("sub/link.ply")).unwrap();
        spellings.push(at("sub/link.ply"));
        // A result of `estimate` whose name is a link to the scan.
        fs::create_dir(at("out")).unwrap();
        std::os::unix::fs::symlink("../own.ply", at("out/own.params.json")).unwrap();
        let said =
            refused("PATH --density 260 --quick --out PATH", &[&scan, &at("out")], folder.path());
        assert!(said.contains("own.params.json: is the input"), "{said}");
    }
    for out in &spellings {
        for verb in ["boundary", "inspect"] {
            let line = format!("{verb} PATH --out PATH");
            let said = refused(&line, &[&scan, out], folder.path());
            assert!(said.contains("is the input") && said.contains("another name"), "{said}");
        }
        refused("augment PATH --out PATH", &[&scan, out], folder.path());
    }
    let line = "boundary PATH --intrinsics PATH --out PATH";
    refused(line, &[&scan, &at("camera.json"), &at("camera.json")], folder.path());
    refused("simulate --params PATH --out PATH", &[&at("p.json"), &at("p.json")], folder.path());
    let line = "simulate --params PATH --out PATH --boundary PATH";
    refused(line, &[&at("p.json"), &at("d.obj"), &at("p.json")], folder.path());
    let said = refused(line, &[&at("p.json"), &at("d.obj"), &at("sub/../d.obj")], folder.path());
    assert!(said.contains("two results"), "{said}");
    // The table of a batch that has the name of its result.
    fs::write(at("sub/results.csv"), "file,density_g_m2\nown.ply,260\n").unwrap();
    let line = "batch PATH --density-csv PATH --quick --out PATH";
    let (table, out) = (at("sub/results.csv"), at("sub"));
    let said = refused(line, &[folder.path(), &table, &out], folder.path());
    assert!(said.contains("results.csv: is the input"), "{said}");
}

/// Every verb says what is wrong with the place of its result before it reads its input,
/// let alone works on it: the inputs here are missing, or would take minutes.
#[test]
fn the_place_of_a_result_is_looked_at_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let (here, none) = (folder.path(), folder.path().join("none/file"));
    let long = "simulate --params fixtures/drapes/mean.params.json --vertices 241";
    let at = |name: &str| folder.path().join(name);
    let to = "export fixtures/drapes/mean.params.json --to";
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    fs::copy(SCAN, scans.join("a.ply")).unwrap();
    for (line, path, code, part) in [
        ("missing.ply --density 200 --quick --out PATH", &file, 2, "is a file; give a folder"),
        ("inspect missing.ply --out PATH", &here.to_owned(), 2, "is a folder; give the name"),
        ("inspect missing.ply --out PATH", &none, 1, "cannot be written"),
        ("inspect missing.ply --out PATH", &at("a.jpg"), 2, "give a name that ends in .png"),
        ("boundary missing.ply --out PATH", &at("a.png"), 2, "give a name that ends in .csv"),
        ("merge missing.ply --out PATH", &at("a.pcd"), 2, "give a name that ends in .ply"),
        (&format!("{long} --out PATH"), &at("a.ply"), 2, "give a name that ends in .obj"),
        ("augment fixtures/drapes --out PATH", &at("a.xyz"), 2, "give a name that ends in .ply"),
        (&format!("{to} clo --out PATH"), &at("a.py"), 2, "give a name that ends in .jfab"),
        (&format!("{to} usd --out PATH"), &at("a.usdz"), 2, "that ends in .usda or .usd"),
        ("boundary missing.ply --out PATH", &here.to_owned(), 2, "is a folder; give the name"),
        ("boundary missing.ply --out PATH", &none, 1, "cannot be written"),
        (&format!("{long} --out PATH"), &here.to_owned(), 2, "is a folder; give the name"),
        (&format!("{long} --out PATH"), &none, 1, "cannot be written"),
        (&format!("{long} --out {} --boundary PATH", file.display()), &none, 1, "cannot be"),
        (
            &format!("batch {} --density 200 --quick --out PATH", scans.display()),
            &file,
            2,
            "give a folder",
        ),
        ("generate --out PATH", &file, 2, "is a file; give a folder"),
        ("augment fixtures/drapes --out PATH", &file, 2, "is a file; give a folder"),
        ("augment fixtures/drapes/stiff.params.json --out PATH.ply", &none, 1, "cannot be"),
    ] {
        let line = line.replace("PATH.ply", &format!("{}.ply", none.display()));
        let run = run(&line, &[path]);
        assert_eq!(run.status.code(), Some(code), "{line}: {}", said(&run));
        assert!(said(&run).contains(part), "{line}: {}", said(&run));
        assert!(run.stdout.is_empty(), "{line}");
    }
    assert_eq!(contents(folder.path()).len(), 2, "something was written");
    if cfg!(target_os = "linux") {
        // The system refuses even root to write here.
        let run = run("missing.ply --density 200 --quick --out PATH", &[Path::new("/proc/out")]);
        assert_eq!(run.status.code(), Some(1), "{}", said(&run));
        assert!(said(&run).contains("cannot be written"), "{}", said(&run));
    }
}

#[test]
fn two_batches_do_not_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    fs::create_dir(&scans).unwrap();
    for name in ["a.csv", "b.csv"] {
        fs::copy("fixtures/drapes/stiff.boundary.csv", scans.join(name)).unwrap();
    }
    let table = folder.path().join("densities.csv");
    fs::write(&table, "file,density_g_m2\na.csv,260\nb.csv,260\n").unwrap();
    let scans_flag = scans.to_str().unwrap();
    let [table, results] = [&table, &out].map(|path| path.to_str().unwrap());
    let batch = ["batch", scans_flag, "--density-csv", table, "--quick", "--out", results];
    let start = || program(&batch).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let ends = [start(), start()].map(|child| child.wait_with_output().unwrap());
    let codes = ends.each_ref().map(|end| end.status.code());
    let journal = || fs::read_to_string(out.join("journal.jsonl")).unwrap();
    assert_eq!(journal().lines().count(), 2, "the journal is doubled: {codes:?}");
    // Both may end well, one after the other.
    assert!(codes.contains(&Some(0)), "{codes:?}");
    for end in ends.iter().filter(|end| end.status.code() != Some(0)) {
        assert_eq!(end.status.code(), Some(1));
        assert!(said(end).contains("is filling this folder already"), "{}", said(end));
    }
    // One that another process holds, for sure.
    let lock = fs::File::create(out.join("batch.lock")).unwrap();
    lock.lock().unwrap();
    fs::write(out.join("batch.lock"), "4242 0\n").unwrap();
    let run = program(&batch).output().unwrap();
    assert_eq!(run.status.code(), Some(1));
    assert!(said(&run).contains("process 4242 (for "), "{}", said(&run));
    assert!(said(&run).contains("wait for it"), "{}", said(&run));
    drop(lock);
    let run = program(&batch).output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert_eq!(journal().lines().count(), 2);
    assert!(!out.join("batch.lock").exists());
}

/// A table of 300,000 rows: seconds where the time grows with the rows, tens of minutes
/// where it grows with their square.
#[test]
fn the_time_for_a_table_of_densities_grows_with_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    fs::write(scans.join("s299999.xyz"), "0 0 0\n").unwrap();
    let mut table = "file,density_g_m2\n".to_owned();
    for row in 0..300_000 {
        table += &format!("s{row}.xyz,{}\n", 100 + row % 100);
    }
    let path = folder.path().join("d.csv");
    fs::write(&path, table).unwrap();
    let run = run("batch PATH --density-csv PATH --dry-run", &[&scans, &path]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let text = String::from_utf8(run.stdout).unwrap();
    let is_missing = |line: &&str| line.ends_with("d.csv names it");
    assert_eq!(text.lines().filter(is_missing).count(), 299_999);
    assert!(text.contains("\ns299999.xyz: 199 g/m^2\n"));
}

/// The rim of a disc runs inside its grid; the corners of the grid are no cloth.
#[test]
fn the_drape_of_a_disc_has_no_vertex_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("disc.obj");
    let line = "simulate --params fixtures/drapes/stiff.params.json --cusick --vertices 31 \
                --out PATH";
    let run = run(line, &[&obj]);
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let text = fs::read_to_string(&obj).unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().skip(1).map(|n| n.parse().unwrap()).collect()
    };
    let of = |kind: &str| -> Vec<Vec<f64>> {
        text.lines().filter(|line| line.starts_with(kind)).map(numbers).collect()
    };
    let (vertices, faces) = (of("v "), of("f "));
    let highest = vertices.iter().map(|v| v[1]).fold(f64::MIN, f64::max);
    assert!(highest < 20.0, "a vertex at y = {highest} mm");
    let mut used = vec![false; vertices.len()];
    for corner in faces.iter().flatten() {
        used[*corner as usize - 1] = true;
    }
    assert!(used.iter().all(|&used| used), "a vertex without a face");
    assert!(vertices.len() > 600 && vertices.len() < 31 * 31, "{}", vertices.len());
}

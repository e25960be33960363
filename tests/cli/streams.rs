//! What the program prints to: full disks, readers that go, streams that are closed,
//! devices and pipes as results, Ctrl-C. Nothing of this makes it panic.

#![cfg(unix)]

use crate::program;
use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const SCAN: &str = "fixtures/scans/stiff_structured-light.ply";
const RIM: &str = "fixtures/drapes/stiff.boundary.csv";
const DRAPE: &str = "simulate --params fixtures/drapes/stiff.params.json --vertices 21 --out";

fn program(arguments: &[&str]) -> Command {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    command
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// A device of this folder's own, and a link to standard output: a program that replaces
/// them, run by root, must not be let near those of the system.
struct Devices {
    /// Takes everything, and a full disk; `None` where no device can be made.
    null_and_full: Option<[PathBuf; 2]>,
    stdout: PathBuf,
}

fn devices(folder: &Path) -> Devices {
    let stdout = folder.join("stdout");
    std::os::unix::fs::symlink("/proc/self/fd/1", &stdout).unwrap();
    let paths = [("null", "3"), ("full", "7")].map(|(name, minor)| {
        let path = folder.join(name);
        let made = Command::new("mknod").arg(&path).args(["c", "1", minor]).output();
        let opens = File::options().write(true).open(&path).is_ok();
        (made.is_ok_and(|made| made.status.success()) && opens).then_some(path)
    });
    let [null, full] = paths;
    let null_and_full = null.zip(full).map(|(null, full)| [null, full]);
    if null_and_full.is_none() {
        eprintln!("skipped: devices, which only root can make");
    }
    Devices { null_and_full, stdout }
}

/// What each verb prints, and files it writes besides in `folder`.
fn commands(folder: &Path) -> Vec<(Vec<String>, Vec<PathBuf>)> {
    let scans = folder.join("scans");
    fs::create_dir_all(&scans).unwrap();
    fs::copy(RIM, scans.join("a.csv")).unwrap();
    let table = folder.join("densities.csv");
    fs::write(&table, "file,density_g_m2\na.csv,260\n").unwrap();
    let scans = format!("{} --density-csv {}", scans.display(), table.display());
    let file = |name: &str| folder.join(name);
    let line = |text: &str, out: &Path| -> Vec<String> {
        words(text).into_iter().map(String::from).chain([out.display().to_string()]).collect()
    };
    let batch = format!("batch {scans} --quick --out");
    let none = |text: &str| words(text).into_iter().map(String::from).collect();
    vec![
        (none("--help"), vec![]),
        (none(&format!("estimate {RIM} --density 260 --quick")), vec![]),
        (none(&format!("batch {scans} --dry-run")), vec![]),
        (line(&format!("inspect {SCAN} --json --out"), &file("a.png")), vec![file("a.png")]),
        (line(DRAPE, &file("a.obj")), vec![file("a.obj")]),
        (line(&batch, &file("out")), vec![file("out/results.csv")]),
    ]
}

#[test]
fn a_full_disk_is_a_failure_with_a_message() {
    let Ok(full) = File::options().write(true).open("/dev/full") else {
        eprintln!("skipped: no /dev/full");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for (arguments, files) in commands(folder.path()) {
        let given: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let run = program(&given).stdout(full.try_clone().unwrap()).output().unwrap();
        let said = said(&run);
        assert_eq!(run.status.code(), Some(1), "{arguments:?}: {said}");
        assert_eq!(said.matches("stdout cannot be written").count(), 1, "{arguments:?}: {said}");
        assert!(said.contains("No space left") && !said.contains("panicked"), "{said}");
        assert!(files.iter().all(|file| file.is_file()), "{arguments:?}: not written");
    }
    // A result on a full disk.
    if let Some([_, full]) = devices(folder.path()).null_and_full {
        let run = program(&["boundary", SCAN, "-o", full.to_str().unwrap()]).output().unwrap();
        assert_eq!(run.status.code(), Some(1));
        assert!(said(&run).contains("full: cannot be written (No space left"), "{}", said(&run));
    }
}

#[test]
fn a_reader_that_goes_ends_the_command_quietly() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, files) in commands(folder.path()) {
        let given: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let mut child =
            program(&given).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let run = child.wait_with_output().unwrap();
        let said = said(&run);
        assert_eq!(run.status.code(), Some(0), "{arguments:?}: {said}");
        assert!(!said.contains("panicked") && !said.contains("pipe"), "{arguments:?}: {said}");
        assert!(files.iter().all(|file| file.is_file()), "{arguments:?}: not written");
    }
    // A result into a pipe that nobody reads.
    let stdout = devices(folder.path()).stdout;
    let mut child = program(&["boundary", SCAN, "-o", stdout.to_str().unwrap()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let run = child.wait_with_output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
}

#[test]
fn what_cannot_be_said_on_stderr_is_lost_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let rim = folder.path().join("rim.csv");
    let drape = folder.path().join("drape.obj");
    let writes = [&words(DRAPE)[..], &[drape.to_str().unwrap()]].concat();
    let writes = [&writes[..], &["--boundary", rim.to_str().unwrap()]].concat();
    let fails = ["inspect", "missing.ply"];
    for (arguments, code) in [(&writes[..], 0), (&fails, 1)] {
        let mut closed = program::shielded("sh");
        closed.current_dir(env!("CARGO_MANIFEST_DIR"));
        closed.args(["-c", "exec \"$@\" 2>&- >&-", "sh", program::PATH]);
        let run = closed.args(arguments).output().unwrap();
        assert_eq!(run.status.code(), Some(code), "closed: {arguments:?}");
        let mut gone = program(arguments).stderr(Stdio::piped()).spawn().unwrap();
        drop(gone.stderr.take());
        assert_eq!(gone.wait().unwrap().code(), Some(code), "gone: {arguments:?}");
        if let Ok(full) = File::options().write(true).open("/dev/full") {
            let run = program(arguments).stderr(full).status().unwrap();
            assert_eq!(run.code(), Some(code), "full: {arguments:?}");
        }
        assert_eq!(fs::read_to_string(&rim).unwrap().lines().count(), 245);
    }
}

#[test]
fn devices_and_pipes_take_results_and_stay_what_they_are() {
    use std::os::unix::fs::FileTypeExt as _;
    let folder = tempfile::tempdir().unwrap();
    let devices = devices(folder.path());
    if let Some([null, _]) = devices.null_and_full {
        let run = program(&[words(DRAPE), vec![null.to_str().unwrap()]].concat()).output().unwrap();
        assert_eq!(run.status.code(), Some(0), "{}", said(&run));
        assert!(fs::metadata(null).unwrap().file_type().is_char_device());
    }

    let stdout = devices.stdout.to_str().unwrap();
    let run = program(&["boundary", SCAN, "-o", stdout]).output().unwrap();
    assert!(fs::symlink_metadata(stdout).unwrap().is_symlink());
    let rim = String::from_utf8(run.stdout).unwrap();
    assert!(rim.starts_with("index,side,x_mm"), "{rim}");
    assert_eq!(rim.lines().count(), 245);

    // A redirected file holds the drape alone: the report makes room for it.
    let path = folder.path().join("drape.obj");
    let arguments = [words(DRAPE), vec![stdout]].concat();
    let run = program(&arguments).stdout(File::create(&path).unwrap()).output().unwrap();
    let obj = fs::read_to_string(&path).unwrap();
    assert!(said(&run).contains("folds"), "{}", said(&run));
    assert!(obj.lines().all(|line| line.starts_with(['#', 'v', 'f'])), "{obj}");
    assert_eq!(obj.lines().filter(|line| line.starts_with('v')).count(), 21 * 21);

    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read_to_string(pipe).unwrap()
    });
    let run = program(&["boundary", SCAN, "-o", pipe.to_str().unwrap()]).output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert_eq!(reader.join().unwrap(), rim);
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
}

/// The program as an interactive shell starts it: a script's background has the signal
/// ignored.
#[cfg(target_os = "linux")]
fn interruptible(arguments: &[&str]) -> Command {
    let mut command = program::shielded("env");
    command.args(["--default-signal=INT", program::PATH]);
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[cfg(target_os = "linux")]
fn interrupt(mut child: Child) -> (Option<i32>, String) {
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(signal.unwrap().success());
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    (child.wait().unwrap().code(), said)
}

/// Waits until a file whose name ends so is in a folder; false if the child ended first.
#[cfg(target_os = "linux")]
fn appears(ending: &str, folder: &Path, child: &mut Child) -> bool {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if names(folder).iter().any(|name| name.ends_with(ending)) {
            return true;
        }
        assert!(start.elapsed() < Duration::from_secs(300), "no {ending} in five minutes");
        std::thread::sleep(Duration::from_micros(200));
    }
    false
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_writer_leaves_no_part() {
    let folder = tempfile::tempdir().unwrap();
    let drape = folder.path().join("drape.obj");
    let run = program(&[words(DRAPE), vec![drape.to_str().unwrap()]].concat()).output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let cloud = folder.path().join("cloud.ply");
    // Writing takes about 0.1 s for each million of points; more of them if it was missed.
    let caught_writing = [2, 4, 8, 16].into_iter().any(|millions| {
        let even = format!("{millions}000000");
        let paths = [drape.to_str().unwrap(), cloud.to_str().unwrap()];
        let arguments = ["augment", paths[0], "--even", &even, "--out", paths[1]];
        let mut child = interruptible(&arguments).spawn().unwrap();
        if !appears("cloud.ply.part", folder.path(), &mut child) {
            return false;
        }
        let (code, said) = interrupt(child);
        if code == Some(0) {
            return false;
        }
        assert_eq!(code, Some(130), "{said}");
        assert!(said.contains("interrupted"), "{said}");
        let left = names(folder.path());
        assert!(left.iter().all(|name| !name.ends_with(".part")), "{left:?}");
        // What was finished between the look and the signal stays.
        let finished = cloud.exists();
        if !finished {
            assert_eq!(left, ["drape.obj"]);
        }
        !finished
    });
    assert!(caught_writing, "16 million points are written before a signal comes");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_of_generate_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("drapes");
    let line = "generate --prior measured --count 2 --threads 1 --seed 3 --out";
    let arguments = [words(line), vec![out.to_str().unwrap()]].concat();
    let mut child = interruptible(&arguments).spawn().unwrap();
    assert!(appears(".partial", &out, &mut child), "a run of one file keeps no rows");
    let (code, said_at_end) = interrupt(child);
    assert_eq!(code, Some(130), "{said_at_end}");
    assert!(said_at_end.contains("the same command continues from there"), "{said_at_end}");
    let mut left = names(&out);
    left.sort();
    assert_eq!(left, ["README.md", "drapes-000000.partial", "manifest.json"]);
    let run = program(&arguments).output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let said = said(&run);
    assert!(
        said.contains("1 drapes made") && said.contains("1 kept from an interrupted"),
        "{said}"
    );
    let mut left = names(&out);
    left.sort();
    assert_eq!(left, ["README.md", "drapes-000000.parquet", "manifest.json"]);
}

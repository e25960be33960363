//! The main job on the committed scans, each done once for all tests of this program.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::program;
use scan2params::base::Boundary;
use scan2params::io::boundary_csv;
use scan2params::sensor::Truth;
use serde_json::Value;

/// The committed scans, with the drape that each shows.
pub const SCANS: [(&str, &str); 3] = [
    ("mean_structured-light", "mean"),
    ("stiff_structured-light", "stiff"),
    ("mean_truedepth", "mean"),
];

/// What the program has written of a scan.
pub struct Job {
    /// The fabric's truth.
    pub truth: Value,
    /// The params.json, which is what was printed.
    pub result: Value,
    /// The rim's file.
    pub rim: Boundary,
    /// Width of the picture \[pixels\].
    pub picture_width: u32,
}

pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

pub fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The true warp direction of a virtual scan, in the scan's frame.
pub fn warp_of(scan: &str) -> [f64; 3] {
    let truth: Truth =
        serde_json::from_value(json(&fixture(&format!("scans/{scan}.truth.json")))).unwrap();
    let inverse = truth.simulation_from_scanner.inverse();
    (inverse * nalgebra::Vector3::x()).into()
}

/// The job of one of [`SCANS`] with `--quick`, its released drape included.
pub fn job(scan: &str) -> &'static Job {
    static JOBS: [OnceLock<Job>; SCANS.len()] = [const { OnceLock::new() }; SCANS.len()];
    let at = SCANS.iter().position(|(name, _)| *name == scan).expect("a committed scan");
    JOBS[at].get_or_init(|| done(scan, SCANS[at].1))
}

fn done(scan: &str, drape: &str) -> Job {
    let truth = json(&fixture(&format!("drapes/{drape}.params.json")));
    let density = truth["density"]["value"].as_f64().unwrap().to_string();
    let warp = warp_of(scan).map(|v| v.to_string()).join(",");
    let (input, out) = (fixture(&format!("scans/{scan}.ply")), tempfile::tempdir().unwrap());
    let mut program = program::program();
    program.arg(&input).args(["--density", &density, "--warp-toward", &warp]);
    program.args(["--quick", "--strict", "--json", "--out"]).arg(out.path());
    let run = program.output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{scan}: {}", String::from_utf8_lossy(&run.stderr));
    let result = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(json(&out.path().join(format!("{scan}.params.json"))), result);
    let rim = boundary_csv::read(out.path().join(format!("{scan}.boundary.csv"))).unwrap();
    let picture = image::open(out.path().join(format!("{scan}.boundary.png"))).unwrap();
    Job { truth, result, rim, picture_width: picture.width() }
}

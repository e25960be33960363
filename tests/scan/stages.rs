//! Whoever times the scan's stages times all of them: the bench and the comparison with other
//! libraries leave none out.

use std::collections::BTreeSet;
use std::path::Path;

use scan2params::base::clock::Stages;
use scan2params::intake::rim;
use scan2params::io::ReadOptions;
use scan2params::scan::{ScanOptions, WarpToward};

/// What stands in double quotes in the part of a file from `begin` to `end`.
fn quoted(file: &str, begin: &str, end: &str) -> Vec<String> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    let (_, rest) = text.split_once(begin).unwrap_or_else(|| panic!("{file} has no {begin}"));
    let (part, _) = rest.split_once(end).unwrap_or_else(|| panic!("{file}: no end of {begin}"));
    part.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_bench_and_the_peers_table_leave_no_stage_out() {
    let scan =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans/mean_structured-light.ply");
    let warp_toward = Some(WarpToward::Direction([-1.0, 0.0, 0.0]));
    let options = ScanOptions { warp_toward, ..ScanOptions::default() };
    let mut stages = Stages::start();
    rim::of_scan_in_stages(&scan, &ReadOptions::default(), &options, &mut stages).unwrap();
    let names: BTreeSet<&str> = stages.noted().iter().map(|stage| stage.name).collect();
    assert!(names.len() > 10 && names.contains("read"), "{names:?}");
    for (file, begin, end) in
        [("benches/scan.rs", "const PARTS", "];"), ("scripts/peers/table.py", "OURS = {", "\n}")]
    {
        let known = quoted(file, begin, end);
        for name in &names {
            // the bench reads its file once, before
            let times = known.iter().filter(|k| k == name).count();
            let wanted = usize::from(!(*name == "read" && file.starts_with("benches")));
            // rows of the table and of the bench may have a stage's name
            let rows = ["read", "voxel", "plane", "rim"].contains(name);
            assert!(times == wanted || (times > 0 && rows), "{file} has {name} {times} times");
        }
    }
}

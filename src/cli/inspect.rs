//! `inspect` and `boundary`: what is found in a scan.

use anyhow::anyhow;

use super::{Failure, Outcome, args};
use scan2params::io::{ReadNotes, boundary_csv};
use scan2params::job::{rim, verdict};
use scan2params::report::{files, inspection, json, table, verdict as words};
use scan2params::scan::ScannedBoundary;

pub(crate) fn inspect(given: &args::Inspect) -> Outcome {
    let (scanned, notes) = rim_of(&given.scan)?;
    let options = given.scan.read.options();
    let said = verdict::of_scan(&scanned, &options);
    eprint!("{}", table::notes(&notes));
    if given.json {
        let mut found = json::quality(&scanned);
        found["verdict"] = serde_json::to_value(&said)?;
        println!("{}", serde_json::to_string_pretty(&found)?);
    } else {
        print!("{}{}", words::lines(&said), table::scan(&scanned));
    }
    if let Some(path) = &given.out {
        files::picture(path, &inspection::draw(&scanned))?;
        eprintln!("wrote {}", path.display());
    }
    Failure::of_verdict(&given.scan.input, &said, false)
}

pub(crate) fn boundary(given: &args::Boundary) -> Outcome {
    let (scanned, _) = rim_of(&given.scan)?;
    boundary_csv::write_oriented(&given.out, &scanned.boundary, scanned.orientation)?;
    let said = verdict::of_scan(&scanned, &given.scan.read.options());
    eprint!("{}{}", words::lines(&said), table::scan(&scanned));
    eprintln!("wrote {}", given.out.display());
    Failure::of_verdict(&given.scan.input, &said, false)
}

/// The rim of a scan; a file that holds a rim already is no scan.
fn rim_of(scan: &args::ScanFlags) -> Result<(ScannedBoundary, ReadNotes), Failure> {
    let path = &scan.input;
    if boundary_csv::is_one(path) {
        let why = "holds a rim already; `estimate` takes it as it is";
        return Err(Failure::usage(anyhow!("{}: {why}", path.display())));
    }
    rim::of_scan(path, &scan.read.read()?, &scan.read.options()).map_err(Failure::of_job)
}

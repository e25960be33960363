//! `inspect` and `boundary`: what is found in a scan.

use anyhow::anyhow;

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::io::{ReadNotes, boundary_csv, output};
use scan2params::job::{rim, verdict};
use scan2params::report::{files, inspection, json, table, verdict as words};
use scan2params::scan::ScannedBoundary;

pub(crate) fn inspect(given: &args::Inspect) -> Outcome {
    if let Some(path) = &given.out {
        output::check_file(path, &given.scan.files()).map_err(Failure::of_output)?;
    }
    let (scanned, notes) = rim_of(&given.scan)?;
    let options = given.scan.read.options();
    let said = verdict::of_scan(&scanned, &options);
    eprint!("{}", table::notes(&notes));
    let found = format!("{}{}", words::lines(&said), table::scan(&scanned));
    if given.out.as_deref().is_some_and(output::is_stdout) {
        eprint!("{found}");
    } else if given.json {
        let mut found = json::quality(&scanned);
        found["verdict"] = serde_json::to_value(&said)?;
        println!("{}", serde_json::to_string_pretty(&found)?);
    } else {
        print!("{found}");
    }
    if let Some(path) = &given.out {
        files::picture(path, &inspection::draw(&scanned))?;
        eprintln!("wrote {}", path.display());
    }
    Failure::of_verdict(&given.scan.input, &said, false)
}

pub(crate) fn boundary(given: &args::Boundary) -> Outcome {
    output::check_file(&given.out, &given.scan.files()).map_err(Failure::of_output)?;
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
    let _working = Working::on(format!("looking for the rim in {}", path.display()));
    rim::of_scan(path, &scan.read.read()?, &scan.read.options()).map_err(Failure::of_job)
}

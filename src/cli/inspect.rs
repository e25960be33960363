//! `inspect` and `boundary`: what is found in a scan.

use anyhow::anyhow;

use super::{Failure, Outcome, args};
use scan2params::io::{ReadNotes, boundary_csv};
use scan2params::job::{JobError, rim};
use scan2params::report::{inspection, json, table};
use scan2params::scan::ScannedBoundary;

pub(crate) fn inspect(given: &args::Inspect) -> Outcome {
    let (scanned, notes) = match rim_of(&given.scan)? {
        Ok(found) => found,
        Err(error) => return Err(refused(error, given)?),
    };
    eprint!("{}", table::notes(&notes));
    if given.json {
        println!("{}", serde_json::to_string_pretty(&json::quality(&scanned))?);
    } else {
        print!("{}", table::scan(&scanned));
    }
    if let Some(path) = &given.out {
        inspection::draw(&scanned).save(path)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// Shows what was found in a scan that gives no rim, and hands the failure on.
fn refused(error: JobError, given: &args::Inspect) -> Result<Failure, Failure> {
    if let JobError::Refused { source, found, .. } = &error {
        for line in inspection::figures(found) {
            eprintln!("found: {line}");
        }
        if let Some(path) = &given.out {
            inspection::draw_refused(found, source).save(path)?;
            eprintln!("wrote {}", path.display());
        }
    }
    Ok(Failure::of_job(error))
}

pub(crate) fn boundary(given: &args::Boundary) -> Outcome {
    let (scanned, _) = rim_of(&given.scan)?.map_err(Failure::of_job)?;
    boundary_csv::write(&given.out, &scanned.boundary)?;
    eprint!("{}", table::scan(&scanned));
    eprintln!("wrote {}", given.out.display());
    Ok(())
}

/// The rim of a scan, or why there is none; a file that holds a rim already is no scan.
type Found = Result<(ScannedBoundary, ReadNotes), JobError>;

fn rim_of(scan: &args::ScanFlags) -> Result<Found, Failure> {
    let path = &scan.input;
    if boundary_csv::is_one(path) {
        let why = "holds a rim already; `estimate` takes it as it is";
        return Err(Failure::usage(anyhow!("{}: {why}", path.display())));
    }
    Ok(rim::of_scan(path, &scan.read.read()?, &scan.read.options()?))
}

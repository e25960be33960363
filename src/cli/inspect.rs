//! `inspect` and `boundary`: what is found in a scan.

use anyhow::anyhow;

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::intake::{IntakeError, rim};
use scan2params::io::{ReadNotes, boundary_csv, output};
use scan2params::job::verdict;
use scan2params::report::json::Inspected;
use scan2params::report::{files, inspection, table, verdict as words};
use scan2params::scan::{ScanOptions, ScannedBoundary};
use scan2params::terminal::flags::ScanFlags;

pub(crate) fn inspect(given: &args::Inspect) -> Outcome {
    if let Some(path) = &given.out {
        output::check_named(path, &[files::PICTURE], &given.scan.files())
            .map_err(Failure::of_output)?;
    }
    let options = given.scan.read.options()?;
    let (scanned, notes) = match rim_of(&given.scan, &options)? {
        Ok(found) => found,
        Err(error) => return Err(refused(error, given)?),
    };
    let said = verdict::of_scan(&scanned, &options);
    eprint!("{}", table::notes(&notes));
    let found = format!("{}{}", words::lines(&said), table::scan(&scanned));
    if given.out.as_deref().is_some_and(output::is_stdout) {
        eprint!("{found}");
    } else if given.json {
        let found = Inspected::of(&scanned, &notes, said.clone());
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

/// Shows what was found in a scan that gives no rim, and hands the failure on.
fn refused(error: IntakeError, given: &args::Inspect) -> Result<Failure, Failure> {
    if let IntakeError::Refused { source, found, .. } = &error {
        for line in inspection::figures(found) {
            eprintln!("found: {line}");
        }
        if let Some(path) = &given.out {
            files::picture(path, &inspection::draw_refused(found, source))?;
            eprintln!("wrote {}", path.display());
        }
    }
    Ok(Failure::of_job(error))
}

pub(crate) fn boundary(given: &args::Boundary) -> Outcome {
    let files = given.scan.files();
    output::check_named(&given.out, &[".csv"], &files).map_err(Failure::of_output)?;
    let options = given.scan.read.options()?;
    let (scanned, notes) = rim_of(&given.scan, &options)?.map_err(Failure::of_job)?;
    boundary_csv::write_oriented(&given.out, &scanned.boundary, scanned.orientation)?;
    let said = verdict::of_scan(&scanned, &options);
    eprint!("{}{}{}", table::notes(&notes), words::lines(&said), table::scan(&scanned));
    eprintln!("wrote {}", given.out.display());
    Failure::of_verdict(&given.scan.input, &said, false)
}

/// The rim of a scan, or why there is none; a file that holds a rim already is no scan.
type Found = Result<(ScannedBoundary, ReadNotes), IntakeError>;

fn rim_of(scan: &ScanFlags, options: &ScanOptions) -> Result<Found, Failure> {
    let path = &scan.input;
    if scan.format.is_none() && boundary_csv::is_one(path) {
        let why = "holds a rim already; `estimate` takes it as it is";
        return Err(Failure::usage(anyhow!("{}: {why}", path.display())));
    }
    let _working = Working::on(format!("looking for the rim in {}", path.display()));
    Ok(rim::of_scan(path, &scan.read_options()?, options))
}

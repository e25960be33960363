//! `inspect` and `boundary`: what is found in a scan.

use super::{Failure, Outcome, args};
use crate::io::boundary_csv;
use crate::report::{json, rim, table};
use crate::scan::picture;

pub(crate) fn inspect(given: &args::Inspect) -> Outcome {
    let (scanned, notes) =
        rim::of_scan(&given.scan.input, &given.scan.read.read()?, &given.scan.read.options())
            .map_err(Failure::of_job)?;
    eprint!("{}", table::notes(&notes));
    if given.json {
        println!("{}", serde_json::to_string_pretty(&json::quality(&scanned))?);
    } else {
        print!("{}", table::scan(&scanned));
    }
    if let Some(path) = &given.out {
        picture::draw(&scanned).save(path)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

pub(crate) fn boundary(given: &args::Boundary) -> Outcome {
    let (scanned, _) =
        rim::of_scan(&given.scan.input, &given.scan.read.read()?, &given.scan.read.options())
            .map_err(Failure::of_job)?;
    boundary_csv::write(&given.out, &scanned.boundary)?;
    eprint!("{}", table::scan(&scanned));
    eprintln!("wrote {}", given.out.display());
    Ok(())
}

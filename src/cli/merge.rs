//! `merge`: views or passes of one drape as one cloud.

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::intake::joined;
use scan2params::io::{output, write_ply};
use scan2params::report::table;

pub(crate) fn merge(given: &args::Merge) -> Outcome {
    output::check_named(&given.out, &[".ply"], &given.scan.files()).map_err(Failure::of_output)?;
    let (read, options) = (given.scan.read_options()?, given.scan.read.options()?);
    let working = Working::on(format!("registering {}", given.scan.input.display()));
    let (cloud, notes) =
        joined::read(&given.scan.input, &read, &options).map_err(Failure::of_job)?;
    drop(working);
    write_ply(&given.out, &cloud, 1.0)?;
    if !notes.views.is_empty() {
        print!("{}", table::by_view(&notes.views));
    }
    eprint!("{}", table::notes(&notes));
    eprintln!("wrote {}", given.out.display());
    Ok(())
}

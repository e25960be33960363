//! `combine`: repeated drapes of one fabric.

use super::{Failure, Outcome, args};
use scan2params::combine::{self, CombineError};
use scan2params::io::{self, output};
use scan2params::job::FailureKind;

pub(crate) fn run(given: &args::Combine) -> Outcome {
    let files = combine::files(&given.inputs)?;
    if let Some(path) = &given.out {
        output::check_named(path, &[".json"], &files).map_err(Failure::of_output)?;
    }
    let drapes: Vec<_> = files.iter().map(|file| combine::read(file)).collect::<Result<_, _>>()?;
    let found = combine::combine(drapes).map_err(|error| match error {
        CombineError::Densities { .. } | CombineError::Versions { .. } => Failure::usage(error),
        CombineError::NothingLeft { .. } => Failure::of_kind(FailureKind::Refused, error),
        other => Failure::from(other),
    })?;
    let json = combine::json(&found);
    if given.json {
        println!("{}", serde_json::to_string_pretty(&json)?);
    } else {
        print!("{}", combine::table(&found));
    }
    if let Some(path) = &given.out {
        io::atomically(path, |out| {
            serde_json::to_writer_pretty(&mut *out, &json)?;
            writeln!(out)
        })?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

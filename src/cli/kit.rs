//! `kit`: what is needed to make the experiment.

use super::{Failure, Outcome, args};
use scan2params::io::output;
use scan2params::kit::{self, Kind, Mark};

pub(crate) fn run(given: &args::Kit) -> Outcome {
    output::check_folder(&given.out).map_err(Failure::of_output)?;
    let kind = match given.bench {
        args::KitBench::Square => Kind::Square,
        args::KitBench::Cusick => Kind::Cusick,
    };
    let (name, color) = given.mark.clone();
    let written = kit::write(&kit::files(kind, &Mark { name, ink: color.0 }), &given.out)?;
    for path in &written {
        println!("{}", path.display());
    }
    eprintln!("start with {}", given.out.join("protocol.html").display());
    Ok(())
}

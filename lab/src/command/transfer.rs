//! `scan2params-lab transfer`: found fabrics in experiments that the fit has not seen.

use super::{Failure, Outcome, args};
use scan2params::estimate::Estimator;
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params::refine::FitOptions;
use scan2params::report::files;
use scan2params::sim::Fall;
use scan2params_lab::evaluate::refine::{Begin, Series, Sight};
use scan2params_lab::evaluate::transfer::table::{self, Lengths, Row};
use scan2params_lab::evaluate::transfer::{self, Keep, Transferred, pictures};

pub(super) fn run(given: &args::Transfer) -> Outcome {
    let named = |name: &String| Mixture::named(name).map_err(Failure::usage);
    let sight = |name: &String| Sight::named(name).map_err(Failure::usage);
    let estimator = Estimator::shipped()?;
    output::check_folder(&given.keep).map_err(Failure::of_output)?;
    std::fs::create_dir_all(&given.keep)?;
    let series = Series {
        priors: given.priors.iter().map(named).collect::<Result<_, _>>()?,
        anywhere: false,
        sights: given.profiles.iter().map(sight).collect::<Result<_, _>>()?,
        estimator: &estimator,
        begin: Begin::Network,
        options: FitOptions::default(),
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(given.count),
        drops: 1,
        fall: Fall::Perturbed,
        truth_vertices: given.truth_vertices as usize,
        energy_drop: 0.0,
        keep: Some(given.keep.clone()),
    };
    let keep = Keep { folder: &given.keep, only: given.kept };
    let all = transfer::run(&series, given.drops, keep, tell)?;
    let (rows, lengths) = (table::rows(&all), table::lengths(&all));
    println!("\n{}", Row::COLUMNS);
    rows.iter().for_each(|row| println!("{}", row.line()));
    println!("\n{}", Lengths::COLUMNS);
    lengths.iter().for_each(|row| println!("{}", row.line()));
    if given.pictures > 0 {
        for (name, image) in pictures::worst(&all, given.pictures) {
            files::picture(&given.keep.join(name), &image)?;
        }
    }
    if given.json {
        println!("{}", serde_json::to_string(&(rows, lengths))?);
    }
    Ok(())
}

/// One line a fabric, as it ends.
fn tell(fabric: &Transferred) {
    let rest = |(shape, sheets): (&str, usize)| format!("{shape} {sheets}");
    let tried = fabric.tried.iter().map(|t| rest((t.shape.name(), t.truth.len())));
    println!(
        "{} {}: {} found, {} refused; true sheets at rest: {}",
        fabric.prior,
        fabric.index,
        fabric.found.len(),
        fabric.refused.len(),
        tried.collect::<Vec<_>>().join(", ")
    );
}

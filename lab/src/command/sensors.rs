//! `scan2params-lab sensors`: the estimate by drop, sensor and network.

use super::estimate::estimator;
use super::{Failure, Outcome, args};
use scan2params::estimate::Estimator;
use scan2params::fabric::Mixture;
use scan2params::sim::NUMERICS_VERSION;
use scan2params_lab::evaluate::estimate as held_out;
use scan2params_lab::evaluate::refine::Sight;
use scan2params_lab::evaluate::sensors::{Cell, Sweep};

pub(super) fn run(given: &args::Sensors) -> Outcome {
    let prior = Mixture::named(&given.prior).map_err(Failure::usage)?;
    let sight = |name: &String| Sight::named(name).map_err(Failure::usage);
    let mut estimators = vec![Estimator::shipped()?];
    for onnx in &given.model {
        estimators.push(estimator(Some(onnx))?);
    }
    for own in &estimators {
        held_out::check_unseen(own, prior.name(), given.seed, NUMERICS_VERSION)
            .map_err(Failure::usage)?;
    }
    let sweep = Sweep {
        prior,
        fabrics: given.first..given.first.saturating_add(given.count),
        seed: given.seed,
        sights: given.profiles.iter().map(sight).collect::<Result<_, _>>()?,
        estimators: &estimators,
    };
    let draped = sweep.run(|draped| eprintln!("{}", draped.told()))?;
    let cells = sweep.cells(&draped);
    println!("{}", Cell::COLUMNS);
    for cell in &cells {
        println!("{}", cell.row());
    }
    if given.json {
        println!("{}", serde_json::to_string(&cells)?);
    }
    Ok(())
}

//! `scan2params-lab redrape`: fabrics that fall again with what is estimated from their rims.

use super::estimate::estimator;
use super::{Failure, Outcome, args};
use scan2params::dataset::read_folder;
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params::refine::FitOptions;
use scan2params::report::files;
use scan2params::sim::{Fall, SimOptions};
use scan2params_lab::evaluate::estimate::converged;
use scan2params_lab::evaluate::linear::Linear;
use scan2params_lab::evaluate::redrape::{self, Comparison, Redraped, Tally};
use scan2params_lab::evaluate::refine::{Begin, Series, Sight};

pub(super) fn run(given: &args::Redrape) -> Outcome {
    let prior = Mixture::named(&given.prior).map_err(Failure::usage)?;
    let estimator = estimator(given.model.as_deref())?;
    if let Some(folder) = &given.out {
        output::check_folder(folder).map_err(Failure::of_output)?;
        std::fs::create_dir_all(folder)?;
    }
    let linear = match &given.train {
        Some(folder) => Some(Linear::fit(&converged(read_folder(folder)?)?, &prior)?),
        None => None,
    };
    let vertices = SimOptions::default().vertices;
    let usual = FitOptions::default();
    let series = Series {
        priors: vec![prior],
        anywhere: false,
        sights: vec![Sight::Rim],
        estimator: &estimator,
        begin: Begin::Network,
        options: FitOptions { vertices: [vertices; 2], ..usual },
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(given.count),
        drops: 1,
        fall: Fall::Canonical,
        truth_vertices: vertices,
        energy_drop: given.energy_drop,
        keep: None,
    };
    if let Some(linear) = &linear {
        println!("linear regression on {} drapes", linear.rows);
    }
    println!("{}", Redraped::COLUMNS);
    let (refine, off) = (given.refine, given.off.map(|percent| percent / 100.0));
    let comparison = Comparison { linear: linear.as_ref(), refine, off };
    let cases = redrape::run(&series, &comparison, |case| println!("{}", case.row()))?;
    let tallies = Tally::all(&cases);
    println!("\n{}", Tally::COLUMNS);
    for tally in &tallies {
        println!("{}", tally.row());
    }
    if let Some(folder) = &given.out {
        files::picture(&folder.join("redrape.png"), &redrape::histogram(&cases))?;
    }
    if given.json {
        println!("{}", serde_json::to_string(&tallies)?);
    }
    Ok(())
}

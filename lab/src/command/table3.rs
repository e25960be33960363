//! `scan2params-lab table3`: the paper's Table 3 beside ours.

use std::path::Path;

use super::Outcome;
use super::estimate::unseen;
use scan2params::estimate::Estimator;
use scan2params::fabric::{Fabric, Mixture};
use scan2params_lab::evaluate::estimate::{self as held_out, Answer, Scores};
use scan2params_lab::evaluate::table3::{self, Line};

pub(super) fn run(drapes: Option<&Path>, as_json: bool) -> Outcome {
    let estimator = Estimator::shipped()?;
    let mut lines = table3::lines(estimator.model());
    if let Some(folder) = drapes {
        let rows = held_out::converged(unseen(&estimator, folder)?)?;
        let answers: Vec<Answer> =
            rows.iter().map(|row| held_out::answer(&estimator, row)).collect::<Result<_, _>>()?;
        let truths: Vec<Fabric> = rows.iter().map(|row| row.fabric).collect();
        let limits = Mixture::named(&estimator.model().prior)?.limits();
        let scores = Scores::of(&truths, &answers, limits);
        lines.push(table3::measured(estimator.model(), &folder.display().to_string(), &scores));
    }
    if as_json {
        println!("{}", serde_json::to_string_pretty(&lines)?);
        return Ok(());
    }
    println!("{}", Line::COLUMNS);
    for line in &lines {
        println!("{}", line.row());
    }
    Ok(())
}

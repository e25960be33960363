//! `scan2params-lab altered`: scans of what is not quite the experiment, through the main job.

use anyhow::anyhow;

use super::profile::profile;
use super::{Failure, Outcome, args};
use scan2params::estimate::Estimator;
use scan2params_lab::evaluate::altered::table::Group;
use scan2params_lab::evaluate::altered::{Alteration, Record, Series};
use scan2params_lab::evaluate::scenes::drapes::KeptDrape;

pub(super) fn run(given: &args::Altered) -> Outcome {
    let kind = |name: &String| {
        Alteration::named(name).ok_or_else(|| {
            let names = Alteration::ALTERED.map(Alteration::name).join(", ");
            Failure::usage(anyhow!("no alteration `{name}`: give valid, or some of {names}"))
        })
    };
    let alterations = match &given.only[..] {
        [] => Alteration::ALTERED.to_vec(),
        names => names.iter().map(kind).collect::<Result<Vec<_>, _>>()?,
    };
    let sensors = given.sensors.iter().map(|name| profile(name)).collect::<Result<Vec<_>, _>>()?;
    if sensors.is_empty() {
        return Err(Failure::usage(anyhow!("--sensors names none")));
    }
    let series = Series {
        sensors,
        folder: given.drapes.clone(),
        drapes: KeptDrape::all(&given.drapes)?,
        alterations,
        seed: given.seed,
        scans: given.first..given.first.saturating_add(given.count),
    };
    println!("{}", Record::COLUMNS);
    let records = series.run(&Estimator::shipped()?, |record| println!("{}", record.row()))?;
    println!("\n{}", Group::COLUMNS);
    Group::all(&records).iter().for_each(|group| println!("{}", group.row()));
    Ok(())
}

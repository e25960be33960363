//! `scan2params-lab views`: views that miss each other, brought together.

use super::profile::profile;
use super::{Outcome, args};
use scan2params_lab::evaluate::scenes::drapes::KeptDrape;
use scan2params_lab::evaluate::views::{Group, Record, Series};

pub(super) fn run(given: &args::Views) -> Outcome {
    let sensors = given.sensors.iter().map(|name| profile(name)).collect::<Result<Vec<_>, _>>()?;
    let series = Series {
        sensors,
        drapes: KeptDrape::all(&given.drapes)?,
        seed: given.seed,
        turntable: given.turntable,
        scenes: given.first..given.first.saturating_add(given.count),
    };
    println!("{}", Record::COLUMNS);
    let records = series.run(|record| println!("{}", record.row()))?;
    println!("\n{}", Group::COLUMNS);
    Group::all(&records).iter().for_each(|group| println!("{}", group.row()));
    if given.json {
        println!("{}", serde_json::to_string(&records)?);
    }
    Ok(())
}

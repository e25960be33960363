//! `evaluate views`: views that miss each other, brought together.

use super::super::augment::profile;
use super::super::{Outcome, args};
use scan2params::evaluate::scenes::drapes::KeptDrape;
use scan2params::evaluate::views::{Record, Series};

pub(super) fn run(given: &args::Views) -> Outcome {
    let sensors = given.sensors.iter().map(|name| profile(name)).collect::<Result<Vec<_>, _>>()?;
    let series = Series {
        sensors,
        drapes: KeptDrape::all(&given.drapes)?,
        seed: given.seed,
        scenes: given.first..given.first.saturating_add(given.count),
    };
    println!("{}", Record::COLUMNS);
    let records = series.run(|record| println!("{}", record.row()))?;
    let of = |outcome: &str| records.iter().filter(|record| record.outcome() == outcome).count();
    let [within, named, beyond] = ["within", "named", "beyond"].map(of);
    println!(
        "\nof {}: {within} within their figure, {beyond} beyond it, {named} with parts named as unfit",
        records.len()
    );
    if given.json {
        println!("{}", serde_json::to_string(&records)?);
    }
    Ok(())
}

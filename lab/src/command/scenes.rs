//! `scan2params-lab scenes`: scenes drawn blind through the scan path.

use anyhow::anyhow;

use super::profile::profile;
use super::{Failure, Outcome, args};
use scan2params::io::output;
use scan2params_lab::evaluate::scenes::drapes::{Filled, Filling, KeptDrape};
use scan2params_lab::evaluate::scenes::table::{Group, Moved, Named};
use scan2params_lab::evaluate::scenes::{Record, Series};

pub(super) fn run(given: &args::Scenes) -> Outcome {
    let folder = &given.drapes;
    output::check_folder(folder).map_err(Failure::of_output)?;
    if let Some(count) = given.make_drapes {
        return fill(given, count);
    }
    if let Some(write) = &given.write {
        output::check_folder(write).map_err(Failure::of_output)?;
    }
    let sensors = given.sensors.iter().map(|name| profile(name)).collect::<Result<Vec<_>, _>>()?;
    if sensors.is_empty() {
        return Err(Failure::usage(anyhow!("--sensors names none")));
    }
    let series = Series {
        sensors,
        drapes: KeptDrape::all(folder)?,
        seed: given.seed,
        scenes: given.first..given.first.saturating_add(given.count),
        broken: given.broken,
        invariance: given.invariance,
        relaxed: given.relaxed,
        write: given.write.clone(),
    };
    println!("{}", Record::COLUMNS);
    let records = series.run(|record| println!("{}", record.row()))?;
    println!("\n{}", Group::COLUMNS);
    let groups = Group::all(&records);
    groups.iter().for_each(|group| println!("{}", group.row()));
    let named = Named::all(&records);
    if !named.is_empty() {
        println!("\n{}", Named::COLUMNS);
        named.iter().for_each(|named| println!("{}", named.row()));
    }
    let moved = Moved::all(&records);
    if !moved.is_empty() {
        println!("\n{}", Moved::COLUMNS);
        moved.iter().for_each(|moved| println!("{}", moved.row()));
    }
    if given.json {
        println!("{}", serde_json::to_string(&records)?);
    }
    Ok(())
}

/// Makes the drapes that are missing.
fn fill(given: &args::Scenes, count: u64) -> Outcome {
    let filling = Filling {
        folder: given.drapes.clone(),
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(count),
        vertices: given.vertices as usize,
    };
    let word = |filled| match filled {
        Filled::Kept => "was there",
        Filled::Made => "made",
        Filled::Failed => "did not come to rest, or crosses itself",
    };
    let filled = filling.run(|name, filled| println!("{name}: {}", word(filled)))?;
    let count = |what| filled.iter().filter(|f| **f == what).count();
    let [kept, made, failed] = [Filled::Kept, Filled::Made, Filled::Failed].map(count);
    println!("{made} made, {kept} were there, {failed} are no drapes");
    Ok(())
}

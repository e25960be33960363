//! `estimate`, the main job.

use super::{Failure, Outcome, args};
use scan2params::base::units::KG_M2_PER_G_M2;
use scan2params::job::Job;
use scan2params::report::{files, json, table};

pub(crate) fn run(given: &args::Estimate) -> Outcome {
    let job = Job {
        input: given.scan.input.clone(),
        density_kg_m2: given.density * KG_M2_PER_G_M2,
        read: given.scan.read.read()?,
        scan: given.scan.read.options()?,
        resimulate: given.resimulate || given.out.is_some(),
    };
    let outcome = job.run().map_err(Failure::of_job)?;
    if given.json {
        println!("{}", serde_json::to_string_pretty(&json::params(&outcome))?);
    } else {
        print!("{}", table::text(&outcome));
    }
    if let Some(folder) = &given.out {
        for path in files::write(&outcome, folder).map_err(Failure::of_job)? {
            eprintln!("wrote {}", path.display());
        }
    }
    Ok(())
}

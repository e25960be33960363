//! `estimate`, the main job.

use super::progress::Working;
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
        refine: given.refine,
        with: given.with.clone(),
    };
    if let Some(folder) = &given.out {
        files::check(&job.input, folder, &given.files()).map_err(Failure::of_output)?;
    }
    let working = Working::on(format!("estimating {}", job.input.display()));
    let outcome = job.run_telling(|step| working.now(step)).map_err(Failure::of_job)?;
    drop(working);
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
    Failure::of_verdict(&given.scan.input, &outcome.verdict, given.strict)
}

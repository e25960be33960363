//! `estimate`, the main job.

use std::io::IsTerminal as _;

use super::progress::Working;
use super::{Failure, Outcome, args, interrupt, print};
use scan2params::base::units::KG_M2_PER_G_M2;
use scan2params::calibrate::cloth_file;
use scan2params::estimate::Estimator;
use scan2params::job::{self, Job, JobError, Told};
use scan2params::report::cusick::StandardCusick;
use scan2params::report::page::lab::{self, Lab, LabError};
use scan2params::report::page::options::Extra;
use scan2params::report::page::provenance;
use scan2params::report::{files, json, table};
use scan2params::sim::Experiment;

/// The standard experiment, with the effects of the fabric's file.
fn experiment(given: &args::Estimate) -> Result<Experiment, Failure> {
    let of_file =
        given.effects.as_ref().map(|path| cloth_file::experiment(path, given.face.into()));
    Ok(of_file.transpose().map_err(Failure::usage)?.unwrap_or_default())
}

pub(crate) fn run(given: &args::Estimate) -> Outcome {
    let job = Job {
        input: given.scan.input.clone(),
        density_kg_m2: given.density * KG_M2_PER_G_M2,
        read: given.scan.read_options()?,
        scan: given.scan.read.options()?,
        refine: !given.quick,
        release: given.release || given.out.is_some(),
        with: given.with.clone(),
        experiment: experiment(given)?,
    };
    if let Some(folder) = &given.out {
        files::check(&job.input, folder, &given.files()).map_err(Failure::of_output)?;
    }
    let lab = read_lab(given)?;
    let working = Working::on(format!("estimating {}", job.input.display()));
    let outcome = match answer(job, given, &lab, &working) {
        Ok(outcome) => outcome,
        Err(error) => {
            drop(working);
            return Err(refused(error, given));
        }
    };
    let cusick = given.cusick.then(|| {
        working.now("simulating the standard Cusick test");
        StandardCusick::of(&outcome.estimate.fabric)
    });
    drop(working);
    give(&outcome, given, lab, cusick)?;
    Failure::of_verdict(&given.scan.input, &outcome.verdict, given.strict)
}

/// The answer. The network's is shown while the simulator refines it, and is given where the user
/// does not wait.
fn answer(
    job: Job,
    given: &args::Estimate,
    lab: &Lab,
    working: &Working,
) -> Result<job::Outcome, JobError> {
    job.check()?;
    let estimator = Estimator::shipped()?;
    let tell = |told: Told<'_>| working.now(told.to_string());
    let quick = job.quick(&estimator, tell)?;
    if quick.job.refine {
        working.aside(|| show_quick(&quick));
        let (instead, given, lab) = (quick.clone().interrupted(), given.clone(), lab.clone());
        let line = working.handle();
        interrupt::answers(move || {
            line.finish_and_clear();
            warning!("warning: interrupted; this is the network's quick answer");
            if let Err(failure) = give(&instead, &given, lab, None) {
                warning!("error: {:#}", failure.error);
            }
        });
    }
    let outcome = quick.refined(&estimator, tell);
    interrupt::answers_no_more();
    outcome
}

/// The network's answer in short, on a terminal.
fn show_quick(quick: &job::Outcome) {
    if !std::io::stderr().is_terminal() {
        return;
    }
    eprintln!("quick answer of the network (control-C stops here and keeps it):");
    for p in quick.estimate.parameters() {
        let [low, high] = p.interval90;
        eprintln!("  {:<14}{:>9.0}   {low:.0} .. {high:.0} {}", p.key, p.value, p.unit);
    }
}

/// Prints the answer and writes its files.
fn give(
    outcome: &job::Outcome,
    given: &args::Estimate,
    lab: Lab,
    cusick: Option<StandardCusick>,
) -> Outcome {
    if given.json {
        println!("{}", serde_json::to_string_pretty(&json::params(outcome))?);
    } else {
        print!("{}", table::text(outcome));
    }
    if print::is_verbose() {
        eprint!("{}", table::stages(&outcome.stages));
    }
    let Some(folder) = &given.out else { return Ok(()) };
    for path in files::write(outcome, folder).map_err(Failure::of_job)? {
        eprintln!("wrote {}", path.display());
    }
    if !given.no_report {
        let mut inputs = provenance::files_of(&given.scan.input)?;
        for other in &given.with {
            inputs.extend(provenance::files_of(other)?);
        }
        let extra = Extra { lab, inputs, cusick, turning_view: true };
        let stem = files::stem(&given.scan.input);
        let path = files::write_page(outcome, folder, &stem, &extra)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// Leaves a picture of a scan that gives no rim, and hands the failure on.
fn refused(error: JobError, given: &args::Estimate) -> Failure {
    if let Some(folder) = &given.out {
        match files::write_refused(&error, folder) {
            Ok(Some(path)) => eprintln!("wrote {}: what was found in the scan", path.display()),
            Ok(None) => {}
            // The refusal is the answer, with its picture or without.
            Err(error) => warning!("warning: no picture of the refused scan: {error}"),
        }
    }
    Failure::of_job(error)
}

/// The laboratory's fields, if a file has them.
fn read_lab(given: &args::Estimate) -> Result<Lab, Failure> {
    let read = given.lab.as_ref().map(|path| lab::read(path)).transpose();
    let lab = read.map_err(|error| match error {
        LabError::Io { .. } => Failure::from(error),
        LabError::Form { .. } => Failure::usage(error),
    })?;
    Ok(lab.unwrap_or_default())
}

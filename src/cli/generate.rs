//! `generate`: a folder of simulated drapes.

use std::io::IsTerminal as _;
use std::ops::ControlFlow;
use std::time::Instant;

use super::{Failure, Outcome, args};
use scan2params::dataset::{GenerateError, GenerateOptions, Progress, Walks, drapes, generate};
use scan2params::fabric::Mixture;
use scan2params::sim::SimOptions;

pub(crate) fn run(given: &args::Generate) -> Outcome {
    let own = match given.walk {
        Some(_) => drapes::walk_options(),
        None => drapes::dataset_options(),
    };
    let energy_drop = given.energy_drop.unwrap_or(own.energy_drop);
    let simulator = SimOptions { vertices: given.vertices as usize, energy_drop, ..own };
    let mut options = GenerateOptions::new(&given.out, given.count);
    options.prior = Mixture::named(&given.prior).map_err(Failure::usage)?;
    options.seed = given.seed;
    options.shard = given.shard;
    options.drops_per_fabric = given.drops_per_fabric;
    options.threads = given.threads.threads;
    options.canonical = given.canonical;
    options.walks = given.walk.map(|rows| Walks { rows, ..Walks::default() });
    options.sheets = given.sheets;
    options.simulator = serde_json::to_value(simulator)?;
    let start = Instant::now();
    let simulate = |sample: &_, sheet| match options.walks {
        Some(_) => drapes::walk(sample, sheet, &simulator),
        None => drapes::simulate(sample, &simulator),
    };
    let report = |progress: Progress| {
        report(progress, start);
        ControlFlow::Continue(())
    };
    let summary = generate(&options, simulate, report).map_err(failure)?;
    eprintln!(
        "{} drapes made in {:.0} s, {} kept from an interrupted run, {} files written, {} kept",
        summary.made,
        start.elapsed().as_secs_f64(),
        summary.rows_kept,
        summary.files_written,
        summary.files_kept
    );
    for (stop, count) in &summary.not_converged {
        warning!("not converged: {count} ({stop})");
    }
    Ok(())
}

fn failure(error: GenerateError) -> Failure {
    match error {
        GenerateError::Options(_)
        | GenerateError::OtherOptions { .. }
        | GenerateError::Older { .. } => Failure::usage(error),
        GenerateError::Output(error) => Failure::of_output(error),
        other => Failure::from(other),
    }
}

fn report(progress: Progress, start: Instant) {
    let Progress { made, to_make, not_converged } = progress;
    let every = if std::io::stderr().is_terminal() { 1 } else { 50 };
    if made.is_multiple_of(every) || made == to_make {
        let spent = start.elapsed().as_secs_f64();
        let left = spent / made as f64 * (to_make - made) as f64;
        eprintln!("{made}/{to_make} drapes, {not_converged} not converged, {left:.0} s left");
    }
}

//! The command line of the laboratory: the tables of docs/validation.
//!
//! stdout is for data, stderr for people. Exit codes are those of `scan2params`.

mod altered;
mod args;
mod calibrate;
mod estimate;
mod follow;
mod physics;
mod profile;
mod redrape;
mod refine;
mod scan;
mod scenes;
mod sensors;
mod start;
mod table3;
mod transfer;
mod verdict;
mod views;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser as _;
use rayon::prelude::*;

use args::{Arguments, Command};
use scan::Sweep;
use scan2params::base::clock::Stage;
use scan2params::dataset::drapes::dataset_options;
use scan2params::fabric::Mixture;
use scan2params::sim::{Numerics, SimOptions};
use scan2params::terminal::flags::ScanFlags;
use scan2params::terminal::value;
use scan2params::terminal::{Failure, Outcome, ended, interrupt, print};
use scan2params_lab::evaluate::soak::{self, Soaked, Tally};
use scan2params_lab::evaluate::timed::timed_drape;
use scan2params_lab::evaluate::{speed, stages};

/// Runs the program with `arguments`, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    interrupt::watch();
    let parsed = match Arguments::try_parse_from(arguments) {
        Ok(parsed) => parsed,
        Err(error) => return print::of_clap(&error),
    };
    parsed.talk.apply();
    ended(parsed.threads.apply().and_then(|()| measure(&parsed.command)))
}

fn measure(command: &Command) -> Outcome {
    // Without a reader the tables are for nobody, and some take hours.
    print::stdout_is_all();
    match command {
        Command::Scan { drapes, profiles, seeds, first_seed, pictures, tune } => {
            let seeds = *first_seed..first_seed.saturating_add(*seeds);
            let tuning = scan::tuned(tune)?;
            scan::run(drapes, &Sweep { profiles, seeds, pictures: pictures.as_deref(), tuning })
        }
        Command::Estimate(given) => estimate::run(given),
        Command::Redrape(given) => redrape::run(given),
        Command::Sensors(given) => sensors::run(given),
        Command::Scenes(given) => scenes::run(given),
        Command::Views(given) => views::run(given),
        Command::Table3 { drapes, json } => table3::run(drapes.as_deref(), *json),
        Command::Stages { scan, repeat } => time_stages(scan, *repeat),
        Command::Physics(given) => physics::run(given),
        Command::Soak { prior, count, first, seed, numerics } => {
            run_soak(prior, *first, *count, *seed, value::numerics(*numerics))
        }
        Command::Follow(given) => follow::run(given),
        Command::Speed { count, seed, dataset, vertices, numerics } => {
            let numerics = value::numerics(*numerics);
            run_speed(*count, *seed, *dataset, vertices, numerics)
        }
        Command::Altered(given) => altered::run(given),
        Command::Verdict(given) => verdict::run(given),
        Command::Start(given) => start::run(given),
        Command::Refine(given) => refine::run(given),
        Command::Transfer(given) => transfer::run(given),
        Command::Calibrate(given) => calibrate::run(given),
        Command::Sensitivities { seed, index } => sensitivities(*seed, *index),
    }
}

fn time_stages(scan: &ScanFlags, repeat: u64) -> Outcome {
    let (read, options) = (scan.read_options()?, scan.read.options()?);
    let mut best: Option<Vec<Stage>> = None;
    let cost = |stages: &[Stage]| stages.iter().map(|s| s.cpu_s.unwrap_or(s.wall_s)).sum::<f64>();
    for _ in 0..repeat {
        let (_, noted) = stages::of_scan(&scan.input, &read, &options).map_err(Failure::of_job)?;
        if best.as_ref().is_none_or(|best| cost(&noted) < cost(best)) {
            best = Some(noted);
        }
    }
    println!("stage,cpu_s,wall_s");
    let mut sums = [0.0; 2];
    for stage in best.unwrap_or_default() {
        let cpu = stage.cpu_s.map_or("unknown".to_owned(), |s| format!("{s:.3}"));
        println!("{},{cpu},{:.3}", stage.name, stage.wall_s);
        sums = [sums[0] + stage.cpu_s.unwrap_or(f64::NAN), sums[1] + stage.wall_s];
    }
    println!("total,{:.3},{:.3}", sums[0], sums[1]);
    Ok(())
}

fn run_speed(count: u64, seed: u64, dataset: bool, sides: &[usize], numerics: Numerics) -> Outcome {
    let options = if dataset { dataset_options() } else { SimOptions::default() };
    let options = SimOptions { numerics, ..options };
    println!("{}", speed::COLUMNS);
    let mut sizes = Vec::new();
    for &vertices in sides {
        let mut timed = Vec::new();
        for index in 0..count {
            let drape = timed_drape(seed, index, &SimOptions { vertices, ..options })?;
            println!("{}", speed::row(index, &drape));
            timed.push(drape);
        }
        let size = speed::Size::of(&timed);
        println!("{vertices} vertices a side: {size}\n");
        sizes.push((vertices, size));
    }
    if let Some(exponent) = speed::exponent(&sizes) {
        println!("cost grows with the number of vertices to the power {exponent:.2}");
    }
    if let Some(peak) = scan2params::base::clock::peak_memory_mib() {
        println!("peak memory of the process, one drape at a time: {peak:.0} MiB");
    }
    Ok(())
}

fn sensitivities(seed: u64, index: u64) -> Outcome {
    let found = speed::rim_sensitivities(seed, index, &SimOptions::default())?;
    println!("parameter, unit, rim_mean_mm_per_part, rim_largest_mm_per_part, part");
    for a in &found.rows {
        println!(
            "{}, {}, {:.3e}, {:.3e}, {}",
            a.key, a.unit, a.rim_mean_mm, a.rim_largest_mm, a.part
        );
    }
    println!(
        "{} parameters in {:.2} CPU-s, {:.1} % of the drape's {:.2} CPU-s",
        found.rows.len(),
        found.cpu_s,
        100.0 * found.cpu_s / found.drape_cpu_s,
        found.drape_cpu_s
    );
    Ok(())
}

fn run_soak(prior: &str, first: u64, count: u64, seed: u64, numerics: Numerics) -> Outcome {
    let prior = Mixture::named(prior).map_err(Failure::usage)?;
    let options = SimOptions { numerics, ..SimOptions::default() };
    println!("{}", Soaked::COLUMNS);
    let (send, receive) = std::sync::mpsc::channel();
    let mut drapes: Vec<Soaked> = std::thread::scope(|scope| {
        scope.spawn(move || {
            (first..first + count).into_par_iter().for_each_with(send, |send, index| {
                let _ = send.send(soak::soak(&prior, seed, index, &options));
            });
        });
        let print = |soaked: Soaked| {
            println!("{}", soaked.row());
            soaked
        };
        receive.into_iter().map(|soaked| soaked.map(print)).collect::<Result<_, _>>()
    })?;
    drapes.sort_by_key(|soaked| soaked.index);
    println!(
        "\nsource, drapes, stops, worst_residual_at_rest, intersections, \
         least_clearance_mm, diverged, cpu_s_median, cpu_s_95, cpu_s_most"
    );
    for source in [soak::Source::Prior, soak::Source::Corner] {
        let of: Vec<&Soaked> = drapes.iter().filter(|d| d.source == source).collect();
        let tally = Tally::of(of.iter().copied());
        println!(
            "{}, {}, {:?}, {:.1e}, {}, {:.3}, {}, {:.2}, {:.2}, {:.2}",
            source.name(),
            of.len(),
            tally.stops,
            tally.worst_residual,
            tally.intersections,
            1e3 * tally.least_clearance_m,
            tally.diverged,
            tally.cpu_at(0.5),
            tally.cpu_at(0.95),
            tally.cpu_at(1.0)
        );
    }
    Ok(())
}

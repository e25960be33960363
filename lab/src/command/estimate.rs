//! `scan2params-lab estimate`: the shipped estimate, or another network's, held against drapes that
//! it has not seen.

use std::io::IsTerminal as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use anyhow::{Context as _, anyhow};
use rayon::prelude::*;
use serde_json::json;

use super::{Failure, Outcome, args};
use scan2params::dataset::drapes::{dataset_options, simulate};
use scan2params::dataset::{Manifest, Row, Sample, read_folder};
use scan2params::estimate::{EstimateError, Estimator};
use scan2params::fabric::{Fabric, Mixture, MixtureError};
use scan2params::io::output;
use scan2params::report::files;
use scan2params::sim::{Experiment, Fall, NUMERICS_VERSION, SimOptions};
use scan2params_lab::evaluate::estimate::{
    self as held_out, Answer, Baseline, Group, Scores, UnfitDrapes, anywhere, by_likeness, noisy,
    pictures, quarters, repeats::Repeats, verdicts::Verdicts,
};
use scan2params_lab::evaluate::rim_noise::RimNoise;

/// The columns of the scores.
const COLUMNS: &str =
    "by, parameter, median_abs_ln_error, rmse, r2, coverage, half_width_factor, novel";

pub(super) fn run(given: &args::HeldOut) -> Outcome {
    let estimator = estimator(given.model.as_deref())?;
    if let Some(folder) = &given.out {
        output::check_folder(folder).map_err(Failure::of_output)?;
        std::fs::create_dir_all(folder)?;
    }
    let prior = Mixture::named(&estimator.model().prior)?;
    let made = made(given, &estimator, &prior)?;
    let count = made.len();
    let rows = held_out::converged(made)?;
    let noise = estimator.model().record.get("noise").context("the model says no scan noise")?;
    let noise: RimNoise = serde_json::from_value(noise.clone())?;
    let scanned = noisy(&rows, &noise, given.seed);
    let truths: Vec<Fabric> = rows.iter().map(|row| row.fabric).collect();
    let said =
        [held_out::estimates(&estimator, &rows)?, held_out::estimates(&estimator, &scanned)?];
    let verdicts =
        [Verdicts::of(&prior, &rows, &said[0]), Verdicts::of(&prior, &scanned, &said[1])];
    let [clean, scanned] = said.map(|said| said.iter().map(Answer::of).collect::<Vec<Answer>>());
    let ignoring = vec![Baseline::of(&prior)?.answer(); rows.len()];
    if let Some(folder) = &given.out {
        files::picture(&folder.join("answers.png"), &pictures::answers(&truths, &scanned))?;
        files::picture(&folder.join("pairs.png"), &pictures::pairs(&truths, &scanned))?;
    }
    let limits = prior.limits();
    let id = estimator.model().id.clone();
    let all = [
        (id.clone(), &clean),
        (format!("{id}, scan noise"), &scanned),
        ("ignoring-the-scan".into(), &ignoring),
    ];
    let scores = all.map(|(name, answers)| (name, Scores::of(&truths, answers, limits)));
    let by_length = [&clean, &scanned].map(|answers| quarters(&truths, answers, limits));
    let likeness = [&clean, &scanned].map(|answers| by_likeness(&prior, &truths, answers));
    let fabric_of: Vec<u64> = rows.iter().map(|row| row.fabric_index).collect();
    let together =
        [&clean, &scanned].map(|answers| Repeats::of(&truths, &fabric_of, answers, limits));
    if given.json {
        let [(_, shipped), (_, with_noise), (_, baseline)] = &scores;
        let all = json!({
            "model": id, "drapes": count, "at_rest": rows.len(),
            "shipped": shipped, "scan_noise": with_noise, "ignoring_the_scan": baseline,
            "quarters": { "clean": by_length[0], "scan_noise": by_length[1] },
            "likeness": { "clean": likeness[0], "scan_noise": likeness[1] },
            "drops_of_one_fabric": { "clean": together[0], "scan_noise": together[1] },
            "verdicts": { "clean": verdicts[0], "scan_noise": verdicts[1] },
        });
        println!("{}", serde_json::to_string_pretty(&all)?);
        return Ok(());
    }
    println!("{} of {count} drapes are at rest\n{COLUMNS}", rows.len());
    for (name, scores) in &scores {
        table(&name.replace(", ", " with "), scores);
    }
    groups("quarter of bending length", &by_length);
    groups("answer is like", &likeness);
    repeats(&together);
    told(&verdicts);
    Ok(())
}

/// The drapes of a folder that the network has not seen, or fresh ones.
fn made(
    given: &args::HeldOut,
    estimator: &Estimator,
    prior: &Mixture,
) -> Result<Vec<Row>, Failure> {
    let experiment = given.experiment.experiment().map_err(Failure::usage)?;
    match &given.drapes {
        Some(_) if experiment != Experiment::default() => {
            let why =
                "drapes of a folder lie as they lie; the flags of an experiment go with --count";
            Err(Failure::usage(anyhow!(why)))
        }
        Some(folder) => unseen(estimator, folder),
        None => {
            held_out::check_unseen(estimator, prior.name(), given.seed, NUMERICS_VERSION)
                .map_err(Failure::usage)?;
            fresh(prior, given, experiment)
        }
    }
}

/// The shipped network, or another one whose record lies next to it.
pub(super) fn estimator(model: Option<&Path>) -> Result<Estimator, EstimateError> {
    match model {
        Some(onnx) => Estimator::from_files(onnx, &onnx.with_extension("json")),
        None => Estimator::shipped(),
    }
}

/// The rows of a folder of another seed than the training's.
pub(super) fn unseen(estimator: &Estimator, folder: &Path) -> Result<Vec<Row>, Failure> {
    let manifest = Manifest::read(folder)?;
    let checked: Result<(), UnfitDrapes> = held_out::check_folder(estimator, &manifest);
    checked?;
    Ok(read_folder(folder)?)
}

fn table(name: &str, scores: &Scores) {
    for p in &scores.parameters {
        println!(
            "{name}, {}, {:.3}, {:.4}, {:.3}, {:.3}, {:.2}, ",
            p.key, p.median_abs_ln_error, p.rmse, p.r2, p.coverage, p.median_half_width_factor
        );
    }
    println!(
        "{name}, all, , {:.4}, {:.3}, {:.3}, {:.2}, {:.3}",
        scores.rmse, scores.r2, scores.coverage, scores.half_width_factor, scores.novel_share
    );
}

/// Groups of clean rims, then the same with scan noise: coverage of each stiffness, and over all.
fn groups(by: &str, [clean, scanned]: &[Vec<Group>; 2]) {
    println!(
        "\n{by}, rims, drapes, rmse, half_width_factor, coverage of S^u S^v H B^u B^v B^h, all"
    );
    for (rims, groups) in [("clean", clean), ("scan noise", scanned)] {
        for Group { name, scores } in groups {
            let each: Vec<String> =
                scores.parameters.iter().map(|p| format!("{:.2}", p.coverage)).collect();
            println!(
                "{name}, {rims}, {}, {:.4}, {:.2}, {}, {:.3}",
                scores.drapes,
                scores.rmse,
                scores.half_width_factor,
                each.join(" "),
                scores.coverage
            );
        }
    }
}

/// Drops of one fabric taken together, where there are any: clean rims, then the same with scan
/// noise.
fn repeats(together: &[Option<Repeats>; 2]) {
    for (rims, repeats) in ["clean", "scan noise"].iter().zip(together) {
        let Some(Repeats { fabrics, drops, parameters, all }) = repeats else { continue };
        println!(
            "\n{drops} drops of {fabrics} fabrics, {rims}: rmse of one, together, share of the error in common, interval holds, \
             its half_width_factor, interval of two drops holds, its half_width_factor"
        );
        for p in parameters.iter().chain([all]) {
            println!(
                "{}, {:.4}, {:.4}, {:.2}, {:.3}, {:.2}, {:.3}, {:.2}",
                p.key,
                p.rmse_of_one,
                p.rmse_together,
                p.common_share,
                p.interval_holds,
                p.half_width_factor,
                p.two_hold,
                p.two_half_width_factor
            );
        }
    }
}

/// What the verdict makes of the answers: to clean rims, then to the same with scan noise.
fn told(verdicts: &[Verdicts; 2]) {
    println!("\nverdict, rims, reliable, doubtful, do_not_use, answers with each ground");
    for (rims, verdicts) in ["clean", "scan noise"].iter().zip(verdicts) {
        let Verdicts { reliable, doubtful, do_not_use, grounds } = verdicts;
        let grounds: Vec<String> = grounds.iter().map(|(code, n)| format!("{code} {n}")).collect();
        println!("verdict, {rims}, {reliable}, {doubtful}, {do_not_use}, {}", grounds.join(" "));
    }
}

/// Drapes as `generate` makes them, but on this bench, on all cores.
fn fresh(
    prior: &Mixture,
    given: &args::HeldOut,
    experiment: Experiment,
) -> Result<Vec<Row>, Failure> {
    let (count, seed) = (given.count.unwrap_or(1), given.seed);
    let options = SimOptions { experiment, ..dataset_options() };
    let start = Instant::now();
    let made = AtomicU64::new(0);
    let row = |index: u64| {
        let fabric = if given.anywhere {
            anywhere(prior, seed, index)
        } else {
            prior.sample(seed, index)?
        };
        let sample =
            Sample { index, fabric_index: index, fabric, run_seed: seed, fall: Fall::Perturbed };
        let drape = simulate::<()>(&sample, &options).row;
        let made = made.fetch_add(1, Ordering::Relaxed) + 1;
        if std::io::stderr().is_terminal() {
            let left = start.elapsed().as_secs_f64() / made as f64 * (count - made) as f64;
            eprintln!("{made}/{count} drapes, {left:.0} s left");
        }
        Ok(Row { index, fabric_index: index, fabric, drape })
    };
    let rows = (0..count).into_par_iter().map(row);
    Ok(rows.collect::<Result<Vec<Row>, MixtureError>>()?)
}

//! `scan2params-lab scan`: rims of virtual scans against the true ones.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::{Failure, Outcome};
use scan2params::dataset::drape_file::{read_drape, rim_of};
use scan2params::io::output;
use scan2params::report::files;
use scan2params::scan::Tuning;
use scan2params_lab::evaluate::scan::{self as rims, Case, Setup, Summary};

/// Which scans are made.
pub(super) struct Sweep<'a> {
    pub(super) profiles: &'a [String],
    pub(super) seeds: std::ops::Range<u64>,
    pub(super) pictures: Option<&'a Path>,
    pub(super) tuning: Tuning,
}

/// The shipped constants with those of `--tune` in place of their own.
pub(super) fn tuned(tune: &[(String, String)]) -> Result<Tuning, Failure> {
    let set = |tuning: Tuning, (key, value): &(String, String)| tuning.with(key, value);
    tune.iter().try_fold(Tuning::default(), set).map_err(Failure::usage)
}

pub(super) fn run(drapes: &[PathBuf], sweep: &Sweep<'_>) -> Outcome {
    let setup = |name: &String| Setup::named(name).map_err(Failure::usage);
    let setups: Vec<Setup> = sweep.profiles.iter().map(setup).collect::<Result<_, _>>()?;
    if let Some(folder) = sweep.pictures {
        output::check_folder(folder).map_err(Failure::of_output)?;
    }
    println!(
        "drape, sensor, seed, mean_mm, largest_mm, without_motion_mm, shift_mm, yaw_deg, \
         edge_bias_mm, within_68, within_95, observed, seconds, refusal"
    );
    let mut cases: Vec<(String, usize, Case)> = Vec::new();
    for path in &obj_files(drapes)? {
        let mesh = read_drape(path)?;
        let truth =
            rim_of(&mesh).with_context(|| format!("{}: not a square grid", path.display()))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for (number, setup) in setups.iter().enumerate() {
            for seed in sweep.seeds.clone() {
                let made = setup.scan(&mesh, seed)?;
                if let Some(folder) = sweep.pictures
                    && let Ok(found) = rims::find(&made, &sweep.tuning)
                {
                    let file = folder.join(format!("{name}_{}_{seed}.png", setup.name));
                    std::fs::create_dir_all(folder)?;
                    files::picture(&file, &rims::picture(&found, &truth))?;
                }
                let case = rims::case(&made, &mesh, &truth, &sweep.tuning);
                println!("{name}, {}, {seed}, {}", setup.name, row(&case));
                cases.push((name.clone(), number, case));
            }
        }
    }
    println!(
        "\ndrape, sensor, scans, answered, mean_mm, worst_mean_mm, largest_mm, over_5_mm, \
         within_68, within_95, sigma_factor_68, sigma_factor_95, edge_bias_mm, seconds"
    );
    let mut names: Vec<&str> = cases.iter().map(|c| c.0.as_str()).collect();
    names.dedup();
    for (number, setup) in setups.iter().enumerate() {
        let of = |name: Option<&str>| -> Vec<&Case> {
            let wanted = cases.iter().filter(|c| c.1 == number);
            wanted.filter(|c| name.is_none_or(|n| c.0 == n)).map(|c| &c.2).collect()
        };
        for name in &names {
            println!("{name}, {}, {}", setup.name, totals(&Summary::of(&of(Some(name)))));
        }
        println!("all, {}, {}", setup.name, totals(&Summary::of(&of(None))));
    }
    Ok(())
}

/// The OBJ files among `given`, and those of the folders among them, by name.
fn obj_files(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in given {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let inside = std::fs::read_dir(path).with_context(|| path.display().to_string())?;
        let mut inside: Vec<PathBuf> =
            inside.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
        inside.retain(|file| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")));
        inside.sort();
        files.extend(inside);
    }
    if files.is_empty() {
        return Err(Failure::usage(anyhow!("no OBJ file among the drapes given")));
    }
    Ok(files)
}

fn row(case: &Case) -> String {
    let seconds = case.seconds;
    match &case.answer {
        Err(refusal) => format!(", , , , , , , , , {seconds:.2}, {refusal}"),
        Ok(e) => {
            let within = rims::INTERVAL_SIGMAS.map(|sigmas| {
                e.scores.iter().filter(|s| **s <= sigmas).count() as f64 / e.scores.len() as f64
            });
            format!(
                "{:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {seconds:.2}, ",
                e.mean_m * 1e3,
                e.largest_m * 1e3,
                e.without_motion_m * 1e3,
                e.shift_m * 1e3,
                e.yaw_rad.to_degrees(),
                e.edge_bias_m * 1e3,
                within[0],
                within[1],
                e.observed
            )
        }
    }
}

fn totals(s: &Summary) -> String {
    format!(
        "{}, {}, {:.2}, {:.2}, {:.2}, {}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}",
        s.cases,
        s.answered,
        s.mean_m * 1e3,
        s.worst_mean_m * 1e3,
        s.largest_m * 1e3,
        s.silent,
        s.coverage[0],
        s.coverage[1],
        s.sigma_factors[0],
        s.sigma_factors[1],
        s.edge_bias_m * 1e3,
        s.seconds
    )
}

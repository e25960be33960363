//! `scan2params-lab calibrate`: calibration held against sealed cases.

use std::path::{Path, PathBuf};

use anyhow::Context as _;

use super::profile::profile;
use super::{Failure, Outcome, args};
use scan2params::base::units::M_PER_MM;
use scan2params::calibrate::manifest::Bench;
use scan2params::calibrate::run::Options;
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params_lab::evaluate::calibrate::{LEAST_FLOORS, Scored, Series, Summary};
use scan2params_lab::sealed::MakeOptions;

pub(super) fn run(given: &args::SealedCases) -> Outcome {
    let folder = Folder::of(given.keep.as_deref())?;
    let prior = Mixture::named(&given.prior).map_err(Failure::usage)?;
    let without = given.without.clone();
    let mut calibrate = Options { prior, without, ..Options::default() };
    calibrate.fit.sim.vertices = given.vertices as usize;
    if let Some(edge_mm) = given.sensor_edge_mm {
        calibrate.fit.sensor_edge_m = edge_mm.map(|mm| mm * M_PER_MM);
    }
    let mut make =
        MakeOptions { vertices: given.truth_vertices as usize, ..MakeOptions::default() };
    if let Some(name) = &given.scans {
        make.sensor = profile(name)?;
    }
    let series = Series {
        seed: given.seed,
        bench: if given.scans.is_some() { Bench::Square } else { Bench::Cusick },
        drops: given.drops.map(|drops| drops as usize),
        cases: given.first..given.first.saturating_add(given.count),
        make,
        calibrate,
        folder: folder.path.clone(),
    };
    println!("{}", Scored::COLUMNS);
    let cases = series.run(|case| println!("{}", case.row()))?;
    let sum = Summary::of(&cases);
    print(&sum, &cases);
    if given.json {
        println!("{}", serde_json::to_string(&sum)?);
    }
    Ok(())
}

/// The figures of the cases, a line each.
fn print(sum: &Summary, cases: &[Scored]) {
    let share = |share: Option<f64>| share.map_or("-".to_owned(), |s| format!("{s:.2}"));
    println!("\nfigure, value, cases");
    println!("answered, , {} of {}", sum.cases - sum.failed, sum.cases);
    let large = format!("{} of {} above {LEAST_FLOORS:.0} floors", sum.large, sum.one);
    println!("one effect: named, {}, {large}", share(sum.named));
    let staying = format!(
        "{} of {} above {LEAST_FLOORS:.0} floors after stiffnesses and poses",
        sum.staying, sum.one
    );
    println!("one effect: named, {}, {staying}", share(sum.staying_named));
    println!(
        "one effect: held-out error after over before, {}, {large}",
        share(sum.after_over_before)
    );
    println!(
        "one effect: held-out error after over the floor, {}, {large}",
        share(sum.after_over_floor)
    );
    println!(
        "one effect: held-out error after over that of the truth, {}, {large}",
        share(sum.after_over_truth)
    );
    let two = cases.iter().filter(|case| case.sealed.kind.name() == "two").count();
    println!("two effects: both named, {}, {two}", share(sum.both_named));
    println!("no effect: false alarms, {}, {}", share(sum.false_alarms), sum.none);
    println!("on no list: called unexplained, {}, {}", share(sum.unexplained), sum.unlisted);
    let drawn = format!("{} of {} with a field and a region", sum.drawn, sum.unlisted);
    println!("on no list: field strongest where it acts, {}, {drawn}", share(sum.in_region));
    println!(
        "on no list: share of the specimen where it acts, {}, {drawn}",
        share(sum.region_share)
    );
}

/// Where cases are made: a folder that is kept, or one that goes with the run.
struct Folder {
    path: PathBuf,
    kept: bool,
}

impl Folder {
    fn of(keep: Option<&Path>) -> Result<Self, Failure> {
        let own =
            || std::env::temp_dir().join(format!("scan2params-sealed-{}", std::process::id()));
        let path = keep.map_or_else(own, Path::to_owned);
        output::check_folder(&path).map_err(Failure::of_output)?;
        std::fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Self { path, kept: keep.is_some() })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.kept {
            // a folder of temporary files that stays is no fault of the run
            let _ = std::fs::remove_dir_all(&self.path);
        }
    }
}

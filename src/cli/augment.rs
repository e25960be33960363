//! `augment`: virtual scans of drapes.

use std::path::Path;

use anyhow::anyhow;

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::base::units::M_PER_MM;
use scan2params::dataset::augment::{self, AugmentError, AugmentOptions, Made, Step};
use scan2params::dataset::setting::Setting;
use scan2params::io::{Format, output};
use scan2params::sim::SimOptions;

pub(crate) fn run(given: &args::Augment) -> Outcome {
    let options = AugmentOptions {
        input: given.input.clone(),
        out: given.out.clone(),
        form: given.form.into(),
        profile: given.profile.clone(),
        setting: setting(given),
        unit: given.unit.into(),
        mark: given.mark,
        even: given.even,
        seed: given.seed,
        count: given.count,
        simulator: SimOptions::default(),
    };
    if given.even.is_some() && !is_ply(&given.out) {
        let why = "--even makes one cloud; give --out FILE.ply";
        return Err(Failure::usage(anyhow!("{}: {why}", given.out.display())));
    }
    if is_ply(&given.out) {
        if given.count != 1 || !matches!(given.form, args::AugmentForm::Ply) {
            let why = "--out names one .ply; for other forms or more variants give a folder";
            return Err(Failure::usage(anyhow!("{}: {why}", given.out.display())));
        }
        let working = Working::on(format!("scanning {}", given.input.display()));
        let tell = |step: Step<'_>| tell(step, &working);
        let points = augment::one_ply(&options, &given.out, tell).map_err(failure)?;
        drop(working);
        eprintln!("wrote {} ({points} points)", given.out.display());
        return Ok(());
    }
    // A folder of a file's name is there on purpose, a new one by mistake.
    if is_file_name(&given.out) && !given.out.is_dir() {
        output::check_named(&given.out, &[".ply"], &[]).map_err(Failure::of_output)?;
    }
    let working = Working::on("reading the drapes");
    let all = augment::run(&options, |step| tell(step, &working)).map_err(failure)?;
    drop(working);
    let failed = all.iter().filter(|made| made.outcome.is_err()).count();
    if failed > 0 {
        return Err(Failure::partial(anyhow!("{failed} of {} were not made", all.len())));
    }
    Ok(())
}

fn is_ply(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply"))
}

/// Whether a name ends as scans and pictures do.
fn is_file_name(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    Format::named(&ending).is_some() || ["jpg", "jpeg"].contains(&ending.as_str())
}

fn tell(step: Step<'_>, working: &Working) {
    match step {
        Step::Begun { name, number, of } => working.now(format!("scan {number} of {of}: {name}")),
        Step::Coarse { name, cell_m } => working.aside(|| {
            warning!(
                "warning: {name}: its cells of {:.1} mm are larger than {:.1} mm: `estimate` will refuse most scans of it; \
                 drape it with 61 vertices a side",
                cell_m / M_PER_MM,
                augment::COARSEST_CELL_M / M_PER_MM
            );
        }),
        Step::Ended(made) => working.aside(|| report(made)),
    }
}

fn report(made: &Made) {
    match &made.outcome {
        Ok(path) => println!("{}", path.display()),
        Err(error) => warning!("warning: {}: {error}", made.name),
    }
}

fn failure(error: AugmentError) -> Failure {
    match error {
        AugmentError::Input { .. } | AugmentError::RimsOnly { .. } => Failure::usage(error),
        AugmentError::Output(error) => Failure::of_output(error),
        other => Failure::from(other),
    }
}

/// What the drapes stand on and among.
fn setting(given: &args::Augment) -> Setting {
    let rounding_m = given.rounded.map(|mm| mm * M_PER_MM);
    Setting { stand: given.stand, surroundings: given.scene, rounding_m }
}

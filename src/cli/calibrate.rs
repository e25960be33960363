//! `calibrate`: fabrics fitted to a manifest's measured drapes.

use std::path::PathBuf;

use anyhow::anyhow;

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::base::units::M_PER_MM;
use scan2params::batch::calibrations::{self, Calibrated, CalibrationsError};
use scan2params::calibrate::manifest::{self, Entry, Kind, ManifestError};
use scan2params::calibrate::run::{CalibrateError, Options, Told};
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params::report::calibration;
use scan2params::report::page::calibration::Source;

pub(crate) fn run(given: &args::Calibrate) -> Outcome {
    output::check_folder(&given.out).map_err(Failure::of_output)?;
    let entries = manifest::read(&given.manifest).map_err(|error| match error {
        ManifestError::Io { .. } => Failure::from(error),
        other => Failure::usage(other),
    })?;
    let inputs: Vec<_> = entries.iter().map(|entry| entry.path.clone()).collect();
    let inputs = [inputs, vec![given.manifest.clone()]].concat();
    calibration::check(&given.out, &inputs).map_err(Failure::of_output)?;
    let options = options_of(given, &entries)?;
    let working = Working::on("reading the manifest's files");
    let tell = |told: Told<'_>| working.now(told.to_string());
    let told = calibrations::run(&entries, &options, &given.out, &tell);
    drop(working);
    let found = told.map_err(|error| match error {
        CalibrationsError::Calibrate(CalibrateError::TwoDensities { .. }) => Failure::usage(error),
        other => Failure::from(other),
    })?;
    if found.kept > 0 {
        eprintln!("kept {} of {} fabrics from an earlier run", found.kept, found.sections.len());
    }
    let page = (!given.no_report).then(|| write_page(given, &options, &found)).transpose()?;
    if given.json {
        println!(
            "{}",
            serde_json::to_string_pretty(&calibration::json(&found.sections, &found.refused))?
        );
    } else {
        print!("{}", calibration::table(&found.sections));
    }
    let files = &found.written;
    eprintln!("wrote {} and {} files next to it", files[0].display(), files.len() - 1);
    if let Some(page) = page {
        eprintln!("wrote {}", page.display());
    }
    for refused in &found.refused {
        warning!(
            "warning: {}:{}: {}: {}",
            given.manifest.display(),
            refused.line,
            refused.name,
            refused.why
        );
    }
    let failed = found.sections.iter().filter(|section| !section.fitted).count();
    if failed + found.refused.len() > 0 {
        let files = found.refused.len();
        return Err(Failure::partial(anyhow!(
            "{files} files not used, {failed} fabrics not fitted"
        )));
    }
    Ok(())
}

/// The settings of the fit that the flags ask for.
fn options_of(given: &args::Calibrate, entries: &[Entry]) -> Result<Options, Failure> {
    let prior = Mixture::named(&given.prior).map_err(Failure::usage)?;
    let without = given.without.clone();
    let mut options = Options { prior, without, ..Options::default() };
    options.fit.sim.vertices = given.vertices as usize;
    if let Some(percent) = given.scale_sigma {
        options.fit.scale_sigma = 0.01 * percent;
    }
    if let Some(edge_mm) = given.sensor_edge_mm {
        if entries.iter().all(|entry| entry.kind != Kind::Scan) {
            let why = "--sensor-edge-mm is of scans, and no row has kind scan; leave it out";
            return Err(Failure::usage(anyhow!("{}: {why}", given.manifest.display())));
        }
        options.fit.sensor_edge_m = edge_mm.map(|mm| mm * M_PER_MM);
    }
    if let Some(percent) = given.hold {
        options.fit.hold_per_m = 0.01 * percent / M_PER_MM;
        if percent == 0.0 {
            options.fit.scan_hold_sag_m = 0.0;
        }
    }
    Ok(options)
}

/// Writes the page, with the manifest's hash and all settings of the fit.
fn write_page(
    given: &args::Calibrate,
    options: &Options,
    found: &Calibrated,
) -> Result<PathBuf, Failure> {
    let source = Source::of(&given.manifest, &given.prior, options)?;
    Ok(calibration::write_page(&found.sections, &found.refused, &source, &given.out)?)
}

//! `simulate`: one drape.

use super::progress::Working;
use super::{Failure, Outcome, args};
use scan2params::base::boundary::Orientation;
use scan2params::base::clock::thread_cpu_s;
use scan2params::calibrate::cloth_file;
use scan2params::calibrate::effect::Cloth;
use scan2params::dataset::sheet_file::read_sheet;
use scan2params::io::{OutputError, boundary_csv, output};
use scan2params::report::json::Simulated;
use scan2params::sim::{Drape, Drop, DropStart, SimOptions, Stop, drape, rim_harmonics_m};
use scan2params::terminal::value::numerics;

pub(crate) fn run(given: &args::Simulate) -> Outcome {
    check_outputs(given).map_err(Failure::of_output)?;
    let cloth = cloth(&given.fabric)?;
    let fabric = cloth.fabric;
    let warnings = fabric.check().map_err(Failure::usage)?;
    for warning in warnings {
        warning!("warning: {warning}");
    }
    let (fabric, projected) = fabric.project_bending();
    if let Some(warning) = projected {
        warning!("warning: {warning}");
    }
    let experiment = given.experiment.experiment().map_err(Failure::usage)?;
    let experiment = cloth.experiment(&experiment, given.face.into());
    experiment.check().map_err(Failure::usage)?;
    let start = match &given.start {
        Some(path) => {
            let specimen = &experiment.specimen;
            let sheet = read_sheet(path, [specimen.warp_m, specimen.weft_m])?;
            DropStart::Surface(Box::new(sheet))
        }
        None => given.seed.map_or(DropStart::Canonical, DropStart::Perturbed),
    };
    let vertices = given.vertices as usize;
    let numerics = numerics(given.numerics);
    let options = SimOptions { vertices, experiment, numerics, ..SimOptions::default() };
    if given.threads.threads > 1 {
        eprintln!(
            "note: one drape is computed on one thread; --threads {} changes nothing",
            given.threads.threads
        );
    }
    let working = Working::on("simulating the drape");
    let cpu_before_s = thread_cpu_s();
    let drape = drape(&fabric, &Drop { start }, &options);
    let cpu_s = cpu_before_s.zip(thread_cpu_s()).map(|(before, after)| after - before);
    drop(working);
    scan2params::io::write_obj(&given.out, &drape.mesh())?;
    if let Some(path) = &given.boundary {
        boundary_csv::write_oriented(path, &drape.boundary, Orientation::Given)?;
    }
    for warning in &drape.warnings {
        warning!("warning: {warning}");
    }
    if drape.stop != Stop::AtRest {
        warning!("warning: the drape is not at rest ({})", drape.stop.name());
    }
    report(given, &drape, cpu_s)
}

/// Prints what became of the drape.
fn report(given: &args::Simulate, drape: &Drape, cpu_s: Option<f64>) -> Outcome {
    if given.json {
        let report = Simulated::of(drape, cpu_s);
        say(given, &serde_json::to_string_pretty(&report)?);
    } else {
        let cpu = cpu_s.map_or(String::new(), |s| format!(", {s:.1} CPU-s"));
        let text = format!(
            "{}: {} folds ({}), {} (largest net force {:.1e} N), energy {:.3} mJ, \
             {} intersections{cpu}",
            given.out.display(),
            drape.nodes,
            strongest_harmonics(drape),
            drape.stop.name(),
            drape.residual_n,
            drape.energy_j * 1e3,
            drape.intersections
        );
        say(given, &text);
    }
    Ok(())
}

/// The three largest harmonics of the rim, which tell the branch beside the folds.
fn strongest_harmonics(drape: &Drape) -> String {
    let mut harmonics: Vec<_> = rim_harmonics_m(&drape.boundary).into_iter().zip(1..).collect();
    harmonics.sort_by(|a, b| b.0.total_cmp(&a.0));
    let three = harmonics.iter().take(3).map(|(m, k)| format!("{k}: {:.1} mm", m * 1e3));
    format!("harmonics {}", three.collect::<Vec<_>>().join(", "))
}

/// Prints the report, beside a result that went to stdout itself.
fn say(given: &args::Simulate, report: &str) {
    let results = given.boundary.iter().chain([&given.out]);
    if results.into_iter().any(|path| output::is_stdout(path)) {
        eprintln!("{report}");
    } else {
        println!("{report}");
    }
}

/// Whether the results can be written, and lose nothing.
fn check_outputs(given: &args::Simulate) -> Result<(), OutputError> {
    let inputs: Vec<_> = given.fabric.params.iter().chain(&given.start).cloned().collect();
    output::check_named(&given.out, &[".obj"], &inputs)?;
    if let Some(boundary) = &given.boundary {
        output::check_distinct(&given.out, boundary)?;
        output::check_named(boundary, &[".csv"], &inputs)?;
    }
    Ok(())
}

/// The fabric of the flags, over that of the params file, with the effects that the file has.
fn cloth(flags: &args::FabricFlags) -> Result<Cloth, Failure> {
    if let Some(fabric) = flags.fabric() {
        let effects = flags.params.as_deref().map(cloth_file::read_effects).transpose()?;
        return Ok(Cloth { fabric, effects: effects.unwrap_or_default() });
    }
    let Some(path) = &flags.params else {
        return Err(Failure::usage(anyhow::anyhow!("give all seven parameters, or --params FILE")));
    };
    let given = [
        flags.stretch_weft,
        flags.stretch_warp,
        flags.shear,
        flags.bending_weft,
        flags.bending_warp,
        flags.bending_bias,
        flags.density,
    ];
    Ok(cloth_file::read(path, given)?)
}

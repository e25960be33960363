//! `simulate`: one drape.

use anyhow::Context as _;

use super::{Failure, Outcome, args};
use crate::fabric::Fabric;
use crate::report::evaluate::thread_cpu_s;
use crate::sim::{Drop, DropStart, SimOptions, Stop, drape};

pub(crate) fn run(given: &args::Simulate) -> Outcome {
    let fabric = fabric(&given.fabric)?;
    let warnings = fabric.check().map_err(Failure::usage)?;
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
    let (fabric, projected) = fabric.project_bending();
    if let Some(warning) = projected {
        eprintln!("warning: {warning}");
    }
    let start = given.seed.map_or(DropStart::Canonical, DropStart::Perturbed);
    let options = SimOptions { vertices: given.vertices as usize, ..SimOptions::default() };
    let cpu_before_s = thread_cpu_s();
    let drape = drape(&fabric, &Drop { start }, &options);
    let cpu_s = cpu_before_s.zip(thread_cpu_s()).map(|(before, after)| after - before);
    crate::io::write_obj(&given.out, &drape.mesh())?;
    if let Some(path) = &given.boundary {
        crate::io::boundary_csv::write(path, &drape.boundary)?;
    }
    for warning in &drape.warnings {
        eprintln!("warning: {warning}");
    }
    if drape.stop != Stop::AtRest {
        eprintln!("warning: the drape is not at rest ({})", drape.stop.name());
    }
    if given.json {
        let report = serde_json::json!({
            "stop": drape.stop.name(),
            "residual_n": drape.residual_n,
            "energy_j": drape.energy_j,
            "nodes": drape.nodes,
            "intersections": drape.intersections,
            "plate_clearance_mm": drape.plate_clearance_m * 1e3,
            "factorisations": drape.factorisations,
            "cpu_s": cpu_s,
        });
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!(
            "{}: {} folds, {} (largest net force {:.1e} N), energy {:.3} mJ, {} intersections",
            given.out.display(),
            drape.nodes,
            drape.stop.name(),
            drape.residual_n,
            drape.energy_j * 1e3,
            drape.intersections
        );
    }
    Ok(())
}

/// The fabric of the flags, over that of the params file.
fn fabric(flags: &args::FabricFlags) -> Result<Fabric, Failure> {
    if let Some(fabric) = flags.fabric() {
        return Ok(fabric);
    }
    let Some(path) = &flags.params else {
        return Err(Failure::usage(anyhow::anyhow!("give all seven parameters, or --params FILE")));
    };
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let file: serde_json::Value =
        serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let value = |flag: Option<f64>, pointer: &str| {
        flag.or_else(|| file.pointer(pointer).and_then(serde_json::Value::as_f64))
            .with_context(|| format!("{}: no number at {pointer}", path.display()))
    };
    Ok(Fabric::from_paper_units([
        value(flags.stretch_weft, "/parameters/stretch_weft/value")?,
        value(flags.stretch_warp, "/parameters/stretch_warp/value")?,
        value(flags.shear, "/parameters/shear/value")?,
        value(flags.bending_weft, "/parameters/bending_weft/value")?,
        value(flags.bending_warp, "/parameters/bending_warp/value")?,
        value(flags.bending_bias, "/parameters/bending_bias/value")?,
        value(flags.density, "/density/value")?,
    ]))
}

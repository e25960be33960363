//! `export` and `convert`: fabrics for other programs, and numbers in other units.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::anyhow;

use super::{Failure, Outcome, args};
use scan2params::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use scan2params::exchange::fab::{self, Take};
use scan2params::exchange::units::{self, Unit};
use scan2params::exchange::{self, ExchangeError, Exported, Mesh, Options, systems};
use scan2params::fabric::params::{self, Params};
use scan2params::io::output;
use scan2params::job::FailureKind;

pub(crate) fn export(given: &args::Export) -> Outcome {
    let inputs = [given.params.clone()];
    let endings = given.to.endings(given.scene);
    output::check_named(&given.out, endings, &inputs).map_err(Failure::of_output)?;
    let params = params::read(&given.params)?;
    let stem = stem(&given.out);
    let exported = exchange::export(given.to, &params, &options(given), &stem);
    let exported = exported.map_err(|error| of_exchange(error, &given.params))?;
    let companion = exported.companion.as_ref().map(|companion| {
        let path = given.out.with_file_name(exchange::companion_name(&stem, companion.ending));
        (path, companion.text.as_str())
    });
    if let Some((path, _)) = &companion {
        output::check_file(path, &inputs).map_err(Failure::of_output)?;
        output::check_distinct(&given.out, path).map_err(Failure::of_output)?;
    }
    for (path, text) in companion
        .iter()
        .map(|(path, text)| (path, *text))
        .chain([(&given.out, exported.text.as_str())])
    {
        scan2params::io::atomically(path, |out| out.write_all(text.as_bytes()))?;
    }
    tell(given, &params, &exported);
    for path in [Some(&given.out), companion.as_ref().map(|(path, _)| path)].into_iter().flatten() {
        if !output::is_stdout(path) {
            eprintln!("wrote {}", path.display());
        }
    }
    Ok(())
}

/// Prints the verdict, what of the fabric is lost, and notes.
fn tell(given: &args::Export, params: &Params, exported: &Exported) {
    if let Some(level) = params.level() {
        let grounds = params.grounds().join("; ");
        let because = if grounds.is_empty() { grounds } else { format!(": {grounds}") };
        eprintln!("verdict: {}{because}", level.replace('_', " "));
    }
    for lost in &exported.lost {
        eprintln!("lost: {lost}");
    }
    for note in &exported.notes {
        eprintln!("note: {note}");
    }
    if given.force {
        warning!("warning: --force exports the result with any verdict");
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn options(given: &args::Export) -> Options {
    let named = stem(&given.params);
    let named = named.strip_suffix(".params").unwrap_or(&named).to_owned();
    let made = std::fs::metadata(&given.params).and_then(|file| file.modified());
    Options {
        name: given.name.clone().unwrap_or(named),
        edge_m: given.edge_mm.map(|mm| mm * M_PER_MM),
        mesh: match given.mesh {
            args::MeshKind::Irregular => Mesh::Irregular,
            args::MeshKind::Grid => Mesh::Grid,
        },
        scene: given.scene,
        thickness_m: given.thickness_mm.map(|mm| mm * M_PER_MM),
        friction: given.friction,
        swap_warp_weft: given.swap_warp_weft,
        force: given.force,
        made: made.unwrap_or_else(|_| SystemTime::now()),
    }
}

/// A refused export: the verdict's exit code, a failure of the file, or a mistake in the flags.
fn of_exchange(error: ExchangeError, params: &Path) -> Failure {
    match error {
        ExchangeError::DoNotUse { .. } => {
            let error = anyhow!("{}: {error}", params.display());
            Failure::of_kind(FailureKind::Refused, error)
        }
        ExchangeError::Fabric(_) => anyhow!("{}: {error}", params.display()).into(),
        ExchangeError::Needs { .. }
        | ExchangeError::Given { .. }
        | ExchangeError::NoScene { .. } => Failure::usage(error),
    }
}

pub(crate) fn convert(given: &args::Convert) -> Outcome {
    let density = given.density.map(|density| density * KG_M2_PER_G_M2);
    let path = Path::new(&given.what);
    if given.unit.is_none() && path.is_file() && fab::is_one(path) {
        return measured(given, path, density);
    }
    if given.out.is_some() {
        let why = "--out is for a measured fabric: a .u3m, or its physics JSON";
        return Err(Failure::usage(anyhow!("{}: {why}", given.what)));
    }
    let (unit, to) = match (&given.unit, &given.to) {
        (Some(unit), Some(to)) => (unit, to),
        (None, Some(_)) if path.is_file() => {
            let why = "--to is for a number; without it a file is printed in all units";
            return Err(Failure::usage(anyhow!("{}: {why}", given.what)));
        }
        _ => return table(given),
    };
    let value: f64 = given.what.parse().map_err(|_| {
        Failure::usage(anyhow!(
            "`{}` is no number; write 0.012 or 1.2e-2, with a decimal point",
            given.what
        ))
    })?;
    let from = Unit::named(unit).map_err(Failure::usage)?;
    let to = Unit::named(to).map_err(Failure::usage)?;
    let converted = units::convert(value, &from, &to, density).map_err(Failure::usage)?;
    if given.json {
        let report = serde_json::json!({
            "given": { "value": value, "unit": from.name },
            "value": converted,
            "unit": to.name,
            "quantity": to.quantity.name(),
        });
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!("{} {}", systems::shown(converted), to.name);
    }
    Ok(())
}

/// What a tester says of a fabric, and the fabric as a params.json.
fn measured(given: &args::Convert, path: &Path, density_kg_m2: Option<f64>) -> Outcome {
    if let Some(out) = &given.out {
        output::check_named(out, &[".json"], &[path.to_owned()]).map_err(Failure::of_output)?;
    }
    let measured = fab::read(path)?;
    if let Some(out) = &given.out {
        let take = match given.values {
            Some(args::MeasuredValues::Recomputed) => Take::Recomputed,
            Some(args::MeasuredValues::Given) | None => Take::Given,
        };
        let fabric = measured.fabric(take, density_kg_m2);
        let fabric = fabric.map_err(|why| Failure::usage(anyhow!("{}: {why}", path.display())))?;
        fabric.check().map_err(|error| anyhow!("{}: {error}", path.display()))?;
        let text = serde_json::to_string_pretty(&measured.params_json(&fabric, take))?;
        scan2params::io::atomically(out, |out| writeln!(out, "{text}"))?;
    }
    let to_stdout = given.out.as_deref().is_some_and(output::is_stdout);
    let report = match given.json {
        true => serde_json::to_string_pretty(&measured.json())? + "\n",
        false => measured.text(),
    };
    if to_stdout {
        eprint!("{report}");
    } else {
        print!("{report}");
    }
    for note in measured.notes() {
        warning!("warning: {note}");
    }
    if let Some(out) = given.out.as_ref().filter(|_| !to_stdout) {
        eprintln!("wrote {}", out.display());
    }
    Ok(())
}

/// A whole params.json in all units.
fn table(given: &args::Convert) -> Outcome {
    let path = PathBuf::from(&given.what);
    if given.what.parse::<f64>().is_ok() && !path.exists() {
        let why = format!("give the unit of {} as well, and --to UNIT", given.what);
        return Err(Failure::usage(anyhow!(why)));
    }
    let params = params::read(&path)?;
    params.fabric.check().map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let rows = systems::rows(&params);
    if given.json {
        println!("{}", serde_json::to_string_pretty(&systems::json(&rows))?);
    } else {
        print!("{}", systems::text(&rows));
    }
    Ok(())
}

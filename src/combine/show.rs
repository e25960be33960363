//! A combination as JSON and as a table.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::{Combined, LeftOut, Used};
use crate::base::units::DENSITY_UNIT;

/// Version of the layout of the JSON.
pub const SCHEMA_VERSION: u32 = 2;

/// The combination as JSON. Stiffnesses and density stand where params.json has them, so that
/// `simulate --params` reads it.
#[must_use]
pub fn json(found: &Combined) -> Value {
    let mut parameters = Map::new();
    for p in &found.parameters {
        let value = json!({
            "symbol": p.symbol,
            "value": p.value,
            "unit": p.unit,
            "interval90": p.interval90,
            "mean": p.mean,
            "sd": p.sd,
            "cv_percent": p.cv_percent,
            "sd_ln_between": p.pooled.between,
            "sd_ln_stated": p.pooled.within,
            "in_range": p.in_range,
        });
        parameters.insert(p.key.to_owned(), value);
    }
    let densities = || found.used.iter().map(|used| used.drape.density_g_m2);
    let first = &found.used[0].drape;
    json!({
        "schema_version": SCHEMA_VERSION,
        "parameters": parameters,
        "density": {
            "value": found.density_g_m2,
            "unit": DENSITY_UNIT,
            "least": densities().fold(f64::INFINITY, f64::min),
            "most": densities().fold(0.0, f64::max),
        },
        "folds": {
            "drapes": found.folds.iter().map(|(folds, n)| (folds.to_string(), json!(n))).collect::<Map<_, _>>(),
            "modal": found.modal,
        },
        "drapes": found.used.iter().map(of_used).collect::<Vec<_>>(),
        "left_out": found.left_out.iter().map(of_left_out).collect::<Vec<_>>(),
        "notes": found.notes,
        "model": { "id": first.model[0], "sha256": first.model[1] },
        "simulator": { "numerics_version": first.numerics },
        "version": env!("CARGO_PKG_VERSION"),
        "note": "simulation parameters, not measured mechanical properties",
    })
}

fn of_used(used: &Used) -> Value {
    let drape = &used.drape;
    json!({
        "file": drape.file.display().to_string(),
        "input": drape.input,
        "folds": drape.folds,
        "verdict": drape.verdict,
        "grounds": drape.grounds,
        "refined": drape.refined,
        "tied_drape_mm": drape.rim_error_mm,
        "outlying": used.outlying,
    })
}

fn of_left_out(left_out: &LeftOut) -> Value {
    json!({
        "file": left_out.drape.file.display().to_string(),
        "input": left_out.drape.input,
        "reason": left_out.reason,
    })
}

/// The combination for people.
#[must_use]
pub fn table(found: &Combined) -> String {
    let (used, all) = (found.used.len(), found.used.len() + found.left_out.len());
    // Writing to a string cannot fail.
    let mut out = format!("drapes           {used} of {all}, {:.1} g/m^2\n", found.density_g_m2);
    let _ = writeln!(out, "folds            {}", folds(found));
    let _ = writeln!(
        out,
        "{:13} {:>10}  {:>23}  {:>9}  {:>6}  {:>7}  {:>6}  unit",
        "", "value", "90 % interval", "SD", "CV %", "between", "stated"
    );
    for p in &found.parameters {
        let ends = |[low, high]: [f64; 2]| format!("{} to {}", short(low), short(high));
        let sd = p.sd.map_or_else(|| "-".to_owned(), short);
        let cv = p.cv_percent.map_or_else(|| "-".to_owned(), |cv| format!("{cv:.1}"));
        let percent = |sigma: f64| format!("{:.1} %", 100.0 * sigma.exp_m1());
        let _ = writeln!(
            out,
            "{:13} {:>10}  {:>23}  {sd:>9}  {cv:>6}  {:>7}  {:>6}  {}{}",
            p.key,
            short(p.value),
            ends(p.interval90),
            percent(p.pooled.between),
            percent(p.pooled.within),
            p.unit,
            if p.in_range { "" } else { "  (out of range in some)" }
        );
    }
    for used in &found.used {
        let drape = &used.drape;
        let folds = drape.folds.map_or_else(|| "?".to_owned(), |n| n.to_string());
        let refined = if drape.refined { ", refined" } else { "" };
        let verdict = drape.verdict.replace('_', " ");
        let _ = writeln!(out, "  {}: {folds} folds, {verdict}{refined}", drape.file.display());
        for said in &used.outlying {
            let _ = writeln!(out, "    apart: {said}");
        }
    }
    for left_out in &found.left_out {
        let _ = writeln!(out, "  left out: {}: {}", left_out.drape.file.display(), left_out.reason);
    }
    for note in &found.notes {
        let _ = writeln!(out, "note: {note}");
    }
    out + "simulation parameters, not measured mechanical properties\n"
}

fn folds(found: &Combined) -> String {
    if found.folds.is_empty() {
        return "not known".to_owned();
    }
    let counts: Vec<String> =
        found.folds.iter().map(|(folds, drapes)| format!("{folds} in {drapes}")).collect();
    let modal =
        found.modal.map_or_else(|| "no count is commonest".to_owned(), |n| format!("mostly {n}"));
    format!("{modal} ({})", counts.join(", "))
}

/// Four significant digits.
fn short(value: f64) -> String {
    let decimals = (3 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

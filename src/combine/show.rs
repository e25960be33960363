//! A combination as JSON and as a table.

use std::fmt::Write as _;

use serde_json::Value;

use super::Combined;
use super::file::File;
use crate::fabric::params::NOTE;

/// The combination as JSON. Stiffnesses and density stand where params.json has them, so that
/// `simulate --params` reads it.
#[must_use]
pub fn json(found: &Combined) -> Value {
    serde_json::json!(File::of(found))
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
    out + NOTE + "\n"
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

//! What a tester says of a fabric, as a table for people and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::recompute::Recomputed;
use super::{DISAGREES, Measured, Stiffness};
use crate::base::units::{BENDING_UNIT, KG_M2_PER_G_M2, N_M_PER_G_MM2_S2, N_M_PER_G_S2};
use crate::exchange::systems::shown;
use crate::exchange::units::NM_PER_DYN_CM;
use crate::fabric::TABLE_2;

/// The tester's unit of a stiffness, and one of it and of the paper's in SI.
fn units(stiffness: &Stiffness) -> (&'static str, f64, &'static str, f64) {
    let paper = TABLE_2.iter().find(|range| range.key == stiffness.key);
    match paper.map_or(BENDING_UNIT, |range| range.unit) {
        BENDING_UNIT => ("dyn cm", NM_PER_DYN_CM, BENDING_UNIT, N_M_PER_G_MM2_S2),
        stretch => ("N/m", 1.0, stretch, N_M_PER_G_S2),
    }
}

impl Measured {
    /// A line per stiffness: given, recomputed with its range over the cycles, their difference,
    /// and the recomputed value in the paper's unit.
    #[must_use]
    pub fn text(&self) -> String {
        let name = if self.name.is_empty() { "a fabric without a name" } else { &self.name };
        let tester = self.tester.map_or_else(String::new, |serial| format!(" no. {serial}"));
        let mut out = format!("{name}, of Browzwear's Fabric Analyzer{tester}\n");
        let _ = writeln!(
            out,
            "{:<13} {:>8} {:>11} {:>19}  {:<7} {:>6} {:>11}  unit",
            "parameter", "given", "recomputed", "cycles", "unit", "diff", "recomputed"
        );
        for stiffness in &self.stiffnesses {
            let (unit, own, paper_unit, paper) = units(stiffness);
            let given = stiffness.given.map_or("-".to_owned(), |si| shown(si / own));
            let of = |si: f64, unit: f64| shown(si / unit);
            let (recomputed, cycles, in_paper) = match &stiffness.recomputed {
                Ok(Recomputed { value, range: [low, high] }) => (
                    of(*value, own),
                    format!("{} .. {}", of(*low, own), of(*high, own)),
                    of(*value, paper),
                ),
                Err(_) => ("-".to_owned(), String::new(), "-".to_owned()),
            };
            let difference = stiffness.difference();
            let difference = difference
                .map_or("-".to_owned(), |d| format!("{:+.0} %", (100.0 * d).round() + 0.0));
            let _ = writeln!(
                out,
                "{:<13} {given:>8} {recomputed:>11} {cycles:>19}  {unit:<7} {difference:>6} \
                 {in_paper:>11}  {paper_unit}",
                stiffness.key
            );
        }
        let density = self.density_kg_m2.map(|density| shown(density / KG_M2_PER_G_M2));
        let _ = writeln!(
            out,
            "{:<13} {:>8} {:>40} g/m^2",
            "density",
            density.unwrap_or("-".into()),
            ""
        );
        out
    }

    /// What is to be known of the values: disagreements, what could not be recomputed, and what the
    /// file itself warns of.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for stiffness in &self.stiffnesses {
            let key = stiffness.key;
            if let Some(d) = stiffness.difference().filter(|d| d.abs() > DISAGREES) {
                notes.push(format!(
                    "{key}: the series give a value {:+.0} % off the given one (allowed: {:.0} %); \
                     its law is not public, so try both (--values given, --values recomputed)",
                    100.0 * d,
                    100.0 * DISAGREES
                ));
            }
            if let Err(why) = &stiffness.recomputed {
                notes.push(format!("{key} is not recomputed: {why}"));
            }
        }
        notes.extend(self.warnings.iter().map(|warned| format!("the file warns: {warned}")));
        notes
    }

    /// All of it as JSON.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut parameters = json!({});
        for stiffness in &self.stiffnesses {
            let (_, _, unit, paper) = units(stiffness);
            let recomputed = stiffness.recomputed.as_ref().ok();
            parameters[stiffness.key] = json!({
                "given": stiffness.given.map(|si| si / paper),
                "recomputed": recomputed.map(|found| found.value / paper),
                "cycles": recomputed.map(|found| found.range.map(|si| si / paper)),
                "difference": stiffness.difference(),
                "unit": unit,
            });
        }
        json!({
            "measured": {
                "name": self.name,
                "tester": self.tester,
                "parameters": parameters,
                "density_g_m2": self.density_kg_m2.map(|density| density / KG_M2_PER_G_M2),
                "thickness_mm": self.thickness_mm,
                "notes": self.notes(),
            }
        })
    }
}

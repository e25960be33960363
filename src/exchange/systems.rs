//! A fabric in the units of the paper, in SI, in those of textile laboratories and in CLO's.
//!
//! In: what a params.json says. Out: a row for each parameter, with its value and its 90 % interval
//! in each unit; bending also as the length (B / (rho g))^(1/3), with the interval of B alone,
//! since the density is weighed. A stiffness beyond CLO's slider has no position there.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::units::UNITS;
#[cfg(test)]
use super::units::Unit;
use crate::base::units::{BENDING_UNIT, DENSITY_UNIT, STRETCH_UNIT};
use crate::fabric::TABLE_2;
use crate::fabric::params::Params;

/// A parameter in all units.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name in files and options.
    pub key: &'static str,
    /// The paper's symbol.
    pub symbol: &'static str,
    /// The units.
    pub cells: Vec<Cell>,
}

/// A value in a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// `paper`, `si`, `textile`, `clo`, `clo_slider` or `bending_length`.
    pub system: &'static str,
    /// The unit's name.
    pub unit: &'static str,
    /// The value.
    pub value: f64,
    /// Its 90 % interval, where the file has one.
    pub interval90: Option<[f64; 2]>,
}

/// The systems of a kind of parameter, with their units.
type Systems = [(&'static str, &'static str); 5];

const STRETCH: Systems = [
    ("paper", STRETCH_UNIT),
    ("si", "N/m"),
    ("textile", "gf/cm"),
    ("clo", STRETCH_UNIT),
    ("clo_slider", "clo-slider"),
];
const SHEAR: Systems = [
    ("paper", STRETCH_UNIT),
    ("si", "N/m"),
    ("textile", "gf/(cm deg)"),
    ("clo", STRETCH_UNIT),
    ("clo_slider", "clo-slider"),
];
const BENDING: Systems = [
    ("paper", BENDING_UNIT),
    ("si", "N m"),
    ("textile", "gf cm^2/cm"),
    ("clo", BENDING_UNIT),
    ("bending_length", "mm"),
];
const DENSITY: [(&str, &str); 4] =
    [("paper", DENSITY_UNIT), ("si", "kg/m^2"), ("textile", "oz/yd^2"), ("clo", "g/mm^2")];

/// The parameters in the paper's order.
#[must_use]
pub fn rows(params: &Params) -> Vec<Row> {
    let si = params.fabric.in_si();
    let density = params.fabric.density_kg_m2;
    let paper = params.fabric.to_paper_units();
    TABLE_2
        .iter()
        .enumerate()
        .map(|(i, range)| {
            let systems: &[(&str, &str)] = match i {
                0 | 1 => &STRETCH,
                2 => &SHEAR,
                3..=5 => &BENDING,
                _ => &DENSITY,
            };
            let interval = params.interval90.get(i).copied().flatten();
            let cell = |&(system, name): &(&'static str, &'static str)| {
                let unit = UNITS.iter().find(|unit| unit.name == name)?;
                let of = |si: f64| unit.of_si(si, Some(density)).ok();
                let end = |end: f64| of(end * si[i] / paper[i]);
                let interval90 = interval.and_then(|[low, high]| Some([end(low)?, end(high)?]));
                Some(Cell { system, unit: unit.name, value: of(si[i])?, interval90 })
            };
            Row {
                key: range.key,
                symbol: range.symbol,
                cells: systems.iter().filter_map(cell).collect(),
            }
        })
        .collect()
}

/// Rows as JSON: for each parameter and system the unit, the value and the interval.
#[must_use]
pub fn json(rows: &[Row]) -> Value {
    let mut all = json!({});
    for row in rows {
        for cell in &row.cells {
            let mut of = json!({ "value": cell.value, "unit": cell.unit });
            if let Some(interval) = cell.interval90 {
                of["interval90"] = json!(interval);
            }
            all[row.key][cell.system] = of;
        }
    }
    all
}

/// Rows as a table for people: a line for each parameter in each unit.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let mut out = format!(
        "{:<14} {:<15} {:>12}   {:<26} unit\n",
        "parameter", "system", "value", "90 % interval"
    );
    for row in rows {
        for cell in &row.cells {
            let interval = cell.interval90.map_or_else(String::new, |[low, high]| {
                format!("{} .. {}", shown(low), shown(high))
            });
            // writing to a string cannot fail
            let _ = writeln!(
                out,
                "{:<14} {:<15} {:>12}   {interval:<26} {}",
                row.key,
                cell.system,
                shown(cell.value),
                cell.unit
            );
        }
    }
    out
}

/// Five significant digits.
#[must_use]
pub fn shown(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-4..=6).contains(&exponent) {
        return format!("{value:.4e}");
    }
    format!("{value:.*}", usize::try_from(4 - exponent).unwrap_or(0))
}

/// The unit of a name; those of this file are known.
#[cfg(test)]
fn unit(name: &str) -> Unit {
    Unit::named(name).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    #[test]
    fn every_unit_of_the_systems_is_known_and_every_number_goes_back() {
        let mut params = Params::of(Fabric::mean_knit());
        params.interval90[3] = Some([900.0, 1500.0]);
        let rows = rows(&params);
        let si = params.fabric.in_si();
        assert_eq!(
            rows.iter().map(|row| row.cells.len()).collect::<Vec<_>>(),
            [5, 5, 5, 5, 5, 5, 4]
        );
        for (row, si) in rows.iter().zip(si) {
            for cell in &row.cells {
                let back = unit(cell.unit).to_si(cell.value, Some(params.fabric.density_kg_m2));
                assert!((back.unwrap() / si - 1.0).abs() < 1e-9, "{} {}", row.key, cell.system);
            }
        }
        let [low, high] = rows[3].cells[1].interval90.unwrap();
        assert!((low - 9e-7).abs() < 1e-18 && (high - 1.5e-6).abs() < 1e-18);
        assert_eq!(rows[0].cells[0].interval90, None);
        let length = rows[3].cells[4];
        assert_eq!((length.system, length.value.round()), ("bending_length", 8.0));
    }

    #[test]
    fn five_digits() {
        for (value, text) in [
            (131_010.96, "131011"),
            (8.11, "8.1100"),
            (2.14e-4, "0.00021400"),
            (1.1e-6, "1.1000e-6"),
        ] {
            assert_eq!(shown(value), text);
        }
    }
}

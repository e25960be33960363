//! JSON and CSV with all that is known, in all units.
//!
//! JSON: what goes along with every target, and `systems`, the rows of [`super::systems`]. CSV: one
//! line for a parameter in a unit: parameter, symbol, system, unit, value, low and high of the 90 %
//! interval, verdict.

use serde_json::json;

use super::exported::{Exported, Options};
use super::{going_along, systems};
use crate::fabric::params::Params;

pub(super) fn json(params: &Params, options: &Options) -> Exported {
    let mut file = going_along::json(params, &[], &[]);
    file["name"] = json!(options.name);
    file["systems"] = systems::json(&systems::rows(params));
    Exported {
        text: going_along::text(&file),
        companion: None,
        lost: Vec::new(),
        notes: Vec::new(),
    }
}

pub(super) fn csv(params: &Params) -> Exported {
    let verdict = params.level().unwrap_or_default();
    let mut text = String::from("parameter,symbol,system,unit,value,low90,high90,verdict\n");
    for row in systems::rows(params) {
        for cell in &row.cells {
            let ends = cell.interval90.map_or_else(
                || [String::new(), String::new()],
                |interval| interval.map(going_along::number),
            );
            let [low, high] = ends;
            let value = going_along::number(cell.value);
            let fields =
                [row.key, row.symbol, cell.system, cell.unit, &value, &low, &high, verdict];
            text += &fields.map(quoted).join(",");
            text.push('\n');
        }
    }
    Exported { text, companion: None, lost: Vec::new(), notes: Vec::new() }
}

/// A field as RFC 4180 has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

//! What goes along with a fabric where a file has room for it: who made it, the verdict, the values
//! with their intervals, what is lost and what is to be known.

use serde_json::{Map, Value, json};

pub(super) use crate::fabric::params::NOTE;
use crate::fabric::params::Params;
use crate::fabric::{STIFFNESSES, TABLE_2};

/// Who made a file.
pub(super) fn made_by() -> String {
    concat!("scan2params ", env!("CARGO_PKG_VERSION")).to_owned()
}

/// All that goes along, as JSON; values in the paper's units.
pub(super) fn json(params: &Params, lost: &[String], notes: &[String]) -> Value {
    let values = params.fabric.to_paper_units();
    let parameters: Map<String, Value> = TABLE_2
        .iter()
        .enumerate()
        .map(|(i, range)| {
            let mut of = json!({ "value": values[i], "unit": range.unit });
            if let Some(interval) = params.interval90.get(i).copied().flatten() {
                of["interval90"] = json!(interval);
            }
            (range.key.to_owned(), of)
        })
        .collect();
    json!({
        "made_by": made_by(),
        "note": NOTE,
        "input": params.input,
        "model": params.model,
        "verdict": params.verdict,
        "parameters": parameters,
        "lost": lost,
        "notes": notes,
    })
}

/// The same as lines for a comment; a line holds no line feed.
pub(super) fn lines(params: &Params, lost: &[String], notes: &[String]) -> Vec<String> {
    let mut lines = vec![format!("{}: {NOTE}", made_by())];
    if let Some(input) = &params.input {
        lines.push(format!("of {input}"));
    }
    if let Some(level) = params.level() {
        lines.push(format!("verdict: {}", level.replace('_', " ")));
        lines.extend(params.grounds().iter().map(|ground| format!("  {ground}")));
    }
    let values = params.fabric.to_paper_units();
    for (i, range) in TABLE_2.iter().enumerate() {
        let interval = params.interval90.get(i).copied().flatten();
        let interval = interval
            .filter(|_| i < STIFFNESSES)
            .map_or(String::new(), |[low, high]| format!(", 90 % interval {low:.4} to {high:.4}"));
        lines.push(format!("{} = {:.4} {}{interval}", range.key, values[i], range.unit));
    }
    lines.extend(lost.iter().map(|what| format!("lost: {what}")));
    lines.extend(notes.iter().map(|what| format!("note: {what}")));
    lines.iter().map(|line| line.replace(['\n', '\r'], " ")).collect()
}

/// A number without the last digit or two, in which conversions leave their rounding.
fn tidy(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// A number for text formats, in the fewest digits that give it back but for rounding.
pub(super) fn number(value: f64) -> String {
    let value = tidy(value);
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        return format!("{value:e}");
    }
    format!("{value}")
}

/// JSON as the text of a file.
pub(super) fn text(value: &Value) -> String {
    format!("{:#}\n", tidied(value))
}

fn tidied(value: &Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or(Value::Null, |f| json!(tidy(f)))
        }
        Value::Array(items) => items.iter().map(tidied).collect(),
        Value::Object(fields) => {
            fields.iter().map(|(key, value)| (key.clone(), tidied(value))).collect()
        }
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_without_the_rounding_of_conversions_and_go_back() {
        for (value, text) in [
            (180.0 * 1e-6, "0.00018"),
            (0.1 + 0.2, "0.3"),
            (1.5e-6, "1.5e-6"),
            (380_000.0, "380000"),
            (4.2e9, "4.2e9"),
            (0.0, "0"),
        ] {
            assert_eq!(number(value), text);
        }
        for value in [std::f64::consts::PI * 1e-7, 131_010.96, 2.0_f64.sqrt() * 1e9] {
            let back: f64 = number(value).parse().unwrap();
            assert!((back / value - 1.0).abs() < 1e-14, "{value}");
        }
        assert_eq!(
            text(&json!({ "a": [180.0 * 1e-6, 3, null] })).split_whitespace().collect::<String>(),
            "{\"a\":[0.00018,3,null]}"
        );
    }
}

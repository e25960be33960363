//! The rows of a batch as CSV: one line per input, empty cells where there is no
//! result, and no times, so that an interrupted run ends with the same bytes.

use serde_json::Value;

use super::Row;
use crate::fabric::{STIFFNESSES, TABLE_2};

/// The table, title line first. Stiffnesses in the paper's units, which the titles
/// name.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut out = titles().join(",") + "\n";
    for row in rows {
        let cells: Vec<String> = cells(row).iter().map(|cell| quoted(cell)).collect();
        out += &(cells.join(",") + "\n");
    }
    out
}

/// Titles before and after those of the stiffnesses.
const BEFORE: [&str; 8] =
    ["file", "status", "exit_code", "verdict", "grounds", "reason", "density_g_m2", "orientation"];
const AFTER: [&str; 6] = [
    "observed_fraction",
    "novelty_mm",
    "tied_drape_mm",
    "released_drape_mm",
    "warnings",
    "input_sha256",
];

/// A file's name, or a text that begins with one, as a cell that no spreadsheet takes for a formula;
/// as a path it is the same.
fn harmless(file: &str) -> String {
    if file.starts_with(['=', '+', '-', '@']) { format!("./{file}") } else { file.to_owned() }
}

fn titles() -> Vec<String> {
    let mut titles: Vec<String> = BEFORE.map(String::from).into();
    for range in TABLE_2.iter().take(STIFFNESSES) {
        let unit = if range.key.starts_with("bending") { "g_mm2_s2" } else { "g_s2" };
        titles.push(format!("{}_{unit}", range.key));
        titles.extend(["low90", "high90", "in_range"].map(|end| format!("{}_{end}", range.key)));
    }
    titles.extend(AFTER.map(String::from));
    titles
}

fn cells(row: &Row) -> Vec<String> {
    let found = |pointer: &str| row.result.as_ref().and_then(|result| result.pointer(pointer));
    let cell = |pointer: &str| found(pointer).map(text).unwrap_or_default();
    let mut cells = vec![
        harmless(&row.file),
        row.status.name().to_owned(),
        row.exit_code.to_string(),
        row.verdict().unwrap_or_default().to_owned(),
        row.grounds().join("; "),
        row.reason.as_deref().map(harmless).unwrap_or_default(),
        row.density_g_m2.map(|d| d.to_string()).unwrap_or_default(),
        cell("/orientation"),
    ];
    for range in TABLE_2.iter().take(STIFFNESSES) {
        for part in ["value", "interval90/0", "interval90/1", "in_range"] {
            cells.push(cell(&format!("/parameters/{}/{part}", range.key)));
        }
    }
    let warnings = found("/warnings").and_then(Value::as_array);
    let warnings: Vec<String> = warnings.into_iter().flatten().map(text).collect();
    cells.extend([
        cell("/boundary/observed_fraction"),
        cell("/novelty/rms_mm"),
        cell("/tied_drape/rim_mean_mm"),
        cell("/released_drape/rim_mean_mm"),
        warnings.join("; "),
        row.input_sha256.clone().unwrap_or_default(),
    ]);
    cells
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

/// A cell as RFC 4180 has it; line breaks become blanks, so that a row is a line.
fn quoted(cell: &str) -> String {
    let cell = cell.replace(['\r', '\n'], " ");
    if cell.contains([',', '"']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell }
}

#[cfg(test)]
mod tests {
    use super::super::{Row, Status};
    use super::*;

    #[test]
    fn every_row_has_a_cell_for_every_title_and_reads_back() {
        let ok = Row {
            density_g_m2: Some(214.0),
            result: Some(serde_json::json!({
                "orientation": "given",
                "verdict": { "level": "doubtful", "not_the_experiment": false, "grounds": [
                    { "code": "novel_rim", "level": "doubtful" },
                    { "code": "out_of_range", "level": "doubtful" },
                    { "code": "out_of_range", "level": "doubtful" },
                    { "code": "rim_from_file", "level": "reliable" },
                ] },
                "parameters": { "shear": { "value": 1.5, "interval90": [1, 2], "in_range": true } },
                "warnings": ["one, two", "three"],
            })),
            ..Row::new("sub/a.ply", Status::Ok)
        };
        let reason = Some("no \"plate\", at\nall".to_owned());
        let refused = Row { reason, ..Row::new("=b.ply", Status::Refused) };
        let text = csv(&[ok, refused]);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let titles = reader.headers().unwrap().clone();
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        let cell = |row: usize, title: &str| {
            rows[row][titles.iter().position(|t| t == title).unwrap()].to_owned()
        };
        assert_eq!(titles.len(), 38);
        assert_eq!((cell(0, "verdict"), cell(1, "verdict")), ("doubtful".into(), String::new()));
        assert_eq!(cell(0, "grounds"), "novel_rim; out_of_range");
        assert_eq!(cell(0, "shear_g_s2"), "1.5");
        assert_eq!(cell(0, "shear_high90"), "2");
        assert_eq!(cell(0, "bending_bias_g_mm2_s2"), "");
        assert_eq!(cell(0, "warnings"), "one, two; three");
        assert_eq!((cell(1, "status"), cell(1, "exit_code")), ("refused".into(), "4".into()));
        assert_eq!(cell(1, "file"), "./=b.ply", "no formula");
        assert_eq!(cell(1, "reason"), "no \"plate\", at all");
    }
}

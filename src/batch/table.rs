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

/// The rows as a short table for a terminal: verdict, whether weft and warp are known, and the
/// bending stiffnesses, which a drape shows best. [`csv()`] has all columns.
#[must_use]
pub fn overview(rows: &[Row]) -> String {
    let titles = ["scan", "verdict", "weft and warp", "bending weft", "warp", "bias"];
    let mut lines = vec![titles.map(String::from)];
    lines.extend(rows.iter().map(overview_cells));
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
    let widths: [usize; 6] = std::array::from_fn(|column| width(column).unwrap_or(0));
    let mut out = String::new();
    for line in &lines {
        let mut text = String::new();
        for (column, cell) in line.iter().enumerate() {
            let width = widths[column];
            // texts to the left, numbers to the right
            text +=
                &if column < 3 { format!("{cell:<width$}  ") } else { format!("{cell:>width$}  ") };
        }
        out += text.trim_end();
        out.push('\n');
    }
    out + "bending stiffnesses in g mm^2 s^-2 rad^-1; results.csv has all values with their intervals\n"
}

fn overview_cells(row: &Row) -> [String; 6] {
    let bending = |key: &str| {
        let value =
            row.result.as_ref().and_then(|r| r.pointer(&format!("/parameters/{key}/value")));
        value.and_then(Value::as_f64).map(|value| format!("{value:.0}")).unwrap_or_default()
    };
    let warp = match &row.result {
        None => "",
        Some(_) if row.is_warp_unknown() => "unknown",
        Some(_) => "known",
    };
    [
        row.file.clone(),
        row.verdict().map_or(row.status.name(), |level| level).replace('_', " "),
        warp.to_owned(),
        bending("bending_weft"),
        bending("bending_warp"),
        bending("bending_bias"),
    ]
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

/// A file's name, or a text that begins with one, as a cell that no spreadsheet takes for a
/// formula; as a path it is the same.
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
    fn the_overview_has_few_columns_and_says_where_weft_and_warp_are_unknown() {
        let row = |file: &str, orientation: &str| {
            let value = serde_json::json!({ "value": 1234.5 });
            let result = serde_json::json!({
                "orientation": orientation,
                "verdict": { "level": "do_not_use" },
                "parameters": { "bending_weft": value, "bending_warp": value, "bending_bias": value },
            });
            Row { result: Some(result), ..Row::new(file, Status::Ok) }
        };
        let rows =
            [row("a.ply", "ambiguous"), row("b.ply", "given"), Row::new("c.ply", Status::Refused)];
        let text = overview(&rows);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 5);
        assert!(lines.iter().all(|line| line.len() < 100 && !line.ends_with(' ')), "{text}");
        assert_eq!(
            lines[1].split_whitespace().collect::<Vec<_>>()[..5],
            ["a.ply", "do", "not", "use", "unknown"]
        );
        assert!(lines[1].contains("1234") && lines[2].contains("  known  "), "{text}");
        assert_eq!(lines[3], "c.ply  refused");
        assert_eq!(rows.iter().filter(|row| row.is_warp_unknown()).count(), 1);
    }

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

//! The page of a batch: its rows as `report::page::batch` shows them.
//!
//! In: the rows and the folder of results, from which overlays are taken where there are some: a
//! row that was kept from a run without pages has none. Out: `report.html`. No time is in it, so
//! that an interrupted batch ends with the same bytes.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value as Json;

use super::Row;
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::io::{self, WriteError};
use crate::job::verdict::Level;
use crate::report::page::batch::{Line, Value, page};
use crate::sim::NUMERICS_VERSION;

/// Its name in the folder of results.
pub(super) const NAME: &str = "report.html";

/// Writes the page of some rows into the folder of results.
pub(super) fn write(out: &Path, folder: &Path, rows: &[Row]) -> Result<PathBuf, WriteError> {
    let lines: Vec<Line> = rows.iter().map(|row| line(out, row)).collect();
    let whole = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let title = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let first = |pointer: &str| {
        let found = rows.iter().find_map(|row| row.result.as_ref()?.pointer(pointer)?.as_str());
        found.unwrap_or("none of the scans came to it").to_owned()
    };
    let facts = [
        ("Program", format!("scan2params {}", env!("CARGO_PKG_VERSION"))),
        ("Model", first("/model/id")),
        ("Model, SHA-256", first("/model/sha256")),
        ("Simulator", format!("numerics {NUMERICS_VERSION}")),
    ];
    let path = out.join(NAME);
    io::atomically(&path, |file| file.write_all(page(&title, &lines, &facts).as_bytes()))?;
    Ok(path)
}

fn line(out: &Path, row: &Row) -> Line {
    let found = |pointer: &str| row.result.as_ref().and_then(|result| result.pointer(pointer));
    let number = |pointer: &str| found(pointer).and_then(Json::as_f64);
    let level = row.verdict().and_then(|name| Level::ALL.into_iter().find(|l| l.name() == name));
    let grounds = found("/verdict/grounds").and_then(Json::as_array).into_iter().flatten();
    let against = grounds.filter(|ground| ground["level"] != Level::Reliable.name());
    let own = |ending: &str| out.join("files").join(format!("{}.{ending}", row.file));
    let paged = row.result.is_some() && own("report.html").is_file();
    Line {
        file: row.file.clone(),
        level,
        not_the_experiment: row.not_the_experiment(),
        warp_unknown: row.is_warp_unknown(),
        status: row.status.name(),
        reason: row.reason.clone(),
        grounds: against.filter_map(|g| Some(g["text"].as_str()?.to_owned())).collect(),
        density_g_m2: row.density_g_m2,
        values: values(&found),
        mean_error_mm: number("/tied_drape/rim_mean_mm").or(number("/released_drape/rim_mean_mm")),
        seen: number("/boundary/observed_fraction"),
        overlay_svg: level.and_then(|_| std::fs::read_to_string(own("overlay.svg")).ok()),
        page: paged.then(|| escaped(&format!("files/{}.report.html", row.file))),
    }
}

/// The six stiffnesses of a result.
fn values<'a>(found: &impl Fn(&str) -> Option<&'a Json>) -> Option<[Value; STIFFNESSES]> {
    let of = |k: usize| {
        let own = found(&format!("/parameters/{}", TABLE_2[k].key))?;
        let end = |k: usize| own["interval90"][k].as_f64();
        Some(Value {
            value: own["value"].as_f64()?,
            interval90: [end(0)?, end(1)?],
            in_range: own["in_range"].as_bool()?,
        })
    };
    let all: Option<Vec<Value>> = (0..STIFFNESSES).map(of).collect();
    all?.try_into().ok()
}

/// A path as an address: what is no letter, digit or mark of a path by its bytes.
fn escaped(path: &str) -> String {
    let mut out = String::new();
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            // writing to a string cannot fail
            let _ = write!(out, "%{byte:02X}");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::Status;
    use super::*;

    #[test]
    fn a_row_is_shown_with_its_files_and_what_speaks_against_it() {
        let folder = tempfile::tempdir().unwrap();
        let files = folder.path().join("files/sub");
        std::fs::create_dir_all(&files).unwrap();
        std::fs::write(files.join("a #1.ply.report.html"), "").unwrap();
        std::fs::write(files.join("a #1.ply.overlay.svg"), "<svg/>").unwrap();
        let parameter = |k: usize| serde_json::json!({ "value": k + 1, "interval90": [k, k + 2], "in_range": k > 0 });
        let parameters: serde_json::Map<String, Json> = TABLE_2[..STIFFNESSES]
            .iter()
            .enumerate()
            .map(|(k, r)| (r.key.to_owned(), parameter(k)))
            .collect();
        let grounds = serde_json::json!([
            { "code": "novel_rim", "level": "doubtful", "text": "far" },
            { "code": "rim_from_file", "level": "reliable", "text": "known" },
        ]);
        let verdict = serde_json::json!({ "level": "doubtful", "not_the_experiment": false, "grounds": grounds });
        let result = Some(serde_json::json!({ "parameters": parameters, "verdict": verdict }));
        let shown = line(folder.path(), &Row { result, ..Row::new("sub/a #1.ply", Status::Ok) });
        assert_eq!(shown.page.as_deref(), Some("files/sub/a%20%231.ply.report.html"));
        assert_eq!(
            (shown.overlay_svg.as_deref(), shown.level),
            (Some("<svg/>"), Some(Level::Doubtful))
        );
        assert_eq!(shown.grounds, ["far"]);
        let values = shown.values.unwrap();
        assert_eq!(
            (values[1].value, values[1].interval90, values[0].in_range),
            (2.0, [1.0, 3.0], false)
        );
        let none = line(folder.path(), &Row::new("b.ply", Status::Refused));
        assert!(none.values.is_none() && none.page.is_none() && none.level.is_none());
    }
}

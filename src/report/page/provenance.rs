//! Where a result comes from: the files by their hashes, the program, the model, the simulator,
//! every setting.

use std::path::Path;

use maud::{Markup, html};
use serde_json::Value;

use super::number;
use crate::fabric::sha256_hex;
use crate::io::{self, ReadError};
use crate::job::Outcome;
use crate::sim::NUMERICS_VERSION;

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Its path, as it was given.
    pub name: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Its size.
    pub bytes: usize,
}

/// The files that a scan consists of: one, or a list of views with its images.
///
/// # Errors
/// When one of them cannot be read.
pub fn files_of(scan: &Path) -> Result<Vec<InputFile>, ReadError> {
    let of = |path: &std::path::PathBuf| {
        let bytes = io::bytes_of(path)?;
        let name = path.display().to_string();
        Ok(InputFile { name, sha256: sha256_hex(&bytes), bytes: bytes.len() })
    };
    // the standard input is gone once it is read: it has no file to name
    if scan == Path::new("-") {
        return Ok(Vec::new());
    }
    io::files_of(scan)?.iter().map(of).collect()
}

/// The table of files.
pub(super) fn inputs(files: &[InputFile]) -> Markup {
    html! {
        @if !files.is_empty() {
            table .plain {
                caption { "Files read" }
                thead { tr { th scope="col" { "File" } th scope="col" .number { "Bytes" } th scope="col" { "SHA-256" } } }
                tbody {
                    @for file in files {
                        tr {
                            th scope="row" .path { (file.name) }
                            td .number { (number::count(file.bytes)) }
                            td { code .hash { (file.sha256) } }
                        }
                    }
                }
            }
        }
    }
}

/// Name and value of each thing that a result depends on.
pub(super) fn facts(facts: &[(&str, String)]) -> Markup {
    html! {
        dl .facts {
            @for (name, value) in facts {
                div { dt { (name) } dd { (value) } }
            }
        }
    }
}

/// Settings as text, folded away.
pub(super) fn settings(title: &str, value: &Value) -> Markup {
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    html! {
        details .settings {
            summary { (title) }
            pre tabindex="0" { code { (text) } }
        }
    }
}

/// The section of a scan's page.
pub(super) fn section(outcome: &Outcome, files: &[InputFile]) -> Markup {
    let all = [
        ("Program", format!("scan2params {}", env!("CARGO_PKG_VERSION"))),
        ("Model", outcome.model[0].clone()),
        ("Model, SHA-256", outcome.model[1].clone()),
        ("Simulator", format!("numerics {NUMERICS_VERSION}")),
        ("Seed", outcome.job.scan.seed.to_string()),
        (
            "Density",
            format!("{} g/m\u{b2}, given", number::significant(1e3 * outcome.job.density_kg_m2)),
        ),
        ("Refined", refined(outcome)),
    ];
    let read = serde_json::to_value(&outcome.job.read).unwrap_or_default();
    let scan = serde_json::to_value(&outcome.job.scan).unwrap_or_default();
    html! {
        section id="provenance" aria-labelledby="provenance-title" {
            h2 id="provenance-title" { "Provenance" }
            (inputs(files))
            (facts(&all))
            (settings("Settings of the scan path", &serde_json::json!({ "read": read, "scan": scan })))
        }
    }
}

fn refined(outcome: &Outcome) -> String {
    let Some(found) = &outcome.refinement else { return "no".to_owned() };
    let Ok(refined) = &found.result else { return "tried, nothing fitted".to_owned() };
    let taken = if found.taken().is_some() { "yes" } else { "tried, not taken" };
    let scans = match found.companions.len() {
        0 => String::new(),
        others => format!(", on {} scans together", others + 1),
    };
    format!("{taken}: {} after {} drapes{scans}", refined.ended.name(), refined.drapes)
}

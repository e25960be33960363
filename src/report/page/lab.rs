//! The laboratory's fields of a report: what no scan shows.
//!
//! In: a TOML or JSON file with some of the fields of [`Lab`], all of them texts. Out: the fields,
//! of which those that are not given are blank lines on the page, to be filled by hand when it is
//! printed.

use std::path::{Path, PathBuf};

use maud::{Markup, html};
use serde::Deserialize;

use crate::base::text;

/// What a laboratory says of a specimen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Lab {
    /// Which specimen of which fabric.
    pub specimen_id: String,
    /// Fibres and their shares.
    pub composition: String,
    /// Knit or woven, and which.
    pub construction: String,
    /// Thickness with its unit and pressure.
    pub thickness: String,
    /// Which face was up.
    pub face: String,
    /// How the warp was marked.
    pub warp_marked: String,
    /// Temperature, humidity, hours.
    pub conditioning: String,
    /// What scanned it.
    pub scanner: String,
    /// Who did it.
    pub operator: String,
    /// When.
    pub date: String,
    /// Anything else.
    pub remarks: String,
}

/// Why a file of the laboratory's fields cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// It cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is not of the form.
    #[error(
        "{}: {fault}; write texts for some of specimen_id, composition, construction, thickness, face, warp_marked, \
         conditioning, scanner, operator, date, remarks",
        path.display()
    )]
    Form {
        /// The file.
        path: PathBuf,
        /// What is wrong, with its line.
        fault: String,
    },
}

/// Reads the fields: JSON where the name ends in `.json`, TOML otherwise.
///
/// # Errors
/// When the file cannot be read, or has other fields than [`Lab`], or one that is no text.
pub fn read(path: &Path) -> Result<Lab, LabError> {
    let io = |source| LabError::Io { path: path.to_owned(), source };
    let text = text::read_to_string(path).map_err(io)?;
    let json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let form = |fault: String| LabError::Form { path: path.to_owned(), fault };
    if json {
        serde_json::from_str(&text).map_err(|fault| form(fault.to_string()))
    } else {
        toml::from_str(&text).map_err(|fault| form(fault.to_string().trim().replace('\n', " ")))
    }
}

/// The section with the fields.
pub(super) fn section(lab: &Lab) -> Markup {
    let short = [
        ("Specimen", &lab.specimen_id),
        ("Composition", &lab.composition),
        ("Construction", &lab.construction),
        ("Thickness", &lab.thickness),
        ("Face up", &lab.face),
        ("Warp marked by", &lab.warp_marked),
        ("Conditioning", &lab.conditioning),
        ("Scanner", &lab.scanner),
        ("Operator", &lab.operator),
        ("Date", &lab.date),
    ];
    html! {
        section id="laboratory" aria-labelledby="laboratory-title" {
            h2 id="laboratory-title" { "Laboratory" }
            dl .fields {
                @for (name, value) in short { (field(name, value, false)) }
                (field("Remarks", &lab.remarks, true))
            }
        }
    }
}

fn field(name: &str, value: &str, wide: bool) -> Markup {
    html! {
        div .wide[wide] {
            dt { (name) }
            @if value.trim().is_empty() {
                dd .blank { span .unseen { "not given" } }
            } @else {
                dd { (value) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_are_read_and_faults_name_file_and_fields() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let toml = write("lab.toml", "specimen_id = \"K <7>\"\nremarks = \"a & b\"\n");
        let json = write("lab.json", r#"{ "specimen_id": "K <7>", "remarks": "a & b" }"#);
        let lab = read(&toml).unwrap();
        assert_eq!((lab.specimen_id.as_str(), lab.operator.as_str()), ("K <7>", ""));
        assert_eq!(read(&json).unwrap(), lab);
        let page = section(&lab).into_string();
        assert!(page.contains("K &lt;7&gt;") && page.contains("a &amp; b"), "{page}");
        assert_eq!(page.matches("not given").count(), 9);
        let unknown = read(&write("other.toml", "specimen = \"K7\"\n")).unwrap_err().to_string();
        assert!(unknown.contains("other.toml") && unknown.contains("specimen_id"), "{unknown}");
        let number = read(&write("n.json", r#"{ "thickness": 1 }"#)).unwrap_err().to_string();
        assert!(number.contains("n.json") && number.contains("write texts"), "{number}");
        let absent = read(&folder.path().join("absent.toml")).unwrap_err().to_string();
        assert!(absent.contains("absent.toml") && absent.contains("check the path"), "{absent}");
    }
}

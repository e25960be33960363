//! The manifest: a table of what was measured of which fabric, one row per file.
//!
//! In: CSV with a title line that names, in any order, `file, kind, fabric, specimen, face,
//! capture, density_g_m2, experiment, mm_per_pixel, role, warp_toward, observation,
//! camera_height_mm`; a column may be missing where every cell would be empty. Commas, semicolons
//! or tabs; lines that begin with `#` are passed over. Out: the rows in SI, in the file's order.
//! What is empty is unknown, but for file, kind, fabric and role, which every row has.
//!
//! All faults are told at once, each with line, column and remedy. Nothing is looked up: whether
//! the files are there is found out when they are read.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::base::text;
use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::fabric::DENSITY_LIMITS_G_M2;
use crate::io::table::{Layout, Rows};

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Kind {
    /// A picture of the drape from above, figure against background.
    Silhouette,
    /// A depth scan.
    Scan,
    /// A rim of 244 points.
    Boundary,
}

impl Kind {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Silhouette => "silhouette",
            Self::Scan => "scan",
            Self::Boundary => "boundary",
        }
    }
}

/// Which side of the cloth is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Face {
    /// The face.
    Up,
    /// The back: the specimen is turned over.
    Down,
}

impl Face {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Down => "down",
        }
    }
}

/// Which specimen on which plate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bench {
    /// A disc of radius 150 mm on a plate of radius 90 mm.
    Cusick,
    /// A square of 300 mm on a plate of radius 50 mm.
    Square,
}

/// What a drape is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Role {
    /// The fabric is fitted to it.
    Fit,
    /// It is predicted.
    Holdout,
}

impl Role {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Holdout => "holdout",
        }
    }
}

/// One row.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Line of the manifest, counted from 1.
    pub line: usize,
    /// The file, as it is written.
    pub name: String,
    /// The file, from the manifest's folder.
    pub path: PathBuf,
    /// What it holds.
    pub kind: Kind,
    /// Name of the fabric.
    pub fabric: String,
    /// Name of the specimen.
    pub specimen: Option<String>,
    /// Which side is up.
    pub face: Option<Face>,
    /// Number or name of the capture: two captures of one specimen and face are one drape seen
    /// twice, or dropped twice.
    pub capture: Option<String>,
    /// Areal density \[kg/m^2\].
    pub density_kg_m2: Option<f64>,
    /// Specimen and plate.
    pub bench: Option<Bench>,
    /// Extent of a pixel of a silhouette on the plate's plane \[m\].
    pub pixel_m: Option<f64>,
    /// What it is used for.
    pub role: Role,
    /// Where the warp points, as it is written.
    pub warp_toward: Option<String>,
    /// Which look at this drape it is since it was laid, from 1 on: between them it settles.
    pub observation: Option<u32>,
    /// Height above the plate's face from which a picture is taken \[m\].
    pub camera_height_m: Option<f64>,
}

impl Entry {
    /// The independent unit that the file belongs to: fabric, specimen and face; captures of one
    /// unit share it.
    #[must_use]
    pub fn unit(&self) -> (&str, Option<&str>, Option<Face>) {
        (&self.fabric, self.specimen.as_deref(), self.face)
    }
}

/// A fault of one cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManifestFault {
    /// Line, counted from 1.
    pub line: usize,
    /// Name of the column.
    pub column: &'static str,
    /// What is wrong and what to write.
    pub what: String,
}

/// Why a manifest cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// It cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Io {
        /// The manifest.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is no text.
    #[error("{}: not UTF-8 text at byte {byte}; save it as `CSV UTF-8`", path.display())]
    NotText {
        /// The manifest.
        path: PathBuf,
        /// The first byte that is none.
        byte: usize,
    },
    /// Some rows are at fault: all of them.
    #[error("{}", listed(path, faults))]
    Faults {
        /// The manifest.
        path: PathBuf,
        /// The faults, at least one.
        faults: Vec<ManifestFault>,
    },
}

fn listed(path: &Path, faults: &[ManifestFault]) -> String {
    let said = faults.iter().map(|fault| {
        let ManifestFault { line, column, what } = fault;
        format!("{}:{line}: {column}: {what}", path.display())
    });
    said.collect::<Vec<_>>().join("\n")
}

/// The columns, in the order of a row's cells.
const COLUMNS: [&str; 13] = [
    "file",
    "kind",
    "fabric",
    "specimen",
    "face",
    "capture",
    "density_g_m2",
    "experiment",
    "mm_per_pixel",
    "role",
    "warp_toward",
    "observation",
    "camera_height_mm",
];

/// Those that must be there.
const NEEDED: [&str; 4] = ["file", "kind", "fabric", "role"];

/// Limits of a pixel's extent \[mm\]: finer than any camera resolves, coarser than shows a fold.
const PIXEL_LIMITS_MM: [f64; 2] = [0.005, 10.0];

/// Limits of a camera's height \[mm\]: nearer it sees the plate's edge alone, farther off no
/// perspective is left.
const CAMERA_LIMITS_MM: [f64; 2] = [200.0, 100_000.0];
/// Most looks at one drape.
const OBSERVATIONS: f64 = 1e6;

/// Reads the manifest.
///
/// # Errors
/// [`ManifestError`], with every fault of the table.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Entry>, ManifestError> {
    let path = path.as_ref();
    let bytes =
        text::read(path).map_err(|source| ManifestError::Io { path: path.to_owned(), source })?;
    let text = std::str::from_utf8(&bytes).map_err(|error| ManifestError::NotText {
        path: path.to_owned(),
        byte: error.valid_up_to(),
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(text, folder).map_err(|faults| ManifestError::Faults { path: path.to_owned(), faults })
}

fn parse(text: &str, folder: &Path) -> Result<Vec<Entry>, Vec<ManifestFault>> {
    let first = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let separates = |mark: &&u8| first.is_some_and(|line| line.as_bytes().contains(mark));
    let delimiter = [b';', b'\t'].iter().find(separates).copied().unwrap_or(b',');
    let mut table = Rows::new(text.as_bytes(), Layout { delimiter, comment: Some(b'#') });
    let Some((line, title)) = table.next() else {
        let what = "the table is empty; write a title line and one row per file".to_owned();
        return Err(vec![ManifestFault { line: 1, column: "file", what }]);
    };
    let places = places_of(line, title)?;
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    let mut seen: HashMap<String, usize> = HashMap::new();
    while let Some((line, record)) = table.next() {
        let cell = |k: usize| {
            let bytes = places[k].and_then(|at| record.get(at)).unwrap_or_default();
            std::str::from_utf8(bytes).unwrap_or_default()
        };
        let cells = std::array::from_fn(cell);
        let mut cells = Cells { line, cells, delimiter, faults: &mut faults };
        let Some(entry) = cells.entry(folder) else { continue };
        if let Some(before) = seen.insert(entry.name.clone(), line) {
            let what = format!("`{}` stands in line {before} already; keep one row", entry.name);
            faults.push(ManifestFault { line, column: "file", what });
        }
        rows.push(entry);
    }
    if rows.is_empty() && faults.is_empty() {
        let what = "no rows; write one row per file".to_owned();
        faults.push(ManifestFault { line, column: "file", what });
    }
    if faults.is_empty() { Ok(rows) } else { Err(faults) }
}

/// Where each column stands.
fn places_of(
    line: usize,
    title: &csv::ByteRecord,
) -> Result<[Option<usize>; 13], Vec<ManifestFault>> {
    let names: Vec<String> =
        title.iter().map(|cell| String::from_utf8_lossy(cell).to_ascii_lowercase()).collect();
    let mut faults = Vec::new();
    for (at, name) in names.iter().enumerate() {
        let known = COLUMNS.iter().find(|known| *known == name);
        let twice = names[..at].contains(name);
        if !name.is_empty() && (known.is_none() || twice) {
            let what = if twice { "named twice" } else { "no such column" };
            let what = format!("`{name}`: {what}; the columns are {}", COLUMNS.join(","));
            faults.push(ManifestFault { line, column: known.copied().unwrap_or("title"), what });
        }
    }
    let places = COLUMNS.map(|column| names.iter().position(|name| name == column));
    for (column, place) in COLUMNS.iter().zip(places) {
        if place.is_none() && NEEDED.contains(column) {
            let what = format!("the title line lacks it; the columns are {}", COLUMNS.join(","));
            faults.push(ManifestFault { line, column, what });
        }
    }
    if faults.is_empty() { Ok(places) } else { Err(faults) }
}

/// The cells of one row, in the order of [`COLUMNS`].
struct Cells<'a, 'b> {
    line: usize,
    cells: [&'a str; 13],
    delimiter: u8,
    faults: &'b mut Vec<ManifestFault>,
}

impl<'a> Cells<'a, '_> {
    fn entry(&mut self, folder: &Path) -> Option<Entry> {
        let name = self.needed(0, "write the file's path, from the manifest's folder");
        let kinds =
            [("silhouette", Kind::Silhouette), ("scan", Kind::Scan), ("boundary", Kind::Boundary)];
        let kind = self.needed_word(1, &kinds);
        let fabric = self.needed(2, "write the fabric's name");
        let face = self.word(4, &[("up", Face::Up), ("down", Face::Down)]);
        let density_g_m2 = self.number(6, DENSITY_LIMITS_G_M2, "g/m^2");
        let bench = self.word(7, &[("cusick", Bench::Cusick), ("square", Bench::Square)]);
        let pixel_mm = self.number(8, PIXEL_LIMITS_MM, "mm");
        let role = self.needed_word(9, &[("fit", Role::Fit), ("holdout", Role::Holdout)]);
        if kind == Some(Kind::Silhouette) {
            self.needed(8, "a silhouette has no scale; write the mm of a pixel");
        }
        let observation = self.number(11, [1.0, OBSERVATIONS], "looks");
        if observation.is_some_and(|v| v.fract() != 0.0) {
            self.fault(11, "write a whole number, 1 for the fresh drape".to_owned());
        }
        let camera_height_mm = self.number(12, CAMERA_LIMITS_MM, "mm");
        let text = |k: usize| Some(self.cells[k]).filter(|t| !t.is_empty()).map(str::to_owned);
        let (specimen, capture, warp_toward) = (text(3), text(5), text(10));
        let pixel_m = pixel_mm.map(|v| v * M_PER_MM);
        let has_scale = kind? != Kind::Silhouette || pixel_m.is_some();
        has_scale.then_some(Entry {
            line: self.line,
            path: folder.join(name?),
            name: name?.to_owned(),
            kind: kind?,
            fabric: fabric?.to_owned(),
            specimen,
            face,
            capture,
            density_kg_m2: density_g_m2.map(|v| v * KG_M2_PER_G_M2),
            bench,
            pixel_m,
            role: role?,
            warp_toward,
            observation: observation.map(|v| v as u32),
            camera_height_m: camera_height_mm.map(|v| v * M_PER_MM),
        })
    }

    fn fault(&mut self, k: usize, what: String) {
        self.faults.push(ManifestFault { line: self.line, column: COLUMNS[k], what });
    }

    /// A cell that every row has.
    fn needed(&mut self, k: usize, remedy: &str) -> Option<&'a str> {
        let cell = self.cells[k];
        if cell.is_empty() {
            self.fault(k, format!("the cell is empty; {remedy}"));
        }
        Some(cell).filter(|cell| !cell.is_empty())
    }

    /// One of some words, or nothing where the cell is empty.
    fn word<T: Copy>(&mut self, k: usize, words: &[(&str, T)]) -> Option<T> {
        let cell = self.cells[k];
        let found = words.iter().find(|(word, _)| word.eq_ignore_ascii_case(cell));
        if found.is_none() && !cell.is_empty() {
            let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            self.fault(k, format!("`{cell}` is none of {}; write one of them", known.join(", ")));
        }
        found.map(|(_, value)| *value)
    }

    fn needed_word<T: Copy>(&mut self, k: usize, words: &[(&str, T)]) -> Option<T> {
        let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        self.needed(k, &format!("write one of {}", known.join(", ")))?;
        self.word(k, words)
    }

    /// A number within limits, or nothing where the cell is empty.
    fn number(&mut self, k: usize, [least, most]: [f64; 2], unit: &str) -> Option<f64> {
        let cell = self.cells[k];
        if cell.is_empty() {
            return None;
        }
        // a decimal comma, where commas do not separate
        let point = if self.delimiter == b',' { cell.to_owned() } else { cell.replace(',', ".") };
        let value = point.parse::<f64>().ok().filter(|v| (least..=most).contains(v));
        if value.is_none() {
            let what = format!("`{cell}` is no number from {least} to {most} {unit}; correct it");
            self.fault(k, format!("{what}, or leave the cell empty if it is not known"));
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Vec<Entry> {
        parse(text, Path::new("folder")).unwrap_or_else(|faults| panic!("{faults:?}"))
    }

    fn said(text: &str) -> String {
        listed(Path::new("m.csv"), &parse(text, Path::new("")).unwrap_err())
    }

    #[test]
    fn a_full_row_and_one_with_what_must_be_are_read() {
        let title = COLUMNS.join(",");
        let text = format!(
            "\u{feff}# from the bench\n{title}\n\
             a/1.png,silhouette,2,7,down,c3,192,cusick,1.39,fit,35\n\
             b.ply,Scan,wool,,,,,,,HOLDOUT,\n"
        );
        let rows = parsed(&text);
        let full = &rows[0];
        assert_eq!((full.line, full.path.as_path()), (3, Path::new("folder/a/1.png")));
        assert_eq!((full.kind, full.role), (Kind::Silhouette, Role::Fit));
        assert_eq!(full.unit(), ("2", Some("7"), Some(Face::Down)));
        assert_eq!(full.capture.as_deref(), Some("c3"));
        assert!((full.density_kg_m2.unwrap() - 0.192).abs() < 1e-15);
        assert!((full.pixel_m.unwrap() - 1.39e-3).abs() < 1e-15);
        assert_eq!((full.bench, full.warp_toward.as_deref()), (Some(Bench::Cusick), Some("35")));
        let bare = &rows[1];
        assert_eq!(
            (bare.kind, bare.role, bare.unit()),
            (Kind::Scan, Role::Holdout, ("wool", None, None))
        );
        assert!(bare.density_kg_m2.is_none() && bare.bench.is_none() && bare.pixel_m.is_none());
        // columns in any order, some missing, a decimal comma
        let german = "role;fabric;kind;mm_per_pixel;file\nfit;2;silhouette;1,39;x.png\n";
        assert!((parsed(german)[0].pixel_m.unwrap() - 1.39e-3).abs() < 1e-15);
    }

    #[test]
    fn every_fault_is_told_at_once_with_line_column_and_remedy() {
        let text = "file,kind,fabric,density_g_m2,mm_per_pixel,face,role\n\
                    a.png,silhouette,2,0.192,1.39,up,fit\n\
                    b.png,photo,2,192,1.39,front,fit\n\
                    c.png,silhouette,,192,,up,\n\
                    d.ply,scan,2,heavy,,up,fit\n\
                    e.ply,scan,2,,,up,fit\n\
                    e.ply,scan,2,,,up,fit\n";
        let said = said(text);
        for part in [
            "m.csv:2: density_g_m2: `0.192` is no number from 1 to 2000 g/m^2",
            "m.csv:3: kind: `photo` is none of silhouette, scan, boundary",
            "m.csv:3: face: `front` is none of up, down",
            "m.csv:4: fabric: the cell is empty; write the fabric's name",
            "m.csv:4: role: the cell is empty; write one of fit, holdout",
            "m.csv:4: mm_per_pixel: the cell is empty; a silhouette has no scale",
            "m.csv:5: density_g_m2: `heavy` is no number",
            "m.csv:7: file: `e.ply` stands in line 6 already",
        ] {
            assert!(said.contains(part), "{said}\nlacks {part:?}");
        }
        assert_eq!(said.lines().count(), 8, "{said}");
    }

    #[test]
    fn a_title_that_is_none_is_refused() {
        for (text, part) in [
            ("", "m.csv:1: file: the table is empty"),
            ("# nothing\n\nfile,kind,fabric,role\n", "m.csv:3: file: no rows"),
            ("file,kind,role\n", "m.csv:1: fabric: the title line lacks it"),
            ("file,kind,fabric,role,weight\n", "m.csv:1: title: `weight`: no such column"),
            ("file,kind,fabric,role,face,face\n", "m.csv:1: face: `face`: named twice"),
        ] {
            let said = said(text);
            assert!(said.contains(part), "{said:?} lacks {part:?}");
        }
    }
}

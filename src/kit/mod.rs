//! Everything that is needed to make the experiment: templates, stand, protocol.
//!
//! In: which experiment ([`Kind`]), the colour of the mark. Out: files, as bytes ([`files`]) or in
//! a folder ([`write()`]): cutting template and placement card as SVG and as PDF at 1:1 (one page
//! or tiles), the stand's parts as STL and as a dimensioned drawing, the protocol as Markdown and
//! HTML with the checklist of what is refused, and an example of the table that `batch` or
//! `calibrate` reads.
//!
//! Dimensions come from the simulator's [`crate::sim::Experiment`], limits from the scan path's
//! options: a kit is that of the version that wrote it. Nothing but specimen and plate is assumed
//! by an estimate; post, base and card are choices.
//!
//! Drawings are made once, as [`sheet::Sheet`]s, which `svg` and `pdf` write; the latter through
//! `pdf-writer`, which depends on four small crates. `svg2pdf` would parse again what is drawn
//! here.

pub mod bench;
pub mod checklist;
pub mod drawing;
pub mod pdf;
pub mod protocol;
pub mod sheet;
pub mod solid;
pub mod svg;
pub mod template;
pub mod tiles;

use std::path::{Path, PathBuf};

pub use bench::{Bench, Kind};

use crate::io::{self, WriteError};
use sheet::Sheet;
use tiles::PAPERS;

/// A file of a kit.
#[derive(Clone, Debug, PartialEq)]
pub struct File {
    /// Its name in the folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// The colour of the mark: its name in the protocol, and as it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// As `--mark` takes it.
    pub name: String,
    /// Red, green, blue.
    pub ink: sheet::Ink,
}

/// The files of a kit.
#[must_use]
pub fn files(kind: Kind, mark: &Mark) -> Vec<File> {
    let bench = Bench::of(kind);
    let mut files = Vec::new();
    let mut add = |name: String, bytes: Vec<u8>| files.push(File { name, bytes });
    let templates = template::all(&bench, mark.ink);
    let drawing = drawing::stand(&bench);
    for sheet in templates.iter().chain([&drawing]) {
        add(format!("{}.svg", sheet.name), svg::document(sheet).into_bytes());
    }
    for paper in PAPERS {
        let pages: Vec<pdf::Page> =
            templates.iter().flat_map(|sheet| tiles::pages(sheet, paper)).collect();
        let title = format!("scan2params kit: templates on {}", paper.name);
        add(format!("templates-{}.pdf", paper.name), pdf::document(&title, &pages));
    }
    add("stand.pdf".to_owned(), pdf::document(&drawing.title, &[whole(&drawing)]));
    for part in solid::parts(&bench) {
        add(format!("{}.stl", part.name), io::stl_bytes(&part.mesh()));
    }
    let text = protocol::markdown(&bench, &mark.name);
    add("protocol.html".to_owned(), protocol::html(&text).into_bytes());
    add("protocol.md".to_owned(), text.into_bytes());
    match kind {
        Kind::Square => add("densities.example.csv".to_owned(), protocol::densities().into_bytes()),
        Kind::Cusick => add("manifest.example.csv".to_owned(), protocol::manifest().into_bytes()),
    }
    files
}

/// A sheet as a page of the sheet's size.
fn whole(sheet: &Sheet) -> pdf::Page {
    let part = pdf::Placed { items: sheet.items.clone(), at_mm: [0.0; 2], clip_mm: None };
    pdf::Page { size_mm: sheet.size_mm, parts: vec![part] }
}

/// Writes files into `folder`, which is made if it is not there. Returns their paths.
///
/// # Errors
/// When the system refuses.
pub fn write(files: &[File], folder: &Path) -> Result<Vec<PathBuf>, WriteError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| WriteError { path: folder.to_owned(), source })?;
    let write = |file: &File| {
        let path = folder.join(&file.name);
        io::atomically(&path, |out| out.write_all(&file.bytes))?;
        Ok(path)
    };
    files.iter().map(write).collect()
}

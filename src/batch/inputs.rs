//! What a batch has to do: the scans of a folder, each with its density.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::error::BatchError;
use super::options::{BatchOptions, SCANS};
use crate::base::units::KG_M2_PER_G_M2;
use crate::fabric::check_density;
use crate::intake::rim::parse_warp_toward;
use crate::io::density_csv::{self, DensityRow};
use crate::io::{VIEWS_FILE, is_views_folder};
use crate::scan::WarpToward;

/// One scan of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Path in the folder, with slashes: the scan's name in every result.
    pub file: String,
    /// Where it is.
    pub path: PathBuf,
    /// Areal density \[kg/m^2\], from the table or for all.
    pub density_kg_m2: Option<f64>,
    /// Where its warp points, if the table says so.
    pub warp_toward: Option<WarpToward>,
    /// Why it cannot be done, if that is known already.
    pub fault: Option<String>,
}

/// What a folder has for a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// Its scans, in the order of their paths.
    pub scans: Vec<Input>,
    /// Files that somebody may take for scans and that are none by their names, likewise.
    pub passed_over: Vec<String>,
}

/// Whether there is a folder.
///
/// # Errors
/// A file, or nothing.
pub fn check_folder(path: &Path) -> Result<(), BatchError> {
    let path = path.to_owned();
    match fs::metadata(&path) {
        Ok(meta) if meta.is_dir() => Ok(()),
        Ok(_) => Err(BatchError::NotAFolder { path }),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            Err(BatchError::NoFolder { path })
        }
        Err(source) => Err(BatchError::Folder { path, source }),
    }
}

/// The scans of `options.folder` or of its shard, and its other files.
///
/// # Errors
/// When the folder cannot be listed, the density table is damaged, or nothing is
/// to be done.
pub fn inputs(options: &BatchOptions) -> Result<Inputs, BatchError> {
    check_folder(&options.folder)?;
    if let Some(density_kg_m2) = options.density_kg_m2 {
        check_density(density_kg_m2)?;
    }
    let rows = match &options.density_csv {
        Some(path) => density_csv::read(path)?,
        None => Vec::new(),
    };
    let listed = |source| BatchError::Folder { path: options.folder.clone(), source };
    let out = fs::canonicalize(&options.out).ok();
    let mut there = Inputs { scans: Vec::new(), passed_over: Vec::new() };
    list(&options.folder, "", out.as_deref(), &mut there).map_err(listed)?;
    let Inputs { scans: mut found, mut passed_over } = there;
    for input in &mut found {
        input.density_kg_m2 = options.density_kg_m2;
    }
    let table = options.density_csv.as_deref().unwrap_or(Path::new(""));
    let mut lines = HashMap::new();
    let mut names = Names::of(&found);
    for row in &rows {
        let at = apply(row, table, options, &mut found, &mut names)?;
        if let Some(first) = lines.insert(at, row.line) {
            let fault = format!(
                "`{}` is the scan that line {first} names already; keep one of both",
                row.file
            );
            return Err(BatchError::Table { path: table.to_owned(), line: row.line, fault });
        }
    }
    for input in found.iter_mut().filter(|input| input.density_kg_m2.is_none()) {
        let fault = match &options.density_csv {
            Some(table) => format!(
                "no density: {} has no row for `{}`; add one, or give --density for all others",
                table.display(),
                input.file
            ),
            None => "no density: give --density or --density-csv".to_owned(),
        };
        input.fault.get_or_insert(fault);
    }
    if found.is_empty() {
        return Err(BatchError::NoScans { folder: options.folder.clone() });
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    // the table names some whose names are not those of scans
    let taken: HashSet<&str> = found.iter().map(|input| input.file.as_str()).collect();
    passed_over.retain(|file| !taken.contains(file.as_str()));
    passed_over.sort();
    if let Some(shard) = options.shard() {
        let mut places = 0..;
        found.retain(|_| places.next().is_some_and(|place| shard.holds(place)));
    }
    Ok(Inputs { scans: found, passed_over })
}

/// Endings of what lies beside scans and is nobody's scan.
const NO_SCANS: [&str; 9] = ["csv", "json", "toml", "yaml", "yml", "md", "html", "pdf", "mtl"];

/// Whether somebody may take a file for a scan that is none by its name: it is neither a table, nor
/// a page, nor made by this program.
fn may_be_meant(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_made = name.contains(".truth.") || name.contains(".boundary.");
    !is_made && !NO_SCANS.contains(&extension(path).as_str())
}

/// Adds what `folder` has, whose path in the batch's folder is `prefix`. Hidden
/// entries, links to folders and the folder of results are passed over.
fn list(
    folder: &Path,
    prefix: &str,
    out: Option<&Path>,
    found: &mut Inputs,
) -> std::io::Result<()> {
    if out.is_some() && fs::canonicalize(folder).ok().as_deref() == out {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        let (path, file) = (entry.path(), format!("{prefix}{name}"));
        if is_views_folder(&path) {
            // The files in and below it are its views.
            found.scans.push(Input::new(file, path));
        } else if entry.file_type()?.is_dir() {
            // One folder that cannot be listed does not stop the others.
            if let Err(error) = list(&path, &format!("{file}/"), out, found) {
                let fault = format!("{}: cannot be listed ({error})", path.display());
                found.scans.push(Input { fault: Some(fault), ..Input::new(file, path) });
            }
        } else if is_scan(&path) {
            found.scans.push(Input::new(file, path));
        } else if may_be_meant(&path) {
            found.passed_over.push(file);
        }
    }
    Ok(())
}

fn is_scan(path: &Path) -> bool {
    // What `augment` writes beside its scans.
    let truth =
        path.file_stem().and_then(|stem| stem.to_str()).is_some_and(|s| s.ends_with(".truth"));
    !truth && SCANS.contains(&extension(path).as_str())
}

/// The ending of a name, in small letters.
fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

impl Input {
    fn new(file: String, path: PathBuf) -> Self {
        Self { file, path, density_kg_m2: None, warp_toward: None, fault: None }
    }
}

/// Gives the scan that a row of the table names its density; a scan that is not
/// there becomes an input with a fault. Returns the scan's place in `found`.
fn apply(
    row: &DensityRow,
    table: &Path,
    options: &BatchOptions,
    found: &mut Vec<Input>,
    names: &mut Names,
) -> Result<usize, BatchError> {
    let fault = |fault: String| {
        let (path, line) = (table.to_owned(), row.line);
        BatchError::Table { path, line, fault }
    };
    let density_kg_m2 = row.density_g_m2 * KG_M2_PER_G_M2;
    check_density(density_kg_m2).map_err(|error| fault(error.to_string()))?;
    let warp = row.warp_toward.as_deref().map(parse_warp_toward).transpose();
    let warp_toward = warp.map_err(|error| fault(format!("warp_toward: {error}")))?;
    let at = match names.find(&row.file, options, found).map_err(fault)? {
        Some(at) => at,
        None => {
            let file = normal(&row.file, &options.folder);
            let path = options.folder.join(&file);
            let missing = (!path.is_file() && !is_views_folder(&path)).then(|| {
                let (line, table) = (row.line, table.display());
                let meant = names.nearly(&file).map_or_else(String::new, |at| {
                    format!("; `{}` is there: write its name whole", found[at].file)
                });
                format!("{}: no such file; line {line} of {table} names it{meant}", path.display())
            });
            names.add(&file, found.len());
            found.push(Input { fault: missing, ..Input::new(file, path) });
            found.len() - 1
        }
    };
    let input = &mut found[at];
    (input.density_kg_m2, input.warp_toward) = (Some(density_kg_m2), warp_toward);
    Ok(at)
}

/// A cell as a path in the folder.
fn normal(cell: &str, folder: &Path) -> String {
    let inside = Path::new(cell).strip_prefix(folder).ok().and_then(Path::to_str);
    let cell = inside.unwrap_or(cell).replace('\\', "/");
    let cell = cell.strip_prefix("./").unwrap_or(&cell).trim_end_matches('/');
    // A folder of views goes by its own name.
    cell.strip_suffix(&format!("/{VIEWS_FILE}")).unwrap_or(cell).to_owned()
}

/// Where in a list the scans of a name are: tables of 100,000 rows are read.
#[derive(Default)]
struct Names {
    /// By path in the folder.
    by_path: HashMap<String, usize>,
    /// By the name alone: the first that has it, and the second if there is one.
    by_name: HashMap<String, (usize, Option<usize>)>,
    /// By path in small letters, whole and without its ending: likewise, of the scans that are
    /// there.
    by_near: HashMap<String, (usize, Option<usize>)>,
}

impl Names {
    fn of(found: &[Input]) -> Self {
        let mut names = Self::default();
        for (at, input) in found.iter().enumerate() {
            names.add(&input.file, at);
            let near = input.file.to_ascii_lowercase();
            let stem = near.rsplit_once('.').map(|(stem, _)| stem.to_owned());
            for name in stem.into_iter().chain([near]) {
                let known = names.by_near.entry(name).or_insert((at, None));
                if known.0 != at {
                    known.1.get_or_insert(at);
                }
            }
        }
        names
    }

    /// The one scan that is there whose name is this without its ending, or in other letter case.
    fn nearly(&self, cell: &str) -> Option<usize> {
        let (at, other) = self.by_near.get(&cell.to_ascii_lowercase())?;
        other.is_none().then_some(*at)
    }

    fn add(&mut self, file: &str, at: usize) {
        self.by_path.entry(file.to_owned()).or_insert(at);
        let name = file.rsplit('/').next().unwrap_or(file).to_owned();
        self.by_name
            .entry(name)
            .and_modify(|(_, second)| *second = second.or(Some(at)))
            .or_insert((at, None));
    }

    /// The scan that a cell names: by its path in the folder, or by its name alone if
    /// only one scan has it.
    fn find(
        &self,
        cell: &str,
        options: &BatchOptions,
        found: &[Input],
    ) -> Result<Option<usize>, String> {
        let cell = normal(cell, &options.folder);
        if let Some(&at) = self.by_path.get(&cell) {
            return Ok(Some(at));
        }
        match self.by_name.get(&cell) {
            Some(&(one, Some(other))) => Err(format!(
                "`{cell}` may be `{}` or `{}`; write the path in the folder",
                found[one].file, found[other].file
            )),
            one => Ok(one.map(|&(at, _)| at)),
        }
    }
}

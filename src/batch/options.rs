//! What a batch is to do.

use std::path::PathBuf;

use crate::io::ReadOptions;
use crate::scan::ScanOptions;

/// Files that are scans by their name alone, besides folders of views. Tables
/// (`.csv`, `.txt`), images and lists of views are taken only if the density table
/// names them: folders are full of others.
pub const SCANS: [&str; 11] =
    ["ply", "obj", "pcd", "stl", "glb", "e57", "las", "laz", "xyz", "asc", "pts"];

/// What to do, and where.
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// The folder; folders in it are looked into.
    pub folder: PathBuf,
    /// Folder of results; made if it is not there.
    pub out: PathBuf,
    /// Table of densities, see [`crate::io::density_csv`].
    pub density_csv: Option<PathBuf>,
    /// Areal density of the scans that the table does not name \[kg/m^2\].
    pub density_kg_m2: Option<f64>,
    /// What depth images do not say themselves.
    pub read: ReadOptions,
    /// How the scans are taken; the table's warp directions go before this one.
    pub scan: ScanOptions,
    /// Whether each answer is refined by the simulator; else it is the network's.
    pub refine: bool,
    /// Whether it is found out what each fabric's sheet does when nothing holds it to the scan.
    pub release: bool,
    /// Whether a result that is not to be used counts as a failure.
    pub strict: bool,
    /// Scans at once; 0 for one per core.
    pub threads: usize,
    /// Whether pages are written: of the whole, and of each scan that has an estimate.
    pub pages: bool,
}

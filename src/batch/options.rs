//! What a batch is to do.

use std::path::PathBuf;

use crate::base::Shard;
use crate::io::ReadOptions;
use crate::scan::ScanOptions;

/// Files that are scans by their name alone, besides folders of views. Tables
/// (`.csv`, `.txt`), images and lists of views are taken only if the density table
/// names them: folders are full of others.
pub const SCANS: [&str; 11] =
    ["ply", "obj", "pcd", "stl", "glb", "e57", "las", "laz", "xyz", "asc", "pts"];

/// What one run does of a batch that several machines may share: their folder of results is one, or
/// is brought together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Share {
    /// Every scan that no run has done yet; then the tables and the page.
    #[default]
    All,
    /// The scans at these places of the list, in order of their paths; no table, no page of the
    /// batch.
    Shard(Shard),
    /// No scan: the tables and the page, of what all runs have done.
    Merge,
}

/// What to do, and where.
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// The folder; folders in it are looked into.
    pub folder: PathBuf,
    /// Folder of results; made if it is not there.
    pub out: PathBuf,
    /// The part of it that is done here.
    pub share: Share,
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

impl BatchOptions {
    /// The shard that is done, of a batch that machines share.
    pub(super) fn shard(&self) -> Option<Shard> {
        match self.share {
            Share::Shard(shard) => Some(shard),
            Share::All | Share::Merge => None,
        }
    }
}

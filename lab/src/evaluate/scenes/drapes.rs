//! The drapes of the laboratory's scenes: a folder that is kept from run to run.
//!
//! In: a folder, a seed, which fabrics. Out: `PRIOR-SEED-INDEX-VERTICES.obj` (mm, simulation frame)
//! with its `.params.json` for each fabric, or `.failed` where the drape is none. Even indices are
//! drawn from the prior `measured`, odd ones from `knit-2020`. Each falls by a perturbed drop to
//! full rest. What is there is not made again, so that an interrupted run continues,
//! and several runs may share a folder, each with its own fabrics.
//!
//! Any other OBJ of a square grid in the folder is a drape too, such as another simulator's. Its
//! bending length is known if it has a `.params.json` next to it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use scan2params::base::Boundary;
use scan2params::dataset::drape_file::{DrapeFileError, read_drape, rim_of};
use scan2params::fabric::params::{self, ParamsError};
use scan2params::fabric::{Fabric, Mixture, MixtureError, TABLE_2};
use scan2params::geom::Mesh;
use scan2params::io::{self, WriteError, write_obj};
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::{Fall, SimOptions, Stop, drape};

/// Least vertices a side of a drape that scans of it pass for those of cloth.
pub const LEAST_VERTICES: usize = 101;

/// A drape of the folder.
#[derive(Clone, Debug)]
pub struct KeptDrape {
    /// Its file's name without the ending.
    pub name: String,
    /// The cloth, simulation frame \[m\].
    pub mesh: Mesh,
    /// Its true rim.
    pub rim: Boundary,
    /// Its fabric, if that is known.
    pub fabric: Option<Fabric>,
}

/// Why the folder gives no drapes.
#[derive(Debug, thiserror::Error)]
pub enum DrapesError {
    /// The folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It holds none.
    #[error("{}: no drapes in it; fill it with --make-drapes N", .0.display())]
    Empty(PathBuf),
    /// One cannot be read.
    #[error(transparent)]
    Drape(#[from] DrapeFileError),
    /// It is none of a square grid.
    #[error("{}: no square grid of vertices, so its rim is not known", .0.display())]
    NoGrid(PathBuf),
    /// Its parameters cannot be read.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// A prior gives no fabric.
    #[error(transparent)]
    Prior(#[from] MixtureError),
    /// A drape cannot be kept.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl KeptDrape {
    /// Its shortest bending length \[m\]; `None` if its fabric is not known.
    #[must_use]
    pub fn bending_length_m(&self) -> Option<f64> {
        self.fabric.as_ref().map(bending_length_m)
    }

    /// All drapes of a folder, in the order of their names.
    ///
    /// # Errors
    /// When there are none, or one cannot be read.
    pub fn all(folder: &Path) -> Result<Vec<Self>, DrapesError> {
        let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
            .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect())
            .map_err(|source| DrapesError::Folder { path: folder.to_owned(), source })?;
        paths.retain(|path| path.extension().is_some_and(|ending| ending == "obj"));
        paths.sort();
        if paths.is_empty() {
            return Err(DrapesError::Empty(folder.to_owned()));
        }
        paths.into_par_iter().map(|path| Self::read(&path)).collect()
    }

    fn read(path: &Path) -> Result<Self, DrapesError> {
        let mesh = read_drape(path)?;
        let rim = rim_of(&mesh).ok_or_else(|| DrapesError::NoGrid(path.to_owned()))?;
        let own = path.with_extension("params.json");
        let fabric = own.is_file().then(|| params::fabric(&own, [None; 7])).transpose()?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, mesh, rim, fabric })
    }
}

/// Fabrics that are draped into a folder.
#[derive(Clone, Debug)]
pub struct Filling {
    /// The folder; made if it is not there.
    pub folder: PathBuf,
    /// Seed of fabrics and drops.
    pub seed: u64,
    /// Which fabrics.
    pub fabrics: Range<u64>,
    /// Vertices a side.
    pub vertices: usize,
}

/// What became of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filled {
    /// It was there.
    Kept,
    /// It was made.
    Made,
    /// It did not come to rest, or crosses itself.
    Failed,
}

impl Filling {
    /// Makes what is missing, on all cores; `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first fabric or file that cannot be made.
    pub fn run(&self, tell: impl Fn(&str, Filled) + Sync) -> Result<Vec<Filled>, DrapesError> {
        std::fs::create_dir_all(&self.folder)
            .map_err(|source| DrapesError::Folder { path: self.folder.clone(), source })?;
        let priors = [Mixture::measured(), Mixture::knit_2020()];
        let fabrics: Vec<u64> = self.fabrics.clone().collect();
        let made = fabrics.into_par_iter().with_max_len(1).map(|index| {
            let prior = &priors[(index % 2) as usize];
            let name = format!("{}-{}-{index}-{}", prior.name(), self.seed, self.vertices);
            let filled = self.one(prior, index, &name)?;
            tell(&name, filled);
            Ok(filled)
        });
        made.collect()
    }

    fn one(&self, prior: &Mixture, index: u64, name: &str) -> Result<Filled, DrapesError> {
        let with = |ending: &str| self.folder.join(format!("{name}.{ending}"));
        let (sheet, failed) = (with("obj"), with("failed"));
        if sheet.is_file() {
            return Ok(Filled::Kept);
        }
        if failed.is_file() {
            return Ok(Filled::Failed);
        }
        let fabric = prior.sample(self.seed, index)?;
        let options = SimOptions { vertices: self.vertices, ..SimOptions::default() };
        let drop = Fall::Perturbed.drop(self.seed ^ index);
        let drape = drape(&fabric, &drop, &options);
        if drape.stop != Stop::AtRest || drape.intersections > 0 {
            let why = format!("{}, {} crossings", drape.stop.name(), drape.intersections);
            io::atomically(&failed, |out| writeln!(out, "{why}"))?;
            return Ok(Filled::Failed);
        }
        let params = params_json(&fabric);
        io::atomically(with("params.json"), |out| writeln!(out, "{params:#}"))?;
        write_obj(&sheet, &drape.mesh())?;
        Ok(Filled::Made)
    }
}

/// The seven parameters as `simulate --params` and `augment` read them.
fn params_json(fabric: &Fabric) -> Value {
    let values = fabric.to_paper_units();
    let entries = TABLE_2.iter().zip(values).take(6);
    let own: Map<String, Value> =
        entries.map(|(range, value)| (range.key.to_owned(), json!({ "value": value }))).collect();
    json!({ "parameters": own, "density": { "value": values[6] } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_filled_once_and_read_with_its_fabrics() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("drapes");
        assert!(matches!(KeptDrape::all(&folder), Err(DrapesError::Folder { .. })));
        let filling = Filling { folder: folder.clone(), seed: 3, fabrics: 0..2, vertices: 31 };
        let first = filling.run(|_, _| ()).unwrap();
        assert!(first.iter().all(|filled| *filled != Filled::Kept), "{first:?}");
        let again = filling.run(|_, _| ()).unwrap();
        for (first, again) in first.iter().zip(&again) {
            let want = if *first == Filled::Made { Filled::Kept } else { Filled::Failed };
            assert_eq!(*again, want);
        }
        let drapes = KeptDrape::all(&folder).unwrap();
        assert_eq!(drapes.len(), first.iter().filter(|f| **f == Filled::Made).count());
        assert!(
            drapes[0].name.starts_with("knit-2020-3-1")
                || drapes[0].name.starts_with("measured-3-0")
        );
        for drape in &drapes {
            let prior = if drape.name.starts_with("knit") {
                Mixture::knit_2020()
            } else {
                Mixture::measured()
            };
            let index = if drape.name.starts_with("knit") { 1 } else { 0 };
            let fabric = prior.sample(3, index).unwrap();
            let found = drape.fabric.unwrap();
            let pairs = fabric.in_si().into_iter().zip(found.in_si());
            assert!(pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
            let length_m = drape.bending_length_m().unwrap();
            assert!((1e-3..0.05).contains(&length_m), "{length_m}");
        }
    }
}

//! Whether found fabrics behave as the true ones in experiments that the fit has not seen, for
//! `scan2params-lab transfer`.
//!
//! In: fabrics of priors, sensors, a seed. Each fabric is draped, scanned once by each sensor,
//! estimated and refined, as in [`super::refine`]. The true fabric and what was found are then
//! tried in [`shapes`]. Out: one [`Transferred`] a fabric, kept in a folder, and rows of
//! [`table`](mod@table). A fabric that is kept is not computed again, and one whose scans were all
//! refused is not tried.

pub mod pictures;
pub mod shapes;
pub mod table;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::case_error::CaseError;
use super::refine::{Case, Series};
use scan2params::fabric::{Fabric, Mixture, PARAMETERS};
use scan2params::io::{WriteError, atomically};
use shapes::{Shape, Tried, cantilevers_mm};

/// One fabric: what was found of it, and how truth and found behave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transferred {
    /// Name of the prior.
    pub prior: String,
    /// Its place in the run.
    pub index: u64,
    /// Seed of its drops in the experiments.
    pub seed: u64,
    /// Drops of each disc.
    pub drops: u64,
    /// The true fabric \[SI\].
    pub truth: [f64; PARAMETERS],
    /// What was found.
    pub found: Vec<Found>,
    /// Sensors whose scan has no answer, and why.
    pub refused: Vec<(String, String)>,
    /// How they behave; the others of [`Tried`] are those of [`Self::found`].
    pub tried: Vec<Tried>,
    /// The true fabric's bending lengths by the cantilever test: weft, warp, bias \[mm\].
    pub cantilevers_mm: Option<[f64; 3]>,
}

/// A fabric that was found from one scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Name of the sensor.
    pub sensor: String,
    /// Who found it.
    pub reader: Reader,
    /// The fabric \[SI\].
    pub fabric: [f64; PARAMETERS],
    /// Its bending lengths by the cantilever test, on the true fabric's strips \[mm\].
    pub cantilevers_mm: Option<[f64; 3]>,
}

/// Who finds a fabric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reader {
    /// The fit.
    Refined,
    /// The network alone.
    Network,
}

impl Reader {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Refined, Self::Network];

    /// The word in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Refined => "refined",
            Self::Network => "network",
        }
    }
}

/// Why a run ended.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// A case cannot be made.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A kept fabric cannot be read.
    #[error("{path}: {source}: remove it and run again")]
    Kept {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A kept fabric cannot be read from the disk.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A fabric cannot be kept.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Where fabrics are kept, and whether those that are not there are left out.
#[derive(Clone, Copy, Debug)]
pub struct Keep<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// Whether nothing is computed.
    pub only: bool,
}

/// Runs all fabrics on all cores and returns them in order; `tell` hears of each as it ends.
///
/// # Errors
/// The first fabric that cannot be made, read or kept.
pub fn run(
    series: &Series<'_>,
    drops: u64,
    keep: Keep<'_>,
    tell: impl Fn(&Transferred) + Sync,
) -> Result<Vec<Transferred>, TransferError> {
    let of_fabric = |index: u64| series.priors.iter().map(move |prior| (prior, index));
    let all: Vec<(&Mixture, u64)> = series.fabrics.clone().flat_map(of_fabric).collect();
    let done = all.into_par_iter().with_max_len(1).map(|(prior, index)| {
        let seed = series.seed;
        let name = format!("transfer-{}-{seed}-{index}-{drops}.json", prior.name());
        let path = keep.folder.join(name);
        let transferred = match path.exists() {
            true => read(&path)?,
            false if keep.only => return Ok(None),
            false => {
                let made = transferred(series, prior, index, drops)?;
                let text = serde_json::to_vec(&made).unwrap_or_else(|_| unreachable!("numbers"));
                atomically(&path, |out| out.write_all(&text))?;
                made
            }
        };
        tell(&transferred);
        Ok(Some(transferred))
    });
    Ok(done.collect::<Result<Vec<_>, TransferError>>()?.into_iter().flatten().collect())
}

/// A fabric that is kept.
fn read(path: &Path) -> Result<Transferred, TransferError> {
    let text = std::fs::read(path)?;
    serde_json::from_slice(&text)
        .map_err(|source| TransferError::Kept { path: path.to_owned(), source })
}

/// A fabric of a prior, scanned, found and tried.
fn transferred(
    series: &Series<'_>,
    prior: &Mixture,
    index: u64,
    drops: u64,
) -> Result<Transferred, TransferError> {
    let cases = series.cases(prior, index)?;
    let truth = cases.first().map_or_else(Fabric::mean_knit, |case| case.fabric);
    let refused = cases.iter().filter_map(|case| {
        let why = case.answer.as_ref().err()?;
        Some((case.sensor.clone(), why.to_string()))
    });
    let found: Vec<Found> = cases.iter().flat_map(|case| found(case, &truth)).collect();
    let others: Vec<Fabric> = found.iter().map(|found| Fabric::from_si(found.fabric)).collect();
    let seed = series.seed ^ (index << 16);
    // what was refused is not tried
    let shapes = if others.is_empty() { &[][..] } else { &Shape::ALL };
    Ok(Transferred {
        prior: prior.name().to_owned(),
        index,
        seed,
        drops,
        truth: truth.in_si(),
        refused: refused.collect(),
        tried: shapes.iter().map(|shape| shape.tried(&truth, &others, drops, seed)).collect(),
        cantilevers_mm: cantilevers_mm(&truth, &truth),
        found,
    })
}

/// What was found from one scan: by the fit and by the network.
fn found(case: &Case, truth: &Fabric) -> Vec<Found> {
    let Ok(answer) = &case.answer else { return Vec::new() };
    let found = |reader: Reader| {
        let fabric = match reader {
            Reader::Refined => answer.refined.fabric,
            Reader::Network => answer.estimate.fabric,
        };
        Found {
            sensor: case.sensor.clone(),
            reader,
            fabric: fabric.in_si(),
            cantilevers_mm: cantilevers_mm(&fabric, truth),
        }
    };
    Reader::ALL.map(found).to_vec()
}

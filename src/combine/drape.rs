//! One drape of those that are combined.

use std::path::PathBuf;

use crate::fabric::STIFFNESSES;
use crate::job::verdict::Level;

/// What one params.json says.
#[derive(Clone, Debug, PartialEq)]
pub struct Drape {
    /// The file.
    pub file: PathBuf,
    /// The scan that it is of, as it is written.
    pub input: String,
    /// The stiffnesses, paper's order and units.
    pub values: [f64; STIFFNESSES],
    /// Their 90 % intervals.
    pub interval90: [[f64; 2]; STIFFNESSES],
    /// Whether each lies inside what the model was trained on.
    pub in_range: [bool; STIFFNESSES],
    /// Areal density \[g/m^2\].
    pub density_g_m2: f64,
    /// Folds of the scanned rim, if they are known.
    pub folds: Option<usize>,
    /// Level of the verdict, as in files.
    pub verdict: String,
    /// Codes of the grounds that speak against the result, each once.
    pub grounds: Vec<String>,
    /// Whether the values are refined on the scan.
    pub refined: bool,
    /// Other scans that it was refined on together with its own.
    pub with: Vec<String>,
    /// Whether weft and warp are known.
    pub oriented: bool,
    /// Mean distance of the tied drape's rim from the scanned one \[mm\].
    pub rim_error_mm: Option<f64>,
    /// Name of the model and the SHA-256 of its file.
    pub model: [String; 2],
    /// Version of the simulator's numerics.
    pub numerics: u64,
    /// Version of the program.
    pub version: String,
}

impl Drape {
    /// Whether the verdict forbids its use.
    #[must_use]
    pub fn is_unusable(&self) -> bool {
        self.verdict == Level::DoNotUse.name()
    }
}

/// A drape that is not in the mean.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// The drape.
    pub drape: Drape,
    /// Why.
    pub reason: String,
}

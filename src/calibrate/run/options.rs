//! What a calibration is asked, why it refuses, and what it tells on the way.

use std::fmt;

use crate::base::units::M_PER_MM;
use crate::calibrate::effect::Effect;
use crate::calibrate::fit::Progress;
use crate::calibrate::measures::FoldRule;
use crate::calibrate::options::FitOptions;
use crate::calibrate::silhouette::SilhouetteLimits;
use crate::fabric::{Mixture, MixtureError};

/// How a manifest is calibrated.
#[derive(Clone, Debug)]
pub struct Options {
    /// The fit.
    pub fit: FitOptions,
    /// What a picture must show.
    pub limits: SilhouetteLimits,
    /// How folds are counted.
    pub folds: FoldRule,
    /// The prior of fabrics.
    pub prior: Mixture,
    /// Effects that are not looked for.
    pub without: Vec<&'static Effect>,
}

impl Default for Options {
    /// With the prior of measured bending and density.
    fn default() -> Self {
        let (limits, folds) = (SilhouetteLimits::default(), FoldRule::default());
        let (fit, prior) = (FitOptions::default(), Mixture::measured());
        Self { fit, limits, folds, prior, without: Vec::new() }
    }
}

/// Why a manifest is not calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// The rows of a fabric give two densities.
    #[error(
        "line {line}: fabric `{fabric}` has {found} g/m^2 here and {first} g/m^2 in line {before}: a fabric has \
         one density; correct it, or name two fabrics"
    )]
    TwoDensities {
        /// The fabric.
        fabric: String,
        /// The line of the second density.
        line: usize,
        /// The second density \[g/m^2\].
        found: f64,
        /// The line of the first one.
        before: usize,
        /// The first density \[g/m^2\].
        first: f64,
    },
    /// No file can be used.
    #[error("none of the manifest's {files} files can be used; the first: line {line}: {why}")]
    Nothing {
        /// How many there are.
        files: usize,
        /// Line of the first one.
        line: usize,
        /// Why it cannot be used.
        why: String,
    },
    /// The prior cannot be used.
    #[error(transparent)]
    Prior(#[from] MixtureError),
}

/// How far a calibration is.
#[derive(Clone, Copy, Debug)]
pub enum Told<'a> {
    /// So many pictures are read.
    Reading(usize),
    /// The distances of a fabric's outlines are taken.
    Floor(&'a str),
    /// A fabric is fitted.
    Fitting(&'a str, Progress),
    /// A fabric's other drapes are predicted.
    Predicting(&'a str, Progress),
}

/// What is being done, in words.
impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reading(files) => write!(f, "outlines of {files} files"),
            Self::Floor(fabric) => write!(f, "fabric {fabric}: outlines against each other"),
            Self::Fitting(fabric, p) if p.rms_m.is_finite() => {
                let mm = p.rms_m / M_PER_MM;
                write!(f, "fabric {fabric}: {} drapes, outlines within {mm:.2} mm", p.drapes)
            }
            Self::Fitting(fabric, p) => {
                write!(f, "fabric {fabric}: {} drapes guided by their outlines", p.drapes)
            }
            Self::Predicting(fabric, p) => {
                write!(f, "fabric {fabric}: {} drapes predicted", p.drapes)
            }
        }
    }
}

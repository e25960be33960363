//! Other scans of the same fabric, which it is refined on together with the first.
//!
//! In: the job. Out: a [`Companion`] each, in the job's order: its rim and what the network says of it. A second drop shows
//! the fabric on another branch and in another place, and tells apart what one drape leaves mixed. Weft and warp must
//! be known in all of them: two drops that are read turned against each other are of two fabrics.
//!
//! A companion that cannot be trusted is refused with its path; it would pull the fabric to itself unseen.

use std::path::PathBuf;

use super::error::JobError;
use super::verdict::{Figures, Level, Limits};
use super::{Job, Rim, rim};
use crate::estimate::{Estimate, Estimator};
use crate::scan::Orientation;

/// Another scan of the fabric.
#[derive(Debug)]
pub struct Companion {
    /// The scan.
    pub path: PathBuf,
    /// Its rim.
    pub rim: Rim,
    /// What the network says of it alone.
    pub network: Estimate,
}

/// Why scans cannot be refined together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompanionFault {
    /// Weft and warp are not known.
    #[error(
        "weft and warp are not known, and scans of one fabric are refined together only where they are: \
         mark the corner, or say where the warp points (--warp-toward)"
    )]
    UnknownWarp,
    /// What the scan alone would give is not to be used.
    #[error("not to be refined with others: {0}; leave it out or scan it again")]
    Unusable(String),
}

/// The companions of the scan whose rim is `rim`.
pub(super) fn all(
    job: &Job,
    rim: &Rim,
    estimator: &Estimator,
    tell: &impl Fn(&str),
) -> Result<Vec<Companion>, JobError> {
    let fault = |path: &PathBuf, source| JobError::Companion { path: path.clone(), source };
    if !job.with.is_empty() && rim.orientation() != Orientation::Given {
        return Err(fault(&job.input, CompanionFault::UnknownWarp));
    }
    let companion = |path: &PathBuf| {
        tell(&format!("looking for the rim of {}", path.display()));
        let rim = rim::of_input(path, &job.read, &job.scan)?;
        if rim.orientation() != Orientation::Given {
            return Err(fault(path, CompanionFault::UnknownWarp));
        }
        let verdict = Figures::of_rim(&rim, &job.scan).verdict(&Limits::default());
        if verdict.level == Level::DoNotUse {
            return Err(fault(path, CompanionFault::Unusable(verdict.refusal())));
        }
        let network = estimator.estimate(rim.boundary(), job.density_kg_m2, true)?;
        Ok(Companion { path: path.clone(), rim, network })
    };
    job.with.iter().map(companion).collect()
}

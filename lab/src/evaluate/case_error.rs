//! Why a case of a series cannot be made.

use scan2params::dataset::drape_file::DrapeFileError;
use scan2params::estimate::EstimateError;
use scan2params::fabric::MixtureError;
use scan2params::io::WriteError;
use scan2params::sensor::SceneError;

/// Why a case cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The prior gives no fabric.
    #[error(transparent)]
    Prior(#[from] MixtureError),
    /// The drape makes no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The estimate fails.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// A kept drape cannot be read.
    #[error(transparent)]
    Read(#[from] DrapeFileError),
    /// A drape cannot be kept.
    #[error(transparent)]
    Write(#[from] WriteError),
}

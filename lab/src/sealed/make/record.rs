//! How cases are made, what is kept of one, and why one is not made.

use serde::{Deserialize, Serialize};

use crate::sealed::case::Kind;
use crate::sealed::effect::Effect;
use scan2params::io::WriteError;
use scan2params::sensor::{Profile, SceneError};
use scan2params::sim::Stop;

/// How cases are made.
#[derive(Clone, Debug, PartialEq)]
pub struct MakeOptions {
    /// Vertices a side of the true drapes; 121 lie 2.5 mm apart.
    pub vertices: usize,
    /// Extent of a pixel \[m\].
    pub pixel_m: f64,
    /// Columns and rows of a picture.
    pub size_px: [u32; 2],
    /// Pictures of each drape.
    pub captures: usize,
    /// The sensor that scans squares.
    pub sensor: Profile,
}

impl Default for MakeOptions {
    /// Cells of 2.5 mm, pictures as those of the measured silhouettes.
    fn default() -> Self {
        let [_, sensor, ..] = Profile::ALL;
        Self { vertices: 121, pixel_m: 1.39e-3, size_px: [256, 256], captures: 2, sensor }
    }
}

/// The truth of a case, as `sealed.json` has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sealed {
    /// Name and version of the format.
    pub schema: String,
    /// Seed of the run.
    pub seed: u64,
    /// Its place in the run.
    pub index: u64,
    /// How many effects it has.
    pub kind: Kind,
    /// Name of the prior that the fabric is from.
    pub prior: String,
    /// The seven parameters, paper's order, SI.
    pub fabric_si: [f64; 7],
    /// The effects, SI, for the face up.
    pub effects: Vec<Effect>,
    /// Vertices a side of the drapes.
    pub vertices: usize,
    /// Name of the sensor that scanned squares; none of silhouettes.
    #[serde(default)]
    pub sensor: Option<String>,
    /// The drapes.
    pub drapes: Vec<SealedDrape>,
}

/// One drape of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SealedDrape {
    /// Number of the specimen, from 1.
    pub specimen: usize,
    /// Which side is up.
    pub face: String,
    /// What it is for.
    pub role: String,
    /// Seed of its drop.
    pub drop_seed: u64,
    /// Its folds.
    pub folds: usize,
    /// Root mean square distance that the effects move its outline by on its branch \[m\]; none
    /// where there is no effect, or where the branch ends.
    pub size_m: Option<f64>,
    /// What is left of it once six stiffnesses, the same for all drapes, and the drape's pose have
    /// taken up what they can \[m\]; none where `size_m` is, and in files of before this was asked.
    #[serde(default)]
    pub remaining_m: Option<f64>,
}

/// Drops that are tried for a drape.
pub(super) const DROPS: u64 = 4;

/// Why a case is not made or not read.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// No drop came to rest.
    #[error(
        "specimen {specimen} face {face}: {DROPS} drops ended as `{}`, not at rest; take another seed", .stop.name()
    )]
    NeverAtRest {
        /// The specimen.
        specimen: usize,
        /// Which side is up.
        face: &'static str,
        /// How the last one ended.
        stop: Stop,
    },
    /// A drape makes no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The folder cannot be made, or the truth not be read.
    #[error("{path}: {source}; check the path and its permissions")]
    Io {
        /// Folder or file.
        path: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The truth is not what was written.
    #[error("{path}: {source}; remove the folder, and the case is made anew")]
    Json {
        /// The file.
        path: String,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The folder has another case.
    #[error("{path} is the truth of another case or of other cells; give another folder")]
    Other {
        /// The file.
        path: String,
    },
}

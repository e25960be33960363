//! What the caller says of a scan's file.

use std::path::PathBuf;

use serde::Serialize;

use super::format::Format;
use super::intrinsics::Intrinsics;

/// What a file does not say itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ReadOptions {
    /// The camera of depth images that no `views.json` says.
    pub intrinsics: Option<Intrinsics>,
    /// Units of depth in a metre \[1/m\].
    pub depth_scale: f64,
    /// Drop pixels of depth images of whose eight neighbours fewer than three lie
    /// within this depth \[m\]: flying pixels between cloth and background. `None`
    /// keeps all.
    pub max_jump_m: Option<f64>,
    /// The file's format, for any name; then the path `-` is the standard input. `None`: as its
    /// name ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Format"))]
    pub format: Option<Format>,
    /// More passes over the same drape, each a file or its own set of views. `intake` brings them
    /// together; the readers here read one input.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub passes: Vec<PathBuf>,
    /// Lengths in the scan over true ones \[-\]: `intake` divides them by it. `None`: the scan's
    /// are true.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "f64"))]
    pub rescale: Option<f64>,
}

impl Default for ReadOptions {
    /// Millimetres, as most depth cameras write.
    fn default() -> Self {
        Self {
            intrinsics: None,
            depth_scale: 1000.0,
            max_jump_m: None,
            format: None,
            passes: Vec::new(),
            rescale: None,
        }
    }
}

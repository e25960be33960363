//! What became of one scan of a batch.

use serde::{Deserialize, Serialize};

use crate::job::FailureKind;

/// Version of the layout of a [`Row`].
pub const SCHEMA_VERSION: u32 = 1;

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// With an estimate.
    Ok,
    /// The scan cannot be trusted.
    Refused,
    /// What was asked cannot be meant: no density.
    Usage,
    /// A file cannot be read or written.
    Failed,
}

impl Status {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Refused => "refused",
            Self::Usage => "usage",
            Self::Failed => "failed",
        }
    }

    /// The exit code that `estimate` would have given.
    #[must_use]
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Ok => 0,
            Self::Refused => FailureKind::Refused.exit_code(),
            Self::Usage => FailureKind::Usage.exit_code(),
            Self::Failed => FailureKind::Failed.exit_code(),
        }
    }

    /// Whether the same input and options end so again.
    pub(super) fn is_final(self) -> bool {
        matches!(self, Self::Ok | Self::Refused)
    }
}

impl From<FailureKind> for Status {
    fn from(kind: FailureKind) -> Self {
        match kind {
            FailureKind::Failed => Self::Failed,
            FailureKind::Usage => Self::Usage,
            FailureKind::Refused => Self::Refused,
        }
    }
}

/// What became of one scan: a line of `journal.jsonl` and `results.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Path in the folder, with slashes.
    pub file: String,
    /// How it ended.
    pub status: Status,
    /// [`Status::exit_code`].
    pub exit_code: u8,
    /// Why there is no estimate.
    pub reason: Option<String>,
    /// Areal density \[g/m^2\].
    pub density_g_m2: Option<f64>,
    /// SHA-256 of the scan's bytes.
    pub input_sha256: Option<String>,
    /// SHA-256 over everything else that the result depends on.
    pub settings_sha256: Option<String>,
    /// Time it took \[s\].
    pub seconds: f64,
    /// The content of params.json.
    pub result: Option<serde_json::Value>,
}

impl Row {
    pub(super) fn new(file: &str, status: Status) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            file: file.to_owned(),
            status,
            exit_code: status.exit_code(),
            reason: None,
            density_g_m2: None,
            input_sha256: None,
            settings_sha256: None,
            seconds: 0.0,
            result: None,
        }
    }
}

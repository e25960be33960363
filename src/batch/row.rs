//! What became of one scan of a batch.

use serde::{Deserialize, Serialize};

use crate::job::FailureKind;
use crate::job::verdict::Level;

/// Version of the layout of a [`Row`].
pub const SCHEMA_VERSION: u32 = 1;

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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

/// What became of one scan of `scan2params batch`: a line of results.jsonl, of journal.jsonl, and
/// of stdout with --json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Row {
    /// Version of the layout \[-\]; raised when a field changes its meaning or goes.
    #[cfg_attr(test, schemars(extend("const" = SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Path in the folder, with slashes.
    pub file: String,
    /// How it ended.
    pub status: Status,
    /// The exit code that `estimate` would have given \[-\]: that of the status, or that of a
    /// refused scan where there is a result that may not be used.
    #[cfg_attr(test, schemars(extend("enum" = [0, 1, 2, 4])))]
    pub exit_code: u8,
    /// Why there is no estimate; `None` where there is one.
    pub reason: Option<String>,
    /// Areal density given \[g/m^2\]; `None`: none.
    pub density_g_m2: Option<f64>,
    /// SHA-256 of the scan's bytes, in hexadecimal; `None` where it could not be read.
    #[cfg_attr(test, schemars(extend("pattern" = "^[0-9a-f]{64}$")))]
    pub input_sha256: Option<String>,
    /// SHA-256 over everything else that the result depends on, in hexadecimal.
    #[cfg_attr(test, schemars(extend("pattern" = "^[0-9a-f]{64}$")))]
    pub settings_sha256: Option<String>,
    /// Time it took \[s\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub seconds: f64,
    /// The content of params.json; `None` without an estimate.
    #[cfg_attr(test, schemars(with = "Option<crate::report::json::Params>"))]
    pub result: Option<serde_json::Value>,
}

impl Row {
    /// The row with the exit code of its verdict. `strict` may differ from one run of a batch to
    /// the next, so that the row's own code is not kept.
    pub(super) fn judged(mut self, strict: bool) -> Self {
        let refused =
            self.not_the_experiment() || strict && self.verdict() == Some(Level::DoNotUse.name());
        if self.status == Status::Ok {
            let code = FailureKind::Refused.exit_code();
            self.exit_code = if refused { code } else { self.status.exit_code() };
        }
        self
    }

    /// The level of the verdict, as params.json has it; `None` without a result.
    #[must_use]
    pub fn verdict(&self) -> Option<&str> {
        self.result.as_ref()?.pointer("/verdict/level")?.as_str()
    }

    /// Whether what was scanned is not the experiment.
    #[must_use]
    pub fn not_the_experiment(&self) -> bool {
        let pointer = "/verdict/not_the_experiment";
        let said = self.result.as_ref().and_then(|result| result.pointer(pointer));
        said.and_then(serde_json::Value::as_bool) == Some(true)
    }

    /// Whether weft and warp are unknown: the values are those of one reading of two, and the
    /// intervals cover both.
    #[must_use]
    pub fn is_warp_unknown(&self) -> bool {
        let orientation = self.result.as_ref().and_then(|result| result.pointer("/orientation"));
        orientation.and_then(serde_json::Value::as_str) == Some("ambiguous")
    }

    /// Codes of the grounds of the verdict that speak against the result, each once.
    #[must_use]
    pub fn grounds(&self) -> Vec<&str> {
        let grounds = self.result.as_ref().and_then(|r| r.pointer("/verdict/grounds")?.as_array());
        let mut codes = Vec::new();
        for ground in grounds.into_iter().flatten() {
            let level = ground["level"].as_str();
            if let Some(code) = ground["code"].as_str()
                && level != Some(Level::Reliable.name())
                && !codes.contains(&code)
            {
                codes.push(code);
            }
        }
        codes
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_of_a_row_is_that_of_the_type() {
        let title = "A line of results.jsonl";
        crate::base::schema::holds::<Row>("batch-line", title, &["Params"]);
    }

    #[test]
    fn a_row_s_exit_code_follows_its_verdict_and_what_is_asked() {
        let row = |level: &str, other: bool| {
            let verdict = serde_json::json!({ "level": level, "not_the_experiment": other });
            let result = Some(serde_json::json!({ "verdict": verdict }));
            Row { result, ..Row::new("a.ply", Status::Ok) }
        };
        for (level, other, lenient, strict) in [
            ("reliable", false, 0, 0),
            ("doubtful", false, 0, 0),
            ("do_not_use", false, 0, 4),
            ("do_not_use", true, 4, 4),
        ] {
            assert_eq!(row(level, other).judged(false).exit_code, lenient, "{level}");
            // As if kept from a run that asked for the opposite.
            assert_eq!(row(level, other).judged(false).judged(true).exit_code, strict, "{level}");
            assert_eq!(row(level, other).judged(true).judged(false).exit_code, lenient, "{level}");
        }
        let refused = Row::new("b.ply", Status::Refused).judged(true);
        assert_eq!((refused.exit_code, refused.verdict()), (4, None));
    }
}

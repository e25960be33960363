//! How a verb ends: well, or with an error and the exit code that stands for it.

use std::path::Path;

use super::print;
use crate::io::OutputError;
use crate::job::{FailureKind, JobError, Verdict};

/// What went wrong, with the exit code that says which kind it is.
pub struct Failure {
    /// The exit code.
    pub code: u8,
    /// What is told of it.
    pub error: anyhow::Error,
}

impl Failure {
    /// A mistake in what the user asked for: exit code 2.
    pub fn usage(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 2, error: error.into() }
    }

    /// A batch of which some failed: exit code 3.
    pub fn partial(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 3, error: error.into() }
    }

    /// A failure of this kind.
    pub fn of_kind(kind: FailureKind, error: impl Into<anyhow::Error>) -> Self {
        Self { code: kind.exit_code(), error: error.into() }
    }

    /// A result that was written and is not to be used: exit code 4. Nothing otherwise.
    ///
    /// # Errors
    /// That failure.
    pub fn of_verdict(input: &Path, verdict: &Verdict, strict: bool) -> Outcome {
        if !verdict.is_refusal(strict) {
            return Ok(());
        }
        let (input, why) = (input.display(), verdict.refusal());
        Err(Self::of_kind(FailureKind::Refused, anyhow::anyhow!("{input}: {why}")))
    }

    /// The exit code that a job's error stands for.
    pub fn of_job(error: impl Into<JobError>) -> Self {
        let error = error.into();
        Self::of_kind(error.kind(), error)
    }

    /// A result that cannot be written where it is asked to be.
    pub fn of_output(error: OutputError) -> Self {
        Self { code: if error.is_usage() { 2 } else { 1 }, error: error.into() }
    }

    /// Whether a result went to a pipe whose reader had enough, as `| head` does.
    pub fn is_end_of_pipe(&self) -> bool {
        let mut causes = self.error.chain().filter_map(|cause| cause.downcast_ref());
        causes.any(print::reader_has_gone)
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { code: 1, error: error.into() }
    }
}

/// What a verb ends with.
pub type Outcome = Result<(), Failure>;

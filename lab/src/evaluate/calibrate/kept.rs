//! A calibration's result for a sealed case, kept in the case's folder: an interrupted run
//! continues, and the figures of many cases are those of one build.
//!
//! In: the options of a calibration. Out: a file in the case's folder with what was said and the
//! truth's own error, under a name that stands for the options and for the program itself, so that
//! neither another build nor other options ever read it. What cannot be read counts as not there,
//! and the case is calibrated again.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::said::{Said, nan_of_null};
use scan2params::calibrate::run::Options;
use scan2params::fabric::sha256_hex;
use scan2params::io::{WriteError, atomically};

/// Where what one program says with some options is kept.
pub(super) struct Keeper {
    /// Digest of the program and the options.
    of: String,
}

/// What is kept of a case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Kept {
    /// What was said, or why nothing was.
    pub(super) said: Result<Said, String>,
    /// Held-out error of the truth \[mm\].
    #[serde(deserialize_with = "nan_of_null")]
    pub(super) truth_mm: f64,
}

impl Keeper {
    /// Of this program with some options; `None` where the system does not show the program.
    pub(super) fn of(options: &Options) -> Option<Self> {
        let program = std::fs::read(std::env::current_exe().ok()?).ok()?;
        let of = sha256_hex(format!("{} {options:?}", sha256_hex(&program)).as_bytes());
        Some(Self { of })
    }

    fn path(&self, folder: &Path) -> PathBuf {
        let short: String = self.of.chars().take(NAME_DIGITS).collect();
        folder.join(format!("said-{short}.json"))
    }

    /// The result for the case of a folder.
    pub(super) fn read(&self, folder: &Path) -> Option<Kept> {
        serde_json::from_slice(&std::fs::read(self.path(folder)).ok()?).ok()
    }

    /// Keeps it.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn write(&self, folder: &Path, kept: &Kept) -> Result<(), WriteError> {
        atomically(self.path(folder), |out| Ok(serde_json::to_writer_pretty(out, kept)?))
    }
}

/// Digits of the digest in a file's name.
const NAME_DIGITS: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::calibrate::effect::Effect;

    #[test]
    fn what_was_said_is_read_again_by_the_same_program_with_the_same_options() {
        let folder = std::env::temp_dir().join(format!("s2p-kept-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut options = Options::default();
        let keeper = Keeper::of(&options).unwrap();
        assert!(keeper.read(&folder).is_none());
        let said = Said {
            verdict: "found".to_owned(),
            effects: vec!["skew".to_owned()],
            group: Vec::new(),
            before_mm: 0.83,
            after_mm: 0.1 + 0.2,
            released_mm: [1.5, f64::NAN],
            misfit: [0.9, 0.2],
            floor_mm: f64::NAN,
            strongest: Some([0.25, 1.0]),
        };
        let kept = Kept { said: Ok(said), truth_mm: f64::NAN };
        keeper.write(&folder, &kept).unwrap();
        let again = keeper.read(&folder).unwrap();
        assert_eq!(format!("{again:?}"), format!("{kept:?}"));
        // another question, and a file without a result
        options.without = vec![Effect::named("skew").unwrap()];
        let other = Keeper::of(&options).unwrap();
        assert!(other.read(&folder).is_none());
        let failed = Kept { said: Err("no, nothing".to_owned()), truth_mm: 0.5 };
        other.write(&folder, &failed).unwrap();
        assert_eq!(other.read(&folder).unwrap().said, failed.said);
        assert!(keeper.read(&folder).unwrap().said.is_ok());
        // a file that is broken counts as none
        std::fs::write(keeper.path(&folder), "{").unwrap();
        assert!(keeper.read(&folder).is_none());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

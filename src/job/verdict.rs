//! What a result is worth: reliable, doubtful, or not to be used, and on what grounds.
//!
//! In: the rim, the estimate and, where there is one, the drape of the estimate. Out: a
//! [`Verdict`], which stands at the top of the table, of params.json and of a batch's row.
//! A verdict is the worst of its [`Ground`]s; without any it is `reliable`. Each ground has
//! a stable code, the number measured, the limit, and a sentence with the remedy.
//!
//! A ground may also say that what was scanned is not the experiment at all (a specimen of
//! another size, a pleated skirt, two cloths in one file): then every stiffness is of
//! something else, and the program ends with exit code 4.
//!
//! To add a ground: a [`Code`], and where the signal becomes known a `Ground::new(code, level,
//! (measured, limit, unit), text)`, with `.not_the_experiment()` where that follows. Signals
//! of the scan path travel up as numbers (of `scan::Quality`, or of the [`Rim`]) and become
//! grounds in `of_rim_grounds`; the layers below `job` know nothing of verdicts.

use serde::Serialize;

use super::Rim;
use crate::estimate::Estimate;
use crate::refine::Resimulation;

/// How far a result can be relied on. The order is from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Honest scans of fabrics that the model knows look like this. As the level of a ground:
    /// to be said, without making the result any worse.
    Reliable,
    /// Something is unusual; at least a part of the result may be off by more than its interval.
    Doubtful,
    /// The result is known to be wrong, or nothing is known of how wrong it is.
    DoNotUse,
}

impl Level {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reliable => "reliable",
            Self::Doubtful => "doubtful",
            Self::DoNotUse => "do_not_use",
        }
    }

    /// The words for people.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Reliable => "reliable",
            Self::Doubtful => "doubtful",
            Self::DoNotUse => "do not use",
        }
    }
}

/// What a ground is about. The names in files are stable: programs compare them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Code {
    /// A side of the rim differs from the specimen's by more than cloth stretches.
    SideLength,
}

impl Code {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SideLength => "side_length",
        }
    }
}

/// One thing that speaks against a result, or has to be known with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ground {
    /// What it is about.
    pub code: Code,
    /// What it makes of the result.
    pub level: Level,
    /// Whether what was scanned is not the experiment.
    pub not_the_experiment: bool,
    /// The number measured \[`unit`\].
    pub measured: f64,
    /// The limit that it was held against \[`unit`\].
    pub limit: f64,
    /// Unit of both, empty for counts and shares.
    pub unit: &'static str,
    /// What was measured, the limit and the remedy, in words.
    pub text: String,
}

impl Ground {
    /// A ground that says nothing of whether the scan shows the experiment.
    #[must_use]
    pub fn new(code: Code, level: Level, (measured, limit, unit): Measured, text: String) -> Self {
        Self { code, level, not_the_experiment: false, measured, limit, unit, text }
    }

    /// The same ground, which also says that what was scanned is not the experiment. Such a
    /// result is not to be used.
    #[must_use]
    pub fn not_the_experiment(self) -> Self {
        Self { level: Level::DoNotUse, not_the_experiment: true, ..self }
    }
}

/// A number measured, the limit it was held against, and the unit of both.
pub type Measured = (f64, f64, &'static str);

/// What a result is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The worst level of all grounds.
    pub level: Level,
    /// Whether what was scanned is not the experiment.
    pub not_the_experiment: bool,
    /// The grounds, worst first.
    pub grounds: Vec<Ground>,
}

impl Verdict {
    /// The verdict that follows from these grounds.
    #[must_use]
    pub fn of(mut grounds: Vec<Ground>) -> Self {
        // Stable: grounds of one level stay in the order in which they were found.
        grounds.sort_by_key(|ground| {
            (std::cmp::Reverse(ground.level), std::cmp::Reverse(ground.not_the_experiment))
        });
        Self {
            level: grounds.first().map_or(Level::Reliable, |worst| worst.level),
            not_the_experiment: grounds.iter().any(|ground| ground.not_the_experiment),
            grounds,
        }
    }
}

/// The verdict on a job: everything known of the rim, the estimate and the drape of the
/// estimate.
#[must_use]
pub fn of_job(rim: &Rim, _estimate: &Estimate, _again: Option<&Resimulation>) -> Verdict {
    Verdict::of(of_rim_grounds(rim))
}

/// The verdict on a rim alone: what `inspect` can say.
#[must_use]
pub fn of_rim(rim: &Rim) -> Verdict {
    Verdict::of(of_rim_grounds(rim))
}

/// What a rim tells by itself. Signals found in `scan` become grounds here.
fn of_rim_grounds(_rim: &Rim) -> Vec<Ground> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(level: Level, text: &str) -> Ground {
        Ground::new(Code::SideLength, level, (1.0, 2.0, "mm"), text.to_owned())
    }

    #[test]
    fn a_verdict_is_the_worst_of_its_grounds_and_names_that_first() {
        assert_eq!(Verdict::of(vec![]).level, Level::Reliable);
        let said = Verdict::of(vec![ground(Level::Reliable, "a remark")]);
        assert_eq!((said.level, said.grounds.len()), (Level::Reliable, 1));
        let all = [
            ground(Level::Reliable, "a"),
            ground(Level::Doubtful, "b"),
            ground(Level::DoNotUse, "c"),
            ground(Level::Doubtful, "d"),
            ground(Level::Doubtful, "e").not_the_experiment(),
        ];
        let verdict = Verdict::of(all.to_vec());
        assert_eq!((verdict.level, verdict.not_the_experiment), (Level::DoNotUse, true));
        let texts: Vec<&str> = verdict.grounds.iter().map(|g| g.text.as_str()).collect();
        assert_eq!(texts, ["e", "c", "b", "d", "a"]);
        assert!(!Verdict::of(all[..4].to_vec()).not_the_experiment);
    }
}

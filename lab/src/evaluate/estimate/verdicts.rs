//! What the verdict makes of the answers to rims, for `scan2params-lab estimate`.
//!
//! In: rims of drapes that were made, and the estimates from them. Out: how many answers are
//! reliable, doubtful and not to be used, and on which grounds. It is the verdict of `estimate` on
//! a rim from a file: nothing of a scan, no drape of the answer.
//!
//! Where it fails: what a scan shows of a wrong plate or specimen, and what the drape of an answer
//! shows, is not in it.

use std::collections::BTreeMap;

use serde::Serialize;

use scan2params::base::boundary::Orientation;
use scan2params::dataset::Row;
use scan2params::estimate::Estimate;
use scan2params::fabric::Mixture;
use scan2params::intake::rim::{GivenWarp, Rim};
use scan2params::job::verdict::{self, Level, Verdict};
use scan2params::scan::ScanOptions;

/// Answers by level, and by what makes them worse than reliable.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Verdicts {
    /// Answers that are reliable.
    pub reliable: usize,
    /// Answers that are doubtful.
    pub doubtful: usize,
    /// Answers that are not to be used.
    pub do_not_use: usize,
    /// How many of the doubtful and of those not to be used have a ground, by its code.
    pub grounds: BTreeMap<&'static str, usize>,
}

impl Verdicts {
    /// On these answers to the rims of `rows`, whose warp was told.
    #[must_use]
    pub fn of(prior: &Mixture, rows: &[Row], estimates: &[Estimate]) -> Self {
        let verdict = |(row, estimate): (&Row, &Estimate)| {
            let (orientation, warp) = (Orientation::Given, GivenWarp::File);
            let rim = Rim::Given { boundary: row.drape.boundary.clone(), orientation, warp };
            let answer = (estimate, Some(&estimate.likeness(prior)));
            verdict::of_job(&rim, &ScanOptions::default(), answer, None, None)
        };
        Self::counted(&rows.iter().zip(estimates).map(verdict).collect::<Vec<Verdict>>())
    }

    fn counted(verdicts: &[Verdict]) -> Self {
        let mut counts = Self::default();
        for verdict in verdicts {
            *match verdict.level {
                Level::Reliable => &mut counts.reliable,
                Level::Doubtful => &mut counts.doubtful,
                Level::DoNotUse => &mut counts.do_not_use,
            } += 1;
            let worse = verdict.grounds.iter().filter(|ground| ground.level > Level::Reliable);
            // a code may stand for several stiffnesses of one answer
            let mut codes: Vec<&str> = worse.map(|ground| ground.code.name()).collect();
            codes.sort_unstable();
            codes.dedup();
            for code in codes {
                *counts.grounds.entry(code).or_default() += 1;
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::job::verdict::{Code, Ground};

    #[test]
    fn answers_are_counted_by_level_and_a_ground_once_an_answer() {
        let ground = |code, level| Ground::new(code, level, (1.0, 0.5, "mm"), String::new());
        let (doubtful, unused) = (Level::Doubtful, Level::DoNotUse);
        let verdicts = [
            Verdict::of(vec![ground(Code::RimFromFile, Level::Reliable)]),
            Verdict::of(vec![
                ground(Code::OutOfRange, doubtful),
                ground(Code::OutOfRange, doubtful),
            ]),
            Verdict::of(vec![ground(Code::NovelRim, unused), ground(Code::OutOfRange, doubtful)]),
        ];
        let Verdicts { reliable, doubtful, do_not_use, grounds } = Verdicts::counted(&verdicts);
        assert_eq!([reliable, doubtful, do_not_use], [1, 1, 1]);
        assert_eq!(grounds, BTreeMap::from([("novel_rim", 1), ("out_of_range", 2)]));
    }
}

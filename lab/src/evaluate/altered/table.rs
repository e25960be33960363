//! Records of altered scans by what was altered.

use super::{Alteration, Outcome, Record};
use scan2params::job::verdict::Level;

/// What became of the scans with one alteration, or of all.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The alteration's name, or `all`.
    pub name: &'static str,
    /// Scans of a drape.
    pub scans: usize,
    /// Refused, not to be used, doubtful and reliable ones.
    pub verdicts: [usize; 4],
    /// Reliable ones that are wrong.
    pub wrong: usize,
    /// Of those refused or not to be used how many name the true cause first.
    pub named: [usize; 2],
    /// Over the reliable ones the bending farthest from its truth, and the largest factor of a
    /// stretch or shear; 1 where there is none.
    pub worst: [f64; 2],
}

impl Group {
    /// The columns of [`Self::row`].
    pub const COLUMNS: &str = "altered            scans  refused  do not use  doubtful  reliable  wrong  named       bending  stretch";

    /// One group for each alteration, and one for all.
    #[must_use]
    pub fn all(records: &[Record]) -> Vec<Self> {
        let mut kinds: Vec<Alteration> = records.iter().map(|record| record.alteration).collect();
        kinds.sort();
        kinds.dedup();
        let of = |kind: &Alteration| {
            let own: Vec<&Record> = records.iter().filter(|r| r.alteration == *kind).collect();
            Self::of(kind.name(), &own)
        };
        let all: Vec<&Record> = records.iter().collect();
        kinds.iter().map(of).chain([Self::of("all", &all)]).collect()
    }

    fn of(name: &'static str, records: &[&Record]) -> Self {
        let mut verdicts = [0; 4];
        let mut worst = [1.0; 2];
        for record in records {
            match &record.outcome {
                Outcome::NoDrape => {}
                Outcome::Refused(..) => verdicts[0] += 1,
                Outcome::Answered { level, off, .. } => {
                    verdicts[3 - *level as usize] += 1;
                    if let (Level::Reliable, Some(off)) = (level, off) {
                        let farther = off.bending.ln().abs() > f64::ln(worst[0]).abs();
                        worst[0] = if farther { off.bending } else { worst[0] };
                        worst[1] = off.stretch.max(worst[1]);
                    }
                }
            }
        }
        let names: Vec<bool> = records.iter().filter_map(|r| r.names_its_cause()).collect();
        Self {
            name,
            scans: verdicts.iter().sum(),
            verdicts,
            wrong: records.iter().filter(|r| r.is_reliable_though_wrong()).count(),
            named: [names.iter().filter(|right| **right).count(), names.len()],
            worst,
        }
    }

    /// A line of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { name, scans, verdicts: [refused, unusable, doubtful, reliable], .. } = self;
        let [right, of] = self.named;
        format!(
            "{name:<17}  {scans:>5}  {refused:>7}  {unusable:>10}  {doubtful:>8}  {reliable:>8}  {:>5}  {right:>3} of {of:>3}  {:>7.2}  {:>7.2}",
            self.wrong, self.worst[0], self.worst[1]
        )
    }
}

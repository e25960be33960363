//! The tables of `scan2params-lab scenes`.
//!
//! In: [`Record`]s. Out: of valid scenes a [`Group`] per sensor and class of bending length, and
//! how often each refusal came; of broken ones what was wrong against what was named; of variants
//! how far rims moved.

use std::collections::BTreeMap;

use serde::Serialize;

use super::broken::Cause;
use super::{Outcome, Record, Variant};
use scan2params::numeric::robust;

/// Bending lengths that are told apart \[mm\]: the stiffer, the softer, and what is softer still
/// or not known.
const CLASSES_MM: [(&str, [f64; 2]); 3] =
    [(">=9 mm", [9.0, f64::INFINITY]), ("2.5-9 mm", [2.5, 9.0]), ("other", [f64::NAN, f64::NAN])];

/// A rim that is farther off than this in the mean has moved \[mm\].
const MOVED_MM: f64 = 0.2;

/// The valid scenes of one sensor and class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// The sensor, or `all`.
    pub sensor: String,
    /// The class of bending lengths.
    pub class: &'static str,
    /// Scenes.
    pub scenes: usize,
    /// Those answered.
    pub answered: usize,
    /// Mean of the answers' mean rim errors \[mm\]; null without answers.
    pub rim_mean_mm: Option<f64>,
    /// Largest error of a rim point \[mm\].
    pub rim_largest_mm: Option<f64>,
    /// Root mean square error of a coordinate over the stated sigma, in the mean.
    pub error_over_sigma: Option<f64>,
    /// The same of the sheet, across the cloth.
    pub sheet_over_sigma: Option<f64>,
    /// Refusals by name.
    pub refusals: BTreeMap<String, usize>,
}

impl Group {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &'static str = "sensor, bending_length, scenes, answered, share, rim_mean_mm, rim_largest_mm, error_over_sigma, sheet_over_sigma, refusals";

    /// Of all sensors and classes, empty ones left out, and of all sensors together.
    #[must_use]
    pub fn all(records: &[Record]) -> Vec<Self> {
        let valid: Vec<&Record> = records.iter().filter(|r| r.cause == Cause::Valid).collect();
        let mut sensors: Vec<&str> = valid.iter().map(|r| r.sensor.as_str()).collect();
        sensors.sort_unstable();
        sensors.dedup();
        sensors.push("all");
        let of = |sensor: &str, class: &'static str| {
            let own = valid.iter().filter(|r| sensor == "all" || r.sensor == sensor);
            let own = own.filter(|r| class_of(r) == class).copied().collect::<Vec<_>>();
            (!own.is_empty()).then(|| Self::of(sensor, class, &own))
        };
        let classes = CLASSES_MM.map(|(class, _)| class);
        sensors.iter().flat_map(|s| classes.iter().filter_map(|c| of(s, c))).collect()
    }

    fn of(sensor: &str, class: &'static str, records: &[&Record]) -> Self {
        let mut refusals = BTreeMap::new();
        let (mut means, mut largest) = (Vec::new(), Vec::new());
        let (mut ratios, mut sheet_ratios) = (Vec::new(), Vec::new());
        for record in records {
            match &record.outcome {
                Outcome::Answered {
                    rim_mean_mm,
                    rim_largest_mm,
                    rms_and_sigma_mm,
                    sheet_rms_and_sigma_mm: [rms, sigma],
                    ..
                } => {
                    sheet_ratios.push(rms / sigma);
                    means.push(*rim_mean_mm);
                    largest.push(*rim_largest_mm);
                    ratios.push(rms_and_sigma_mm[0] / rms_and_sigma_mm[1]);
                }
                Outcome::Refused { error, .. } => *refusals.entry(error.clone()).or_default() += 1,
            }
        }
        let mean = |v: &[f64]| (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64);
        Self {
            sensor: sensor.to_owned(),
            class,
            scenes: records.len(),
            answered: means.len(),
            rim_mean_mm: mean(&means),
            rim_largest_mm: largest.iter().copied().reduce(f64::max),
            error_over_sigma: mean(&ratios),
            sheet_over_sigma: mean(&sheet_ratios),
            refusals,
        }
    }

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { sensor, class, scenes, answered, .. } = self;
        let share = *answered as f64 / *scenes as f64;
        let [mean, largest] = [self.rim_mean_mm, self.rim_largest_mm].map(number);
        let [ratio, sheet] = [self.error_over_sigma, self.sheet_over_sigma].map(number);
        let refusals = counts(&self.refusals);
        format!(
            "{sensor}, {class}, {scenes}, {answered}, {share:.2}, {mean}, {largest}, {ratio}, {sheet}, {refusals}"
        )
    }
}

/// The class of a record's bending length.
fn class_of(record: &Record) -> &'static str {
    let inside = |[low, high]: [f64; 2]| {
        record.bending_length_mm.is_some_and(|mm| (low..high).contains(&mm))
    };
    CLASSES_MM.iter().find(|(_, limits)| inside(*limits)).map_or("other", |(class, _)| class)
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
}

fn counts(of: &BTreeMap<String, usize>) -> String {
    let words: Vec<String> = of.iter().map(|(name, count)| format!("{name} {count}")).collect();
    if words.is_empty() { "-".to_owned() } else { words.join("; ") }
}

/// The scenes of one cause, and their refusals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Named {
    /// What was wrong.
    pub cause: Cause,
    /// Scenes.
    pub scenes: usize,
    /// Those where the program did right ([`Record::is_right`]).
    pub right: usize,
    /// Answers by whether the rim is right, and refusals, by name.
    pub named: BTreeMap<String, usize>,
}

impl Named {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &'static str = "cause, scenes, right, named";

    /// Of every cause that is there.
    #[must_use]
    pub fn all(records: &[Record]) -> Vec<Self> {
        let mut all: BTreeMap<Cause, Self> = BTreeMap::new();
        for record in records.iter().filter(|r| r.cause != Cause::Valid) {
            let cause = record.cause;
            let fresh = || Self { cause, scenes: 0, right: 0, named: BTreeMap::new() };
            let own = all.entry(cause).or_insert_with(fresh);
            own.scenes += 1;
            own.right += usize::from(record.is_right());
            let word = match &record.outcome {
                Outcome::Refused { error, .. } => error.clone(),
                Outcome::Answered { .. } if record.is_right() => "answered, right".to_owned(),
                Outcome::Answered { .. } => "answered, wrong".to_owned(),
            };
            *own.named.entry(word).or_default() += 1;
        }
        all.into_values().collect()
    }

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { cause, scenes, right, named } = self;
        format!("{}, {scenes}, {right}, {}", cause.name(), counts(named).replace(", ", " "))
    }
}

/// One kind of variant over all scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moved {
    /// What was done to the clouds.
    pub variant: &'static str,
    /// Clouds.
    pub scenes: usize,
    /// Those with another outcome than the whole cloud.
    pub changed: usize,
    /// Median of the mean distances of two rims \[mm\]; null without a pair.
    pub median_shift_mm: Option<f64>,
    /// Pairs of rims farther apart than 0.2 mm in the mean.
    pub moved: usize,
    /// The same but for a rigid motion.
    pub deformed: usize,
    /// Largest distance of two rims' points \[mm\]; null without a pair.
    pub largest_shift_mm: Option<f64>,
    /// What the changed ones came to, by name.
    pub changed_to: BTreeMap<String, usize>,
}

impl Moved {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &'static str =
        "variant, scenes, changed, median_shift_mm, moved, deformed, largest_shift_mm, changed_to";

    /// Of every kind that is there.
    #[must_use]
    pub fn all(records: &[Record]) -> Vec<Self> {
        let mut all: BTreeMap<&'static str, Vec<&Variant>> = BTreeMap::new();
        for variant in records.iter().flat_map(|r| &r.variants) {
            all.entry(variant.name).or_default().push(variant);
        }
        let of = |(variant, own): (&'static str, Vec<&Variant>)| {
            let mut changed_to = BTreeMap::new();
            for changed in own.iter().filter(|v| !v.same) {
                let word = changed.error.clone().unwrap_or_else(|| "answered".to_owned());
                *changed_to.entry(word).or_default() += 1;
            }
            let deformed = own.iter().filter_map(|v| v.deformed_mm);
            let shifts = || own.iter().filter_map(|v| v.rim_shift_mm);
            Self {
                variant,
                scenes: own.len(),
                changed: changed_to.values().sum(),
                median_shift_mm: robust::median(shifts().map(|[mean, _]| mean).collect()),
                moved: shifts().filter(|[mean, _]| *mean > MOVED_MM).count(),
                deformed: deformed.filter(|mm| *mm > MOVED_MM).count(),
                largest_shift_mm: shifts().map(|[_, largest]| largest).reduce(f64::max),
                changed_to,
            }
        };
        all.into_iter().map(of).collect()
    }

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { variant, scenes, changed, moved, deformed, changed_to, .. } = self;
        let [median, largest] = [self.median_shift_mm, self.largest_shift_mm].map(number);
        let to = counts(changed_to);
        format!("{variant}, {scenes}, {changed}, {median}, {moved}, {deformed}, {largest}, {to}")
    }
}

impl Record {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &'static str = "index, sensor, stand, scene, drape, bending_length_mm, views, unit, points, rim_seen, cause, \
         outcome, rim_mean_mm, rim_largest_mm, deformed_mm, rms_mm, sigma_mm, sheet_rms_mm, sheet_sigma_mm, \
         seconds, message";

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { index, sensor, stand, scene, drape, views, unit, points, .. } = self;
        let length = self.bending_length_mm.map_or("-".to_owned(), |mm| format!("{mm:.1}"));
        let outcome = match &self.outcome {
            Outcome::Answered {
                rim_mean_mm,
                rim_largest_mm,
                deformed_mm,
                rms_and_sigma_mm: [rms, sigma],
                sheet_rms_and_sigma_mm: [sheet_rms, sheet_sigma],
                ..
            } => {
                let rim = [rim_mean_mm, rim_largest_mm, deformed_mm, rms, sigma];
                let numbers = [&rim[..], &[sheet_rms, sheet_sigma]].concat();
                let numbers =
                    numbers.iter().map(|mm| format!("{mm:.2}")).collect::<Vec<_>>().join(", ");
                format!("answered, {numbers}, {:.1}, ", self.seconds)
            }
            Outcome::Refused { error, message, .. } => {
                format!(
                    "{error}, , , , , , , , {:.1}, {}",
                    self.seconds,
                    message.replace(", ", "; ")
                )
            }
        };
        format!(
            "{index}, {sensor}, {stand}, {scene}, {drape}, {length}, {views}, {unit}, {points}, {:.2}, {}, {outcome}",
            self.rim_seen,
            self.cause.name()
        )
    }
}

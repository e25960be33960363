//! What a result is worth: reliable, doubtful, or not to be used, and on what grounds.
//!
//! In: the rim, the estimate and, where there is one, the drape of the estimate. Out: a
//! [`Verdict`], which stands at the top of the table, of params.json and of a batch's row.
//! A verdict is the worst of its [`Ground`]s; without any it is `reliable`. Each ground has
//! a stable code, the number measured, the limit, and a sentence with the remedy.
//!
//! A ground may also say that what was scanned is not the experiment at all (a plate of
//! another size, a pleated skirt, two cloths in one file): then every stiffness is of
//! something else, and the program ends with exit code 4.
//!
//! The numbers are gathered first ([`Figures`]), then held against [`Limits`]: one pure
//! function, [`Figures::verdict`]. The limits were measured on valid scans
//! (`scan2params-lab verdict`), so that these are reliable.
//!
//! Where it fails: what leaves no trace in these figures goes unnoticed. A vertical scale
//! that is 2 % off looks like another fabric.
//!
//! To add a ground: a [`Code`], and where the signal becomes known a `Ground::new(code, level,
//! (measured, limit, unit), text)`, with `.not_the_experiment()` where that follows. Signals
//! of the scan path travel up as numbers (of `scan::Quality`, or of the [`super::Rim`]),
//! become a field of [`Figures`] and grounds in `grounds`; the layers below `job` know
//! nothing of verdicts.

mod figures;
mod grounds;
mod limits;
mod scale;
#[cfg(test)]
mod tests;

use serde::Serialize;

use super::{Refinement, Rim};
use crate::estimate::Estimate;
use crate::fabric::Likeness;
use crate::refine::ReleasedDrape;
use crate::scan::{ScanOptions, ScannedBoundary};

pub use figures::{Answer, Figures, Fit, Given, InPrior, OnPlate, Parameter, Refining, Shown};
pub use limits::{Limits, Steps};
pub use scale::{Scale, ScaleBy};

/// How far a result can be relied on. The order is from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Level {
    /// The scan and the result look normal. As the level of a ground: a note, which does not make
    /// the result any worse.
    Reliable,
    /// Something is unusual; at least a part of the result may be off by more than its interval.
    Doubtful,
    /// The result is known to be wrong, or nothing is known of how wrong it is.
    DoNotUse,
}

impl Level {
    /// All levels, best first.
    pub const ALL: [Self; 3] = [Self::Reliable, Self::Doubtful, Self::DoNotUse];

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

/// Declares the codes with their names in files, so that no code is without one.
macro_rules! codes {
    ($($(#[$doc:meta])* $code:ident = $name:literal,)*) => {
        /// What a ground is about. The names in files are stable: programs compare them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        pub enum Code { $($(#[$doc])* #[serde(rename = $name)] $code,)* }

        impl Code {
            /// All codes.
            pub const ALL: &[Self] = &[$(Self::$code,)*];

            /// The name in files.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$code => $name,)* }
            }
        }
    };
}

codes! {
    /// The scan's scale is off, by the four sides together, or by the cloth from edge to edge and
    /// the plate.
    Scale = "scale",
    /// A side of the rim differs from the specimen's by more than cloth stretches.
    SideLength = "side_length",
    /// The cloth from edge to opposite edge is too long or too short.
    Width = "width",
    /// The sides of one rim differ among each other.
    UnevenSides = "uneven_sides",
    /// The plate found is not of the radius given.
    PlateRadius = "plate_radius",
    /// The specimen lies off the plate's centre.
    OffCentre = "off_centre",
    /// The plate is not level.
    Tilted = "tilted",
    /// Little of the rim was seen.
    RimHidden = "rim_hidden",
    /// A long arc of the rim was bridged.
    RimBridged = "rim_bridged",
    /// The fitted sheet is nearly as far from the scanned cloth as is refused.
    SheetMisfit = "sheet_misfit",
    /// Nearly as much cloth near the rim as is refused lies off the fitted sheet.
    Unexplained = "unexplained_cloth",
    /// The rim was read from a file, so that the cloth and the plate could not be checked.
    RimFromFile = "rim_from_file",
    /// The direction given for the warp was not used: the file of the rim says it.
    WarpFromFile = "warp_from_file",
    /// The direction given for the warp lies near a diagonal of the specimen.
    WarpNearDiagonal = "warp_near_diagonal",
    /// Weft and warp are not known.
    OrientationAmbiguous = "orientation_ambiguous",
    /// The rim is unlike all rims of the training.
    NovelRim = "novel_rim",
    /// A stiffness is at or beyond the end of what the model was trained on.
    OutOfRange = "out_of_range",
    /// The interval of a stiffness was cut at the end of what the model was trained on.
    IntervalAtBound = "interval_at_bound",
    /// The fabric lies outside every part of the prior that the model was trained on.
    OutsidePrior = "outside_prior",
    /// The density lies outside the training.
    DensityOutsideTraining = "density_outside_training",
    /// The three bending stiffnesses had to be made those of one plate.
    BendingProjected = "bending_projected",
    /// The rim has more or fewer folds than cloth of the bending length found makes.
    FoldsForBending = "folds_for_bending",
    /// Refining found no fabric that is the answer: the values are the network's.
    NotRefined = "not_refined",
    /// Held to the scan, the drape of the fabric that was found is farther from it than scan and
    /// simulator err.
    ModelMisfit = "model_misfit",
    /// A refined stiffness is hardly visible in this drape: its interval is the network's.
    HardlyVisible = "hardly_visible",
    /// The released drape has another number of folds than the scan.
    FoldsDiffer = "folds_differ",
    /// The released drape lies far from the scanned rim.
    ReleasedDrapeOff = "released_drape_off",
    /// The released drape did not come to rest.
    ReleasedDrapeNotAtRest = "released_drape_not_at_rest",
    /// The released drape passes through itself.
    ReleasedDrapeIntersects = "released_drape_intersects",
}

/// One thing that speaks against a result, or has to be known with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Ground {
    /// What it is about.
    pub code: Code,
    /// What it makes of the result.
    pub level: Level,
    /// Whether what was scanned is not the experiment.
    pub not_the_experiment: bool,
    /// The stiffness that it concerns, by its key in params.json; `None` for all.
    #[cfg_attr(test, schemars(extend("enum" = [
        "stretch_weft", "stretch_warp", "shear", "bending_weft", "bending_warp", "bending_bias", null
    ])))]
    pub parameter: Option<&'static str>,
    /// The number measured \[`unit`\].
    pub measured: f64,
    /// The limit that it was held against \[`unit`\].
    pub limit: f64,
    /// Unit of both, empty for counts and shares.
    pub unit: &'static str,
    /// What was measured, the limit and the remedy, in words, which may change.
    pub text: String,
}

impl Ground {
    /// A ground that says nothing of whether the scan shows the experiment.
    #[must_use]
    pub fn new(code: Code, level: Level, (measured, limit, unit): Measured, text: String) -> Self {
        let (not_the_experiment, parameter) = (false, None);
        Self { code, level, not_the_experiment, parameter, measured, limit, unit, text }
    }

    /// The same ground, which also says that what was scanned is not the experiment. Such a
    /// result is not to be used.
    #[must_use]
    pub fn not_the_experiment(self) -> Self {
        Self { level: Level::DoNotUse, not_the_experiment: true, ..self }
    }

    /// The same ground, about one stiffness.
    #[must_use]
    pub fn about(self, parameter: &'static str) -> Self {
        Self { parameter: Some(parameter), ..self }
    }
}

/// A number measured, the limit it was held against, and the unit of both.
pub type Measured = (f64, f64, &'static str);

/// What a result is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Verdict {
    /// The worst level of all grounds.
    pub level: Level,
    /// Whether what was scanned is not the experiment.
    pub not_the_experiment: bool,
    /// The grounds, worst first.
    pub grounds: Vec<Ground>,
    /// The scan's scale; not there without an answer, or where the cloth was not seen from edge to
    /// edge.
    #[cfg_attr(test, schemars(with = "Scale"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
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
            scale: None,
        }
    }

    /// Whether the program ends as if the scan were refused: always where it is not the
    /// experiment, with `strict` wherever the result is not to be used.
    #[must_use]
    pub fn is_refusal(&self, strict: bool) -> bool {
        self.not_the_experiment || strict && self.level == Level::DoNotUse
    }

    /// The grounds for [`Self::is_refusal`], in one sentence.
    #[must_use]
    pub fn refusal(&self) -> String {
        let what = if self.not_the_experiment {
            "what was scanned is not the experiment"
        } else {
            "the result is not to be used"
        };
        let worst = self.grounds.iter().filter(|ground| {
            ground.level == Level::DoNotUse && ground.not_the_experiment == self.not_the_experiment
        });
        let texts: Vec<&str> = worst.map(|ground| ground.text.as_str()).collect();
        format!("{what}: {}", texts.join("; "))
    }
}

/// The verdict on a job: everything known of the rim, the estimate, where it lies in the model's
/// prior, and the released drape, held against the limits of this version.
#[must_use]
pub fn of_job(
    rim: &Rim,
    options: &ScanOptions,
    (estimate, likeness): (&Estimate, Option<&Likeness>),
    refinement: Option<&Refinement>,
    released: Option<&ReleasedDrape>,
) -> Verdict {
    let figures = Figures::of_rim(rim, options).answered(estimate, likeness, released);
    let figures = match refinement {
        Some(found) => figures.refined(found),
        None => figures,
    };
    figures.verdict(&Limits::default())
}

/// The verdict on a rim, from a scan or from a file, before any estimate.
#[must_use]
pub fn of_rim(rim: &Rim, options: &ScanOptions) -> Verdict {
    Figures::of_rim(rim, options).verdict(&Limits::default())
}

/// The verdict on what was found in a scan, before any estimate: what `inspect` can say.
#[must_use]
pub fn of_scan(scanned: &ScannedBoundary, options: &ScanOptions) -> Verdict {
    Figures::of_scan(scanned, options).verdict(&Limits::default())
}

//! params.json.

use serde::Serialize;

use super::refinement::{Refinement, ReleasedDrape, TiedDrape};
use super::scan::{Quality, Read};
use crate::base::boundary::Orientation;
use crate::base::units::{DENSITY_UNIT, KG_M2_PER_G_M2, M_PER_MM};
use crate::estimate::ParameterEstimate;
use crate::fabric::params::NOTE;
use crate::fabric::{Likeness, PARAMETERS, Stiffnesses};
use crate::io::ReadOptions;
use crate::job::Outcome;
use crate::job::verdict::Verdict;
use crate::scan::ScanOptions;
use crate::sim::{Experiment, NUMERICS_VERSION, rim_nodes};

/// Version of the layout of params.json.
pub const SCHEMA_VERSION: u32 = 3;

/// What `scan2params estimate` found: `NAME.params.json` of --out, `--json` on stdout, and `result`
/// in a line of a batch.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Params {
    /// Version of the layout \[-\]; raised when a field changes its meaning or goes.
    #[cfg_attr(test, schemars(extend("const" = SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// What the result is worth.
    pub verdict: Verdict,
    /// The scan, as it was named.
    pub input: String,
    /// The six stiffnesses.
    pub parameters: Stiffnesses<Parameter>,
    /// Areal density, as it was given.
    pub density: Density,
    /// One fabric, or two where weft and warp may be exchanged: the six stiffnesses in the order
    /// S^u, S^v, H, B^u, B^v, B^h \[g/s^2 and g mm^2 s^-2 rad^-1\] and the density \[g/m^2\].
    pub candidates: Vec<[f64; PARAMETERS]>,
    /// Where the stiffnesses over the density lie among the fabrics that the model was trained on;
    /// null of a model whose prior does not ship.
    pub prior: Option<Prior>,
    /// The tied drape of the answer; null where the answer is the network's.
    pub tied_drape: Option<TiedDrape>,
    /// The released drape of the answer; null if it was not asked for.
    pub released_drape: Option<ReleasedDrape>,
    /// What refining found; null with `--quick`.
    pub refinement: Option<Refinement>,
    /// The rim.
    pub boundary: Rim,
    /// What was read of the file; null for a rim from a boundary CSV.
    pub read: Option<Read>,
    /// What was found in the scan; null for a rim that was read from a boundary CSV.
    pub quality: Option<Quality>,
    /// What is known of weft and warp.
    pub orientation: Orientation,
    /// How unlike the rim is to those of the training.
    pub novelty: Novelty,
    /// Sentences for people.
    pub warnings: Vec<String>,
    /// The trained model.
    pub model: Model,
    /// The simulator.
    pub simulator: Simulator,
    /// How the file was read.
    pub read_options: ReadOptions,
    /// Settings of the scan path, in SI units.
    pub scan_options: ScanOptions,
    /// Version of the program that wrote this.
    #[cfg_attr(test, schemars(extend("pattern" = r"^[0-9]+\.[0-9]+\.[0-9]+")))]
    pub version: &'static str,
    /// Seed of the plane search \[-\].
    pub seed: u64,
    /// Settings of the simulated experiment in SI units, where they are not the standard ones
    /// (`--effects`); null where they are. src/sim/experiment.rs has names and units.
    #[cfg_attr(test, schemars(with = "Option<serde_json::Map<String, serde_json::Value>>"))]
    pub experiment: Option<Experiment>,
    /// What the numbers are not.
    #[cfg_attr(test, schemars(extend("const" = NOTE)))]
    pub note: &'static str,
}

/// A stiffness.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Parameter {
    /// The paper's symbol.
    #[cfg_attr(test, schemars(extend("enum" = ["S^u", "S^v", "H", "B^u", "B^v", "B^h"])))]
    pub symbol: &'static str,
    /// The value \[`unit`\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub value: f64,
    /// Unit of value and interval.
    #[cfg_attr(test, schemars(extend("enum" = ["g/s^2", "g mm^2 s^-2 rad^-1"])))]
    pub unit: &'static str,
    /// 90 % interval, low and high end \[`unit`\].
    pub interval90: [f64; 2],
    /// Whether the value lies inside the range that the model was trained on.
    pub in_range: bool,
}

/// Areal density, as it was given.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Density {
    /// The value \[g/m^2\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub value: f64,
    /// Its unit.
    #[cfg_attr(test, schemars(extend("const" = DENSITY_UNIT)))]
    pub unit: &'static str,
}

/// Where a fabric lies in the prior of the training.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Prior {
    /// The prior.
    pub name: String,
    /// The parts of it that the fabric is like, likeliest first: within `limit` and of a
    /// probability of at least 0.1. Empty: like none of them.
    pub like: Vec<String>,
    /// Each part: `knit-2020` and `measured` of `union`, else the prior itself.
    pub parts: Vec<PriorPart>,
    /// The same in words.
    pub text: String,
}

/// Where a fabric lies in a part of a prior.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PriorPart {
    /// The part.
    pub name: String,
    /// That the fabric is of it, its density integrated over the 90 % intervals, if the fabric is
    /// of the prior and all parts are as likely \[-\].
    pub probability: f64,
    /// From the nearest of its Gaussians, in standard deviations of that and the intervals
    /// (Mahalanobis) \[-\].
    pub distance: f64,
    /// What 99 of 100 of its fabrics stay below \[-\].
    pub limit: f64,
}

/// The rim.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Rim {
    /// Points \[count\].
    pub points: usize,
    /// Folds \[count\].
    pub folds: usize,
    /// Share of the points that was seen, not bridged \[-\].
    #[cfg_attr(test, schemars(range(min = 0, max = 1)))]
    pub observed_fraction: f64,
    /// Mean standard deviation of a point \[mm\].
    pub mean_sigma_mm: f64,
}

/// How unlike a rim is to those of the training.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Novelty {
    /// Distance \[mm\].
    pub rms_mm: f64,
    /// Beyond this a rim is novel \[mm\].
    pub limit_mm: f64,
}

/// A trained model.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Model {
    /// Its name.
    pub id: String,
    /// SHA-256 of its ONNX file, in hexadecimal.
    #[cfg_attr(test, schemars(extend("pattern" = "^[0-9a-f]{64}$")))]
    pub sha256: String,
}

/// The simulator.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Simulator {
    /// Version of its numerics \[-\]: within one, the same input gives the same bits.
    pub numerics_version: u64,
}

impl Params {
    /// Of a job that was done.
    #[must_use]
    pub fn of(outcome: &Outcome) -> Self {
        let (job, estimate, rim) = (&outcome.job, &outcome.estimate, outcome.rim.boundary());
        let candidates = estimate.candidates.iter().map(|c| c.fabric.to_paper_units());
        let taken = outcome.taken();
        let [id, sha256] = outcome.model.clone();
        Self {
            schema_version: SCHEMA_VERSION,
            verdict: outcome.verdict.clone(),
            input: job.input.display().to_string(),
            parameters: estimate.parameters().map(|p| Parameter::of(&p)).into(),
            density: Density { value: job.density_kg_m2 / KG_M2_PER_G_M2, unit: DENSITY_UNIT },
            candidates: candidates.collect(),
            prior: outcome.likeness.as_ref().map(Prior::of),
            tied_drape: taken.map(|taken| TiedDrape::of(taken.first(), taken.refined().misfit)),
            released_drape: outcome.released.as_ref().map(ReleasedDrape::of),
            refinement: outcome.refinement.as_ref().map(Refinement::of),
            boundary: Rim {
                points: rim.points().len(),
                folds: rim_nodes(rim),
                observed_fraction: outcome.rim.observed_fraction(),
                mean_sigma_mm: rim.mean_sigma_m() / M_PER_MM,
            },
            read: outcome.rim.notes().map(Read::of),
            quality: outcome.rim.scanned().map(Quality::of),
            orientation: outcome.rim.orientation(),
            novelty: Novelty {
                rms_mm: estimate.novelty.rms_m / M_PER_MM,
                limit_mm: estimate.novelty.limit_m / M_PER_MM,
            },
            warnings: estimate.warnings.iter().map(ToString::to_string).collect(),
            model: Model { id, sha256 },
            simulator: Simulator { numerics_version: NUMERICS_VERSION.into() },
            read_options: job.read.clone(),
            scan_options: job.scan.clone(),
            version: env!("CARGO_PKG_VERSION"),
            seed: job.scan.seed,
            experiment: (job.experiment != Experiment::default()).then_some(job.experiment),
            note: NOTE,
        }
    }
}

impl Parameter {
    fn of(p: &ParameterEstimate) -> Self {
        let ParameterEstimate { symbol, value, unit, interval90, in_range, .. } = *p;
        Self { symbol, value, unit, interval90, in_range }
    }
}

impl Prior {
    fn of(likeness: &Likeness) -> Self {
        let parts = likeness.parts.iter().map(|part| PriorPart {
            name: part.name.clone(),
            probability: part.probability,
            distance: part.distance,
            limit: part.limit,
        });
        Self {
            name: likeness.prior.clone(),
            like: likeness.like().iter().map(|part| part.name.clone()).collect(),
            parts: parts.collect(),
            text: likeness.words(),
        }
    }
}

#[cfg(test)]
#[test]
fn the_schema_of_params_is_that_of_the_type() {
    crate::base::schema::holds::<Params>("params", "params.json", &[]);
}

//! A combination as JSON.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Combination, Combined, LeftOut, Used};
use crate::base::units::DENSITY_UNIT;
use crate::fabric::Stiffnesses;
use crate::fabric::params::NOTE;
use crate::report::json::{Model, Simulator};

/// Version of the layout of the JSON.
pub const SCHEMA_VERSION: u32 = 2;

/// Repeated drapes of one fabric: what `scan2params combine` writes with --out and prints with
/// --json. `simulate --params` and `export` read it.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct File {
    /// Version of the layout \[-\]; raised when a field changes its meaning or goes.
    #[cfg_attr(test, schemars(extend("const" = SCHEMA_VERSION)))]
    schema_version: u32,
    /// The six stiffnesses.
    parameters: Stiffnesses<Parameter>,
    /// Areal density.
    density: Density,
    /// Folds of the drapes.
    folds: Folds,
    /// Drapes that were used.
    drapes: Vec<DrapeUsed>,
    /// Drapes that were not.
    left_out: Vec<DrapeLeftOut>,
    /// Sentences for people.
    notes: Vec<String>,
    /// The trained model.
    model: Model,
    /// The simulator.
    simulator: Simulator,
    /// Version of the program that wrote this.
    #[cfg_attr(test, schemars(extend("pattern" = r"^[0-9]+\.[0-9]+\.[0-9]+")))]
    version: &'static str,
    /// What the numbers are not.
    #[cfg_attr(test, schemars(extend("const" = NOTE)))]
    note: &'static str,
}

/// A stiffness over all drapes.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Parameter {
    /// The paper's symbol.
    #[cfg_attr(test, schemars(extend("enum" = ["S^u", "S^v", "H", "B^u", "B^v", "B^h"])))]
    symbol: &'static str,
    /// Mean over the drapes, of logarithms \[`unit`\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    value: f64,
    /// Unit of values and intervals.
    #[cfg_attr(test, schemars(extend("enum" = ["g/s^2", "g mm^2 s^-2 rad^-1"])))]
    unit: &'static str,
    /// 90 % interval of the fabric's value \[`unit`\].
    interval90: [f64; 2],
    /// Mean of the plain values \[`unit`\].
    mean: f64,
    /// Standard deviation of the plain values \[`unit`\]; null of one drape.
    sd: Option<f64>,
    /// The same over the mean \[%\]; null of one drape.
    cv_percent: Option<f64>,
    /// What drapes scatter beyond what each says of itself, of logarithms \[-\].
    sd_ln_between: f64,
    /// What drapes state of themselves, root mean square, of logarithms \[-\].
    sd_ln_stated: f64,
    /// Whether it lies inside the trained range in all drapes.
    in_range: bool,
}

/// Areal density.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Density {
    /// Mean \[g/m^2\].
    value: f64,
    /// Unit of all three.
    #[cfg_attr(test, schemars(extend("const" = DENSITY_UNIT)))]
    unit: &'static str,
    /// Least of the drapes \[g/m^2\].
    least: f64,
    /// Most of the drapes \[g/m^2\].
    most: f64,
}

/// Folds of the drapes.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Folds {
    /// How many drapes \[count\] have how many folds (the key).
    #[cfg_attr(test, schemars(extend(
        "additionalProperties" = { "type": "integer", "minimum": 1 }
    )))]
    drapes: BTreeMap<String, usize>,
    /// The commonest count \[count\]; null if none is.
    modal: Option<usize>,
}

/// A drape that was used.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DrapeUsed {
    /// Its params.json.
    file: String,
    /// Its scan.
    input: String,
    /// Its folds \[count\]; null: not known.
    folds: Option<usize>,
    /// Its verdict.
    #[cfg_attr(test, schemars(with = "crate::job::verdict::Level"))]
    verdict: String,
    /// Codes of the grounds that speak against it.
    grounds: Vec<String>,
    /// Whether it was refined.
    refined: bool,
    /// Mean distance of the tied drape's rim from the scanned one \[mm\]; null where the answer is
    /// the network's.
    tied_drape_mm: Option<f64>,
    /// Where it lies apart from the others, in sentences.
    outlying: Vec<String>,
}

/// A drape that was left out.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DrapeLeftOut {
    /// Its params.json.
    file: String,
    /// Its scan.
    input: String,
    /// Why it was not used.
    reason: String,
}

impl File {
    pub(super) fn of(found: &Combined) -> Self {
        let densities = || found.used.iter().map(|used| used.drape.density_g_m2);
        let first = &found.used[0].drape;
        let [id, sha256] = first.model.clone();
        Self {
            schema_version: SCHEMA_VERSION,
            parameters: found.parameters.each_ref().map(Parameter::of).into(),
            density: Density {
                value: found.density_g_m2,
                unit: DENSITY_UNIT,
                least: densities().fold(f64::INFINITY, f64::min),
                most: densities().fold(0.0, f64::max),
            },
            folds: Folds {
                drapes: found.folds.iter().map(|(folds, n)| (folds.to_string(), *n)).collect(),
                modal: found.modal,
            },
            drapes: found.used.iter().map(DrapeUsed::of).collect(),
            left_out: found.left_out.iter().map(DrapeLeftOut::of).collect(),
            notes: found.notes.clone(),
            model: Model { id, sha256 },
            simulator: Simulator { numerics_version: first.numerics },
            version: env!("CARGO_PKG_VERSION"),
            note: NOTE,
        }
    }
}

impl Parameter {
    fn of(p: &Combination) -> Self {
        Self {
            symbol: p.symbol,
            value: p.value,
            unit: p.unit,
            interval90: p.interval90,
            mean: p.mean,
            sd: p.sd,
            cv_percent: p.cv_percent,
            sd_ln_between: p.pooled.between,
            sd_ln_stated: p.pooled.within,
            in_range: p.in_range,
        }
    }
}

impl DrapeUsed {
    fn of(used: &Used) -> Self {
        let drape = &used.drape;
        Self {
            file: drape.file.display().to_string(),
            input: drape.input.clone(),
            folds: drape.folds,
            verdict: drape.verdict.clone(),
            grounds: drape.grounds.clone(),
            refined: drape.refined,
            tied_drape_mm: drape.rim_error_mm,
            outlying: used.outlying.clone(),
        }
    }
}

impl DrapeLeftOut {
    fn of(left_out: &LeftOut) -> Self {
        Self {
            file: left_out.drape.file.display().to_string(),
            input: left_out.drape.input.clone(),
            reason: left_out.reason.clone(),
        }
    }
}

#[cfg(test)]
#[test]
fn the_schema_of_a_combination_is_that_of_the_type() {
    let of_params = ["Level", "Model", "Simulator"];
    crate::base::schema::holds::<File>("combine", "A combination", &of_params);
}

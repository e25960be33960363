//! calibration.json, and the numbers of effects in the units of files.

use serde_json::{Value, json};

use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::calibrate::comparison::Comparison;
use crate::calibrate::effect::{Effect, Number};
use crate::calibrate::explain::{Cause, Explanation, Explanations};
use crate::calibrate::field::{Field, FieldLayer};
use crate::calibrate::fit::Fitted;
use crate::calibrate::floor::{Pairing, Spread};
use crate::calibrate::found::FoundEffect;
use crate::calibrate::manifest::Face;
use crate::calibrate::measured::Measured;
use crate::calibrate::pose::Pose;
use crate::calibrate::result::{ComparedDrape, FabricResult, Group, Pair};
use crate::calibrate::run::{Calibration, Refused};
use crate::fabric::TABLE_2;
use crate::numeric::moments::{mean, mean_and_error};
use crate::report::section::Section;
use crate::sim::experiment::Specimen;

/// Version of calibration.json.
pub const SCHEMA_VERSION: u32 = 3;

/// calibration.json of the sections of its fabrics; lengths in mm, angles in degrees.
#[must_use]
pub fn json(sections: &[Section], refused: &[Refused]) -> Value {
    whole(sections.iter().map(|section| (section.name.clone(), section.json.clone())), refused)
}

/// The same of a calibration of which nothing is written.
#[must_use]
pub fn json_of(calibration: &Calibration) -> Value {
    let fabrics = calibration.fabrics.iter();
    whole(fabrics.map(|fabric| (fabric.name.clone(), of_fabric(fabric))), &calibration.refused)
}

fn whole(fabrics: impl Iterator<Item = (String, Value)>, refused: &[Refused]) -> Value {
    let of = |r: &Refused| json!({"line": r.line, "file": r.name, "why": r.why});
    json!({
        "schema_version": SCHEMA_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "fabrics": fabrics.collect::<serde_json::Map<String, Value>>(),
        "refused": refused.iter().map(of).collect::<Vec<_>>(),
    })
}

pub(super) fn of_fabric(fabric: &FabricResult) -> Value {
    let density = json!({
        "value": fabric.fabric_prior.density_kg_m2 / KG_M2_PER_G_M2,
        "unit": "g/m^2",
        "known": fabric.fabric_prior.density_known,
    });
    let floor: serde_json::Map<String, Value> =
        fabric.floor.iter().map(|s| (s.pairing.name().to_owned(), of_spread(s))).collect();
    let mut text = json!({
        "density": density,
        "outlines": fabric.measured.iter().map(of_measured).collect::<Vec<_>>(),
        "floor": floor,
        "drapes": fabric.drapes.iter().map(|d| of_drape(fabric, d)).collect::<Vec<_>>(),
        "groups": fabric.groups().iter().map(of_group).collect::<Vec<_>>(),
    });
    match &fabric.fitted {
        Ok(fitted) => text["fit"] = of_fit(fitted),
        Err(error) => text["failed"] = json!(error.to_string()),
    }
    text["verdict"] = json!(fabric.verdict.name());
    let found = fabric.after.iter().flat_map(|after| &after.effects);
    text["effects"] = found.flat_map(of_effect).collect();
    text["explanations"] = fabric.explanations.as_ref().map_or(Value::Null, of_explanations);
    let specimen = fabric.measured.first().map(|measured| measured.bench.specimen);
    let fields = specimen.iter().flat_map(|s| fabric.fields.iter().map(move |f| of_field(f, s)));
    text["fields"] = fields.collect();
    text["residual"] = fabric.residual_size().map_or(Value::Null, |of| {
        let length_mm = of.correlation_length_m / M_PER_MM;
        json!({"rms_mm": of.rms_m / M_PER_MM, "correlation_length_mm": length_mm})
    });
    text["holdout"] = of_holdout(fabric);
    if let Some(after) = &fabric.after {
        text["after"] = json!({
            "fit": of_fit(&after.fitted),
            "drapes": after.drapes.iter().map(|d| of_drape(fabric, d)).collect::<Vec<_>>(),
            "groups": fabric.groups_of(&after.drapes).iter().map(of_group).collect::<Vec<_>>(),
        });
    }
    text
}

/// One entry for each number of an effect.
fn of_effect(found: &FoundEffect) -> Vec<Value> {
    let of = |(number, value, ends): &(&Number, f64, [f64; 2])| {
        let of = Shown::of(number, *value, *ends);
        json!({
            "name": of.name,
            "part": of.part,
            "value": of.value,
            "unit": of.unit,
            "interval90": of.interval90,
            "group": found.group,
        })
    };
    found.numbers.iter().map(of).collect()
}

/// The explanations, the most probable first; a cause is the names of its effects, `nothing`, or
/// `else`.
fn of_explanations(explanations: &Explanations) -> Value {
    let of =
        |e: &Explanation| json!({"cause": cause_names(&e.cause), "probability": e.probability});
    explanations.0.iter().map(of).collect()
}

pub(super) fn cause_names(cause: &Cause) -> Vec<&'static str> {
    match cause {
        Cause::Nothing => vec!["nothing"],
        Cause::Effects(effects) => effects.iter().map(|effect| effect.name).collect(),
        Cause::Else => vec!["else"],
    }
}

/// A field's numbers at its nodes, along the warp and then along the weft, and where it is
/// strongest.
fn of_field(field: &Field, specimen: &Specimen) -> Value {
    let layer = |own: &FieldLayer| json!({"of": own.of.name(), "layer": own.layer.name(), "nodes": own.values.nodes, "se": own.errors.nodes});
    let strongest = field.strongest(specimen).map(|strongest| {
        let [warp, weft] = strongest.place.map(|t| t - 0.5);
        let own = &field.layers[strongest.layer];
        json!({
            "of": own.of.name(),
            "layer": own.layer.name(),
            "warp_mm": warp * specimen.warp_m / M_PER_MM,
            "weft_mm": weft * specimen.weft_m / M_PER_MM,
            "value": strongest.value,
            "se": strongest.error,
        })
    });
    json!({
        "of": field.name,
        "unit": field.layers[0].of.unit(),
        "is_something": field.is_something(),
        "ln_gain": field.ln_gain,
        "neighbours": field.step,
        "is_even": field.is_even,
        "layers": field.layers.iter().map(layer).collect::<Vec<_>>(),
        "strongest": strongest,
    })
}

/// The drapes held out: before, and after effects were added; lengths in mm, drape coefficients in
/// %.
fn of_holdout(fabric: &FabricResult) -> Value {
    let before: Vec<f64> = fabric.held_out_rms_m().iter().map(|m| m / M_PER_MM).collect();
    if before.is_empty() {
        return Value::Null;
    }
    let mut text = json!({"before_mm": mean(&before), "drapes": before.len()});
    if let Some(floor) = fabric.floor.iter().find(|s| s.pairing == Pairing::Captures) {
        text["floor_mm"] = json!(floor.median_m / M_PER_MM);
    }
    let pairs = fabric.pairs();
    if !pairs.is_empty() {
        let of = |value: &dyn Fn(&Pair) -> f64| pairs.iter().map(value).collect::<Vec<f64>>();
        let fall = of(&|p| (p.rms_m[0] - p.rms_m[1]) / M_PER_MM);
        text["pairs"] = json!(pairs.len());
        text["before_mm"] = json!(mean(&of(&|p| p.rms_m[0] / M_PER_MM)));
        text["after_mm"] = json!(mean(&of(&|p| p.rms_m[1] / M_PER_MM)));
        let released: Vec<[f64; 2]> = pairs.iter().filter_map(|p| p.released_rms_m).collect();
        if !released.is_empty() {
            for (which, key) in ["released_before_mm", "released_after_mm"].into_iter().enumerate()
            {
                let own: Vec<f64> = released.iter().map(|both| both[which] / M_PER_MM).collect();
                text[key] = json!(mean(&own));
            }
        }
        text["se_mm"] = json!(finite(mean_and_error(&fall)[1]));
        text["dc_before"] = json!(mean(&of(&|p| p.dc_off[0].abs())));
        text["dc_after"] = json!(mean(&of(&|p| p.dc_off[1].abs())));
    }
    text
}

fn of_measured(measured: &Measured) -> Value {
    let (entry, m) = (&measured.entry, &measured.measures);
    json!({
        "file": entry.name,
        "kind": entry.kind.name(),
        "line": entry.line,
        "specimen": entry.specimen,
        "face": entry.face.map(Face::name),
        "capture": entry.capture,
        "observation": entry.observation,
        "role": entry.role.name(),
        "drape_coefficient": m.drape_coefficient,
        "folds": m.folds,
        "amplitudes_mm": m.amplitudes_m.map(|a| a / M_PER_MM),
        "mean_radius_mm": m.mean_m / M_PER_MM,
    })
}

fn of_spread(spread: &Spread) -> Value {
    json!({
        "pairs": spread.pairs,
        "median_mm": spread.median_m / M_PER_MM,
        "q10_mm": spread.quantiles_m[0] / M_PER_MM,
        "q90_mm": spread.quantiles_m[1] / M_PER_MM,
        "turned_median_mm": spread.turned_median_m / M_PER_MM,
    })
}

fn of_fit(fitted: &Fitted) -> Value {
    let values = fitted.cloth.fabric.to_paper_units();
    let parameters: serde_json::Map<String, Value> = fitted
        .stiffnesses
        .iter()
        .enumerate()
        .map(|(k, s)| {
            // from SI to the paper's unit
            let unit = values[k] / fitted.cloth.fabric.in_si()[k];
            let value = json!({
                "value": values[k],
                "unit": TABLE_2[k].unit,
                "interval90": s.interval90.map(|v| v * unit),
                "shown": s.shown,
                "at_limit": s.at_limit,
            });
            (s.key.to_owned(), value)
        })
        .collect();
    json!({
        "parameters": parameters,
        "effects": numbers_of(fitted).iter().map(|of| json!({
            "name": of.name, "part": of.part, "value": of.value, "unit": of.unit, "interval90": of.interval90, "at_limit": of.at_limit,
        })).collect::<Vec<_>>(),
        "misfit": fitted.misfit,
        "ended": fitted.ended.name(),
        "simulated_drapes": fitted.simulated,
    })
}

/// A number of an effect, in the unit of files.
pub(super) struct Shown {
    pub(super) name: &'static str,
    part: &'static str,
    value: f64,
    unit: &'static str,
    interval90: [f64; 2],
    at_limit: bool,
}

impl Shown {
    pub(super) fn of(number: &Number, value: f64, interval90: [f64; 2]) -> Self {
        let (unit, size) = number.unit();
        let name = Effect::of(number).map_or("", |effect| effect.name);
        let interval90 = interval90.map(|end| end / size);
        Self { name, part: number.key, value: value / size, unit, interval90, at_limit: false }
    }

    pub(super) fn line(&self) -> String {
        let Self { name, part, value, unit, interval90: [low, high], at_limit } = self;
        let limit = if *at_limit { ", at the end of what is tried" } else { "" };
        format!("  {name} {part}: {value:.3} {unit} ({low:.3} to {high:.3}){limit}\n")
    }
}

/// The numbers of a fit beside its stiffnesses: declared ones and those of the effects added.
pub(super) fn numbers_of(fitted: &Fitted) -> Vec<Shown> {
    let all = fitted.cloth.effects.iter().zip(&fitted.intervals90).zip(&fitted.at_limit);
    all.map(|(((number, value), ends), at_limit)| {
        let shown = Shown::of(number, *value, *ends);
        Shown { at_limit: *at_limit, ..shown }
    })
    .collect()
}

fn of_pose(pose: &Pose) -> Value {
    let [[offset_x, offset_z], [warp, weft]] = [pose.offset_m, pose.specimen_m];
    json!({
        "offset_x_mm": offset_x / M_PER_MM,
        "offset_z_mm": offset_z / M_PER_MM,
        "rotation_deg": pose.rotation_rad.to_degrees(),
        "scale": pose.ln_scale.exp(),
        "specimen_x_mm": warp / M_PER_MM,
        "specimen_z_mm": weft / M_PER_MM,
        "pull_mm": pose.pull_m / M_PER_MM,
        "height_mm": pose.height_m / M_PER_MM,
        "lean_x_deg": pose.lean_rad[0].to_degrees(),
        "lean_z_deg": pose.lean_rad[1].to_degrees(),
        "cells": pose.cells,
    })
}

fn of_drape(fabric: &FabricResult, drape: &ComparedDrape) -> Value {
    let measured = &fabric.measured[drape.measured];
    let (file, role) = (&measured.entry.name, measured.entry.role.name());
    let comparison = match &drape.comparison {
        Ok(comparison) => comparison,
        Err(error) => return json!({"file": file, "role": role, "failed": error.to_string()}),
    };
    json!({
        "file": file,
        "role": role,
        "rms_mm": comparison.rms_m / M_PER_MM,
        "springs_share": comparison.springs_share,
        "released_rms_mm": comparison.released_rms_m.map(|m| m / M_PER_MM),
        "drape_coefficient": comparison.measures.drape_coefficient,
        "folds": comparison.measures.folds,
        "amplitudes_mm": comparison.measures.amplitudes_m.map(|a| a / M_PER_MM),
        "pose": of_pose(&comparison.pose),
        "residual_by_bearing_mm": by_bearing(comparison).map(|m| m / M_PER_MM),
    })
}

/// Sectors of the rim that residuals are given by.
const SECTORS: usize = 24;

/// Mean distance of the measured outline outside the simulated one in each of 24 sectors from the
/// warp on, towards the weft \[m\].
fn by_bearing(comparison: &Comparison) -> [f64; SECTORS] {
    let (mut sums, mut counts) = ([0.0; SECTORS], [0.0_f64; SECTORS]);
    for row in &comparison.rows {
        let turn = row.bearing_rad.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
        sums[sector] += row.outwards_m;
        counts[sector] += 1.0;
    }
    std::array::from_fn(|k| sums[k] / counts[k].max(1.0))
}

fn of_group(group: &Group) -> Value {
    json!({
        "role": group.role.name(),
        "face": group.face.map(Face::name),
        "observation": group.observation,
        "drapes": group.drapes,
        "not_at_rest": group.lost,
        "rms_mm": group.rms_m[0] / M_PER_MM,
        "rms_se_mm": finite(group.rms_m[1] / M_PER_MM),
        "springs_share": group.springs_share,
        "dc_measured": group.drape_coefficient[0],
        "dc_simulated": group.drape_coefficient[1],
        "dc_difference_se": finite(group.difference_se),
        "folds_measured": group.folds[0],
        "folds_simulated": group.folds[1],
    })
}

/// Of one drape there is no standard error.
pub(super) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

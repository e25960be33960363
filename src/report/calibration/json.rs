//! calibration.json of what was found: lengths in mm, angles in degrees, numbers of effects in the
//! units of files.

use serde::Serialize;
use serde_json::{Value, json};

use super::file::{
    After, Compared, Drape, Explanation, Fabric, FieldLayer, File, Fit, Floor, Found, Holdout,
    NotUsed, Outline, Pairs, Parameter, Residual, SCHEMA_VERSION, Strongest,
};
use super::file::{Field as FieldFile, Fitted as FittedNumber, Group as GroupFile};
use super::file::{Pose as PoseFile, Spread as SpreadFile};
use crate::base::units::M_PER_MM;
use crate::calibrate::cloth_file::{Density, EffectNumber};
use crate::calibrate::comparison::Comparison;
use crate::calibrate::explain::Cause;
use crate::calibrate::field::{Field, Strongest as StrongestAt};
use crate::calibrate::fit::Fitted;
use crate::calibrate::floor::{Pairing, Spread};
use crate::calibrate::found::FoundEffect;
use crate::calibrate::measured::Measured;
use crate::calibrate::pose::Pose;
use crate::calibrate::result::{ComparedDrape, FabricResult, Group, Pair};
use crate::calibrate::run::{Calibration, Refused};
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::numeric::moments::{mean, mean_and_error};
use crate::report::section::Section;
use crate::sim::experiment::Specimen;

/// calibration.json of the sections of its fabrics.
#[must_use]
pub fn json(sections: &[Section], refused: &[Refused]) -> Value {
    whole(sections.iter().map(|section| (section.name.clone(), &section.json)), refused)
}

/// The same of a calibration of which nothing is written.
#[must_use]
pub fn json_of(calibration: &Calibration) -> Value {
    let fabrics = calibration.fabrics.iter();
    whole(fabrics.map(|fabric| (fabric.name.clone(), of_fabric(fabric))), &calibration.refused)
}

fn whole<F: Serialize>(fabrics: impl Iterator<Item = (String, F)>, refused: &[Refused]) -> Value {
    let of = |r: &Refused| NotUsed { line: r.line, file: r.name.clone(), why: r.why.clone() };
    json!(File {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION"),
        fabrics: fabrics.collect(),
        refused: refused.iter().map(of).collect(),
    })
}

pub(super) fn of_fabric(fabric: &FabricResult) -> Fabric {
    let (fit, failed) = match &fabric.fitted {
        Ok(fitted) => (Some(of_fit(fitted)), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let found = fabric.after.iter().flat_map(|after| &after.effects);
    let explanations = fabric.explanations.as_ref().map(|all| {
        let of = |e: &crate::calibrate::explain::Explanation| Explanation {
            cause: cause_names(&e.cause),
            probability: e.probability,
        };
        all.0.iter().map(of).collect()
    });
    let specimen = fabric.measured.first().map(|measured| measured.bench.specimen);
    let fields = specimen.iter().flat_map(|s| fabric.fields.iter().map(move |f| of_field(f, s)));
    let after = fabric.after.as_ref().map(|after| After {
        fit: of_fit(&after.fitted),
        drapes: after.drapes.iter().map(|d| of_drape(fabric, d)).collect(),
        groups: fabric.groups_of(&after.drapes).iter().map(of_group).collect(),
    });
    Fabric {
        density: Density::of(fabric.fabric_prior.density_kg_m2, fabric.fabric_prior.density_known),
        outlines: fabric.measured.iter().map(of_measured).collect(),
        floor: of_floor(&fabric.floor),
        drapes: fabric.drapes.iter().map(|d| of_drape(fabric, d)).collect(),
        groups: fabric.groups().iter().map(of_group).collect(),
        fit,
        failed,
        verdict: fabric.verdict,
        effects: found.flat_map(of_effect).collect(),
        explanations,
        fields: fields.collect(),
        residual: fabric.residual_size().map(|of| Residual {
            rms_mm: of.rms_m / M_PER_MM,
            correlation_length_mm: of.correlation_length_m / M_PER_MM,
        }),
        holdout: of_holdout(fabric),
        after,
    }
}

/// One entry for each number of an effect.
fn of_effect(found: &FoundEffect) -> Vec<Found> {
    let numbers = found.numbers.iter();
    let of = numbers.map(|(number, value, ends)| Found {
        number: EffectNumber::of(number, *value, *ends),
        group: found.group.clone(),
    });
    of.collect()
}

/// A cause as files have it: the names of its effects, `nothing`, or `else`.
pub(super) fn cause_names(cause: &Cause) -> Vec<&'static str> {
    match cause {
        Cause::Nothing => vec!["nothing"],
        Cause::Effects(effects) => effects.iter().map(|effect| effect.name).collect(),
        Cause::Else => vec!["else"],
    }
}

/// A field's numbers at its nodes, along the warp and then along the weft, and where it is
/// strongest.
fn of_field(field: &Field, specimen: &Specimen) -> FieldFile {
    let layers = field.layers.iter().map(|own| FieldLayer {
        of: own.of,
        layer: own.layer,
        nodes: own.values.nodes,
        se: own.errors.nodes,
    });
    let place = |strongest: StrongestAt| {
        let [warp, weft] = strongest.place.map(|t| t - 0.5);
        let own = &field.layers[strongest.layer];
        Strongest {
            of: own.of,
            layer: own.layer,
            warp_mm: warp * specimen.warp_m / M_PER_MM,
            weft_mm: weft * specimen.weft_m / M_PER_MM,
            value: strongest.value,
            se: strongest.error,
        }
    };
    FieldFile {
        of: field.name,
        unit: field.layers[0].of.unit(),
        is_something: field.is_something(),
        ln_gain: field.ln_gain,
        neighbours: field.step,
        is_even: field.is_even,
        layers: layers.collect(),
        strongest: field.strongest(specimen).map(place),
    }
}

/// The drapes held out: before, and after effects were added; lengths in mm, drape coefficients in
/// %.
fn of_holdout(fabric: &FabricResult) -> Option<Holdout> {
    let before: Vec<f64> = fabric.held_out_rms_m().iter().map(|m| m / M_PER_MM).collect();
    if before.is_empty() {
        return None;
    }
    let floor = fabric.floor.iter().find(|s| s.pairing == Pairing::Captures);
    let pairs = fabric.pairs();
    let of = |value: &dyn Fn(&Pair) -> f64| pairs.iter().map(value).collect::<Vec<f64>>();
    let released: Vec<[f64; 2]> = pairs.iter().filter_map(|p| p.released_rms_m).collect();
    let released_mm = |which: usize| {
        let own: Vec<f64> = released.iter().map(|both| both[which] / M_PER_MM).collect();
        (!own.is_empty()).then(|| mean(&own))
    };
    let changed = (!pairs.is_empty()).then(|| Pairs {
        pairs: pairs.len(),
        after_mm: mean(&of(&|p| p.rms_m[1] / M_PER_MM)),
        released_before_mm: released_mm(0),
        released_after_mm: released_mm(1),
        se_mm: finite(mean_and_error(&of(&|p| (p.rms_m[0] - p.rms_m[1]) / M_PER_MM))[1]),
        dc_before: mean(&of(&|p| p.dc_off[0].abs())),
        dc_after: mean(&of(&|p| p.dc_off[1].abs())),
    });
    Some(Holdout {
        before_mm: match &changed {
            Some(_) => mean(&of(&|p| p.rms_m[0] / M_PER_MM)),
            None => mean(&before),
        },
        drapes: before.len(),
        floor_mm: floor.map(|floor| floor.median_m / M_PER_MM),
        pairs: changed,
    })
}

fn of_measured(measured: &Measured) -> Outline {
    let (entry, m) = (&measured.entry, &measured.measures);
    Outline {
        file: entry.name.clone(),
        kind: entry.kind,
        line: entry.line,
        specimen: entry.specimen.clone(),
        face: entry.face,
        capture: entry.capture.clone(),
        observation: entry.observation,
        role: entry.role,
        drape_coefficient: m.drape_coefficient,
        folds: m.folds,
        amplitudes_mm: m.amplitudes_m.map(|a| a / M_PER_MM),
        mean_radius_mm: m.mean_m / M_PER_MM,
    }
}

fn of_floor(spreads: &[Spread]) -> Floor {
    let mut floor = Floor::default();
    for spread in spreads {
        let place = match spread.pairing {
            Pairing::Captures => &mut floor.captures,
            Pairing::Drops => &mut floor.drops,
            Pairing::Faces => &mut floor.faces,
            Pairing::Specimens => &mut floor.specimens,
        };
        *place = Some(SpreadFile {
            pairs: spread.pairs,
            median_mm: spread.median_m / M_PER_MM,
            q10_mm: spread.quantiles_m[0] / M_PER_MM,
            q90_mm: spread.quantiles_m[1] / M_PER_MM,
            turned_median_mm: spread.turned_median_m / M_PER_MM,
        });
    }
    floor
}

fn of_fit(fitted: &Fitted) -> Fit {
    let values = fitted.cloth.fabric.to_paper_units();
    let si = fitted.cloth.fabric.in_si();
    let parameter = |k: usize| {
        let (s, unit) = (&fitted.stiffnesses[k], values[k] / si[k]);
        Parameter {
            value: values[k],
            unit: TABLE_2[k].unit,
            interval90: s.interval90.map(|v| v * unit),
            shown: s.shown,
            at_limit: s.at_limit,
        }
    };
    let parameters: [Parameter; STIFFNESSES] = std::array::from_fn(parameter);
    Fit {
        parameters: parameters.into(),
        effects: numbers_of(fitted),
        misfit: fitted.misfit,
        ended: fitted.ended,
        simulated_drapes: fitted.simulated,
    }
}

/// The line of a number in the table.
pub(super) fn line(number: &EffectNumber, at_limit: bool) -> String {
    let EffectNumber { name, part, value, unit, interval90: [low, high] } = number;
    let limit = if at_limit { ", at the end of what is tried" } else { "" };
    format!("  {name} {part}: {value:.3} {unit} ({low:.3} to {high:.3}){limit}\n")
}

/// The numbers of a fit beside its stiffnesses: declared ones and those of the effects added.
pub(super) fn numbers_of(fitted: &Fitted) -> Vec<FittedNumber> {
    let all = fitted.cloth.effects.iter().zip(&fitted.intervals90).zip(&fitted.at_limit);
    let of = all.map(|(((number, value), ends), at_limit)| FittedNumber {
        number: EffectNumber::of(number, *value, *ends),
        at_limit: *at_limit,
    });
    of.collect()
}

fn of_pose(pose: &Pose) -> PoseFile {
    let [[offset_x, offset_z], [warp, weft]] = [pose.offset_m, pose.specimen_m];
    PoseFile {
        offset_x_mm: offset_x / M_PER_MM,
        offset_z_mm: offset_z / M_PER_MM,
        rotation_deg: pose.rotation_rad.to_degrees(),
        scale: pose.ln_scale.exp(),
        specimen_x_mm: warp / M_PER_MM,
        specimen_z_mm: weft / M_PER_MM,
        pull_mm: pose.pull_m / M_PER_MM,
        height_mm: pose.height_m / M_PER_MM,
        lean_x_deg: pose.lean_rad[0].to_degrees(),
        lean_z_deg: pose.lean_rad[1].to_degrees(),
        cells: pose.cells,
    }
}

fn of_drape(fabric: &FabricResult, drape: &ComparedDrape) -> Drape {
    let entry = &fabric.measured[drape.measured].entry;
    let (failed, compared) = match &drape.comparison {
        Ok(comparison) => (None, Some(of_comparison(comparison))),
        Err(error) => (Some(error.to_string()), None),
    };
    Drape { file: entry.name.clone(), role: entry.role, failed, compared }
}

fn of_comparison(comparison: &Comparison) -> Compared {
    Compared {
        rms_mm: comparison.rms_m / M_PER_MM,
        springs_share: comparison.springs_share,
        released_rms_mm: comparison.released_rms_m.map(|m| m / M_PER_MM),
        drape_coefficient: comparison.measures.drape_coefficient,
        folds: comparison.measures.folds,
        amplitudes_mm: comparison.measures.amplitudes_m.map(|a| a / M_PER_MM),
        pose: of_pose(&comparison.pose),
        residual_by_bearing_mm: by_bearing(comparison).map(|m| m / M_PER_MM),
    }
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

fn of_group(group: &Group) -> GroupFile {
    GroupFile {
        role: group.role,
        face: group.face,
        observation: group.observation,
        drapes: group.drapes,
        not_at_rest: group.lost,
        rms_mm: finite(group.rms_m[0] / M_PER_MM),
        rms_se_mm: finite(group.rms_m[1] / M_PER_MM),
        springs_share: finite(group.springs_share),
        dc_measured: finite(group.drape_coefficient[0]),
        dc_simulated: finite(group.drape_coefficient[1]),
        dc_difference_se: finite(group.difference_se),
        folds_measured: finite(group.folds[0]),
        folds_simulated: finite(group.folds[1]),
    }
}

/// Of one drape there is no standard error.
pub(super) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

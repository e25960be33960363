//! What is shown of a calibration: calibration.json, a table, a page, and a picture of each drape.
//!
//! Each fabric by itself is a [`Section`], all of it text, which can be kept; the whole is put
//! together from sections.

use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};
use serde_json::{Value, json};

use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::calibrate::cloth_file;
use crate::calibrate::comparison::Comparison;
use crate::calibrate::effect::{Effect, Number};
use crate::calibrate::explain::{Cause, Explanation, Explanations};
use crate::calibrate::field::{Field, FieldLayer, Strongest};
use crate::calibrate::fit::Fitted;
use crate::calibrate::floor::{Pairing, Spread};
use crate::calibrate::found::FoundEffect;
use crate::calibrate::manifest::Face;
use crate::calibrate::measured::Measured;
use crate::calibrate::pose::POSE_KEYS;
use crate::calibrate::result::{ComparedDrape, FabricResult, Group, Pair, Verdict};
use crate::calibrate::run::{Calibration, Refused};
use crate::fabric::TABLE_2;
use crate::io::{self, OutputError, WriteError, output};
use crate::numeric::moments::{mean, mean_and_error};
use crate::picture::draw;
use crate::report::page;
use crate::report::page::calibration::Source;
use crate::report::section::Section;
use crate::sim::experiment::Specimen;

/// Name of the file that programs read.
pub const JSON: &str = "calibration.json";
/// Name of the page.
pub const PAGE: &str = "report.html";
/// Version of calibration.json.
pub const SCHEMA_VERSION: u32 = 3;

/// Whether `calibration.json` and the page can be written into `folder` without any of `inputs`
/// being lost.
///
/// # Errors
/// When a file would be lost, `folder` is none, or the system refuses.
pub fn check(folder: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
    output::check_folder(folder)?;
    if folder.is_dir() {
        for name in [JSON, PAGE] {
            output::check_file(&folder.join(name), inputs)?;
        }
    }
    Ok(())
}

/// A fabric's section. Writes its files into `folder`, which is there: `FABRIC.params.json` (the
/// fabric with the effects that were added), `FABRIC_lineN.png` for each simulated drape, and
/// `FABRIC_lineN_after.png` where effects were added.
///
/// # Errors
/// When the system refuses.
pub fn write(fabric: &FabricResult, folder: &Path) -> Result<Section, WriteError> {
    Ok(Section {
        name: fabric.name.clone(),
        json: of_fabric(fabric),
        table: fabric_table(fabric),
        page: page::calibration::section(fabric).into_string(),
        drapes: fabric.drapes.len(),
        fitted: fabric.fitted.is_ok(),
        files: write_files(fabric, folder)?,
    })
}

/// Writes `calibration.json` into `folder`. Returns its path.
///
/// # Errors
/// When the system refuses.
pub fn write_json(
    sections: &[Section],
    refused: &[Refused],
    folder: &Path,
) -> Result<PathBuf, WriteError> {
    let path = folder.join(JSON);
    let text = json(sections, refused);
    io::atomically(&path, |out| {
        serde_json::to_writer_pretty(&mut *out, &text)?;
        writeln!(out)
    })?;
    Ok(path)
}

fn write_files(fabric: &FabricResult, folder: &Path) -> Result<Vec<String>, WriteError> {
    let mut written = Vec::new();
    let found = fabric.after.as_ref().map(|after| &after.fitted);
    if let Some(fitted) = found.or(fabric.fitted.as_ref().ok()) {
        let name = format!("{}.params.json", plain(&fabric.name));
        let text = cloth_file::text(fitted, fabric.fabric_prior.density_known, &fabric.doubts());
        io::atomically(folder.join(&name), |out| {
            serde_json::to_writer_pretty(&mut *out, &text)?;
            writeln!(out)
        })?;
        written.push(name);
    }
    let after = fabric.after.iter().flat_map(|after| &after.drapes);
    let both = fabric.drapes.iter().map(|d| (d, "")).chain(after.map(|d| (d, "_after")));
    for (drape, which) in both {
        let Ok(comparison) = &drape.comparison else { continue };
        let measured = &fabric.measured[drape.measured];
        let name = format!("{}_line{}{which}.png", plain(&fabric.name), measured.entry.line);
        let picture = picture(measured, comparison);
        io::write_png(folder.join(&name), [picture.width(), picture.height()], picture.as_raw())?;
        written.push(name);
    }
    Ok(written)
}

/// Writes `report.html`, the page of a calibration, into `folder`, which is there. Returns its
/// path.
///
/// # Errors
/// When the system refuses.
pub fn write_page(
    sections: &[Section],
    refused: &[Refused],
    source: &Source,
    folder: &Path,
) -> Result<PathBuf, WriteError> {
    let path = folder.join(PAGE);
    let page = page::calibration::page(sections, refused, source);
    io::atomically(&path, |out| out.write_all(page.as_bytes()))?;
    Ok(path)
}

/// A name that any file system takes.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

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

fn of_fabric(fabric: &FabricResult) -> Value {
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

fn cause_names(cause: &Cause) -> Vec<&'static str> {
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
struct Shown {
    name: &'static str,
    part: &'static str,
    value: f64,
    unit: &'static str,
    interval90: [f64; 2],
    at_limit: bool,
}

impl Shown {
    fn of(number: &Number, value: f64, interval90: [f64; 2]) -> Self {
        let (unit, size) = number.unit();
        let name = Effect::of(number).map_or("", |effect| effect.name);
        let interval90 = interval90.map(|end| end / size);
        Self { name, part: number.key, value: value / size, unit, interval90, at_limit: false }
    }

    fn line(&self) -> String {
        let Self { name, part, value, unit, interval90: [low, high], at_limit } = self;
        let limit = if *at_limit { ", at the end of what is tried" } else { "" };
        format!("  {name} {part}: {value:.3} {unit} ({low:.3} to {high:.3}){limit}\n")
    }
}

/// The numbers of a fit beside its stiffnesses: declared ones and those of the effects added.
fn numbers_of(fitted: &Fitted) -> Vec<Shown> {
    let all = fitted.cloth.effects.iter().zip(&fitted.intervals90).zip(&fitted.at_limit);
    all.map(|(((number, value), ends), at_limit)| {
        let shown = Shown::of(number, *value, *ends);
        Shown { at_limit: *at_limit, ..shown }
    })
    .collect()
}

fn of_drape(fabric: &FabricResult, drape: &ComparedDrape) -> Value {
    let measured = &fabric.measured[drape.measured];
    let (file, role) = (&measured.entry.name, measured.entry.role.name());
    let comparison = match &drape.comparison {
        Ok(comparison) => comparison,
        Err(error) => return json!({"file": file, "role": role, "failed": error.to_string()}),
    };
    let pose: serde_json::Map<String, Value> = POSE_KEYS
        .iter()
        .zip(comparison.pose)
        .map(|(key, value)| match *key {
            "rotation" => ("rotation_deg".to_owned(), json!(value.to_degrees())),
            "ln_scale" => ("scale".to_owned(), json!(value.exp())),
            "lean_x" | "lean_z" => (format!("{key}_deg"), json!(value.to_degrees())),
            "cells" => ("cells".to_owned(), json!(value)),
            key => (format!("{key}_mm"), json!(value / M_PER_MM)),
        })
        .collect();
    json!({
        "file": file,
        "role": role,
        "rms_mm": comparison.rms_m / M_PER_MM,
        "springs_share": comparison.springs_share,
        "released_rms_mm": comparison.released_rms_m.map(|m| m / M_PER_MM),
        "drape_coefficient": comparison.measures.drape_coefficient,
        "folds": comparison.measures.folds,
        "amplitudes_mm": comparison.measures.amplitudes_m.map(|a| a / M_PER_MM),
        "pose": pose,
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
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The table for people: floor, parameters, groups.
#[must_use]
pub fn table(sections: &[Section]) -> String {
    sections.iter().map(|section| section.table.as_str()).collect()
}

fn fabric_table(fabric: &FabricResult) -> String {
    let density = fabric.fabric_prior.density_kg_m2 / KG_M2_PER_G_M2;
    let known = if fabric.fabric_prior.density_known {
        ""
    } else {
        " (assumed: stiffness over weight is fitted)"
    };
    let mut text = format!(
        "fabric {}: {density:.0} g/m^2{known}, measured drapes: {}\n",
        fabric.name,
        fabric.measured.len()
    );
    for spread in &fabric.floor {
        let [low, high] = spread.quantiles_m.map(|m| m / M_PER_MM);
        text += &format!(
            "  {:9} {:4} pairs: {:5.2} mm rms (10 to 90 %: {low:.2} to {high:.2}), turned {:5.2}\n",
            spread.pairing.name(),
            spread.pairs,
            spread.median_m / M_PER_MM,
            spread.turned_median_m / M_PER_MM
        );
    }
    match &fabric.fitted {
        Ok(fitted) => {
            let values = fitted.cloth.fabric.to_paper_units();
            for (k, s) in fitted.stiffnesses.iter().enumerate() {
                let unit = values[k] / fitted.cloth.fabric.in_si()[k];
                let [low, high] = s.interval90.map(|v| v * unit);
                let at_limit = if s.at_limit { ", at its limit" } else { "" };
                text += &format!(
                    "  {:13} {:9.0} {} ({low:.0} to {high:.0}), uncertainty removed {:.0} %{at_limit}\n",
                    s.key,
                    values[k],
                    TABLE_2[k].unit,
                    100.0 * s.shown
                );
            }
            numbers_of(fitted).iter().for_each(|number| text += &number.line());
            text += &format!(
                "  {} after {} drapes, misfit {:.2}\n",
                fitted.ended.name(),
                fitted.simulated,
                fitted.misfit
            );
        }
        Err(error) => text += &format!("  not fitted: {error}\n"),
    }
    text += &groups_table(&fabric.groups());
    text += &effects_table(fabric);
    text
}

fn groups_table(groups: &[Group]) -> String {
    // of one drape there is no standard error
    let error = |value: f64, before: &str, after: &str| {
        finite(value).map_or(String::new(), |value| format!("{before}{value:.2}{after}"))
    };
    let mut text = String::new();
    for group in groups {
        let face = group.face.map_or("-", Face::name);
        let looked = group.observation.map_or(String::new(), |k| format!(" observation {k}"));
        let lost =
            if group.lost > 0 { format!(", {} not at rest", group.lost) } else { String::new() };
        text += &format!(
            "  {:7} {face:4}{looked} {:2} drapes{lost}: {:.2}{} mm off, springs carry {:.1} % of the weight, drape coefficient \
             {:.1} % (simulated {:.1} %{}), folds {:.1} (simulated {:.1})\n",
            group.role.name(),
            group.drapes,
            group.rms_m[0] / M_PER_MM,
            error(group.rms_m[1] / M_PER_MM, " +- ", ""),
            100.0 * group.springs_share,
            group.drape_coefficient[0],
            group.drape_coefficient[1],
            error(group.difference_se, ", difference +- ", ""),
            group.folds[0],
            group.folds[1]
        );
    }
    text
}

/// What was added, what that gained, and what explains the drapes.
fn effects_table(fabric: &FabricResult) -> String {
    let mut text = String::new();
    if let Some(after) = &fabric.after {
        for found in &after.effects {
            for (number, value, ends) in &found.numbers {
                text += &Shown::of(number, *value, *ends).line();
            }
            if !found.group.is_empty() {
                text += &format!("    not told apart from {}\n", found.group.join(", "));
            }
        }
        for number in numbers_of(&after.fitted) {
            if fabric.fitted.iter().flat_map(numbers_of).any(|own| own.name == number.name) {
                text += &number.line();
            }
        }
        text += "  with that\n";
        text += &groups_table(&fabric.groups_of(&after.drapes));
    }
    if fabric.explanations.is_some() {
        text += "  probable explanations:\n";
    }
    for explanation in fabric.explanations.iter().flat_map(|all| &all.0) {
        if explanation.probability >= SHOWN_PROBABILITY {
            let cause = match &explanation.cause {
                Cause::Else => "something that is on no list".to_owned(),
                listed => cause_names(listed).join(" and "),
            };
            text += &format!("  {:5.1} % {cause}\n", 100.0 * explanation.probability);
        }
    }
    text += &field_lines(fabric);
    text += &format!("  verdict: {}\n", fabric.verdict.name());
    if let Some(doubt) = fabric.coarse_cells() {
        text += &format!("  doubtful: {}\n", doubt.text);
    }
    let next = fabric.next_measurement();
    if let Some(next) = next.filter(|_| fabric.verdict == Verdict::Undecided) {
        text += &format!("  next: {next}\n");
    }
    text
}

/// Least probability of an explanation that is printed.
const SHOWN_PROBABILITY: f64 = 0.01;

/// Where on the cloth what is left would come from.
fn field_lines(fabric: &FabricResult) -> String {
    let Some(measured) = fabric.measured.first() else { return String::new() };
    let specimen = &measured.bench.specimen;
    let said = |field: &Field| {
        let strongest = field.strongest(specimen).filter(|_| field.is_something())?;
        let (odds, at) = (field.ln_gain, strongest_of(field, &strongest, specimen));
        Some(format!("  a field of {} explains more: ln odds {odds:.1}; {at}\n", field.name))
    };
    fabric.fields.iter().filter_map(said).collect()
}

fn strongest_of(field: &Field, strongest: &Strongest, specimen: &Specimen) -> String {
    let own = &field.layers[strongest.layer];
    let [warp, weft] = strongest.place.map(|t| t - 0.5);
    let place = if field.is_even {
        "even over the cloth".to_owned()
    } else {
        let [warp_mm, weft_mm] =
            [warp * specimen.warp_m, weft * specimen.weft_m].map(|m| m / M_PER_MM);
        format!("{warp_mm:.0} mm along the warp and {weft_mm:.0} mm along the weft from the middle")
    };
    let (title, value, error) = (own.title(), strongest.value, strongest.error);
    format!("strongest {title}, {value:.2} +- {error:.2} {}, {place}", own.of.unit())
}

const WHITE: Rgb<u8> = Rgb([255; 3]);
const INK: Rgb<u8> = Rgb([40; 3]);
const FAINT: Rgb<u8> = Rgb([215; 3]);
const MEASURED: Rgb<u8> = Rgb([20, 20, 20]);
const SIMULATED: Rgb<u8> = Rgb([214, 70, 40]);
const WARP: Rgb<u8> = Rgb([40, 110, 200]);
/// Sides of the picture's two halves in pixels.
const SIDE: u32 = 480;
/// Pixels a metre of the plan.
const SCALE: f64 = 1400.0;
/// Distance that reaches half the height of the residual's chart \[m\].
const REACH_M: f64 = 15e-3;

/// The outlines of a drape, and how far the measured one lies outside the simulated one around the
/// rim.
#[must_use]
pub fn picture(measured: &Measured, comparison: &Comparison) -> RgbImage {
    let mut image = RgbImage::from_pixel(2 * SIDE, SIDE + 40, WHITE);
    let middle = f64::from(SIDE) / 2.0;
    let at = |[x, z]: [f64; 2]| [x, z].map(|v| (middle + v * SCALE) as f32);
    let closed = |points: &[[f64; 2]]| -> Vec<[f32; 2]> {
        points.iter().chain(points.first()).map(|&p| at(p)).collect()
    };
    let [px, pz] = [comparison.pose[0], comparison.pose[1]];
    let radius_m = measured.bench.plate.radius_m;
    let circle: Vec<[f64; 2]> = (0..180)
        .map(|k| f64::from(2 * k).to_radians())
        .map(|t| [px + radius_m * t.cos(), pz + radius_m * t.sin()])
        .collect();
    draw::polyline(&mut image, &closed(&circle), 1.0, FAINT);
    let (sin, cos) = comparison.pose[2].sin_cos();
    draw::line(&mut image, at([px, pz]), at([px + 0.04 * cos, pz + 0.04 * sin]), WARP);
    draw::polyline(&mut image, &closed(comparison.measured.points_m()), 2.0, MEASURED);
    draw::polyline(&mut image, &closed(comparison.simulated.points_m()), 1.6, SIMULATED);
    residual_chart(&mut image, comparison);
    let m = &measured.measures;
    let said = format!(
        "{} line {}: {:.2} mm rms; drape coefficient {:.1}, simulated {:.1}; folds {}, simulated {}",
        measured.entry.fabric,
        measured.entry.line,
        comparison.rms_m / M_PER_MM,
        m.drape_coefficient,
        comparison.measures.drape_coefficient,
        m.folds,
        comparison.measures.folds
    );
    draw::text(&mut image, 8, SIDE as i32 + 14, &said, INK);
    draw::text(&mut image, 8, 6, "black: measured, red: simulated, blue: warp", INK);
    image
}

/// On the right half: distance over the bearing from the warp.
fn residual_chart(image: &mut RgbImage, comparison: &Comparison) {
    let (left, width) = (SIDE as f32 + 30.0, SIDE as f32 - 60.0);
    let middle = 0.5 * SIDE as f32;
    let half = middle - 30.0;
    for step in -3..=3 {
        let y = middle - half * step as f32 / 3.0;
        draw::stroke(image, [left, y], [left + width, y], 1.0, FAINT);
        let label = format!("{}", step * 5);
        draw::text(image, left as i32 - 28, y as i32 - 8, &label, INK);
    }
    for quarter in 0..=4 {
        let x = left + width * quarter as f32 / 4.0;
        draw::stroke(image, [x, middle - half], [x, middle + half], 1.0, FAINT);
        draw::text(image, x as i32 - 12, SIDE as i32 - 24, &format!("{}", quarter * 90), INK);
    }
    let title = "measured rim outside simulated rim [mm] over bearing from warp [deg]";
    draw::text(image, left as i32, 6, title, INK);
    for row in &comparison.rows {
        let turn = row.bearing_rad.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let x = left + width * turn as f32;
        let y = middle - half * (row.outwards_m / REACH_M).clamp(-1.0, 1.0) as f32;
        draw::dot(image, [x, y], 2.0, SIMULATED);
    }
}

//! The table of a calibration for people.

use super::file::Fitted;
use super::json::{cause_names, finite, line, numbers_of};
use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::calibrate::cloth_file::EffectNumber;
use crate::calibrate::explain::Cause;
use crate::calibrate::field::{Field, Strongest};
use crate::calibrate::manifest::Face;
use crate::calibrate::result::{FabricResult, Group, Verdict};
use crate::fabric::TABLE_2;
use crate::report::section::Section;
use crate::sim::experiment::Specimen;

/// The table for people: floor, parameters, groups.
#[must_use]
pub fn table(sections: &[Section]) -> String {
    sections.iter().map(|section| section.table.as_str()).collect()
}

pub(super) fn fabric_table(fabric: &FabricResult) -> String {
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
            numbers_of(fitted).iter().for_each(|of| text += &line(&of.number, of.at_limit));
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
                text += &line(&EffectNumber::of(number, *value, *ends), false);
            }
            if !found.group.is_empty() {
                text += &format!("    not told apart from {}\n", found.group.join(", "));
            }
        }
        for of in numbers_of(&after.fitted) {
            let is_it = |own: &Fitted| own.number.name == of.number.name;
            if fabric.fitted.iter().flat_map(numbers_of).any(|own| is_it(&own)) {
                text += &line(&of.number, of.at_limit);
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

//! The page of a calibration: per fabric the verdict, parameters and effects, the drapes held out
//! before and after, what these data cannot decide; then the files that were not used.
//!
//! In: the [`Section`]s of the fabrics and where they come from. Out: one HTML file that needs no
//! script.

mod charts;
mod drapes;
mod effects;
mod field;
mod said;

use std::path::Path;

use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::number::{self, fixed, percent, significant};
use super::parameters::{self, Stiffness};
use super::provenance::{self, InputFile};
use super::shell::Shell;
use crate::base::units::{KG_M2_PER_G_M2, mm};
use crate::calibrate::fit::Fitted;
use crate::calibrate::floor::Pairing;
use crate::calibrate::manifest::Face;
use crate::calibrate::result::{FabricResult, Group};
use crate::calibrate::run::{Options, Refused};
use crate::fabric::STIFFNESSES;
use crate::io::ReadError;
use crate::report::section::Section;
use crate::sim::NUMERICS_VERSION;

/// Where a calibration comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The manifest.
    pub manifest: Vec<InputFile>,
    /// What it was made with.
    pub settings: Value,
}

impl Source {
    /// Of a manifest, with the name of the prior and the other settings that it is calibrated with.
    ///
    /// # Errors
    /// When the manifest cannot be read.
    pub fn of(manifest: &Path, prior: &str, options: &Options) -> Result<Self, ReadError> {
        let without = options.without.iter().map(|effect| effect.name).collect::<Vec<_>>();
        let settings = json!({ "prior": prior, "fit": options.fit, "without": without });
        Ok(Self { manifest: provenance::files_of(manifest)?, settings })
    }
}

/// The page, of the sections of its fabrics.
#[must_use]
pub fn page(sections: &[Section], refused: &[Refused], source: &Source) -> String {
    let name = source.manifest.first().map_or("calibration", |file| file.name.as_str());
    let title = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let drapes: usize = sections.iter().map(|section| section.drapes).sum();
    let targets: Vec<String> = sections.iter().map(|section| target_of(&section.name)).collect();
    let names: Vec<String> = sections.iter().map(|s| format!("Fabric {}", s.name)).collect();
    let mut contents: Vec<(&str, &str)> =
        targets.iter().zip(&names).map(|(target, name)| (target.as_str(), name.as_str())).collect();
    if !refused.is_empty() {
        contents.push(("refused", "Files not used"));
    }
    contents.push(("provenance", "Provenance"));
    let facts = [
        ("Program", format!("scan2params {}", env!("CARGO_PKG_VERSION"))),
        ("Simulator", format!("numerics {NUMERICS_VERSION}")),
    ];
    let all = html! {
        @for section in sections { (PreEscaped(section.page.as_str())) }
        @if !refused.is_empty() { (files_not_used(refused)) }
        section id="provenance" aria-labelledby="provenance-title" {
            h2 id="provenance-title" { "Provenance" }
            (provenance::inputs(&source.manifest))
            (provenance::facts(&facts))
            (provenance::settings("Settings of the fit", &source.settings))
        }
    };
    let subtitle = format!(
        "{}, {} simulated and compared, {} not used",
        number::counted(sections.len(), "fabric"),
        number::counted(drapes, "drape"),
        number::counted(refused.len(), "file")
    );
    Shell {
        kind: "Calibration report",
        title,
        subtitle: &subtitle,
        contents: &contents,
        scripts: &[],
    }
    .around(&all)
}

/// Where a fabric stands on the page: its name's bytes, which no other fabric has.
fn target_of(name: &str) -> String {
    let hex: String = name.bytes().map(|byte| format!("{byte:02x}")).collect();
    format!("fabric-{hex}")
}

/// The part of the page that a fabric has.
pub(in crate::report) fn section(fabric: &FabricResult) -> Markup {
    let target = target_of(&fabric.name);
    html! {
        section .fabric id=(target) aria-labelledby={ (target) "-title" } {
            h2 id={ (target) "-title" } { "Fabric " (fabric.name) }
            (said::verdict(fabric))
            (said::next(fabric))
            (fits(fabric))
            @if let Some(after) = &fabric.after { (effects::found(&after.effects)) }
            @if let Some(explanations) = &fabric.explanations { (effects::explanations(explanations)) }
            (field::maps(fabric))
            (held_out(fabric))
            (coefficients(fabric))
            (groups(fabric))
            (drapes::section(fabric))
            (floor(fabric))
            (said::undecided(fabric))
        }
    }
}

/// The stiffnesses of a fit, as the page shows them.
fn stiffnesses(fabric: &FabricResult, fitted: &Fitted) -> Vec<Stiffness> {
    let values = fitted.cloth.fabric.to_paper_units();
    let si = fitted.cloth.fabric.in_si();
    let of = |index: usize| {
        let (own, unit) = (&fitted.stiffnesses[index], values[index] / si[index]);
        Stiffness {
            index,
            value: values[index],
            interval90: own.interval90.map(|v| v * unit),
            ends: fabric.fabric_prior.ln_limits[index].map(|ln| ln.exp() * unit),
            in_range: !own.at_limit,
            shown: Some(own.shown),
            exchanged: None,
        }
    };
    (0..STIFFNESSES).map(of).collect()
}

fn fits(fabric: &FabricResult) -> Markup {
    let density = fabric.fabric_prior.density_kg_m2 / KG_M2_PER_G_M2;
    let (ends, prior) = ("the range that is tried", "the prior");
    html! {
        @match &fabric.fitted {
            Ok(fitted) => {
                h3 { "Parameters of the plain model" }
                @let plain = stiffnesses(fabric, fitted);
                (parameters::table(&plain, density, ends, prior))
                (ended(fitted))
                @if fabric.after.is_none() { (parameters::in_units(&plain, density)) }
            }
            Err(error) => p .flag { "Not fitted: " (error) }
        }
        @if let Some(after) = &fabric.after {
            h3 { "Parameters with the effects" }
            @let with = stiffnesses(fabric, &after.fitted);
            (parameters::table(&with, density, ends, prior))
            (ended(&after.fitted))
            (parameters::in_units(&with, density))
        }
        p .note { (super::number::sentence(super::shell::NOTE)) }
    }
}

fn ended(fitted: &Fitted) -> Markup {
    html! {
        p .caption {
            "The fit ended as \u{201c}" (fitted.ended.name().replace('_', " ")) "\u{201d} after " (fitted.simulated) " drapes; an independent point of an outline \
             lies " (fixed(fitted.misfit, 2)) " standard deviations off (root mean square)."
        }
    }
}

fn held_out(fabric: &FabricResult) -> Markup {
    html! {
        h3 { "Drapes held out" }
        @match charts::held_out(fabric) {
            Some(chart) => figure {
                (chart)
                figcaption {
                    "Root mean square distance of the measured outline from the simulated one. Hollow dots: plain model"
                    @if fabric.after.is_some() { "; full dots: with the effects" }
                    ". None of these drapes was used to fit anything."
                    @if fabric.floor.iter().any(|spread| spread.pairing == Pairing::Captures) {
                        " Grey band and dashed line: two captures of one drape differ by as much (10 to 90 %, median): no model comes nearer to one of them than \
                         the line over the square root of two."
                    } @else {
                        " The error of a single picture is not drawn: no drape was captured twice."
                    }
                }
            },
            None => p { "No drape was held out, or none came to rest. Mark rows of the manifest \u{201c}holdout\u{201d} to test the fit on other drapes." }
        }
    }
}

fn coefficients(fabric: &FabricResult) -> Markup {
    html! {
        @if let Some(chart) = charts::coefficients(fabric) {
            h3 { "Drape coefficient, measured against simulated" }
            figure {
                (chart)
                figcaption { "Circles: face up; squares: face down; triangles: face not known. Hollow: plain model" @if fabric.after.is_some() { "; full: with the effects" } ". On the dashed line both are equal." }
            }
        }
    }
}

fn groups(fabric: &FabricResult) -> Markup {
    let after =
        fabric.after.as_ref().map(|after| fabric.groups_of(&after.drapes)).unwrap_or_default();
    let before = fabric.groups();
    html! {
        @if !before.is_empty() {
            h3 { "By role and face" }
            div .scroll role="region" aria-label="Means by role and face" tabindex="0" {
                table {
                    thead { tr {
                        th scope="col" { "Drapes" }
                        th scope="col" { "Model" }
                        th scope="col" .number { "At rest" }
                        th scope="col" .number { "Outline, mm" }
                        th scope="col" .number { "Drape coefficient, measured / simulated" }
                        th scope="col" .number { "Folds, measured / simulated" }
                        th scope="col" .number { "Springs carry" }
                    } }
                    tbody {
                        @for group in &before { (group_row(group, "plain")) }
                        @for group in &after { (group_row(group, "effects")) }
                    }
                }
            }
            p .caption { "Outline: mean and standard error of the root mean square distance. Springs carry: mean force of the springs that tie a drape to the measured arrangement of folds, as a share of the hanging cloth\u{2019}s weight." }
        }
    }
}

fn group_row(group: &Group, model: &str) -> Markup {
    let [rms, error] = group.rms_m;
    let error =
        if error.is_finite() { format!(" \u{b1} {}", fixed(mm(error), 2)) } else { String::new() };
    html! {
        tr {
            th scope="row" {
                (said::role(group.role)) ", " (face(group.face))
                @if let Some(look) = group.observation { ", observation " (look) }
            }
            td { (model) }
            td .number { (group.drapes) " of " (group.drapes + group.lost) }
            td .number .strong { (fixed(mm(rms), 2)) (error) }
            td .number { (fixed(group.drape_coefficient[0], 1)) " / " (fixed(group.drape_coefficient[1], 1)) " %" }
            td .number { (fixed(group.folds[0], 1)) " / " (fixed(group.folds[1], 1)) }
            td .number { (percent(group.springs_share, 1)) }
        }
    }
}

/// A face in words.
fn face(face: Option<Face>) -> &'static str {
    match face {
        Some(Face::Up) => "face up",
        Some(Face::Down) => "face down",
        None => "face not known",
    }
}

fn floor(fabric: &FabricResult) -> Markup {
    html! {
        @if !fabric.floor.is_empty() {
            h3 { "How well the outlines are known" }
            div .scroll role="region" aria-label="Distances of outlines" tabindex="0" {
                table {
                    thead { tr {
                        th scope="col" { "Pairs that share" }
                        th scope="col" .number { "Pairs" }
                        th scope="col" .number { "Median distance, mm" }
                        th scope="col" .number { "10 to 90 %" }
                        th scope="col" .number { "After rotation" }
                    } }
                    tbody {
                        @for spread in &fabric.floor {
                            @let [low, high] = spread.quantiles_m.map(|m| fixed(mm(m), 2));
                            tr {
                                th scope="row" { (said::pairing(spread.pairing)) }
                                td .number { (spread.pairs) }
                                td .number .strong { (fixed(mm(spread.median_m), 2)) }
                                td .number { (low) " to " (high) }
                                td .number { (fixed(mm(spread.turned_median_m), 2)) }
                            }
                        }
                    }
                }
            }
        }
        p .caption {
            (number::counted(fabric.measured.len(), "outline"))
            @if !fabric.fabric_prior.density_known { "; the density was not given, so that " (significant(fabric.fabric_prior.density_kg_m2 / KG_M2_PER_G_M2)) " g/m\u{b2} was assumed and stiffness over weight was fitted" }
            "."
        }
    }
}

fn files_not_used(refused: &[Refused]) -> Markup {
    html! {
        section id="refused" aria-labelledby="refused-title" {
            h2 id="refused-title" { "Files not used" }
            table .plain {
                thead { tr { th scope="col" .number { "Line" } th scope="col" { "File" } th scope="col" { "Reason and remedy" } } }
                tbody {
                    @for refused in refused {
                        tr { td .number { (refused.line) } th scope="row" .path { (refused.name) } td { (refused.why) } }
                    }
                }
            }
        }
    }
}

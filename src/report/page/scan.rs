//! The page of one scan: verdict first, what to do next, parameters, overlay, error along the rim,
//! three dimensions, quality, drape coefficient, laboratory, provenance.
//!
//! In: a job's outcome and what is shown with it. Out: one HTML file that needs nothing else. The
//! same outcome gives the same bytes: no time is in it.

use maud::{Markup, html};

use super::super::simulated::{RELEASED, SimulatedDrape};
use super::number::{fixed, percent};
use super::options::Extra;
use super::parameters::{self, Stiffness};
use super::scene;
use super::shell::Shell;
use super::shown::Shown;
use super::{along, figures, lab, overlay, provenance, verdict};
use crate::base::units::{KG_M2_PER_G_M2, mm};
use crate::fabric::STIFFNESSES;
use crate::job::Outcome;

const CONTENTS: [(&str, &str); 10] = [
    ("verdict", "Verdict"),
    ("next", "What to do next"),
    ("parameters", "Parameters"),
    ("overlay", "Overlay"),
    ("along", "Error along the rim"),
    ("space", "In three dimensions"),
    ("quality", "Quality of the scan"),
    ("coefficient", "Drape coefficient"),
    ("laboratory", "Laboratory"),
    ("provenance", "Provenance"),
];

/// The page.
#[must_use]
pub fn page(outcome: &Outcome, extra: &Extra) -> String {
    let name = outcome.job.input.file_name().unwrap_or_default().to_string_lossy();
    let density = fixed(outcome.job.density_kg_m2 / KG_M2_PER_G_M2, 0);
    let specimen = if extra.lab.specimen_id.is_empty() {
        String::new()
    } else {
        format!("{}, ", extra.lab.specimen_id)
    };
    let subtitle = format!(
        "{specimen}{density} g/m\u{b2}, square of {} mm on a plate of radius {} mm",
        fixed(mm(outcome.job.scan.specimen_side_m), 0),
        fixed(mm(outcome.job.scan.plate_radius_m), 0)
    );
    let all = stiffnesses(outcome);
    let drawn = SimulatedDrape::of(outcome).is_some();
    let contents: Vec<_> =
        CONTENTS.into_iter().filter(|(target, _)| drawn || *target != "along").collect();
    let sections = html! {
        (verdict::section(&outcome.verdict))
        (figures::glance(outcome))
        (verdict::next(outcome))
        (parameters_section(outcome, &all))
        (overlay_section(outcome))
        (along_section(outcome))
        section id="space" aria-labelledby="space-title" {
            h2 id="space-title" { "In three dimensions" }
            (scene::figure(&Shown::of(outcome), extra.turning_view))
        }
        (figures::quality(outcome))
        (figures::coefficients(outcome, extra))
        (lab::section(&extra.lab))
        (provenance::section(outcome, &extra.inputs))
    };
    let scripts: &[&str] = if extra.turning_view { &[scene::VIEWER] } else { &[] };
    Shell { kind: "Drape report", title: &name, subtitle: &subtitle, contents: &contents, scripts }
        .around(&sections)
}

/// The six as the page shows them.
fn stiffnesses(outcome: &Outcome) -> Vec<Stiffness> {
    let refined = outcome.taken().map(|taken| taken.refined());
    let other =
        outcome.estimate.candidates.get(1).map(|candidate| candidate.fabric.to_paper_units());
    let parameters = outcome.estimate.parameters();
    let of = |index: usize| {
        let own = &parameters[index];
        Stiffness {
            index,
            value: own.value,
            interval90: own.interval90,
            ends: own.trained,
            in_range: own.in_range,
            shown: refined.map(|refined| refined.stiffnesses[index].shown),
            exchanged: other.map(|values| values[index]),
        }
    };
    (0..STIFFNESSES).map(of).collect()
}

fn parameters_section(outcome: &Outcome, all: &[Stiffness]) -> Markup {
    let density = outcome.job.density_kg_m2 / KG_M2_PER_G_M2;
    html! {
        section id="parameters" aria-labelledby="parameters-title" {
            h2 id="parameters-title" { "Parameters" }
            (parameters::table(all, density, "what the network was trained on", "the network"))
            (parameters::in_units(all, density))
            @if let Some(likeness) = &outcome.likeness {
                p .caption {
                    "For its weight, the fabric " b { (likeness.words()) } "."
                }
            }
            p .note { (super::number::sentence(super::shell::NOTE)) }
        }
    }
}

fn overlay_section(outcome: &Outcome) -> Markup {
    let rim = outcome.rim.boundary();
    html! {
        section id="overlay" aria-labelledby="overlay-title" {
            h2 id="overlay-title" { "Overlay, from above" }
            figure .overlay-figure {
                (overlay::drawing(outcome))
                figcaption {
                    ul .legend {
                        li { (swatch("scanned")) span { "scanned rim" } }
                        li { (swatch("bridged")) span { "bridged, not observed" } }
                        @if let Some(again) = SimulatedDrape::of(outcome) {
                            li { (swatch("simulated")) span { (again.name) } }
                            @if SimulatedDrape::second(outcome).is_some() { li { (swatch("released")) span { (RELEASED) } } }
                            @let [five, ten] = along::within(rim, &again.drape.boundary, overlay::BANDS_MM);
                            li { (swatch("band5")) span { "within 5 mm of the scan: " b { (percent(five, 1)) } " of the rim, in space" } }
                            li { (swatch("band10")) span { "within 10 mm: " b { (percent(ten, 1)) } } }
                        }
                        li { (swatch("plate")) span { "plate" } }
                        li { span .number-mark aria-hidden="true" { "1" } span { "folds of the scanned rim, numbered along it" } }
                    }
                    p {
                        "Ring: bearings as in messages about the scan, anticlockwise from its x axis. Arrows from the middle: the horizontal \
                         parts of the scan\u{2019}s own axes."
                        @if SimulatedDrape::of(outcome).is_none() { " Nothing was simulated." }
                    }
                }
            }
        }
    }
}

/// A piece of a drawing's line, for a legend.
fn swatch(class: &str) -> Markup {
    html! { svg .swatch viewBox="0 0 28 12" aria-hidden="true" { path class=(class) d="M1 6h26" {} } }
}

fn along_section(outcome: &Outcome) -> Markup {
    html! {
        @if let Some(again) = SimulatedDrape::of(outcome) {
            section id="along" aria-labelledby="along-title" {
                h2 id="along-title" { "Error along the rim" }
                figure {
                    div .scroll role="region" aria-label="Chart of the error along the rim" tabindex="0" {
                        (along::chart(outcome.rim.boundary(), &again.drape.boundary, mm(outcome.job.scan.specimen_side_m)))
                    }
                    figcaption {
                        "Mean " b { (fixed(mm(again.distances_m[0]), 2)) " mm" } ", largest " b { (fixed(mm(again.distances_m[1]), 2)) " mm" }
                        ". Grey area: twice the standard deviation of the scanned rim. Thick marks at the bottom: bridged, not observed. \
                         The components point from the scanned rim to that of the " (again.name) "."
                    }
                }
            }
        }
    }
}

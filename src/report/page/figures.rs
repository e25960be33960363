//! The figures of a scan: what is told at a glance, how good the scan is, how much of the specimen
//! is seen from above.

use maud::{Markup, html};

use super::super::simulated::{SimulatedDrape, TIED};
use super::along;
use super::coefficient;
use super::number::{count, fixed, percent};
use super::options::Extra;
use super::overlay::BANDS_MM;
use crate::base::units::mm;
use crate::intake::Rim;
use crate::job::{Outcome, Taken};
use crate::scan::{Orientation, Quality, ScannedBoundary};
use crate::sim::rim_nodes;

/// A name, a value and what is to be known with it.
type Figure = (&'static str, String, String);

/// The figures below the verdict.
pub(super) fn glance(outcome: &Outcome) -> Markup {
    let rim = outcome.rim.boundary();
    let mut all: Vec<Figure> = Vec::new();
    if let Some(shown) = SimulatedDrape::of(outcome) {
        all.push(distance(shown));
        match outcome.taken() {
            Some(taken) => all.push(misfit(taken)),
            None => {
                let [five, ten] = along::within(rim, &shown.drape.boundary, BANDS_MM);
                let more = format!("{} within 10 mm", percent(ten, 0));
                all.push(("Within 5 mm", percent(five, 0), more));
            }
        }
        all.extend(SimulatedDrape::second(outcome).map(distance));
        let folds = format!("{} / {}", rim_nodes(rim), shown.drape.nodes);
        all.push(("Folds", folds, format!("scanned / {}", shown.name)));
    } else {
        all.push(("Folds", rim_nodes(rim).to_string(), "on the scanned rim".to_owned()));
    }
    all.push((
        "Rim observed",
        percent(outcome.rim.observed_fraction(), 1),
        "of its 244 points".to_owned(),
    ));
    let way = match outcome.rim.orientation() {
        Orientation::Given => "known",
        Orientation::Ambiguous => "not known",
    };
    let more = if way == "known" { "given" } else { "values may be exchanged" };
    all.push(("Weft and warp", way.to_owned(), more.to_owned()));
    html! {
        dl .glance {
            @for (name, value, more) in &all {
                div { dt { (name) } dd { span .big { (value) } @if !more.is_empty() { small { (more) } } } }
            }
        }
        @if outcome.taken().is_some() {
            p .caption {
                "Tied drape: the fabric\u{2019}s sheet, tied to the scan by weak springs. Judge the result by it and by the misfit. \
                 Released drape: the sheet without springs, one of several stable drapes of this fabric."
            }
        }
    }
}

/// How far a simulated drape's rim lies from the scanned one.
fn distance(shown: SimulatedDrape<'_>) -> Figure {
    let [mean, largest] = shown.distances_m.map(mm);
    let name = if shown.name == TIED { "Tied drape" } else { "Released drape" };
    let more = format!("from the scanned rim; largest {} mm", fixed(largest, 1));
    (name, format!("{} mm", fixed(mean, 2)), more)
}

/// How well the fabric explains the whole sheet.
fn misfit(taken: Taken<'_>) -> Figure {
    let (refined, tied) = (taken.refined(), taken.first());
    let share = percent(tied.springs_share, 1);
    let more = format!("of scan and simulator; springs carry {share} of the weight");
    ("Misfit", format!("{} sigma", fixed(refined.misfit, 2)), more)
}

/// The section with the quality of the scan.
pub(super) fn quality(outcome: &Outcome) -> Markup {
    html! {
        section id="quality" aria-labelledby="quality-title" {
            h2 id="quality-title" { "Quality of the scan" }
            @match &outcome.rim {
                Rim::Scanned { scanned, notes } => {
                    @let left_out = notes.dropped_non_finite + notes.dropped_jumps;
                    (table(&of_scan(scanned, left_out)))
                }
                Rim::Given { .. } => p {
                    "The rim was read from a file: cloth, plate and noise are unknown. "
                    (percent(outcome.rim.observed_fraction(), 1)) " of its points are marked as observed."
                }
            }
        }
    }
}

fn table(figures: &[Figure]) -> Markup {
    html! {
        table .plain .quality {
            thead { tr { th scope="col" { "Figure" } th scope="col" .number { "Value" } th scope="col" { "What it is" } } }
            tbody {
                @for (name, value, more) in figures {
                    tr { th scope="row" { (name) } td .number { (value) } td { (more) } }
                }
            }
        }
    }
}

fn of_scan(scanned: &ScannedBoundary, left_out: usize) -> Vec<Figure> {
    let q = &scanned.quality;
    let length = |metres: f64, decimals: usize| format!("{} mm", fixed(mm(metres), decimals));
    let sides = q.side_lengths_m.map(|m| fixed(mm(m), 1)).join(", ");
    let guessed = if q.unit_guessed { "found from the scene" } else { "given" };
    let up = q.up.map(|v| fixed(v, 3)).join(", ");
    let across = |width: Option<f64>| width.map_or_else(|| "\u{2013}".into(), |m| fixed(mm(m), 1));
    let bridged = if q.longest_gap_m > 0.0 {
        let bearing = fixed(q.longest_gap_bearing_deg, 0);
        format!("longest bridged arc {} at bearing {bearing}\u{b0}", length(q.longest_gap_m, 1))
    } else {
        "nothing bridged".to_owned()
    };
    let mut all = vec![
        (
            "Points",
            count(q.points),
            format!(
                "in the file; {} of the cloth, {} left out by the reader",
                count(q.cloth_points),
                count(left_out)
            ),
        ),
        ("Unit", scanned.unit.name().to_owned(), guessed.to_owned()),
        ("Up", format!("({up})"), "in the scan\u{2019}s frame".to_owned()),
        (
            "Cloth observed",
            percent(q.seen_share, 1),
            "share of the specimen\u{2019}s area that points cover".to_owned(),
        ),
        ("Rim observed", percent(q.observed_fraction, 1), bridged),
        ("Rim\u{2019}s length", length(q.loop_length_m, 1), format!("sides {sides} mm")),
        (
            "Cloth\u{2019}s widths",
            format!("{} / {} mm", across(q.widths_m[0]), across(q.widths_m[1])),
            "from edge to edge along warp / weft".to_owned(),
        ),
    ];
    all.extend(of_bench(q));
    if let Some(mesh) = &q.mesh {
        let own = percent(mesh.own_edge_share, 0);
        all.push((
            "Mesh",
            count(mesh.triangles),
            format!(
                "triangles with edges of {}; {own} of the rim from its own edge",
                length(mesh.edge_m, 1)
            ),
        ));
    }
    all
}

/// Of plate, points and sheet.
fn of_bench(q: &Quality) -> Vec<Figure> {
    let length = |metres: f64, decimals: usize| format!("{} mm", fixed(mm(metres), decimals));
    vec![
        (
            "Plate",
            length(q.plate_radius_m, 1),
            format!(
                "radius at which the cloth leaves it; centre known to {}",
                length(q.origin_sigma_m, 2)
            ),
        ),
        (
            "Off centre",
            length(q.centre_offset_m, 1),
            "specimen\u{2019}s centre from the plate\u{2019}s axis".to_owned(),
        ),
        ("Spacing", length(q.point_spacing_m, 2), "between neighbouring points".to_owned()),
        ("Noise", length(q.noise_m, 2), "of single points, from the cloth on the plate".to_owned()),
        (
            "Sheet",
            length(q.sheet_rms_m, 2),
            "rms distance of the smoothed points from the fitted sheet".to_owned(),
        ),
        (
            "Unexplained",
            format!("{} mm\u{b2}", fixed(1e6 * q.unexplained_m2, 0)),
            "largest patch of cloth near the rim that the sheet leaves out".to_owned(),
        ),
    ]
}

/// The section with the drape coefficients.
pub(super) fn coefficients(outcome: &Outcome, extra: &Extra) -> Markup {
    let (scanned, again) = coefficient::of(outcome);
    html! {
        section id="coefficient" aria-labelledby="coefficient-title" {
            h2 id="coefficient-title" { "Drape coefficient" }
            table .plain {
                thead { tr { th scope="col" { "Of" } th scope="col" .number { "Value" } th scope="col" { "What it is" } } }
                tbody {
                    tr {
                        th scope="row" { "Square, as scanned" }
                        td .number .strong { (fixed(scanned.percent, 1)) " %" }
                        td { "square of " (fixed(mm(outcome.job.scan.specimen_side_m), 0)) " mm on a plate of radius " (fixed(mm(outcome.job.scan.plate_radius_m), 0)) " mm; " (scanned.source) }
                    }
                    @if let Some(again) = again {
                        tr {
                            th scope="row" { "Square, simulated" }
                            td .number .strong { (fixed(again.percent, 1)) " %" }
                            td { "the same of the " (again.source) " of these parameters" }
                        }
                    }
                    @if let Some(cusick) = &extra.cusick {
                        tr {
                            th scope="row" { "Standard Cusick, simulated" }
                            td .number .strong { (fixed(cusick.drape_coefficient, 1)) " %" }
                            td {
                                "disc of radius 150 mm on a plate of radius 90 mm, one simulated drop of these parameters, "
                                (cusick.folds) " folds" @if !cusick.at_rest { ", which did not come to rest" }
                            }
                        }
                    }
                }
            }
            p .caption { "(Area seen from above \u{2212} plate) / (specimen \u{2212} plate). That of the square is no Cusick drape coefficient and is not to be compared with one." }
        }
    }
}

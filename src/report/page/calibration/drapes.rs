//! Each measured drape with its simulated one: outlines from above, and the residual around the
//! rim.
//!
//! In: a fabric's drapes. Out: cards by face. Outlines are drawn as the picture shows them; the
//! residual is drawn over the bearing from the warp towards the weft, warp to the right: outside
//! the grey ring the measured outline lies outside the simulated one.

use maud::{Markup, html};

use super::said;
use crate::base::Outline;
use crate::base::units::mm;
use crate::calibrate::comparison::Comparison;
use crate::calibrate::manifest::Face;
use crate::calibrate::measured::Measured;
use crate::calibrate::result::FabricResult;
use crate::report::page::number::fixed;
use crate::report::page::svg::{c, closed};

/// Points of an outline that is drawn.
const POINTS: usize = 150;
/// Half of the view of outlines \[mm\].
const HALF_MM: f64 = 165.0;
/// Radius of the plate of the standard Cusick drape, which is what is calibrated \[mm\].
const PLATE_MM: f64 = 90.0;
/// Radius of no residual, and how far the largest one reaches, in a view of 2 x 100.
const RING: f64 = 58.0;
const REACH: f64 = 36.0;

/// All drapes by face, those held out first.
pub(super) fn section(fabric: &FabricResult) -> Markup {
    let faces = [Some(Face::Up), Some(Face::Down), None];
    let largest = largest_mm(fabric);
    html! {
        @if !fabric.drapes.is_empty() {
            h3 { "Drape by drape" }
            ul .legend .inline .caption {
                li { (swatch("measured")) "measured" }
                li { (swatch("before")) "simulated, plain model" }
                @if fabric.after.is_some() { li { (swatch("after")) "simulated, with the effects" } }
            }
            @for face in faces {
                @let own: Vec<usize> = order(fabric, face);
                @if !own.is_empty() {
                    h3 { (said_face(face)) }
                    ul .cards { @for k in own { (card(fabric, k, largest)) } }
                }
            }
            p .caption {
                "Below each pair of outlines: how far the measured one lies outside the simulated one, by the bearing from the warp (to the right) towards the weft (down). \
                 The grey ring is no difference, the outer and the inner one " (fixed(largest, 0)) " mm outside and inside, the same for all."
            }
        }
    }
}

fn said_face(face: Option<Face>) -> &'static str {
    match face {
        Some(Face::Up) => "Face up",
        Some(Face::Down) => "Face down",
        None => "Face not known",
    }
}

/// The drapes of a face: held out first, each role in the manifest's order.
fn order(fabric: &FabricResult, face: Option<Face>) -> Vec<usize> {
    let entry = |k: &usize| &fabric.measured[fabric.drapes[*k].measured].entry;
    let mut own: Vec<usize> = (0..fabric.drapes.len()).filter(|k| entry(k).face == face).collect();
    own.sort_by_key(|k| (std::cmp::Reverse(entry(k).role), entry(k).line));
    own
}

/// The largest residual of all drapes before, rounded up to 5 mm.
fn largest_mm(fabric: &FabricResult) -> f64 {
    let rows =
        fabric.drapes.iter().filter_map(|d| d.comparison.as_ref().ok()).flat_map(|b| &b.rows);
    let most = rows.map(|row| mm(row.outwards_m.abs())).fold(1.0, f64::max);
    5.0 * (most / 5.0).ceil()
}

fn swatch(class: &str) -> Markup {
    html! { svg .swatch viewBox="0 0 28 12" aria-hidden="true" { path class=(class) d="M1 6h26" {} } }
}

fn card(fabric: &FabricResult, k: usize, largest: f64) -> Markup {
    let drape = &fabric.drapes[k];
    let measured = &fabric.measured[drape.measured];
    let after =
        fabric.after.as_ref().and_then(|after| after.drapes.get(k)?.comparison.as_ref().ok());
    let name = measured.entry.name.rsplit(['/', '\\']).next().unwrap_or_default();
    let specimen = measured.entry.specimen.as_deref().unwrap_or("not known");
    html! {
        li .card {
            @match &drape.comparison {
                Ok(before) => {
                    (outlines(measured, before, after, name))
                    (residual(before, after, largest, name))
                    p {
                        b { "Specimen " (specimen) } ", " (said::role(measured.entry.role)) br;
                        "outline " (fixed(mm(before.rms_m), 2)) @if let Some(after) = after { " \u{2192} " b { (fixed(mm(after.rms_m), 2)) } } " mm" br;
                        "drape coefficient " (fixed(measured.measures.drape_coefficient, 1)) " measured, "
                        (fixed(before.measures.drape_coefficient, 1)) @if let Some(after) = after { " \u{2192} " (fixed(after.measures.drape_coefficient, 1)) } " %" br;
                        "folds " (measured.measures.folds) " measured, " (before.measures.folds) @if let Some(after) = after { " \u{2192} " (after.measures.folds) }
                    }
                    p .caption { (name) }
                }
                Err(error) => p { b { "Specimen " (specimen) } ", " (said::role(measured.entry.role)) ": no simulated drape (" (error) ")" br; span .caption { (name) } }
            }
        }
    }
}

/// The outlines on the plate, as the picture shows them.
fn outlines(
    measured: &Measured,
    before: &Comparison,
    after: Option<&Comparison>,
    name: &str,
) -> Markup {
    let drawn = |outline: &Outline| closed(outline.evenly(POINTS).into_iter().map(|p| p.map(mm)));
    let [px, pz] = before.pose.offset_m.map(mm);
    let label = format!(
        "Outlines of {name}, specimen {}",
        measured.entry.specimen.as_deref().unwrap_or("not known")
    );
    html! {
        svg .whole viewBox={ (c(-HALF_MM)) " " (c(-HALF_MM)) " " (c(2.0 * HALF_MM)) " " (c(2.0 * HALF_MM)) } role="img" aria-label=(label) {
            circle .polar-zero cx=(c(px)) cy=(c(pz)) r=(c(PLATE_MM)) {}
            path .measured d=(drawn(&before.measured)) {}
            path .before d=(drawn(&before.simulated)) {}
            @if let Some(after) = after { path .after d=(drawn(&after.simulated)) {} }
        }
    }
}

/// The residual around the rim.
fn residual(before: &Comparison, after: Option<&Comparison>, largest: f64, name: &str) -> Markup {
    let drawn = |comparison: &Comparison| {
        let mut rows: Vec<_> = comparison
            .rows
            .iter()
            .map(|row| (row.bearing_rad.rem_euclid(std::f64::consts::TAU), row.outwards_m))
            .collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        closed(rows.into_iter().map(|(bearing, out)| {
            let radius = RING + REACH * mm(out) / largest;
            [radius * bearing.cos(), radius * bearing.sin()]
        }))
    };
    html! {
        svg .whole viewBox="-100 -100 200 200" role="img" aria-label={ "Residual around the rim of " (name) } {
            circle .polar-ring cx="0" cy="0" r=(c(RING - REACH)) {}
            circle .polar-ring cx="0" cy="0" r=(c(RING + REACH)) {}
            circle .polar-zero cx="0" cy="0" r=(c(RING)) {}
            path .polar-ring d="M22 0H94M-22 0H-94M0 22V94M0 -22V-94" {}
            path .before d=(drawn(before)) {}
            @if let Some(after) = after { path .after d=(drawn(after)) {} }
        }
    }
}

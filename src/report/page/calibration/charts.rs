//! Charts of a calibrated fabric: the drapes held out before and after, drape coefficients measured
//! against simulated.

use maud::{Markup, html};

use crate::base::units::mm;
use crate::calibrate::floor::Pairing;
use crate::calibrate::manifest::{Face, Role};
use crate::calibrate::result::{ComparedDrape, FabricResult};
use crate::report::page::number::fixed;
use crate::report::page::svg::{Scale, c, closed, labelled};

/// Drapes with what they were before and are after: both where both came to rest.
fn both(fabric: &FabricResult) -> impl Iterator<Item = (&ComparedDrape, Option<&ComparedDrape>)> {
    let after = fabric.after.as_ref().map(|after| after.drapes.as_slice()).unwrap_or_default();
    fabric.drapes.iter().enumerate().map(|(k, before)| (before, after.get(k)))
}

/// The distances of the drapes held out as paired dots, worst first, with the floor; `None` without
/// such drapes.
pub(super) fn held_out(fabric: &FabricResult) -> Option<Markup> {
    let mut rows: Vec<(String, f64, Option<f64>)> = Vec::new();
    for (before, after) in both(fabric) {
        let entry = &fabric.measured[before.measured].entry;
        let Ok(own) = &before.comparison else { continue };
        if entry.role != Role::Holdout {
            continue;
        }
        let after = after.and_then(|after| after.comparison.as_ref().ok()).map(|b| mm(b.rms_m));
        let face = entry.face.map_or("", Face::name);
        let specimen = entry.specimen.as_deref().unwrap_or("\u{2013}");
        rows.push((format!("{specimen} {face}"), mm(own.rms_m), after));
    }
    if rows.is_empty() {
        return None;
    }
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    let floor = fabric.floor.iter().find(|spread| spread.pairing == Pairing::Captures);
    let most = rows
        .iter()
        .map(|r| r.1.max(r.2.unwrap_or(0.0)))
        .chain(floor.map(|f| mm(f.quantiles_m[1])))
        .fold(1.0, f64::max);
    let (left, right, foot) = (46.0, 948.0, 236.0);
    let y = Scale { values: [0.0, 1.1 * most], pixels: [foot, 24.0] };
    let x = |k: usize| left + (right - left) * (k as f64 + 0.5) / rows.len() as f64;
    let label = format!(
        "{} drapes held out, {} to {} mm off",
        rows.len(),
        fixed(rows[rows.len() - 1].1, 1),
        fixed(rows[0].1, 1)
    );
    Some(html! {
        div .scroll role="region" aria-label="Drapes held out" tabindex="0" {
            svg .chart viewBox="0 0 960 276" role="img" aria-label=(label) {
                @for (tick, label) in labelled(y.values, 6) {
                    line .grid x1=(c(left)) x2=(c(right)) y1=(c(y.at(tick))) y2=(c(y.at(tick))) {}
                    text x=(c(left - 6.0)) y=(c(y.at(tick) + 4.0)) text-anchor="end" { (label) }
                }
                @if let Some(floor) = floor {
                    @let [low, high] = floor.quantiles_m.map(|m| y.at(mm(m)));
                    rect .floor-band x=(c(left)) y=(c(high)) width=(c(right - left)) height=(c(low - high)) {}
                    line .floor-line x1=(c(left)) x2=(c(right)) y1=(c(y.at(mm(floor.median_m)))) y2=(c(y.at(mm(floor.median_m)))) {}
                }
                @for (k, (name, before, after)) in rows.iter().enumerate() {
                    @if let Some(after) = after { line .link x1=(c(x(k))) x2=(c(x(k))) y1=(c(y.at(*before))) y2=(c(y.at(*after))) {} }
                    circle .dot-before cx=(c(x(k))) cy=(c(y.at(*before))) r="4.6" {}
                    @if let Some(after) = after { circle .dot-after cx=(c(x(k))) cy=(c(y.at(*after))) r="4.2" {} }
                    text x=(c(x(k))) y=(c(foot + 16.0)) text-anchor="middle" { (name) }
                }
                text .title x=(c(left)) y="14" { "Distance of the outlines, root mean square [mm]" }
                text .title x=(c(right)) y=(c(foot + 36.0)) text-anchor="end" { "specimen and face" }
            }
        }
    })
}

/// Drape coefficients, measured to the right and simulated upwards; `None` without a drape at rest.
pub(super) fn coefficients(fabric: &FabricResult) -> Option<Markup> {
    let mut points: Vec<(Option<Face>, f64, f64, &'static str)> = Vec::new();
    for (before, after) in both(fabric) {
        let measured = &fabric.measured[before.measured];
        let own = measured.measures.drape_coefficient;
        let mut add = |drape: &ComparedDrape, class| {
            if let Ok(comparison) = &drape.comparison {
                points.push((
                    measured.entry.face,
                    own,
                    comparison.measures.drape_coefficient,
                    class,
                ));
            }
        };
        add(before, "dot-before");
        if let Some(after) = after {
            add(after, "dot-after");
        }
    }
    let values = || points.iter().flat_map(|p| [p.1, p.2]);
    let (low, high) =
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    if points.is_empty() {
        return None;
    }
    let margin = (0.08 * (high - low)).max(0.5);
    let x = Scale { values: [low - margin, high + margin], pixels: [52.0, 412.0] };
    let y = Scale { pixels: [372.0, 12.0], ..x };
    let ends = x.values.map(|v| [x.at(v), y.at(v)]);
    let label = format!(
        "Drape coefficients from {} to {} %, measured against simulated",
        fixed(low, 0),
        fixed(high, 0)
    );
    Some(html! {
        svg .plot .square viewBox="0 0 424 420" role="img" aria-label=(label) {
            @for (tick, label) in labelled(x.values, 6) {
                line .grid x1=(c(x.at(tick))) x2=(c(x.at(tick))) y1="12" y2="372" {}
                line .grid y1=(c(y.at(tick))) y2=(c(y.at(tick))) x1="52" x2="412" {}
                text x=(c(x.at(tick))) y="388" text-anchor="middle" { (label) }
                text x="46" y=(c(y.at(tick) + 4.0)) text-anchor="end" { (label) }
            }
            line .identity x1=(c(ends[0][0])) y1=(c(ends[0][1])) x2=(c(ends[1][0])) y2=(c(ends[1][1])) {}
            @for (face, measured, simulated, class) in &points { (mark(*face, [x.at(*measured), y.at(*simulated)], class)) }
            text .title x="412" y="410" text-anchor="end" { "measured [%]" }
            text .title x="56" y="24" { "simulated [%]" }
        }
    })
}

/// A circle, square or triangle by face.
fn mark(face: Option<Face>, [x, y]: [f64; 2], class: &str) -> Markup {
    html! {
        @match face {
            Some(Face::Up) => circle class=(class) cx=(c(x)) cy=(c(y)) r="4.4" {},
            Some(Face::Down) => rect class=(class) x=(c(x - 4.0)) y=(c(y - 4.0)) width="8" height="8" {},
            None => path class=(class) d=(closed([[x, y - 5.0], [x + 4.8, y + 3.6], [x - 4.8, y + 3.6]])) {},
        }
    }
}

//! The scanned rim on those of the simulated drapes, from above: bands, plate, folds, bearings, the
//! scan's own axes.
//!
//! In: a job's outcome. Out: SVG, warp (x) to the right, weft (z) down, as large as the drape
//! allows. The bands are what lies within 5 and 10 mm of the scanned rim in this view; the shares
//! beside the drawing count distances in space. Bearings are those of every message about the scan:
//! degrees counter-clockwise from the scan's x axis laid horizontal; of a rim from a file, from the
//! warp.

use maud::{Markup, html};

use super::super::simulated::SimulatedDrape;
use super::svg::{c, closed, path, runs};
use crate::base::boundary::{POINTS_PER_SIDE, SIDES};
use crate::base::units::mm;
use crate::base::{Boundary, Vector3};
use crate::job::Outcome;
use crate::sim::rim_nodes_at;

/// Half of the view, radius of the ring of bearings, and room between it and the drape, in the
/// drawing's units.
const HALF: f64 = 215.0;
const RING: f64 = 192.0;
const ROOM: f64 = 30.0;
/// The paper's bands \[mm\].
pub(super) const BANDS_MM: [f64; 2] = [5.0, 10.0];

/// From above, so many units a millimetre.
fn plan(rim: &Boundary, scale: f64) -> Vec<[f64; 2]> {
    rim.positions_m().map(|p| [scale * mm(p.x), scale * mm(p.z)]).collect()
}

/// The scale with which all of some rims lies within the ring.
fn scale_of<'a>(rims: impl Iterator<Item = &'a Boundary>) -> f64 {
    let reach = rims.flat_map(Boundary::positions_m).map(|p| mm(p.x.hypot(p.z)));
    (RING - ROOM) / reach.fold(60.0, f64::max)
}

/// The drawing.
pub(super) fn drawing(outcome: &Outcome) -> Markup {
    let rim = outcome.rim.boundary();
    let again = SimulatedDrape::of(outcome).map(|shown| &shown.drape.boundary);
    let second = SimulatedDrape::second(outcome).map(|shown| &shown.drape.boundary);
    let scale = scale_of([rim].into_iter().chain(again).chain(second));
    let scanned = plan(rim, scale);
    let folds = rim_nodes_at(rim);
    let seen = |k: usize| rim.points()[k].observed;
    let outline = closed(scanned.iter().copied());
    let label = format!(
        "From above: the scanned rim with {} folds{}, the plate, bearings and axes",
        folds.len(),
        if again.is_some() {
            " on the rim of the simulated drape, with bands of 5 and 10 mm"
        } else {
            ""
        }
    );
    html! {
        svg .overlay viewBox={ (c(-HALF)) " " (c(-HALF)) " " (c(2.0 * HALF)) " " (c(2.0 * HALF)) } role="img" aria-label=(label) {
            (grid(scale))
            @if again.is_some() {
                path .band10 d=(outline) stroke-width=(c(2.0 * scale * BANDS_MM[1])) {}
                path .band5 d=(outline) stroke-width=(c(2.0 * scale * BANDS_MM[0])) {}
            }
            circle .plate cx="0" cy="0" r=(c(scale * mm(outcome.job.scan.plate_radius_m))) {}
            (bearings(outcome))
            (axes(outcome))
            path .scanned d=(runs(&scanned, true, seen)) {}
            path .bridged d=(runs(&scanned, true, |k| !seen(k) || !seen((k + 1) % scanned.len()) || !seen((k + scanned.len() - 1) % scanned.len()))) {}
            @if let Some(second) = second { path .released d=(closed(plan(second, scale))) {} }
            @if let Some(again) = again { path .simulated d=(closed(plan(again, scale))) {} }
            (corners(&scanned))
            (numbered(&scanned, &folds))
            (scale_bar(scale))
        }
    }
}

fn grid(scale: f64) -> Markup {
    let (step, end) = (50.0 * scale, 0.8 * RING);
    let most = (end / step).floor() as i32;
    html! {
        g .grid aria-hidden="true" {
            @for k in -most..=most {
                @let at = c(f64::from(k) * step);
                line x1=(at) x2=(at) y1=(c(-end)) y2=(c(end)) {}
                line y1=(at) y2=(at) x1=(c(-end)) x2=(c(end)) {}
            }
        }
    }
}

/// A bar of 50 mm in the lower left corner.
fn scale_bar(scale: f64) -> Markup {
    html! {
        g .scale {
            path d={ "M-210 206v4h" (c(50.0 * scale)) "v-4" } {}
            text x=(c(25.0 * scale - 210.0)) y="203" text-anchor="middle" { "50 mm" }
        }
    }
}

/// Where a bearing of the scan points in the drawing: unit vector, x right, y down.
fn toward(outcome: &Outcome, bearing_deg: f64) -> [f64; 2] {
    let (sin, cos) = bearing_deg.to_radians().sin_cos();
    let local = Vector3::new(cos, 0.0, -sin);
    let sim = outcome.rim.scanned().and_then(|scanned| {
        let local_from_scan = scanned.found.local_from_scan?;
        Some(scanned.sim_from_scan * (local_from_scan.inverse() * local))
    });
    let sim = sim.unwrap_or(local);
    let norm = sim.x.hypot(sim.z).max(f64::MIN_POSITIVE);
    [sim.x / norm, sim.z / norm]
}

fn bearings(outcome: &Outcome) -> Markup {
    html! {
        g .bearings {
            circle cx="0" cy="0" r=(c(RING)) {}
            @for degrees in (0..360).step_by(10) {
                @let [x, y] = toward(outcome, f64::from(degrees));
                @let inner = RING - if degrees % 30 == 0 { 5.0 } else { 2.5 };
                line x1=(c(inner * x)) y1=(c(inner * y)) x2=(c(RING * x)) y2=(c(RING * y)) {}
                @if degrees % 30 == 0 {
                    text x=(c((RING + 11.0) * x)) y=(c((RING + 11.0) * y + 3.0)) text-anchor="middle" { (degrees) "\u{b0}" }
                }
            }
        }
    }
}

/// Shortest horizontal part of an axis that is drawn as an arrow.
const LYING: f64 = 0.25;

/// The warp, and the scan's own axes as they lie in this view: arrows as long as their horizontal
/// part.
fn axes(outcome: &Outcome) -> Markup {
    let own: Vec<(&str, Vector3)> = outcome.rim.scanned().map_or_else(Vec::new, |scanned| {
        let of = |axis: Vector3| scanned.sim_from_scan * axis;
        vec![("x", of(Vector3::x())), ("y", of(Vector3::y())), ("z", of(Vector3::z()))]
    });
    html! {
        g .own-axes {
            @for (name, axis) in &own {
                @let flat = axis.x.hypot(axis.z);
                @if flat > LYING {
                    (arrow([0.0; 2], [36.0 * axis.x, 36.0 * axis.z], name))
                }
            }
            @let upright: Vec<String> = own.iter().filter(|(_, axis)| axis.x.hypot(axis.z) <= LYING)
                .map(|(name, axis)| format!("{name} {}", if axis.y > 0.0 { "up" } else { "down" })).collect();
            @if !upright.is_empty() { text x="0" y="-42" text-anchor="middle" { "scan\u{2019}s " (upright.join(", ")) } }
        }
        g .material {
            (arrow([-205.0, -205.0], [-175.0, -205.0], "warp"))
            (arrow([-205.0, -205.0], [-205.0, -175.0], "weft"))
        }
    }
}

/// An arrow with a name beyond its tip.
fn arrow([x0, y0]: [f64; 2], [x1, y1]: [f64; 2], name: &str) -> Markup {
    let length = (x1 - x0).hypot(y1 - y0).max(f64::MIN_POSITIVE);
    let [u, v] = [(x1 - x0) / length, (y1 - y0) / length];
    let barb = |side: f64| [x1 - 4.5 * u + side * 2.2 * v, y1 - 4.5 * v - side * 2.2 * u];
    let reach = if name.len() > 1 { 13.0 } else { 7.0 };
    html! {
        path d=(path([[x0, y0], [x1, y1]]) + &path([barb(1.0), [x1, y1], barb(-1.0)])) {}
        text x=(c(x1 + reach * u)) y=(c(y1 + reach * v + 3.0)) text-anchor="middle" { (name) }
    }
}

/// The corners, where the sides end, and the number of each side beside its middle.
fn corners(rim: &[[f64; 2]]) -> Markup {
    html! {
        g .corners {
            @for side in 0..SIDES {
                @let [x, y] = rim[side * POINTS_PER_SIDE + POINTS_PER_SIDE - 1];
                circle cx=(c(x)) cy=(c(y)) r="2.6" {}
            }
        }
    }
}

/// The folds, numbered along the rim.
fn numbered(rim: &[[f64; 2]], folds: &[usize]) -> Markup {
    html! {
        g .folds {
            @for (k, &at) in folds.iter().enumerate() {
                @let [x, y] = rim[at];
                @let far = x.hypot(y).max(1.0);
                @let [u, v] = [x * (1.0 + 15.0 / far), y * (1.0 + 15.0 / far)];
                circle cx=(c(u)) cy=(c(v)) r="6.2" {}
                text x=(c(u)) y=(c(v + 2.9)) text-anchor="middle" { (k + 1) }
            }
        }
    }
}

/// A drawing of both rims that stands alone, for a list of many: its colours are its own, in light
/// and dark.
#[must_use]
pub fn thumbnail(outcome: &Outcome) -> String {
    let again = SimulatedDrape::of(outcome).map(|shown| &shown.drape.boundary);
    let rim = outcome.rim.boundary();
    let scale = scale_of([rim].into_iter().chain(again));
    let style = "path,circle{fill:none;stroke-width:2.4;stroke-linejoin:round}.p{stroke:#8d98a3;stroke-width:1.6}\
                 .a{stroke:#b02a1e}.b{stroke:#1f5fb0;stroke-dasharray:7 4}\
                 @media(prefers-color-scheme:dark){.a{stroke:#ff8a75}.b{stroke:#7db4ff}}";
    let drawing = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox="-175 -175 350 350" {
            style { (maud::PreEscaped(style)) }
            circle class="p" cx="0" cy="0" r=(c(scale * mm(outcome.job.scan.plate_radius_m))) {}
            path class="a" d=(closed(plan(rim, scale))) {}
            @if let Some(again) = again { path class="b" d=(closed(plan(again, scale))) {} }
        }
    };
    drawing.into_string()
}

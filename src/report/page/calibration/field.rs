//! The fields that would explain what the effects leave, as maps of the specimen.

use maud::{Markup, html};

use crate::base::units::mm;
use crate::calibrate::field::{Field, FieldLayer, is_on};
use crate::calibrate::result::FabricResult;
use crate::report::page::number::fixed;
use crate::report::page::svg::c;
use crate::sim::Experiment;

/// Squares along a side of a map, and the side \[CSS pixels\].
const SQUARES: usize = 42;
const SIDE: f64 = 210.0;
/// Distance of the maps' left ends \[CSS pixels\].
const PITCH: f64 = 240.0;

/// What each field explains, and the maps of the most probable one; nothing where none was looked
/// for.
pub(super) fn maps(fabric: &FabricResult) -> Markup {
    let fields = fabric.fields.iter();
    let bench = fabric.measured.first().map(|measured| measured.bench);
    let drawn = fields.clone().find(|field| field.is_something());
    html! {
        @if let Some(bench) = bench.filter(|_| fields.clone().next().is_some()) {
            h3 { "Fields that would explain the residual" }
            @for field in fields { (said(field, &bench)) }
            @if let Some(field) = drawn { (figure(field, &bench)) }
        }
    }
}

fn said(field: &Field, bench: &Experiment) -> Markup {
    let strongest = field.strongest(&bench.specimen).filter(|_| field.is_something());
    html! {
        @if let Some(strongest) = strongest {
            @let [warp, weft] = strongest.place.map(|t| t - 0.5);
            @let own = &field.layers[strongest.layer];
            p {
                "With a field of " (name(field)) " the drapes are " (odds(field.ln_gain)) " as probable. It is strongest "
                @if field.layers.len() > 1 { (own.title()) ", " }
                (fixed(strongest.value, 2)) " \u{b1} " (fixed(strongest.error, 2)) " " (own.of.unit()) ", "
                @if field.is_even { "and even over the cloth." } @else {
                    "at " (fixed(mm(warp * bench.specimen.warp_m), 0)) " mm along the warp and " (fixed(mm(weft * bench.specimen.weft_m), 0))
                    " mm along the weft from the middle."
                }
            }
        } @else {
            p { "No field of " (name(field)) " is needed: with one the drapes are " (odds(field.ln_gain)) " as probable." }
        }
    }
}

/// How many times as probable, in words.
fn odds(ln: f64) -> String {
    match ln {
        7.0.. => "more than 1000 times".to_owned(),
        1.0.. => format!("{} times", fixed(ln.exp(), 0)),
        _ => "no more than 3 times".to_owned(),
    }
}

/// What a field is of, in words.
fn name(field: &Field) -> &'static str {
    if field.name == "curvature" { "natural curvature" } else { field.name }
}

fn figure(field: &Field, bench: &Experiment) -> Markup {
    let strongest = field.strongest(&bench.specimen);
    let most = strongest.map_or(0.0, |s| field.layers[s.layer].sure_at(s.place).abs()).max(1e-9);
    let unit = field.layers[0].of.unit();
    let label =
        format!("Maps of {} on the specimen, at most {} {unit}", name(field), fixed(most, 2));
    let wide = 15.0 + PITCH * field.layers.len() as f64;
    html! {
        figure {
            div .scroll role="region" aria-label={ "Field of " (name(field)) } tabindex="0" {
                svg .chart .field viewBox={ "0 0 " (c(wide)) " 262" } role="img" aria-label=(label) {
                    @for (n, layer) in field.layers.iter().enumerate() {
                        @let left = 15.0 + PITCH * n as f64;
                        text .title x=(c(left + 0.5 * SIDE)) y="14" text-anchor="middle" { (layer.title()) }
                        (map(layer, bench, left, most))
                        @if let Some(strongest) = strongest.filter(|s| !field.is_even && s.layer == n) {
                            @let [x, y] = at(strongest.place, left);
                            circle .ring cx=(c(x)) cy=(c(y)) r="9" {}
                        }
                    }
                }
            }
            figcaption {
                @if field.layers.len() > 1 { "Blue: the cloth would curl upwards, red: downwards" } @else { "Blue: more, red: less" }
                ", the value less two standard errors, at full colour " (fixed(most, 2)) " " (unit) "; ring: where it is strongest. Warp to the right, weft up, a specimen with its \
                 face up; circle: the plate. "
                @if field.layers.len() > 1 { "Left two: what turns over with the specimen; right two: what bends it upwards whichever face is up. " }
                "Anything that moves the rim like such a field is drawn as one: the map shows where, not what."
            }
        }
    }
}

/// Where a place of the specimen lies in a map.
fn at([warp, weft]: [f64; 2], left: f64) -> [f64; 2] {
    [left + SIDE * warp, 24.0 + SIDE * (1.0 - weft)]
}

fn map(layer: &FieldLayer, bench: &Experiment, left: f64, most: f64) -> Markup {
    let side = SIDE / SQUARES as f64;
    let centre = |k: usize| (k as f64 + 0.5) / SQUARES as f64;
    let squares = (0..SQUARES).flat_map(|i| (0..SQUARES).map(move |j| [centre(i), centre(j)]));
    let squares = squares.filter(|place| is_on(&bench.specimen, *place));
    let plate = SIDE * bench.plate.radius_m / bench.specimen.warp_m;
    let [x, y] = at([0.5, 0.5], left);
    html! {
        @for place in squares {
            @let value = layer.sure_at(place);
            @let [x, y] = at(place, left);
            rect class=(if value > 0.0 { "square up" } else { "square down" }) fill-opacity=(fixed((value / most).abs().min(1.0), 2))
                x=(c(x - 0.5 * side)) y=(c(y - 0.5 * side)) width=(c(side)) height=(c(side)) {}
        }
        circle .plate cx=(c(x)) cy=(c(y)) r=(c(plate)) {}
    }
}

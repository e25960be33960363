//! The field of natural curvature that would explain what the effects leave, as four maps of the specimen.

use maud::{Markup, html};

use crate::base::units::mm;
use crate::calibrate::effect::FIELD_COMPONENTS;
use crate::calibrate::field::{Field, Layer, is_on};
use crate::calibrate::run::FabricResult;
use crate::report::page::number::fixed;
use crate::report::page::svg::c;
use crate::sim::Experiment;

/// Squares along a side of a map, and the side \[CSS pixels\].
const SQUARES: usize = 42;
const SIDE: f64 = 210.0;
/// Distance of the maps' left ends \[CSS pixels\].
const PITCH: f64 = 240.0;

/// The maps; nothing where no field was looked for.
pub(super) fn maps(fabric: &FabricResult) -> Markup {
    let field = fabric.trace.as_ref().and_then(|trace| trace.field.as_ref());
    let bench = fabric.measured.first().map(|measured| measured.bench);
    html! {
        @if let (Some(field), Some(bench)) = (field, bench) {
            h3 { "Where on the cloth the rest would come from" }
            (said(field, &bench))
            @if field.is_something() { (figure(field, &bench)) }
        }
    }
}

fn said(field: &Field, bench: &Experiment) -> Markup {
    let [gain, error] = field.gain;
    let strongest = field.strongest(&bench.specimen).filter(|_| field.is_something());
    html! {
        @if let Some(strongest) = strongest {
            @let [warp, weft] = strongest.place.map(|t| t - 0.5);
            p {
                "A field of natural curvature foretells what is left (fall " (fixed(gain, 2)) " \u{b1} " (fixed(error, 2)) "). It is strongest along the "
                (FIELD_COMPONENTS[strongest.component].name()) ", "
                (fixed(strongest.per_m, 1)) " \u{b1} " (fixed(strongest.error_per_m, 1)) " /m, "
                @if field.is_even() { "and even over the cloth." } @else {
                    "at " (fixed(mm(warp * bench.specimen.warp_m), 0)) " mm along the warp and " (fixed(mm(weft * bench.specimen.weft_m), 0))
                    " mm along the weft from the middle."
                }
            }
        } @else {
            p { "No field of natural curvature foretells what is left (fall " (fixed(gain, 2)) " \u{b1} " (fixed(error, 2)) ")." }
        }
    }
}

fn figure(field: &Field, bench: &Experiment) -> Markup {
    let strongest = field.strongest(&bench.specimen);
    let most =
        strongest.map_or(0.0, |s| field.sure_at(s.layer, s.component, s.place).abs()).max(1e-9);
    let label =
        format!("Four maps of curvature on the specimen, at most {} per metre", fixed(most, 1));
    let panels = Layer::ALL
        .into_iter()
        .flat_map(|layer| (0..FIELD_COMPONENTS.len()).map(move |k| (layer, k)));
    html! {
        figure {
            div .scroll role="region" aria-label="Field of curvature" tabindex="0" {
                svg .chart .field viewBox="0 0 960 262" role="img" aria-label=(label) {
                    @for (n, (layer, component)) in panels.enumerate() {
                        @let left = 15.0 + PITCH * n as f64;
                        text .title x=(c(left + 0.5 * SIDE)) y="14" text-anchor="middle" {
                            (match layer { Layer::Turns => "turns over", Layer::Stays => "stays up" }) ", along the " (FIELD_COMPONENTS[component].name())
                        }
                        (map(field, bench, (layer, component), left, most))
                        @if let Some(strongest) = strongest.filter(|s| !field.is_even() && (s.layer, s.component) == (layer, component)) {
                            @let [x, y] = at(strongest.place, left);
                            circle .ring cx=(c(x)) cy=(c(y)) r="9" {}
                        }
                    }
                }
            }
            figcaption {
                "Blue: the cloth would curl upwards, red: downwards, what is left of it less two standard errors, at full colour " (fixed(most, 1)) " /m; ring: where it is strongest. Warp to the right, weft up, a specimen with its \
                 face up; circle: the plate. Left two: what turns over with the specimen; right two: what bends it upwards whichever face is up. Whatever moves the rim as a curvature there would \
                 is drawn as one: this shows where, not what."
            }
        }
    }
}

/// Where a place of the specimen lies in a map.
fn at([warp, weft]: [f64; 2], left: f64) -> [f64; 2] {
    [left + SIDE * warp, 24.0 + SIDE * (1.0 - weft)]
}

fn map(
    field: &Field,
    bench: &Experiment,
    (layer, component): (Layer, usize),
    left: f64,
    most: f64,
) -> Markup {
    let side = SIDE / SQUARES as f64;
    let centre = |k: usize| (k as f64 + 0.5) / SQUARES as f64;
    let squares = (0..SQUARES).flat_map(|i| (0..SQUARES).map(move |j| [centre(i), centre(j)]));
    let squares = squares.filter(|place| is_on(&bench.specimen, *place));
    let plate = SIDE * bench.plate.radius_m / bench.specimen.warp_m;
    let [x, y] = at([0.5, 0.5], left);
    html! {
        @for place in squares {
            @let value = field.sure_at(layer, component, place);
            @let [x, y] = at(place, left);
            rect class=(if value > 0.0 { "square up" } else { "square down" }) fill-opacity=(fixed((value / most).abs().min(1.0), 2))
                x=(c(x - 0.5 * side)) y=(c(y - 0.5 * side)) width=(c(side)) height=(c(side)) {}
        }
        circle .plate cx=(c(x)) cy=(c(y)) r=(c(plate)) {}
    }
}

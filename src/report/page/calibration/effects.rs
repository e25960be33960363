//! The effects of a calibration: those added, with values and intervals, and the ranking of all that were looked for.

use maud::{Markup, html};

use super::said::effect;
use crate::calibrate::add::FoundEffect;
use crate::calibrate::trace::Trace;
use crate::report::page::number::{fixed, significant};
use crate::report::page::svg::{Scale, c, ticks};

/// The effects that were added.
pub(super) fn found(effects: &[FoundEffect]) -> Markup {
    html! {
        h3 { "Effects" }
        div .scroll role="region" aria-label="Effects" tabindex="0" {
            table {
                thead { tr {
                    th scope="col" { "Effect" }
                    th scope="col" .number { "Value" }
                    th scope="col" .number { "90 % interval" }
                    th scope="col" { "Unit" }
                    th scope="col" { "Against none" }
                    th scope="col" { "Not told apart from" }
                } }
                tbody {
                    @for found in effects {
                        @for (k, (number, value, ends)) in found.numbers.iter().enumerate() {
                            @let (unit, size) = number.unit;
                            @let [low, high] = ends.map(|end| end / size);
                            tr {
                                th scope="row" { (effect(found.effect.name)) ", " (effect(number.key)) }
                                td .number .strong { (significant(value / size)) }
                                td .number { (significant(low)) " to " (significant(high)) }
                                td .unit { (unit) }
                                td { (bar(value / size, [low, high], number.limits.map(|end| end / size))) }
                                td { @if k == 0 { @if found.group.is_empty() { "\u{2013}" } @else { (found.group.iter().map(|name| effect(name)).collect::<Vec<_>>().join(", ")) } } }
                            }
                        }
                    }
                }
            }
        }
        p .caption { "Bar: 90 % interval between the least and the largest value that is tried; the upright line is no effect." }
    }
}

fn bar(value: f64, [low, high]: [f64; 2], limits: [f64; 2]) -> Markup {
    let x = Scale { values: [limits[0].min(0.0), limits[1].max(0.0)], pixels: [8.0, 252.0] };
    let at = |v: f64| x.at(v.clamp(x.values[0], x.values[1]));
    let label =
        format!("{} between {} and {}", significant(value), significant(low), significant(high));
    html! {
        svg .bar viewBox="0 0 260 22" role="img" aria-label=(label) {
            line .axis x1="8" x2="252" y1="11" y2="11" {}
            line .tick x1=(c(at(0.0))) x2=(c(at(0.0))) y1="2" y2="20" {}
            rect .interval x=(c(at(low))) y="7.5" width=(c((at(high) - at(low)).max(2.0))) height="7" rx="3.5" {}
            circle .value cx=(c(at(value))) cy="11" r="4.5" {}
        }
    }
}

/// How well each effect alone foretells a specimen from the others.
pub(super) fn ranking(trace: &Trace, added: &[FoundEffect]) -> Markup {
    const ROW: f64 = 22.0;
    let ends = trace.alone.iter().flat_map(|r| [r.gain[0] - r.gain[1], r.gain[0] + r.gain[1]]);
    let [low, high] =
        ends.fold(
            [0.0_f64, 0.02],
            |[a, b], v| if v.is_finite() { [a.min(v), b.max(v)] } else { [a, b] },
        );
    // what makes matters much worse need not be drawn to scale
    let low = low.max(-1.5 * high).min(-0.1 * high);
    let x = Scale { values: [low, 1.08 * high], pixels: [150.0, 500.0] };
    let foot = 10.0 + ROW * trace.alone.len() as f64;
    let note = |name: &str| {
        if added.iter().any(|found| found.effect.name == name) {
            ", added"
        } else if trace.chosen.iter().any(|choice| choice.ranked.effect.name == name) {
            ", chosen"
        } else {
            ""
        }
    };
    html! {
        h3 { "What the residual asks for" }
        figure {
            svg .plot viewBox={ "0 0 560 " (c(foot + 40.0)) } role="img" aria-label="How much each effect alone lowers the cost of specimens that it was not fitted to" {
                @for tick in ticks(x.values, 5) {
                    line .grid x1=(c(x.at(tick))) x2=(c(x.at(tick))) y1="4" y2=(c(foot)) {}
                    text x=(c(x.at(tick))) y=(c(foot + 14.0)) text-anchor="middle" { (fixed(tick, 2)) }
                }
                line .zero .identity x1=(c(x.at(0.0))) x2=(c(x.at(0.0))) y1="4" y2=(c(foot)) {}
                @for (k, ranked) in trace.alone.iter().enumerate() {
                    @let y = 16.0 + ROW * k as f64;
                    @let [gain, error] = ranked.gain;
                    @let at = |v: f64| x.at(v.clamp(low, x.values[1]));
                    text x="140" y=(c(y + 4.0)) text-anchor="end" { (effect(ranked.effect.name)) (note(ranked.effect.name)) }
                    line .whisker x1=(c(at(gain - error))) x2=(c(at(gain + error))) y1=(c(y)) y2=(c(y)) {}
                    circle .point cx=(c(at(gain))) cy=(c(y)) r="4" {}
                    text x="556" y=(c(y + 4.0)) text-anchor="end" { (fixed(ranked.sure, 1)) " se" }
                }
                text .title x="500" y=(c(foot + 34.0)) text-anchor="end" { "fall of the logarithm of the held-out cost" }
            }
            figcaption {
                "Each of " (trace.units) " " (trace.independent.name()) " was foretold from the others. Dot and bar: mean and standard error of the fall; at the right: the effect\u{2019}s size \
                 in its own standard errors. An effect must foretell, and be sure, to be chosen; of a chosen one and those that cannot be \
                 told from it, the one whose fit is best is added."
            }
        }
    }
}

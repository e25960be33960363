//! The effects of a calibration: those added, with values and intervals, and what explains the
//! drapes, with probabilities.

use maud::{Markup, html};

use super::said::{cause, effect};
use crate::calibrate::explain::Explanations;
use crate::calibrate::found::FoundEffect;
use crate::report::page::number::{percent, significant};
use crate::report::page::svg::{Scale, c};

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
                            @let (unit, size) = number.unit();
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

/// What explains the drapes, each explanation with its probability.
pub(super) fn explanations(explanations: &Explanations) -> Markup {
    const ROW: f64 = 22.0;
    let all: Vec<_> = explanations.0.iter().filter(|e| e.probability >= SHOWN).collect();
    let x = Scale { values: [0.0, 1.0], pixels: [270.0, 490.0] };
    html! {
        h3 { "What explains the drapes" }
        figure {
            svg .plot viewBox={ "0 0 560 " (c(8.0 + ROW * all.len() as f64)) } role="img" aria-label="Probabilities of the explanations" {
                @for (k, explanation) in all.iter().enumerate() {
                    @let y = 16.0 + ROW * k as f64;
                    text x="260" y=(c(y + 4.0)) text-anchor="end" { (cause(&explanation.cause)) }
                    rect .interval x=(c(x.at(0.0))) y=(c(y - 6.0)) width=(c(x.at(explanation.probability) - x.at(0.0))) height="12" {}
                    text x="496" y=(c(y + 4.0)) { (percent(explanation.probability, 0)) }
                }
            }
            figcaption {
                "Probabilities from one in a hundred on. All explanations are compared in one sum: how probable the drapes are with each, for any \
                 size, and how probable it was before."
            }
        }
    }
}

/// Least probability that is drawn.
const SHOWN: f64 = 0.01;

//! The parameters with their intervals: values and bars first, then the same in the units of those
//! who use them.

use maud::{Markup, html};

use super::number::{percent, raised, significant};
use super::svg::c;
use super::units::{UNITS, Unit, typeset};
use crate::fabric::{STIFFNESSES, TABLE_2};

/// A stiffness as the page shows it, paper's units.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stiffness {
    /// Which of the paper's order.
    pub index: usize,
    /// Value.
    pub value: f64,
    /// 90 % interval.
    pub interval90: [f64; 2],
    /// Ends of the bar's axis: what the model was trained on, or what is tried.
    pub ends: [f64; 2],
    /// Inside these, and not at an end.
    pub in_range: bool,
    /// Share of the uncertainty that the scan removed, where it was refined.
    pub shown: Option<f64>,
    /// The value if weft and warp are exchanged, where they are not known.
    pub exchanged: Option<f64>,
}

const WIDTH: f64 = 260.0;
const HEIGHT: f64 = 38.0;
/// The axis' ends and the bar's middle in it.
const SPAN: [f64; 2] = [8.0, 252.0];
const MIDDLE: f64 = 11.0;

/// The interval on a logarithmic axis, decades marked.
pub(super) fn bar(own: &Stiffness) -> Markup {
    let low = own.ends[0].min(own.interval90[0]).max(f64::MIN_POSITIVE);
    let high = own.ends[1].max(own.interval90[1]).max(1.01 * low);
    let x = |value: f64| {
        let share = (value.clamp(low, high) / low).ln() / (high / low).ln();
        SPAN[0] + share * (SPAN[1] - SPAN[0])
    };
    let decades = (low.log10().ceil() as i32)..=(high.log10().floor() as i32);
    let [a, b] = own.interval90.map(x);
    let label = format!(
        "{} between {} and {} on an axis from {} to {}",
        significant(own.value),
        significant(own.interval90[0]),
        significant(own.interval90[1]),
        significant(low),
        significant(high)
    );
    html! {
        svg .bar viewBox={ "0 0 " (c(WIDTH)) " " (c(HEIGHT)) } role="img" aria-label=(label) {
            line .axis x1=(c(SPAN[0])) x2=(c(SPAN[1])) y1=(c(MIDDLE)) y2=(c(MIDDLE)) {}
            @for power in decades {
                @let at = x(10f64.powi(power));
                line .tick x1=(c(at)) x2=(c(at)) y1="6" y2="16" {}
                text .label x=(c(at)) y="32" text-anchor=(anchor(at)) { "10" (raised(power)) }
            }
            rect .interval x=(c(a)) y="7.5" width=(c((b - a).max(2.0))) height="7" rx="3.5" {}
            circle .value .outside[!own.in_range] cx=(c(x(own.value))) cy=(c(MIDDLE)) r="4.5" {}
        }
    }
}

/// A label that stays within the drawing.
fn anchor(at: f64) -> &'static str {
    if at < 20.0 {
        "start"
    } else if at > WIDTH - 20.0 {
        "end"
    } else {
        "middle"
    }
}

/// `low to high`.
fn interval(ends: [f64; 2]) -> String {
    format!("{} to {}", significant(ends[0]), significant(ends[1]))
}

/// The table of values, intervals and bars; `ends` says what their axes span, `before` names the
/// prior of the fit.
pub(super) fn table(all: &[Stiffness], density_g_m2: f64, ends: &str, before: &str) -> Markup {
    let refined = all.iter().any(|own| own.shown.is_some());
    let exchanged = all.iter().any(|own| own.exchanged.is_some());
    html! {
        div .scroll role="region" aria-label="Parameters with intervals" tabindex="0" {
            table .parameters {
                thead { tr {
                    th scope="col" { "Parameter" }
                    th scope="col" .number { "Value" }
                    th scope="col" .number { "90 % interval" }
                    th scope="col" { "Unit" }
                    th scope="col" { "On a log axis" }
                    @if exchanged { th scope="col" .number { "If exchanged" } }
                    @if refined { th scope="col" { "Uncertainty removed" } }
                    th scope="col" { "In range" }
                } }
                tbody {
                    @for own in all { (row(own, refined, exchanged)) }
                    tr .given {
                        th scope="row" { (UNITS[STIFFNESSES].words) " " i { "D" } }
                        td .number .strong { (significant(density_g_m2)) }
                        td .number { "given" }
                        td { "g/m\u{b2}" }
                        td {}
                        @if exchanged { td {} }
                        @if refined { td {} }
                        td {}
                    }
                }
            }
        }
        p .caption {
            "Dot: value; bar: 90 % interval; thin line: " (ends) ". A hollow dot is not in range: at or beyond an end of it, or with a density beyond it."
            @if refined {
                " Uncertainty removed: share of the uncertainty of " (before) " that this scan removed; near 0 % the interval is still that of " (before) "."
            }
        }
    }
}

fn row(own: &Stiffness, refined: bool, exchanged: bool) -> Markup {
    let range = &TABLE_2[own.index];
    html! {
        tr {
            th scope="row" { (UNITS[own.index].words) " " (symbol(range.symbol)) }
            td .number .strong { (significant(own.value)) }
            td .number { (interval(own.interval90)) }
            td .unit { (typeset(range.unit)) }
            td { (bar(own)) }
            @if exchanged { td .number { (own.exchanged.map(significant).unwrap_or_default()) } }
            @if refined { td { @if let Some(share) = own.shown { (meter(share)) } } }
            td { @if own.in_range { "yes" } @else { span .flag { "no" } } }
        }
    }
}

/// A share as a small bar with its number.
pub(super) fn meter(share: f64) -> Markup {
    let width = 44.0 * share.clamp(0.0, 1.0);
    html! {
        span .meter {
            svg viewBox="0 0 44 8" aria-hidden="true" {
                rect .track x="0" y="0" width="44" height="8" rx="2" {}
                rect .fill x="0" y="0" width=(c(width)) height="8" rx="2" {}
            }
            span .number { (percent(share, 0)) }
        }
    }
}

/// The paper's symbol with its index raised: `S^u`.
pub(super) fn symbol(symbol: &str) -> Markup {
    let (base, index) = symbol.split_once('^').unwrap_or((symbol, ""));
    html! { i { (base) } @if !index.is_empty() { sup { (index) } } }
}

/// The same in other units.
pub(super) fn in_units(all: &[Stiffness], density_g_m2: f64) -> Markup {
    html! {
        div .scroll role="region" aria-label="The same in other units" tabindex="0" {
            table .units {
                caption { "The same in other units, each with its 90 % interval" }
                thead { tr {
                    th scope="col" { "Parameter" }
                    th scope="col" { "SI" }
                    th scope="col" { "Textile" }
                    th scope="col" { "CLO" }
                    th scope="col" { "in .jfab" }
                } }
                tbody {
                    @for own in all {
                        @let units = &UNITS[own.index];
                        tr {
                            th scope="row" { (units.words) }
                            td { (converted(own, &units.si)) }
                            td { @for unit in units.textile { (converted(own, unit)) } }
                            td { (converted(own, &units.clo)) }
                            td { code { (units.clo_field) } }
                        }
                    }
                    @let units = &UNITS[STIFFNESSES];
                    @let of = |unit: &Unit| significant(density_g_m2 * unit.per_paper_unit);
                    tr .given {
                        th scope="row" { (units.words) ", given" }
                        td { span .quantity { b { (of(&units.si)) } " " (units.si.name) } }
                        td { @for unit in units.textile { span .quantity { b { (of(unit)) } " " (unit.name) } } }
                        td { span .quantity { b { (of(&units.clo)) } " " (units.clo.name) } }
                        td { code { (units.clo_field) } }
                    }
                }
            }
        }
    }
}

fn converted(own: &Stiffness, unit: &Unit) -> Markup {
    let of = |value: f64| significant(value * unit.per_paper_unit);
    html! {
        span .quantity {
            b { (of(own.value)) } " " (unit.name)
            small { (of(own.interval90[0])) " to " (of(own.interval90[1])) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::WIDTH;

    /// The number behind some text of the style sheet.
    fn number(css: &str, before: &str) -> f64 {
        let rest = css.split_once(before).unwrap_or_else(|| panic!("no `{before}`")).1;
        let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap();
        rest[..end].parse().unwrap()
    }

    #[test]
    fn labels_of_the_log_axis_are_legible() {
        const LEAST_PX: f64 = 10.0;
        let css = include_str!("style.css");
        let bar_px = 16.0 * number(css, "td .bar{display:block;width:");
        let label_px = number(css, "\n.bar text{font-size:") * bar_px / WIDTH;
        assert!(label_px >= LEAST_PX, "{label_px}");
        // on paper a row is smaller, and its labels are as large again
        let print = css.split_once("@media print{").unwrap().1;
        let bar_pt = number(css, "html{font-size:") * number(print, "td .bar{width:");
        let label_pt = number(print, "\n.bar text{font-size:") * bar_pt / WIDTH;
        assert!(label_pt >= 7.0, "{label_pt}");
    }
}

//! The page of a batch: how many may be used, every scan in a table, spread and outliers, overlays,
//! failures with their reasons.
//!
//! In: a [`Line`] for each scan. Out: one HTML file. Scans are taken together by folder and
//! density: these are drops and specimens of one fabric, as far as a batch can know. A scan is an
//! outlier in a stiffness where its value is farther from the median of the others than twice its
//! own 90 % interval reaches, on a logarithmic axis; three scans at least.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::number::{fixed, percent, significant};
use super::provenance;
use super::shell::Shell;
use super::svg::c;
use super::units::UNITS;
use super::verdict::{badge, class};
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::job::verdict::Level;
use crate::numeric::moments::mean;

const SORT: &str = include_str!("sort.js");

/// A stiffness of a scan, paper's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Value.
    pub value: f64,
    /// 90 % interval.
    pub interval90: [f64; 2],
    /// Inside what the model was trained on.
    pub in_range: bool,
}

/// One scan of a batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Line {
    /// Path in the folder, with slashes.
    pub file: String,
    /// The verdict; `None` where there is no estimate.
    pub level: Option<Level>,
    /// Whether what was scanned is not the experiment.
    pub not_the_experiment: bool,
    /// Whether weft and warp are unknown.
    pub warp_unknown: bool,
    /// How it ended, in a word.
    pub status: &'static str,
    /// Why there is no estimate, with the remedy.
    pub reason: Option<String>,
    /// What speaks against it, in sentences.
    pub grounds: Vec<String>,
    /// Density \[g/m^2\].
    pub density_g_m2: Option<f64>,
    /// The stiffnesses, paper's order.
    pub values: Option<[Value; STIFFNESSES]>,
    /// Mean distance from the scanned rim of the tied drape's, or of the released one's of an
    /// answer that was not refined \[mm\].
    pub mean_error_mm: Option<f64>,
    /// Share of the rim that was seen.
    pub seen: Option<f64>,
    /// A drawing of its rims that stands alone.
    pub overlay_svg: Option<String>,
    /// Its own page, from this one.
    pub page: Option<String>,
}

/// The page; `facts` are what all its scans share.
#[must_use]
pub fn page(title: &str, lines: &[Line], facts: &[(&str, String)]) -> String {
    let failures: Vec<&Line> = lines.iter().filter(|line| line.level.is_none()).collect();
    let groups = groups(lines);
    let pictured = lines.iter().any(|line| line.overlay_svg.is_some());
    let mut contents = vec![("verdicts", "Verdicts"), ("scans", "Scans")];
    if !groups.is_empty() {
        contents.push(("spread", "Spread"));
    }
    if pictured {
        contents.push(("overlays", "Overlays"));
    }
    if !failures.is_empty() {
        contents.push(("failures", "Without an estimate"));
    }
    contents.push(("provenance", "Provenance"));
    let sections = html! {
        (verdicts(lines))
        (scans(lines))
        @if !groups.is_empty() { (spread(&groups)) }
        @if pictured { (overlays(lines)) }
        @if !failures.is_empty() { (failed(&failures)) }
        section id="provenance" aria-labelledby="provenance-title" {
            h2 id="provenance-title" { "Provenance" }
            (provenance::facts(facts))
            p .caption { "The hash of each scan and the settings are in results.jsonl." }
        }
    };
    let subtitle = super::number::counted(lines.len(), "scan");
    Shell {
        kind: "Batch report",
        title,
        subtitle: &subtitle,
        contents: &contents,
        scripts: &[SORT],
    }
    .around(&sections)
}

fn verdicts(lines: &[Line]) -> Markup {
    let count = |level: Level| lines.iter().filter(|line| line.level == Some(level)).count();
    let without = lines.iter().filter(|line| line.level.is_none()).count();
    let others = lines.iter().filter(|line| line.not_the_experiment).count();
    let unknown = lines.iter().filter(|line| line.warp_unknown).count();
    html! {
        section id="verdicts" aria-labelledby="verdicts-title" {
            h2 id="verdicts-title" { "Verdicts" }
            dl .glance {
                @for level in Level::ALL {
                    div { dt class=(class(level)) { (badge(level)) } dd { span .big { (count(level)) } } }
                }
                div { dt { "Without an estimate" } dd { span .big { (without) } } }
            }
            @if others > 0 { p { (others) " of them: what was scanned is not the experiment." } }
            @if unknown > 0 {
                p {
                    "Weft and warp unknown: " (unknown) " of " (super::number::counted(lines.len(), "scan")) ". Their intervals cover both readings. \
                     Give " span .whole { "--warp-toward" } ", --mark, or the column warp_toward of the table of densities."
                }
            }
            p { (advice(count(Level::Reliable), lines.len(), without)) }
        }
    }
}

fn advice(reliable: usize, all: usize, without: usize) -> &'static str {
    if without > 0 {
        "Begin with those without an estimate: each says below why, and what to do. Then look at the doubtful ones\u{2019} grounds; run \
         the same command again, which keeps what is done."
    } else if reliable < all {
        "Look at the grounds of those that are not reliable, in the table and on their own pages, before their values are used."
    } else {
        "All can be used. Look at the spread before values are taken together."
    }
}

fn scans(lines: &[Line]) -> Markup {
    let drawn = lines.iter().any(|line| line.mean_error_mm.is_some());
    html! {
        section id="scans" aria-labelledby="scans-title" {
            h2 id="scans-title" { "Scans" }
            div .scroll role="region" aria-label="All scans" tabindex="0" {
                table data-sort="" {
                    thead { tr {
                        th scope="col" { "Scan" }
                        th scope="col" { "Verdict" }
                        th scope="col" .number { "g/m\u{b2}" }
                        @for range in &TABLE_2[..STIFFNESSES] { th scope="col" .number { (super::parameters::symbol(range.symbol)) } }
                        @if drawn { th scope="col" .number { "Rim, mm" } }
                        th scope="col" .number { "Observed" }
                    } }
                    tbody { @for line in lines { (scan(line, drawn)) } }
                }
            }
            p .caption {
                "Stretch and shear " i { "S" } ", " i { "H" } " in g/s\u{b2}, bending " i { "B" } " in g\u{b7}mm\u{b2}\u{b7}s\u{207b}\u{b2}\u{b7}rad\u{207b}\u{b9}; \
                 a value in brackets lies at or beyond the end of what the model was trained on. "
                @if drawn { "Rim: mean distance of the tied drape, or of the released one, where one was simulated. " }
                "Intervals and all digits are in results.csv."
            }
        }
    }
}

fn scan(line: &Line, drawn: bool) -> Markup {
    let rank = line.level.map_or(3, |level| level as usize);
    html! {
        tr class=(line.level.map_or("refused", class)) {
            th scope="row" .path data-value=(line.file) {
                @if let Some(page) = &line.page { a href=(page) { (name(&line.file)) } } @else { (name(&line.file)) }
            }
            td data-value=(rank) {
                @match line.level {
                    Some(level) => (badge(level)),
                    None => span .flag { (line.status) },
                }
            }
            td .number data-value=(cell(line.density_g_m2)) { (line.density_g_m2.map(significant).unwrap_or_default()) }
            @for k in 0..STIFFNESSES {
                @let own = line.values.map(|values| values[k]);
                td .number data-value=(cell(own.map(|v| v.value))) {
                    @if let Some(own) = own {
                        @if own.in_range { (significant(own.value)) } @else { "(" (significant(own.value)) ")" }
                    }
                }
            }
            @if drawn { td .number data-value=(cell(line.mean_error_mm)) { (line.mean_error_mm.map(|mm| fixed(mm, 2)).unwrap_or_default()) } }
            td .number data-value=(cell(line.seen)) { (line.seen.map(|share| percent(share, 1)).unwrap_or_default()) }
        }
    }
}

/// A path that a line breaks at its slashes, spaces and underscores only.
fn name(file: &str) -> Markup {
    html! { @for part in file.split_inclusive(['/', ' ', '_']) { span .whole { (part) } wbr; } }
}

/// A path that a line breaks at its slashes and underscores, in a narrow card.
fn soft(file: &str) -> Markup {
    html! { @for part in file.split_inclusive(['/', '_']) { (part) wbr; } }
}

/// A number for sorting; what is absent comes last.
fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

/// Scans of one folder and density that may be used.
struct Group<'a> {
    name: String,
    lines: Vec<(&'a Line, [Value; STIFFNESSES])>,
}

fn groups(lines: &[Line]) -> Vec<Group<'_>> {
    let mut all: BTreeMap<(String, String), Group<'_>> = BTreeMap::new();
    for line in lines.iter().filter(|line| line.level.is_some_and(|level| level != Level::DoNotUse))
    {
        let (Some(values), Some(density)) = (line.values, line.density_g_m2) else { continue };
        let folder = line.file.rsplit_once('/').map_or("", |(folder, _)| folder);
        let place = if folder.is_empty() { String::new() } else { format!("{folder}, ") };
        let name = format!("{place}{} g/m\u{b2}", significant(density));
        let group = all.entry((folder.to_owned(), format!("{density:012.3}")));
        group.or_insert_with(|| Group { name, lines: Vec::new() }).lines.push((line, values));
    }
    all.into_values().filter(|group| group.lines.len() > 1).collect()
}

impl Group<'_> {
    /// The values of one stiffness.
    fn values(&self, k: usize) -> Vec<f64> {
        self.lines.iter().map(|(_, values)| values[k].value).collect()
    }

    /// Geometric mean, and the standard deviation of the logarithm as a factor less one.
    fn moments(&self, k: usize) -> [f64; 2] {
        let ln: Vec<f64> = self.values(k).iter().map(|v| v.ln()).collect();
        let middle = mean(&ln);
        let squares: f64 = ln.iter().map(|v| (v - middle).powi(2)).sum();
        [middle.exp(), (squares / (ln.len() - 1) as f64).sqrt().exp_m1()]
    }

    /// Scan, stiffness and factor over the median of the others.
    fn outliers(&self) -> Vec<(&str, usize, f64)> {
        let mut found = Vec::new();
        if self.lines.len() < 3 {
            return found;
        }
        for (at, (line, values)) in self.lines.iter().enumerate() {
            for k in 0..STIFFNESSES {
                let mut others: Vec<f64> = self.values(k);
                others.remove(at);
                others.sort_by(f64::total_cmp);
                let middle = (others[others.len() / 2] * others[(others.len() - 1) / 2]).sqrt();
                let own = values[k];
                let end = own.interval90[usize::from(middle > own.value)];
                let reach = REACH * (end / own.value).ln().abs();
                if (own.value / middle).ln().abs() > reach {
                    found.push((line.file.as_str(), k, own.value / middle));
                }
            }
        }
        found
    }
}

/// Half widths of a scan's interval beyond which it is an outlier.
const REACH: f64 = 2.0;

fn spread(groups: &[Group<'_>]) -> Markup {
    html! {
        section id="spread" aria-labelledby="spread-title" {
            h2 id="spread-title" { "Spread" }
            p .caption { "Scans of one folder and density that are not marked \u{201c}do not use\u{201d}. SD: standard deviation of the logarithm, as per cent. A folder is taken for one fabric: give each its own." }
            @for group in groups {
                h3 { (group.name) ", " (group.lines.len()) " scans" }
                div .scroll role="region" aria-label={ "Spread of " (group.name) } tabindex="0" {
                    table {
                        thead { tr {
                            th scope="col" { "Parameter" }
                            th scope="col" .number { "Geometric mean" }
                            th scope="col" .number { "SD" }
                            th scope="col" { "Each scan" }
                        } }
                        tbody {
                            @for k in 0..STIFFNESSES {
                                @let [middle, sd] = group.moments(k);
                                tr {
                                    th scope="row" { (UNITS[k].words) }
                                    td .number .strong { (significant(middle)) }
                                    td .number { (percent(sd, 0)) }
                                    td { (strip(&group.values(k), k)) }
                                }
                            }
                        }
                    }
                }
                @let outliers = group.outliers();
                @if !outliers.is_empty() {
                    p { b { "Outliers" } ", farther from the others\u{2019} median than twice their own interval reaches:" }
                    ul .plainlist {
                        @for (file, k, factor) in outliers {
                            li { (file) ": " (UNITS[k].words) " is " (significant(factor)) " times the others\u{2019} median" }
                        }
                    }
                } @else if group.lines.len() >= 3 {
                    p .caption { "No scan is an outlier: none is farther from the others\u{2019} median than twice its own interval reaches." }
                }
            }
        }
    }
}

/// Values as dots on a logarithmic axis that spans a decade at least.
fn strip(values: &[f64], k: usize) -> Markup {
    let (low, high) =
        values.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    let middle = (low * high).sqrt();
    let half = (high / low).sqrt().max(10f64.sqrt()) * 1.1;
    let x = |v: f64| 8.0 + 264.0 * (v / (middle / half)).ln() / (half * half).ln();
    let label = format!(
        "{}: {} values from {} to {}",
        UNITS[k].words,
        values.len(),
        significant(low),
        significant(high)
    );
    html! {
        svg .bar viewBox="0 0 280 22" role="img" aria-label=(label) {
            line .axis x1="8" x2="272" y1="11" y2="11" {}
            @for value in values { circle .point cx=(c(x(*value))) cy="11" r="4" fill-opacity="0.6" {} }
        }
    }
}

fn overlays(lines: &[Line]) -> Markup {
    html! {
        section id="overlays" aria-labelledby="overlays-title" {
            h2 id="overlays-title" { "Overlays" }
            p .caption { "From above, warp to the right: scanned rim solid, simulated drape dashed where there is one." }
            ul .cards .small {
                @for line in lines {
                    @if let (Some(svg), Some(level)) = (&line.overlay_svg, line.level) {
                        li class={ "card " (class(level)) } {
                            @let source = format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
                            img loading="lazy" width="170" height="170" alt={ "Rims of " (line.file) } src=(source);
                            p { @if let Some(page) = &line.page { a href=(page) { (soft(&line.file)) } } @else { (soft(&line.file)) } }
                            p { (badge(level)) }
                            @for ground in line.grounds.iter().take(2) { p .caption { (super::number::sentence(ground)) } }
                        }
                    }
                }
            }
        }
    }
}

fn failed(lines: &[&Line]) -> Markup {
    html! {
        section id="failures" aria-labelledby="failures-title" {
            h2 id="failures-title" { "Without an estimate" }
            div .scroll role="region" aria-label="Scans without an estimate" tabindex="0" {
                table .plain {
                    thead { tr { th scope="col" { "Scan" } th scope="col" { "Status" } th scope="col" { "Reason and remedy" } } }
                    tbody {
                        @for line in lines {
                            tr {
                                th scope="row" .path { (name(&line.file)) }
                                td { (line.status) }
                                td { (line.reason.as_deref().unwrap_or("no reason was given")) }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(file: &str, factor: f64) -> Line {
        let value = |k: usize| {
            let own = 1000.0 * (k + 1) as f64 * factor;
            Value { value: own, interval90: [own / 1.2, own * 1.2], in_range: k != 5 }
        };
        Line {
            file: file.to_owned(),
            level: Some(Level::Reliable),
            status: "ok",
            density_g_m2: Some(200.0),
            values: Some(std::array::from_fn(value)),
            ..Line::default()
        }
    }

    #[test]
    fn an_outlier_is_named_and_those_within_their_intervals_are_not() {
        let lines =
            [line("a.ply", 1.0), line("b.ply", 1.1), line("c.ply", 0.95), line("odd.ply", 2.0)];
        let groups = groups(&lines);
        assert_eq!(groups.len(), 1);
        let outliers = groups[0].outliers();
        assert!(
            outliers
                .iter()
                .all(|(file, _, factor)| *file == "odd.ply" && (*factor - 2.0).abs() < 1e-9)
        );
        assert_eq!(outliers.len(), STIFFNESSES);
        let [middle, sd] = groups[0].moments(0);
        assert!(
            (middle - 1000.0 * (1.1_f64 * 0.95 * 2.0).powf(0.25)).abs() < 1e-6
                && sd > 0.2
                && sd < 0.6,
            "{sd}"
        );
        // another folder or density is another fabric
        let apart = [
            line("x/a.ply", 1.0),
            line("y/b.ply", 1.0),
            Line { density_g_m2: Some(201.0), ..line("x/c.ply", 1.0) },
        ];
        assert!(super::groups(&apart).is_empty());
    }

    #[test]
    fn unknown_weft_and_warp_are_told_and_names_break_between_words() {
        let unknown = Line { warp_unknown: true, ..line("sub/linen_7.ply", 1.0) };
        let text = page("t", &[unknown, line("b.ply", 1.1)], &[]);
        assert!(text.contains("Weft and warp unknown: 1 of 2 scans."), "{text}");
        let whole = "<span class=\"whole\">sub/</span><wbr><span class=\"whole\">linen_</span><wbr><span class=\"whole\">7.ply</span>";
        assert!(text.contains(whole), "{text}");
        let text = page("t", &[line("b.ply", 1.1)], &[]);
        assert!(!text.contains("Weft and warp unknown"), "{text}");
    }

    #[test]
    fn names_are_escaped_and_failures_have_their_reasons() {
        let odd = "a\"<b>&'.ply";
        let failure = Line {
            file: odd.to_owned(),
            status: "refused",
            reason: Some("no <plate>; scan again".into()),
            ..Line::default()
        };
        let text = page("x & <y>", &[line(odd, 1.0), failure], &[("Program", "1".into())]);
        assert!(text.contains("a&quot;&lt;b&gt;&amp;") && !text.contains("<b>&"), "{text}");
        assert!(
            text.contains("no &lt;plate&gt;; scan again") && text.contains("x &amp; &lt;y&gt;")
        );
        assert!(text.contains(">1</span>"), "one without an estimate");
    }
}

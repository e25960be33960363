//! What a result is worth and what to do next: the first sections of a scan's page.

use maud::{Markup, html};

use super::number::sentence;
use crate::intake::Rim;
use crate::job::Outcome;
use crate::job::verdict::{Code, Ground, Level, Verdict};
use crate::scan::Orientation;

/// The word, its sign and the class that colours it: none of them alone carries the level.
pub(super) fn badge(level: Level) -> Markup {
    html! { span .badge .(class(level)) { (sign(level)) (sentence_case(level.words())) } }
}

/// The class of a level.
pub(super) fn class(level: Level) -> &'static str {
    match level {
        Level::Reliable => "reliable",
        Level::Doubtful => "doubtful",
        Level::DoNotUse => "refused",
    }
}

/// A tick in a circle, a triangle with a bar, a cross in an octagon.
fn sign(level: Level) -> Markup {
    let (frame, mark) = match level {
        Level::Reliable => ("M10 1a9 9 0 1 0 0 18a9 9 0 0 0 0-18Z", "M5.8 10.4l2.9 2.9l5.6-6.3"),
        Level::Doubtful => ("M10 1.6L19 18.2H1Z", "M10 7.4v5.2M10 15.2v.3"),
        Level::DoNotUse => {
            ("M6.3 1h7.4L19 6.3v7.4L13.7 19H6.3L1 13.7V6.3Z", "M6.4 6.4l7.2 7.2M13.6 6.4l-7.2 7.2")
        }
    };
    html! {
        svg .sign viewBox="0 0 20 20" aria-hidden="true" {
            path .frame d=(frame) {}
            path .mark d=(mark) {}
        }
    }
}

fn sentence_case(words: &str) -> String {
    let mut letters = words.chars();
    letters
        .next()
        .map(|c| c.to_uppercase().collect::<String>() + letters.as_str())
        .unwrap_or_default()
}

/// The verdict with its grounds.
pub(super) fn section(verdict: &Verdict) -> Markup {
    let said: &str = match verdict.level {
        _ if verdict.not_the_experiment => {
            "The scan does not show the experiment: no number below is valid."
        }
        Level::Reliable => "The scan and the result look normal.",
        Level::Doubtful => {
            "Something is unusual: a part of the result may be off by more than its interval."
        }
        Level::DoNotUse => "The result is known to be wrong, or its error is unknown.",
    };
    html! {
        section id="verdict" class={ "verdict " (class(verdict.level)) } aria-labelledby="verdict-title" {
            h2 id="verdict-title" { span .unseen { "Verdict: " } (badge(verdict.level)) }
            p .lead { (said) }
            @if verdict.grounds.is_empty() {
                p { "Nothing in the scan, its rim or the estimate speaks against it." }
            } @else {
                ul .grounds { @for ground in &verdict.grounds { (ground_item(ground)) } }
            }
        }
    }
}

fn ground_item(ground: &Ground) -> Markup {
    let word = match ground.level {
        Level::Reliable => "note",
        level => level.words(),
    };
    html! {
        li class=(class(ground.level)) {
            span .weight { (word) }
            span { (sentence(&ground.text)) " " code .code { (ground.code.name()) } }
        }
    }
}

/// What to do next, most urgent first.
pub(super) fn next(outcome: &Outcome) -> Markup {
    let steps = steps(outcome);
    html! {
        section id="next" aria-labelledby="next-title" {
            h2 id="next-title" { "What to do next" }
            ol .steps { @for step in &steps { li { (step) } } }
        }
    }
}

fn steps(outcome: &Outcome) -> Vec<String> {
    let mut steps: Vec<String> = Vec::new();
    let mut add = |text: &str| {
        if !steps.iter().any(|step| step == text) {
            steps.push(text.to_owned());
        }
    };
    for ground in &outcome.verdict.grounds {
        if let Some(text) = remedy(ground) {
            add(text);
        }
    }
    let usable = outcome.verdict.level != Level::DoNotUse;
    if usable {
        add(
            "Use the six stiffnesses and the density together in the simulator, in its units (table of units below; \
             params.json has all digits).",
        );
    }
    if usable && outcome.refinement.is_none() {
        add(
            "Run without --quick: the simulator then fits the fabric to the scan and reports how well it explains the drape.",
        );
    }
    let several = outcome.refinement.as_ref().is_some_and(|found| !found.companions.is_empty());
    let known = outcome.rim.orientation() == Orientation::Given;
    if usable && !several && known && matches!(outcome.rim, Rim::Scanned { .. }) {
        add(
            "Before you decide anything by the values, drop and scan the same cloth again, and give both scans (--with SECOND). A fabric has several stable drapes.",
        );
    }
    steps
}

/// What is to be done about a ground; `None` where it only has to be known.
fn remedy(ground: &Ground) -> Option<&'static str> {
    use Code as C;
    Some(match ground.code {
        C::OffCentre | C::NovelRim | C::FoldsForBending if ground.level == Level::Reliable => {
            return None;
        }
        C::Scale | C::SideLength | C::Width | C::UnevenSides => {
            "Measure the specimen's sides with a ruler, and the scan's scale on something of known size, the height too; \
             correct what is wrong, and scan again."
        }
        C::PlateRadius => {
            "Measure the plate (radius 50 mm) and look whether anything but cloth lies on it or the cloth lifts off it; then \
             scan again."
        }
        C::OffCentre => {
            "Centre the specimen on the plate and scan again, or run without --quick: the fit takes the offset into \
             account."
        }
        C::Tilted => "Level the plate with a spirit level, lay the specimen again, and scan it.",
        C::RimHidden | C::RimBridged => {
            "Scan again so that the whole rim is seen, also from a little below; the chart along the rim shows where it was \
             bridged."
        }
        C::SheetMisfit | C::Unexplained => {
            "Look in the view in three dimensions for anything that is not cloth. Let the cloth come to rest, remove what is \
             near it, and scan again."
        }
        C::RimFromFile => {
            "Give the scan itself in place of the rim's file where you can: cloth and plate are then checked too."
        }
        C::WarpNearDiagonal | C::OrientationAmbiguous => {
            "Give the direction of the warp (--warp-toward), or mark it on the cloth (--mark), and run again: weft and warp \
             may be exchanged in these values."
        }
        C::OutsidePrior => {
            "Check that plate and specimen are those of the experiment. If they are, the cloth is a rare one: drop and scan \
             it again, and give both scans (--with SECOND)."
        }
        C::NovelRim | C::FoldsForBending => {
            "Compare the overlay with the cloth. If the rim is not the cloth's, scan again."
        }
        C::OutOfRange | C::IntervalAtBound | C::DensityOutsideTraining => {
            "Check the density on a scale. If it is right, run without --quick: the simulator is not limited to the range of \
             the network's training data."
        }
        C::NotRefined | C::FoldsDiffer => {
            "Drop the cloth again, scan it, and give both scans (--with SECOND): another drape may lie on a \
             branch that the simulator finds."
        }
        C::ModelMisfit | C::ReleasedDrapeOff => {
            "Look where along the rim the error lies. All around: the six stiffnesses cannot describe this fabric, or the \
             density is wrong. In one place: the cloth was creased, pulled or hidden there."
        }
        C::ReleasedDrapeNotAtRest | C::ReleasedDrapeIntersects => {
            "Do not rely on the distances of the released drape, which is not at rest. The parameters do not depend on it."
        }
        C::HardlyVisible | C::BendingProjected | C::WarpFromFile => return None,
    })
}

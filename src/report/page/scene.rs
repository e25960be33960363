//! The figure of a scan in three dimensions: the view that turns with its knobs, and the still
//! picture for where there is none.
//!
//! In: what is shown. Out: a figure; without the view no script is in it.

use maud::{Markup, PreEscaped, html};

use super::shown::Shown;
use super::still;

/// The script of the view that turns, built by `scripts/viewer` with the licence of what is in it.
pub(super) const VIEWER: &str = include_str!("viewer/viewer.min.js");

/// The figure: the still picture, and where `turning` the canvas with its knobs and data.
pub(super) fn figure(shown: &Shown, turning: bool) -> Markup {
    let sheet = if shown.simulated_sheet { "simulated drape" } else { "fitted sheet" };
    let layers = [
        ("points", "scanned points", !shown.points.is_empty()),
        ("scanned", "scanned rim", true),
        ("sheet", sheet, !shown.sheet.is_empty()),
        ("simulated", "simulated rim", !shown.simulated.is_empty()),
    ];
    html! {
        figure .view3d data-view3d[turning] {
            div .stage {
                (still::drawing(shown))
                @if turning {
                    canvas tabindex="0" role="img" aria-label={ "The scanned cloth, both rims and the " (sheet) " in three dimensions; arrow keys turn, plus and minus zoom, Home resets" } {}
                }
            }
            @if turning {
                div .knobs {
                    fieldset {
                        legend { "Shown" }
                        @for (key, words, there) in layers {
                            @if there { label .(key) { input type="checkbox" data-layer=(key) checked; (words) } }
                        }
                    }
                    fieldset {
                        legend { "Seen from" }
                        @for (key, words) in [("oblique", "aside"), ("above", "above"), ("front", "weft"), ("side", "warp")] {
                            button type="button" data-view=(key) { (words) }
                        }
                    }
                    p .said { span data-said="" {} }
                }
                script type="application/json" { (PreEscaped(shown.data().to_string())) }
            }
            figcaption {
                "Scanned rim, " (sheet) " and plate."
                @if turning {
                    span .live-only { " Drag, or focus the view and use the arrow keys, to turn; plus and minus, wheel or two fingers zoom; Home resets." }
                    span .still-only { " The view that turns needs WebGL and scripts; this is its still picture." }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::page::shown::tests::shown;

    #[test]
    fn without_the_view_no_script_is_left() {
        let still = figure(&shown(), false).into_string();
        assert!(!still.contains("<script") && !still.contains("<canvas") && still.contains("<svg"));
        let turning = figure(&shown(), true).into_string();
        assert!(turning.contains("fitted sheet") && turning.contains("data-layer=\"points\""));
        assert!(!turning.contains("data-layer=\"simulated\""));
    }
}

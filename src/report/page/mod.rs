//! Pages to look at: one self-contained HTML file per scan, batch or calibration, for a screen, a
//! phone or paper.
//!
//! In: results. Out: a text that is a whole page. It asks nothing of any network, needs no script
//! to be read, escapes what users named, and holds no time, so that the same result gives the same
//! bytes. What is on which page, and how each number is computed, is in docs/report.md.
//!
//! A page is sections (`verdict`, `parameters`, `overlay`, ...) in a [`shell`]; drawings are SVG
//! made here, the view that turns is a script built by `scripts/viewer`.

mod along;
pub mod batch;
pub mod calibration;
mod coefficient;
mod figures;
pub mod lab;
pub mod number;
pub mod options;
pub mod overlay;
mod parameters;
pub mod provenance;
pub mod scan;
mod scene;
pub mod shell;
mod shown;
mod still;
pub mod svg;
pub mod units;
mod verdict;

//! What a page shows beside the result itself.

use super::lab::Lab;
use super::provenance::InputFile;
use crate::report::cusick::StandardCusick;

/// What a scan's page shows beside its result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extra {
    /// The laboratory's fields; blank lines where there are none.
    pub lab: Lab,
    /// The files that were read, with their hashes.
    pub inputs: Vec<InputFile>,
    /// The standard Cusick test of the fabric, where it was simulated.
    pub cusick: Option<StandardCusick>,
    /// Whether the page has the view that turns; without it the still picture alone.
    pub turning_view: bool,
}

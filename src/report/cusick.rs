//! The standard Cusick test of a fabric, simulated: what a laboratory would compare with its own
//! drapemeter.
//!
//! In: a fabric. Out: the drape coefficient and the folds of one drop of a disc of radius 150 mm on
//! a plate of radius 90 mm. A fabric has several drapes; one of them is simulated.

use crate::calibrate::measures::{FoldRule, Measures};
use crate::calibrate::prediction::outline_of;
use crate::fabric::Fabric;
use crate::sim::{Drop, Experiment, SimOptions, Stop, drape};

/// What the test of a fabric gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardCusick {
    /// Drape coefficient \[%\].
    pub drape_coefficient: f64,
    /// Number of folds.
    pub folds: usize,
    /// Whether the drape came to rest.
    pub at_rest: bool,
}

impl StandardCusick {
    /// Simulates the test.
    #[must_use]
    pub fn of(fabric: &Fabric) -> Self {
        let experiment = Experiment::standard_cusick();
        let drape =
            drape(fabric, &Drop::canonical(), &SimOptions { experiment, ..SimOptions::default() });
        let measures = Measures::of(&outline_of(&drape), &experiment, &FoldRule::default());
        Self {
            drape_coefficient: measures.drape_coefficient,
            folds: measures.folds,
            at_rest: drape.stop == Stop::AtRest,
        }
    }
}

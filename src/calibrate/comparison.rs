//! A measured outline compared with the drape that simulates it.
//!
//! In: a target, its sheet at rest, the pose and what is seen of it there. Out: [`Comparison`],
//! which pages, files and the verdict read.

use super::effect::View;
use super::equations::{Draped, rms_m};
use super::measures::{FoldRule, Measures};
use super::options::FitOptions;
use super::pose::{Pose, picture_of, scaled};
use super::residuals::Row;
use super::target::Target;
use crate::base::Outline;
use crate::sim::Drape;

/// A measured outline beside the drape of a fabric on its branch.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The drape, at rest.
    pub drape: Drape,
    /// How it lies in the picture.
    pub pose: Pose,
    /// Root mean square distance of the outlines \[m\].
    pub rms_m: f64,
    /// Where they differ, at even steps along the measured outline.
    pub rows: Vec<Row>,
    /// The measured outline around its centroid, in the picture \[m\].
    pub measured: Outline,
    /// The drape's outline there \[m\].
    pub simulated: Outline,
    /// What is counted on the drape's outline at the picture's scale, as on the measured one.
    pub measures: Measures,
    /// Force of the springs that hold it, root mean square. It is a share of the weight of the
    /// cloth beyond the plate's edge, for a scanned sheet of the sheet's whole weight. 0 for a
    /// released drape.
    pub springs_share: f64,
    /// Of a scanned sheet that was held and predicted, root mean square distance of the rims once
    /// it is released \[m\].
    pub released_rms_m: Option<f64>,
}

impl Comparison {
    pub(super) fn of(
        target: &Target,
        draped: Draped,
        view: View,
        options: &FitOptions,
        rule: &FoldRule,
    ) -> Self {
        let Draped { prediction, pose, residuals } = draped;
        let posed = scaled(&pose, view.ln_scale);
        let larger = posed.ln_scale.exp();
        let outline = match target.rim {
            Some(_) => prediction.outline.clone(),
            None => prediction.seen_from_above(target.seen_from(view)),
        };
        let as_seen = outline.mapped(|p| p.map(|v| v * larger));
        Self {
            rms_m: rms_m(&residuals.rows),
            measured: target.outline.clone(),
            simulated: outline.mapped(|p| picture_of(p, &posed)),
            measures: Measures::of(&as_seen, &target.bench, rule),
            springs_share: match target.rim {
                Some(_) => target.tied_share(&prediction, view, options),
                None => options.hold_per_m * prediction.hold.rms_m,
            },
            released_rms_m: None,
            drape: prediction.drape,
            pose,
            rows: residuals.rows,
        }
    }
}

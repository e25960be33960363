//! The scan's scale, as the specimen and the plate tell it.
//!
//! The cloth from edge to opposite edge is held against the specimen's side and what hanging cloth
//! stretches; the radius at which it leaves the plate against the plate's. The first tells the
//! scale to 0.3 % under a sensor of little noise; the second to 2 %, since cloth leaves a plate
//! earlier or later by its stiffness. Both were measured on valid scans
//! (docs/validation/verdict.md, "Scale"). The sides of the rim tell a third of it: the sheet is
//! fitted with the specimen's lengths.

use serde::Serialize;

use super::figures::{Figures, OnPlate};
use super::limits::Limits;
use crate::numeric::moments::Z90;

/// The scale of a scan by one thing of known size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ScaleBy {
    /// Lengths in the scan over true ones \[-\].
    pub value: f64,
    /// Its standard deviation \[-\].
    pub sigma: f64,
}

/// The scale of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Scale {
    /// Lengths in the scan over true ones, by cloth and plate \[-\].
    pub value: f64,
    /// Its standard deviation \[-\].
    pub sigma: f64,
    /// What the cloth's lengths from edge to edge say.
    pub cloth: ScaleBy,
    /// What the plate's radius says.
    pub plate: ScaleBy,
}

impl Scale {
    /// The scale of a scan whose cloth was seen from edge to edge; `None` of others.
    pub(super) fn of(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Self> {
        let [cloth, plate] = [of_cloth(f, scan, limits)?, of_plate(f, scan, limits)];
        let [by_cloth, by_plate] = [cloth, plate].map(|by| by.sigma.powi(-2));
        Some(Self {
            value: (cloth.value * by_cloth + plate.value * by_plate) / (by_cloth + by_plate),
            sigma: (by_cloth + by_plate).sqrt().recip(),
            cloth,
            plate,
        })
    }

    /// How far the logarithm of bending moves with this scale.
    pub(super) fn bending_moves(&self, limits: &Limits) -> f64 {
        limits.bending_per_scale * self.value.ln().abs()
    }

    /// Whether the scale is another one than 1 with 90 % probability.
    pub(super) fn is_off(&self) -> bool {
        (self.value - 1.0).abs() > Z90 * self.sigma
    }
}

fn of_cloth(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<ScaleBy> {
    let (side_m, answer) = (f.given.side_m, f.answer.as_ref()?);
    // Of the widths the one along the warp comes first, of the stretches the one along the weft.
    let [weft, warp] = answer.stretch;
    let seen: Vec<(f64, f64)> =
        scan.widths_m.into_iter().zip([warp, weft]).filter_map(|(w, s)| Some((w?, s))).collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / seen.len() as f64;
    let width_m = mean(&mut seen.iter().map(|(width_m, _)| *width_m));
    let stretch = mean(&mut seen.iter().map(|(_, stretch)| *stretch));
    let length_m = answer.bending_length_m.max(limits.least_bending_length_m);
    let folds = 0.5 * limits.side_loss_m2 / length_m / side_m;
    let expected = 1.0 + limits.scale_per_stretch[0] * stretch - folds;
    let unsure = [
        limits.scale_sigma,
        limits.scale_sigma_per_noise * f.noise_m,
        limits.scale_per_stretch[1] * stretch,
        folds,
    ];
    let sigma = unsure.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt();
    (!seen.is_empty()).then(|| ScaleBy { value: width_m / side_m / expected, sigma })
}

fn of_plate(f: &Figures, scan: &OnPlate, limits: &Limits) -> ScaleBy {
    let expected_m = f.given.plate_radius_m - limits.plate_lead_m;
    let sigma = limits.scale_sigma_of_plate.hypot(scan.radius_sigma_m / expected_m);
    ScaleBy { value: scan.radius_m / expected_m, sigma }
}

//! The scan's scale, as the specimen and the plate tell it.
//!
//! The cloth from edge to opposite edge is held against the specimen's side and what hanging cloth stretches; the
//! radius at which it leaves the plate against the plate's. The first tells the scale to 0.3 % under a sensor of little noise; the
//! second to 2 %, since cloth leaves a plate earlier or later by its stiffness. Both were measured on honest scans
//! (docs/validation.md, "Scale"). The sides of the rim tell a third of it: the sheet is fitted with the specimen's lengths.

use serde::Serialize;

use super::figures::{Figures, OnPlate};
use super::limits::Limits;

/// Lengths in a scan over true ones, and the standard deviation of that \[-\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Told {
    /// The scale.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// The scale of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scale {
    /// Lengths in the scan over true ones, by cloth and plate \[-\].
    pub value: f64,
    /// Its standard deviation \[-\].
    pub sigma: f64,
    /// What the cloth's lengths from edge to edge say.
    pub cloth: Told,
    /// What the plate's radius says.
    pub plate: Told,
}

impl Scale {
    /// The scale of a scan whose cloth was seen from edge to edge; `None` of others.
    pub(super) fn of(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Self> {
        let [cloth, plate] = [of_cloth(f, scan, limits)?, of_plate(f, scan, limits)];
        let [by_cloth, by_plate] = [cloth, plate].map(|told| told.sigma.powi(-2));
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

/// Quantile of the standard normal beyond which 5 % lie on each side.
const Z90: f64 = 1.6449;

fn of_cloth(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Told> {
    let side_m = f.given.side_m;
    let (length_m, stretch) = match &f.answer {
        Some(answer) => (answer.bending_length_m, answer.stretch),
        None => return None,
    };
    // Warp first; stretch along the weft first.
    let [warp, weft] = scan.widths_m;
    let seen: Vec<[f64; 2]> = [(warp, stretch[1]), (weft, stretch[0])]
        .into_iter()
        .filter_map(|(width_m, stretch)| Some([width_m?, stretch]))
        .collect();
    let count = seen.len() as f64;
    let mean = |k: usize| seen.iter().map(|of| of[k]).sum::<f64>() / count;
    let stretch = mean(1);
    let folds = 0.5 * limits.side_loss_m2 / length_m.max(limits.least_bending_length_m) / side_m;
    let expected = 1.0 + limits.scale_per_stretch[0] * stretch - folds;
    let unsure = [
        limits.scale_sigma,
        limits.scale_sigma_per_noise * f.noise_m,
        limits.scale_per_stretch[1] * stretch,
        folds,
    ];
    let sigma = unsure.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt();
    (count > 0.0).then(|| Told { value: mean(0) / side_m / expected, sigma })
}

fn of_plate(f: &Figures, scan: &OnPlate, limits: &Limits) -> Told {
    let expected_m = f.given.plate_radius_m - limits.plate_lead_m;
    let sigma = limits.scale_sigma_of_plate.hypot(scan.radius_sigma_m / expected_m);
    Told { value: scan.radius_m / expected_m, sigma }
}

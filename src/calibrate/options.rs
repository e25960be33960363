//! How a fabric is fitted: how well drapes are measured and simulated, how they lie, how they are
//! held.

use super::effect::{Acts, Effect, Number, SENSOR_EDGE};
use super::pose::Pose;
use crate::inverse::scanned;
use crate::sim::SimOptions;

/// How a fabric is fitted to outlines and rims.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FitOptions {
    /// Standard deviation of a measured outline across itself: picture, settling \[m\].
    pub outline_m: f64,
    /// Standard deviation by which a drape of the true fabric lies off on its branch \[m\].
    pub model_m: f64,
    /// The same where a scan's sheet or rim leads it \[m\].
    pub scan_model_m: f64,
    /// Length of outline over which errors are alike \[m\]: one point of it counts.
    pub correlation_length_m: f64,
    /// Distance, in standard deviations, from which on a point pulls no harder.
    pub outlier: f64,
    /// Standard deviation of a place of a rim along it, beside that across it \[m\].
    pub along_m: f64,
    /// Standard deviations of the numbers of a pose in a picture. With 0 a number stays what it is.
    pub pose_sigma: Pose,
    /// The same in a scan's frame, which the scan path has laid on plate and specimen.
    pub scan_pose_sigma: Pose,
    /// How many times finer the cells are on which tied sheets are laid once more, so that it is
    /// known what cells do to them; with 1 none are.
    pub finer: f64,
    /// How far cloth lies beyond those finer cells, in parts of what an error that falls with the
    /// square of the cell predicts: mean and standard deviation.
    pub cells: [f64; 2],
    /// Standard deviation of the warp's bearing where it is not known \[rad\].
    pub unknown_bearing: f64,
    /// Standard deviation of the logarithm of the pictures' scale, which all pictures of a fabric
    /// share; with 0 the scale is as it is given, and is looked for as an effect.
    pub scale_sigma: f64,
    /// By how much scanned edges lie farther out than the cloth ends, which all scans of a fabric
    /// share: mean and standard deviation \[m\]. With a standard deviation of 0 the edges are where
    /// they are scanned.
    pub sensor_edge_m: [f64; 2],
    /// How strongly a drape is held across its outline, see [`crate::sim::Hold::per_m`] \[1/m\];
    /// with 0 it is released.
    pub hold_per_m: f64,
    /// How far the weight of a piece of cloth stretches the springs that hold it to a scanned sheet
    /// \[m\]; with 0 it is released.
    pub scan_hold_sag_m: f64,
    /// The same of the springs on the edge of a rim without a sheet; they are few. Weaker ones
    /// leave stretch too low for its interval.
    pub rim_hold_sag_m: f64,
    /// Standard deviation of the springs' mean stretch from none \[m\].
    pub stretch_m: f64,
    /// Most drapes of an outline.
    pub evaluations: usize,
    /// Largest change of a shared unknown in one step.
    pub longest_step: f64,
    /// The simulator's options but for the experiment, which each target has.
    pub sim: SimOptions,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            // captures of one drape differ by 1 to 2.4 mm, each by that over the root of two
            outline_m: 1.2e-3,
            // rims of neighbouring minima: `docs/validation/simulator.md`
            model_m: 1.0e-3,
            scan_model_m: scanned::MODEL_M,
            // a quarter of a fold of seven
            correlation_length_m: 25e-3,
            outlier: 3.0,
            // chosen: a centroid lies a few mm from the axis, a specimen is laid to a mm, a warp is
            // marked to 3 degrees; the pull is what it must be
            pose_sigma: Pose {
                offset_m: [4e-3; 2],
                rotation_rad: 0.05,
                specimen_m: [1e-3; 2],
                pull_m: 50e-3,
                ..Pose::default()
            },
            along_m: scanned::ALONG_M,
            scan_pose_sigma: Pose {
                offset_m: [scanned::OFFSET_M; 2],
                rotation_rad: scanned::ROTATION_RAD,
                specimen_m: [scanned::OFFSET_M; 2],
                height_m: scanned::HEIGHT_M,
                lean_rad: [scanned::TILT_RAD; 2],
                ..Pose::default()
            },
            finer: 1.5,
            cells: scanned::CELLS,
            unknown_bearing: 0.5,
            scale_sigma: 0.0,
            sensor_edge_m: [0.0; 2],
            // 15 % of the weight for each mm: with a twentieth single sheets still lose a fold on
            // the way
            hold_per_m: 150.0,
            scan_hold_sag_m: scanned::HOLD_SAG_M,
            rim_hold_sag_m: scanned::RIM_HOLD_SAG_M,
            stretch_m: 0.02e-3,
            evaluations: 12,
            longest_step: 0.7,
            sim: SimOptions::default(),
        }
    }
}

impl FitOptions {
    /// The effects' numbers that are no effects here, since it is declared how well they are known:
    /// they are fitted from the plain model on.
    #[must_use]
    pub fn declared(&self) -> Vec<&'static Number> {
        let scale = Effect::named("scale").filter(|_| self.scale_sigma > 0.0);
        let edge = Some(&SENSOR_EDGE).filter(|_| self.sensor_edge_m[1] > 0.0);
        scale.into_iter().chain(edge).flat_map(|effect| effect.numbers).collect()
    }

    /// How far cloth lies beyond the drapes' cells, in moves from them to the finer ones: mean and
    /// standard deviation.
    pub(super) fn believed_of_cells(&self) -> [f64; 2] {
        let [mean, sigma] = scanned::beyond_cells(self.cells, self.finer);
        [1.0 + mean, sigma]
    }

    /// How large a number may be expected to be: standard deviation, SI.
    pub(super) fn expected_of(&self, number: &Number) -> f64 {
        self.declared_of(number).unwrap_or(number.sigma)
    }

    /// What a number is expected to be, SI: nothing, but for a sensor's edge that is known.
    pub(super) fn mean_of(&self, number: &Number) -> f64 {
        if number.acts == Acts::Edge { self.sensor_edge_m[0] } else { 0.0 }
    }

    /// Its standard deviation, if that is declared.
    fn declared_of(&self, number: &Number) -> Option<f64> {
        let sigma = match number.acts {
            Acts::Scale => self.scale_sigma,
            Acts::Edge => self.sensor_edge_m[1],
            _ => 0.0,
        };
        (sigma > 0.0).then_some(sigma)
    }

    /// Least and largest value of a number that is tried, in units of [`Number::sigma`].
    #[must_use]
    pub fn limits_of(&self, number: &Number) -> [f64; 2] {
        match self.declared_of(number) {
            Some(declared) => {
                let (mean, most) = (self.mean_of(number), DECLARED_LIMIT * declared);
                [mean - most, mean + most].map(|end| end / number.sigma)
            }
            None => number.limits.map(|limit| limit / number.sigma),
        }
    }
}

/// Misfit of scanned sheets from which on something is left to explain: drapes of the model itself
/// leave 0.10 to 0.20 with a handheld scanner and 0.46 to 0.55 with a phone
/// (`docs/design/calibration.md`).
pub(super) const LEAVES: f64 = 0.6;
/// Misfit of scanned sheets from which on the model is not theirs, wherever a fit begins and
/// however long it continues.
pub(super) const MUCH: f64 = 0.9;
/// Standard deviations of what is declared up to which it is tried. Tied drapes always ask for
/// more: of a softer cloth on a larger scale the springs leave less (`docs/closing_the_loop.md`).
const DECLARED_LIMIT: f64 = 2.0;

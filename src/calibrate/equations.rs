//! The least squares around the drapes of one fabric.
//!
//! Unknown are the logarithms of the six stiffnesses and the numbers of the effects that are looked
//! for, which all drapes share (the latter in units of what may be expected, [`Number::sigma`]),
//! and the pose of each drape where it was measured. The distance of a measured point from the
//! simulated drape ([`residuals`]) is predicted by the moves of the cloth there. Neighbouring
//! points err alike: of all points on a stretch one counts. A distance of more than a few standard
//! deviations pulls no harder than one at that distance (Huber 1964).
//!
//! Where a sensor has the edges of scanned sheets is known no better than sensors are: one number
//! for all scans of a fabric ([`super::effect::SENSOR_EDGE`]), in every fit to them. The scan path,
//! told the specimen's size, takes what it can out of each rim ([`crate::scan::EdgeShift`]); that
//! is counted in, so that specimens of another size are no sensor's.
//!
//! A drape that springs hold across its outline has one unknown more, how far outwards they pull,
//! and one row more: that they pull nowhere on the whole. Its arrangement of folds is then the
//! measured one, and its mean extent its own.

use nalgebra::{DMatrix, DVector};

use super::effect::{Cloth, Number};
use super::fabric_prior::FabricPrior;
use super::options::FitOptions;
use super::pose::{POSE, Pose};
use super::prediction::Prediction;
use super::residuals::{Residuals, Row, Unknowns, residuals};
use super::target::Target;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::inverse::{
    self, Part, Pull, SharedPrior, Step, Sums, at_best, huber_cost, huber_weight,
};
use crate::sim::sensitivity::Parameter;

/// The sensitivities of every predicted sheet: stiffnesses, the specimen's place, the springs'
/// pull.
const ALWAYS: [Parameter; STIFFNESSES + 3] = {
    let [a, b, c, d, e, f] = Parameter::STIFFNESSES;
    [a, b, c, d, e, f, Parameter::OffsetX, Parameter::OffsetZ, Parameter::Pull]
};

/// The shared unknowns of a cloth.
pub(super) fn shared_of(cloth: &Cloth) -> Vec<f64> {
    let sizes = cloth.effects.iter().map(|(number, value)| value / number.sigma);
    cloth.ln().into_iter().chain(sizes).collect()
}

/// The sensitivities of a predicted sheet where some effects are looked for.
pub(super) fn parameters(numbers: &[&'static Number]) -> Vec<Parameter> {
    let mut all = ALWAYS.to_vec();
    for parameter in numbers.iter().flat_map(|number| number.parameters()) {
        if !all.contains(parameter) {
            all.push(*parameter);
        }
    }
    all
}

/// What the least squares are over.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    /// What was measured, with what finer cells do to the cloth.
    pub targets: Vec<Target>,
    /// The unknowns that they share beside the stiffnesses.
    pub numbers: Vec<&'static Number>,
    pub fabric_prior: &'a FabricPrior,
    pub options: &'a FitOptions,
}

/// What is kept of a drape.
#[derive(Clone)]
pub(super) struct Draped {
    pub prediction: Prediction,
    pub pose: Pose,
    pub residuals: Residuals,
}

/// A cloth with its drapes, and the least squares around it. Shared are logarithms of stiffnesses,
/// then effects in units of what may be expected.
pub(super) type State = inverse::State<Draped>;

impl State {
    /// How each drape lies.
    pub fn poses(&self) -> Vec<Pose> {
        self.drapes.iter().map(|draped| draped.pose).collect()
    }

    /// What is seen of each.
    pub fn into_predictions(self) -> Vec<Prediction> {
        self.drapes.into_iter().map(|draped| draped.prediction).collect()
    }

    /// What each drape costs.
    pub fn costs(&self) -> Vec<f64> {
        self.parts.iter().map(Part::cost).collect()
    }
}

/// Root mean square of the rows' distances \[m\].
pub(super) fn rms_m(rows: &[Row]) -> f64 {
    (rows.iter().map(|row| row.across_m.powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

impl Problem<'_> {
    /// The same with other unknowns.
    pub fn with(&self, numbers: &[&'static Number]) -> Self {
        Self { numbers: numbers.to_vec(), ..self.to(self.targets.clone()) }
    }

    /// The same of other drapes.
    pub fn to(&self, targets: Vec<Target>) -> Self {
        Self { targets, numbers: self.numbers.clone(), ..*self }
    }

    /// Number of shared unknowns.
    pub fn shared(&self) -> usize {
        STIFFNESSES + self.numbers.len()
    }

    /// The cloth of some shared unknowns, its fabric made one that can be.
    pub fn cloth(&self, shared: &[f64]) -> Cloth {
        let ln = std::array::from_fn(|k| shared[k]);
        let fabric = Fabric::from_ln_stiffnesses(&ln, self.fabric_prior.density_kg_m2);
        let sizes = self.numbers.iter().zip(&shared[STIFFNESSES..]);
        Cloth { fabric, effects: sizes.map(|(&n, share)| (n, n.sigma * share)).collect() }
    }

    /// The least squares around some drapes of a cloth, the poses at their best from `poses` on.
    pub fn around(&self, shared: &[f64], predictions: Vec<Prediction>, poses: &[Pose]) -> State {
        let cloth = self.cloth(shared);
        let of = Unknowns { cloth: &cloth, numbers: &self.numbers, options: self.options };
        let alone = Unknowns { numbers: &[], ..of };
        let drapes = self.targets.iter().zip(predictions).zip(poses);
        let (drapes, parts) = drapes
            .map(|((target, prediction), from)| {
                let at = |pose: &Pose, of| {
                    let residuals = residuals(target, &prediction, pose, of);
                    (self.part(target, pose, &residuals), residuals)
                };
                let pose = at_best(*from, POSE_ROUNDS, 1e-7, |pose| at(pose, alone).0);
                let (part, residuals) = at(&pose, of);
                (Draped { prediction, pose, residuals }, part)
            })
            .unzip();
        let shared = [&cloth.ln(), &shared[STIFFNESSES..]].concat();
        let prior = self.prior(&shared);
        State::around(shared, &prior, drapes, parts)
    }

    /// What the shared unknowns are before any drape is seen.
    pub fn prior(&self, shared: &[f64]) -> SharedPrior {
        let common = self.shared();
        let mut precision = DMatrix::identity(common, common);
        if let Some(of_fabric) = self.fabric_prior.covariance.try_inverse() {
            precision.view_mut((0, 0), (STIFFNESSES, STIFFNESSES)).copy_from(&of_fabric);
        }
        for (k, number) in self.numbers.iter().enumerate() {
            let at = STIFFNESSES + k;
            precision[(at, at)] = (number.sigma / self.options.expected_of(number)).powi(2);
        }
        let off = self.off(shared);
        let right = &precision * &off;
        let cost = off.dot(&right);
        SharedPrior { precision, right, cost }
    }

    /// How far each shared unknown is below what is expected.
    pub fn off(&self, shared: &[f64]) -> DVector<f64> {
        let of_number = |k: usize| {
            let number = self.numbers[k - STIFFNESSES];
            self.options.mean_of(number) / number.sigma
        };
        let expected =
            |k: usize| if k < STIFFNESSES { self.fabric_prior.ln_mean[k] } else { of_number(k) };
        DVector::from_fn(self.shared(), |k, _| expected(k) - shared[k])
    }

    /// What a drape adds.
    fn part(&self, target: &Target, pose: &Pose, residuals: &Residuals) -> Part {
        let poses = [*pose, target.first_pose(), target.pose_sigma(self.options)];
        let [now, first, sigma] = poses.map(<[f64; POSE]>::from);
        let pull = |m: usize| match now[m] - first[m] {
            beyond if sigma[m] > 0.0 => Pull::gaussian(sigma[m].powi(-2), beyond),
            beyond => Pull::fixed(beyond),
        };
        Part { sums: self.sums_of(residuals), own: (0..POSE).map(pull).collect() }
    }

    /// The sums over a drape's distances.
    fn sums_of(&self, residuals: &Residuals) -> Sums {
        let options = self.options;
        let mut cost = 0.0;
        let mut weighted = residuals.columns.clone();
        let known = residuals.sigma_m.iter().zip(&residuals.counts);
        for (r, (off_m, (sigma_m, counts))) in residuals.off_m.iter().zip(known).enumerate() {
            let far = off_m.abs() / sigma_m;
            let weight = huber_weight(far, options.outlier);
            cost += huber_cost(*counts, far, weight);
            weighted.row_mut(r).scale_mut(counts * weight / sigma_m.powi(2));
        }
        let mut right = weighted.tr_mul(&residuals.off_m);
        let mut normal = weighted.tr_mul(&residuals.columns);
        let precision = options.stretch_m.powi(-2);
        right.axpy(-precision * residuals.stretch_m, &residuals.stretch, 1.0);
        normal.ger(precision, &residuals.stretch, &residuals.stretch, 1.0);
        cost += precision * residuals.stretch_m.powi(2);
        Sums { normal, right, cost, independent: residuals.counts.sum() }
    }

    /// A damped step.
    pub fn step(&self, at: &State, damping: f64) -> Option<Step> {
        at.step(&self.limits(), self.options.longest_step, damping)
    }

    /// Least and largest value of each shared unknown that is tried.
    pub fn limits(&self) -> Vec<[f64; 2]> {
        let of_numbers = self.numbers.iter().map(|n| self.options.limits_of(n));
        self.fabric_prior.ln_limits.iter().copied().chain(of_numbers).collect()
    }
}

/// Rounds in which pose, feet and the weights of outliers follow each other.
const POSE_ROUNDS: usize = 8;

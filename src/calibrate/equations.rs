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
use crate::refine::damping::damped_step;
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
pub(super) struct NormalEquations<'a> {
    pub targets: &'a [Target],
    pub fabric_prior: &'a FabricPrior,
    pub options: &'a FitOptions,
    pub numbers: &'a [&'static Number],
}

/// A cloth with its drapes, and the least squares around it.
#[derive(Clone)]
pub(super) struct State {
    /// Logarithms of stiffnesses, then effects in units of what may be expected.
    pub shared: Vec<f64>,
    pub predictions: Vec<Prediction>,
    pub poses: Vec<Pose>,
    pub residuals: Vec<Residuals>,
    /// The sums of each drape, its pose's priors in them.
    pub sums: Vec<Sums>,
    /// Sum of squared distances in standard deviations, outliers weighted down, and of the priors'.
    pub cost: f64,
    /// The data's part, and the number of independent points.
    pub data_cost: f64,
    pub independent: f64,
    /// Normal matrix of the data and the precision of the priors, right-hand side of both.
    pub normal: DMatrix<f64>,
    pub priors: DMatrix<f64>,
    pub right: DVector<f64>,
}

impl State {
    /// What each drape costs.
    pub fn costs(&self) -> Vec<f64> {
        self.sums.iter().map(|sums| sums.cost).collect()
    }

    /// Root mean square distance of an independent point in standard deviations.
    pub fn misfit(&self) -> f64 {
        (self.data_cost / self.independent).sqrt()
    }
}

/// Root mean square of the rows' distances \[m\].
pub(super) fn rms_m(rows: &[Row]) -> f64 {
    (rows.iter().map(|row| row.across_m.powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

impl NormalEquations<'_> {
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
    pub fn around(
        &self,
        shared: &[f64],
        predictions: Vec<Prediction>,
        mut poses: Vec<Pose>,
    ) -> State {
        let cloth = self.cloth(shared);
        let of = Unknowns { cloth: &cloth, numbers: self.numbers, options: self.options };
        let shared = [&cloth.ln(), &shared[STIFFNESSES..]].concat();
        let common = self.shared();
        let size = common + POSE * self.targets.len();
        let (mut normal, mut priors) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent, mut cost) = (0.0, 0.0, 0.0);
        let (mut all_residuals, mut all_sums) = (Vec::new(), Vec::new());
        for (k, (target, prediction)) in self.targets.iter().zip(&predictions).enumerate() {
            poses[k] = self.pose_of(target, prediction, poses[k], of);
            let residuals = residuals(target, prediction, &poses[k], of);
            let mut sums = self.sums_of(&residuals);
            let column = |c: usize| if c < common { c } else { c + POSE * k };
            for a in 0..common + POSE {
                right[column(a)] += sums.right[a];
                for b in 0..common + POSE {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            data_cost += sums.cost;
            independent += sums.independent;
            let prior = self.pose_prior(target, &poses[k]);
            for (m, (precision, off)) in prior.into_iter().enumerate() {
                let at = common + POSE * k + m;
                priors[(at, at)] = precision;
                right[at] -= precision * off;
                let squared = if precision < FIXED { precision * off * off } else { 0.0 };
                cost += squared;
                sums.normal[(common + m, common + m)] += precision;
                sums.right[common + m] -= precision * off;
                sums.cost += squared;
            }
            all_residuals.push(residuals);
            all_sums.push(sums);
        }
        let (precision, pull, off) = self.prior(&shared);
        priors.view_mut((0, 0), (common, common)).copy_from(&precision);
        (0..common).for_each(|k| right[k] += pull[k]);
        cost += data_cost + off;
        State {
            shared,
            predictions,
            poses,
            residuals: all_residuals,
            sums: all_sums,
            cost,
            data_cost,
            independent,
            normal,
            priors,
            right,
        }
    }

    /// Precision of the shared unknowns before any drape is seen, what draws them to what is
    /// expected, and how far they are from that in squared standard deviations.
    pub fn prior(&self, shared: &[f64]) -> (DMatrix<f64>, DVector<f64>, f64) {
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
        let pull = &precision * &off;
        let squared = off.dot(&pull);
        (precision, pull, squared)
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

    /// Precision of each number of a pose, and how far it is from what is expected.
    pub fn pose_prior(&self, target: &Target, pose: &Pose) -> [(f64, f64); POSE] {
        let (sigma, first) = (target.pose_sigma(self.options), target.first_pose());
        std::array::from_fn(|m| {
            let precision = if sigma[m] > 0.0 { sigma[m].powi(-2) } else { FIXED };
            (precision, pose[m] - first[m])
        })
    }

    /// The pose in which a drape lies closest to its outline.
    fn pose_of(
        &self,
        target: &Target,
        prediction: &Prediction,
        from: Pose,
        of: Unknowns<'_>,
    ) -> Pose {
        let alone = Unknowns { numbers: &[], ..of };
        let mut pose = from;
        for _ in 0..POSE_ROUNDS {
            let sums = self.sums_of(&residuals(target, prediction, &pose, alone));
            let own = (STIFFNESSES, STIFFNESSES);
            let mut matrix = sums.normal.view(own, (POSE, POSE)).into_owned();
            let mut right = sums.right.rows(STIFFNESSES, POSE).into_owned();
            for (m, (precision, off)) in self.pose_prior(target, &pose).into_iter().enumerate() {
                matrix[(m, m)] += precision;
                right[m] -= precision * off;
            }
            let Some(factor) = matrix.cholesky() else { break };
            let change = factor.solve(&right);
            (0..POSE).for_each(|m| pose[m] += change[m]);
            if change.amax() < 1e-7 {
                break;
            }
        }
        pose
    }

    /// The sums of a drape, its pose's priors not in them.
    pub fn sums_of(&self, residuals: &Residuals) -> Sums {
        let options = self.options;
        let mut cost = 0.0;
        let mut weighted = residuals.columns.clone();
        let known = residuals.sigma_m.iter().zip(&residuals.counts);
        for (r, (off_m, (sigma_m, counts))) in residuals.off_m.iter().zip(known).enumerate() {
            let far = off_m.abs() / sigma_m;
            let huber_weight = if far > options.outlier { options.outlier / far } else { 1.0 };
            cost += counts * far * far * huber_weight * (2.0 - huber_weight);
            let weight = counts * huber_weight / sigma_m.powi(2);
            weighted.row_mut(r).scale_mut(weight);
        }
        let mut right = weighted.tr_mul(&residuals.off_m);
        let mut normal = weighted.tr_mul(&residuals.columns);
        let precision = options.stretch_m.powi(-2);
        right.axpy(-precision * residuals.stretch_m, &residuals.stretch, 1.0);
        normal.ger(precision, &residuals.stretch, &residuals.stretch, 1.0);
        cost += precision * residuals.stretch_m.powi(2);
        Sums { normal, right, cost, independent: residuals.counts.sum() }
    }

    /// Where a damped step leads, and by how much the cost is predicted to fall.
    pub fn step(&self, at: &State, damping: f64) -> Option<(Vec<f64>, f64)> {
        let whole = &at.normal + &at.priors;
        let longest = self.options.longest_step;
        damped_step((&whole, &at.right), &at.shared, &self.limits(), damping, longest)
    }

    /// Least and largest value of each shared unknown that is tried.
    pub fn limits(&self) -> Vec<[f64; 2]> {
        let of_numbers = self.numbers.iter().map(|n| self.options.limits_of(n));
        self.fabric_prior.ln_limits.iter().copied().chain(of_numbers).collect()
    }
}

/// Precision of a number that stays what it is.
const FIXED: f64 = 1e18;

/// The sums of the least squares over one drape: shared unknowns, then its pose.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
    pub cost: f64,
    pub independent: f64,
}

/// Rounds in which pose, feet and the weights of outliers follow each other.
const POSE_ROUNDS: usize = 8;

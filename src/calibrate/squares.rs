//! The least squares around the drapes of one fabric, seen from above.
//!
//! Unknown are the logarithms of the six stiffnesses and the numbers of the effects that are looked for, which all drapes
//! share (the latter in units of what may be expected, [`Number::sigma`]), and the pose of each drape in its picture. The
//! distance of a point of the measured outline from the simulated one, across the latter, is foretold by the moves of the
//! cloth there. Neighbouring points err alike: of all points on a stretch one counts. A point more than a few standard
//! deviations off pulls no harder than one at that distance (Huber 1964).
//!
//! A drape that springs hold across its outline has one unknown more, how far outwards they pull, and one row more: that
//! they pull nowhere on the whole. Its arrangement of folds is then the measured one, and its mean extent its own.

use nalgebra::{DMatrix, DVector};

use super::believed::Believed;
use super::effect::{Acts, Cloth, Harmonic, Lies, Number, Stays, tilt_parts};
use super::trial::{Move, Trial};
use crate::base::Outline;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::refine::damping::damped_step;
use crate::sim::SimOptions;
use crate::sim::sensitivity::Parameter;

/// Numbers of a pose.
pub const POSE: usize = 7;

/// Names of the pose's numbers in files.
pub const POSE_KEYS: [&str; POSE] =
    ["offset_x", "offset_z", "rotation", "ln_scale", "specimen_x", "specimen_z", "pull"];

/// How a drape lies in its picture: the plate's axis beside the outline's centroid, x and z \[m\]; the warp's bearing, from
/// +x towards +z \[rad\]; the logarithm of the picture's scale over the one given; the specimen's centre beside the
/// plate's axis, along warp and weft \[m\]; and how far beyond the outline its springs pull \[m\].
pub type Pose = [f64; POSE];

/// What every trial's sheet is asked for: stiffnesses, the specimen's place, the springs' pull.
const ALWAYS: [Parameter; STIFFNESSES + 3] = {
    let [a, b, c, d, e, f] = Parameter::STIFFNESSES;
    [a, b, c, d, e, f, Parameter::OffsetX, Parameter::OffsetZ, Parameter::Pull]
};

/// What a trial's sheet is asked for where some effects are looked for.
pub(super) fn parameters(numbers: &[&'static Number]) -> Vec<Parameter> {
    let mut all = ALWAYS.to_vec();
    for parameter in numbers.iter().flat_map(|number| number.parameters()) {
        if !all.contains(parameter) {
            all.push(*parameter);
        }
    }
    all
}

/// How a fabric is fitted to outlines.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FitOptions {
    /// Standard deviation of a measured outline across itself: picture, settling \[m\].
    pub outline_m: f64,
    /// Standard deviation by which a drape of the true fabric lies off on its branch \[m\].
    pub model_m: f64,
    /// Length of outline over which errors are alike \[m\]: one point of it counts.
    pub alike_m: f64,
    /// Distance, in standard deviations, from which on a point pulls no harder.
    pub outlier: f64,
    /// Standard deviations of the pose's numbers, in the order of [`Pose`]. With 0 a number stays what it is.
    pub pose_sigma: Pose,
    /// Standard deviation of the warp's bearing where it is not known \[rad\].
    pub unknown_bearing: f64,
    /// How strongly a drape is held across its outline, see [`crate::sim::Hold::per_m`] \[1/m\]; with 0 it is let go.
    pub hold_per_m: f64,
    /// Standard deviation of the springs' mean stretch from none \[m\].
    pub stretch_m: f64,
    /// Most drapes of an outline.
    pub evaluations: usize,
    /// Largest change of a shared unknown in one step.
    pub longest_step: f64,
    /// The simulator's options but for the experiment's effects.
    pub sim: SimOptions,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            // captures of one drape differ by 1 to 2.4 mm, each by that over the root of two
            outline_m: 1.2e-3,
            // rims of neighbouring minima: `docs/validation.md`
            model_m: 1.0e-3,
            // a quarter of a fold of seven
            alike_m: 25e-3,
            outlier: 3.0,
            // chosen: a centroid lies a few mm from the axis, a specimen is laid to a mm, a warp is marked to 3 degrees; the
            // pull is what it must be
            pose_sigma: [4e-3, 4e-3, 0.05, 0.0, 1e-3, 1e-3, 50e-3],
            unknown_bearing: 0.5,
            // 15 % of the weight for each mm: with a twentieth single sheets still lose a fold on the way
            hold_per_m: 150.0,
            stretch_m: 0.02e-3,
            evaluations: 12,
            longest_step: 0.7,
            sim: SimOptions::default(),
        }
    }
}

/// An outline that is fitted or predicted.
#[derive(Clone, Debug)]
pub struct Target {
    /// The outline around its centroid \[m\].
    pub outline: Outline,
    /// Bearing of the warp in the picture, from +x towards +z, if it is known \[rad\].
    pub warp_rad: Option<f64>,
    /// Whether the specimen is turned over.
    pub turned_over: bool,
}

/// Even points of a measured outline.
const POINTS: usize = 240;
/// Rounds in which pose, feet and the weights of outliers follow each other.
const POSE_ROUNDS: usize = 8;

impl Target {
    /// Of an outline anywhere in its picture, face up.
    #[must_use]
    pub fn of(outline: &Outline, warp_rad: Option<f64>) -> Self {
        let [cx, cz] = outline.centroid_m();
        let outline = outline.mapped(|[x, z]| [x - cx, z - cz]);
        Self { outline, warp_rad, turned_over: false }
    }

    /// The pose before anything is fitted.
    #[must_use]
    pub fn first_pose(&self) -> Pose {
        [0.0, 0.0, self.warp_rad.unwrap_or(0.0), 0.0, 0.0, 0.0, 0.0]
    }

    /// The standard deviations of its pose.
    pub(super) fn pose_sigma(&self, options: &FitOptions) -> Pose {
        let mut sigma = options.pose_sigma;
        if self.warp_rad.is_none() {
            sigma[2] = options.unknown_bearing;
        }
        sigma
    }

    /// The outline in the plan of the simulation frame, as a pose has it.
    #[must_use]
    pub fn in_plan(&self, pose: &Pose) -> Outline {
        self.outline.mapped(|p| plan_of(p, pose))
    }

    /// How the specimen lies in a pose.
    #[must_use]
    pub fn lies(&self, pose: &Pose) -> Lies {
        Lies { face: if self.turned_over { -1.0 } else { 1.0 }, bearing_rad: pose[2] }
    }
}

/// A pose in a picture whose scale is off by a logarithm.
#[must_use]
pub fn scaled(pose: &Pose, ln_scale: f64) -> Pose {
    let mut pose = *pose;
    pose[3] += ln_scale;
    pose
}

/// A place beside the outline's centroid, in the plan of the simulation frame.
pub(super) fn plan_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose[2].sin_cos();
    let scale = (-pose[3]).exp();
    let (x, z) = (x - pose[0], z - pose[1]);
    [scale * (x * cos + z * sin), scale * (z * cos - x * sin)]
}

/// A place in the plan of the simulation frame, beside the outline's centroid in the picture.
#[must_use]
pub fn picture_of([x, z]: [f64; 2], pose: &Pose) -> [f64; 2] {
    let (sin, cos) = pose[2].sin_cos();
    let scale = pose[3].exp();
    [scale * (x * cos - z * sin) + pose[0], scale * (x * sin + z * cos) + pose[1]]
}

/// One point of a measured outline beside a drape.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Bearing of the foot on the drape about the plate's axis, from the warp towards the weft \[rad\].
    pub bearing_rad: f64,
    /// Distance of the measured outline from the drape's, across the latter, positive outwards \[m\].
    pub outwards_m: f64,
}

/// A measured outline beside a drape in a pose.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// Its points at even steps.
    pub rows: Vec<Row>,
    /// Moves of the drape's outline across itself at each point with each unknown: shared ones, then the pose \[m per
    /// unit\].
    columns: DMatrix<f64>,
    /// Mean stretch of the springs \[m\], and its change with each unknown.
    stretch_m: f64,
    stretch: DVector<f64>,
}

/// The cloth of the trials and the numbers that are unknown of it.
#[derive(Clone, Copy)]
pub(super) struct Unknowns<'a> {
    pub cloth: &'a Cloth,
    pub numbers: &'a [&'static Number],
}

/// A place on a drape's outline.
struct At<'a> {
    normal: [f64; 2],
    place: [f64; 2],
    segment: usize,
    fraction: f64,
    trial: &'a Trial,
}

impl At<'_> {
    /// How it moves across the outline.
    fn across(&self, moves: &[[f64; 2]]) -> f64 {
        let (a, b) = (moves[self.segment], moves[(self.segment + 1) % moves.len()]);
        let at = [0, 1].map(|c| a[c] + (b[c] - a[c]) * self.fraction);
        self.normal[0] * at[0] + self.normal[1] * at[1]
    }

    /// The same with a number of an effect, per unit of it.
    fn with(&self, number: &Number, lies: Lies) -> f64 {
        let moves = |p: Parameter| self.across(&self.trial.with(p).outline);
        match &number.acts {
            Acts::Scale => self.normal[0] * self.place[0] + self.normal[1] * self.place[1],
            Acts::Outline(harmonic) => harmonic.at(self.place[1].atan2(self.place[0]), lies),
            acts => on_sheet(acts, lies, moves),
        }
    }
}

/// What a number does to the sheet, of what its parameters do.
fn on_sheet(acts: &Acts, lies: Lies, of: impl Fn(Parameter) -> f64) -> f64 {
    match acts {
        Acts::Sheet(parameters) => parameters.iter().map(|&p| of(p)).sum(),
        Acts::Face(parameter) => lies.face * of(*parameter),
        Acts::Tilt(side) => {
            let [x, z] = tilt_parts(*side, lies.bearing_rad);
            x * of(Parameter::TiltX) + z * of(Parameter::TiltZ)
        }
        Acts::Scale | Acts::Outline(_) => 0.0,
    }
}

impl Harmonic {
    /// Its value at a bearing from the warp.
    fn at(&self, bearing_rad: f64, lies: Lies) -> f64 {
        let turn = if self.stays == Stays::Bench { lies.bearing_rad } else { 0.0 };
        let (sin, cos) = (f64::from(self.order) * (bearing_rad + turn)).sin_cos();
        let value = if self.sine { sin } else { cos };
        if self.stays == Stays::Face { lies.face * value } else { value }
    }
}

/// A measured outline beside a drape in a pose: the drape's outline is moved by the specimen's place and the springs' pull
/// as far as these differ from the trial's.
pub(super) fn seen(target: &Target, trial: &Trial, pose: &Pose, of: Unknowns<'_>) -> Seen {
    let own = [Parameter::OffsetX, Parameter::OffsetZ, Parameter::Pull].map(|p| trial.with(p));
    let moved = [pose[4], pose[5], pose[6] - trial.hold.pull_m];
    let points = trial.outline.points_m();
    let place = |k: usize| {
        [0, 1].map(|c| points[k][c] + (0..3).map(|m| moved[m] * own[m].outline[k][c]).sum::<f64>())
    };
    let drape = Outline::new((0..points.len()).map(place).collect());
    let drape = drape.unwrap_or_else(|_| trial.outline.clone());
    let lies = target.lies(pose);
    let posed = scaled(pose, of.cloth.ln_scale());
    let (sin, cos) = posed[2].sin_cos();
    let scale = (-posed[3]).exp();
    let values = of.cloth.fabric.in_si();
    let shared = STIFFNESSES + of.numbers.len();
    let even = target.outline.evenly(POINTS);
    let mut columns = DMatrix::zeros(POINTS, shared + POSE);
    let mut rows = Vec::with_capacity(POINTS);
    for (r, point) in even.into_iter().enumerate() {
        let foot = drape.foot(plan_of(point, &posed));
        let ([nx, nz], [x, z]) = (foot.normal, foot.at_m);
        let at = At {
            normal: foot.normal,
            place: foot.at_m,
            segment: foot.segment,
            fraction: foot.fraction,
            trial,
        };
        for (k, parameter) in Parameter::STIFFNESSES.into_iter().enumerate() {
            // d/d ln v = v d/dv
            columns[(r, k)] = values[k] * at.across(&trial.with(parameter).outline);
        }
        for (k, number) in of.numbers.iter().enumerate() {
            columns[(r, STIFFNESSES + k)] = number.sigma * at.with(number, lies);
        }
        let in_pose = [
            scale * (nx * cos - nz * sin),
            scale * (nx * sin + nz * cos),
            nz * x - nx * z,
            nx * x + nz * z,
            at.across(&own[0].outline),
            at.across(&own[1].outline),
            at.across(&own[2].outline),
        ];
        for (m, value) in in_pose.into_iter().enumerate() {
            columns[(r, shared + m)] = value;
        }
        rows.push(Row { bearing_rad: z.atan2(x), outwards_m: foot.outwards_m });
    }
    let stretched = |p: Parameter| trial.with(p).stretch_m;
    let mut stretch = DVector::zeros(shared + POSE);
    for (k, parameter) in Parameter::STIFFNESSES.into_iter().enumerate() {
        stretch[k] = values[k] * stretched(parameter);
    }
    for (k, number) in of.numbers.iter().enumerate() {
        stretch[STIFFNESSES + k] = number.sigma * on_sheet(&number.acts, lies, stretched);
    }
    let of_own = |m: &&Move| m.stretch_m;
    own.iter().map(of_own).enumerate().for_each(|(m, s)| stretch[shared + 4 + m] = s);
    let stretch_m = trial.hold.mean_m + (0..3).map(|m| moved[m] * own[m].stretch_m).sum::<f64>();
    Seen { rows, columns, stretch_m, stretch }
}

/// What the least squares are over.
pub(super) struct Squares<'a> {
    pub targets: &'a [Target],
    pub believed: &'a Believed,
    pub options: &'a FitOptions,
    pub numbers: &'a [&'static Number],
}

/// A cloth with its drapes, and the least squares around it.
#[derive(Clone)]
pub(super) struct State {
    /// Logarithms of stiffnesses, then effects in units of what may be expected.
    pub shared: Vec<f64>,
    pub trials: Vec<Trial>,
    pub poses: Vec<Pose>,
    pub seen: Vec<Seen>,
    /// The sums of each drape, its pose's priors in them.
    pub sums: Vec<Sums>,
    /// Sum of squared distances in standard deviations, outliers tamed, and of the priors'.
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
    /// Root mean square distance of an independent point in standard deviations.
    pub fn misfit(&self) -> f64 {
        (self.data_cost / self.independent).sqrt()
    }
}

/// Root mean square of the rows' distances \[m\].
pub(super) fn rms_m(rows: &[Row]) -> f64 {
    (rows.iter().map(|row| row.outwards_m.powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
}

impl Squares<'_> {
    /// Number of shared unknowns.
    pub fn shared(&self) -> usize {
        STIFFNESSES + self.numbers.len()
    }

    /// The cloth of some shared unknowns, its fabric made one that can be.
    pub fn cloth(&self, shared: &[f64]) -> Cloth {
        let ln = std::array::from_fn(|k| shared[k]);
        let fabric = Fabric::from_ln_stiffnesses(&ln, self.believed.density_kg_m2);
        let sizes = self.numbers.iter().zip(&shared[STIFFNESSES..]);
        Cloth { fabric, effects: sizes.map(|(&n, share)| (n, n.sigma * share)).collect() }
    }

    /// The least squares around some drapes of a cloth, the poses at their best from `poses` on.
    pub fn around(&self, shared: &[f64], trials: Vec<Trial>, mut poses: Vec<Pose>) -> State {
        let cloth = self.cloth(shared);
        let of = Unknowns { cloth: &cloth, numbers: self.numbers };
        // what the projection of the fabric made of the logarithms
        let shared: Vec<f64> =
            cloth.ln().into_iter().chain(shared[STIFFNESSES..].to_vec()).collect();
        let common = self.shared();
        let size = common + POSE * self.targets.len();
        let (mut normal, mut priors) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent, mut cost) = (0.0, 0.0, 0.0);
        let (mut all_seen, mut all_sums) = (Vec::new(), Vec::new());
        for (k, (target, trial)) in self.targets.iter().zip(&trials).enumerate() {
            poses[k] = self.pose_of(target, trial, poses[k], of);
            let seen = seen(target, trial, &poses[k], of);
            let mut sums = self.sums_of(target, &seen);
            let column = |c: usize| if c < common { c } else { c + POSE * k };
            for a in 0..common + POSE {
                right[column(a)] += sums.right[a];
                for b in 0..common + POSE {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            data_cost += sums.cost;
            independent += sums.independent;
            for (m, (precision, off)) in self.pose_prior(target, &poses[k]).into_iter().enumerate()
            {
                let at = common + POSE * k + m;
                priors[(at, at)] = precision;
                right[at] -= precision * off;
                let squared = if precision < FIXED { precision * off * off } else { 0.0 };
                cost += squared;
                sums.normal[(common + m, common + m)] += precision;
                sums.right[common + m] -= precision * off;
                sums.cost += squared;
            }
            all_seen.push(seen);
            all_sums.push(sums);
        }
        let (precision, pull, off) = self.prior(&shared);
        priors.view_mut((0, 0), (common, common)).copy_from(&precision);
        (0..common).for_each(|k| right[k] += pull[k]);
        cost += data_cost + off;
        State {
            shared,
            trials,
            poses,
            seen: all_seen,
            sums: all_sums,
            cost,
            data_cost,
            independent,
            normal,
            priors,
            right,
        }
    }

    /// Precision of the shared unknowns before any drape is seen, what draws them to what is expected, and how far they
    /// are from that in squared standard deviations.
    pub fn prior(&self, shared: &[f64]) -> (DMatrix<f64>, DVector<f64>, f64) {
        let common = self.shared();
        let mut precision = DMatrix::identity(common, common);
        if let Some(of_fabric) = self.believed.covariance.try_inverse() {
            precision.view_mut((0, 0), (STIFFNESSES, STIFFNESSES)).copy_from(&of_fabric);
        }
        let expected = |k: usize| if k < STIFFNESSES { self.believed.ln_mean[k] } else { 0.0 };
        let off = DVector::from_fn(common, |k, _| expected(k) - shared[k]);
        let pull = &precision * &off;
        let squared = off.dot(&pull);
        (precision, pull, squared)
    }

    /// Precision of each number of a pose, and how far it is from what is expected.
    fn pose_prior(&self, target: &Target, pose: &Pose) -> [(f64, f64); POSE] {
        let (sigma, first) = (target.pose_sigma(self.options), target.first_pose());
        std::array::from_fn(|m| {
            let precision = if sigma[m] > 0.0 { sigma[m].powi(-2) } else { FIXED };
            (precision, pose[m] - first[m])
        })
    }

    /// The pose in which a drape lies closest to its outline.
    fn pose_of(&self, target: &Target, trial: &Trial, from: Pose, of: Unknowns<'_>) -> Pose {
        let alone = Unknowns { numbers: &[], ..of };
        let mut pose = from;
        for _ in 0..POSE_ROUNDS {
            let sums = self.sums_of(target, &seen(target, trial, &pose, alone));
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

    fn sums_of(&self, target: &Target, seen: &Seen) -> Sums {
        let options = self.options;
        let sigma_m = options.outline_m.hypot(options.model_m);
        let count = seen.rows.len();
        let step_m = target.outline.length_m() / count as f64;
        let counts = (step_m / options.alike_m).min(1.0);
        let mut cost = 0.0;
        let mut weighted = seen.columns.clone();
        let mut off = DVector::zeros(count);
        for (r, row) in seen.rows.iter().enumerate() {
            let far = row.outwards_m.abs() / sigma_m;
            let tamed = if far > options.outlier { options.outlier / far } else { 1.0 };
            cost += counts * far * far * tamed * (2.0 - tamed);
            let weight = counts * tamed / (sigma_m * sigma_m);
            weighted.row_mut(r).scale_mut(weight);
            off[r] = row.outwards_m;
        }
        let mut right = weighted.tr_mul(&off);
        let mut normal = weighted.tr_mul(&seen.columns);
        let precision = options.stretch_m.powi(-2);
        right.axpy(-precision * seen.stretch_m, &seen.stretch, 1.0);
        normal.ger(precision, &seen.stretch, &seen.stretch, 1.0);
        cost += precision * seen.stretch_m.powi(2);
        Sums { normal, right, cost, independent: counts * count as f64 }
    }

    /// Where a damped step leads, and by how much the cost is foretold to fall.
    pub fn step(&self, at: &State, damping: f64) -> Option<(Vec<f64>, f64)> {
        let whole = &at.normal + &at.priors;
        let of_numbers = self.numbers.iter().map(|n| n.limits.map(|limit| limit / n.sigma));
        let limits: Vec<[f64; 2]> =
            self.believed.ln_limits.iter().copied().chain(of_numbers).collect();
        let longest = self.options.longest_step;
        damped_step((&whole, &at.right), &at.shared, &limits, damping, longest)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_maps_there_and_back() {
        let pose = [2e-3, -1e-3, 0.4, 0.02, 0.0, 0.0, 0.0];
        let p = [0.11, -0.03];
        let back = plan_of(picture_of(p, &pose), &pose);
        assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-15);
        // the warp's bearing in the picture is the rotation
        let [x, z] = picture_of([0.1, 0.0], &[0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0]);
        assert!((z.atan2(x) - 0.4).abs() < 1e-12);
    }
}

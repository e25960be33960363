//! The least squares around the drapes of one fabric, seen from above.
//!
//! Unknown are the logarithms of the six stiffnesses, which all drapes share, and the pose of each drape in its
//! picture. The distance of a point of the measured outline from the simulated one, across the latter, is foretold by the
//! moves of the cloth there. Neighbouring points err alike: of all points on a stretch one counts. A point more
//! than a few standard deviations off pulls no harder than one at that distance (Huber 1964).

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::believed::Believed;
use super::trial::Trial;
use crate::base::Outline;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::refine::damping::damped_step;
use crate::sim::SimOptions;
use crate::sim::sensitivity::Parameter;

/// Numbers of a pose.
pub const POSE: usize = 6;

/// Names of the pose's numbers in files.
pub const POSE_KEYS: [&str; POSE] =
    ["offset_x", "offset_z", "rotation", "ln_scale", "specimen_x", "specimen_z"];

/// How a drape lies in its picture: the plate's axis beside the outline's centroid, x and z \[m\]; the warp's bearing, from
/// +x towards +z \[rad\]; the logarithm of the picture's scale over the one given; the specimen's centre beside the
/// plate's axis, along warp and weft \[m\].
pub type Pose = [f64; POSE];

/// What a trial's sheet is asked for, in the order of its moves: stiffnesses, then the specimen's place.
pub(super) const PARAMETERS: [Parameter; STIFFNESSES + 2] = {
    let [a, b, c, d, e, f] = Parameter::STIFFNESSES;
    [a, b, c, d, e, f, Parameter::OffsetX, Parameter::OffsetZ]
};

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
    /// Most drapes of an outline.
    pub evaluations: usize,
    /// Largest change of a logarithm in one step.
    pub longest_step: f64,
    /// The simulator's options but for the experiment.
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
            // chosen: a centroid lies a few mm from the axis, a specimen is laid to a mm, a warp is marked to 3 degrees
            pose_sigma: [4e-3, 4e-3, 0.05, 0.0, 1e-3, 1e-3],
            unknown_bearing: 0.5,
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
}

/// Even points of a measured outline.
const POINTS: usize = 240;
/// Rounds in which pose, feet and the weights of outliers follow each other.
const POSE_ROUNDS: usize = 8;

impl Target {
    /// Of an outline anywhere in its picture.
    #[must_use]
    pub fn of(outline: &Outline, warp_rad: Option<f64>) -> Self {
        let [cx, cz] = outline.centroid_m();
        let outline = outline.mapped(|[x, z]| [x - cx, z - cz]);
        Self { outline, warp_rad }
    }

    /// The pose before anything is fitted.
    #[must_use]
    pub fn first_pose(&self) -> Pose {
        [0.0, 0.0, self.warp_rad.unwrap_or(0.0), 0.0, 0.0, 0.0]
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

/// Columns of one drape: stiffnesses, then the pose.
pub(super) const COLUMNS: usize = STIFFNESSES + POSE;

/// One point of a measured outline beside a drape.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Bearing of the foot on the drape about the plate's axis, from the warp towards the weft \[rad\].
    pub bearing_rad: f64,
    /// Distance of the measured outline from the drape's, across the latter, positive outwards \[m\].
    pub outwards_m: f64,
    /// Segment of the drape's outline and fraction along it.
    pub foot: (usize, f64),
    /// Unit vector across the drape's outline, outwards, in the plan.
    pub normal: [f64; 2],
    /// Moves of the drape's outline across itself with each column's unknown \[m per unit\].
    pub(super) columns: [f64; COLUMNS],
}

/// The rows of a drape in a pose: its outline moved by the specimen's place, and the feet on it.
pub(super) fn rows_of(target: &Target, trial: &Trial, pose: &Pose, values: &[f64; 7]) -> Vec<Row> {
    let points = trial.outline.points_m();
    let moved = |k: usize| {
        [0, 1].map(|c| {
            points[k][c]
                + pose[4] * trial.moves[STIFFNESSES][k][c]
                + pose[5] * trial.moves[STIFFNESSES + 1][k][c]
        })
    };
    let drape = Outline::new((0..points.len()).map(moved).collect());
    let drape = drape.unwrap_or_else(|_| trial.outline.clone());
    let (sin, cos) = pose[2].sin_cos();
    let scale = (-pose[3]).exp();
    let row = |place: [f64; 2]| {
        let foot = drape.foot(plan_of(place, pose));
        let [nx, nz] = foot.normal;
        let next = (foot.segment + 1) % points.len();
        let across = |moves: &[[f64; 2]]| {
            let (a, b) = (moves[foot.segment], moves[next]);
            let at = [0, 1].map(|c| a[c] + (b[c] - a[c]) * foot.fraction);
            nx * at[0] + nz * at[1]
        };
        let [x, z] = foot.at_m;
        let mut columns = [0.0; COLUMNS];
        for k in 0..STIFFNESSES {
            // d/d ln v = v d/dv
            columns[k] = values[k] * across(&trial.moves[k]);
        }
        let pose_columns = [
            scale * (nx * cos - nz * sin),
            scale * (nx * sin + nz * cos),
            nz * x - nx * z,
            nx * x + nz * z,
            across(&trial.moves[STIFFNESSES]),
            across(&trial.moves[STIFFNESSES + 1]),
        ];
        columns[STIFFNESSES..].copy_from_slice(&pose_columns);
        Row {
            bearing_rad: z.atan2(x),
            outwards_m: foot.outwards_m,
            foot: (foot.segment, foot.fraction),
            normal: foot.normal,
            columns,
        }
    };
    target.outline.evenly(POINTS).into_iter().map(row).collect()
}

/// What the least squares are over.
pub(super) struct Squares<'a> {
    pub targets: &'a [Target],
    pub believed: &'a Believed,
    pub options: &'a FitOptions,
}

/// A fabric with its drapes, and the least squares around it.
pub(super) struct State {
    pub ln: [f64; STIFFNESSES],
    pub trials: Vec<Trial>,
    pub poses: Vec<Pose>,
    pub rows: Vec<Vec<Row>>,
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
    /// The fabric of six logarithms, made one that can be.
    pub fn fabric(&self, ln: &[f64; STIFFNESSES]) -> Fabric {
        Fabric::from_ln_stiffnesses(ln, self.believed.density_kg_m2)
    }

    /// The least squares around some drapes, the poses at their best from `poses` on.
    pub fn around(&self, fabric: &Fabric, trials: Vec<Trial>, mut poses: Vec<Pose>) -> State {
        let values = fabric.in_si();
        let [ln @ .., _] = values.map(f64::ln);
        let size = STIFFNESSES + POSE * self.targets.len();
        let (mut normal, mut priors) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent, mut cost) = (0.0, 0.0, 0.0);
        let mut all_rows = Vec::new();
        for (k, (target, trial)) in self.targets.iter().zip(&trials).enumerate() {
            poses[k] = self.pose_of(target, trial, poses[k], &values);
            let rows = rows_of(target, trial, &poses[k], &values);
            let sums = self.sums_of(target, &rows);
            let column = |c: usize| if c < STIFFNESSES { c } else { c + POSE * k };
            for a in 0..COLUMNS {
                right[column(a)] += sums.right[a];
                for b in 0..COLUMNS {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            data_cost += sums.cost;
            independent += sums.independent;
            for (m, (precision, off)) in self.pose_prior(target, &poses[k]).into_iter().enumerate()
            {
                let at = STIFFNESSES + POSE * k + m;
                priors[(at, at)] = precision;
                right[at] -= precision * off;
                cost += if precision < FIXED { precision * off * off } else { 0.0 };
            }
            all_rows.push(rows);
        }
        let precision = self.believed.covariance.try_inverse().unwrap_or_else(SMatrix::identity);
        let off = self.believed.ln_mean - SVector::from(ln);
        let pull = precision * off;
        priors.view_mut((0, 0), (STIFFNESSES, STIFFNESSES)).copy_from(&precision);
        (0..STIFFNESSES).for_each(|k| right[k] += pull[k]);
        cost += data_cost + off.dot(&pull);
        State {
            ln,
            trials,
            poses,
            rows: all_rows,
            cost,
            data_cost,
            independent,
            normal,
            priors,
            right,
        }
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
    fn pose_of(&self, target: &Target, trial: &Trial, from: Pose, values: &[f64; 7]) -> Pose {
        let mut pose = from;
        for _ in 0..POSE_ROUNDS {
            let sums = self.sums_of(target, &rows_of(target, trial, &pose, values));
            let mut matrix: SMatrix<f64, POSE, POSE> =
                sums.normal.fixed_view::<POSE, POSE>(STIFFNESSES, STIFFNESSES).into_owned();
            let mut right: SVector<f64, POSE> =
                sums.right.fixed_rows::<POSE>(STIFFNESSES).into_owned();
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

    fn sums_of(&self, target: &Target, rows: &[Row]) -> Sums {
        let options = self.options;
        let sigma_m = options.outline_m.hypot(options.model_m);
        let step_m = target.outline.length_m() / rows.len() as f64;
        let counts = (step_m / options.alike_m).min(1.0);
        let mut sums = Sums {
            normal: SMatrix::zeros(),
            right: SVector::zeros(),
            cost: 0.0,
            independent: counts * rows.len() as f64,
        };
        for row in rows {
            let far = row.outwards_m.abs() / sigma_m;
            let tamed = if far > options.outlier { options.outlier / far } else { 1.0 };
            sums.cost += counts * far * far * tamed * (2.0 - tamed);
            let weight = counts * tamed / (sigma_m * sigma_m);
            let columns = SVector::from(row.columns);
            sums.right += columns * (weight * row.outwards_m);
            sums.normal += columns * columns.transpose() * weight;
        }
        sums
    }

    /// Where a damped step leads, and by how much the cost is foretold to fall.
    pub fn step(&self, at: &State, damping: f64) -> Option<([f64; STIFFNESSES], f64)> {
        let whole = &at.normal + &at.priors;
        let longest = self.options.longest_step;
        damped_step((&whole, &at.right), &at.ln, &self.believed.ln_limits, damping, longest)
    }
}

/// Precision of a number that stays what it is.
const FIXED: f64 = 1e18;

/// The sums of the least squares over one drape's rows.
struct Sums {
    normal: SMatrix<f64, COLUMNS, COLUMNS>,
    right: SVector<f64, COLUMNS>,
    cost: f64,
    independent: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_maps_there_and_back() {
        let pose = [2e-3, -1e-3, 0.4, 0.02, 0.0, 0.0];
        let p = [0.11, -0.03];
        let back = plan_of(picture_of(p, &pose), &pose);
        assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-15);
        // the warp's bearing in the picture is the rotation
        let [x, z] = picture_of([0.1, 0.0], &[0.0, 0.0, 0.4, 0.0, 0.0, 0.0]);
        assert!((z.atan2(x) - 0.4).abs() < 1e-12);
    }
}

//! What remains of a case's effects once six stiffnesses and the drapes' poses have taken up what
//! they can.
//!
//! In: for each drape how the effects move what is measured of it, and how the six stiffnesses and
//! a pose do, all of them at the drape itself, on its own cells ([`Moved`]). Out: the root mean
//! square move that remains of each drape. The stiffnesses are shared by the drapes, the poses are
//! not; both are weighed as a fit weighs them ([`FitOptions`]). What remains is what a calibration
//! can see of the effects.
//!
//! Where it fails: all of it is linear, and an effect of several millimetres is not.

use nalgebra::{DMatrix, DVector};

use scan2params::base::boundary::POINTS;
use scan2params::base::{Outline, Surface, Vector3};
use scan2params::calibrate::manifest::Bench;
use scan2params::calibrate::options::FitOptions;
use scan2params::calibrate::prediction::{
    Compared, Move, Prediction, STRIDE, compared, prediction_of,
};
use scan2params::fabric::STIFFNESSES;
use scan2params::numeric::moments::mean;
use scan2params::sim::sensitivity::Parameter;
use scan2params::sim::{Drape, Follower};

/// How a drape's measured places move: with the effects, with the logarithm of each stiffness and
/// with each number of its pose.
pub(super) struct Moved {
    /// Moves by the effects, one a place and direction \[m\].
    pub effects_m: DVector<f64>,
    /// Precision of each, neighbours counted in \[1/m^2\].
    pub weights: DVector<f64>,
    /// Moves by the stiffnesses, then by the pose \[m per unit\].
    pub columns: DMatrix<f64>,
    /// Standard deviations of the pose's numbers.
    pub pose_sigma: Vec<f64>,
    /// The first of the moves, of which the size is taken, and the number of points that they are
    /// of.
    pub shown: [usize; 2],
}

/// Standard deviation of a stiffness's logarithm: what changes by more is no linear matter.
const LN_SIGMA: f64 = 1.0;

/// The root mean square move that is left of each drape \[m\]; `None` where the sums have no
/// solution.
pub(super) fn remaining_m(drapes: &[&Moved]) -> Option<Vec<f64>> {
    let size = STIFFNESSES + drapes.iter().map(|d| d.pose_sigma.len()).sum::<usize>();
    let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for k in 0..STIFFNESSES {
        normal[(k, k)] = LN_SIGMA.powi(-2);
    }
    let mut first = STIFFNESSES;
    for drape in drapes {
        let own = drape.weighted();
        let (matrix, pulls) = (own.tr_mul(&drape.columns), own.tr_mul(&drape.effects_m));
        let at = |k: usize| if k < STIFFNESSES { k } else { first + k - STIFFNESSES };
        for a in 0..pulls.len() {
            right[at(a)] += pulls[a];
            (0..pulls.len()).for_each(|b| normal[(at(a), at(b))] += matrix[(a, b)]);
        }
        for (m, sigma) in drape.pose_sigma.iter().enumerate() {
            normal[(first + m, first + m)] += sigma.powi(-2);
        }
        first += drape.pose_sigma.len();
    }
    let change = normal.cholesky()?.solve(&right);
    let mut first = STIFFNESSES;
    let left = drapes.iter().map(|drape| {
        let poses = drape.pose_sigma.len();
        let own = DVector::from_iterator(
            STIFFNESSES + poses,
            change.rows(0, STIFFNESSES).iter().chain(change.rows(first, poses).iter()).copied(),
        );
        first += poses;
        let [rows, points] = drape.shown;
        let left = &drape.effects_m - &drape.columns * own;
        (left.rows(0, rows).norm_squared() / points as f64).sqrt()
    });
    Some(left.collect())
}

impl Moved {
    fn weighted(&self) -> DMatrix<f64> {
        let mut weighted = self.columns.clone();
        weighted.row_iter_mut().zip(&self.weights).for_each(|(mut row, weight)| row *= *weight);
        weighted
    }
}

/// A drape with the moves of what is measured of it; `None` where it has no sensitivities.
pub(super) fn at_rest(follower: &mut Follower, bench: Bench) -> Option<Prediction> {
    let asked: Vec<_> = Parameter::STIFFNESSES.into_iter().chain(PLACED).collect();
    let compared = if bench == Bench::Square { Compared::Sheet } else { Compared::Rim };
    prediction_of(follower, &asked, compared).ok()
}

/// What moves a specimen on its plate.
const PLACED: [Parameter; 2] = [Parameter::OffsetX, Parameter::OffsetZ];

/// How a scanned drape moves, `by` being the moves of its vertices by the effects.
pub(super) fn of_scan(
    prediction: &Prediction,
    by: &[Vector3],
    ln: &[f64],
    options: &FitOptions,
) -> Moved {
    let drape = &prediction.drape;
    let rim: Vec<Vector3> = drape.grid.boundary(by).positions_m().map(|p| p.coords).collect();
    let places = places(drape, by);
    let (rim_step_m, sheet_step_m) =
        (mean_step_m(&prediction.rim), sheet_step_m(&prediction.places));
    let across =
        options.scan_model_m.powi(-2) * (rim_step_m / options.correlation_length_m).min(1.0);
    let along = across / (1.0 + (options.along_m / options.scan_model_m).powi(2));
    let within = options.scan_model_m.powi(-2)
        * (sheet_step_m / options.correlation_length_m).min(1.0).powi(2);
    let mut rows: Vec<Placed> = Vec::new();
    for index in 0..POINTS {
        let next =
            prediction.rim[(index + 1) % POINTS] - prediction.rim[(index + POINTS - 1) % POINTS];
        for (k, normal) in triad(&next).into_iter().enumerate() {
            let weight = if k == 0 { along } else { across };
            let (at, moves) = (prediction.rim[index], rim[index]);
            rows.push(Placed { on: On::Rim(index), normal, at, by_m: normal.dot(&moves), weight });
        }
    }
    let shown = [rows.len(), POINTS];
    for (index, moves) in places.iter().enumerate() {
        let Some(normal) = sheet_normal(&prediction.places, index) else { continue };
        let (on, at) = (On::Sheet(index), prediction.places[index]);
        rows.push(Placed { on, normal, at, by_m: normal.dot(moves), weight: within });
    }
    let s = options.scan_pose_sigma;
    let ([x, z], [warp, weft], [lean_x, lean_z]) = (s.offset_m, s.specimen_m, s.lean_rad);
    let sigma = [x, z, s.rotation_rad, warp, weft, s.height_m, lean_x, lean_z];
    moved(prediction, &rows, ln, shown, &sigma)
}

/// How the outline of a drape moves that is seen from above; `by_m` are the moves of its points
/// across it by the effects.
pub(super) fn of_outline(
    prediction: &Prediction,
    by_m: &[f64],
    ln: &[f64],
    options: &FitOptions,
) -> Moved {
    let points = prediction.outline.points_m();
    let count = points.len();
    let alike =
        (prediction.outline.length_m() / count as f64 / options.correlation_length_m).min(1.0);
    let weight = alike / (options.outline_m.powi(2) + options.model_m.powi(2));
    let row = |(index, by_m): (usize, &f64)| {
        let normal = outline_normal(&prediction.outline, index);
        let [x, z] = points[index];
        let at = Vector3::new(x, 0.0, z);
        Placed { on: On::Outline(index), normal, at, by_m: *by_m, weight }
    };
    let rows: Vec<Placed> = by_m.iter().enumerate().map(row).collect();
    let s = options.pose_sigma;
    let ([x, z], [warp, weft]) = (s.offset_m, s.specimen_m);
    moved(prediction, &rows, ln, [count, count], &[x, z, s.rotation_rad, warp, weft])
}

/// A measured place and a direction.
struct Placed {
    on: On,
    normal: Vector3,
    at: Vector3,
    /// Move by the effects \[m\].
    by_m: f64,
    weight: f64,
}

#[derive(Clone, Copy)]
enum On {
    Rim(usize),
    Sheet(usize),
    Outline(usize),
}

impl Placed {
    fn across(&self, move_: &Move) -> f64 {
        match self.on {
            On::Rim(index) => self.normal.dot(&move_.rim[index]),
            On::Sheet(index) => self.normal.dot(&move_.places[index]),
            On::Outline(index) => {
                let [x, z] = move_.outline[index];
                self.normal.x * x + self.normal.z * z
            }
        }
    }
}

/// The columns of some places; the pose's numbers are shift x and z, rotation, the specimen's place
/// along warp and weft, and of a scan height and leans.
fn moved(
    prediction: &Prediction,
    rows: &[Placed],
    ln: &[f64],
    shown: [usize; 2],
    pose_sigma: &[f64],
) -> Moved {
    let of = |parameter: Parameter| prediction.moves.iter().find(|m| m.parameter == parameter);
    let mut columns = DMatrix::zeros(rows.len(), STIFFNESSES + pose_sigma.len());
    for (r, row) in rows.iter().enumerate() {
        for (k, parameter) in Parameter::STIFFNESSES.into_iter().enumerate() {
            // d/d ln v = v d/dv
            columns[(r, k)] = of(parameter).map_or(0.0, |m| ln[k].exp() * row.across(m));
        }
        let (n, at) = (row.normal, row.at);
        let [warp, weft] = PLACED.map(|p| of(p).map_or(0.0, |m| row.across(m)));
        let leans = [n.x * at.y - n.y * at.x, n.z * at.y - n.y * at.z];
        let all = [n.x, n.z, n.z * at.x - n.x * at.z, warp, weft, n.y, leans[0], leans[1]];
        all.iter().take(pose_sigma.len()).enumerate().for_each(|(m, value)| {
            columns[(r, STIFFNESSES + m)] = *value;
        });
    }
    Moved {
        effects_m: DVector::from_iterator(rows.len(), rows.iter().map(|row| row.by_m)),
        weights: DVector::from_iterator(rows.len(), rows.iter().map(|row| row.weight)),
        columns,
        pose_sigma: pose_sigma.to_vec(),
        shown,
    }
}

/// A field on the vertices at the places of a sheet that are compared.
fn places(drape: &Drape, field: &[Vector3]) -> Vec<Vector3> {
    let all = drape.grid.evenly(Surface::SIDE).prolong(&drape.grid, field, 1.0);
    compared().map(|[i, j]| all[i * Surface::SIDE + j]).collect()
}

/// Places of a side that are compared.
const ACROSS: usize = (Surface::SIDE - 2) / STRIDE;

/// The direction across the sheet at a place, from its neighbours among those that are compared.
fn sheet_normal(places: &[Vector3], index: usize) -> Option<Vector3> {
    let [i, j] = [index / ACROSS, index % ACROSS];
    let at = |i: usize, j: usize| places[i * ACROSS + j];
    let ends = |k: usize| [k.saturating_sub(1), (k + 1).min(ACROSS - 1)];
    let ([i0, i1], [j0, j1]) = (ends(i), ends(j));
    (at(i1, j) - at(i0, j)).cross(&(at(i, j1) - at(i, j0))).try_normalize(0.0)
}

/// Mean distance of neighbouring places of a sheet \[m\].
fn sheet_step_m(places: &[Vector3]) -> f64 {
    let rows = places.chunks(ACROSS).flat_map(|row| row.windows(2));
    mean(&rows.map(|pair| (pair[1] - pair[0]).norm()).collect::<Vec<_>>())
}

fn outline_normal(outline: &Outline, index: usize) -> Vector3 {
    let points = outline.points_m();
    let (a, b) =
        (points[(index + points.len() - 1) % points.len()], points[(index + 1) % points.len()]);
    // the curve runs anticlockwise: outside lies to the right of its direction
    let normal = Vector3::new(b[1] - a[1], 0.0, a[0] - b[0]);
    normal.try_normalize(0.0).unwrap_or_else(Vector3::x)
}

/// Along a rim, and two directions across it.
fn triad(next: &Vector3) -> [Vector3; 3] {
    let along = next.try_normalize(0.0).unwrap_or_else(Vector3::x);
    let other = if along.y.abs() < 0.7 { Vector3::y() } else { Vector3::x() };
    let across = along.cross(&other).normalize();
    [along, across, along.cross(&across)]
}

fn mean_step_m(points: &[Vector3]) -> f64 {
    let step = |k: usize| (points[(k + 1) % points.len()] - points[k]).norm();
    (0..points.len()).map(step).sum::<f64>() / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::fabric::Fabric;
    use scan2params::sim::{Drop, DropStart, SimOptions};

    /// The moves of a scanned drape of 31 x 31 vertices, by nothing.
    fn still() -> Moved {
        let fabric = Fabric::from_paper_units([3e5, 4e5, 1.5e5, 2.2e4, 3.4e4, 2.6e4, 190.0]);
        let sim = SimOptions { vertices: 31, ..SimOptions::default() };
        let drop = Drop { start: DropStart::Perturbed(3) };
        let mut follower = Follower::drop(&fabric, &drop, &sim);
        let prediction = at_rest(&mut follower, Bench::Square).unwrap();
        let nothing = vec![Vector3::zeros(); prediction.drape.positions_m.len()];
        let ln = fabric.in_si().map(f64::ln);
        of_scan(&prediction, &nothing, &ln[..STIFFNESSES], &FitOptions::default())
    }

    fn size_m(moved: &Moved) -> f64 {
        let [rows, points] = moved.shown;
        (moved.effects_m.rows(0, rows).norm_squared() / points as f64).sqrt()
    }

    #[test]
    fn an_effect_that_moves_as_a_stiffness_does_leaves_nothing_and_one_across_all_stays_what_it_is()
    {
        let mut moved = still();
        // stretch is hardly seen of a drape; a third off in bending along the weft, and laid 0.2 mm
        // aside
        moved.effects_m =
            moved.columns.column(3) * 0.3 + moved.columns.column(STIFFNESSES) * 0.2e-3;
        let size = size_m(&moved);
        let left = remaining_m(&[&moved]).unwrap()[0];
        assert!(size > 0.5e-3 && left < 0.03 * size, "{left:e} of {size:e}");
        // what is across all that stiffnesses and poses do, as the data weigh it
        let count = moved.effects_m.len();
        let any = DVector::from_fn(count, |k, _| 1e-3 * (0.7 * k as f64).sin());
        let own = moved.weighted();
        let normal = own.tr_mul(&moved.columns);
        let taken = normal.clone().cholesky().unwrap().solve(&own.tr_mul(&any));
        moved.effects_m = &any - &moved.columns * taken;
        let size = size_m(&moved);
        let left = remaining_m(&[&moved]).unwrap()[0];
        assert!((left / size - 1.0).abs() < 1e-6, "{left:e} of {size:e}");
    }

    #[test]
    fn what_two_drapes_share_takes_up_what_they_have_in_common_alone() {
        let (mut one, mut other) = (still(), still());
        one.effects_m = one.columns.column(3) * 0.3;
        other.effects_m = other.columns.column(3) * -0.3;
        let size = size_m(&one);
        // one drape alone is a stiffness; the two of them ask for opposite ones
        assert!(remaining_m(&[&one]).unwrap()[0] < 0.03 * size);
        for left in remaining_m(&[&one, &other]).unwrap() {
            assert!(left > 0.5 * size, "{left:e} of {size:e}");
        }
    }
}

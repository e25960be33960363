//! The promise of the scan path, measured: rim error, stated sigma and refusals of
//! virtual scans of drapes with known truth, for `scan2params-lab scan`.
//!
//! In: drapes (mesh and true rim), [`Setup`]s (sensor, poses, stand), seeds. Out: one
//! [`Case`] each, and a [`Summary`] of many. A refusal is a case too.

use std::time::Instant;

use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

pub use super::setup::{Setup, SetupError};
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Boundary, Point3, Surface, Vector3};
use scan2params::geom::Mesh;
use scan2params::numeric::robust;
use scan2params::picture::draw::{dot, line};
use scan2params::scan::{
    ScanError, ScanOptions, ScannedBoundary, Tuning, WarpToward, boundary_from_scan,
};
use scan2params::sensor::VirtualScan;

/// Shares of a normal distribution within [`INTERVAL_SIGMAS`].
pub const INTERVALS: [f64; 2] = [0.68, 0.95];
/// Half widths of those intervals, in sigma.
pub const INTERVAL_SIGMAS: [f64; 2] = [0.9945, 1.9600];
/// A rim point this far off, not refused, is a silent error \[m\].
pub const SILENT_ERROR_M: f64 = 5e-3;

/// Finds the rim in a virtual scan, told where the warp points, with these constants.
///
/// # Errors
/// When the scan is refused.
pub fn find(made: &VirtualScan, tuning: &Tuning) -> Result<ScannedBoundary, ScanError> {
    let warp = made.truth.simulation_from_scanner.inverse() * Vector3::x();
    let options = ScanOptions {
        warp_toward: Some(WarpToward::Direction(warp.into())),
        tuning: tuning.clone(),
        ..ScanOptions::default()
    };
    boundary_from_scan(&made.cloud, &options)
}

/// What became of one scan.
#[derive(Clone, Debug)]
pub struct Case {
    /// The rim's error, or why there is none.
    pub answer: Result<RimError, ScanError>,
    /// Wall time of the scan path \[s\].
    pub seconds: f64,
}

/// The error of one rim.
#[derive(Clone, Debug)]
pub struct RimError {
    /// Mean distance of corresponding points \[m\].
    pub mean_m: f64,
    /// Largest distance \[m\].
    pub largest_m: f64,
    /// Mean distance after the rigid motion that fits best \[m\].
    pub without_motion_m: f64,
    /// That motion: shift of the rim's middle \[m\].
    pub shift_m: f64,
    /// And rotation about the vertical \[rad\].
    pub yaw_rad: f64,
    /// Mean error of the observed points across the free edge, along the cloth;
    /// outward is positive \[m\].
    pub edge_bias_m: f64,
    /// |error| / sigma of each coordinate of each point.
    pub scores: Vec<f64>,
    /// Share of the points observed.
    pub observed: f64,
}

/// Runs one case.
#[must_use]
pub fn case(made: &VirtualScan, drape: &Mesh, truth: &Boundary, tuning: &Tuning) -> Case {
    let before = Instant::now();
    let found = find(made, tuning);
    let seconds = before.elapsed().as_secs_f64();
    Case { answer: found.map(|found| rim_error(&found, drape, truth)), seconds }
}

/// How far a rim lies from the true one and says that it does, root mean squares of a coordinate
/// \[mm\].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RimOff {
    /// The error.
    pub off_mm: f64,
    /// The same but for the rigid motion that fits it best, which moves no answer.
    pub deformed_mm: f64,
    /// What the rim says of it.
    pub sigma_mm: f64,
}

impl RimOff {
    /// Of a rim and the truth.
    #[must_use]
    pub fn of(found: &Boundary, truth: &Boundary) -> Self {
        let errors = errors(found, truth);
        let (_, left) = without_motion(truth, &errors);
        let rms_mm = |squares: f64| (squares / (3 * errors.len()) as f64).sqrt() / M_PER_MM;
        let square = |all: &[Vector3]| all.iter().map(Vector3::norm_squared).sum();
        Self {
            off_mm: rms_mm(square(&errors)),
            deformed_mm: rms_mm(square(&left)),
            sigma_mm: rms_mm(found.points().iter().map(|p| 3.0 * p.sigma_m.powi(2)).sum()),
        }
    }

    /// The mean; none of none.
    #[must_use]
    pub fn mean(all: &[Self]) -> Option<Self> {
        let of = |part: fn(&Self) -> f64| mean(all.iter().map(part));
        (!all.is_empty()).then(|| Self {
            off_mm: of(|rim| rim.off_mm),
            deformed_mm: of(|rim| rim.deformed_mm),
            sigma_mm: of(|rim| rim.sigma_mm),
        })
    }
}

/// How far a sheet lies from the true one across the cloth where it was observed, but for the rigid
/// motion that fits it best, and what it says of that: root mean squares \[mm\].
#[must_use]
pub fn sheet_off_and_sigma_mm(found: &Surface, truth: &Mesh) -> [f64; 2] {
    let Ok(truth) = Surface::exact(truth.vertices.iter().copied()) else { return [f64::NAN; 2] };
    let step = 1.0 / (found.side() - 1) as f64;
    let slope = |[i, j]: [f64; 2], [di, dj]: [f64; 2]| {
        let at = |sign: f64| truth.at([i + sign * di, j + sign * dj]).position_m;
        at(1.0) - at(-1.0)
    };
    // what a shift and a small rotation move across the cloth, the error, and sigma
    let rows = found.points().iter().enumerate().filter(|(_, p)| p.observed).map(|(k, p)| {
        let at = [k / found.side(), k % found.side()].map(|k| k as f64 * step);
        let across = slope(at, [step, 0.0]).cross(&slope(at, [0.0, step])).normalize();
        let place = truth.at(at).position_m;
        let turned = place.coords.cross(&across);
        let row = Vector6::from_iterator(across.iter().chain(turned.iter()).copied());
        (row, (p.position_m - place).dot(&across), p.sigma_m)
    });
    let rows: Vec<(Vector6<f64>, f64, f64)> = rows.collect();
    let motion = least_squares(rows.iter().map(|(row, off_m, _)| (*row, *off_m)));
    let off = rows.iter().map(|(row, off_m, _)| (off_m - row.dot(&motion)).powi(2));
    let sigma = rows.iter().map(|(.., sigma_m)| sigma_m.powi(2));
    [mean(off).sqrt() / M_PER_MM, mean(sigma).sqrt() / M_PER_MM]
}

/// Holds a rim against the truth; `drape` is the grid of vertices that it is of.
#[must_use]
pub fn rim_error(found: &ScannedBoundary, drape: &Mesh, truth: &Boundary) -> RimError {
    let points = found.boundary.points();
    let errors = errors(&found.boundary, truth);
    let lengths = errors.iter().map(Vector3::norm);
    let (motion, left) = without_motion(truth, &errors);
    let left = left.iter().map(Vector3::norm).sum::<f64>();
    let across: Vec<f64> = points
        .iter()
        .enumerate()
        .filter(|(_, p)| p.observed)
        .map(|(i, _)| errors[i].dot(&outward(drape, i)))
        .collect();
    let scores = points.iter().zip(&errors);
    let scores =
        scores.flat_map(|(p, e)| e.iter().map(|c| c.abs() / p.sigma_m).collect::<Vec<_>>());
    RimError {
        mean_m: mean(lengths.clone()),
        largest_m: lengths.fold(0.0, f64::max),
        without_motion_m: left / points.len() as f64,
        shift_m: motion.0.norm(),
        yaw_rad: motion.1.y,
        edge_bias_m: mean(across.iter().copied()),
        scores: scores.collect(),
        observed: found.quality.observed_fraction,
    }
}

/// Mean distance of corresponding points of two rims but for a rigid motion \[m\].
#[must_use]
pub fn deformed_m(found: &Boundary, truth: &Boundary) -> f64 {
    let (_, left) = without_motion(truth, &errors(found, truth));
    mean(left.iter().map(Vector3::norm))
}

fn errors(found: &Boundary, truth: &Boundary) -> Vec<Vector3> {
    found.positions_m().zip(truth.positions_m()).map(|(p, q)| p - q).collect()
}

/// The rigid motion of [`best_motion`], and the errors but for it.
fn without_motion(truth: &Boundary, errors: &[Vector3]) -> ((Vector3, Vector3), Vec<Vector3>) {
    let middle =
        truth.positions_m().fold(Vector3::zeros(), |s, q| s + q.coords) / errors.len() as f64;
    let arms: Vec<Vector3> = truth.positions_m().map(|q| q.coords - middle).collect();
    let motion = best_motion(&arms, errors);
    let left = arms.iter().zip(errors).map(|(arm, e)| e - motion.0 - motion.1.cross(arm)).collect();
    (motion, left)
}

/// Shift t of the rim's middle and small rotation w about it with t + w x q nearest
/// to the errors.
fn best_motion(arms: &[Vector3], errors: &[Vector3]) -> (Vector3, Vector3) {
    let rows = arms.iter().zip(errors).flat_map(|(q, e)| {
        // Row c of t + w x q.
        [0, 1, 2].map(|c| {
            let mut unit = Vector3::zeros();
            unit[c] = 1.0;
            let turned = q.cross(&unit);
            (Vector6::from_iterator(unit.iter().chain(turned.iter()).copied()), e[c])
        })
    });
    let motion = least_squares(rows);
    (motion.fixed_rows::<3>(0).into(), motion.fixed_rows::<3>(3).into())
}

/// The six numbers whose products with the rows are nearest to the values; zeros where rows do not
/// tell them.
fn least_squares(rows: impl Iterator<Item = (Vector6<f64>, f64)>) -> Vector6<f64> {
    let (mut normal, mut right) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
    for (row, value) in rows {
        normal += row * row.transpose();
        right += row * value;
    }
    normal.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&right))
}

/// Unit vector along the cloth, outward across the rim at point `index`.
fn outward(drape: &Mesh, index: usize) -> Vector3 {
    let side_m = scan2params::base::frame::SPECIMEN_SIDE_M;
    let n = drape.vertices.len().isqrt();
    let [x, z] = Boundary::flat_xz_m(index, side_m);
    let of = |c: f64| ((c / side_m + 0.5) * (n - 1) as f64).round() as usize;
    let (i, j) = (of(x).min(n - 1), of(z).min(n - 1));
    let (a, b) = match index / scan2params::base::boundary::POINTS_PER_SIDE {
        0 => (n - 2, j),
        1 => (i, n - 2),
        2 => (1, j),
        _ => (i, 1),
    };
    (drape.vertices[i * n + j] - drape.vertices[a * n + b]).normalize()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    sum / f64::from(count.max(1))
}

/// Many cases in one row.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Cases, and those answered.
    pub cases: usize,
    /// Those answered.
    pub answered: usize,
    /// Mean over the answers of [`RimError::mean_m`].
    pub mean_m: f64,
    /// The largest of them.
    pub worst_mean_m: f64,
    /// Largest error of a point of an answer \[m\].
    pub largest_m: f64,
    /// Answers with a point beyond [`SILENT_ERROR_M`].
    pub silent: usize,
    /// Share of the coordinates within the intervals of [`INTERVALS`].
    pub coverage: [f64; 2],
    /// Factors on sigma with which the intervals would hold what they say.
    pub sigma_factors: [f64; 2],
    /// Mean error across the free edge \[m\].
    pub edge_bias_m: f64,
    /// Median wall time \[s\].
    pub seconds: f64,
}

impl Summary {
    /// Of these cases.
    #[must_use]
    pub fn of(cases: &[&Case]) -> Self {
        let answers: Vec<&RimError> = cases.iter().filter_map(|c| c.answer.as_ref().ok()).collect();
        let scores: Vec<f64> = answers.iter().flat_map(|a| a.scores.iter().copied()).collect();
        let covered = |sigmas: f64| {
            scores.iter().filter(|s| **s <= sigmas).count() as f64 / scores.len().max(1) as f64
        };
        let factor = |k: usize| {
            robust::quantile(scores.clone(), INTERVALS[k]).unwrap_or(f64::NAN) / INTERVAL_SIGMAS[k]
        };
        let largest = |of: fn(&RimError) -> f64| answers.iter().map(|a| of(a)).fold(0.0, f64::max);
        Self {
            cases: cases.len(),
            answered: answers.len(),
            mean_m: mean(answers.iter().map(|a| a.mean_m)),
            worst_mean_m: largest(|a| a.mean_m),
            largest_m: largest(|a| a.largest_m),
            silent: answers.iter().filter(|a| a.largest_m > SILENT_ERROR_M).count(),
            coverage: INTERVAL_SIGMAS.map(covered),
            sigma_factors: [factor(0), factor(1)],
            edge_bias_m: mean(answers.iter().map(|a| a.edge_bias_m)),
            seconds: robust::median(cases.iter().map(|c| c.seconds).collect()).unwrap_or(0.0),
        }
    }
}

/// Draws the true rim (blue) and the rim found (red; bridged orange), joined where
/// they differ by more than 1 mm (green), over the cloth's scanned points, from
/// above and from two sides; simulation frame.
#[must_use]
pub fn picture(found: &ScannedBoundary, truth: &Boundary) -> image::RgbImage {
    const PANE: u32 = 900;
    const PIXELS_PER_M: f64 = 3600.0;
    let mut image = image::RgbImage::from_pixel(3 * PANE, PANE, image::Rgb([255; 3]));
    let views: [fn(&Point3) -> [f64; 2]; 3] =
        [|p| [p.x, p.z], |p| [p.x, -p.y - 0.075], |p| [p.z, -p.y - 0.075]];
    for (pane, view) in views.into_iter().enumerate() {
        let place = |p: &Point3| {
            let [x, y] = view(p).map(|c| c * PIXELS_PER_M + f64::from(PANE) / 2.0);
            [(x + f64::from(pane as u32 * PANE)) as f32, y as f32]
        };
        for p in &found.evidence.cloth {
            let shade = 150 + (80.0 * (p.y / -0.17).clamp(0.0, 1.0)) as u8;
            dot(&mut image, place(p), 0.6, image::Rgb([shade; 3]));
        }
        for (p, q) in found.boundary.points().iter().zip(truth.positions_m()) {
            if (p.position_m - q).norm() > 1e-3 {
                line(&mut image, place(&p.position_m), place(&q), image::Rgb([0, 160, 0]));
            }
            dot(&mut image, place(&q), 2.2, image::Rgb([20, 60, 220]));
            let color = if p.observed { [220, 0, 0] } else { [255, 150, 0] };
            dot(&mut image, place(&p.position_m), 2.2, image::Rgb(color));
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring() -> Boundary {
        let at = |i: usize| {
            let [x, z] = Boundary::flat_xz_m(i, 0.3);
            Point3::new(x, -0.3 * x.abs().max(z.abs()), z)
        };
        Boundary::exact((0..scan2params::base::boundary::POINTS).map(at)).unwrap()
    }

    #[test]
    fn a_small_motion_is_found_again() {
        let (shift, turn) = (Vector3::new(1e-3, 2e-3, -1e-3), Vector3::new(1e-3, -4e-3, 2e-3));
        let arms: Vec<Vector3> = ring().positions_m().map(|q| q.coords).collect();
        let errors: Vec<Vector3> = arms.iter().map(|arm| shift + turn.cross(arm)).collect();
        let (t, w) = best_motion(&arms, &errors);
        assert!((t - shift).norm() < 1e-9 && (w - turn).norm() < 1e-8, "{t} {w}");
    }

    #[test]
    fn factors_undo_sigmas_that_are_half_too_small() {
        let scores: Vec<f64> = (1..1000).map(|k| 2.0 * f64::from(k) / 1000.0 * 2.5).collect();
        let answer = RimError {
            mean_m: 1e-3,
            largest_m: 6e-3,
            without_motion_m: 1e-3,
            shift_m: 0.0,
            yaw_rad: 0.0,
            edge_bias_m: 0.0,
            scores,
            observed: 1.0,
        };
        let case = Case { answer: Ok(answer), seconds: 1.0 };
        let refused = ScanError::TooFewPoints { points: 1, limit: 2 };
        let refused = Case { answer: Err(refused), seconds: 1.0 };
        let summary = Summary::of(&[&case, &refused]);
        assert_eq!((summary.cases, summary.answered, summary.silent), (2, 1, 1));
        assert!((summary.sigma_factors[1] - 4.75 / 1.96).abs() < 0.02);
        assert!((summary.coverage[1] - 1.96 / 5.0).abs() < 0.01);
    }
}

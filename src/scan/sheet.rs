//! The sheet: the draped cloth as a smooth map from the flat specimen into space,
//! fitted to the scanned surface.
//!
//! A uniform bicubic B-spline x(m) over the material square minimises
//!
//! `sum |x(m_i) - p_i|^2 / s_i^2 + sum |second differences|^2 / d^2 + sum |dx/dm - R|^2 / e^2`
//!
//! with R the rotation nearest to dx/dm of the round before: data, bending and
//! inextensibility (local/global as in `parameterisation::relax`). After each fit the points slide
//! to their nearest places m on the sheet. Where points are missing the last two
//! terms carry the sheet across. The posterior covariance of the same system
//! gives the sigma of every place.
//!
//! In: surface points with material coordinates, local frame \[m\]. Out: the map.

use nalgebra::{Matrix2, Matrix3x2, Vector2};
use rayon::prelude::*;

use super::tuning::SheetTuning;
use crate::base::{Point3, Vector3};
use crate::numeric::banded::{Banded, Factor};
use crate::numeric::bspline::{Grid, Weights};

/// The fitted map and its information matrix.
pub(super) struct Sheet {
    pub(super) grid: Grid,
    pub(super) controls: Vec<Vector3>,
    factor: Option<Factor>,
}

/// Where a point of space lies on the sheet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Material coordinates of the nearest place \[m\].
    pub material: [f64; 2],
    /// Distance of the point from there \[m\].
    pub off_m: f64,
}

/// Which terms a fit has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Terms {
    /// Points and bending: there is no sheet yet whose lengths could be held.
    WithoutStrain,
    /// Points, bending and inextensibility, robust about the sheet of the round before.
    All,
}

/// Priors and loops of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetSettings<'a> {
    /// Half side of the material square that the map covers \[m\].
    pub half_m: f64,
    /// Standard deviation of a surface point \[m\].
    pub point_sigma_m: f64,
    /// The constants.
    pub tuning: &'a SheetTuning,
}

impl Sheet {
    /// The place of material coordinates.
    pub fn at(&self, material: [f64; 2]) -> Point3 {
        let w = self.grid.weights(material);
        let sum: Vector3 =
            (0..16).map(|k| self.controls[self.grid.control(&w, k)] * w.value[k]).sum();
        Point3::from(sum)
    }

    /// Derivatives of the place to both material coordinates.
    pub fn slopes(&self, material: [f64; 2]) -> Matrix3x2<f64> {
        self.near(material).2
    }

    /// The place and its derivatives, with the controls' weights there.
    pub fn near(&self, material: [f64; 2]) -> (Weights, Point3, Matrix3x2<f64>) {
        let w = self.grid.weights(material);
        let (mut at, mut along_u, mut along_v) =
            (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for a in 0..4 {
            let first = self.grid.index(w.first[0] + a, w.first[1]);
            for (k, control) in (4 * a..).zip(&self.controls[first..first + 4]) {
                at += control * w.value[k];
                along_u += control * w.du[k];
                along_v += control * w.dv[k];
            }
        }
        (w, Point3::from(at), Matrix3x2::from_columns(&[along_u, along_v]))
    }

    /// Posterior standard deviation of a place, per coordinate \[m\], if the
    /// points' errors were independent.
    pub fn sigma_m(&self, material: [f64; 2]) -> f64 {
        let Some(factor) = &self.factor else { return f64::INFINITY };
        let w = self.grid.weights(material);
        let entries: Vec<(usize, f64)> =
            (0..16).map(|k| (self.grid.control(&w, k), w.value[k])).collect();
        factor.inverse_form(&entries).sqrt()
    }

    /// The place of the sheet nearest to `p`, started at `from`.
    pub fn nearest(&self, p: &Point3, from: [f64; 2], half_m: f64) -> Foot {
        /// A place is found where the next step is no longer than this \[m\].
        const FOUND_M: f64 = 3e-6;
        let mut m = from;
        for _ in 0..3 {
            let (_, at, jacobian) = self.near(m);
            let residual = p - at;
            let normal: Matrix2<f64> = jacobian.transpose() * jacobian + Matrix2::identity() * 1e-3;
            let Some(inverse) = normal.try_inverse() else { break };
            let step: Vector2<f64> = inverse * (jacobian.transpose() * residual);
            if step.norm() < FOUND_M {
                return Foot { material: m, off_m: residual.norm() };
            }
            let step = step * (3e-3 / step.norm().max(3e-3));
            m = [(m[0] + step[0]).clamp(-half_m, half_m), (m[1] + step[1]).clamp(-half_m, half_m)];
        }
        Foot { material: m, off_m: (p - self.at(m)).norm() }
    }
}

/// Fits the map; `material` is moved to the points' places on it. `None` if the
/// system is singular (too few points).
pub(super) fn fit(
    points: &[Point3],
    disorder: &[f64],
    material: &mut [[f64; 2]],
    settings: &SheetSettings,
) -> Option<Sheet> {
    let grid = Grid::new(settings.half_m, settings.tuning.knot_m);
    let mut sheet =
        Sheet { grid, controls: vec![Vector3::zeros(); grid.side() * grid.side()], factor: None };
    for round in 0..settings.tuning.rounds {
        let terms = if round > 0 { Terms::All } else { Terms::WithoutStrain };
        sheet = solve(&sheet, points, disorder, material, settings, terms)?;
        if round + 1 < settings.tuning.rounds {
            let moved: Vec<[f64; 2]> = points
                .par_iter()
                .zip(material.par_iter())
                .map(|(p, &m)| sheet.nearest(p, m, settings.half_m).material)
                .collect();
            let slid: f64 =
                moved.iter().zip(&*material).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
            material.copy_from_slice(&moved);
            if terms == Terms::All && slid < settings.tuning.settled_m * material.len() as f64 {
                break;
            }
        }
    }
    Some(sheet)
}

/// One linear least-squares solve.
fn solve(
    before: &Sheet,
    points: &[Point3],
    disorder: &[f64],
    material: &[[f64; 2]],
    settings: &SheetSettings,
    terms: Terms,
) -> Option<Sheet> {
    let grid = before.grid;
    let count = grid.side() * grid.side();
    let mut matrix = Banded::zeros(count, grid.bandwidth());
    let mut right: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; count]);
    // Robust: a point far off the sheet of the round before counts little.
    let tuning = settings.tuning;
    let bound = (tuning.bound_sigmas * settings.point_sigma_m).max(tuning.bound_m);
    for ((p, &m), disorder) in points.iter().zip(material).zip(disorder) {
        let w = grid.weights(m);
        let off = if terms == Terms::All { (p - before.at(m)).norm() } else { 0.0 };
        let weight = 1.0
            / (settings.point_sigma_m * (disorder - tuning.disorder).max(1.0)).powi(2)
            / (1.0 + (off / bound).powi(2)).powi(2);
        add(&mut matrix, &mut right, &grid, &w, &w.value, &p.coords, weight);
    }
    bending(&mut matrix, &grid, settings);
    if terms == Terms::All {
        inextensible(&mut matrix, &mut right, before, settings);
    }
    let factor = matrix.cholesky()?;
    let mut controls = vec![Vector3::zeros(); count];
    for (c, mut b) in right.into_iter().enumerate() {
        factor.solve(&mut b);
        for (control, value) in controls.iter_mut().zip(b) {
            control[c] = value;
        }
    }
    Some(Sheet { grid, controls, factor: Some(factor) })
}

/// Adds weight * |sum row_k control_k - target|^2.
fn add(
    matrix: &mut Banded,
    right: &mut [Vec<f64>; 3],
    grid: &Grid,
    at: &Weights,
    row: &[f64; 16],
    target: &Vector3,
    weight: f64,
) {
    for k in 0..16 {
        let i = grid.control(at, k);
        let scaled = weight * row[k];
        for (c, list) in right.iter_mut().enumerate() {
            list[i] += scaled * target[c];
        }
        for l in 0..=k {
            matrix.add(i, grid.control(at, l), scaled * row[l]);
        }
    }
}

/// Second differences of the controls, along both axes and mixed (twice).
fn bending(matrix: &mut Banded, grid: &Grid, settings: &SheetSettings) {
    let spread = settings.tuning.curvature_sigma_per_m * grid.spacing().powi(2);
    let weight = 1.0 / (spread * spread);
    let n = grid.side();
    let mut stencil = |cells: &[(usize, usize, f64)], weight: f64| {
        for (k, a) in cells.iter().enumerate() {
            for b in &cells[..=k] {
                matrix.add(grid.index(a.0, a.1), grid.index(b.0, b.1), weight * a.2 * b.2);
            }
        }
    };
    for i in 0..n {
        for j in 0..n {
            if i + 2 < n {
                stencil(&[(i, j, 1.0), (i + 1, j, -2.0), (i + 2, j, 1.0)], weight);
            }
            if j + 2 < n {
                stencil(&[(i, j, 1.0), (i, j + 1, -2.0), (i, j + 2, 1.0)], weight);
            }
            if i + 1 < n && j + 1 < n {
                let twist = [(i, j, 1.0), (i, j + 1, -1.0), (i + 1, j, -1.0), (i + 1, j + 1, 1.0)];
                stencil(&twist, 2.0 * weight);
            }
        }
    }
}

/// dx/dm = nearest rotation of the round before, at the middle of every span.
fn inextensible(
    matrix: &mut Banded,
    right: &mut [Vec<f64>; 3],
    before: &Sheet,
    settings: &SheetSettings,
) {
    let grid = before.grid;
    let h = grid.spacing();
    let weight = 1.0 / settings.tuning.strain_sigma.powi(2);
    let spans = grid.side() - 3;
    for a in 0..spans {
        for b in 0..spans {
            let at =
                [(a as f64 + 0.5) * h - settings.half_m, (b as f64 + 0.5) * h - settings.half_m];
            let w = grid.weights(at);
            let svd = before.slopes(at).svd(true, true);
            let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { continue };
            let rotation = u * vt;
            let columns = [rotation.column(0).into_owned(), rotation.column(1).into_owned()];
            add(matrix, right, &grid, &w, &w.du, &columns[0], weight);
            add(matrix, right, &grid, &w, &w.dv, &columns[1], weight);
        }
    }
}

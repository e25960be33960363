//! A view thinned to cells, and which cells of two views lie opposite each other.

use std::collections::HashMap;
use std::sync::OnceLock;

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

use crate::base::{Isometry3, Point3, Vector3};
use crate::geom::Neighbours;
use crate::numeric::robust::median;

/// How finely views are thinned.
#[derive(Clone, Copy)]
pub(super) struct Fineness {
    /// Side of a cell \[m\]: a fold's radius is 10 mm and more.
    cell_m: f64,
    /// A cell's normal is that of the means within this \[m\].
    normal_within_m: f64,
    /// Two cells lie opposite if they are no farther than this beside each other \[m\].
    beside_m: f64,
}

pub(super) const FINE: Fineness = Fineness { cell_m: 2e-3, normal_within_m: 5e-3, beside_m: 3e-3 };
/// Of views whose noise turns the normals of fine cells.
pub(super) const COARSE: Fineness =
    Fineness { cell_m: 4e-3, normal_within_m: 9e-3, beside_m: 6e-3 };
/// A normal is that of so many means at least.
const NORMAL_LEAST: usize = 6;
/// Noise is the mean of a block of so many cells along a side.
const NOISE_CELLS: f64 = 5.0;
/// Cells of a view whose surroundings are looked at beforehand, at most some.
const SAMPLED: usize = 20_000;
/// Cells of a view that are held against each other view.
const ASKED: usize = 4500;
/// Each so many-th of them where coarse steps or a count will do, and for the steps after.
pub(super) const STRIDE: usize = 9;
pub(super) const FINE_STRIDE: usize = 3;
/// Two cells lie opposite only if their normals differ by no more than this \[cosine\].
const LEAST_COSINE: f64 = 0.7;
/// A cell is seen under no steeper angle than this \[cosine\].
const STEEPEST_COSINE: f64 = 0.2;
/// How flat the means about a cell are, for it to be a sheet: variance across against along \[-\].
const FLAT: f64 = 0.3;

/// One view.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Its points in its own frame \[m\].
    pub points: &'a [Point3],
    /// Where its camera stood, in that frame; `None` for points that were fused.
    pub eye: Option<Point3>,
}

/// What the points about a cell's mean lie like, in the view's own frame.
#[derive(Clone, Copy, Debug)]
struct Sheet {
    /// To the camera, if that is known.
    normal: Vector3,
    /// Noise of the cell's points \[m\]; 0 of a single one.
    noise_m: f64,
    /// Distance of the means about it from their plane, root mean square \[m\].
    rough_m: f64,
}

/// A view as it is registered.
pub(super) struct Thinned {
    /// The means of the cells' points, in the view's own frame.
    pub(super) means: Vec<Point3>,
    cells: Vec<Cell>,
    /// What lies about each, where it was asked; `None` where that is no sheet.
    sheets: Vec<OnceLock<Option<Sheet>>>,
    tree: Neighbours,
    /// The cells that are held against other views.
    pub(super) asked: Vec<usize>,
    eye: Option<Point3>,
    /// Noise of single points: of the middle cell, and the mean of blocks of cells \[m\].
    pub(super) noise_m: f64,
    block_noises_m: HashMap<[i32; 3], f64>,
    /// Distance of a cell's neighbours from their plane, root mean square, of the middle cell
    /// \[m\].
    pub(super) rough_m: f64,
    fineness: Fineness,
}

/// Two cells that lie opposite each other, common frame.
pub(super) struct Pair {
    pub(super) at: Point3,
    /// The mean of both normals.
    pub(super) normal: Vector3,
    /// How far the first lies above the second along it \[m\].
    pub(super) off_m: f64,
    /// Noise of single points about the two, root mean square \[m\].
    pub(super) noise_m: f64,
}

/// Of the cells of `a` that are asked for each `stride`th that lies opposite one of `b`, no farther
/// off than three reaches.
pub(super) fn pairs(
    a: &Thinned,
    a_pose: &Isometry3,
    b: &Thinned,
    b_pose: &Isometry3,
    reach_m: f64,
    stride: usize,
) -> impl Iterator<Item = Pair> {
    let b_from_a = b_pose.inv_mul(a_pose);
    let beside_m = b.fineness.beside_m;
    let both_eyes = a.eye.is_some() && b.eye.is_some();
    a.asked.iter().step_by(stride).filter_map(move |&k| {
        let at = b_from_a * a.means[k];
        let nearest = b.tree.one(&at).filter(|near| near.distance() < 3.0 * reach_m + beside_m)?;
        let other = b.means[nearest.index];
        let (normal, other_normal) =
            (b_from_a * a.sheet(k)?.normal, b.sheet(nearest.index)?.normal);
        let cosine = normal.dot(&other_normal);
        let sign = if both_eyes { 1.0 } else { cosine.signum() };
        if cosine * sign < LEAST_COSINE {
            return None;
        }
        let mean = (normal * sign + other_normal).normalize();
        let offset = at - other;
        let off_m = offset.dot(&mean);
        let off_beside_m = (offset - mean * off_m).norm();
        let [noise_m, other_noise_m] = [a.noise_about_m(k), b.noise_about_m(nearest.index)];
        (off_beside_m < beside_m && off_m.abs() < 3.0 * reach_m).then(|| Pair {
            at: a_pose * a.means[k],
            normal: b_pose * mean,
            off_m,
            noise_m: (0.5 * (noise_m.powi(2) + other_noise_m.powi(2))).sqrt(),
        })
    })
}

impl Thinned {
    pub(super) fn new(view: &View<'_>, fineness: Fineness) -> Self {
        let origin = view.points.first().copied().unwrap_or_default().coords;
        let cells = cells(view.points, &origin, fineness.cell_m);
        let means: Vec<Point3> = cells.iter().map(|cell| cell.mean() + origin).collect();
        let mut thinned = Self {
            tree: Neighbours::new(&means),
            sheets: vec![OnceLock::new(); means.len()],
            means,
            cells,
            asked: Vec::new(),
            eye: view.eye,
            noise_m: 0.0,
            block_noises_m: HashMap::new(),
            rough_m: 0.0,
            fineness,
        };
        let sampled: Vec<usize> = (0..thinned.means.len())
            .step_by(thinned.means.len().div_ceil(SAMPLED).max(1))
            .collect();
        let sheets: Vec<(usize, Sheet)> =
            sampled.par_iter().filter_map(|&k| Some((k, thinned.sheet(k)?))).collect();
        // A cell of one point says nothing of noise.
        let usual = |of: fn(&Sheet) -> f64| {
            let known = sheets.iter().map(|(_, sheet)| of(sheet)).filter(|&m| m > 0.0);
            median(known.collect()).unwrap_or(0.0)
        };
        thinned.noise_m = usual(|sheet| sheet.noise_m);
        thinned.rough_m = usual(|sheet| sheet.rough_m);
        thinned.block_noises_m = thinned.block_noises_m(&sheets);
        thinned.asked = evenly(&sheets);
        thinned
    }

    /// What lies about a cell's mean; `None` where that is no sheet, or is seen too steeply.
    fn sheet(&self, k: usize) -> Option<Sheet> {
        *self.sheets[k].get_or_init(|| {
            let at = self.means[k];
            let near = self.tree.within(&at, self.fineness.normal_within_m);
            let near: Vec<Vector3> = near.iter().map(|&k| self.means[k] - at).collect();
            let (normal, rough_m) = plane(&near)?;
            let normal = match self.eye.map(|eye| (eye - at).normalize().dot(&normal)) {
                Some(cosine) if cosine.abs() < STEEPEST_COSINE => return None,
                Some(cosine) => normal * cosine.signum(),
                None => normal,
            };
            Some(Sheet { normal, noise_m: self.cells[k].noise_m(&normal), rough_m })
        })
    }

    /// The mean noise of single points in each block of cells in which it is known \[m\].
    fn block_noises_m(&self, sheets: &[(usize, Sheet)]) -> HashMap<[i32; 3], f64> {
        let mut sums: HashMap<[i32; 3], [f64; 2]> = HashMap::new();
        for (k, sheet) in sheets.iter().filter(|(_, sheet)| sheet.noise_m > 0.0) {
            let [sum, count] = sums.entry(self.block(*k)).or_default();
            (*sum, *count) = (*sum + sheet.noise_m, *count + 1.0);
        }
        sums.into_iter().map(|(block, [sum, count])| (block, sum / count)).collect()
    }

    fn block(&self, k: usize) -> [i32; 3] {
        let side_m = NOISE_CELLS * self.fineness.cell_m;
        let offset = self.means[k] - self.means[0];
        [0, 1, 2].map(|axis| (offset[axis] / side_m).floor() as i32)
    }

    /// Noise of single points about a cell \[m\].
    fn noise_about_m(&self, k: usize) -> f64 {
        self.block_noises_m.get(&self.block(k)).copied().unwrap_or(self.noise_m)
    }
}

/// The points of one cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: f64,
    sum: Vector3,
    squares: Matrix3<f64>,
}

impl Cell {
    fn mean(&self) -> Point3 {
        Point3::from(self.sum / self.count)
    }

    /// Standard deviation of its points along a normal \[m\]; 0 of a single one.
    fn noise_m(&self, normal: &Vector3) -> f64 {
        let mean = self.sum / self.count;
        let spread = self.squares - mean * mean.transpose() * self.count;
        (normal.dot(&(spread * normal)) / (self.count - 1.0).max(1.0)).max(0.0).sqrt()
    }
}

/// The cells of some points, in the order of their first points.
fn cells(points: &[Point3], origin: &Vector3, cell_m: f64) -> Vec<Cell> {
    let mut index: HashMap<[i32; 3], usize> = HashMap::new();
    let mut cells: Vec<Cell> = Vec::new();
    for point in points {
        let at = point.coords - origin;
        let key = [0, 1, 2].map(|k| (at[k] / cell_m).floor() as i32);
        let place = *index.entry(key).or_insert(cells.len());
        if place == cells.len() {
            cells.push(Cell::default());
        }
        let cell = &mut cells[place];
        cell.count += 1.0;
        cell.sum += at;
        cell.squares += at * at.transpose();
    }
    cells
}

/// The normal of the plane through some points, and their distance from it, root mean square \[m\];
/// `None` where they are few, or no sheet.
fn plane(points: &[Vector3]) -> Option<(Vector3, f64)> {
    if points.len() < NORMAL_LEAST {
        return None;
    }
    let mean = points.iter().sum::<Vector3>() / points.len() as f64;
    let spread = |sum: Matrix3<f64>, point: &Vector3| {
        let off = point - mean;
        sum + off * off.transpose()
    };
    let eigen = SymmetricEigen::new(points.iter().fold(Matrix3::zeros(), spread));
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [least, middle, _] = order;
    let flat = eigen.eigenvalues[least] < FLAT * eigen.eigenvalues[middle];
    let rough_m = (eigen.eigenvalues[least].max(0.0) / points.len() as f64).sqrt();
    flat.then(|| (eigen.eigenvectors.column(least).into_owned(), rough_m))
}

/// Some cells, even over the directions of their normals.
fn evenly(sheets: &[(usize, Sheet)]) -> Vec<usize> {
    let mut bins: Vec<Vec<usize>> = vec![Vec::new(); 6 * 9];
    for (k, Sheet { normal, .. }) in sheets {
        let axis = normal.iamax();
        let sign = normal[axis];
        let third = |c: f64| (((c / sign.abs() + 1.0) * 1.5).floor() as usize).min(2);
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|k| third(normal[k]));
        bins[9 * (2 * axis + usize::from(sign > 0.0)) + 3 * u + v].push(*k);
    }
    // The most of each bin with which there are not too many.
    let kept = |most: usize| bins.iter().map(|bin| bin.len().min(most)).sum::<usize>();
    let most = (1..=ASKED).rev().find(|&most| kept(most) <= ASKED).unwrap_or(1);
    let strided = |bin: &Vec<usize>| {
        let count = bin.len().min(most);
        let place = |k: usize| bin[k * bin.len() / count];
        (0..count).map(place).collect::<Vec<_>>()
    };
    bins.iter().flat_map(strided).collect()
}

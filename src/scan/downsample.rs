//! Downsampling: points that lie near each other become their mean.
//!
//! By voxels: one point per occupied cell. Or about centres that the points' order chooses, so that
//! neither the frame nor what else is in a file changes which points come together.

use foldhash::{HashMap, HashMapExt as _};
use rayon::prelude::*;

use crate::base::{Point3, Vector3};
use crate::geom::Neighbours;
use crate::numeric::robust;

/// Means of points, each with the number of points it stands for.
#[derive(Clone, Debug, Default)]
pub(super) struct Downsampled {
    /// The means.
    pub points: Vec<Point3>,
    /// Points of each.
    pub counts: Vec<f64>,
}

/// Half of the cells that a key has room for in each direction.
const HALF_CELLS: i64 = 1 << 20;

/// The cell from which cells are counted: the origin's, or the median point's if some point is too
/// far from the origin, as all are of a scan in a map's projection. Whole cells, so that which
/// points share one does not depend on it; strays beyond all bounds share the outermost.
fn middle_cell(points: &[Point3], cell: f64) -> [i64; 3] {
    let reach = cell * HALF_CELLS as f64;
    if points.iter().all(|p| p.iter().all(|c| (-reach..reach).contains(c))) {
        return [0; 3];
    }
    [0, 1, 2].map(|k| {
        let median = robust::median(points.iter().map(|p| p[k]).collect());
        median.map_or(0, |median| (median / cell).floor() as i64)
    })
}

/// Replaces the points of each cubic cell of edge length `cell` (same unit as the points)
/// by their mean. The cells come in lexicographic order, so that the result does not depend on
/// threads.
pub(super) fn voxel_downsample(points: &[Point3], cell: f64) -> Vec<Point3> {
    let middle = middle_cell(points, cell);
    let key = |p: &Point3| {
        let of = |k: usize| {
            let cells = ((p[k] / cell).floor() as i64).saturating_sub(middle[k]);
            cells.saturating_add(HALF_CELLS).clamp(0, 2 * HALF_CELLS - 1) as u64
        };
        (of(0) << 42) | (of(1) << 21) | of(2)
    };
    let mut order: Vec<(u64, u32)> =
        points.par_iter().enumerate().map(|(i, p)| (key(p), i as u32)).collect();
    order.par_sort_unstable();
    let mean = |group: &[(u64, u32)]| {
        let sum: Vector3 = group.iter().map(|&(_, i)| points[i as usize].coords).sum();
        Point3::from(sum / group.len() as f64)
    };
    order.chunk_by(|a, b| a.0 == b.0).map(mean).collect()
}

/// Replaces the points nearest to each centre by their mean, weighted by `counts` if given and by
/// 1 each if not. A point is a centre if no earlier one lies within `apart` (same unit as the points). A motion of
/// all points moves the result, and points far from others change nothing of those.
pub(super) fn cluster(points: &[Point3], counts: Option<&[f64]>, apart: f64) -> Downsampled {
    let centres = centres(points, apart);
    let tree = Neighbours::new(&centres);
    let nearest = |p: &Point3| tree.one(p).map_or(0, |near| near.index);
    let of: Vec<usize> = points.par_iter().map(nearest).collect();
    let mut sums = vec![(Vector3::zeros(), 0.0); centres.len()];
    for (i, (p, &centre)) in points.iter().zip(&of).enumerate() {
        let weight = counts.map_or(1.0, |c| c[i]);
        // From the centre, so that sums lose no digits far from the origin.
        sums[centre].0 += (p - centres[centre]) * weight;
        sums[centre].1 += weight;
    }
    let mean = |(centre, (sum, weight)): (&Point3, &(Vector3, f64))| centre + sum / *weight;
    Downsampled {
        points: centres.iter().zip(&sums).map(mean).collect(),
        counts: sums.iter().map(|(_, weight)| *weight).collect(),
    }
}

/// The points that have no earlier centre within `apart`.
fn centres(points: &[Point3], apart: f64) -> Vec<Point3> {
    let cell_of = |p: &Point3| [p.x, p.y, p.z].map(|c| (c / apart).floor() as i64);
    // The last centre in each cell, and the one before each in the same cell.
    let mut last: HashMap<[i64; 3], usize> = HashMap::new();
    let mut before: Vec<Option<usize>> = Vec::new();
    let mut centres: Vec<Point3> = Vec::new();
    for p in points {
        let [i, j, k] = cell_of(p);
        let near = |at: [i64; 3]| {
            let first = last.get(&at).copied();
            std::iter::successors(first, |&centre| before[centre])
                .any(|centre| (centres[centre] - p).norm_squared() < apart * apart)
        };
        let mut beside = (0..27_i64).map(|n| [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
        if near([i, j, k]) || beside.any(near) {
            continue;
        }
        before.push(last.insert([i, j, k], centres.len()));
        centres.push(*p);
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_move_with_their_points_whatever_lies_far_from_them() {
        let at = |k: u32| [0.618_034, 0.414_214].map(|step| 10.0 * (step * f64::from(k)).fract());
        let points: Vec<Point3> = (0..5000).map(at).map(|[x, y]| Point3::new(x, y, 0.0)).collect();
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, 1.1, -2.0);
        let moved = |p: &Point3| turn * p + Vector3::new(3.3, -1.7, 0.4);
        let far: Vec<Point3> = points.iter().map(|p| p + Vector3::z() * 50.0).collect();
        let found = cluster(&points, None, 0.5);
        let with_others: Vec<Point3> =
            far.iter().zip(&points).flat_map(|(a, b)| [moved(a), moved(b)]).collect();
        let again = cluster(&with_others, None, 0.5);
        assert_eq!(again.points.len(), 2 * found.points.len());
        let tree = Neighbours::new(&again.points);
        for p in &found.points {
            assert!(tree.one(&moved(p)).unwrap().distance() < 1e-12);
        }
        assert_eq!(found.counts.iter().sum::<f64>(), 5000.0);
        // Discs of half a unit must cover 10 by 10 units, and their centres lie that far apart.
        assert!((128..500).contains(&found.points.len()), "{}", found.points.len());
    }

    #[test]
    fn cells_keep_the_mean_of_their_points() {
        let points =
            [Point3::new(0.1, 0.1, 0.1), Point3::new(0.3, 0.1, 0.1), Point3::new(-0.1, 0.1, 0.1)];
        let [alone, mean] = voxel_downsample(&points, 1.0)[..] else { panic!("not two cells") };
        assert_eq!(alone, points[2]);
        assert!((mean - Point3::new(0.2, 0.1, 0.1)).norm() < 1e-15);
    }

    /// As scans in a map's projection are, strays beside them.
    #[test]
    fn far_from_the_origin_the_cells_are_the_same() {
        let points: Vec<Point3> = (0..2000)
            .map(|k| [k % 13, k % 17, k % 29].map(|c| f64::from(c) * 0.375))
            .map(Point3::from)
            .collect();
        let near = voxel_downsample(&points, 0.5);
        assert!(near.len() > 500);
        let place = Vector3::new(691_234.5, 5_336_789.0, -9e8);
        let mut far: Vec<Point3> = points.iter().map(|p| p + place).collect();
        far.push(Point3::new(1e9, 0.0, -1e9));
        let far = voxel_downsample(&far, 0.5);
        // Lexicographic order puts the stray last.
        assert_eq!(far.len(), near.len() + 1);
        for (a, b) in far.iter().zip(&near) {
            assert!((a - b - place).norm() < 1e-6, "{a} {b}");
        }
    }
}

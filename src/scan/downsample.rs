//! Voxel downsampling: one point per occupied cell, the mean of the cell's points.

use rayon::prelude::*;

use crate::base::{Point3, Vector3};
use crate::numeric::robust;

/// Downsampled points, each with the number of points it stands for.
#[derive(Clone, Debug, Default)]
pub struct Downsampled {
    /// Means of the occupied cells.
    pub points: Vec<Point3>,
    /// Points in each cell.
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
/// by their mean, weighted by `counts` if given and by 1 each if not. The cells come in
/// lexicographic order, so that the result does not depend on threads.
#[must_use]
pub fn voxel_downsample(points: &[Point3], counts: Option<&[f64]>, cell: f64) -> Downsampled {
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
    let mut out = Downsampled::default();
    for group in order.chunk_by(|a, b| a.0 == b.0) {
        let mut sum = Vector3::zeros();
        let mut weight = 0.0;
        for &(_, i) in group {
            let w = counts.map_or(1.0, |c| c[i as usize]);
            sum += points[i as usize].coords * w;
            weight += w;
        }
        out.points.push(Point3::from(sum / weight));
        out.counts.push(weight);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_keep_the_mean_and_the_number_of_their_points() {
        let points =
            [Point3::new(0.1, 0.1, 0.1), Point3::new(0.3, 0.1, 0.1), Point3::new(-0.1, 0.1, 0.1)];
        let downsampled = voxel_downsample(&points, None, 1.0);
        assert_eq!(downsampled.counts, [1.0, 2.0]);
        assert!((downsampled.points[1] - Point3::new(0.2, 0.1, 0.1)).norm() < 1e-15);
    }

    /// As scans in a map's projection are, strays beside them.
    #[test]
    fn far_from_the_origin_the_cells_are_the_same() {
        let points: Vec<Point3> = (0..2000)
            .map(|k| [k % 13, k % 17, k % 29].map(|c| f64::from(c) * 0.375))
            .map(Point3::from)
            .collect();
        let near = voxel_downsample(&points, None, 0.5);
        assert!(near.points.len() > 500);
        let place = Vector3::new(691_234.5, 5_336_789.0, -9e8);
        let mut far: Vec<Point3> = points.iter().map(|p| p + place).collect();
        far.push(Point3::new(1e9, 0.0, -1e9));
        let far = voxel_downsample(&far, None, 0.5);
        // Lexicographic order puts the stray last.
        assert_eq!(far.points.len(), near.points.len() + 1);
        assert_eq!(far.counts[..near.counts.len()], near.counts);
        for (a, b) in far.points.iter().zip(&near.points) {
            assert!((a - b - place).norm() < 1e-6, "{a} {b}");
        }
    }
}

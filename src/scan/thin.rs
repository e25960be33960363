//! Voxel thinning: one point per occupied cell, the mean of the cell's points.

use rayon::prelude::*;

use crate::base::{Point3, Vector3};

/// Thinned points, each with the number of points it stands for.
#[derive(Clone, Debug, Default)]
pub struct Thinned {
    /// Means of the occupied cells.
    pub points: Vec<Point3>,
    /// Points in each cell.
    pub counts: Vec<f64>,
}

/// Thins `points` (with weights `counts`, or 1 each) to cells of `cell` edge
/// length, same unit as the points. Deterministic: cells in lexicographic order.
#[must_use]
pub fn thin(points: &[Point3], counts: Option<&[f64]>, cell: f64) -> Thinned {
    let key = |p: &Point3| {
        let of = |c: f64| ((c / cell).floor() as i64 + (1 << 20)).clamp(0, (1 << 21) - 1) as u64;
        (of(p.x) << 42) | (of(p.y) << 21) | of(p.z)
    };
    let mut order: Vec<(u64, u32)> =
        points.par_iter().enumerate().map(|(i, p)| (key(p), i as u32)).collect();
    order.par_sort_unstable();
    let mut out = Thinned::default();
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
        let thinned = thin(&points, None, 1.0);
        assert_eq!(thinned.counts, [1.0, 2.0]);
        assert!((thinned.points[1] - Point3::new(0.2, 0.1, 0.1)).norm() < 1e-15);
    }
}

//! Voxel downsampling: one point per occupied cell, the mean of the cell's points.

use rayon::prelude::*;

use crate::base::{Point3, Vector3};

/// Downsampled points, each with the number of points it stands for.
#[derive(Clone, Debug, Default)]
pub struct Downsampled {
    /// Means of the occupied cells.
    pub points: Vec<Point3>,
    /// Points in each cell.
    pub counts: Vec<f64>,
}

/// Replaces the points of each cubic cell of edge length `cell` (same unit as the points)
/// by their mean, weighted by `counts` if given and by 1 each if not. The cells come in
/// lexicographic order, so that the result does not depend on threads.
#[must_use]
pub fn voxel_downsample(points: &[Point3], counts: Option<&[f64]>, cell: f64) -> Downsampled {
    let key = |p: &Point3| {
        let of = |c: f64| ((c / cell).floor() as i64 + (1 << 20)).clamp(0, (1 << 21) - 1) as u64;
        (of(p.x) << 42) | (of(p.y) << 21) | of(p.z)
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
}

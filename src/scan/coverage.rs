//! How much of the cloth was seen: a hole in the scan is one in the plane of its parameterisation.

use spade::{DelaunayTriangulation, Point2, Triangulation as _};

/// Area of the specimen that scanned points cover, as a share of `side_m` squared.
///
/// In: material coordinates of the scanned points \[m\]. The Delaunay triangles of
/// these whose edges are all shorter than `longest_edge_m` count as seen. A hole,
/// or an arc of the rim that no view reached, is spanned by longer ones.
#[must_use]
pub(super) fn seen_share(material: &[[f64; 2]], side_m: f64, longest_edge_m: f64) -> f64 {
    let half = 0.5 * side_m;
    let inside = |p: &&[f64; 2]| p[0].abs() <= half && p[1].abs() <= half;
    let points = material.iter().filter(inside).map(|p| Point2::new(p[0], p[1])).collect();
    // fails for coordinates that are not finite, which `inside` has left out
    let Ok(triangulation) = DelaunayTriangulation::<Point2<f64>>::bulk_load(points) else {
        return 0.0;
    };
    let seen: f64 = triangulation
        .inner_faces()
        .filter(|face| {
            let edges = face.adjacent_edges();
            edges.iter().all(|edge| edge.length_2() < longest_edge_m * longest_edge_m)
        })
        .map(|face| face.area())
        .sum();
    seen / (side_m * side_m)
}

#[cfg(test)]
mod tests {
    use super::seen_share;

    /// A 300 mm square of points 3 mm apart, those that `keep` leaves.
    fn points(keep: impl Fn(f64, f64) -> bool) -> Vec<[f64; 2]> {
        let at = |k: usize| -0.15 + 0.003 * k as f64;
        (0..101)
            .flat_map(|i| (0..101).map(move |j| [at(i), at(j)]))
            .filter(|p| keep(p[0], p[1]))
            .collect()
    }

    #[test]
    fn the_whole_square_is_seen() {
        let share = seen_share(&points(|_, _| true), 0.3, 0.008);
        assert!((share - 1.0).abs() < 1e-9, "{share}");
    }

    #[test]
    fn a_hole_is_missing_from_the_share() {
        let share = seen_share(&points(|x, z| x.hypot(z) > 0.05), 0.3, 0.008);
        let hole = std::f64::consts::PI * 0.05_f64.powi(2) / 0.09;
        assert!((share - (1.0 - hole)).abs() < 0.01, "{share}");
    }

    #[test]
    fn nothing_is_seen_of_nothing() {
        assert_eq!(seen_share(&[], 0.3, 0.008), 0.0);
        assert_eq!(seen_share(&[[0.0, f64::NAN]], 0.3, 0.008), 0.0);
    }
}

//! The symmetries of the square specimen on a disc: half turn, mirrors in x and
//! z, and quarter turns, which exchange weft and warp. Eight views of one rim.

use crate::base::boundary::{POINTS, SIDES};
use crate::base::{Boundary, BoundaryPoint, Point3};

/// One rim as a symmetric experiment would have shown it.
#[derive(Clone, Debug)]
pub struct View {
    /// The rim, again in the order and frame of [`crate::base::boundary`].
    pub boundary: Boundary,
    /// Whether what is weft in this view is warp in the original.
    pub swapped: bool,
}

/// All eight views; the first is the rim itself, the first four keep weft and
/// warp.
#[must_use]
pub fn views(boundary: &Boundary) -> Vec<View> {
    [0, 2, 1, 3]
        .into_iter()
        .flat_map(|quarters| {
            let turned = boundary.rotated(quarters);
            let mirrored = mirrored_x(&turned);
            [turned, mirrored].map(|boundary| View { boundary, swapped: quarters % 2 == 1 })
        })
        .collect()
}

/// The rim mirrored in the plane x = 0: positions flip, and the walk, which then
/// runs backwards, is turned round to start at the same corner.
fn mirrored_x(boundary: &Boundary) -> Boundary {
    // Side 0 at step t becomes side 2 at step 60 - t: index i comes from 182 - i.
    const SUM: usize = POINTS + 3 * POINTS / SIDES - 1;
    let points = (0..POINTS).map(|index| {
        let from = boundary.points()[(SUM - index) % POINTS];
        let p = from.position_m;
        BoundaryPoint { position_m: Point3::new(-p.x, p.y, p.z), ..from }
    });
    Boundary::new(points.collect()).expect("as many points as before")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rim(height: impl Fn(usize) -> f64) -> Boundary {
        let at = |i| Boundary::flat_xz_m(i, 0.3);
        Boundary::exact((0..POINTS).map(|i| Point3::new(at(i)[0], height(i), at(i)[1]))).unwrap()
    }

    #[test]
    fn a_flat_square_is_the_same_in_all_views() {
        let flat = rim(|_| 0.0);
        for view in views(&flat) {
            assert!(view.boundary.mean_distance_m(&flat) < 1e-15);
        }
    }

    #[test]
    fn the_views_of_a_crooked_rim_all_differ_and_half_of_them_swap() {
        let crooked = rim(|i| (i as f64 * 0.37).sin() + i as f64 * 1e-3);
        let views = views(&crooked);
        assert_eq!(views[0].boundary, crooked);
        assert_eq!(
            views.iter().map(|v| v.swapped).collect::<Vec<_>>(),
            [false, false, false, false, true, true, true, true]
        );
        for (i, a) in views.iter().enumerate() {
            for b in &views[..i] {
                assert!(a.boundary.mean_distance_m(&b.boundary) > 1e-3, "view {i}");
            }
        }
    }

    /// A function of the flat cloth alone (not of the walk) must move with it.
    #[test]
    fn a_mark_on_the_cloth_moves_as_the_symmetry_says() {
        let marked = rim(|i| {
            let [x, z] = Boundary::flat_xz_m(i, 0.3);
            2.0 * x + 5.0 * z
        });
        let mirrored = mirrored_x(&marked);
        for point in mirrored.positions_m() {
            assert!((point.y - (-2.0 * point.x + 5.0 * point.z)).abs() < 1e-12);
        }
        assert_eq!(mirrored_x(&mirrored), marked);
    }
}

//! The boundary vector: 244 points of the specimen's rim in the simulation frame.
//!
//! 4 sides of 61 points, 5 mm apart on the flat cloth. Each corner is counted at
//! the end of one side and at the start of the next, so index 60 and 61 are the
//! same corner (this is how 1200 mm / 5 mm gives 244). The walk starts at the
//! flat specimen's corner (x, z) = (+150, -150) mm, runs along the weft side
//! x = +150 towards +z, then along the warp side z = +150 towards -x, along
//! x = -150 towards -z, and along z = -150 towards +x.
//! Source: section IV of the paper (its 732 numbers, 733 with the density).

use serde::Serialize;

use super::vectors::{Point3, Vector3};

/// Sides of the specimen.
pub const SIDES: usize = 4;
/// Points on a side, both corners included.
pub const POINTS_PER_SIDE: usize = 61;
/// Points of the boundary vector.
pub const POINTS: usize = SIDES * POINTS_PER_SIDE;

/// Whether weft and warp of a rim are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Orientation {
    /// The caller said where the warp points, or a mark on the specimen did.
    Given,
    /// Undecided: the boundary turned by one quarter is as likely.
    Ambiguous,
}

/// One point of the rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryPoint {
    /// Position, simulation frame \[m\].
    pub position_m: Point3,
    /// Standard deviation of the position's error, per coordinate \[m\]; 0 for a
    /// simulated rim.
    pub sigma_m: f64,
    /// Whether scanned points lie there; false where the rim was bridged.
    pub observed: bool,
}

/// The rim as an ordered, closed, corner-anchored loop of [`POINTS`] points.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    points: Vec<BoundaryPoint>,
}

/// Another number of points than a boundary has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} points, but a boundary has {POINTS}: four sides of {POINTS_PER_SIDE}")]
pub struct BoundaryError {
    /// How many there are.
    pub found: usize,
}

impl Boundary {
    /// Takes exactly [`POINTS`] points in the module's order.
    ///
    /// # Errors
    /// When there is any other number of them.
    pub fn new(points: Vec<BoundaryPoint>) -> Result<Self, BoundaryError> {
        let found = points.len();
        if found == POINTS { Ok(Self { points }) } else { Err(BoundaryError { found }) }
    }

    /// A rim without error, as the simulator gives it.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn exact(positions_m: impl IntoIterator<Item = Point3>) -> Result<Self, BoundaryError> {
        let exact = |position_m| BoundaryPoint { position_m, sigma_m: 0.0, observed: true };
        Self::new(positions_m.into_iter().map(exact).collect())
    }

    /// The points in order.
    #[must_use]
    pub fn points(&self) -> &[BoundaryPoint] {
        &self.points
    }

    /// The positions in order, simulation frame \[m\].
    pub fn positions_m(&self) -> impl Iterator<Item = Point3> + '_ {
        self.points.iter().map(|point| point.position_m)
    }

    /// The same, moved by so much \[m\].
    #[must_use]
    pub fn translated(&self, by_m: Vector3) -> Self {
        let moved = |p: &BoundaryPoint| BoundaryPoint { position_m: p.position_m + by_m, ..*p };
        Self { points: self.points.iter().map(moved).collect() }
    }

    /// Mean of the points' sigmas, per coordinate \[m\].
    #[must_use]
    pub fn mean_sigma_m(&self) -> f64 {
        self.points.iter().map(|point| point.sigma_m).sum::<f64>() / POINTS as f64
    }

    /// The flat specimen's coordinates (x, z) of point `index` \[m\].
    #[must_use]
    pub fn flat_xz_m(index: usize, specimen_side_m: f64) -> [f64; 2] {
        let half = 0.5 * specimen_side_m;
        let step = specimen_side_m / (POINTS_PER_SIDE - 1) as f64;
        let along = (index % POINTS_PER_SIDE) as f64 * step;
        match index / POINTS_PER_SIDE % SIDES {
            0 => [half, along - half],
            1 => [half - along, half],
            2 => [-half, half - along],
            _ => [along - half, -half],
        }
    }

    /// Mean distance between corresponding points of two rims \[m\].
    #[must_use]
    pub fn mean_distance_m(&self, other: &Self) -> f64 {
        self.distances_m(other)[0]
    }

    /// Mean and largest distance between corresponding points of two rims \[m\].
    #[must_use]
    pub fn distances_m(&self, other: &Self) -> [f64; 2] {
        let apart = self.positions_m().zip(other.positions_m()).map(|(a, b)| (a - b).norm());
        let [sum, largest] =
            apart.fold([0.0, 0.0_f64], |[sum, largest], d| [sum + d, largest.max(d)]);
        [sum / POINTS as f64, largest]
    }

    /// The same rim turned about the plate's axis to where it fits `other` best: least squares in
    /// the horizontal plane. A specimen may rotate as it falls, by up to some degrees; a scan that
    /// shows it at rest cannot know, and calls x where the warp lies.
    #[must_use]
    pub fn turned_onto(&self, other: &Self) -> Self {
        let pairs = self.positions_m().zip(other.positions_m());
        let (cos, sin) = pairs.fold((0.0, 0.0), |(cos, sin), (p, q)| {
            (cos + p.x * q.x + p.z * q.z, sin + p.x * q.z - p.z * q.x)
        });
        let (sin, cos) = sin.atan2(cos).sin_cos();
        let turn = |p: Point3| Point3::new(p.x * cos - p.z * sin, p.y, p.x * sin + p.z * cos);
        let points = self.points.iter();
        let points = points.map(|p| BoundaryPoint { position_m: turn(p.position_m), ..*p });
        Self { points: points.collect() }
    }

    /// The same rim with the specimen rotated by `quarter_turns` about the vertical:
    /// index 0 moves to the next corner and the positions rotate with it, so that the
    /// result is again in the module's frame. Two quarter turns keep weft and warp; one
    /// swaps them.
    #[must_use]
    pub fn rotated(&self, quarter_turns: usize) -> Self {
        let quarter_turns = quarter_turns % SIDES;
        let rotate = |p: Point3| match quarter_turns {
            0 => p,
            1 => Point3::new(p.z, p.y, -p.x),
            2 => Point3::new(-p.x, p.y, -p.z),
            _ => Point3::new(-p.z, p.y, p.x),
        };
        let points = (0..POINTS)
            .map(|index| {
                let from = self.points[(index + quarter_turns * POINTS_PER_SIDE) % POINTS];
                BoundaryPoint { position_m: rotate(from.position_m), ..from }
            })
            .collect();
        Self { points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat() -> Boundary {
        let at = |i| Boundary::flat_xz_m(i, 0.3);
        Boundary::exact((0..POINTS).map(|i| Point3::new(at(i)[0], 0.0, at(i)[1]))).unwrap()
    }

    #[test]
    fn a_rim_that_whirled_is_turned_back_and_no_farther() {
        let away = |p: Point3| Point3::new(p.x + 3e-3, p.y - 0.01, p.z);
        let moved = Boundary::exact(flat().positions_m().map(away)).unwrap();
        let (sin, cos) = 0.12_f64.sin_cos();
        let turn = |p: Point3| Point3::new(cos * p.x - sin * p.z, p.y, sin * p.x + cos * p.z);
        let turned = Boundary::exact(moved.positions_m().map(turn)).unwrap();
        assert!(turned.mean_distance_m(&moved) > 15e-3);
        assert!(turned.turned_onto(&moved).mean_distance_m(&moved) < 1e-12);
        // what is no rotation stays
        let off_m = turned.turned_onto(&flat()).mean_distance_m(&flat());
        assert!((off_m - 3e-3_f64.hypot(0.01)).abs() < 1e-6, "{off_m}");
    }

    #[test]
    fn walk_visits_the_four_sides_in_order_and_doubles_each_corner() {
        let rim = flat();
        let at = |i: usize| rim.points()[i].position_m * 1e3;
        assert!((at(0) - Point3::new(150.0, 0.0, -150.0)).norm() < 1e-9);
        assert!((at(1) - Point3::new(150.0, 0.0, -145.0)).norm() < 1e-9);
        assert!((at(61) - Point3::new(150.0, 0.0, 150.0)).norm() < 1e-9);
        assert!((at(62) - Point3::new(145.0, 0.0, 150.0)).norm() < 1e-9);
        for corner in 0..SIDES {
            let (end, start) = (corner * 61 + 60, (corner * 61 + 61) % POINTS);
            assert!((at(end) - at(start)).norm() < 1e-9, "corner after side {corner}");
        }
    }

    #[test]
    fn a_flat_square_is_unchanged_by_quarter_turns() {
        for quarters in 0..4 {
            assert!(flat().rotated(quarters).mean_distance_m(&flat()) < 1e-12, "{quarters}");
        }
    }

    #[test]
    fn four_quarter_turns_compose_to_none() {
        let mut rim = flat();
        for (i, point) in rim.points.iter_mut().enumerate() {
            point.position_m.y = (i as f64).sin();
            point.position_m.x += 0.01 * (i as f64).cos();
        }
        let once_thrice = rim.rotated(1).rotated(3);
        assert!(once_thrice.mean_distance_m(&rim) < 1e-15);
        assert!(rim.rotated(1).rotated(1).mean_distance_m(&rim.rotated(2)) < 1e-15);
    }

    #[test]
    fn a_wrong_number_of_points_is_refused() {
        assert!(Boundary::exact((0..240).map(|_| Point3::origin())).is_err());
    }
}

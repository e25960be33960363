//! A sheet of the specimen: where the places of the flat cloth lie in space.
//!
//! `n` x `n` places at even steps over the flat specimen. Place (i, j) has the index `i * n + j`; i
//! runs along the warp, j along the weft, as the simulator's vertices do: on the flat square (i, j)
//! lies at x = (i / (n - 1) - 1/2) side, z = (j / (n - 1) - 1/2) side. Positions are of the
//! simulation frame.

use super::boundary::POINTS_PER_SIDE;
use super::vectors::{Point3, Vector3};

/// Fewest places on a side: cubic interpolation needs four.
pub const LEAST_PLACES: usize = 4;

/// One place of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, simulation frame \[m\].
    pub position_m: Point3,
    /// Standard deviation of the position's error, per coordinate \[m\]; 0 for a simulated sheet.
    pub sigma_m: f64,
    /// Whether scanned points lie there; false where the sheet was bridged.
    pub observed: bool,
}

/// A sheet of the specimen, sampled at even steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    side: usize,
    points: Vec<SurfacePoint>,
}

/// A number of points that makes no sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} points make no sheet: give n x n of them, n at least {LEAST_PLACES}")]
pub struct SurfaceError {
    /// How many there are.
    pub found: usize,
}

impl Surface {
    /// Places on a side of the sheet that the scan path gives: 5 mm apart on the flat specimen, so
    /// that those of the sides are the rim's points.
    pub const SIDE: usize = POINTS_PER_SIDE;

    /// Takes n x n points in the module's order.
    ///
    /// # Errors
    /// When their number is no square of [`LEAST_PLACES`] or more.
    pub fn new(points: Vec<SurfacePoint>) -> Result<Self, SurfaceError> {
        let side = points.len().isqrt();
        if side < LEAST_PLACES || side * side != points.len() {
            return Err(SurfaceError { found: points.len() });
        }
        Ok(Self { side, points })
    }

    /// A sheet without error, as the simulator gives it.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn exact(positions_m: impl IntoIterator<Item = Point3>) -> Result<Self, SurfaceError> {
        let exact = |position_m| SurfacePoint { position_m, sigma_m: 0.0, observed: true };
        Self::new(positions_m.into_iter().map(exact).collect())
    }

    /// Number of places on a side.
    #[must_use]
    pub fn side(&self) -> usize {
        self.side
    }

    /// The same, moved by so much \[m\].
    #[must_use]
    pub fn translated(&self, by_m: Vector3) -> Self {
        let moved = |p: &SurfacePoint| SurfacePoint { position_m: p.position_m + by_m, ..*p };
        Self { side: self.side, points: self.points.iter().map(moved).collect() }
    }

    /// The places in order.
    #[must_use]
    pub fn points(&self) -> &[SurfacePoint] {
        &self.points
    }

    /// The place at the shares `[along the warp, along the weft]` of the specimen's extents, 0 to 1
    /// from its corner (-x, -z): the position is cubic along each direction and exact at the
    /// sheet's own places, the standard deviation is linear, and a place is observed if the nearest
    /// of the sheet's is.
    #[must_use]
    pub fn at(&self, shares: [f64; 2]) -> SurfacePoint {
        let last = (self.side - 1) as f64;
        let at = shares.map(|share| (share * last).clamp(0.0, last));
        let [cubic_i, cubic_j] = at.map(|at| cubic(at, self.side));
        let mut position_m = Vector3::zeros();
        for (i, wi) in (cubic_i.0..).zip(cubic_i.1) {
            for (j, wj) in (cubic_j.0..).zip(cubic_j.1) {
                position_m += self.points[i * self.side + j].position_m.coords * (wi * wj);
            }
        }
        let whole = at.map(|at| (at as usize).min(self.side - 2));
        let [a, b] = [0, 1].map(|c| at[c] - whole[c] as f64);
        let near = |di: usize, dj: usize| &self.points[(whole[0] + di) * self.side + whole[1] + dj];
        let sigma_m = (near(0, 0).sigma_m * (1.0 - b) + near(0, 1).sigma_m * b) * (1.0 - a)
            + (near(1, 0).sigma_m * (1.0 - b) + near(1, 1).sigma_m * b) * a;
        let observed = near(usize::from(a >= 0.5), usize::from(b >= 0.5)).observed;
        SurfacePoint { position_m: position_m.into(), sigma_m, observed }
    }
}

/// The first of four neighbouring places and their weights at `at` in 0..n-1, after Lagrange;
/// one-sided near the ends.
fn cubic(at: f64, n: usize) -> (usize, [f64; 4]) {
    let first = (at.floor() as isize - 1).clamp(0, n as isize - 4) as usize;
    let t = at - first as f64;
    let mut weights = [1.0; 4];
    for (k, weight) in weights.iter_mut().enumerate() {
        for m in (0..4).filter(|&m| m != k) {
            *weight *= (t - m as f64) / (k as f64 - m as f64);
        }
    }
    (first, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape([u, v]: [f64; 2]) -> Point3 {
        Point3::new(u * u * u - v, u * v * v, 1.0 + v * v * v + u * u * v)
    }

    fn of(n: usize) -> Surface {
        let share = |k: usize| k as f64 / (n - 1) as f64;
        Surface::exact((0..n * n).map(|k| shape([share(k / n), share(k % n)]))).unwrap()
    }

    #[test]
    fn a_sheet_of_cubics_is_exact_between_its_places_and_at_its_sides() {
        for n in [4, 5, 61] {
            for at in [[0.0, 0.0], [1.0, 0.3], [0.37, 1.0], [0.5, 0.123], [0.991, 0.004]] {
                let off = (of(n).at(at).position_m - shape(at)).norm();
                assert!(off < 1e-13, "{n} {at:?} {off}");
            }
        }
        let surface = of(7);
        assert_eq!(surface.at([0.5, 1.0]).position_m, surface.points()[3 * 7 + 6].position_m);
    }

    #[test]
    fn sigma_and_flag_are_those_of_the_places_around() {
        let mut points = of(5).points().to_vec();
        points[2 * 5 + 3] = SurfacePoint { sigma_m: 4e-3, observed: false, ..points[0] };
        let surface = Surface::new(points).unwrap();
        let near = surface.at([0.5, 0.75 - 0.1]);
        assert!((near.sigma_m - 0.6 * 4e-3).abs() < 1e-15 && !near.observed);
        let far = surface.at([0.5, 0.75 - 0.15]);
        assert!((far.sigma_m - 0.4 * 4e-3).abs() < 1e-15 && far.observed);
    }

    #[test]
    fn points_that_make_no_sheet_are_refused() {
        for count in [0, 9, 15, 3722] {
            let points = (0..count).map(|_| Point3::origin());
            assert_eq!(Surface::exact(points), Err(SurfaceError { found: count }));
        }
    }
}

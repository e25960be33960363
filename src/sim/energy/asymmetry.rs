//! Bending that is stiffer towards one face of the cloth than towards the other.
//!
//! The moment per width of a strip bent to the curvature k, positive towards the face, is
//!
//! `M = B k (1 + a s(k))`, `s(k) = k / sqrt(k^2 + k0^2)`  \[N\]
//!
//! along the weft and along the warp: `B (1 + a)` towards the face, `B (1 - a)` towards the back.
//! What it adds to the plate energy of `bending.rs` is
//!
//! `E = integral [ a^u B^u p(k_uu) + a^v B^v p(k_vv) ]`, `p(k) = integral of k s(k) = +-(|k| r -
//! k0^2 asinh(|k| / k0)) / 2`, `r = sqrt(k^2 + k0^2)` \[J\]
//!
//! **Why this s.** The energy has continuous derivatives of every order, which Newton steps and the
//! sensitivities ask for, and no kink where flat cloth lies; M / k is within 1 % of B (1 +- a) from
//! 7 k0 on. The tangent stiffness overshoots to 1 + 1.09 a at 1.4 k0. Not taken: s for the slope of
//! the moment instead (`M = B (k + a (r - k0))`), whose tangent never overshoots but whose moment
//! lacks a B k0 for good, a tenth of the effect at 50 /m.
//!
//! **Why k less the natural curvature.** k is `x_ab . n` (`signed.rs`) less that: the cloth is
//! stiffer to one side of the shape that it rests in, which so stays the natural curvature. With k
//! alone the moment would vanish elsewhere.
//!
//! **With softening** the moment that is scaled is the softened one, `B k (1 - c |k|) (1 + a s(k))`
//! with its linear continuation, so that the tangent stays positive on both sides. (Softening
//! itself counts the whole curvature; beside a natural curvature the two differ by it.)
//!
//! **Why no number for the bias.** A twist has both faces bent alike, so that its sign tells
//! nothing. Bending about a 45 degree line is asymmetric by what weft and warp give it, `(a^u B^u +
//! a^v B^v) / (4 B^h)`: half of a where all is equal. Tried and dropped: a third term in k_uu +
//! k_vv, which on a sheet bent about any one line is its curvature. It makes equal numbers the same
//! about every line, but it couples the two curvatures as a Poisson ratio of a does: a strip of 30
//! mm, free to bend across, ended 1.6 % of its length from the law's elastica at a = 0.3 (without
//! that term 0.04 %). Not tried: a twist whose stiffness goes by the sign of k_uu + k_vv. It has no
//! such ratio, but it couples vertices that the grid's pattern does not.
//!
//! The projected Hessian keeps what is positive along the curvature and leaves the rest out.
//!
//! Fails: as `signed.rs` does.

use super::Energy;
use super::curl;
use super::signed::Signed;
use super::softened::{Piece, SoftenedMoment};
use super::softening::{combine, components};
use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::sim::experiment::Experiment;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// The curvature k0 over which the stiffness goes from that of one side to that of the other
/// \[1/m\]: a seventh to a tenth of what drapes bend to at the plate's edge, and several steps of a
/// solver near rest. Chosen, not measured.
pub const SMOOTHING_PER_M: f64 = 5.0;

/// The integral of `a s(k) M(k)`, with the moment M of cloth that may soften.
#[derive(Clone, Copy, Debug)]
struct Law {
    /// The sign of a; 0 without asymmetry.
    sign: f64,
    /// |a| M.
    softened: SoftenedMoment,
}

impl Law {
    /// The law of an asymmetry `a` of this rigidity, softened by `soft_m`, which was measured up to
    /// a curvature.
    fn new(a: f64, rigidity_nm: f64, soft_m: f64, measured_to_per_m: f64) -> Self {
        let stiffness = a.abs() * rigidity_nm;
        let softened = SoftenedMoment::new(stiffness, stiffness * soft_m, measured_to_per_m);
        Self { sign: if a == 0.0 { 0.0 } else { a.signum() }, softened }
    }

    /// Value, first and second derivative at the curvature `k`.
    fn at(&self, k: f64) -> [f64; 3] {
        let (side, size) = (self.sign * 1.0_f64.copysign(k), k.abs());
        let root = |size: f64| size.hypot(SMOOTHING_PER_M);
        let r = root(size);
        // integrals of s, s k and s k^2, from 0
        let zeroth = |size: f64| size * size / (root(size) + SMOOTHING_PER_M);
        let first = |size: f64| {
            let flat = SMOOTHING_PER_M * SMOOTHING_PER_M * (size / SMOOTHING_PER_M).asinh();
            0.5 * (size * root(size) - flat)
        };
        let second = |size: f64| {
            let d = zeroth(size);
            d * d * (SMOOTHING_PER_M + d / 3.0)
        };
        let integral = |piece: Piece, size: f64| {
            piece.constant * zeroth(size)
                + piece.linear * first(size)
                + piece.quadratic * second(size)
        };
        let parts = self.softened.up_to(size);
        let value: f64 = parts.map(|(p, to)| integral(p, to) - integral(p, p.from)).sum();
        let [_, moment, tangent] = self.softened.at(size);
        let s = size / r;
        let tangent = s * tangent + moment * (SMOOTHING_PER_M / r).powi(2) / r;
        [side * value, self.sign * s * moment, side * tangent]
    }
}

/// One curvature at one place.
#[derive(Clone, Debug)]
struct Sided {
    place: Signed,
    natural_per_m: f64,
    area_m2: f64,
    law: Law,
}

/// The asymmetric part of the bending energy on a grid.
#[derive(Clone, Debug)]
pub struct AsymmetryEnergy {
    places: Vec<Sided>,
}

impl AsymmetryEnergy {
    /// The energy of `fabric` with the experiment's asymmetric bending; `None` if that is off.
    #[must_use]
    pub fn new(grid: &Grid, fabric: &Fabric, experiment: &Experiment) -> Option<Self> {
        if experiment.asymmetric_bending.is_off() {
            return None;
        }
        let (a, soft) = (&experiment.asymmetric_bending, &experiment.softening);
        let [weft, warp, _] = components(grid);
        let sides = [
            (weft, Law::new(a.weft, fabric.bending_weft_nm, soft.weft_m, soft.measured_to_per_m)),
            (warp, Law::new(a.warp, fabric.bending_warp_nm, soft.warp_m, soft.measured_to_per_m)),
        ];
        let unit = grid.spacing_m.powi(-2);
        let around = grid.cells_around();
        let mut places = Vec::new();
        for v in 0..grid.vertices() {
            let naturals = curl::natural_at(grid, &experiment.curl, v);
            for ((parts, law), natural_per_m) in sides.into_iter().zip(naturals) {
                let combination = combine(grid, v, parts, &around[v]);
                let Some(mut a) = combination.filter(|_| law.sign != 0.0) else {
                    continue;
                };
                a.iter_mut().for_each(|(_, weight)| *weight *= unit);
                let area_m2 = grid.cell_area_m2() * grid.share(v);
                let place = Signed::at_vertex(grid, &a, v);
                places.push(Sided { place, natural_per_m, area_m2, law });
            }
        }
        Some(Self { places })
    }
}

impl Energy for AsymmetryEnergy {
    /// Zero for a sheet in its natural shape.
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        let of = |p: &Sided| p.area_m2 * p.law.at(p.place.at(x).part - p.natural_per_m)[0];
        self.places.iter().map(of).sum()
    }

    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for sided in &self.places {
            let at = sided.place.at(x);
            let [_, slope, _] = sided.law.at(at.part - sided.natural_per_m);
            sided.place.add_gradient(&at, sided.area_m2 * slope, gradient);
        }
    }

    /// The projected form keeps what stiffens along each curvature.
    fn add_hessian(&self, grid: &Grid, x: &[Vector3], form: HessianForm, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        for sided in &self.places {
            let at = sided.place.at(x);
            let [_, slope, rise] =
                sided.law.at(at.part - sided.natural_per_m).map(|v| v * sided.area_m2);
            let parts = match form {
                HessianForm::Exact => [slope, rise],
                HessianForm::Projected => [0.0, rise.max(0.0)],
            };
            sided.place.add_hessian(&at, parts, pattern, values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::energy::difference::{cylinder, errors, flat_with_noise, grids};
    use crate::sim::experiment::{AsymmetricBending, Curl, Softening};
    use std::sync::Arc;

    fn fabric() -> Fabric {
        Fabric::from_paper_units([1e5, 1e5, 1e5, 1000.0, 1500.0, 1300.0, 200.0])
    }

    fn experiment(softening: Softening) -> Experiment {
        let asymmetric_bending = AsymmetricBending { weft: 0.3, warp: -0.2 };
        let curl = Curl::uniform([3.0, -2.0, 1.0]);
        Experiment { asymmetric_bending, softening, curl, ..Experiment::default() }
    }

    #[test]
    fn gradient_and_hessian_are_difference_quotients_around_zero_and_beyond_the_limit() {
        let softening =
            Softening { weft_m: 5e-3, warp_m: 8e-3, bias_m: 4e-3, ..Softening::default() };
        for softening in [Softening::default(), softening] {
            for grid in grids() {
                let energy =
                    AsymmetryEnergy::new(&grid, &fabric(), &experiment(softening)).unwrap();
                // curvatures of some k0, and of ten times as much
                for noise in [0.01, 0.2] {
                    let x = flat_with_noise(&grid, noise);
                    let beyond = |p: &&Sided| {
                        (p.place.at(&x).part - p.natural_per_m).abs()
                            > p.law.softened.pieces[1].from
                    };
                    let beyond = energy.places.iter().filter(beyond).count();
                    let softened = softening != Softening::default() && noise == 0.2;
                    assert_eq!(beyond > 5, softened, "{beyond}");
                    let [gradient, hessian] = errors(&grid, &x, &energy);
                    // observed floors 3e-8 and 3e-7
                    assert!(gradient < 2e-7 && hessian < 3e-6, "{gradient:e} {hessian:e}");
                }
            }
        }
    }

    #[test]
    fn value_slope_and_curvature_of_the_law_are_difference_quotients_on_both_sides_of_every_case() {
        for soft_m in [0.0, 6e-3] {
            let law = Law::new(0.5, 2e-6, soft_m, 100.0);
            for k in [-200.0, -80.0, -79.0, -20.0, -5.0, -0.1, 0.1, 4.0, 30.0, 79.0, 80.0, 150.0] {
                let step = 1e-4;
                let [_, slope, rise] = law.at(k);
                let (above, below) = (law.at(k + step), law.at(k - step));
                let quotient = |n: usize| (above[n] - below[n]) / (2.0 * step);
                assert!((quotient(0) - slope).abs() < 1e-7 * slope.abs().max(1e-6), "{k}");
                assert!((quotient(1) - rise).abs() < 1e-6 * 1e-6, "{k}");
            }
            let [value, slope, rise] = law.at(0.0);
            assert!(value == 0.0 && slope == 0.0 && rise == 0.0);
            // C2 where the parabola ends
            let limit = law.softened.pieces[1].from;
            let limit = if limit.is_finite() { limit } else { 60.0 };
            let (before, after) = (law.at(limit - 1e-9), law.at(limit + 1e-9));
            assert!((before[2] - after[2]).abs() < 1e-8 * 1e-6);
        }
    }

    /// Energy per area away from the border of the sheet bent to a cylinder.
    fn of_cylinder(experiment: &Experiment, degrees: f64, k: f64) -> f64 {
        let of = |cells: usize| {
            let h = 2.5e-3;
            let grid: Arc<Grid> = Grid::shared(cells + 1, h * cells as f64);
            let x = cylinder(&grid, degrees, k);
            AsymmetryEnergy::new(&grid, &fabric(), experiment).unwrap().energy_j(&grid, &x)
                / (h * h)
        };
        // the second difference in the size leaves out border and corners
        0.5 * (of(22) - 2.0 * of(21) + of(20))
    }

    #[test]
    fn a_cylinder_costs_its_direction_s_law_and_the_other_sign_on_the_other_side() {
        let f = fabric();
        let asymmetric_bending = AsymmetricBending { weft: 0.3, warp: -0.1 };
        let uneven = Experiment { asymmetric_bending, ..Experiment::default() };
        let a = &asymmetric_bending;
        let k = 40.0;
        let [weft, warp] = [a.weft * f.bending_weft_nm, a.warp * f.bending_warp_nm];
        let p = |k: f64| {
            let r = f64::hypot(k, SMOOTHING_PER_M);
            0.5 * (k * r - SMOOTHING_PER_M.powi(2) * (k / SMOOTHING_PER_M).asinh())
        };
        let cases = [(0.0, weft * p(k)), (90.0, warp * p(k)), (45.0, (weft + warp) * p(0.5 * k))];
        for (degrees, nominal) in cases {
            let (face, back) =
                (of_cylinder(&uneven, degrees, k), of_cylinder(&uneven, degrees, -k));
            assert!((face + back).abs() < 1e-9 * face.abs(), "{degrees}: {face:e} {back:e}");
            // second differences of a circle: -(k h)^2 / 6
            let error = face / nominal - 1.0;
            assert!(error.abs() < 4e-3, "{degrees}: {error:e}");
        }
    }

    #[test]
    fn off_is_none_and_a_rigid_motion_changes_nothing() {
        let grid = Grid::shared(7, 0.03);
        assert!(AsymmetryEnergy::new(&grid, &fabric(), &Experiment::default()).is_none());
        let energy =
            AsymmetryEnergy::new(&grid, &fabric(), &experiment(Softening::default())).unwrap();
        let x = flat_with_noise(&grid, 0.1);
        let motion =
            nalgebra::Isometry3::new(Vector3::new(0.3, -0.2, 1.0), Vector3::new(1.0, 2.0, 0.5));
        let moved: Vec<_> =
            x.iter().map(|&p| (motion * nalgebra::Point3::from(p)).coords).collect();
        let (before, after) = (energy.energy_j(&grid, &x), energy.energy_j(&grid, &moved));
        assert!((before - after).abs() < 1e-9 * before.abs(), "{before:e} {after:e}");
    }

    #[test]
    fn the_mirrored_sheet_of_the_cloth_laid_face_down_has_the_same_energy() {
        let grid = Grid::shared(7, 0.03);
        let asymmetric_bending = AsymmetricBending { weft: 0.3, warp: -0.2 };
        let up = Experiment { asymmetric_bending, ..Experiment::default() };
        let down = Experiment {
            asymmetric_bending: asymmetric_bending.face_down(),
            ..Experiment::default()
        };
        let [up, down] = [up, down].map(|e| AsymmetryEnergy::new(&grid, &fabric(), &e).unwrap());
        let x = flat_with_noise(&grid, 0.1);
        let mirrored: Vec<_> = x.iter().map(|p| Vector3::new(p.x, -p.y, p.z)).collect();
        let (of_up, of_down) = (up.energy_j(&grid, &x), down.energy_j(&grid, &mirrored));
        assert!((of_up - of_down).abs() < 1e-12 * of_up.abs(), "{of_up:e} {of_down:e}");
        assert!(of_up * up.energy_j(&grid, &mirrored) < 0.0);
    }
}

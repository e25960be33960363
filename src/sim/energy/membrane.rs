//! Weft and warp stretch and shear of one grid cell.
//!
//! The condition energies of Baraff and Witkin 1998 (section 4.2), per area:
//!
//! `E = A/2 [ S^u (|w_u| - 1)^2 + S^v (|w_v| - 1)^2 + H (w_u . w_v)^2 ]`  \[J\]
//!
//! with `w_u`, `w_v` the derivatives of position along weft and warp, which on a grid rotated
//! against the yarns mix the differences along both of its directions
//! ([`MaterialFrame::derivatives`]). They are taken once a cell, at its centre (one-point
//! quadrature of the bilinear cell), not on triangles: two triangles a cell make the stiffness
//! depend on the diagonal, and averaging both diagonals locks: a cylinder at 45 degrees of
//! curvature k costs H (k h)^4 / 512 a unit area, at k = 100/m and h = 5 mm more than bending the
//! mean knit (`docs/design/simulator.md`).
//!
//! One point leaves the cell's in-plane twist `g = x_00 - x_10 - x_01 + x_11`
//! free. Its in-plane part is held at the bilinear cell's own stiffness,
//!
//! `E_g = A/24 [ S^u (g . w_u)^2 + S^v (g . w_v)^2 ] / h^2`
//!
//! which is exactly the energy of the stretch's variation across the cell; where the yarns do
//! not run along the cell's sides, or these differ, each 1/h^2 is the sum of the squares of the
//! two derivatives. The normal part of g is twist and belongs to bending.
//!
//! In a fold about a line at 45 degrees the cells' sides bend alike and g is of the order k^2 h^3
//! in plane, so that the hold costs what the sheet would not: it locks where the plate's edge
//! bends the sheet most. Numerics 4 hold a part of it ([`Numerics::twist_hold`]).
//!
//! Tests: value, gradient and Hessian against finite differences, invariance under rigid motion,
//! no locking on cylinders at any angle. Where it fails: a cell that collapses to a line has no
//! directions left, and compression is as stiff as tension.

use nalgebra::Matrix3;

use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::sim::grid::{Grid, MaterialFrame};
use crate::sim::hessian_form::HessianForm;
#[cfg(doc)]
use crate::sim::numerics::Numerics;

/// The stretch and shear energy of one cell, whole.
#[derive(Clone, Copy, Debug)]
pub struct Membrane {
    /// Weft stretch stiffness \[N/m\].
    stretch_weft_n_m: f64,
    /// Warp stretch stiffness \[N/m\].
    stretch_warp_n_m: f64,
    /// Shear stiffness \[N/m\].
    shear_n_m: f64,
    /// Area of the cell \[m^2\].
    area_m2: f64,
    /// Weights of the doubled differences along i and j in w_u \[1/m\].
    weft: [f64; 2],
    /// Weights of the doubled differences along i and j in w_v \[1/m\].
    warp: [f64; 2],
    /// S^u and S^v for the twist's in-plane part: themselves on square cells with the whole hold
    /// \[N/m\].
    twist_n_m: [f64; 2],
}

/// The positions of a cell's corners (i, j), (i+1, j), (i, j+1), (i+1, j+1) \[m\].
pub type Corners = [Vector3; 4];

/// The cell's derivatives: weft, warp, and the twist g.
struct Derivatives {
    weft: Vector3,
    warp: Vector3,
    twist: Vector3,
}

/// The stress of a cell: what multiplies the second derivatives of the five conditions (weft and
/// warp stretch, shear, and the two in-plane parts of the twist) in the Hessian. That part of the
/// Hessian is the geometric stiffness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    weft: f64,
    warp: f64,
    shear: f64,
    twist_weft: f64,
    twist_warp: f64,
}

impl Stress {
    /// The tension whole, and this part of the compression and of the shear.
    #[must_use]
    pub fn relieved(self, kept: f64) -> Self {
        let relieve = |s: f64| s.max(0.0) + kept * s.min(0.0);
        Self {
            weft: relieve(self.weft),
            warp: relieve(self.warp),
            shear: kept * self.shear,
            twist_weft: kept * self.twist_weft,
            twist_warp: kept * self.twist_warp,
        }
    }
}

/// Signs of the corners in the doubled differences along j and i, and in the twist.
const SIGNS: [[f64; 4]; 3] =
    [[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0], [1.0, -1.0, -1.0, 1.0]];

impl Membrane {
    /// The energies of the cells of `grid` made of `fabric`, one a cell, with `twist_hold` times
    /// the whole hold of the twist's in-plane part.
    #[must_use]
    pub fn of_cells(grid: &Grid, fabric: &Fabric, twist_hold: f64) -> Vec<Self> {
        let of = |sides| Self::of_cell(&grid.frame, grid.spacing_m, sides, fabric, twist_hold);
        grid.sides.iter().map(|&sides| of(sides)).collect()
    }

    /// The energy of a cell whose sides are `sides` times the frame's steps over `spacing_m`.
    fn of_cell(
        frame: &MaterialFrame,
        spacing_m: f64,
        sides: [f64; 2],
        fabric: &Fabric,
        twist_hold: f64,
    ) -> Self {
        let [weft, warp] = frame.derivatives().map(|by| [by[0] / sides[0], by[1] / sides[1]]);
        let area = frame.area() * (sides[0] * sides[1]);
        let twist = |by: [f64; 2]| twist_hold * area * (by[0] * by[0] + by[1] * by[1]);
        let scale = 0.5 / spacing_m;
        Self {
            stretch_weft_n_m: fabric.stretch_weft_n_m,
            stretch_warp_n_m: fabric.stretch_warp_n_m,
            shear_n_m: fabric.shear_n_m,
            area_m2: spacing_m * spacing_m * area,
            weft: weft.map(|by| by * scale),
            warp: warp.map(|by| by * scale),
            twist_n_m: [
                fabric.stretch_weft_n_m * twist(weft),
                fabric.stretch_warp_n_m * twist(warp),
            ],
        }
    }

    fn derivatives(&self, x: &Corners) -> Derivatives {
        let (by_i, by_j) = (x[1] - x[0] + x[3] - x[2], x[2] - x[0] + x[3] - x[1]);
        Derivatives {
            weft: by_j * self.weft[1] + by_i * self.weft[0],
            warp: by_i * self.warp[0] + by_j * self.warp[1],
            twist: x[0] - x[1] - x[2] + x[3],
        }
    }

    /// Stiffness of the twist's in-plane part per S: A / (12 h^2) = 1/12.
    const TWIST: f64 = 1.0 / 12.0;

    /// Energy of a cell with these corners \[J\].
    #[must_use]
    pub fn energy_j(&self, x: &Corners) -> f64 {
        let d = self.derivatives(x);
        let weft = d.weft.norm() - 1.0;
        let warp = d.warp.norm() - 1.0;
        let shear = d.weft.dot(&d.warp);
        let (gu, gv) = (d.twist.dot(&d.weft), d.twist.dot(&d.warp));
        let (su, sv) = (self.stretch_weft_n_m, self.stretch_warp_n_m);
        let [tu, tv] = self.twist_n_m;
        0.5 * self.area_m2 * (su * weft * weft + sv * warp * warp + self.shear_n_m * shear * shear)
            + 0.5 * Self::TWIST * (tu * gu * gu + tv * gv * gv)
    }

    /// Adds the gradient of a cell's energy by its four corners \[N\].
    pub fn add_gradient(&self, x: &Corners, gradient: &mut [Vector3; 4]) {
        let d = self.derivatives(x);
        let area = self.area_m2;
        let (su, sv) = (self.stretch_weft_n_m, self.stretch_warp_n_m);
        let [tu, tv] = self.twist_n_m;
        let (lu, lv) = (d.weft.norm(), d.warp.norm());
        let shear = area * self.shear_n_m * d.weft.dot(&d.warp);
        let gu = Self::TWIST * tu * d.twist.dot(&d.weft);
        let gv = Self::TWIST * tv * d.twist.dot(&d.warp);
        let by_weft = d.weft * (area * su * (1.0 - 1.0 / lu)) + d.warp * shear + d.twist * gu;
        let by_warp = d.warp * (area * sv * (1.0 - 1.0 / lv)) + d.weft * shear + d.twist * gv;
        let by_j = by_weft * self.weft[1] + by_warp * self.warp[1];
        let by_i = by_warp * self.warp[0] + by_weft * self.weft[0];
        let by_twist = d.weft * gu + d.warp * gv;
        for (k, g) in gradient.iter_mut().enumerate() {
            *g += by_j * SIGNS[0][k] + by_i * SIGNS[1][k] + by_twist * SIGNS[2][k];
        }
    }

    /// How much more one of the cell's sides is stretched than the one facing it, along weft and
    /// along warp: the in-plane part of the twist over the sides' length. Where it alternates from
    /// cell to cell, the sheet hourglasses.
    #[must_use]
    pub fn in_plane_twist(&self, x: &Corners) -> [f64; 2] {
        let d = self.derivatives(x);
        let by = |[i, j]: [f64; 2]| 2.0 * i.hypot(j);
        [d.twist.dot(&d.weft) * by(self.weft), d.twist.dot(&d.warp) * by(self.warp)]
    }

    /// The stress of a cell with the corners `x`.
    #[must_use]
    pub fn stress(&self, x: &Corners) -> Stress {
        self.stress_of(&self.derivatives(x))
    }

    fn stress_of(&self, d: &Derivatives) -> Stress {
        let area = self.area_m2;
        Stress {
            weft: area * self.stretch_weft_n_m * (d.weft.norm() - 1.0),
            warp: area * self.stretch_warp_n_m * (d.warp.norm() - 1.0),
            shear: area * self.shear_n_m * d.weft.dot(&d.warp),
            twist_weft: Self::TWIST * self.twist_n_m[0] * d.twist.dot(&d.weft),
            twist_warp: Self::TWIST * self.twist_n_m[1] * d.twist.dot(&d.warp),
        }
    }

    /// The stress at `x`, with `weight` times the tension along weft and warp that the move `dx`
    /// would cause beyond what the linearisation at `x` predicts: where a cell rotates, a straight
    /// move stretches it to second order. As the stress of the next geometric stiffness it makes
    /// the Hessian stiff where the last move would have been cut short.
    #[must_use]
    pub fn second_order_stress(&self, x: &Corners, dx: &Corners, weight: f64) -> Stress {
        let now = self.stress(x);
        let after = self.stress(&std::array::from_fn(|k| x[k] + dx[k]));
        let linear = self.linearised_stress(x, dx);
        Stress {
            weft: now.weft.max(0.0) + weight * (after.weft - linear.weft).max(0.0),
            warp: now.warp.max(0.0) + weight * (after.warp - linear.warp).max(0.0),
            ..now
        }
    }

    /// The stress that the linearisation at `x` predicts after the move `dx`. A Newton step along a
    /// stiff sheet's tangent strains it to second order; a geometric stiffness with that strain's
    /// tension is far too stiff, one with the predicted tension (the multiplier of a constrained
    /// method) is not.
    #[must_use]
    pub fn linearised_stress(&self, x: &Corners, dx: &Corners) -> Stress {
        let (d, e) = (self.derivatives(x), self.derivatives(dx));
        let area = self.area_m2;
        let now = self.stress_of(&d);
        let (su, sv) = (self.stretch_weft_n_m, self.stretch_warp_n_m);
        let [tu, tv] = self.twist_n_m;
        let shear = d.weft.dot(&e.warp) + d.warp.dot(&e.weft);
        let gu = d.twist.dot(&e.weft) + e.twist.dot(&d.weft);
        let gv = d.twist.dot(&e.warp) + e.twist.dot(&d.warp);
        Stress {
            weft: now.weft + area * su * d.weft.dot(&e.weft) / d.weft.norm(),
            warp: now.warp + area * sv * d.warp.dot(&e.warp) / d.warp.norm(),
            shear: now.shear + area * self.shear_n_m * shear,
            twist_weft: now.twist_weft + Self::TWIST * tu * gu,
            twist_warp: now.twist_warp + Self::TWIST * tv * gv,
        }
    }

    /// Second derivatives by (difference along j, along i, twist), 3 x 3 blocks. The projected form
    /// is Gauss-Newton's with the tension, and without compression and shear.
    fn second(
        &self,
        d: &Derivatives,
        stress: &Stress,
        form: HessianForm,
    ) -> [[Matrix3<f64>; 3]; 3] {
        let area = self.area_m2;
        let (su, sv, h) =
            (area * self.stretch_weft_n_m, area * self.stretch_warp_n_m, area * self.shear_n_m);
        let (ku, kv) = (Self::TWIST * self.twist_n_m[0], Self::TWIST * self.twist_n_m[1]);
        let (weft, warp, twist) = (&d.weft, &d.warp, &d.twist);
        let stretch = |w: &Vector3, s: f64, tension: f64| {
            let length = w.norm();
            let along = w * w.transpose() / (length * length);
            let tension = match form {
                HessianForm::Projected => tension.max(0.0),
                HessianForm::Exact => tension,
            };
            along * s + (Matrix3::identity() - along) * (tension / length)
        };
        let uu = stretch(weft, su, stress.weft)
            + warp * warp.transpose() * h
            + twist * twist.transpose() * ku;
        let vv = stretch(warp, sv, stress.warp)
            + weft * weft.transpose() * h
            + twist * twist.transpose() * kv;
        let mut uv = warp * weft.transpose() * h;
        let mut ug = twist * weft.transpose() * ku;
        let mut vg = twist * warp.transpose() * kv;
        let gg = weft * weft.transpose() * ku + warp * warp.transpose() * kv;
        if form == HessianForm::Exact {
            uv += Matrix3::identity() * stress.shear;
            ug += Matrix3::identity() * stress.twist_weft;
            vg += Matrix3::identity() * stress.twist_warp;
        }
        let ([ui, uj], [vi, vj]) = (self.weft, self.warp);
        let vu = uv.transpose();
        let mixed = |a: f64, b: f64, c: f64, d: f64| {
            // (a u + b v) by (c u + d v)
            uu * (a * c) + vv * (b * d) + uv * (a * d) + vu * (b * c)
        };
        let (jj, ii, ji) = (mixed(uj, vj, uj, vj), mixed(ui, vi, ui, vi), mixed(uj, vj, ui, vi));
        let (jg, ig) = (ug * uj + vg * vj, vg * vi + ug * ui);
        [[jj, ji, jg], [ji.transpose(), ii, ig], [jg.transpose(), ig.transpose(), gg]]
    }

    /// Gives the Hessian of a cell's energy \[N/m\] block by block: calls `put(row, column, block)`
    /// with numbers of corners, first for the four diagonal blocks, then for `pairs` in their
    /// order. It is exact with the [`Self::stress`] of `x`.
    pub fn hessian(
        &self,
        x: &Corners,
        stress: &Stress,
        form: HessianForm,
        pairs: &[(usize, usize)],
        mut put: impl FnMut(usize, usize, &Matrix3<f64>),
    ) {
        let second = self.second(&self.derivatives(x), stress, form);
        // right half of B^T H B: H B for each corner
        let column = |c: usize, p: usize| {
            second[p][0] * SIGNS[0][c] + second[p][1] * SIGNS[1][c] + second[p][2] * SIGNS[2][c]
        };
        let columns: [[Matrix3<f64>; 3]; 4] =
            std::array::from_fn(|c| std::array::from_fn(|p| column(c, p)));
        let block = |r: usize, c: usize| {
            columns[c][0] * SIGNS[0][r] + columns[c][1] * SIGNS[1][r] + columns[c][2] * SIGNS[2][r]
        };
        for corner in 0..4 {
            put(corner, corner, &block(corner, corner));
        }
        for &(r, c) in pairs {
            put(r, c, &block(r, c));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::seed;
    use rand::RngExt as _;

    const SPACING_M: f64 = 0.005;
    /// Cells along the yarns, rotated against them, and skewed oblong ones rotated against them;
    /// the sides of the last two differ besides.
    const FRAMES: [MaterialFrame; 3] = [
        MaterialFrame::ALIGNED,
        MaterialFrame { warp_rad: 0.6, ..MaterialFrame::ALIGNED },
        MaterialFrame { step_i: [1.1, 0.0], step_j: [0.2, 0.9], warp_rad: -0.3 },
    ];

    fn membrane(frame: &MaterialFrame) -> Membrane {
        let fabric = Fabric::from_paper_units([131e3, 164e3, 75e3, 1e3, 1e3, 1e3, 200.0]);
        Membrane::of_cell(frame, SPACING_M, sides(frame), &fabric, 1.0)
    }

    fn sides(frame: &MaterialFrame) -> [f64; 2] {
        if *frame == MaterialFrame::ALIGNED { [1.0; 2] } else { [1.3, 0.8] }
    }

    const ALL: [(usize, usize); 12] = [
        (1, 0),
        (2, 0),
        (3, 0),
        (2, 1),
        (3, 1),
        (3, 2),
        (0, 1),
        (0, 2),
        (0, 3),
        (1, 2),
        (1, 3),
        (2, 3),
    ];

    fn cell(index: u64) -> Corners {
        let mut rng = seed::rng(1, "cell", index);
        let h = SPACING_M;
        let rotation = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.7);
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[i, j]: [f64; 2]| {
            let noise = Vector3::from_fn(|_, _| rng.random_range(-0.2..0.2));
            rotation * (Vector3::new(i, 0.0, j) + noise) * h
        })
    }

    fn gradient(membrane: &Membrane, x: &Corners) -> [Vector3; 4] {
        let mut g = [Vector3::zeros(); 4];
        membrane.add_gradient(x, &mut g);
        g
    }

    #[test]
    fn gradient_is_the_difference_quotient_of_the_energy() {
        for index in 0..20 {
            let membrane = membrane(&FRAMES[index % 3]);
            let x = cell(index as u64);
            let g = gradient(&membrane, &x);
            let norm = g.iter().map(Vector3::norm).fold(0.0, f64::max);
            for k in 0..12 {
                let step = 1e-8;
                let moved = |by: f64| {
                    let mut y = x;
                    y[k / 3][k % 3] += by;
                    membrane.energy_j(&y)
                };
                let numeric = (moved(step) - moved(-step)) / (2.0 * step);
                let error = (numeric - g[k / 3][k % 3]).abs() / norm;
                // observed floor 5e-8; a wrong sign scores 1
                assert!(error < 5e-7, "cell {index}, {k}: {error:e}");
            }
        }
    }

    #[test]
    fn hessian_is_the_difference_quotient_of_the_gradient() {
        for index in 0..20 {
            let membrane = membrane(&FRAMES[index % 3]);
            let x = cell(index as u64);
            let mut full = nalgebra::SMatrix::<f64, 12, 12>::zeros();
            membrane.hessian(&x, &membrane.stress(&x), HessianForm::Exact, &ALL, |r, c, b| {
                full.fixed_view_mut::<3, 3>(3 * r, 3 * c).copy_from(b);
            });
            for k in 0..12 {
                let step = 1e-8;
                let moved = |by: f64| {
                    let mut y = x;
                    y[k / 3][k % 3] += by;
                    gradient(&membrane, &y)
                };
                let (plus, minus) = (moved(step), moved(-step));
                for m in 0..12 {
                    let numeric = (plus[m / 3][m % 3] - minus[m / 3][m % 3]) / (2.0 * step);
                    let error = (numeric - full[(m, k)]).abs() / full.amax();
                    // observed floor 3e-8
                    assert!(error < 3e-7, "cell {index}, {m}, {k}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn projected_hessian_has_no_negative_eigenvalue() {
        for index in 0..50 {
            let mut full = nalgebra::SMatrix::<f64, 12, 12>::zeros();
            let membrane = membrane(&FRAMES[index % 3]);
            let x = cell(index as u64);
            membrane.hessian(&x, &membrane.stress(&x), HessianForm::Projected, &ALL, |r, c, b| {
                full.fixed_view_mut::<3, 3>(3 * r, 3 * c).copy_from(b);
            });
            let eigen = full.symmetric_eigenvalues();
            assert!(eigen.min() > -1e-12 * eigen.max(), "cell {index}: {}", eigen.min());
        }
    }

    #[test]
    fn rigid_motion_costs_nothing_and_changes_nothing() {
        let motion =
            nalgebra::Isometry3::new(Vector3::new(0.3, -0.2, 5.0), Vector3::new(1.0, 2.0, 0.5));
        let (membrane, x) = (membrane(&FRAMES[2]), cell(3));
        let moved = x.map(|p| (motion * nalgebra::Point3::from(p)).coords);
        let (before, after) = (membrane.energy_j(&x), membrane.energy_j(&moved));
        assert!((before - after).abs() < 1e-10 * before);
    }

    #[test]
    fn the_hold_alone_resists_the_in_plane_twist() {
        let fabric = Fabric::from_paper_units([131e3, 164e3, 75e3, 1e3, 1e3, 1e3, 200.0]);
        let of = |hold: f64| {
            let cell = Membrane::of_cell(&MaterialFrame::ALIGNED, 5e-3, [0.7, 1.2], &fabric, hold);
            // an hourglass: no strain at the centre, one side longer than the one facing it
            let [a, b, c] = [0.7 * 5e-3, 1.2 * 5e-3, 1e-5];
            let corner = |i: f64, j: f64| {
                let sign = (1.0 - 2.0 * i) * (1.0 - 2.0 * j);
                Vector3::new(i * a, 0.0, j * b + c * sign)
            };
            let x = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
            let [weft, warp] = cell.in_plane_twist(&x);
            assert!((weft - 4.0 * c / b).abs() < 1e-9 && warp.abs() < 1e-9, "{weft} {warp}");
            cell.energy_j(&x)
        };
        // A/24 S^u (g . w_u)^2 / h^2 with g = 4 c and h the side along the weft
        let whole = 0.7 * 1.2 * 25e-6 / 24.0 * 131.0 * (4e-5_f64 / (1.2 * 5e-3)).powi(2);
        for hold in [1.0, 0.03, 0.0] {
            assert!((of(hold) - hold * whole).abs() < 1e-9 * whole, "{hold}: {:e}", of(hold));
        }
    }

    /// A cell bent to a cylinder about a line at `degrees`, with the in-plane
    /// strain (along, across, shear) added.
    fn cylinder(degrees: f64, curvature: f64, strain: nalgebra::Vector3<f64>) -> Corners {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let h = SPACING_M;
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[i, j]: [f64; 2]| {
            let (a, b) = (h * (i * cos + j * sin), h * (j * cos - i * sin));
            let along = a * (1.0 + strain.x) + b * strain.z;
            let across = b * (1.0 + strain.y) + a * strain.z;
            let angle = curvature * along;
            Vector3::new(angle.sin() / curvature, (1.0 - angle.cos()) / curvature, across)
        })
    }

    #[test]
    fn a_cylinder_does_not_lock_at_any_angle() {
        // the sheet may choose a uniform strain; what is left is locking
        let membrane = membrane(&MaterialFrame::ALIGNED);
        let curvature = 100.0;
        let bending = 0.5 * 1.12e-6 * curvature * curvature * SPACING_M.powi(2);
        for degrees in [0.0, 30.0, 45.0, 60.0, 90.0] {
            let energy = |s| membrane.energy_j(&cylinder(degrees, curvature, s));
            let mut strain = nalgebra::Vector3::zeros();
            for _ in 0..20 {
                let step = 1e-4;
                let unit = |k: usize| nalgebra::Vector3::ith(k, step);
                let gradient = nalgebra::Vector3::from_fn(|k, _| {
                    (energy(strain + unit(k)) - energy(strain - unit(k))) / (2.0 * step)
                });
                let hessian = nalgebra::Matrix3::from_fn(|r, c| {
                    (energy(strain + unit(r) + unit(c))
                        - energy(strain + unit(r) - unit(c))
                        - energy(strain - unit(r) + unit(c))
                        + energy(strain - unit(r) - unit(c)))
                        / (4.0 * step * step)
                });
                strain -= hessian.lu().solve(&gradient).unwrap();
            }
            let left = energy(strain) / bending;
            // observed: at most 3e-13 (45 degrees)
            assert!(left < 1e-11, "{degrees} degrees: {left:e} of the bending energy");
        }
    }

    /// Flat corners of a cell under a uniform strain of the yarns.
    fn strained(frame: &MaterialFrame, weft: f64, warp: f64, shear: f64) -> Corners {
        let (sin, cos) = frame.warp_rad.sin_cos();
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[i, j]: [f64; 2]| {
            let [a, b] = sides(frame);
            let at = |c: usize| (i * a * frame.step_i[c] + j * b * frame.step_j[c]) * SPACING_M;
            let (v, u) = (at(0) * cos + at(1) * sin, at(1) * cos - at(0) * sin);
            Vector3::new(u * (1.0 + weft), v * (1.0 + warp), u * shear)
        })
    }

    #[test]
    fn a_uniform_strain_costs_the_same_per_area_in_every_material_frame() {
        let per_area = |frame: &MaterialFrame, strain: [f64; 3]| {
            let [weft, warp, shear] = strain;
            let [a, b] = sides(frame);
            let area = SPACING_M * SPACING_M * frame.area() * a * b;
            membrane(frame).energy_j(&strained(frame, weft, warp, shear)) / area
        };
        for strain in [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.003, -0.004, 0.0], [0.0, 0.0, 0.1]] {
            let straight = per_area(&FRAMES[0], strain);
            for frame in &FRAMES[1..] {
                let error = per_area(frame, strain) / straight - 1.0;
                // observed: at most 1e-13
                assert!(error.abs() < 1e-11, "{frame:?} {strain:?}: {error:e}");
            }
        }
    }
}

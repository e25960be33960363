//! The energy of one contact pair.
//!
//! In: a [`Pair`], its four corner positions (metres), the gap (metres).
//! Out: energy (J), gradient (N), Hessian (N/m).
//!
//! `E = k m(c) b(d)`, with
//! - `b(d) = -(d - gap)^2 ln(d / gap)` for `0 < d < gap`, else 0, m^2: the
//!   clamped log barrier of Li et al. 2020, eq. 6 (C2 at the gap), here on the
//!   distance and not on its square, so that `k` is a plain N/m;
//! - `m(c) = c/e (2 - c/e)` for `c < e`, else 1, with `c = |u x v|^2` and
//!   `e = 1e-3 |U|^2 |V|^2` of the rest edges: the edge-edge mollifier of the
//!   same paper, eq. 24. Point-triangle pairs have `m = 1`.
//!
//! The gradient is exact: `grad_i d = w_i n` at the closest points (envelope
//! theorem). The unprojected Hessian is exact within a distance type. The
//! projected one is `k b'' n n^T w w^T` for `m = 1` (Gauss-Newton form: what
//! is dropped is `b' d''`, small where it is positive: of the order
//! `gap / edge length` of what is kept) and the eigenvalue-clamped exact
//! matrix for a mollified pair, where the mollifier's stiffness against
//! rotation (some 4 times `b''` at half the gap) must not be lost.
//!
//! Fails: at `d = 0` the energy is infinite and the gradient is NaN; `max_step`
//! never leads there. The Hessian jumps where the distance type changes.
//!
//! Dropped: no mollifier. Edges that fold along a mesh line are parallel to rounding in a symmetric
//! drape; without `m` the gradient jumps by more than a tenth of its size within 6e-5 rad about
//! parallel, with `m` by less than 0.02 (test `parallel_edges_need_the_mollifier`).

use super::distance::{Closest, Hessian12, PairKind, closest, hessian_distance_sq};
use crate::base::Vector3;
use crate::sim::hessian_form::HessianForm;
use nalgebra::{Matrix3, SVector};

/// Two mesh elements that may touch.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Whether a point faces a triangle, or an edge another edge.
    pub kind: PairKind,
    /// `[p, a, b, c]` or `[a0, a1, b0, b1]`, vertex indices.
    pub vertices: [u32; 4],
    /// The barrier's scale times the pair's area weight, N/m.
    pub stiffness_n_m: f64,
    /// The value of `c` below which the mollifier acts, m^4; 0 for a point and a triangle.
    pub mollify_below_m4: f64,
}

impl Pair {
    /// The positions of the pair's four vertices.
    #[inline]
    pub fn corners(&self, x: &[Vector3]) -> [Vector3; 4] {
        let [a, b, c, d] = self.vertices;
        [x[a as usize], x[b as usize], x[c as usize], x[d as usize]]
    }
}

/// The clamped logarithm b of the distance with its first two derivatives, in m^2, m and 1.
pub fn clamped_log(distance_m: f64, gap_m: f64) -> [f64; 3] {
    if distance_m >= gap_m {
        return [0.0; 3];
    }
    let over = distance_m - gap_m;
    let log = (distance_m / gap_m).ln();
    let ratio = over / distance_m;
    [-over * over * log, -2.0 * over * log - over * ratio, -2.0 * log - 4.0 * ratio + ratio * ratio]
}

/// The mollifier with its derivatives by the corners' edge vectors.
struct Mollifier {
    value: f64,
    d1: f64,
    d2: f64,
    u: Vector3,
    v: Vector3,
}

impl Mollifier {
    /// The mollifier of a pair; `None` where it is 1 and does not change.
    fn new(pair: &Pair, x: &[Vector3; 4]) -> Option<Self> {
        if pair.kind == PairKind::PointTriangle {
            return None;
        }
        let (u, v) = (x[1] - x[0], x[3] - x[2]);
        let below = pair.mollify_below_m4;
        let cross_sq = u.cross(&v).norm_squared();
        if cross_sq >= below {
            return None;
        }
        let c = cross_sq / below;
        Some(Mollifier {
            value: c * (2.0 - c),
            d1: (2.0 - 2.0 * c) / below,
            d2: -2.0 / (below * below),
            u,
            v,
        })
    }

    /// Gradient of `c` by the four corners, m^3.
    fn gradient_c(&self) -> [Vector3; 4] {
        let (u, v) = (&self.u, &self.v);
        let uv = u.dot(v);
        let by_u = (u * v.norm_squared() - v * uv) * 2.0;
        let by_v = (v * u.norm_squared() - u * uv) * 2.0;
        [-by_u, by_u, -by_v, by_v]
    }

    fn hessian_c(&self) -> Hessian12 {
        let (u, v) = (&self.u, &self.v);
        let identity = Matrix3::identity();
        let uu = (identity * v.norm_squared() - v * v.transpose()) * 2.0;
        let vv = (identity * u.norm_squared() - u * u.transpose()) * 2.0;
        let uv = (u * v.transpose() * 2.0 - identity * u.dot(v) - v * u.transpose()) * 2.0;
        let sign = [-1.0, 1.0, -1.0, 1.0];
        let mut hessian = Hessian12::zeros();
        for i in 0..4 {
            for j in 0..4 {
                let part = match (i < 2, j < 2) {
                    (true, true) => uu,
                    (false, false) => vv,
                    (true, false) => uv,
                    (false, true) => uv.transpose(),
                };
                hessian
                    .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                    .copy_from(&(part * (sign[i] * sign[j])));
            }
        }
        hessian
    }
}

/// The closest points if they are nearer than the gap.
fn active(pair: &Pair, x: &[Vector3; 4], gap_m: f64) -> Option<Closest> {
    let at = closest(pair.kind, x);
    (at.distance_sq < gap_m * gap_m).then_some(at)
}

/// Energy of the pair, J; 0 beyond the gap.
pub fn energy_j(pair: &Pair, x: &[Vector3; 4], gap_m: f64) -> f64 {
    let Some(at) = active(pair, x, gap_m) else { return 0.0 };
    let mollified = Mollifier::new(pair, x).map_or(1.0, |m| m.value);
    let [value, _, _] = clamped_log(at.distance_sq.sqrt(), gap_m);
    pair.stiffness_n_m * mollified * value
}

/// Energy (J) and its gradient by the four corners (N); `None` beyond the gap.
pub fn gradient(pair: &Pair, x: &[Vector3; 4], gap_m: f64) -> Option<(f64, [Vector3; 4])> {
    let at = active(pair, x, gap_m)?;
    let distance_m = at.distance_sq.sqrt();
    let [b, b1, _] = clamped_log(distance_m, gap_m);
    let k = pair.stiffness_n_m;
    let mollifier = Mollifier::new(pair, x);
    let m = mollifier.as_ref().map_or(1.0, |m| m.value);
    let push = at.separation * (k * m * b1 / distance_m);
    let mut gradient = at.weights.map(|w| push * w);
    if let Some(mollifier) = mollifier {
        for (g, c) in gradient.iter_mut().zip(mollifier.gradient_c()) {
            *g += c * (k * b * mollifier.d1);
        }
    }
    Some((k * m * b, gradient))
}

fn stacked(parts: [Vector3; 4]) -> SVector<f64, 12> {
    SVector::from_fn(|row, _| parts[row / 3][row % 3])
}

/// Hessian of the pair's energy, N/m; `None` beyond the gap.
pub fn hessian(pair: &Pair, x: &[Vector3; 4], gap_m: f64, form: HessianForm) -> Option<Hessian12> {
    let at = active(pair, x, gap_m)?;
    let distance_m = at.distance_sq.sqrt();
    let [b, b1, b2] = clamped_log(distance_m, gap_m);
    let k = pair.stiffness_n_m;
    let normal = at.separation / distance_m;
    let grad_d = stacked(at.weights.map(|w| normal * w));
    let outer_d = grad_d * grad_d.transpose();
    let mollifier = Mollifier::new(pair, x);
    if form == HessianForm::Projected && mollifier.is_none() {
        return Some(outer_d * (k * b2));
    }
    let hess_d = (hessian_distance_sq(pair.kind, x, &at) - outer_d * 2.0) / (2.0 * distance_m);
    let of_barrier = outer_d * b2 + hess_d * b1;
    let Some(m) = mollifier else { return Some(of_barrier * k) };
    let grad_c = stacked(m.gradient_c());
    let cross = grad_c * grad_d.transpose();
    let exact = (of_barrier * m.value
        + (cross + cross.transpose()) * (m.d1 * b1)
        + m.hessian_c() * (m.d1 * b)
        + grad_c * grad_c.transpose() * (m.d2 * b))
        * k;
    Some(match form {
        HessianForm::Projected => clamp_eigenvalues(exact),
        HessianForm::Exact => exact,
    })
}

fn clamp_eigenvalues(matrix: Hessian12) -> Hessian12 {
    let eigen = matrix.symmetric_eigen();
    let kept = eigen.eigenvalues.map(|value| value.max(0.0));
    eigen.eigenvectors * Hessian12::from_diagonal(&kept) * eigen.eigenvectors.transpose()
}

//! A curvature with its sign: a second difference measured along the sheet's normal.
//!
//! `c = a . n`, n the direction of `p x q`, where a (a combination of second differences), p (a
//! difference along j) and q (one along i) are linear in the positions. On the flat specimen n
//! points up (+y), to the face, so that c is positive where the sheet curls towards its face.
//! A rigid motion leaves c as it is, so that it can be remembered.
//!
//! Energies `f(c)` take their gradient `f' dc` and Hessian `f' ddc + f'' dc dc^T` from here; dc and
//! ddc have no differences of their own in the tests, since every energy that uses them has.
//!
//! Fails: where a cell collapses to a line n has no direction.

use nalgebra::Matrix3;

use super::stencil::Stencil;
use crate::base::Vector3;
use crate::numeric::sparse::BlockPattern;
use crate::sim::grid::Grid;

/// One place with its three combinations of vertices.
#[derive(Clone, Debug)]
pub(super) struct Signed {
    stencil: Stencil,
    a: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
}

/// A place's vectors at given positions.
pub(super) struct SignedAt {
    p: Vector3,
    q: Vector3,
    a: Vector3,
    normal: Vector3,
    /// Length of p x q.
    length: f64,
    /// a . n.
    pub(super) part: f64,
    /// Derivative of a . n by p x q.
    slope: Vector3,
}

impl Signed {
    /// Of these weights of vertices for a, p and q.
    ///
    /// # Panics
    /// If two of the vertices do not couple in the grid's pattern.
    pub(super) fn new(
        grid: &Grid,
        a: &[(usize, f64)],
        p: &[(usize, f64)],
        q: &[(usize, f64)],
    ) -> Self {
        let stencil = Stencil::new(grid, a.iter().chain(p).chain(q).map(|(v, _)| *v));
        Self { a: stencil.weights(a), p: stencil.weights(p), q: stencil.weights(q), stencil }
    }

    /// Of the weights `a` at a vertex, whose normal is that of the differences there.
    pub(super) fn at_vertex(grid: &Grid, a: &[(usize, f64)], vertex: usize) -> Self {
        Self::new(grid, a, &grid.tangent(vertex, 1), &grid.tangent(vertex, grid.n))
    }

    pub(super) fn at(&self, x: &[Vector3]) -> SignedAt {
        let sum = |weights: &[f64]| -> Vector3 {
            self.stencil.vertices.iter().zip(weights).map(|(&v, w)| x[v as usize] * *w).sum()
        };
        let (a, p, q) = (sum(&self.a), sum(&self.p), sum(&self.q));
        let area = p.cross(&q);
        let length = area.norm().max(f64::MIN_POSITIVE);
        let normal = area / length;
        let part = a.dot(&normal);
        SignedAt { p, q, a, normal, length, part, slope: (a - normal * part) / length }
    }

    /// Derivative of a . n by vertex `k` of the stencil.
    fn derivative(&self, at: &SignedAt, k: usize) -> Vector3 {
        let by_normal = at.q.cross(&at.slope) * self.p[k] - at.p.cross(&at.slope) * self.q[k];
        at.normal * self.a[k] + by_normal
    }

    /// Adds `slope` times the derivative of a . n to the gradient.
    pub(super) fn add_gradient(&self, at: &SignedAt, slope: f64, gradient: &mut [Vector3]) {
        for (k, &v) in self.stencil.vertices.iter().enumerate() {
            gradient[v as usize] += self.derivative(at, k) * slope;
        }
    }

    /// Adds `slope` times the second derivative of a . n and `rise` times the outer product of its
    /// derivative to the values of the grid's pattern.
    pub(super) fn add_hessian(
        &self,
        at: &SignedAt,
        [slope, rise]: [f64; 2],
        pattern: &BlockPattern,
        values: &mut [f64],
    ) {
        if rise != 0.0 {
            let count = self.stencil.vertices.len();
            let by: Vec<Vector3> = (0..count).map(|k| self.derivative(at, k)).collect();
            self.stencil.add_blocks(pattern, values, |r, s| by[r] * (by[s] * rise).transpose());
        }
        if slope == 0.0 {
            return;
        }
        let across = (Matrix3::identity() - at.normal * at.normal.transpose()) / at.length;
        let (px, qx) = (at.p.cross_matrix(), at.q.cross_matrix());
        let turned = at.slope.cross_matrix();
        let bend = at.second_by_area();
        // area vector by vertex
        let by_area: Vec<Matrix3<f64>> =
            self.p.iter().zip(&self.q).map(|(p, q)| px * *q - qx * *p).collect();
        self.stencil.add_blocks(pattern, values, |r, s| {
            let both = across * by_area[s] * self.a[r]
                + by_area[r].transpose() * across * self.a[s]
                + by_area[r].transpose() * bend * by_area[s]
                + turned * (self.p[s] * self.q[r] - self.p[r] * self.q[s]);
            both * slope
        });
    }
}

impl SignedAt {
    /// Second derivative of a . n by p x q.
    fn second_by_area(&self) -> Matrix3<f64> {
        let (a, n) = (&self.a, &self.normal);
        let sum = a * n.transpose() + n * a.transpose() + Matrix3::identity() * self.part
            - n * n.transpose() * (3.0 * self.part);
        -sum / (self.length * self.length)
    }
}

//! Distance of a point to a triangle and of an edge to an edge.
//!
//! In: four corner positions, metres, any frame. Pair order: point-triangle
//! `[p, a, b, c]`, edge-edge `[a0, a1, b0, b1]`.
//! Out: [`Closest`]: signed weights `w` with `separation = sum_i w_i x_i`, the
//! vector between the two closest points, and its squared length. A weight
//! that is clamped (the closest point lies on a side or a corner) is exactly
//! zero, so the weights name the distance type (point-point, point-edge,
//! point-triangle, edge-edge) and no separate tag is needed.
//!
//! Equations: minimum of a convex quadratic over a triangle or a square: the
//! stationary point if it lies inside, else the least of the point-segment
//! problems on the sides. Second derivatives by eliminating the free closest
//! point parameters (implicit function theorem), exact in every type.
//!
//! Fails: nothing is reported for zero-length edges or zero-area triangles;
//! they fall back to their sides and corners, which is the right distance.
//! The distance of two nearly parallel edges has a discontinuous gradient;
//! the mollifier in `barrier.rs` deals with that.
//!
//! Dropped: a closed form per distance type (IPC toolkit): nine formulas with
//! their Hessians where one elimination does. Region tests after Ericson for
//! the triangle: a little faster, but wrong near slivers.

use crate::base::Vector3;
use nalgebra::SMatrix;

/// Second derivatives by four corners, x, y and z each.
pub type Hessian12 = SMatrix<f64, 12, 12>;

/// Below this squared sine the interior solution is not attempted. A guard
/// against a singular 2 x 2 system, far below the mollifier's 1e-3; empirical.
const SINGULAR_SIN_SQ: f64 = 1e-12;

/// Which elements face each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PairKind {
    /// A point and a triangle.
    PointTriangle,
    /// Two edges.
    EdgeEdge,
}

impl PairKind {
    /// Number of corners of the pair's first element.
    pub fn first(self) -> usize {
        match self {
            Self::PointTriangle => 1,
            Self::EdgeEdge => 2,
        }
    }
}

/// The two closest points of a pair, as weights of its four corners.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// Weights of the four corners in `separation`.
    pub weights: [f64; 4],
    /// From the second element's closest point to the first's, metres.
    pub separation: Vector3,
    /// The squared distance, metres^2.
    pub distance_sq: f64,
}

impl Closest {
    fn new(weights: [f64; 4], separation: Vector3) -> Self {
        Closest { weights, separation, distance_sq: separation.norm_squared() }
    }
}

/// Index of the least; the first of equals.
#[inline(always)]
fn least<const N: usize>(values: [f64; N]) -> usize {
    let mut at = 0;
    for i in 1..N {
        if values[i] < values[at] {
            at = i;
        }
    }
    at
}

/// The closest points of a pair with these corners.
#[inline]
pub fn closest(kind: PairKind, x: &[Vector3; 4]) -> Closest {
    match kind {
        PairKind::PointTriangle => point_triangle(x),
        PairKind::EdgeEdge => edge_edge(x),
    }
}

/// Fraction along `a -> b` nearest to `p`, clamped, and `p` minus that point.
#[inline(always)]
fn point_segment(p: &Vector3, a: &Vector3, b: &Vector3) -> (f64, Vector3) {
    let along = b - a;
    let from_a = p - a;
    let projected = from_a.dot(&along);
    let length_sq = along.norm_squared();
    if projected <= 0.0 || length_sq == 0.0 {
        (0.0, from_a)
    } else if projected >= length_sq {
        (1.0, p - b)
    } else {
        let s = projected / length_sq;
        (s, from_a - along * s)
    }
}

fn point_triangle(x: &[Vector3; 4]) -> Closest {
    let [p, a, b, c] = x;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (g11, g12, g22) = (ab.norm_squared(), ab.dot(&ac), ac.norm_squared());
    let det = g11 * g22 - g12 * g12;
    if det > SINGULAR_SIN_SQ * g11 * g22 {
        let (h1, h2) = (ap.dot(&ab), ap.dot(&ac));
        let s = (g22 * h1 - g12 * h2) / det;
        let t = (g11 * h2 - g12 * h1) / det;
        if s > 0.0 && t > 0.0 && s + t < 1.0 {
            return Closest::new([1.0, -(1.0 - s - t), -s, -t], ap - ab * s - ac * t);
        }
    }
    let (s_ab, r_ab) = point_segment(p, a, b);
    let (s_bc, r_bc) = point_segment(p, b, c);
    let (s_ca, r_ca) = point_segment(p, c, a);
    // `s - 1.0` and `-0.0 + 0.0` keep clamped weights exactly zero.
    match least([r_ab, r_bc, r_ca].map(|r| r.norm_squared())) {
        0 => Closest::new([1.0, s_ab - 1.0, -s_ab, 0.0], r_ab),
        1 => Closest::new([1.0, 0.0, s_bc - 1.0, -s_bc], r_bc),
        _ => Closest::new([1.0, -s_ca, 0.0, s_ca - 1.0], r_ca),
    }
}

fn edge_edge(x: &[Vector3; 4]) -> Closest {
    let [a0, a1, b0, b1] = x;
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (uu, uv, vv) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let det = uu * vv - uv * uv;
    if det > SINGULAR_SIN_SQ * uu * vv {
        let (uw, vw) = (u.dot(&w), v.dot(&w));
        let s = (uv * vw - vv * uw) / det;
        let t = (uu * vw - uv * uw) / det;
        if s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0 {
            return Closest::new([1.0 - s, s, t - 1.0, -t], w + u * s - v * t);
        }
    }
    let (t0, r_a0) = point_segment(a0, b0, b1);
    let (t1, r_a1) = point_segment(a1, b0, b1);
    let (s0, r_b0) = point_segment(b0, a0, a1);
    let (s1, r_b1) = point_segment(b1, a0, a1);
    match least([r_a0, r_a1, r_b0, r_b1].map(|r| r.norm_squared())) {
        0 => Closest::new([1.0, 0.0, t0 - 1.0, -t0], r_a0),
        1 => Closest::new([0.0, 1.0, t1 - 1.0, -t1], r_a1),
        2 => Closest::new([1.0 - s0, s0, -1.0, 0.0], -r_b0),
        _ => Closest::new([1.0 - s1, s1, 0.0, -1.0], -r_b1),
    }
}

/// Directions in weight space along which the closest points are free to
/// slide: 0, 1 or 2 of them.
fn free_directions(kind: PairKind, weights: &[f64; 4]) -> ([[f64; 4]; 2], usize) {
    let mut directions = [[0.0; 4]; 2];
    let mut count = 0;
    let mut slide = |from: usize, to: usize| {
        directions[count][from] = -1.0;
        directions[count][to] = 1.0;
        count += 1;
    };
    match kind {
        PairKind::PointTriangle => {
            let first = (1..4).find(|&i| weights[i] != 0.0).unwrap_or(1);
            for i in first + 1..4 {
                if weights[i] != 0.0 {
                    slide(first, i);
                }
            }
        }
        PairKind::EdgeEdge => {
            for (i, j) in [(0, 1), (2, 3)] {
                if weights[i] != 0.0 && weights[j] != 0.0 {
                    slide(i, j);
                }
            }
        }
    }
    (directions, count)
}

/// Exact second derivative of the squared distance, metres^2 per metre^2.
///
/// With `D(x, beta) = |sum_i w_i(beta) x_i|^2` minimised over the free
/// parameters, `D'' = D_xx - D_xb D_bb^-1 D_bx`.
pub fn hessian_distance_sq(kind: PairKind, x: &[Vector3; 4], at: &Closest) -> Hessian12 {
    let mut hessian = Hessian12::zeros();
    for i in 0..4 {
        for j in 0..4 {
            for k in 0..3 {
                hessian[(3 * i + k, 3 * j + k)] = 2.0 * at.weights[i] * at.weights[j];
            }
        }
    }
    let (directions, count) = free_directions(kind, &at.weights);
    let mut slides = [Vector3::zeros(); 2];
    let mut mixed = [nalgebra::SVector::<f64, 12>::zeros(); 2];
    for f in 0..count {
        slides[f] = (0..4).map(|i| x[i] * directions[f][i]).sum();
        for i in 0..4 {
            let row = (at.separation * directions[f][i] + slides[f] * at.weights[i]) * 2.0;
            mixed[f].fixed_rows_mut::<3>(3 * i).copy_from(&row);
        }
    }
    match count {
        1 => {
            let scale = 1.0 / (2.0 * slides[0].norm_squared());
            hessian -= mixed[0] * mixed[0].transpose() * scale;
        }
        2 => {
            let (g11, g12, g22) = (
                2.0 * slides[0].norm_squared(),
                2.0 * slides[0].dot(&slides[1]),
                2.0 * slides[1].norm_squared(),
            );
            let det = g11 * g22 - g12 * g12;
            let (m0, m1) = (mixed[0], mixed[1]);
            hessian -= (m0 * m0.transpose()) * (g22 / det) + (m1 * m1.transpose()) * (g11 / det)
                - (m0 * m1.transpose() + m1 * m0.transpose()) * (g12 / det);
        }
        _ => {}
    }
    hessian
}

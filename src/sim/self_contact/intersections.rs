//! How often a mesh passes through itself: the check at the end of a drape.
//!
//! In: triangles and positions (metres). Out: number of pairs of triangles
//! without a common vertex that intersect; touching counts.
//!
//! Method: sweep along x over the triangles' boxes; two triangles intersect if
//! a side of one crosses the other (signs of tetrahedron volumes), or if they
//! lie in one plane and overlap there. Shares no code with the barrier, so
//! that it can find the barrier's mistakes.
//!
//! Fails: a crossing less than [`FLAT`] triangle sizes deep (5e-15 m for 5 mm) is
//! taken for two triangles in one plane. Zero-area triangles count as their segments, and only
//! where they cross the other triangle's face.
//!
//! Dropped: parry3d: its triangle-triangle intersection is private to the mesh
//! boolean. Exact zeros as the sign of one plane: neighbours on an almost flat
//! sheet then touch by rounding (a false count that a test met).

use crate::base::Vector3;

/// A tetrahedron flatter than this, relative to its size, has no volume: a
/// thousand times the rounding of coordinates about as large as ten triangles.
const FLAT: f64 = 1e-12;

/// A triangle with its bounding box, metres.
struct Boxed<'a> {
    min: Vector3,
    max: Vector3,
    vertices: &'a [u32; 3],
    index: u32,
}

/// Number of pairs of triangles without a common vertex that intersect at the positions `x`
/// (metres); touching counts. 0 for a sheet that does not pass through itself.
pub fn count_intersections(triangles: &[[u32; 3]], x: &[Vector3]) -> usize {
    intersecting(triangles, x).len()
}

/// The pairs of triangles, as their indices, that [`count_intersections`] counts.
pub fn intersecting(triangles: &[[u32; 3]], x: &[Vector3]) -> Vec<[u32; 2]> {
    let corners = |t: &[u32; 3]| t.map(|v| x[v as usize]);
    let boxed = |(index, vertices)| {
        let [a, b, c] = corners(vertices);
        Boxed { min: a.inf(&b).inf(&c), max: a.sup(&b).sup(&c), vertices, index }
    };
    let mut order: Vec<Boxed> = (0..).zip(triangles).map(boxed).collect();
    order.sort_by(|a, b| a.min.x.total_cmp(&b.min.x));
    let mut pairs = Vec::new();
    for (i, t) in order.iter().enumerate() {
        for other in &order[i + 1..] {
            if other.min.x > t.max.x {
                break;
            }
            let apart = other.min.y > t.max.y
                || t.min.y > other.max.y
                || other.min.z > t.max.z
                || t.min.z > other.max.z;
            if !apart
                && !t.vertices.iter().any(|v| other.vertices.contains(v))
                && intersect(&corners(t.vertices), &corners(other.vertices))
            {
                pairs.push([t.index, other.index]);
            }
        }
    }
    pairs
}

/// Six times the signed volume of the tetrahedron, 0 if it is flat.
fn volume(a: &Vector3, b: &Vector3, c: &Vector3, d: &Vector3) -> f64 {
    let (ab, ac, ad) = (b - a, c - a, d - a);
    let size = ab.amax().max(ac.amax()).max(ad.amax());
    let volume = ab.cross(&ac).dot(&ad);
    if volume.abs() < FLAT * size * size * size { 0.0 } else { volume }
}

fn intersect(s: &[Vector3; 3], t: &[Vector3; 3]) -> bool {
    let coplanar = t.iter().all(|p| volume(&s[0], &s[1], &s[2], p) == 0.0);
    if coplanar {
        return overlap_in_plane(s, t);
    }
    (0..3).any(|i| crosses(&s[i], &s[(i + 1) % 3], t) || crosses(&t[i], &t[(i + 1) % 3], s))
}

/// Does the segment meet the triangle? A segment in its plane does not.
fn crosses(p: &Vector3, q: &Vector3, [a, b, c]: &[Vector3; 3]) -> bool {
    let (above, below) = (volume(a, b, c, p), volume(a, b, c, q));
    if above * below > 0.0 || (above == 0.0 && below == 0.0) {
        return false;
    }
    same_sign([volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)])
}

fn same_sign(v: [f64; 3]) -> bool {
    v.iter().all(|&v| v >= 0.0) || v.iter().all(|&v| v <= 0.0)
}

/// Two triangles of one plane, seen along its normal's largest component.
fn overlap_in_plane(s: &[Vector3; 3], t: &[Vector3; 3]) -> bool {
    let normal = (s[1] - s[0]).cross(&(s[2] - s[0]));
    let drop = normal.iamax();
    let flat = |p: &Vector3| [p[(drop + 1) % 3], p[(drop + 2) % 3]];
    let (s, t) = (s.each_ref().map(flat), t.each_ref().map(flat));
    let area2 = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    // Two convex shapes are apart if a side of one has the other strictly on
    // its outer side.
    let split_by = |s: &[[f64; 2]; 3], t: &[[f64; 2]; 3]| {
        (0..3).any(|i| {
            let (a, b, inner) = (s[i], s[(i + 1) % 3], s[(i + 2) % 3]);
            let inside = area2(a, b, inner);
            t.iter().all(|p| area2(a, b, *p) * inside < 0.0)
        })
    };
    !split_by(&s, &t) && !split_by(&t, &s)
}

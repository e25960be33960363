//! The points, edges and triangles of a mesh that may touch, with their weights.
//!
//! In: triangles (vertex indices), rest positions (metres), gap and stiffness. Out: what never
//! changes while the mesh moves: each edge once, the area that a point or an edge stands for,
//! and the patches (`patches.rs`) that tell neighbours apart many at once.

use super::patches::Patches;
use crate::base::Vector3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Pairs nearer than this many gaps at rest are left out. 1 would do for an
/// unstrained sheet; 2 leaves room for compression and shear. Empirical.
pub const REST_FACTOR: f64 = 2.0;
/// Area at which a pair has weight 1, m^2: a 5 mm cell.
pub const WEIGHT_AREA_M2: f64 = 25e-6;
/// Edge-edge mollifier threshold on the squared sine (Li et al. 2020, eq. 24).
pub const MOLLIFIER_SIN_SQ: f64 = 1e-3;

/// How self-contact acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContactParams {
    /// The distance at which the barrier starts to act, metres; positive.
    pub gap_m: f64,
    /// The scale k of the barrier `k (d - gap)^2 ln(gap / d)` of one pair of weight 1, which is
    /// 25 mm^2 of cloth, N/m; positive. Two layers facing each other feel the sum over several
    /// pairs a cell. `Default` says where its value comes from.
    pub stiffness_n_m: f64,
}

/// Stiffness: empirical. A sheet pressed on another with 0.5, 4 and 40 Pa (1.2e-5,
/// 1e-4 and 1e-3 N per vertex) rests at 0.9, 0.75 and 0.37 gaps (test
/// `pressed_sheets_rest_within_the_gap_and_never_pass`).
impl Default for SelfContactParams {
    fn default() -> Self {
        SelfContactParams { gap_m: 1.0e-3, stiffness_n_m: 0.1 }
    }
}

/// An edge of the mesh.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Its two vertices, the smaller index first.
    pub ends: [u32; 2],
    /// Its length at rest, metres.
    pub rest_length_m: f64,
    /// Area over [`WEIGHT_AREA_M2`].
    pub weight: f64,
}

/// The elements of a mesh that may touch, at rest.
#[derive(Clone, Debug)]
pub struct Elements {
    /// Gap and stiffness.
    pub params: SelfContactParams,
    /// The vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Each edge once, in the order of its ends.
    pub edges: Vec<Edge>,
    /// Positions at rest, metres.
    pub rest: Vec<Vector3>,
    /// Area of each vertex over [`WEIGHT_AREA_M2`].
    pub point_weight: Vec<f64>,
    /// What is known of neighbours on the sheet.
    pub patches: Arc<Patches>,
}

impl Elements {
    /// The elements of `triangles`; `rest`: flat or as made, metres.
    pub fn new(triangles: &[[u32; 3]], rest: &[Vector3], params: SelfContactParams) -> Self {
        let mut point_weight = vec![0.0; rest.len()];
        let mut edge_weight = BTreeMap::<[u32; 2], f64>::new();
        for t in triangles {
            let [a, b, c] = t.map(|v| rest[v as usize]);
            let third = 0.5 * (b - a).cross(&(c - a)).norm() / (3.0 * WEIGHT_AREA_M2);
            for i in 0..3 {
                let (from, to) = (t[i], t[(i + 1) % 3]);
                point_weight[from as usize] += third;
                *edge_weight.entry([from.min(to), from.max(to)]).or_default() += third;
            }
        }
        let length_m = |e: [u32; 2]| (rest[e[1] as usize] - rest[e[0] as usize]).norm();
        let edges = edge_weight
            .into_iter()
            .map(|(ends, weight)| Edge { ends, rest_length_m: length_m(ends), weight })
            .collect::<Vec<_>>();
        let ends: Vec<_> = edges.iter().map(|e| e.ends).collect();
        let has_area: Vec<_> = point_weight.iter().map(|w| *w > 0.0).collect();
        let patches =
            Patches::shared(triangles, &ends, &has_area, rest, REST_FACTOR * params.gap_m);
        Self {
            params,
            triangles: triangles.to_vec(),
            edges,
            rest: rest.to_vec(),
            point_weight,
            patches,
        }
    }
}

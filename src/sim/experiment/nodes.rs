//! Fields over a specimen: numbers at 5 x 5 nodes, bilinear between them.
//!
//! In: a number for each node. Out: the field's value at a place, and the same field of a specimen
//! turned over.

use serde::{Deserialize, Serialize};

/// Number of nodes of a field along one side of the specimen.
pub const CURL_NODES: usize = 5;

/// A number at 5 x 5 nodes evenly over the specimen, bilinear between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeField {
    /// `nodes[i][j]` is node i along the warp and j along the weft.
    pub nodes: [[f64; CURL_NODES]; CURL_NODES],
}

impl NodeField {
    /// Whether it is zero everywhere.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.nodes.iter().flatten().all(|&value| value == 0.0)
    }

    /// Its value at a place given as fractions of the specimen's sides along the warp and along the
    /// weft, 0 to 1 each.
    #[must_use]
    pub fn at(&self, warp: f64, weft: f64) -> f64 {
        bilinear(warp, weft, |i, j| self.nodes[i][j])
    }

    /// That of the same cloth turned over about its warp.
    pub(super) fn face_down(&self) -> Self {
        let node = |i: usize, j: usize| self.nodes[i][CURL_NODES - 1 - j];
        Self { nodes: std::array::from_fn(|i| std::array::from_fn(|j| node(i, j))) }
    }
}

/// What the nodes of a field have between them, bilinear, at a place given as fractions of the
/// specimen's sides along the warp and along the weft, 0 to 1 each; `node(i, j)` is node i along
/// the warp and j along the weft.
pub(super) fn bilinear(warp: f64, weft: f64, node: impl Fn(usize, usize) -> f64) -> f64 {
    let split = |t: f64| {
        let at = t.clamp(0.0, 1.0) * (CURL_NODES - 1) as f64;
        let whole = (at.floor() as usize).min(CURL_NODES - 2);
        (whole, at - whole as f64)
    };
    let ((i, a), (j, b)) = (split(warp), split(weft));
    (1.0 - a) * ((1.0 - b) * node(i, j) + b * node(i, j + 1))
        + a * ((1.0 - b) * node(i + 1, j) + b * node(i + 1, j + 1))
}

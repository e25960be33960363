//! What was found in a scan that is a mesh.

use serde::Serialize;

/// What was found in a scan that is a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeshFacts {
    /// Triangles of the file.
    pub triangles: usize,
    /// Points that stand for them around the plate.
    pub samples: usize,
    /// Typical length of an edge on the cloth \[m\].
    pub edge_m: f64,
    /// What was cut away underneath.
    pub cut: Option<CutFacts>,
    /// Share of the free edge that was read from the mesh's own.
    pub own_edge_share: f64,
}

/// The false underside of a closed mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CutFacts {
    /// Its area as a share of all that hung together with the cloth.
    pub removed_share: f64,
    /// Median dihedral angle of the surface along the cut \[rad\].
    pub crease_rad: f64,
}

//! A triangle mesh and a point cloud: positions in metres unless said otherwise.

use crate::base::Point3;

/// Triangles on shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions \[m\].
    pub vertices: Vec<Point3>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// Points, with what the file gave beside them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Positions; in the file's unit when fresh from a reader, else \[m\].
    pub points: Vec<Point3>,
    /// Red, green, blue of each point; empty if the source has none.
    pub colors: Vec<[u8; 3]>,
    /// Triangles on the points; empty for a bare cloud.
    pub triangles: Vec<[u32; 3]>,
}

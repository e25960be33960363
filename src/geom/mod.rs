//! Geometry: meshes and clouds, and the one place each where they meet parry's types and kiddo's
//! trees.

pub mod adjacency;
pub mod mesh;
pub mod neighbours;
pub mod parry;

pub use adjacency::Adjacency;
pub use mesh::{Cloud, Mesh, retain};
pub use neighbours::{Neighbour, Neighbours};
pub use parry::{Hit, MeshError, MeshIndex};

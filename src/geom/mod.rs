//! Geometry: meshes and clouds, and the one place where they meet parry's types.

pub mod adjacency;
pub mod mesh;
pub mod parry;

pub use adjacency::Adjacency;
pub use mesh::{Cloud, Mesh};
pub use parry::{Hit, MeshError, MeshIndex};

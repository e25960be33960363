//! Geometry: meshes and clouds, and the one place where they meet parry's types.

pub mod mesh;

pub use mesh::{Cloud, Mesh};

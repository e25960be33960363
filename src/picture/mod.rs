//! Pictures: charts of numbers, shaded meshes, and what they are drawn with.

pub mod chart;
pub mod draw;
pub mod shaded;

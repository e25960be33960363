//! Pictures: charts of numbers, shaded meshes, and what they are drawn with.

mod canvas;
pub mod chart;
pub mod draw;
pub mod shaded;

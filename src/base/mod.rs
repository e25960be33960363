//! What every layer shares: the vector types, the boundary vector, the sheet, the frame,
//! units, seeds, parts of a long list, processor time.

pub mod boundary;
pub mod clock;
pub mod frame;
pub mod outline;
#[cfg(test)]
pub(crate) mod schema;
pub mod seed;
pub mod shard;
pub mod surface;
pub mod text;
pub mod units;
pub mod vectors;

pub use boundary::{Boundary, BoundaryError, BoundaryPoint};
pub use outline::{Foot, Outline, OutlineError};
pub use shard::{Shard, ShardError};
pub use surface::{Surface, SurfaceError, SurfacePoint};
pub use vectors::{Isometry3, Point3, Vector3};

//! The vector types that every layer uses: nalgebra's, in double precision.

/// A point in 3D, metres unless the name says otherwise.
pub type Point3 = nalgebra::Point3<f64>;
/// A vector in 3D, metres unless the name says otherwise.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A rigid motion, named `target_from_source`.
pub type Isometry3 = nalgebra::Isometry3<f64>;

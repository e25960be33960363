//! The simulation frame and the specimen's flat (material) coordinates.
//!
//! Origin at the centre of the plate's top face, y up, **weft along z, warp
//! along x** (the paper's Fig. 3; its section IV-B says the opposite, see
//! `docs/symbols.md`). Right-handed. Metres.

use super::vectors::Vector3;

/// Up, against gravity.
pub const UP: Vector3 = Vector3::new(0.0, 1.0, 0.0);
/// The weft direction of the flat specimen.
pub const WEFT: Vector3 = Vector3::new(0.0, 0.0, 1.0);
/// The warp direction of the flat specimen.
pub const WARP: Vector3 = Vector3::new(1.0, 0.0, 0.0);

/// Standard gravity \[m/s^2\].
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Side of the square specimen of the modified Cusick drape \[m\].
pub const SPECIMEN_SIDE_M: f64 = 0.300;
/// Radius of the plate of the modified Cusick drape \[m\].
pub const PLATE_RADIUS_M: f64 = 0.050;

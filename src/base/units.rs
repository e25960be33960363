//! Conversions between SI (inside) and the field's units (at the edges).
//!
//! Source: the paper's Tables 1 and 2. Its Table 1 prints "g mm^2" for stretch
//! and shear, which is a misprint of g/s^2 (CLO's own importers convert g/s^2).

/// 1 g/s^2 in N/m: stretch and shear stiffness.
pub const N_M_PER_G_S2: f64 = 1e-3;
/// 1 g mm^2 s^-2 rad^-1 in N m: bending stiffness (a plate's rigidity per width
/// times width, per radian).
pub const N_M_PER_G_MM2_S2: f64 = 1e-9;
/// 1 g/m^2 in kg/m^2: areal density.
pub const KG_M2_PER_G_M2: f64 = 1e-3;
/// 1 mm in m.
pub const M_PER_MM: f64 = 1e-3;
/// Lengths in a scan whose unit is known over true ones; beyond these the unit is another.
pub const LIKELY_SCALES: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// A length in millimetres.
#[must_use]
pub const fn mm(metres: f64) -> f64 {
    metres / M_PER_MM
}

/// Printed unit of stretch and shear stiffness.
pub const STRETCH_UNIT: &str = "g/s^2";
/// Printed unit of bending stiffness.
pub const BENDING_UNIT: &str = "g mm^2 s^-2 rad^-1";
/// Printed unit of areal density.
pub const DENSITY_UNIT: &str = "g/m^2";

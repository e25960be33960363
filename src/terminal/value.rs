//! Values that both command lines take, checked.

use crate::calibrate::effect::{EFFECTS, Effect};
use crate::sim::Numerics;

/// The numerics of a version that the flags let through.
pub fn numerics(version: u32) -> Numerics {
    if version == 4 { Numerics::FOUR } else { Numerics::THREE }
}

/// A scanner's edge relative to the cloth's, and its standard deviation \[mm\].
///
/// # Errors
/// Another text, with what would be one.
pub fn sensor_edge(text: &str) -> Result<[f64; 2], String> {
    let both: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match both.as_deref() {
        Some(&[mm]) if mm.abs() <= 5.0 => Ok([mm, 0.1]),
        Some(&[mm, sigma]) if mm.abs() <= 5.0 && (0.01..=5.0).contains(&sigma) => Ok([mm, sigma]),
        _ => Err("give -5 to 5 mm, and after a comma a standard deviation of 0.01 to 5".into()),
    }
}

/// An effect by its name.
///
/// # Errors
/// Another text, with what would be one.
pub fn effect(text: &str) -> Result<&'static Effect, String> {
    let names = || EFFECTS.map(|effect| effect.name).join(", ");
    Effect::named(text).ok_or_else(|| format!("no such effect; the effects are {}", names()))
}

/// Of itself, that a cycle of the descent lowers the energy by: beyond a thousandth a sheet is
/// nowhere near rest.
///
/// # Errors
/// Another text, with what would be one.
pub fn energy_drop(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|v| (0.0..=1e-3).contains(v)).ok_or_else(|| "give 0 to 1e-3".into())
}

/// A share in per cent of which a quarter is already absurd.
///
/// # Errors
/// Another text, with what would be one.
pub fn percent(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|v| (0.0..=25.0).contains(v)).ok_or_else(|| "give 0 to 25".into())
}

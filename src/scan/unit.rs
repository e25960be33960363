//! The scan's unit of length, from the one thing known about its size: a 300 mm
//! specimen and a 100 mm plate leave metres or millimetres only.

use serde::Serialize;

use super::error::ScanError;
use crate::base::Point3;

/// Units that sensors write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Metres.
    Metre,
    /// Millimetres.
    Millimetre,
}

impl LengthUnit {
    /// The unit's symbol.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Millimetre => "mm",
        }
    }

    /// Metres in one unit.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Millimetre => 1e-3,
        }
    }
}

/// Smallest size of a scene with a drape in it: a bit less than the drape alone \[m\].
const SMALLEST_SCENE_M: f64 = 0.12;
/// Largest: a room with a corridor \[m\]. Below 1000 times the smallest, so that
/// at most one unit fits.
const LARGEST_SCENE_M: f64 = 60.0;

/// Half-way size of the cloud: twice the median distance from its median point,
/// which strays do not move; file units.
fn typical_size(points: &[Point3]) -> f64 {
    let stride = (points.len() / 20_000).max(1);
    let some: Vec<&Point3> = points.iter().step_by(stride).collect();
    let median = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let centre = [0, 1, 2].map(|axis| median(some.iter().map(|p| p[axis]).collect()));
    4.0 * median(some.iter().map(|p| (**p - Point3::from(centre)).norm()).collect())
}

/// Guesses the unit from the size of the scene.
pub(super) fn guess(points: &[Point3]) -> Result<LengthUnit, ScanError> {
    let size = typical_size(points);
    [LengthUnit::Metre, LengthUnit::Millimetre]
        .into_iter()
        .find(|unit| (SMALLEST_SCENE_M..LARGEST_SCENE_M).contains(&(size * unit.metres())))
        .ok_or(ScanError::Size {
            measured_units: size,
            smallest_m: SMALLEST_SCENE_M,
            largest_m: LARGEST_SCENE_M,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64) -> Vec<Point3> {
        (0..400)
            .map(|k| {
                Point3::new(f64::from(k % 20) / 20.0 * side, f64::from(k / 20) / 20.0 * side, 0.0)
            })
            .collect()
    }

    #[test]
    fn a_drape_sized_scene_is_metres_or_millimetres_and_nothing_else() {
        assert_eq!(guess(&square(0.3)).unwrap(), LengthUnit::Metre);
        assert_eq!(guess(&square(300.0)).unwrap(), LengthUnit::Millimetre);
        assert_eq!(guess(&square(2.0)).unwrap(), LengthUnit::Metre);
        assert!(guess(&square(0.002)).is_err());
        assert!(guess(&square(1e6)).is_err());
    }
}

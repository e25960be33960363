//! The scan's unit of length, guessed from the one thing known about its size: a 300 mm
//! specimen and a 100 mm plate leave metres or millimetres only.

use super::tuning::SceneTuning;
use super::unit::LengthUnit;
use crate::base::Point3;

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

/// What the size of a scene says of its unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    /// The scene's typical size in file units.
    pub size_units: f64,
    /// The unit in which this is the size of a scene with a drape, if there is one.
    pub unit: Option<LengthUnit>,
}

/// Guesses the unit from the size of the scene.
pub(super) fn guess(points: &[Point3], tuning: &SceneTuning) -> Guess {
    let size_units = typical_size(points);
    let fits = |unit: &LengthUnit| {
        (tuning.smallest_m..tuning.largest_m).contains(&(size_units * unit.metres()))
    };
    let unit = [LengthUnit::Metre, LengthUnit::Millimetre].into_iter().find(fits);
    Guess { size_units, unit }
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
        let tuning = crate::scan::tuning::Tuning::default().scene;
        let unit = |side| guess(&square(side), &tuning).unit;
        assert_eq!(unit(0.3), Some(LengthUnit::Metre));
        assert_eq!(unit(300.0), Some(LengthUnit::Millimetre));
        assert_eq!(unit(2.0), Some(LengthUnit::Metre));
        assert_eq!(unit(0.002), None);
        assert_eq!(unit(1e6), None);
    }
}

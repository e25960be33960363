//! The scan's unit of length, guessed from what is known of its size: a scene with a drape
//! in it is between a drape and a room. That leaves one of metres and millimetres at most;
//! whether it is centimetres or inches instead, only the plate's size tells: the units are
//! tried in order until a plate is found.

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
#[derive(Clone, Debug)]
pub(super) struct Guess {
    /// The scene's typical size in file units.
    pub size_units: f64,
    /// The units in which this is the size of a scene with a drape, likely ones first.
    pub units: Vec<LengthUnit>,
}

/// Guesses the unit from the size of the scene.
pub(super) fn guess(points: &[Point3], tuning: &SceneTuning) -> Guess {
    let size_units = typical_size(points);
    let fits = |unit: &LengthUnit| {
        (tuning.smallest_m..tuning.largest_m).contains(&(size_units * unit.metres()))
    };
    let units = LengthUnit::ALL.into_iter().filter(fits).collect();
    Guess { size_units, units }
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
    fn a_drape_sized_scene_leaves_metres_or_millimetres_first() {
        let tuning = crate::scan::tuning::Tuning::default().scene;
        let units = |side| guess(&square(side), &tuning).units;
        let (m, mm) = (LengthUnit::Metre, LengthUnit::Millimetre);
        let (cm, inch) = (LengthUnit::Centimetre, LengthUnit::Inch);
        assert_eq!(units(0.3), [m, LengthUnit::Foot]);
        assert_eq!(units(2.0), [m, LengthUnit::Foot]);
        assert_eq!(units(300.0), [mm, cm, inch]);
        assert_eq!(units(30.0), [m, cm, inch, LengthUnit::Foot]);
        assert_eq!(units(3e5), [LengthUnit::Micrometre, LengthUnit::TenthMillimetre]);
        assert!(units(0.002).is_empty());
        assert!(units(1e9).is_empty());
    }
}

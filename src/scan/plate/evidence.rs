//! What around a flat patch looks like a drape: a level disc of the plate's size at the top,
//! nothing above it, cloth hanging on all sides, some of the specimen's area in all.
//!
//! In: a patch, the downsampled points about it without wide planes \[m\]. Out: figures, and one
//! score by which places are put in order. It only says where to look first: what is a drape is
//! decided by the flattened cloth (`scan::pose`).

use super::super::tuning::PlateTuning;
use super::placed::Placed;

/// What speaks for a place. Shares of 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Evidence {
    /// Of the disc's cells, those that have level points.
    pub filled: f64,
    /// Level points outside of the disc, in those that it would take to fill it.
    pub level_outside: f64,
    /// Points above the disc, in those that it would take to fill it.
    pub above: f64,
    /// Of the bearings, those on which something hangs.
    pub hanging: f64,
    /// Area of all surfaces within the cloth's reach, in the specimen's.
    pub area: f64,
}

impl Evidence {
    /// Of points placed about the patch; each stands for a cell of `cell_m`.
    pub fn of(
        around: &[Placed],
        radius_m: f64,
        side_m: f64,
        cell_m: f64,
        tuning: &PlateTuning,
    ) -> Self {
        let level_m = tuning.flat_rms_m + 0.5 * cell_m;
        let reach_m = tuning.reach_sides * side_m;
        let lowest_m = -(reach_m - radius_m) * tuning.hang;
        let grid = Grid::new(radius_m, cell_m);
        let mut filled = vec![false; grid.cells()];
        let (mut outside, mut above, mut within) = (0.0, 0.0, 0.0);
        let mut hanging = vec![false; tuning.bearings];
        for p in around {
            let r = p.radius_m();
            if r > reach_m || p.height_m < lowest_m {
                continue;
            }
            within += 1.0;
            if p.height_m > tuning.rise_m {
                above += f64::from(r < tuning.level_outside_radii * radius_m);
            } else if p.height_m.abs() < level_m {
                if let Some(cell) = grid.cell(p.xz_m) {
                    filled[cell] = true;
                }
                if r > tuning.level_outside_radii * radius_m {
                    outside += 1.0;
                }
            } else if p.height_m < -tuning.hanging_radii * radius_m && r > 0.5 * radius_m {
                hanging[p.sector(tuning.bearings)] = true;
            }
        }
        let disc = std::f64::consts::PI * radius_m.powi(2) / cell_m.powi(2);
        let share =
            |flags: &[bool]| flags.iter().filter(|f| **f).count() as f64 / flags.len() as f64;
        Self {
            filled: share(&filled),
            level_outside: outside / disc,
            above: above / disc,
            hanging: share(&hanging),
            area: within * cell_m.powi(2) / (tuning.cells_per_area * side_m.powi(2)),
        }
    }

    /// The larger, the more like a drape; at most 2. Where no disc is, what hangs about counts for
    /// nothing: it may be a floor's noise. A hand or a box may be level with a plate; a table is so
    /// on more than ten times the plate's area.
    pub fn score(&self, tuning: &PlateTuning) -> f64 {
        let Self { filled, level_outside, above, hanging, area } = *self;
        2.0 * filled * hanging
            - 2.0 * level_outside / (level_outside + tuning.half_a_table)
            - 2.0 * above.min(1.0)
            - area.max(0.01).ln().abs().min(1.0)
    }
}

/// Cells of the disc within 0.85 of the plate's radius, twice as wide as the points' own.
struct Grid {
    radius_m: f64,
    step_m: f64,
    side: usize,
    numbers: Vec<Option<usize>>,
}

impl Grid {
    fn new(radius_m: f64, cell_m: f64) -> Self {
        let (radius_m, step_m) = (0.85 * radius_m, 2.0 * cell_m);
        let side = (2.0 * radius_m / step_m).ceil() as usize;
        let mut count = 0;
        let middle = |k: usize| (k as f64 + 0.5) * step_m - radius_m;
        let numbers = (0..side * side)
            .map(|k| {
                let inside = middle(k / side).hypot(middle(k % side)) < radius_m;
                inside.then(|| {
                    count += 1;
                    count - 1
                })
            })
            .collect();
        Self { radius_m, step_m, side, numbers }
    }

    fn cells(&self) -> usize {
        self.numbers.iter().flatten().count()
    }

    fn cell(&self, xz_m: [f64; 2]) -> Option<usize> {
        let [i, k] = xz_m.map(|c| ((c + self.radius_m) / self.step_m).floor());
        let inside = |c: f64| (0.0..self.side as f64).contains(&c);
        (inside(i) && inside(k))
            .then(|| self.numbers[i as usize * self.side + k as usize])
            .flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::tuning::Tuning;
    use super::*;

    #[test]
    fn a_plate_beside_a_hand_is_likelier_than_a_table_or_what_hangs_about_nothing() {
        let drape = Evidence { filled: 1.0, hanging: 1.0, area: 1.2, ..Evidence::default() };
        let beside_a_hand = Evidence { level_outside: 2.0, area: 1.5, ..drape };
        let table = Evidence { level_outside: 17.0, hanging: 0.5, ..drape };
        let over_noise = Evidence { filled: 0.0, area: 1.0, ..drape };
        let tuning = Tuning::default().plate;
        let score = |of: &Evidence| of.score(&tuning);
        assert!(score(&drape) > score(&beside_a_hand));
        assert!(score(&beside_a_hand) > score(&over_noise).max(score(&table)) + 0.5);
    }
}

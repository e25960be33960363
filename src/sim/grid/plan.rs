//! Size, lines, material frame and outline of a grid, and what of each cell lies on the cloth.

use super::frame::MaterialFrame;
use super::lines::{Band, Lines};
use crate::sim::experiment::{Experiment, Outline, Specimen};
use crate::sim::numerics::Grading;

/// Size, lines, material frame and outline of a grid: two grids with the same plan are the same.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// The lines of vertices that i and j count.
    pub(super) lines: [Lines; 2],
    pub(super) spacing_m: f64,
    pub(super) half_m: [f64; 2],
    pub(super) frame: MaterialFrame,
    pub(super) disc_radius_m: Option<f64>,
    /// Flat (x, z) of the point that the cells are arranged around: the plate's centre on graded
    /// cells, the specimen's on even ones \[m\].
    pub(super) middle_m: [f64; 2],
}

/// Samples along a cell's side with which its volume fraction on a disc is found.
const FRACTION_SAMPLES: usize = 64;

impl Plan {
    /// The plan of a specimen with `n` vertices on a side.
    pub(super) fn of(specimen: &Specimen, n: usize) -> Self {
        let side_m = specimen.weft_m;
        let frame = MaterialFrame {
            step_i: [specimen.warp_m / side_m, 0.0],
            step_j: [specimen.skew_rad.tan(), 1.0],
            warp_rad: 0.0,
        };
        Self {
            lines: [Lines::even(n), Lines::even(n)],
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame,
            disc_radius_m: (specimen.outline == Outline::Disc).then_some(0.5 * side_m),
            middle_m: [0.0; 2],
        }
    }

    /// The plan of a strip of these lines, with the warp rotated by `warp_rad` from x towards z.
    pub(super) fn strip(lines: [Lines; 2], spacing_m: f64, warp_rad: f64) -> Self {
        let half_m = [0, 1].map(|axis| 0.5 * spacing_m * (lines[axis].count() - 1) as f64);
        let frame = MaterialFrame { warp_rad, ..MaterialFrame::ALIGNED };
        Self { lines, spacing_m, half_m, frame, disc_radius_m: None, middle_m: [0.0; 2] }
    }

    /// The plan of [`Self::of`] with the lines denser near the edge of the experiment's plate,
    /// wherever that lies under the flat specimen; that of its specimen if the grading is even.
    pub(super) fn graded(experiment: &Experiment, n: usize, grading: &Grading) -> Self {
        let mut plan = Self::of(&experiment.specimen, n);
        if grading.density == 1.0 {
            return plan;
        }
        plan.middle_m = experiment.specimen.plate_centre_m();
        let ([ix, iz], [jx, jz]) = (plan.frame.step_i, plan.frame.step_j);
        let area = plan.frame.area();
        // what of (x, z) counts along i and along j: the inverse of the frame's steps
        let along = [[jz / area, -jx / area], [-iz / area, ix / area]];
        let radius_m = experiment.plate.radius_m;
        for (axis, [by_x, by_z]) in along.into_iter().enumerate() {
            let [x, z] = plan.middle_m;
            let middle = (by_x * x + by_z * z + plan.half_m[axis]) / plan.spacing_m;
            let steps = by_x.hypot(by_z) / plan.spacing_m;
            let (inner, outer) = (radius_m - grading.inwards_m, radius_m + grading.outwards_m);
            let [inner, outer, flank] = [inner.max(0.0), outer, grading.flank_m].map(|m| m * steps);
            plan.lines[axis] = Lines::graded(
                n,
                grading.density,
                &[
                    Band { low: middle - outer, high: middle - inner, flank },
                    Band { low: middle + inner, high: middle + outer, flank },
                ],
            );
        }
        plan
    }

    /// This plan with its lines, cut as `specimen` says: the cells are carried with the cloth.
    pub(super) fn recut(&self, specimen: &Specimen) -> Self {
        let lines = self.lines.clone();
        Self { lines, middle_m: self.middle_m, ..Self::of(specimen, self.lines[1].count()) }
    }

    /// The plan of the same specimen with `n` lines either way, evenly spaced.
    pub(super) fn evenly(&self, n: usize) -> Self {
        let spacing_m = 2.0 * self.half_m[1] / (n - 1) as f64;
        let lines = [Lines::even(n), Lines::even(n)];
        Self { lines, spacing_m, middle_m: [0.0; 2], ..self.clone() }
    }

    /// Whether the lines are evenly spaced.
    pub(super) fn is_even(&self) -> bool {
        self.lines.iter().all(Lines::are_even)
    }

    /// Flat (x, z) of the grid coordinates (i, j) \[m\].
    pub(super) fn flat(&self, coordinates: [f64; 2]) -> [f64; 2] {
        let [a, b] = [0, 1].map(|axis| {
            self.lines[axis].between(coordinates[axis]) * self.spacing_m - self.half_m[axis]
        });
        let ([ix, iz], [jx, jz]) = (self.frame.step_i, self.frame.step_j);
        [ix * a + jx * b, iz * a + jz * b]
    }

    /// The material of the cell from vertex (i, j) on that each corner carries, in
    /// cells: the integral of the corner's bilinear weight over the part inside.
    pub(super) fn parts_inside(&self, cell: [usize; 2]) -> [f64; 4] {
        let Some(radius_m) = self.disc_radius_m else { return [0.25; 4] };
        let inside = |a: f64, b: f64| {
            let [x, z] = self.flat([cell[0] as f64 + a, cell[1] as f64 + b]);
            x.hypot(z) <= radius_m
        };
        if [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].iter().all(|&(a, b)| inside(a, b)) {
            return [0.25; 4];
        }
        let mut parts = [0.0; 4];
        let at = |k: usize| (k as f64 + 0.5) / FRACTION_SAMPLES as f64;
        for (a, b) in (0..FRACTION_SAMPLES.pow(2))
            .map(|k| (at(k / FRACTION_SAMPLES), at(k % FRACTION_SAMPLES)))
        {
            if inside(a, b) {
                let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
                parts.iter_mut().zip(weights).for_each(|(part, w)| *part += w);
            }
        }
        parts.map(|part| part / FRACTION_SAMPLES.pow(2) as f64)
    }
}

//! Size, material frame and outline of a grid, and what of each cell lies on the cloth.

use super::frame::MaterialFrame;
use crate::sim::experiment::{Outline, Specimen};

/// Size, material frame and outline of a grid: two grids with the same plan are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plan {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) spacing_m: f64,
    pub(super) half_m: [f64; 2],
    pub(super) frame: MaterialFrame,
    pub(super) disc_radius_m: Option<f64>,
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
            rows: n,
            columns: n,
            spacing_m: side_m / (n - 1) as f64,
            half_m: [0.5 * side_m; 2],
            frame,
            disc_radius_m: (specimen.outline == Outline::Disc).then_some(0.5 * side_m),
        }
    }

    /// Flat (x, z) of the grid coordinates (i, j) \[m\].
    pub(super) fn flat(&self, [i, j]: [f64; 2]) -> [f64; 2] {
        let a = i * self.spacing_m - self.half_m[0];
        let b = j * self.spacing_m - self.half_m[1];
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

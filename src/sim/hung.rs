//! A square of cloth that hangs by two of its corners.
//!
//! In: a fabric (SI), a cut, a mesh. Out: the sheet at rest. Frame: y is up; the two corners lie on
//! the x axis, evenly about its origin. Clips hold a short piece of the upper edge at each corner.
//! The sheet begins bent evenly about a vertical line, with its upper corners where they are held:
//! no length has changed there. It runs on the drape's own grid, energies and Newton iterations,
//! without a plate.

use std::sync::Arc;

use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::sim::grid::Grid;
use crate::sim::strip::{rest, without_plate};

/// How the square is cut and held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HungSquare {
    /// Side \[m\]; the warp hangs down.
    pub side_m: f64,
    /// Distance of the two corners over the side \[-\], between 0.2 and 1.
    pub apart: f64,
    /// Width of a clip, from the corner along the upper edge \[m\].
    pub clip_m: f64,
    /// Vertices on a side.
    pub vertices: usize,
}

impl Default for HungSquare {
    /// The specimen of a drape, its corners 240 mm apart in clips of 10 mm, on cells of 5 mm.
    fn default() -> Self {
        let side_m = crate::base::frame::SPECIMEN_SIDE_M;
        Self { side_m, apart: 0.8, clip_m: 10e-3, vertices: 61 }
    }
}

/// A square that hangs, after the search for rest.
#[derive(Clone, Debug)]
pub struct Hung {
    /// The grid that it was simulated on.
    pub grid: Arc<Grid>,
    /// Position of each vertex of the grid \[m\].
    pub positions_m: Vec<Vector3>,
    /// Largest net force on a vertex at the end of the search \[N\].
    pub residual_n: f64,
    /// Whether it came to rest in a stable equilibrium.
    pub at_rest: bool,
}

/// Part of a cell's weight that a vertex of a sheet at rest may still feel, as in a drape.
const RESIDUAL: f64 = 1e-3;

impl HungSquare {
    /// Hangs a square of `fabric` from its beginning.
    #[must_use]
    pub fn hang(&self, fabric: &Fabric) -> Hung {
        let grid = Grid::shared(self.vertices, self.side_m);
        let start = self.bent(&grid);
        self.from(fabric, &grid, start)
    }

    /// Hangs a square of `fabric` from where another fabric hangs.
    #[must_use]
    pub fn continued(&self, from: &Hung, fabric: &Fabric) -> Hung {
        self.from(fabric, &from.grid, from.positions_m.clone())
    }

    fn from(&self, fabric: &Fabric, grid: &Arc<Grid>, start: Vec<Vector3>) -> Hung {
        let mut model = without_plate(grid, fabric, &Default::default());
        let clipped = (self.clip_m / grid.spacing_m).round() as usize;
        model.held = (0..=clipped).chain(grid.n - 1 - clipped..grid.n).collect();
        let rested = rest(&mut model, start, fabric, RESIDUAL);
        let (positions_m, residual_n) = (rested.positions_m, rested.residual_n);
        Hung { grid: Arc::clone(grid), positions_m, residual_n, at_rest: rested.at_rest }
    }

    /// The sheet bent about a vertical line, its chord as long as the corners are apart.
    fn bent(&self, grid: &Grid) -> Vec<Vector3> {
        let half = 0.5 * self.side_m;
        // half the angle of the arc, whose sine over itself is chord over arc
        let (mut low, mut high) = (1e-6, std::f64::consts::PI);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if middle.sin() / middle > self.apart { low = middle } else { high = middle }
        }
        let radius = half / low;
        let at = |v: usize| {
            let flat = grid.flat(v);
            let (sin, cos) = (flat.z / radius).sin_cos();
            Vector3::new(radius * sin, -(flat.x + half), radius * (cos - low.cos()))
        };
        (0..grid.vertices()).map(at).collect()
    }
}

impl Hung {
    /// The lower edge, from below one corner to below the other \[m\].
    #[must_use]
    pub fn hem_m(&self) -> &[Vector3] {
        &self.positions_m[self.positions_m.len() - self.grid.n..]
    }

    /// The upper edge, from one corner to the other \[m\].
    #[must_use]
    pub fn top_m(&self) -> &[Vector3] {
        &self.positions_m[..self.grid.n]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fabric(bending: f64) -> Fabric {
        Fabric::from_paper_units([4e5, 4e5, 4e5, bending, bending, bending, 200.0])
    }

    /// How deep the upper edge hangs below the corners \[m\].
    fn sag_m(hung: &Hung) -> f64 {
        hung.top_m().iter().map(|p| -p.y).fold(0.0, f64::max)
    }

    /// Mean of a coordinate over some places.
    fn mean(places: &[Vector3], axis: usize) -> f64 {
        places.iter().map(|p| p[axis]).sum::<f64>() / places.len() as f64
    }

    #[test]
    fn a_hung_square_keeps_its_corners_its_lengths_and_its_mirror_plane() {
        // cells of 10 and 5 mm, of which one and two make a clip
        let cut = HungSquare { vertices: 31, ..HungSquare::default() };
        let hung = cut.hang(&fabric(12e3));
        assert!(hung.at_rest, "{}", hung.residual_n);
        for (corner, x) in [(0, -0.12), (hung.grid.n - 1, 0.12)] {
            assert!((hung.positions_m[corner] - Vector3::new(x, 0.0, 0.0)).norm() < 1e-9);
        }
        let length = |row: &[Vector3]| row.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        for row in [hung.hem_m(), hung.top_m()] {
            assert!((length(row) / cut.side_m - 1.0).abs() < 0.01, "{}", length(row));
        }
        // the upper edge hangs through, less deep than two straight threads, alike on finer cells
        let finer = HungSquare { vertices: 61, ..cut }.hang(&fabric(12e3));
        let [deepest, on_finer] = [&hung, &finer].map(sag_m);
        println!("sag {:.2} mm, on finer cells {:.2} mm", 1e3 * deepest, 1e3 * on_finer);
        assert!(finer.at_rest && deepest < 0.09);
        assert!((deepest / on_finer - 1.0).abs() < 0.02, "{deepest} {on_finer}");
        let n = hung.grid.n;
        for (v, p) in hung.positions_m.iter().enumerate() {
            let mirrored = hung.positions_m[v / n * n + (n - 1 - v % n)];
            assert!((p.x + mirrored.x).abs() < 1e-5 && (p.y - mirrored.y).abs() < 1e-5);
        }
    }

    #[test]
    fn a_stiffer_square_hangs_higher_and_a_led_one_lies_where_it_would_hang_by_itself() {
        let cut = HungSquare { vertices: 31, ..HungSquare::default() };
        let [soft, stiff] = [12e3, 48e3].map(|bending| cut.hang(&fabric(bending)));
        assert!(soft.at_rest && stiff.at_rest);
        println!("sag {:.1} and {:.1} mm", 1e3 * sag_m(&soft), 1e3 * sag_m(&stiff));
        assert!(sag_m(&stiff) < 0.97 * sag_m(&soft));
        let continued = cut.continued(&soft, &fabric(48e3));
        assert!(continued.at_rest);
        let apart = mean(continued.hem_m(), 1) - mean(stiff.hem_m(), 1);
        assert!(apart.abs() < 0.5e-3, "{apart}");
    }
}

//! The free edge of a mesh, read from its own boundary instead of from the density
//! of points.
//!
//! In: the edges found from density (`edge`), and points along the mesh's boundary in
//! material coordinates \[m\]. Out: the same edges, where a strip has a boundary that
//! runs along the side moved onto it. Holes near the rim, and the ragged edges of
//! meshes made from sparse points, do not count: there the density stays.

use rayon::prelude::*;

use super::edge::{Edge, STATION_M};
use super::neighbours::Neighbours;
use super::sheet::Sheet;
use super::sides::to_side;
use crate::base::Point3;
use crate::base::boundary::SIDES;
use crate::numeric::robust;

/// Half width of a strip \[m\].
const STRIP_HALF_M: f64 = 4e-3;
/// How far the boundary may lie from the density's edge, inward and outward \[m\].
const FROM_DENSITY_M: f64 = 4e-3;
/// Shortest and longest boundary in a strip, in strip widths: a hole's edge is missing
/// or there twice, a ragged edge is longer than the strip is wide.
const LENGTH_RANGE: [f64; 2] = [0.7, 1.5];
/// A boundary that scatters by more about its middle is ragged \[m\].
const MOST_SCATTER_M: f64 = 0.6e-3;
/// Least standard deviation of a strip's edge \[m\].
const LEAST_SIGMA_M: f64 = 0.05e-3;

/// Boundary points near the sheet's edge in material coordinates, and off the sheet by
/// no more than `off_m`.
pub(super) fn on_sheet(
    rim: &[Point3],
    surface: &[Point3],
    material: &[[f64; 2]],
    sheet: &Sheet,
    off_m: f64,
    half_m: f64,
) -> Vec<[f64; 2]> {
    let tree = Neighbours::new(surface);
    rim.par_iter()
        .filter_map(|p| {
            let near = tree.one(p)?;
            let foot = sheet.nearest(p, material[near.index], 1.09 * half_m);
            (foot.off_m < off_m).then_some(foot.material)
        })
        .collect()
}

/// Moves the edges onto the boundary; returns the share of the strips moved.
pub(super) fn refine(
    edges: &mut [Edge; SIDES],
    boundary: &[[f64; 2]],
    step_m: f64,
    half_m: f64,
) -> f64 {
    let (mut moved, mut all) = (0, 0);
    for (side, edge) in edges.iter_mut().enumerate() {
        let points: Vec<[f64; 2]> = boundary.iter().map(|&m| to_side(side, m)).collect();
        let mut strips: Vec<Vec<f64>> = vec![Vec::new(); edge.along.len()];
        for [along, outward] in points {
            let first = ((along - STRIP_HALF_M + half_m) / STATION_M).ceil().max(0.0) as usize;
            let strips = strips.iter_mut().enumerate().skip(first);
            for (k, strip) in strips.take_while(|(k, _)| edge.along[*k] <= along + STRIP_HALF_M) {
                if (outward - edge.outward[k]).abs() < FROM_DENSITY_M {
                    strip.push(outward);
                }
            }
        }
        all += strips.len();
        for (k, strip) in strips.into_iter().enumerate() {
            // The strips at the ends are half beyond the corner.
            let whole = (edge.along[k].abs() + STRIP_HALF_M).min(half_m) - edge.along[k].abs();
            let width_m = STRIP_HALF_M + whole;
            let lengths = strip.len() as f64 * step_m / width_m;
            let scatter_m = robust::sigma(&strip).unwrap_or(f64::INFINITY);
            if (LENGTH_RANGE[0]..LENGTH_RANGE[1]).contains(&lengths) && scatter_m < MOST_SCATTER_M {
                edge.outward[k] = robust::median(strip).unwrap_or(edge.outward[k]);
                edge.sigma[k] = LEAST_SIGMA_M.hypot(0.5 * scatter_m);
                edge.observed[k] = true;
                moved += 1;
            }
        }
    }
    f64::from(moved) / all.max(1) as f64
}

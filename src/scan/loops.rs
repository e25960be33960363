//! The free edge of a mesh, read from its own boundary instead of from the density
//! of points.
//!
//! In: the edges found from density (`edge`), and points along the mesh's boundary in
//! material coordinates \[m\]. Out: the same edges, where a strip has a boundary that
//! runs along the side moved onto it. Holes near the rim, and the ragged edges of
//! meshes made from sparse points, do not count: there the density stays.

use rayon::prelude::*;

use super::edge::Edge;
use super::sheet::Sheet;
use super::sides::to_side;
use super::tuning::Tuning;
use crate::base::Point3;
use crate::base::boundary::SIDES;
use crate::geom::Neighbours;
use crate::numeric::robust;

/// Boundary points near the sheet's edge in material coordinates, and off the sheet by
/// no more than `off_m`.
pub(super) fn on_sheet(
    rim: &[Point3],
    surface: &[Point3],
    material: &[[f64; 2]],
    sheet: &Sheet,
    off_m: f64,
    reach_m: f64,
) -> Vec<[f64; 2]> {
    let tree = Neighbours::new(surface);
    rim.par_iter()
        .filter_map(|p| {
            let near = tree.one(p)?;
            let foot = sheet.nearest(p, material[near.index], reach_m);
            (foot.off_m < off_m).then_some(foot.material)
        })
        .collect()
}

/// Moves the edges onto the boundary; returns the share of the strips moved.
pub(super) fn refine(
    edges: &mut [Edge; SIDES],
    boundary: &[[f64; 2]],
    half_m: f64,
    tuning: &Tuning,
) -> f64 {
    let step_m = tuning.scene.edge_step_m;
    let tuning = &tuning.mesh_edge;
    let strip_half_m = tuning.strip_half_m;
    let (mut moved, mut all) = (0, 0);
    for (side, edge) in edges.iter_mut().enumerate() {
        let points: Vec<[f64; 2]> = boundary.iter().map(|&m| to_side(side, m)).collect();
        let mut strips: Vec<Vec<f64>> = vec![Vec::new(); edge.along.len()];
        for [along, outward] in points {
            let first = ((along - strip_half_m + half_m) / edge.station_m).ceil().max(0.0) as usize;
            let strips = strips.iter_mut().enumerate().skip(first);
            for (k, strip) in strips.take_while(|(k, _)| edge.along[*k] <= along + strip_half_m) {
                if (outward - edge.outward[k]).abs() < tuning.from_density_m {
                    strip.push(outward);
                }
            }
        }
        all += strips.len();
        for (k, strip) in strips.into_iter().enumerate() {
            // The strips at the ends are half beyond the corner.
            let whole = (edge.along[k].abs() + strip_half_m).min(half_m) - edge.along[k].abs();
            let width_m = strip_half_m + whole;
            let lengths = strip.len() as f64 * step_m / width_m;
            let scatter_m = robust::sigma(&strip).unwrap_or(f64::INFINITY);
            if (tuning.length_range[0]..tuning.length_range[1]).contains(&lengths)
                && scatter_m < tuning.most_scatter_m
            {
                edge.outward[k] = robust::median(strip).unwrap_or(edge.outward[k]);
                edge.sigma[k] = tuning.least_sigma_m.hypot(0.5 * scatter_m);
                edge.observed[k] = true;
                moved += 1;
            }
        }
    }
    f64::from(moved) / all.max(1) as f64
}

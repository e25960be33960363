//! The parameterisation of the cloth: material coordinates for every surface point.
//!
//! `front` places the points by geodesic distance from the plate; `relax` makes the
//! result as rigid as possible, while `ties` pull its free edges onto the sides of the
//! square that fits best.
//!
//! In: the cloth, local frame \[m\]. Out: its points with their places in the parameter
//! plane, and the specimen's square in that plane.

mod front;
mod links;
mod relax;
mod system;
mod ties;

pub(super) use front::Parameterisation;

use super::cloth::Cloth;
use super::edge;
use super::error::ScanError;
use super::limits;
use super::options::ScanOptions;
use super::sides::to_side;
use super::square::{self, Outline, Square};
use crate::base::boundary::SIDES;
use relax::{Effort, Relaxation};

/// Grows the front over the cloth.
pub(super) fn grow(cloth: &Cloth, options: &ScanOptions) -> Parameterisation {
    let tuning = &options.tuning.parameterisation;
    let reach_m = options.specimen_side_m * 0.5 * 2_f64.sqrt() * tuning.reach;
    front::grow(cloth, tuning.seed_radii * options.plate_radius_m, reach_m, tuning)
}

/// Relaxes the parameterisation as the front has left it.
pub(super) fn relax(surface: &mut Parameterisation, spacing_m: f64, options: &ScanOptions) {
    let tuning = &options.tuning.parameterisation;
    let effort = Effort { rounds: tuning.rounds, steps: tuning.steps, enough_m: tuning.enough_m };
    let Parameterisation { fixed, flat, links, .. } = surface;
    Relaxation { links, fixed, spacing_m, tuning }.relax(&[], effort, flat);
}

/// The square that the relaxed cloth makes, of any size; its side is measured by the
/// density of points across the edges, which the outermost points would make too short.
pub(super) fn outline(surface: &Parameterisation, options: &ScanOptions) -> Option<Outline> {
    let outline = square::measure(&surface.flat, options.specimen_side_m, &options.tuning.square)?;
    let half_m = 0.5 * outline.side_m;
    let material: Vec<[f64; 2]> =
        surface.flat.iter().map(|&p| outline.square.material(p)).collect();
    let halves = (0..SIDES).map(|side| {
        let points: Vec<[f64; 2]> = material.iter().map(|&m| to_side(side, m)).collect();
        edge::measure_bent(&points, half_m, &options.tuning.edge).mean_m()
    });
    let side_m = 2.0 * halves.sum::<f64>() / SIDES as f64;
    Some(Outline { side_m, ..outline })
}

/// Pulls the free edges of the relaxed cloth onto the sides of the square that fits best,
/// and relaxes it again; returns that square. Uses the links up.
///
/// The front may have carried the cloth round the plate by a degree, and ties to a
/// square that is rotated as far keep it there. So at the end the edges hold the cloth
/// and the part on the plate is loose: where it comes to rest says how the square lies
/// on the plate.
///
/// # Errors
/// When the parameterised cloth is no square of the specimen's size.
pub(super) fn straighten(
    surface: &mut Parameterisation,
    spacing_m: f64,
    options: &ScanOptions,
) -> Result<Square, ScanError> {
    let tuning = &options.tuning.parameterisation;
    let effort = |rounds| Effort { rounds, steps: tuning.steps, enough_m: tuning.enough_m };
    let links = &std::mem::take(&mut surface.links);
    let Parameterisation { fixed, flat, .. } = surface;
    let find = |flat: &[[f64; 2]]| {
        let fit = square::find(flat, options.specimen_side_m, &options.tuning.square);
        limits::square(&fit, options).map(|()| fit.square)
    };
    let mut surface = Relaxation { links, fixed, spacing_m, tuning };
    let mut square = find(flat)?;
    let half_m = 0.5 * options.specimen_side_m;
    for _ in 0..tuning.straightenings {
        let mut material: Vec<[f64; 2]> = flat.iter().map(|&p| square.material(p)).collect();
        let ties = ties::to_straight_sides(&material, half_m, options);
        surface.relax(&ties, effort(tuning.straightening_rounds), &mut material);
        for (p, &m) in flat.iter_mut().zip(&material) {
            *p = square.flat(m);
        }
        square = find(flat)?;
    }
    let mut material: Vec<[f64; 2]> = flat.iter().map(|&p| square.material(p)).collect();
    let on_plate: Vec<usize> = (0..fixed.len()).filter(|&i| fixed[i]).collect();
    let places: Vec<[f64; 2]> = on_plate.iter().map(|&i| flat[i]).collect();
    let ties = ties::to_straight_sides(&material, half_m, options);
    let loose = vec![false; fixed.len()];
    surface.fixed = &loose;
    let (steps, enough_m) = (tuning.loose_steps, tuning.loose_enough_m);
    surface.relax(&ties, Effort { rounds: tuning.rounds, steps, enough_m }, &mut material);
    square = square.rotated_to(on_plate.iter().map(|&i| material[i]).zip(places));
    for (p, &m) in flat.iter_mut().zip(&material) {
        *p = square.flat(m);
    }
    Ok(square)
}

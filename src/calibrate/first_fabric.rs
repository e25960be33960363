//! The fabric that a fit begins with: soft enough for the folds that were measured, so that sheets
//! are not brought to folds that they cannot hold.
//!
//! In: what was measured, and the prior of fabrics. Out: the prior's mean with its bending scaled.

use rayon::prelude::*;

use super::continuation::Continuation;
use super::effect::Cloth;
use super::equations::Problem;
use super::fabric_prior::FabricPrior;
use super::options::FitOptions;
use super::target::Target;
use crate::base::frame::GRAVITY_M_S2;
use crate::fabric::{Fabric, STIFFNESSES};

/// The fabric to begin with: by the drape coefficient of the discs \[%\], or, where rims were
/// scanned, of some bending lengths the one whose drape lies closest to the first rim.
pub(super) fn first_fabric(
    targets: &[Target],
    fabric_prior: &FabricPrior,
    drape_coefficient: f64,
    options: &FitOptions,
) -> Fabric {
    let Some(target) = targets.iter().find(|target| target.rim.is_some()) else {
        let [shortest, longest] = LENGTHS_M;
        let length_m = LENGTH_AT_50_M + LENGTH_PER_PERCENT_M * (drape_coefficient - 50.0);
        return bending(fabric_prior, length_m.clamp(shortest, longest));
    };
    let (targets, pose) = (vec![target.clone()], target.first_pose());
    let problem = Problem { targets, numbers: Vec::new(), fabric_prior, options };
    let tried = RIM_LENGTHS_M.into_par_iter().filter_map(|length_m| {
        let cloth = Cloth::plain(bending(fabric_prior, length_m));
        let guided = Continuation::of(&problem, &cloth).all(&problem.targets, &[pose]);
        let (_, prediction) = guided.into_iter().next()?.ok()?;
        let state = problem.around(&cloth.ln(), vec![prediction], &[pose]);
        Some((state.data_cost, cloth.fabric))
    });
    let nearest = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or_else(|| bending(fabric_prior, LENGTH_AT_50_M), |(_, fabric)| fabric)
}

/// Bending lengths that are tried with a scanned rim.
const RIM_LENGTHS_M: [f64; 5] = [6e-3, 9e-3, 13e-3, 18e-3, 26e-3];

/// The prior's mean, its bending scaled to a bending length.
fn bending(fabric_prior: &FabricPrior, length_m: f64) -> Fabric {
    let mut ln = fabric_prior.ln_mean;
    let wanted = (fabric_prior.density_kg_m2 * GRAVITY_M_S2 * length_m.powi(3)).ln();
    let shift = wanted - (ln[3] + ln[4] + ln[5]) / 3.0;
    (3..STIFFNESSES).for_each(|k| ln[k] += shift);
    let ln: [f64; STIFFNESSES] = std::array::from_fn(|k| {
        let [low, high] = fabric_prior.ln_limits[k];
        ln[k].clamp(low, high)
    });
    Fabric::from_ln_stiffnesses(&ln, fabric_prior.density_kg_m2)
}

/// Bending length over drape coefficient of standard Cusick drapes: roughly a line,
/// `docs/validation/simulator.md`.
const LENGTH_AT_50_M: f64 = 18.6e-3;
const LENGTH_PER_PERCENT_M: f64 = 0.36e-3;
const LENGTHS_M: [f64; 2] = [9e-3, 35e-3];

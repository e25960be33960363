//! How far a sheet at rest moves with a small change of the fabric or of the experiment.
//!
//! At rest the gradient of the energy vanishes, g(x, p) = 0, so that
//!
//! `dx/dp = - H^-1 dg/dp`,  H = d^2 E / dx^2 at the equilibrium,
//!
//! with the factor of H that the search for rest ends with (conjugate gradients where layers
//! touch). dg/dp is a central difference of the gradient at fixed x, exact to rounding for the
//! many parameters in which the energy is linear.
//!
//! In: a sheet at rest, the parameters asked for. Out: moves of the vertices \[m\] in the
//! simulation frame per SI unit of the parameter.
//!
//! Where it fails: friction is taken as it stands. The anchors and normal forces of its grips do
//! not change, nor do the anchors of the friction inside the cloth (where that is off, its
//! sensitivity is that of cloth bent one way from its natural shape), which holds for small changes
//! of cloth that sticks; the specimen's place and rotation act through the plate's anchors alone.
//! The pairs of self-contact are those at rest. On a fold's flank the sheet may leave this branch
//! at a change far smaller than the linear solution suggests.

pub use super::parameters::Parameter;

use std::sync::Arc;

use rayon::prelude::*;

use crate::base::Vector3;
use crate::sim::experiment::CURL_NODES;
use crate::sim::grid::Grid;
use crate::sim::model::Model;
use crate::sim::newton::Newton;
use crate::sim::options::Stop;
use crate::sim::setup::Setup;

/// Whether the parameter exists.
fn check(parameter: Parameter) -> Result<(), SensitivityError> {
    match parameter {
        Parameter::CurlNode { warp, weft, .. }
        | Parameter::WeightNode { warp, weft }
        | Parameter::BendingNode { warp, weft }
            if warp.max(weft) >= CURL_NODES =>
        {
            Err(SensitivityError::NoSuchNode { warp, weft })
        }
        _ => Ok(()),
    }
}

/// How the sheet moves with one parameter.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: Parameter,
    /// Derivative of each vertex's position by the parameter, in the order of the grid's
    /// vertices, simulation frame \[m per SI unit of the parameter\].
    pub moves: Vec<Vector3>,
}

impl Sensitivity {
    /// Derivative of each of the 244 points of the rim, in the order of [`crate::base::boundary`],
    /// simulation frame \[m per SI unit of the parameter\]. The rim is linear in the vertices of
    /// `grid`, the drape's own.
    #[must_use]
    pub fn rim_moves(&self, grid: &Grid) -> Vec<Vector3> {
        grid.boundary(&self.moves).positions_m().map(|move_m| move_m.coords).collect()
    }
}

/// Why a drape has no sensitivities.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SensitivityError {
    /// The sheet is not at rest, so that its forces do not balance.
    #[error("the drape ended as `{}`, not at rest: raise the number of iterations", .0.name())]
    NotAtRest(Stop),
    /// Some small move lowers the energy.
    #[error(
        "the equilibrium is not stable: a small change can move the sheet far; perturb the drop \
         to find a stable one"
    )]
    Unstable,
    /// A field has no such node.
    #[error(
        "no node {warp}, {weft} of a field over the specimen: give numbers from 0 to {}", CURL_NODES - 1
    )]
    NoSuchNode {
        /// The number asked for along the warp.
        warp: usize,
        /// The number asked for along the weft.
        weft: usize,
    },
}

impl Setup {
    /// The model with `parameter` changed, contacts as they are in `model`.
    fn changed(&self, model: &Model, parameter: Parameter, change: f64) -> Model {
        let setup = self.with(parameter, change);
        let grid = match parameter {
            Parameter::Warp | Parameter::Weft | Parameter::Skew => {
                model.grid.recut(&setup.experiment.specimen)
            }
            _ => Arc::clone(&model.grid),
        };
        let mut changed = model.changed(&grid, &setup.fabric, &setup.experiment);
        let (sin, cos) = change.sin_cos();
        match parameter {
            Parameter::OffsetX => {
                changed.plate.move_anchors(|p| p + Vector3::new(change, 0.0, 0.0));
            }
            Parameter::OffsetZ => {
                changed.plate.move_anchors(|p| p + Vector3::new(0.0, 0.0, change));
            }
            Parameter::Rotation => changed
                .plate
                .move_anchors(|p| Vector3::new(p.x * cos + p.z * sin, p.y, p.z * cos - p.x * sin)),
            Parameter::Pull => changed.guide.outwards_m += change,
            Parameter::TiesX => changed.guide.move_places(Vector3::x() * change),
            Parameter::TiesZ => changed.guide.move_places(Vector3::z() * change),
            _ => {}
        }
        changed
    }
}

/// The sensitivities of the sheet at rest at `x` to each of `parameters`, in their order;
/// `steadied`, those of its projected Hessian, which is stable for any exact one.
///
/// # Errors
/// [`SensitivityError::Unstable`] where the exact Hessian at `x` is wanted and is not positive
/// definite, [`SensitivityError::NoSuchNode`] for a node that the natural curvature does not have.
pub(super) fn sensitivities(
    model: &mut Model,
    newton: &mut Newton,
    x: &[Vector3],
    setup: &Setup,
    parameters: &[Parameter],
    steadied: bool,
) -> Result<Vec<Sensitivity>, SensitivityError> {
    parameters.iter().try_for_each(|&parameter| check(parameter))?;
    let model_now = &*model;
    let loads: Vec<_> = parameters.par_iter().map(|&p| load(model_now, x, setup, p)).collect();
    let moves = match steadied {
        true => newton.solve_loads_steadied(model, x, &loads),
        false => newton.solve_loads(model, x, &loads),
    };
    let moves = moves.ok_or(SensitivityError::Unstable)?;
    let both = parameters.iter().zip(moves);
    Ok(both.map(|(&parameter, moves)| Sensitivity { parameter, moves }).collect())
}

/// -dg/dp: the load on the vertices \[N per unit of the parameter\].
fn load(model: &Model, x: &[Vector3], setup: &Setup, parameter: Parameter) -> Vec<Vector3> {
    let step = parameter.step(&setup.fabric.in_si());
    let gradient = |change: f64| {
        let mut at = vec![Vector3::zeros(); x.len()];
        setup.changed(model, parameter, change).gradient(x, &mut at);
        at
    };
    let one_sided = parameter.is_one_sided();
    let (low, width) = if one_sided { (0.0, step) } else { (-step, 2.0 * step) };
    let (below, above) = (gradient(low), gradient(step));
    below.iter().zip(&above).map(|(b, a)| (b - a) / width).collect()
}

#[cfg(test)]
mod tests;

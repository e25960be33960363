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

use std::sync::Arc;

use rayon::prelude::*;

use crate::base::Vector3;
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::sim::experiment::{CURL_NODES, CurvatureComponent};
use crate::sim::grid::Grid;
use crate::sim::model::Model;
use crate::sim::newton::Newton;
use crate::sim::options::Stop;
use crate::sim::setup::Setup;

/// A number that the drape depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Weft stretch stiffness S^u \[N/m\].
    StretchWeft,
    /// Warp stretch stiffness S^v \[N/m\].
    StretchWarp,
    /// Shear stiffness H \[N/m\].
    Shear,
    /// Weft bending stiffness B^u \[N m\].
    BendingWeft,
    /// Warp bending stiffness B^v \[N m\].
    BendingWarp,
    /// Bias bending stiffness B^h \[N m\].
    BendingBias,
    /// Areal density D \[kg/m^2\].
    Density,
    /// One component of the natural curvature, everywhere on the sheet \[1/m\].
    Curl(CurvatureComponent),
    /// One component of the natural curvature at one node of its field \[1/m\].
    CurlNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
        /// Which curvature.
        component: CurvatureComponent,
    },
    /// What the cloth weighs more at one node of a field, as a share of its weight.
    WeightNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
    },
    /// Logarithm of a factor on bending at one node of a field.
    BendingNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
    },
    /// Natural curvature across the free edges \[1/m\].
    EdgeCurl,
    /// Natural curvature across a line \[1/m\].
    LineCurl,
    /// Natural curvature across the second line \[1/m\].
    CrossLineCurl,
    /// Softening of bending along the weft \[m\].
    SofteningWeft,
    /// Softening of bending along the warp \[m\].
    SofteningWarp,
    /// Softening of bending about a line at 45 degrees \[m\].
    SofteningBias,
    /// Asymmetry of bending along the weft.
    AsymmetryWeft,
    /// Asymmetry of bending along the warp.
    AsymmetryWarp,
    /// Friction moment per width against bending along the weft \[N\].
    HysteresisWeft,
    /// Friction moment per width against bending along the warp \[N\].
    HysteresisWarp,
    /// Angle by which the plate falls towards +x \[rad\].
    TiltX,
    /// Angle by which the plate falls towards +z \[rad\].
    TiltZ,
    /// Place of the specimen along x \[m\].
    OffsetX,
    /// Place of the specimen along z \[m\].
    OffsetZ,
    /// Rotation of the specimen about the plate's normal, from +x towards -z \[rad\].
    Rotation,
    /// Radius of the plate \[m\].
    PlateRadius,
    /// Radius of the plate's rounded edge \[m\].
    EdgeRadius,
    /// Coefficient of friction on the plate.
    Friction,
    /// Extent of the specimen along the warp \[m\].
    Warp,
    /// Extent of the specimen along the weft \[m\].
    Weft,
    /// Skew of the specimen \[rad\].
    Skew,
    /// How far beyond an outline the springs of a [`crate::sim::Hold`] pull \[m\].
    Pull,
    /// Place along x of the surface or rim that ties hold the sheet to \[m\].
    TiesX,
    /// Place along z of the surface or rim that ties hold the sheet to \[m\].
    TiesZ,
}

impl Parameter {
    /// All parameters but the single nodes of fields and those of a hold and of ties.
    pub const ALL: [Self; 31] = [
        Self::StretchWeft,
        Self::StretchWarp,
        Self::Shear,
        Self::BendingWeft,
        Self::BendingWarp,
        Self::BendingBias,
        Self::Density,
        Self::Curl(CurvatureComponent::Weft),
        Self::Curl(CurvatureComponent::Warp),
        Self::Curl(CurvatureComponent::Twist),
        Self::EdgeCurl,
        Self::LineCurl,
        Self::CrossLineCurl,
        Self::SofteningWeft,
        Self::SofteningWarp,
        Self::SofteningBias,
        Self::AsymmetryWeft,
        Self::AsymmetryWarp,
        Self::HysteresisWeft,
        Self::HysteresisWarp,
        Self::TiltX,
        Self::TiltZ,
        Self::OffsetX,
        Self::OffsetZ,
        Self::Rotation,
        Self::PlateRadius,
        Self::EdgeRadius,
        Self::Friction,
        Self::Warp,
        Self::Weft,
        Self::Skew,
    ];

    /// The six stiffnesses, paper's order.
    pub const STIFFNESSES: [Self; STIFFNESSES] = [
        Self::StretchWeft,
        Self::StretchWarp,
        Self::Shear,
        Self::BendingWeft,
        Self::BendingWarp,
        Self::BendingBias,
    ];

    /// The parameter's place among the fabric's seven, in the paper's order (see [`TABLE_2`]);
    /// `None` for a parameter of the experiment.
    #[must_use]
    pub fn of_fabric(self) -> Option<usize> {
        let seven = Self::STIFFNESSES.iter().chain([&Self::Density]);
        seven.into_iter().position(|&parameter| parameter == self)
    }

    /// Name of the parameter, as it stands in tables.
    #[must_use]
    pub fn name(self) -> String {
        let name = match self {
            Self::Curl(component) => return format!("curl_{}", component.name()),
            Self::CurlNode { warp, weft, component } => {
                return format!("curl_{}_{warp}_{weft}", component.name());
            }
            Self::WeightNode { warp, weft } => return format!("weight_{warp}_{weft}"),
            Self::BendingNode { warp, weft } => return format!("ln_bending_{warp}_{weft}"),
            Self::EdgeCurl => "curl_edge",
            Self::LineCurl => "curl_line",
            Self::CrossLineCurl => "curl_cross_line",
            Self::SofteningWeft => "softening_weft",
            Self::SofteningWarp => "softening_warp",
            Self::SofteningBias => "softening_bias",
            Self::AsymmetryWeft => "asymmetry_weft",
            Self::AsymmetryWarp => "asymmetry_warp",
            Self::HysteresisWeft => "hysteresis_weft",
            Self::HysteresisWarp => "hysteresis_warp",
            Self::TiltX => "tilt_down_x",
            Self::TiltZ => "tilt_down_z",
            Self::OffsetX => "offset_x",
            Self::OffsetZ => "offset_z",
            Self::Rotation => "rotation",
            Self::PlateRadius => "plate_radius",
            Self::EdgeRadius => "plate_edge_radius",
            Self::Friction => "friction",
            Self::Warp => "specimen_warp",
            Self::Weft => "specimen_weft",
            Self::Skew => "specimen_skew",
            Self::Pull => "pull",
            Self::TiesX => "ties_x",
            Self::TiesZ => "ties_z",
            fabric => fabric.of_fabric().map_or("", |k| TABLE_2[k].key),
        };
        name.to_owned()
    }

    /// SI unit of the parameter; empty for a number without one.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::StretchWeft | Self::StretchWarp | Self::Shear => "N/m",
            Self::BendingWeft | Self::BendingWarp | Self::BendingBias => "N m",
            Self::Density => "kg/m^2",
            Self::Curl(_)
            | Self::CurlNode { .. }
            | Self::EdgeCurl
            | Self::LineCurl
            | Self::CrossLineCurl => "1/m",
            Self::TiltX | Self::TiltZ | Self::Rotation | Self::Skew => "rad",
            Self::HysteresisWeft | Self::HysteresisWarp => "N",
            Self::AsymmetryWeft
            | Self::AsymmetryWarp
            | Self::Friction
            | Self::WeightNode { .. }
            | Self::BendingNode { .. } => "",
            _ => "m",
        }
    }

    /// A change small enough for a difference of the gradient and large enough for its digits;
    /// `fabric` in SI, in the paper's order.
    fn step(self, fabric: &[f64; 7]) -> f64 {
        match self {
            Self::Curl(_)
            | Self::CurlNode { .. }
            | Self::EdgeCurl
            | Self::LineCurl
            | Self::CrossLineCurl => 0.1,
            Self::SofteningWeft | Self::SofteningWarp | Self::SofteningBias => 1e-6,
            Self::TiltX | Self::TiltZ | Self::Rotation | Self::Skew => 1e-5,
            Self::HysteresisWeft | Self::HysteresisWarp => 1e-7,
            Self::AsymmetryWeft
            | Self::AsymmetryWarp
            | Self::Friction
            | Self::WeightNode { .. }
            | Self::BendingNode { .. } => 1e-3,
            _ => self.of_fabric().map_or(1e-7, |k| 1e-3 * fabric[k]),
        }
    }

    /// Whether the parameter exists.
    fn check(self) -> Result<(), SensitivityError> {
        match self {
            Self::CurlNode { warp, weft, .. }
            | Self::WeightNode { warp, weft }
            | Self::BendingNode { warp, weft }
                if warp.max(weft) >= CURL_NODES =>
            {
                Err(SensitivityError::NoSuchNode { warp, weft })
            }
            _ => Ok(()),
        }
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
    /// The same with `change` added to `parameter`. The specimen's place and rotation change
    /// nothing here: they act through friction's anchors, as a hold's pull and the ties' place do
    /// through their springs.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, change: f64) -> Self {
        let (f, e) = (&mut self.fabric, &mut self.experiment);
        let number = match parameter {
            Parameter::StretchWeft => &mut f.stretch_weft_n_m,
            Parameter::StretchWarp => &mut f.stretch_warp_n_m,
            Parameter::Shear => &mut f.shear_n_m,
            Parameter::BendingWeft => &mut f.bending_weft_nm,
            Parameter::BendingWarp => &mut f.bending_warp_nm,
            Parameter::BendingBias => &mut f.bending_bias_nm,
            Parameter::Density => &mut f.density_kg_m2,
            Parameter::Curl(component) => {
                let nodes = e.curl.nodes.iter_mut().flatten();
                nodes.for_each(|node| node[component as usize] += change);
                return self;
            }
            Parameter::CurlNode { warp, weft, component } => {
                &mut e.curl.nodes[warp][weft][component as usize]
            }
            Parameter::WeightNode { warp, weft } => &mut e.uneven.weight.nodes[warp][weft],
            Parameter::BendingNode { warp, weft } => &mut e.uneven.ln_bending.nodes[warp][weft],
            Parameter::EdgeCurl => &mut e.curl.edge.curvature_per_m,
            Parameter::LineCurl => &mut e.curl.line.curvature_per_m,
            Parameter::CrossLineCurl => &mut e.curl.cross_line.curvature_per_m,
            Parameter::SofteningWeft => &mut e.softening.weft_m,
            Parameter::SofteningWarp => &mut e.softening.warp_m,
            Parameter::SofteningBias => &mut e.softening.bias_m,
            Parameter::AsymmetryWeft => &mut e.asymmetric_bending.weft,
            Parameter::AsymmetryWarp => &mut e.asymmetric_bending.warp,
            Parameter::HysteresisWeft => &mut e.hysteresis.weft_n,
            Parameter::HysteresisWarp => &mut e.hysteresis.warp_n,
            Parameter::TiltX => &mut e.tilt.down_x_rad,
            Parameter::TiltZ => &mut e.tilt.down_z_rad,
            Parameter::PlateRadius => &mut e.plate.radius_m,
            Parameter::EdgeRadius => &mut e.plate.edge_radius_m,
            Parameter::Friction => &mut e.plate.friction,
            Parameter::Warp => &mut e.specimen.warp_m,
            Parameter::Weft => &mut e.specimen.weft_m,
            Parameter::Skew => &mut e.specimen.skew_rad,
            Parameter::OffsetX
            | Parameter::OffsetZ
            | Parameter::Rotation
            | Parameter::Pull
            | Parameter::TiesX
            | Parameter::TiesZ => return self,
        };
        *number += change;
        self
    }

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
    parameters.iter().try_for_each(|parameter| parameter.check())?;
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
    // what cannot be negative is changed to one side alone
    let one_sided = matches!(
        parameter,
        Parameter::SofteningWeft
            | Parameter::SofteningWarp
            | Parameter::SofteningBias
            | Parameter::HysteresisWeft
            | Parameter::HysteresisWarp
    );
    let (low, width) = if one_sided { (0.0, step) } else { (-step, 2.0 * step) };
    let (below, above) = (gradient(low), gradient(step));
    below.iter().zip(&above).map(|(b, a)| (b - a) / width).collect()
}

#[cfg(test)]
mod tests;

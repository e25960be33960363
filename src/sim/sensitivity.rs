//! How a sheet at rest answers a small change of the fabric or the experiment.
//!
//! At rest the gradient of the energy vanishes, g(x, p) = 0, so that
//!
//! `dx/dp = - H^-1 dg/dp`,  H = d^2 E / dx^2 at the equilibrium,
//!
//! with the factor of H that the search for rest ends with (conjugate gradients where layers
//! touch). dg/dp is a central difference of the gradient at fixed x, exact to rounding for the
//! many parameters in which the energy is linear.
//!
//! Frame and units: moves of the vertices \[m\] in the simulation frame per SI unit of the
//! parameter. Friction is taken as it stands: the anchors and normal forces of its grips do not
//! change, which holds for small changes of cloth that sticks. The specimen's place and turn act through
//! these anchors alone. The pairs of self-contact are those at rest; on a fold's flank the sheet
//! may leave this branch at a change far smaller than a linear answer suggests.

use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::sim::experiment::{CURL_NODES, Experiment};
use crate::sim::grid::Grid;
use crate::sim::model::Model;
use crate::sim::newton::Newton;

/// A number that the drape depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// One of the paper's seven, in its order: S^u, S^v, H \[N/m\], B^u, B^v, B^h \[N m\],
    /// density \[kg/m^2\].
    Fabric(usize),
    /// Natural curvature of the whole sheet: along the weft, the warp, twist \[1/m\].
    Curl(usize),
    /// The same at one node of the field: along the warp, along the weft, component \[1/m\].
    CurlNode(usize, usize, usize),
    /// Natural curvature across the free edges \[1/m\].
    EdgeCurl,
    /// Natural curvature across a line \[1/m\].
    LineCurl,
    /// Softening of bending: weft, warp, bias \[m\].
    Softening(usize),
    /// Fall of the plate towards +x \[rad\].
    TiltX,
    /// Fall of the plate towards +z \[rad\].
    TiltZ,
    /// Place of the specimen along x \[m\].
    OffsetX,
    /// Place of the specimen along z \[m\].
    OffsetZ,
    /// Turn of the specimen, from +x towards -z \[rad\].
    Rotation,
    /// Radius of the plate \[m\].
    PlateRadius,
    /// Radius of the plate's edge \[m\].
    EdgeRadius,
    /// Friction on the plate.
    Friction,
    /// Extent of the specimen along the warp \[m\].
    Warp,
    /// Extent of the specimen along the weft \[m\].
    Weft,
    /// Skew of the specimen \[rad\].
    Skew,
}

impl Parameter {
    /// All of them, the natural curvature's nodes one by one left out.
    pub const ALL: [Self; 26] = [
        Self::Fabric(0),
        Self::Fabric(1),
        Self::Fabric(2),
        Self::Fabric(3),
        Self::Fabric(4),
        Self::Fabric(5),
        Self::Fabric(6),
        Self::Curl(0),
        Self::Curl(1),
        Self::Curl(2),
        Self::EdgeCurl,
        Self::LineCurl,
        Self::Softening(0),
        Self::Softening(1),
        Self::Softening(2),
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

    /// Name and SI unit.
    #[must_use]
    pub fn name(self) -> (String, &'static str) {
        const DIRECTIONS: [&str; 3] = ["weft", "warp", "twist"];
        const BIAS: [&str; 3] = ["weft", "warp", "bias"];
        match self {
            Self::Fabric(k) => (
                crate::fabric::TABLE_2[k].key.to_owned(),
                ["N/m", "N/m", "N/m", "N m", "N m", "N m", "kg/m^2"][k],
            ),
            Self::Curl(k) => (format!("curl_{}", DIRECTIONS[k]), "1/m"),
            Self::CurlNode(i, j, k) => (format!("curl_{}_{i}_{j}", DIRECTIONS[k]), "1/m"),
            Self::EdgeCurl => ("curl_edge".into(), "1/m"),
            Self::LineCurl => ("curl_line".into(), "1/m"),
            Self::Softening(k) => (format!("softening_{}", BIAS[k]), "m"),
            Self::TiltX => ("tilt_down_x".into(), "rad"),
            Self::TiltZ => ("tilt_down_z".into(), "rad"),
            Self::OffsetX => ("offset_x".into(), "m"),
            Self::OffsetZ => ("offset_z".into(), "m"),
            Self::Rotation => ("rotation".into(), "rad"),
            Self::PlateRadius => ("plate_radius".into(), "m"),
            Self::EdgeRadius => ("plate_edge_radius".into(), "m"),
            Self::Friction => ("friction".into(), ""),
            Self::Warp => ("specimen_warp".into(), "m"),
            Self::Weft => ("specimen_weft".into(), "m"),
            Self::Skew => ("specimen_skew".into(), "rad"),
        }
    }
}

/// The answer to one parameter.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The parameter.
    pub parameter: Parameter,
    /// d(vertex position) / d(parameter), a vertex after another \[m per SI unit\].
    pub moves: Vec<Vector3>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SensitivityError {
    /// The sheet is not at rest.
    #[error("the drape ended as `{0}`, not at rest: raise the number of iterations")]
    NotAtRest(&'static str),
    /// Some small move lowers the energy.
    #[error("the equilibrium is not stable: no small change has a small answer")]
    Unstable,
}

/// What is simulated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub(super) fabric: Fabric,
    pub(super) experiment: Experiment,
}

impl Setup {
    /// The number that `parameter` names; `None` for those that act through friction's anchors.
    fn number(&mut self, parameter: Parameter) -> Option<&mut f64> {
        let (f, e) = (&mut self.fabric, &mut self.experiment);
        Some(match parameter {
            Parameter::Fabric(k) => {
                return [
                    &mut f.stretch_weft_n_m,
                    &mut f.stretch_warp_n_m,
                    &mut f.shear_n_m,
                    &mut f.bending_weft_nm,
                    &mut f.bending_warp_nm,
                    &mut f.bending_bias_nm,
                    &mut f.density_kg_m2,
                ]
                .into_iter()
                .nth(k);
            }
            Parameter::CurlNode(i, j, k) => &mut e.curl.nodes[i][j][k],
            Parameter::EdgeCurl => &mut e.curl.edge.curvature_per_m,
            Parameter::LineCurl => &mut e.curl.line.curvature_per_m,
            Parameter::Softening(0) => &mut e.softening.weft_m,
            Parameter::Softening(1) => &mut e.softening.warp_m,
            Parameter::Softening(_) => &mut e.softening.bias_m,
            Parameter::TiltX => &mut e.tilt.down_x_rad,
            Parameter::TiltZ => &mut e.tilt.down_z_rad,
            Parameter::PlateRadius => &mut e.plate.radius_m,
            Parameter::EdgeRadius => &mut e.plate.edge_radius_m,
            Parameter::Friction => &mut e.plate.friction,
            Parameter::Warp => &mut e.specimen.warp_m,
            Parameter::Weft => &mut e.specimen.weft_m,
            Parameter::Skew => &mut e.specimen.skew_rad,
            Parameter::Curl(_) | Parameter::OffsetX | Parameter::OffsetZ | Parameter::Rotation => {
                return None;
            }
        })
    }

    /// Adds `change` to `parameter`.
    fn change(&mut self, parameter: Parameter, change: f64) {
        match parameter {
            Parameter::Curl(k) => {
                for i in 0..CURL_NODES {
                    for j in 0..CURL_NODES {
                        self.change(Parameter::CurlNode(i, j, k), change);
                    }
                }
            }
            _ => {
                if let Some(number) = self.number(parameter) {
                    *number += change;
                }
            }
        }
    }

    /// A change small enough for a difference and large enough for its digits.
    fn step(&mut self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Fabric(_) => 1e-3 * self.number(parameter).map_or(0.0, |n| *n),
            Parameter::Curl(_)
            | Parameter::CurlNode(..)
            | Parameter::EdgeCurl
            | Parameter::LineCurl => 0.1,
            Parameter::Softening(_) => 1e-6,
            Parameter::TiltX | Parameter::TiltZ | Parameter::Rotation | Parameter::Skew => 1e-5,
            Parameter::Friction => 1e-3,
            Parameter::OffsetX
            | Parameter::OffsetZ
            | Parameter::PlateRadius
            | Parameter::EdgeRadius
            | Parameter::Warp
            | Parameter::Weft => 1e-7,
        }
    }

    /// The model with `parameter` changed, contacts as they are in `model`.
    fn changed(&self, model: &Model, parameter: Parameter, change: f64) -> Model {
        let mut setup = *self;
        setup.change(parameter, change);
        let grid = match parameter {
            Parameter::Warp | Parameter::Weft | Parameter::Skew => {
                Grid::unshared(&setup.experiment.specimen, model.grid.n)
            }
            _ => std::sync::Arc::clone(&model.grid),
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
            _ => {}
        }
        changed
    }
}

/// The answers of the sheet at rest at `x`.
///
/// # Errors
/// [`SensitivityError`].
pub(super) fn sensitivities(
    model: &mut Model,
    newton: &mut Newton,
    x: &[Vector3],
    setup: &Setup,
    parameters: &[Parameter],
) -> Result<Vec<Sensitivity>, SensitivityError> {
    let loads: Vec<_> = parameters.iter().map(|&p| load(model, x, setup, p)).collect();
    let moves = newton.answers(model, x, &loads).ok_or(SensitivityError::Unstable)?;
    let answers = parameters.iter().zip(moves);
    Ok(answers.map(|(&parameter, moves)| Sensitivity { parameter, moves }).collect())
}

/// -dg/dp: the load on the vertices \[N per unit of the parameter\].
fn load(model: &Model, x: &[Vector3], setup: &Setup, parameter: Parameter) -> Vec<Vector3> {
    let step = Setup::step(&mut setup.clone(), parameter);
    let gradient = |change: f64| {
        let mut at = vec![Vector3::zeros(); x.len()];
        setup.changed(model, parameter, change).gradient(x, &mut at);
        at
    };
    // what cannot be negative is changed to one side alone
    let one_sided = matches!(parameter, Parameter::Softening(_));
    let (low, width) = if one_sided { (0.0, step) } else { (-step, 2.0 * step) };
    let (below, above) = (gradient(low), gradient(step));
    below.iter().zip(&above).map(|(b, a)| (b - a) / width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::experiment::Softening;
    use crate::sim::newton::{Inertia, Tangency};
    use crate::sim::{Drop, DropStart, SimOptions, drape};

    fn fabric() -> Fabric {
        Fabric::from_paper_units([40e3, 50e3, 20e3, 9000.0, 7000.0, 8200.0, 180.0])
    }

    fn options() -> SimOptions {
        SimOptions { vertices: 25, fall_vertices: 25, residual: 1e-7, ..SimOptions::default() }
    }

    /// Newton steps to the changed equilibrium, the grips as they are.
    fn again(model: &mut Model, x: &[Vector3]) -> Vec<Vector3> {
        let mut y = x.to_vec();
        let mut newton = Newton::new(model);
        for _ in 0..12 {
            model.self_contact.update(&y, 0.0);
            model.forget_foreseen();
            let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
            newton.iterate(model, &mut y, still, Tangency::Exact);
        }
        y
    }

    #[test]
    fn answers_are_those_of_a_changed_drape() {
        let (fabric, mut options) = (fabric(), options());
        options.experiment.softening = Softening { weft_m: 1e-4, warp_m: 1e-4, bias_m: 1e-4 };
        let drop = Drop { start: DropStart::Perturbed(3) };
        let (fine, start, _) = crate::sim::drape::fallen(&fabric, &drop, &options);
        let mut rested = crate::sim::drape::rest(&fabric, &drop, &fine, start, &options);
        let answers = rested.sensitivities(&fabric, &options, &Parameter::ALL).unwrap();
        let setup = Setup { fabric, experiment: options.experiment };
        let (model, x) = rested.model_and_positions();
        let base = again(&mut setup.changed(model, Parameter::TiltX, 0.0), x);
        for answer in &answers {
            let largest = answer.moves.iter().map(Vector3::norm).fold(0.0, f64::max);
            // a change that moves the sheet by some 2 um: still linear, far above rounding
            let change = 2e-6 / largest.max(1e-12);
            let at = |change: f64| again(&mut setup.changed(model, answer.parameter, change), x);
            // a skewed grid has wider stencils, however small the skew
            let skew = answer.parameter == Parameter::Skew;
            let (moved, from) = (at(change), if skew { at(-change) } else { base.clone() });
            let width = if skew { 2.0 * change } else { change };
            let mut worst = 0.0_f64;
            for ((m, a), b) in answer.moves.iter().zip(&moved).zip(&from) {
                worst = worst.max(((a - b) / width - m).norm());
            }
            let error = worst / largest;
            println!("{:>20} {largest:10.3e} error {error:.1e}", answer.parameter.name().0);
            assert!(largest > 0.0, "{:?} has no answer", answer.parameter);
            assert!(error < 0.01, "{:?}: off by {error:.1e} of its largest", answer.parameter);
        }
    }

    #[test]
    fn a_drape_that_is_not_at_rest_has_no_answer() {
        let options = SimOptions { iterations: 0, ..options() };
        let drop = Drop::canonical();
        let given = crate::sim::drape::drape_with_sensitivities(&fabric(), &drop, &options, &[])
            .unwrap_err();
        assert!(matches!(given, SensitivityError::NotAtRest(_)), "{given}");
        assert!(drape(&fabric(), &drop, &options).stop.name() != "at_rest");
    }
}

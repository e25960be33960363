//! The solver's work space, and the small pieces that all of its parts use.

use crate::base::Vector3;
use crate::numeric::sparse::Factor;
use crate::sim::effort::{Effort, charge};
use crate::sim::model::{Model, Tangent};

/// The solver of one model on one thread: its matrices and vectors, reused from step to step, and
/// an account of its work.
pub struct Newton {
    pub(super) factor: Factor,
    pub(super) rough: Factor<f32>,
    pub(super) tangent: Tangent,
    pub(super) gradient: Vec<Vector3>,
    pub(super) direction: Vec<Vector3>,
    pub(super) trial: Vec<Vector3>,
    /// Whether `factor` and `tangent` are those of one exact Hessian.
    pub(super) exact: bool,
    /// Where [`Self::is_stable`] made them last, if nothing was assembled since.
    pub(super) factored_at: Vec<Vector3>,
    /// What the solver has done so far.
    pub effort: Effort,
}

/// The inertia of a time step.
#[derive(Clone, Copy, Debug)]
pub struct Inertia<'a> {
    /// Length of the time step \[s\]; infinite for a search without inertia.
    pub dt_s: f64,
    /// Where inertia alone would carry each vertex \[m\]; `None` if it would stay where it is.
    pub free_flight: Option<&'a [Vector3]>,
}

/// What an iteration, or a descent of several, did.
#[derive(Clone, Copy, Debug)]
pub struct Iteration {
    /// Largest net force on a vertex, inertia left out \[N\]: before a Newton iteration, after a
    /// descent.
    pub residual_n: f64,
    /// Largest move of a vertex in the last step \[m\].
    pub step_m: f64,
    /// Fraction of the full last step that was taken; 0 if none lowered the energy.
    pub fraction: f64,
    /// Whether the matrix, inertia included, showed no negative curvature.
    pub definite: bool,
}

/// Largest move of a vertex that a step may ask for \[m\]: about a plate's edge.
pub(super) const LONGEST_STEP_M: f64 = 0.03;
/// Sufficient decrease (Armijo), the usual value.
const ARMIJO: f64 = 1e-4;
/// Rounding of an energy, as a part of it; a decrease below it cannot be seen, and a
/// step that promises no more is taken whole.
pub(super) const ROUNDING: f64 = 1e-13;
/// Halvings before a step is given up.
pub(super) const HALVINGS: usize = 14;

impl Newton {
    /// A solver for `model`, and for every other model on the same grid.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let n = model.grid.vertices();
        let zeros = || vec![Vector3::zeros(); n];
        Self {
            factor: Factor::new(&model.grid.analysis),
            rough: Factor::new(&model.grid.analysis),
            tangent: Tangent::default(),
            gradient: zeros(),
            direction: zeros(),
            trial: zeros(),
            exact: false,
            factored_at: Vec::new(),
            effort: Effort::default(),
        }
    }

    /// Finds anew what touches at the positions `x`, and renews the grips of friction there. Gives
    /// the largest change of a normal force on the plate times the coefficient of friction
    /// \[N\].
    pub fn renew_contact(&mut self, model: &mut Model, x: &[Vector3]) -> f64 {
        self.renew_contact_by(model, x, 1.0)
    }

    /// The same, friction's normal forces this part of the way to what they are at `x`.
    pub fn renew_contact_by(&mut self, model: &mut Model, x: &[Vector3], part: f64) -> f64 {
        charge(&mut self.effort.contact_s, || {
            model.self_contact.update(x, 0.0);
            model.plate.renew_by(&model.grid, x, part)
        })
    }

    /// What a step minimises \[J\]: the energy and the inertia's part.
    pub(super) fn objective(&mut self, model: &Model, x: &[Vector3], inertia: Inertia) -> f64 {
        charge(&mut self.effort.search_s, || {
            let pull: f64 = match inertia.free_flight {
                Some(y) => {
                    let apart = x.iter().zip(y).map(|(p, q)| (p - q).norm_squared());
                    apart.zip(&model.weight.mass_kg).map(|(square, m)| m * square).sum()
                }
                None => 0.0,
            };
            model.energy_j(x) + 0.5 * inertia.dt_s.powi(-2) * pull
        })
    }

    /// Writes to `trial` the positions `x` after this fraction of the direction.
    pub(super) fn try_fraction(&mut self, x: &[Vector3], fraction: f64) {
        for ((t, p), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
            *t = p + d * fraction;
        }
    }
}

/// Whether `value` is enough below `start` for a move along which the slope promised
/// `promised` (negative), as far as rounding tells.
pub(super) fn is_lower(value: f64, start: f64, promised: f64) -> bool {
    value <= start + ARMIJO * promised + ROUNDING * start.abs()
}

/// The length of the longest of some vectors.
pub(super) fn largest(a: &[Vector3]) -> f64 {
    a.iter().map(Vector3::norm).fold(0.0, f64::max)
}

/// The scalar product of two fields of vectors.
pub(super) fn dot(a: &[Vector3], b: &[Vector3]) -> f64 {
    a.iter().zip(b).map(|(p, q)| p.dot(q)).sum()
}

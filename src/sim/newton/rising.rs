//! Newton steps that may raise the energy for a while.
//!
//! A whole Newton step along a stiff sheet's tangent stretches it to second order, and a line search
//! cuts it to a tenth; taken whole, the next step takes the stretch off again, and the sheet is
//! ahead (the Maratos effect, and its remedy by a watchdog: Chamberlain et al. 1982). After as many
//! steps as are allowed the energy must lie below that where they began, or the sheet is put back
//! and the next step searches its line.

use super::workspace::{Inertia, Iteration, Newton};
use crate::base::Vector3;
use crate::sim::energy::plate::PlateContact;
use crate::sim::hessian_form::HessianForm;
use crate::sim::model::Model;

/// How many Newton steps may rise, and where those under way began.
pub struct Rising {
    most: usize,
    start: Option<Start>,
}

/// The sheet before steps that may rise.
struct Start {
    x: Vec<Vector3>,
    plate: PlateContact,
    energy_j: f64,
    taken: usize,
}

impl Rising {
    /// At most this many steps in a row; none with 0.
    #[must_use]
    pub fn new(most: usize) -> Self {
        Self { most, start: None }
    }
}

impl Newton {
    /// One Newton iteration without inertia, with the exact Hessian, as [`Self::iterate`] does, or
    /// whole as long as `rising` allows.
    pub fn iterate_rising(
        &mut self,
        model: &mut Model,
        x: &mut [Vector3],
        rising: &mut Rising,
    ) -> Iteration {
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        if rising.most == 0 {
            return self.iterate(model, x, still, HessianForm::Exact);
        }
        let energy_j = self.objective(model, x, still);
        let spent = match &mut rising.start {
            Some(start) if energy_j > start.energy_j => {
                start.taken += 1;
                start.taken > rising.most
            }
            _ => {
                let (x, plate) = (x.to_vec(), model.plate.clone());
                rising.start = Some(Start { x, plate, energy_j, taken: 1 });
                false
            }
        };
        if spent {
            self.put_back(model, x, rising);
        }
        self.advance(model, x, still, HessianForm::Exact, !spent)
    }

    /// Ends a run of steps that may rise: puts the sheet back to where they began if the energy is
    /// above that there.
    pub fn put_back(&mut self, model: &mut Model, x: &mut [Vector3], rising: &mut Rising) {
        let Some(start) = rising.start.take() else { return };
        let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
        if self.objective(model, x, still) > start.energy_j {
            x.copy_from_slice(&start.x);
            model.plate = start.plate;
            model.self_contact.update(x, 0.0);
            model.forget_lagged_stress();
        }
    }
}

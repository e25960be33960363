//! The fit with effects: more unknowns around the plain fit, or around another cloth.

use rayon::prelude::*;

use super::{Fit, Fitted, Found};
use crate::calibrate::continuation::{Continuation, Sheet};
use crate::calibrate::effect::{EFFECTS, Number, SENSOR_EDGE};
use crate::calibrate::equations::{State, parameters, shared_of};
use crate::calibrate::evidence::{Around, DrapeAround};
use crate::calibrate::prediction::{Prediction, steadied_prediction_of};
use crate::calibrate::softened::softened;
use crate::calibrate::specimens::specimens_of;
use crate::fabric::STIFFNESSES;
use crate::inverse::Ended;

impl Fit<'_> {
    /// The least squares around the plain fit's drapes with more unknowns; `None` where a sheet has
    /// no sensitivities to them.
    pub(in crate::calibrate) fn state_with(
        &mut self,
        numbers: &[&'static Number],
    ) -> Option<State> {
        self.restore();
        let (plain, declared) = (self.plain.clone(), self.declared.clone());
        self.with_more(&plain, &declared, numbers)
    }

    /// The least squares around a state, to whose numbers the sheets are led, with more unknowns;
    /// `None` where a sheet has no sensitivities to them.
    pub(super) fn with_more(
        &mut self,
        state: &State,
        own: &[&'static Number],
        numbers: &[&'static Number],
    ) -> Option<State> {
        let asked = parameters(numbers);
        let cloth = self.equations(own).cloth(&state.shared);
        let continuation = Continuation { cloth: &cloth, options: self.options, asked: &asked };
        let sheets = self.followers.par_iter_mut().zip(&self.targets);
        let poses = state.poses();
        let both = sheets.zip(&poses).zip(&self.stays);
        let predictions: Option<Vec<Prediction>> = both
            .map(|(((sheet, target), pose), stays)| match stays {
                true => steadied_prediction_of(sheet, &asked, target.compared()).ok(),
                false => continuation.seen(sheet, target, pose).ok(),
            })
            .collect();
        let predictions = predictions?;
        self.stays = predictions.iter().map(|prediction| prediction.is_steadied).collect();
        let shared = extended(&state.shared, own, numbers);
        Some(self.equations(numbers).around(&shared, predictions, &poses))
    }

    /// The least squares around the plain fit with every number of some effects.
    pub(in crate::calibrate) fn around_plain(
        &mut self,
        numbers: Vec<&'static Number>,
    ) -> Option<Around> {
        let state = self.state_with(&numbers)?;
        Some(self.around_state(numbers, &state))
    }

    /// The least squares around a state, to which the sheets are led, with every effect's numbers;
    /// `None` where a sheet has no sensitivities to them.
    pub(super) fn around_found(
        &mut self,
        state: &State,
        own: &[&'static Number],
    ) -> Option<Around> {
        let stays = std::mem::replace(&mut self.stays, vec![false; self.followers.len()]);
        let numbers: Vec<_> =
            EFFECTS.iter().chain([&SENSOR_EDGE]).flat_map(|e| e.numbers).collect();
        let state = self.with_more(state, own, &numbers);
        self.stays = stays;
        Some(self.around_state(numbers, &state?))
    }

    pub(super) fn around_state(&self, numbers: Vec<&'static Number>, state: &State) -> Around {
        let equations = self.equations(&numbers);
        let precision = equations.prior(&state.shared).precision;
        let off = equations.off(&state.shared);
        let drapes = self.targets.iter().zip(&state.parts).map(|(target, part)| DrapeAround {
            part: part.clone(),
            is_picture: target.rim.is_none(),
        });
        let drapes = drapes.collect();
        let ends = equations.limits();
        let room = ends.iter().zip(&state.shared).map(|(ends, at)| ends.map(|end| end - at));
        let room = room.collect();
        let specimens: Vec<Option<&str>> =
            self.targets.iter().map(|target| target.specimen.as_deref()).collect();
        Around { drapes, specimens: specimens_of(&specimens), precision, off, room, numbers }
    }

    /// The fit with some effects' numbers, from the plain one on; `None` where a sheet has no
    /// sensitivities to them.
    pub fn with(&mut self, numbers: &[&'static Number]) -> Option<Fitted> {
        let (state, ended) = self.descended(numbers)?;
        Some(self.fitted(numbers, state, ended))
    }

    /// The same with the least squares around it.
    pub(in crate::calibrate) fn found(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let (state, ended) = self.descended(numbers)?;
        let around = self.around_found(&state, numbers)?;
        Some((self.fitted(numbers, state, ended), around))
    }

    pub(super) fn descended(&mut self, numbers: &[&'static Number]) -> Option<(State, Ended)> {
        let state = self.state_with(numbers)?;
        let most = self.simulated + self.options.evaluations * self.targets.len();
        Some(self.descend(numbers, state, most))
    }

    /// The plain fit with the least squares around it, of every effect's numbers.
    pub(in crate::calibrate) fn plain_found(&mut self) -> Option<Found> {
        self.restore();
        let (state, own) = (self.plain.clone(), self.declared.clone());
        let around = self.around_found(&state, &own)?;
        Some((self.plain(), around))
    }

    /// The fit with some effects' numbers, softening among them, from sheets led with the cloth
    /// that balances the forces on the plain fit's sheets (`softened.rs`), and with what finer
    /// cells do to that cloth; `None` where nothing softens, or a sheet does not come to rest.
    pub(in crate::calibrate) fn softened(&mut self, numbers: &[&'static Number]) -> Option<Found> {
        let state = self.state_with(numbers)?;
        let shared = softened(&state, numbers, &self.equations(numbers).limits())?;
        self.around_shared(numbers, &shared, Self::plain_found)?
    }

    /// Does something with the fit around the cloth of another one, whose effects' numbers are
    /// unknowns of the model there as those declared are, its sheets started anew; `None` where one
    /// does not come to rest.
    pub(in crate::calibrate) fn around<T>(
        &mut self,
        numbers: &[&'static Number],
        from: &Fitted,
        act: impl FnOnce(&mut Self) -> T,
    ) -> Option<T> {
        self.around_shared(numbers, &shared_of(&from.cloth), act)
    }

    /// The same around a cloth of some shared unknowns: what finer cells do to it is known before
    /// the first step.
    pub(super) fn around_shared<T>(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
        act: impl FnOnce(&mut Self) -> T,
    ) -> Option<T> {
        let finer: Vec<_> = self.targets.iter().map(|target| target.finer.clone()).collect();
        let done = self.finely_guided(numbers, shared).map(|(state, ended)| {
            let (kept, stays) = (std::mem::take(&mut self.kept), self.stays.clone());
            self.keep();
            let plain = std::mem::replace(&mut self.plain, state);
            let declared = std::mem::replace(&mut self.declared, numbers.to_vec());
            let ended = std::mem::replace(&mut self.ended, ended);
            let done = act(self);
            (self.plain, self.kept, self.stays) = (plain, kept, stays);
            (self.declared, self.ended) = (declared, ended);
            done
        });
        self.targets.iter_mut().zip(finer).for_each(|(target, finer)| target.finer = finer);
        self.restore();
        done
    }

    /// Where the least squares end from sheets started anew with some shared unknowns, with what
    /// finer cells do to that cloth.
    pub(super) fn finely_guided(
        &mut self,
        numbers: &[&'static Number],
        shared: &[f64],
    ) -> Option<(State, Ended)> {
        let state = self.guided(numbers, shared)?;
        let cloth = self.equations(numbers).cloth(shared);
        let finer = self.finer(&cloth, &state);
        let both = self.targets.iter_mut().zip(finer);
        both.filter(|(_, finer)| finer.is_some()).for_each(|(target, finer)| target.finer = finer);
        let (poses, drapes) = (state.poses(), state.drapes);
        let predictions = drapes.into_iter().map(|draped| draped.prediction).collect();
        let state = self.equations(numbers).around(shared, predictions, &poses);
        let most = self.simulated + self.options.evaluations * self.targets.len();
        Some(self.descend(numbers, state, most))
    }

    /// Sheets of a cloth guided by the outlines anew, in the plain fit's poses, and the least
    /// squares around them; `None`, and the sheets as they were, where one does not come to rest.
    pub(super) fn guided(&mut self, numbers: &[&'static Number], shared: &[f64]) -> Option<State> {
        let cloth = self.equations(numbers).cloth(shared);
        let poses = self.plain.poses();
        let asked = parameters(numbers);
        self.simulated += self.targets.len();
        let continuation = Continuation { cloth: &cloth, options: self.options, asked: &asked };
        let guided = continuation.all(&self.targets, &poses);
        let sheets: Option<Vec<Sheet>> = guided.into_iter().map(Result::ok).collect();
        let (followers, predictions): (Vec<_>, Vec<_>) = sheets?.into_iter().unzip();
        self.followers = followers;
        Some(self.equations(numbers).around(shared, predictions, &poses))
    }
}

/// Shared unknowns with some numbers, those at nothing that were not among them.
fn extended(shared: &[f64], had: &[&'static Number], numbers: &[&'static Number]) -> Vec<f64> {
    let (ln, sizes) = shared.split_at(STIFFNESSES);
    let size = |number: &&'static Number| {
        had.iter().position(|own| own == number).map_or(0.0, |at| sizes[at])
    };
    ln.iter().copied().chain(numbers.iter().map(size)).collect()
}

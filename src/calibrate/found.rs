//! An effect of a fabric, as a fit found it.

use super::effect::{Effect, Number};
use super::fit::Fitted;

/// An effect that was found.
#[derive(Clone, Debug)]
pub struct FoundEffect {
    /// The effect.
    pub effect: &'static Effect,
    /// Its numbers with their values and 90 % intervals, SI.
    pub numbers: Vec<(&'static Number, f64, [f64; 2])>,
    /// Names of the effects that these drapes cannot tell from it.
    pub group: Vec<&'static str>,
}

impl FoundEffect {
    /// An effect of a fit.
    pub(super) fn of(effect: &'static Effect, fitted: &Fitted, group: Vec<&'static str>) -> Self {
        let all = fitted.cloth.effects.iter().zip(&fitted.intervals90);
        let numbers = all
            .filter(|((number, _), _)| effect.numbers.contains(number))
            .map(|((number, value), ends)| (*number, *value, *ends));
        Self { effect, numbers: numbers.collect(), group }
    }
}

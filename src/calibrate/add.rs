//! Effects added to a plain fit, and whether what is left says that something is there at all.
//!
//! In: a plain fit and what its residual asks for ([`Trace`]). Out: the fit with the effects that were asked for, one after the
//! other, each with those that the drapes do not tell from it. Every effect is fitted, not only ranked: its fit is not linear,
//! must be sure of its sign and must not run to an end of what is tried.
//!
//! Scans are explained otherwise ([`super::explain`]).

use super::effect::{Effect, Number};
use super::fit::{Fit, Fitted};
use super::independent::Units;
use super::trace::{Choice, Trace};
use crate::numeric::moments::{mean, mean_and_error};

/// An effect that was added.
#[derive(Clone, Debug)]
pub struct FoundEffect {
    /// The effect.
    pub effect: &'static Effect,
    /// Its numbers with their values and 90 % intervals, SI.
    pub numbers: Vec<(&'static Number, f64, [f64; 2])>,
    /// Names of the effects that these drapes cannot tell from it.
    pub group: Vec<&'static str>,
}

/// Effects with the fit that has them.
pub(super) type Added = (Vec<FoundEffect>, Fitted);

/// What became of the effects that a residual asks for.
pub(super) enum Asked {
    /// These were added.
    Added(Box<Added>),
    /// Each that was asked for is nothing in its own fit: its interval holds nothing and ends before what may be expected.
    Nothing,
    /// None was asked for, or none has a fit that is sure of it.
    NotSure,
}

/// Adds the effects that a residual asks for, some left out of the list; the units are those of the fit's drapes.
pub(super) fn add(fit: &mut Fit<'_>, trace: &Trace, units: &Units) -> Asked {
    let mut added: Option<Added> = None;
    let mut are_nothing = !trace.chosen.is_empty();
    for choice in &trace.chosen {
        let tried = tried_beside(fit, added.as_ref(), &rivals(choice));
        are_nothing &= are_all_nothing(&tried);
        if let Some(more) = nearest(fit, added.as_ref(), tried, &units.of) {
            added = Some(more);
        }
    }
    match added {
        Some(added) => Asked::Added(Box::new(added)),
        None if are_nothing => Asked::Nothing,
        None => Asked::NotSure,
    }
}

/// The fits with one of some effects beside those that were added.
fn tried_beside(
    fit: &mut Fit<'_>,
    added: Option<&Added>,
    of: &[&'static Effect],
) -> Vec<(&'static Effect, Fitted)> {
    let before = effects_of(added);
    let other = of.iter().copied().filter(|effect| !before.contains(effect));
    let fitted = |effect| Some((effect, fit.with(&numbers_with(fit.declared(), &before, effect))?));
    other.filter_map(fitted).collect()
}

fn effects_of(added: Option<&Added>) -> Vec<&'static Effect> {
    added.map_or(Vec::new(), |(found, _)| found.iter().map(|found| found.effect).collect())
}

/// The numbers of a fit with one effect more.
fn numbers_with(
    declared: &[&'static Number],
    before: &[&'static Effect],
    effect: &'static Effect,
) -> Vec<&'static Number> {
    let effects = before.iter().copied().chain([effect]).flat_map(|effect| effect.numbers);
    declared.iter().copied().chain(effects).collect()
}

/// Of some fits with one effect more the best that is sure of it, from sheets led anew.
fn nearest(
    fit: &mut Fit<'_>,
    added: Option<&Added>,
    mut tried: Vec<(&'static Effect, Fitted)>,
    units: &[usize],
) -> Option<Added> {
    let (declared, before) = (fit.declared().to_vec(), effects_of(added));
    tried.retain(|(effect, fitted)| is_something(effect, fitted));
    tried.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    let (effect, mut fitted) = tried.first().cloned()?;
    let numbers = numbers_with(&declared, &before, effect);
    let again = fit.led_again(&numbers, &fitted);
    let better = |again: &Fitted| again.cost < fitted.cost && is_something(effect, again);
    if let Some(again) = again.filter(better) {
        fitted = again;
    }
    let best = &tried[0].1;
    let near = best.cost + TOLD_APART * fitted.misfit.max(1.0).powi(2);
    let as_near = |f: &Fitted| f.cost < near || !is_nearer(best, f, units);
    let other = tried[1..].iter().filter(|(_, f)| as_near(f));
    let found = added.map_or(&[][..], |(effects, _)| effects);
    let mut groups: Vec<Vec<&'static str>> = found.iter().map(|e| e.group.clone()).collect();
    groups.push(other.map(|(e, _)| e.name).collect());
    let effects = [before, vec![effect]].concat();
    // what is there as well is no alternative
    let beside = |name: &&str| effects.iter().all(|effect| effect.name != *name);
    groups.iter_mut().for_each(|group| group.retain(beside));
    let found = effects.iter().zip(groups).map(|(&effect, group)| {
        let numbers = values_of(effect, &fitted);
        FoundEffect { effect, numbers, group }
    });
    Some((found.collect(), fitted))
}

/// The numbers of an effect in a fit, with their values and intervals.
pub(super) fn values_of(effect: &Effect, fitted: &Fitted) -> Vec<(&'static Number, f64, [f64; 2])> {
    let all = fitted.cloth.effects.iter().zip(&fitted.intervals90);
    all.filter(|((number, _), _)| effect.numbers.contains(number))
        .map(|((number, value), ends)| (*number, *value, *ends))
        .collect()
}

/// Whether a fit has an effect of some size, within what is tried.
fn is_something(effect: &Effect, fitted: &Fitted) -> bool {
    let own = numbers_of(effect, fitted);
    let inside = own.iter().all(|(_, _, at_limit)| !at_limit);
    inside && own.iter().any(|(_, [low, high], _)| low * high > 0.0)
}

/// Whether fits with one effect each say of every one that it is nothing. Where none could be fitted nothing is said.
fn are_all_nothing(tried: &[(&'static Effect, Fitted)]) -> bool {
    !tried.is_empty() && tried.iter().all(|(effect, fitted)| is_nothing(effect, fitted))
}

/// Whether a fit leaves no room for an effect: its numbers' intervals hold nothing, and end before what may be expected of it.
fn is_nothing(effect: &Effect, fitted: &Fitted) -> bool {
    let own = numbers_of(effect, fitted);
    own.iter().all(|(number, [low, high], at_limit)| {
        !at_limit && low * high <= 0.0 && -low < number.sigma && *high < number.sigma
    })
}

/// The numbers of an effect in a fit, with their intervals and whether they are at an end of what is tried.
fn numbers_of(effect: &Effect, fitted: &Fitted) -> Vec<(&'static Number, [f64; 2], bool)> {
    let all = fitted.cloth.effects.iter().zip(&fitted.intervals90).zip(&fitted.at_limit);
    all.filter(|(((number, _), _), _)| effect.numbers.contains(number))
        .map(|(((number, _), ends), at_limit)| (*number, *ends, *at_limit))
        .collect()
}

/// Whether the drapes of one fit lie nearer to what was measured than those of another, on the mean over the specimens.
fn is_nearer(one: &Fitted, other: &Fitted, units: &[usize]) -> bool {
    let squared = |fitted: &Fitted| -> Vec<f64> {
        fitted.drapes.iter().flatten().map(|beside| beside.rms_m.powi(2)).collect()
    };
    let farther: Vec<f64> =
        squared(other).iter().zip(squared(one)).map(|(other, one)| other - one).collect();
    let count = units.iter().max().map_or(0, |most| most + 1);
    let of_unit = |unit: usize| {
        let own = farther.iter().zip(units).filter(|(_, own)| **own == unit);
        mean(&own.map(|(value, _)| *value).collect::<Vec<_>>())
    };
    let [mean, error] = mean_and_error(&(0..count).map(of_unit).collect::<Vec<_>>());
    mean > CONFIRMED * error
}

/// The effects of a choice, best first, as many as are refitted.
fn rivals(choice: &Choice) -> Vec<&'static Effect> {
    let mut group = choice.group.clone();
    group.sort_by(|a, b| b.gain[0].total_cmp(&a.gain[0]));
    let all = std::iter::once(choice.ranked.effect).chain(group.iter().map(|r| r.effect));
    all.take(RIVALS).collect()
}

/// Effects that are refitted beside each other.
const RIVALS: usize = 3;
/// Difference of costs, in units of the misfit, below which two effects are not told apart: the odds are then within 20.
const TOLD_APART: f64 = 6.0;
/// Standard errors by which drapes must be nearer with an effect than without.
pub(super) const CONFIRMED: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::effect::Cloth;
    use crate::fabric::{Fabric, TABLE_2};
    use crate::refine::{Ended, RefinedStiffness};

    /// A fit that has one effect of some size.
    fn fitted(effect: &'static Effect, value: f64, half: f64, at_limit: bool) -> Fitted {
        let fabric = Fabric::from_paper_units(TABLE_2.map(|range| range.mean));
        let effects = effect.numbers.iter().map(|number| (number, value)).collect();
        Fitted {
            cloth: Cloth { effects, ..Cloth::plain(fabric) },
            stiffnesses: std::array::from_fn(|k| {
                RefinedStiffness::of(k, 0.0, [0.1, 1.0], [-1.0, 1.0])
            }),
            intervals90: vec![[value - half, value + half]; effect.numbers.len()],
            at_limit: vec![at_limit; effect.numbers.len()],
            drapes: Vec::new(),
            cost: 1.0,
            misfit: 1.0,
            ended: Ended::Converged,
            simulated: 1,
        }
    }

    #[test]
    fn an_effect_is_something_or_nothing_only_within_what_is_tried() {
        let effect = Effect::named("friction").unwrap();
        let of = |value, half, at_limit| {
            let fitted = fitted(effect, value, half, at_limit);
            (is_something(effect, &fitted), is_nothing(effect, &fitted))
        };
        assert_eq!(of(0.3, 0.1, false), (true, false));
        assert_eq!(of(0.05, 0.1, false), (false, true));
        // hardly shown is not nothing
        assert_eq!(of(0.05, 0.5, false), (false, false));
        assert_eq!(of(0.7, 0.1, true), (false, false));
        let tried = |sizes: &[f64]| -> Vec<_> {
            sizes.iter().map(|&value| (effect, fitted(effect, value, 0.1, false))).collect()
        };
        assert!(are_all_nothing(&tried(&[0.05, 0.0])) && !are_all_nothing(&tried(&[0.05, 0.3])));
        // no fit, nothing said
        assert!(!are_all_nothing(&[]));
    }
}

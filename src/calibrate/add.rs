//! Effects added to a plain fit, and whether what is left says that something is there at all.
//!
//! In: a plain fit and what its residual asks for ([`Trace`]). Out: the fit with the effects that were asked for, one after the
//! other, each with those that the drapes do not tell from it. Every effect is fitted, not only ranked: its fit is not linear,
//! must be sure of its sign and must not run to an end of what is tried.
//!
//! Scanned sheets know more than a trace of few units can be sure of: thousands of points that lie farther from the plain model's than scans
//! and cells explain (a misfit above 0.6). Where that is so after what the trace is sure of, the effects that foretell most and softening are fitted
//! all the same, first without the others: a large effect looks like several small ones to a linear choice. One of them is added where its
//! fit leaves less than that and less than half. What an effect leaves (from 0.3 on) is asked anew around the fit that has it, and a second one added
//! beside it where it leaves less than half of that.

use super::effect::{Effect, Number};
use super::fit::{Fit, Fitted};
use super::independent::Units;
use super::options::LEAVES;
use super::trace::{Choice, Trace, trace as trace_of};
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
/// Of scanned sheets nothing is added to an effect that leaves nothing: the choice is linear, and what a large effect does beyond
/// that looks like another.
pub(super) fn add(
    fit: &mut Fit<'_>,
    trace: &Trace,
    units: &Units,
    without: &[&'static Effect],
    scanned: bool,
) -> Asked {
    let mut added: Option<Added> = None;
    let mut alone = Alone::default();
    let mut are_nothing = !trace.chosen.is_empty();
    for choice in &trace.chosen {
        let leads_on = |(_, fitted): &Added| fitted.misfit >= LEAVES && !stands_in(fit, fitted);
        if scanned && !added.as_ref().is_none_or(leads_on) {
            break;
        }
        let rivals = rivals(choice);
        let tried = match &added {
            None => alone.tried(fit, &rivals),
            Some(added) => tried_beside(fit, added, &rivals),
        };
        are_nothing &= are_all_nothing(&tried);
        if let Some(more) = nearest(fit, added.as_ref(), tried, &units.of) {
            added = Some(more);
        }
    }
    if scanned && misfit_of(fit, added.as_ref()) >= LEAVES {
        // what the linear choice took for small effects may be a large one
        added = explained(fit, &foretelling(trace), units, &mut alone).or(added);
    }
    let has_more = |first: &&Added| scanned && is_asked_beside([fit.misfit(), first.1.misfit]);
    if let Some(first) = added.as_ref().filter(has_more) {
        added = explained_beside(fit, first, units, without).or(added);
    }
    match added {
        Some(added) => Asked::Added(Box::new(added)),
        None if are_nothing => Asked::Nothing,
        None => Asked::NotSure,
    }
}

/// The misfit with the effects that were added, or without any.
fn misfit_of(fit: &Fit<'_>, added: Option<&Added>) -> f64 {
    added.map_or_else(|| fit.misfit(), |(_, fitted)| fitted.misfit)
}

/// The one of some effects that leaves little and less than half of what the plain fit does; `None` where there is none.
fn explained(
    fit: &mut Fit<'_>,
    effects: &[&'static Effect],
    units: &Units,
    alone: &mut Alone,
) -> Option<Added> {
    let misfit = fit.misfit();
    let mut tried = alone.tried(fit, effects);
    soften(fit, &mut tried);
    let added = nearest(fit, None, tried, &units.of);
    added.filter(|(_, fitted)| fitted.misfit < LEAVES.min(0.5 * misfit))
}

/// An effect with another one beside it that leaves little and less than half of what the first does. What is left is asked anew around the fit
/// with the first, whose moves are other ones than the plain cloth's: fitted is what that is sure of, else what foretells most.
fn explained_beside(
    fit: &mut Fit<'_>,
    (found, fitted): &Added,
    units: &Units,
    without: &[&'static Effect],
) -> Option<Added> {
    let [first] = &found[..] else { return None };
    let numbers = numbers_with(fit.declared(), &[], first.effect);
    let around = |fit: &mut Fit<'_>| {
        let trace = trace_of(fit, units, without)?;
        let sure = trace.chosen.first().map(rivals);
        let effects = sure.unwrap_or_else(|| foretelling(&trace));
        explained(fit, &effects, units, &mut Alone::default())
    };
    let (second, fitted) = fit.around(&numbers, fitted, around)??;
    if !is_something(first.effect, &fitted) {
        return None;
    }
    let first = FoundEffect { numbers: values_of(first.effect, &fitted), ..first.clone() };
    Some((std::iter::once(first).chain(second).collect(), fitted))
}

/// Fits with one effect each beside the plain model of one fit: an effect that is asked for again is not fitted again.
#[derive(Default)]
struct Alone(Vec<(&'static Effect, Option<Fitted>)>);

impl Alone {
    /// The fits with one of some effects.
    fn tried(
        &mut self,
        fit: &mut Fit<'_>,
        of: &[&'static Effect],
    ) -> Vec<(&'static Effect, Fitted)> {
        of.iter().filter_map(|&effect| Some((effect, self.with(fit, effect)?))).collect()
    }

    fn with(&mut self, fit: &mut Fit<'_>, effect: &'static Effect) -> Option<Fitted> {
        if let Some((_, known)) = self.0.iter().find(|(known, _)| *known == effect) {
            return known.clone();
        }
        let fitted = fit.with(&numbers_with(fit.declared(), &[], effect));
        self.0.push((effect, fitted.clone()));
        fitted
    }
}

/// The fits with one of some effects beside those that were added.
fn tried_beside(
    fit: &mut Fit<'_>,
    (found, _): &Added,
    of: &[&'static Effect],
) -> Vec<(&'static Effect, Fitted)> {
    let before: Vec<_> = found.iter().map(|found| found.effect).collect();
    let other = of.iter().copied().filter(|effect| !before.contains(effect));
    let fitted = |effect| Some((effect, fit.with(&numbers_with(fit.declared(), &before, effect))?));
    other.filter_map(fitted).collect()
}

/// Puts the fit of a cloth that softens in place of the tried one where it begins nearer ([`Fit::softened`]).
fn soften(fit: &mut Fit<'_>, tried: &mut [(&'static Effect, Fitted)]) {
    let own = tried.iter_mut().find(|(effect, _)| effect.name == SOFTENING);
    let Some((effect, fitted)) = own else { return };
    let other = fit.softened(&numbers_with(fit.declared(), &[], effect));
    if let Some(other) = other.filter(|other| other.cost < fitted.cost) {
        *fitted = other;
    }
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
    let again = (!stands_in(fit, &fitted)).then(|| fit.led_again(&numbers, &fitted)).flatten();
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

/// Whether an effect leaves scanned sheets too much, and nearly all that they had: it stands in for something else, and nothing is built on it.
fn stands_in(fit: &Fit<'_>, fitted: &Fitted) -> bool {
    let is_scanned = fit.scanned().into_iter().all(|scanned| scanned);
    is_scanned && fitted.misfit >= LEAVES && fitted.misfit >= LITTLE * fit.misfit()
}

/// The numbers of an effect in a fit, with their values and intervals.
fn values_of(effect: &Effect, fitted: &Fitted) -> Vec<(&'static Number, f64, [f64; 2])> {
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

/// The effects that foretell anything, each alone, best first, as many as are refitted; and softening, which next to all measured
/// fabrics have (`docs/validation.md`) and which the moves of a cloth that does not soften hardly show once it is large.
fn foretelling(trace: &Trace) -> Vec<&'static Effect> {
    let foretell = trace.alone.iter().filter(|ranked| ranked.gain[0] > 0.0).take(RIVALS);
    let mut effects: Vec<&'static Effect> = foretell.map(|ranked| ranked.effect).collect();
    let mut asked = trace.alone.iter().map(|ranked| ranked.effect);
    let softening = asked.find(|effect| effect.name == SOFTENING);
    effects.extend(softening.filter(|effect| !effects.contains(effect)));
    effects
}

/// Whether misfits before and after effects, or without any, say that something else is there. An effect that takes a
/// little of what is left may stand in for another one, so that it is held to less than no effect at all.
pub(super) fn is_left([before, after]: [f64; 2], added: bool) -> bool {
    if added { after > LEAVES_BESIDE && after > 0.5 * before } else { after > LEAVES }
}

/// Whether misfits before and after an effect say that another one may be beside it: something is left, and the first took enough of it
/// to be no stand-in for something else.
fn is_asked_beside([before, after]: [f64; 2]) -> bool {
    after >= ASKED_BESIDE && after < STANDS_IN * before
}

/// Misfit that an effect leaves from which on another is asked for beside it, and the part of the misfit before from which on it takes too little
/// to be one of two.
const ASKED_BESIDE: f64 = 0.3;
const STANDS_IN: f64 = 0.8;
/// The part of a misfit that is too much left for it to be led on, where scanned sheets leave much.
const LITTLE: f64 = 0.9;
/// Misfit that an effect may leave at most which takes less than half of it.
const LEAVES_BESIDE: f64 = 0.5;

/// The effect that is fitted whatever it foretells.
const SOFTENING: &str = "softening";
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
    use crate::calibrate::independent::Independent;
    use crate::calibrate::trace::Ranked;
    use crate::fabric::{Fabric, TABLE_2};
    use crate::refine::{Ended, RefinedStiffness};

    #[test]
    fn what_is_left_is_unexplained_unless_effects_take_half_of_it() {
        assert!(!is_left([0.24, 0.24], false) && is_left([0.65, 0.65], false));
        assert!(is_left([2.36, 2.28], true) && !is_left([2.05, 0.44], true));
        assert!(!is_left([2.05, 0.9], true));
        // a tilt in place of a draught, and an effect that does what it can
        assert!(is_left([0.7, 0.58], true) && !is_left([0.58, 0.58], false));
        assert!(!is_left([0.5, 0.4], true));
    }

    #[test]
    fn a_second_effect_is_asked_for_where_the_first_takes_much_and_leaves_something() {
        assert!(is_asked_beside([1.27, 0.57]) && is_asked_beside([1.29, 0.92]));
        assert!(!is_asked_beside([1.27, 0.27]));
        // a tilt in place of a draught
        assert!(!is_asked_beside([1.29, 1.16]));
    }

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

    #[test]
    fn softening_is_fitted_whatever_it_foretells() {
        let ranked = |name: &str, gain: f64| {
            let effect = Effect::named(name).unwrap();
            Ranked { effect, gain: [gain, 0.01], sure: 1.0 }
        };
        let names = |alone: Vec<Ranked>| -> Vec<&'static str> {
            let (units, independent) = (3, Independent::Drapes);
            let (plain, chosen, unexplained, fields) = (1.0, Vec::new(), None, Vec::new());
            let trace = Trace { units, independent, plain, alone, chosen, unexplained, fields };
            foretelling(&trace).into_iter().map(|effect| effect.name).collect()
        };
        let all = ["tilt", "scale", "friction", "plate_radius", "softening"];
        let with = |gains: [f64; 5]| {
            all.iter().zip(gains).map(|(name, gain)| ranked(name, gain)).collect::<Vec<_>>()
        };
        let four = ["tilt", "scale", "friction", "softening"];
        assert_eq!(names(with([0.5, 0.4, 0.3, 0.2, -0.1])), four);
        assert_eq!(names(with([0.5, -0.1, -0.2, -0.3, -0.4])), ["tilt", "softening"]);
        assert!(names(vec![ranked("tilt", -0.1)]).is_empty());
    }
}

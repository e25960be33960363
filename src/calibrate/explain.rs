//! What explains the drapes of a fabric, and how probable each explanation is.
//!
//! In: a plain fit. Out: the explanations with their probabilities, and the fit with the most
//! probable effects. An explanation is nothing beyond the plain model, one effect of the list, two,
//! or something else. All are compared by their evidence (`evidence.rs`) in one sum, so that one
//! drape is enough to ask.
//!
//! Around the plain fit the evidence of every effect is known without simulating a drape. Then the
//! most probable explanation that has not been fitted is fitted, and so on, until none that counts
//! is left: an effect's moves are not linear, and its own fit says what it is worth. What then has
//! some probability is fitted again from sheets that are started anew. Pairs are asked for around
//! these fits. Where something else is most probable, the likeliest effects and softening are
//! fitted too. Then the plain fit begins again from other starts: it may have ended beside the
//! scans for no reason but its start.
//!
//! Something else is what smooth fields on the cloth explain better than the list, or what leaves
//! every fit with a discrepancy that the model's own drapes do not have.

use super::effect::{EFFECTS, Effect, Number, known};
use super::equations::shared_of;
use super::evidence::{Around, Discrepancy, Evidence, Forms, ln_sum};
use super::field::{Field, fields};
use super::fit::{Fit, Fitted, Found};
use super::found::FoundEffect;

/// What may be the cause of what the plain model leaves.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// Nothing: cells, scans and minima alone.
    Nothing,
    /// One effect of the list, or two.
    Effects(Vec<&'static Effect>),
    /// Something that is not on the list.
    Else,
}

/// A cause with its probability.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The cause.
    pub cause: Cause,
    /// Its probability.
    pub probability: f64,
}

/// The probability that something is on which a verdict rests.
const SURE: f64 = 0.95;
/// The probability beyond which something is more probable than all else together.
const MOSTLY: f64 = 0.5;
/// Explanations with effects that count as one, since the scans do not tell them apart.
const MOST_ALIKE: usize = 4;

/// The explanations of the scans of a fabric, the most probable first; the sum of their
/// probabilities is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanations(pub Vec<Explanation>);

impl Explanations {
    /// The probability of a cause.
    #[must_use]
    pub fn probability_of(&self, cause: &Cause) -> f64 {
        let own = self.0.iter().find(|explanation| explanation.cause == *cause);
        own.map_or(0.0, |explanation| explanation.probability)
    }

    /// The most probable effects, and those that the scans do not tell from them: all that are at
    /// least a twentieth as probable. An explanation with an effect more counts for the one without
    /// it: that is there either way, and the other one is not sure.
    #[must_use]
    pub fn alike(&self) -> Vec<(&[&'static Effect], f64)> {
        let of_effects = |e: &Explanation| matches!(e.cause, Cause::Effects(_));
        let most = self.0.iter().find(|e| of_effects(e)).map_or(0.0, |e| e.probability);
        let mut by_size: Vec<(&[&'static Effect], f64)> = Vec::new();
        for Explanation { cause, probability } in &self.0 {
            if let Cause::Effects(effects) = cause {
                by_size.push((effects, *probability));
            }
        }
        by_size.sort_by_key(|(effects, _)| effects.len());
        let mut all: Vec<(&[&'static Effect], f64)> = Vec::new();
        for (effects, probability) in by_size {
            let has = |own: &[&'static Effect]| own.iter().all(|effect| effects.contains(effect));
            match all.iter_mut().find(|(own, _)| has(own)) {
                Some((_, sum)) => *sum += probability,
                None if probability >= TOLD_APART * most => all.push((effects, probability)),
                None => {}
            }
        }
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }

    /// Whether the scans show one effect, or one of a few that they do not tell apart.
    #[must_use]
    pub fn show_an_effect(&self) -> bool {
        let alike = self.alike();
        alike.len() <= MOST_ALIKE && alike.iter().map(|(_, p)| p).sum::<f64>() >= SURE
    }

    /// Whether they show something that is not on the list.
    #[must_use]
    pub fn show_something_else(&self) -> bool {
        self.probability_of(&Cause::Else) >= SURE
    }

    /// Whether nothing beyond the plain model is most probable, more than all else together.
    #[must_use]
    pub fn show_nothing(&self) -> bool {
        self.probability_of(&Cause::Nothing) > MOSTLY
    }
}

/// The measurement that would tell the two most probable explanations apart, told whether drapes of
/// both faces were measured.
#[must_use]
pub fn next_measurement(explanations: &Explanations, both_faces: bool) -> Option<&'static str> {
    let [first, second, ..] = &explanations.0[..] else { return None };
    let effects: Vec<&'static Effect> = [first, second]
        .into_iter()
        .flat_map(|explanation| match &explanation.cause {
            Cause::Effects(effects) => effects.clone(),
            Cause::Nothing | Cause::Else => Vec::new(),
        })
        .collect();
    let has = |names: &[&str]| effects.iter().any(|effect| names.contains(&effect.name));
    let turn = effects.iter().filter(|effect| effect.turns_over()).count();
    Some(if has(&["scale", "specimen_size"]) {
        "Measure the sides of a specimen, and something flat of known size in the same way as the drapes."
    } else if has(&["plate_radius", "plate_edge"]) {
        "Measure the plate\u{2019}s diameter and the radius of its edge."
    } else if has(&["skew"]) {
        "Measure the specimen\u{2019}s two diagonals."
    } else if has(&["tilt"]) {
        "Level the plate, or turn the specimen by 90 degrees and lay it again: a tilt stays with the plate."
    } else if turn == 1 && !both_faces {
        "Turn the specimen over and lay it again: what belongs to a face changes its sign."
    } else if turn > 0 {
        "Lay the specimen on a table: a natural curvature lifts its edges, and a crease stands up as a line."
    } else {
        "Measure more drops of the specimen, and other specimens, or use a sensor with less noise."
    })
}

/// The explanations, with the fit of the most probable effects where these are more probable than
/// nothing.
pub(super) struct Explained {
    pub explanations: Explanations,
    /// What smooth fields on the cloth would explain beside these effects.
    pub fields: Vec<Field>,
    /// The most probable effects with their fit, each with those that the drapes do not tell from
    /// them.
    pub added: Option<(Vec<FoundEffect>, Fitted)>,
}

/// Explains the drapes of a fit, some effects left out of the list; `None` where a sheet has no
/// sensitivities.
pub(super) fn explain(
    fit: &mut Fit<'_>,
    without: &[&'static Effect],
    usual: Discrepancy,
) -> Option<Explained> {
    fit.begin_again_here();
    let mut hunt = Hunt::over(fit, without, usual)?;
    if hunt.may_end_elsewhere(fit.misfit()) && fit.start_otherwise() {
        hunt = Hunt::over(fit, without, usual)?;
    }
    Some(hunt.explained())
}

/// An explanation on trial.
struct Hypothesis {
    effects: Vec<&'static Effect>,
    evidence: Evidence,
    /// Its own fit; without one the evidence is linear, around another fit.
    found: Option<Found>,
    /// How far it was tried.
    tried: Tried,
}

/// How far an explanation was tried.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tried {
    /// Around another fit alone.
    No,
    /// By a fit from the plain one on, if there is one.
    Fitted,
    /// By a fit whose sheets were started anew as well.
    Refit,
}

/// The explanations that are compared.
struct Hunt {
    declared: Vec<&'static Number>,
    asked: Vec<&'static Effect>,
    hypotheses: Vec<Hypothesis>,
    /// The prior of the discrepancy of the model's own drapes.
    usual: Discrepancy,
    /// Evidence of what is on no list: of smooth fields on the cloth, and of patterns.
    other: Option<Evidence>,
    fits: usize,
    /// The least squares around the plain fit.
    plain: (Around, Forms),
}

impl Hunt {
    /// The explanations of what a plain fit leaves, those fitted that count.
    fn over(fit: &mut Fit<'_>, without: &[&'static Effect], usual: Discrepancy) -> Option<Self> {
        let mut hunt = Self::around(fit, without, usual)?;
        hunt.fit_probable(fit);
        if hunt.leads() == Cause::Else {
            hunt.fit_in_doubt(fit);
            hunt.fit_probable(fit);
        }
        Some(hunt)
    }

    fn around(fit: &mut Fit<'_>, without: &[&'static Effect], usual: Discrepancy) -> Option<Self> {
        let declared = fit.declared().to_vec();
        let around =
            fit.around_plain(&known().flat_map(|effect| effect.numbers).collect::<Vec<_>>())?;
        let forms = around.forms()?;
        let is_asked = |effect: &&'static Effect| {
            !without.contains(effect)
                && effect.numbers.iter().any(|n| around.moves(n) && !declared.contains(&n))
        };
        let asked: Vec<&'static Effect> = EFFECTS.iter().filter(is_asked).collect();
        let other = around.of_something_else(&forms, &declared);
        let nothing = around.evidence(&forms, &declared)?;
        let plain =
            Hypothesis { effects: Vec::new(), evidence: nothing, found: None, tried: Tried::Refit };
        let hypotheses = vec![plain];
        let plain = (around, forms);
        let mut hunt = Self { declared, asked, hypotheses, usual, other, fits: 0, plain };
        let given = hunt.given(&[], &hunt.plain.0, &hunt.plain.1);
        hunt.hypotheses.extend(given);
        Some(hunt)
    }

    /// The explanations with one effect more than some have, by their linear evidence around the
    /// fit of those.
    fn given(&self, first: &[&'static Effect], around: &Around, forms: &Forms) -> Vec<Hypothesis> {
        let with = |&effect: &&'static Effect| {
            let effects = sorted(&[first, &[effect]].concat());
            let is_known = self.hypotheses.iter().any(|hypothesis| hypothesis.effects == effects);
            if first.contains(&effect) || is_known {
                return None;
            }
            let evidence = around.evidence(forms, &self.numbers(&effects))?;
            Some(Hypothesis { effects, evidence, found: None, tried: Tried::No })
        };
        self.asked.iter().filter_map(with).collect()
    }

    fn numbers(&self, effects: &[&'static Effect]) -> Vec<&'static Number> {
        let own = effects.iter().flat_map(|effect| effect.numbers);
        self.declared.iter().copied().chain(own).collect()
    }

    /// Fits the most probable explanation that was not fitted, as long as one counts. Then starts
    /// the sheets of those anew that count still.
    fn fit_probable(&mut self, fit: &mut Fit<'_>) {
        while let Some((at, tried)) = self.next() {
            match tried {
                Tried::No => self.fit_one(fit, at),
                Tried::Fitted | Tried::Refit => self.refit(fit, at),
            }
        }
    }

    /// What is tried next, and how far it was.
    fn next(&self) -> Option<(usize, Tried)> {
        let probabilities = self.probabilities();
        let most = |tried: Tried, least: f64| {
            let own = (0..self.hypotheses.len()).filter(|&k| self.hypotheses[k].tried == tried);
            let first = own.max_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]))?;
            (probabilities[first] > least).then_some((first, tried))
        };
        let untried = most(Tried::No, COUNTS).filter(|_| self.fits < MOST_FITS);
        untried.or_else(|| most(Tried::Fitted, MAY_COUNT))
    }

    /// Fits the likeliest single effects that were not fitted, and softening: of a large effect the
    /// linear evidence says little.
    fn fit_in_doubt(&mut self, fit: &mut Fit<'_>) {
        let mut untried: Vec<usize> = (0..self.hypotheses.len())
            .filter(|&k| {
                self.hypotheses[k].tried == Tried::No && self.hypotheses[k].effects.len() == 1
            })
            .collect();
        let ln = |k: &usize| self.hypotheses[*k].evidence.ln(self.usual);
        untried.sort_by(|a, b| ln(b).total_cmp(&ln(a)));
        let softens = |k: &usize| self.hypotheses[*k].effects[0].name == SOFTENING;
        let softening = untried.iter().copied().skip(IN_DOUBT).find(softens);
        untried.truncate(IN_DOUBT);
        untried.extend(softening);
        for k in untried {
            self.fit_one(fit, k);
            self.refit(fit, k);
        }
    }

    /// Fits an explanation from the plain fit on.
    fn fit_one(&mut self, fit: &mut Fit<'_>, at: usize) {
        self.fits += 1;
        let numbers = self.numbers(&self.hypotheses[at].effects);
        let found = fit.found(&numbers);
        match found.and_then(|found| with_evidence(found, &numbers)) {
            Some((found, evidence)) => self.hypotheses[at].take(found, evidence),
            // without a fit it explains nothing
            None => self.hypotheses[at].evidence = self.hypotheses[0].evidence,
        }
        self.hypotheses[at].tried = Tried::Fitted;
    }

    /// Fits an explanation from sheets that are started anew by the cloth of its fit: sheets bring
    /// along what friction remembers of their way. A cloth that softens much is far from the plain
    /// one: its fit begins from the balance of forces as well. The nearest is kept, and what a
    /// second effect would be worth is asked around it.
    fn refit(&mut self, fit: &mut Fit<'_>, at: usize) {
        self.hypotheses[at].tried = Tried::Refit;
        let Some(first) = self.hypotheses[at].found.clone() else { return };
        let effects = self.hypotheses[at].effects.clone();
        let numbers = self.numbers(&effects);
        let again = fit.anew(&numbers, &shared_of(&first.0.cloth));
        let softens = effects.iter().any(|effect| effect.name == SOFTENING);
        let softened = softens.then(|| fit.softened(&numbers)).flatten();
        let all = [Some(first), again, softened].into_iter().flatten();
        let best = all.min_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        let Some((found, evidence)) = best.and_then(|best| with_evidence(best, &numbers)) else {
            return;
        };
        if let (1, Some(forms)) = (effects.len(), found.1.forms()) {
            let given = self.given(&effects, &found.1, &forms);
            self.hypotheses.extend(given);
        }
        self.hypotheses[at].take(found, evidence);
    }

    /// Logarithm of the probability before anything is measured.
    fn ln_prior(&self, hypothesis: &Hypothesis) -> f64 {
        let of = |effect: &&'static Effect| if effect.is_of_bench() { BENCH } else { 1.0 };
        let each: Vec<f64> = self.asked.iter().map(of).collect();
        let (sum, squares): (f64, f64) =
            (each.iter().sum(), each.iter().map(|own| own * own).sum());
        let own: f64 = hypothesis.effects.iter().map(of).product();
        match hypothesis.effects.len() {
            0 => PRIOR_NOTHING.ln(),
            1 => (PRIOR_ONE * own / sum).ln(),
            _ => (PRIOR_TWO * own / (0.5 * (sum * sum - squares))).ln(),
        }
    }

    /// Logarithms of what is compared: each trial's, then that of something else.
    fn ln_all(&self) -> Vec<f64> {
        let own = self.hypotheses.iter().map(|t| self.ln_prior(t) + t.evidence.ln(self.usual));
        let mut all: Vec<f64> = own.collect();
        let given = self
            .hypotheses
            .iter()
            .map(|t| self.ln_prior(t) + t.evidence.ln(self.usual.with_more()));
        let mut other: Vec<f64> = given.map(|ln| ln + PRIOR_ELSE.ln()).collect();
        let of_no_effect =
            self.other.map(|own| [own.ln(self.usual), own.ln(self.usual.with_more())]);
        other.extend(of_no_effect.into_iter().flatten().map(|ln| ln + PRIOR_ELSE.ln()));
        all.push(ln_sum(&other));
        all
    }

    /// Their probabilities.
    fn probabilities(&self) -> Vec<f64> {
        let all = self.ln_all();
        let sum = ln_sum(&all);
        all.iter().map(|ln| (ln - sum).exp()).collect()
    }

    fn explained(mut self) -> Explained {
        let probabilities = self.probabilities();
        let causes = self.hypotheses.iter().map(Hypothesis::cause).chain([Cause::Else]);
        let both = causes.zip(&probabilities);
        let mut explanations: Vec<Explanation> =
            both.map(|(cause, &probability)| Explanation { cause, probability }).collect();
        explanations.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let explanations = Explanations(explanations);
        let alike = explanations.alike();
        let first = alike.first().filter(|(_, sum)| *sum > probabilities[0]);
        let added = first.and_then(|(effects, _)| {
            let own =
                self.hypotheses.iter_mut().find(|hypothesis| hypothesis.effects == *effects)?;
            let fitted = own.found.take()?.0;
            let mut group: Vec<&'static str> = Vec::new();
            for effect in alike.iter().flat_map(|(other, _)| *other) {
                if !effects.contains(effect) && !group.contains(&effect.name) {
                    group.push(effect.name);
                }
            }
            let found = effects.iter().map(|e| FoundEffect::of(e, &fitted, group.clone()));
            Some((found.collect::<Vec<_>>(), fitted))
        });
        let found = added.iter().flat_map(|(found, _)| found);
        let given: Vec<&'static Effect> = found.map(|found| found.effect).collect();
        let (around, forms) = &self.plain;
        let fields = fields(around, forms, &self.numbers(&given), self.usual);
        Explained { explanations, fields, added }
    }

    /// Whether a plain fit that leaves so much may have ended beside the scans for no reason but
    /// its start.
    fn may_end_elsewhere(&self, misfit: f64) -> bool {
        match self.leads() {
            Cause::Else => true,
            Cause::Nothing => misfit > LEFT_BEHIND * self.usual.median(),
            Cause::Effects(_) => false,
        }
    }

    /// The most probable cause.
    fn leads(&self) -> Cause {
        let probabilities = self.probabilities();
        let best =
            (0..probabilities.len()).max_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
        best.and_then(|k| self.hypotheses.get(k)).map_or(Cause::Else, Hypothesis::cause)
    }
}

/// A fit with some numbers and its evidence.
fn with_evidence(found: Found, numbers: &[&'static Number]) -> Option<(Found, Evidence)> {
    let evidence = found.1.evidence(&found.1.forms()?, numbers)?;
    Some((found, evidence))
}

impl Hypothesis {
    fn take(&mut self, found: Found, evidence: Evidence) {
        (self.found, self.evidence) = (Some(found), evidence);
    }

    fn cause(&self) -> Cause {
        match self.effects.is_empty() {
            true => Cause::Nothing,
            false => Cause::Effects(self.effects.clone()),
        }
    }
}

/// Effects in the order of the list, so that a pair is one whichever comes first.
fn sorted(effects: &[&'static Effect]) -> Vec<&'static Effect> {
    EFFECTS.iter().filter(|effect| effects.contains(effect)).collect()
}

/// The effect whose fit may begin from the balance of forces.
const SOFTENING: &str = "softening";
/// Probabilities before anything is measured: of nothing, of any one effect, of any two. And of
/// something else beside each of them.
const PRIOR_NOTHING: f64 = 0.5;
const PRIOR_ONE: f64 = 0.35;
const PRIOR_TWO: f64 = 0.15;
const PRIOR_ELSE: f64 = 0.05;
/// How many times as probable as an effect of the cloth one of the bench is: benches are measured.
const BENCH: f64 = 0.2;
/// Probability from which on an explanation is fitted.
const COUNTS: f64 = 0.05;
/// Probability of a fitted explanation from which on its sheets are started anew.
const MAY_COUNT: f64 = 0.01;
/// Single effects that are fitted before something else is accepted.
const IN_DOUBT: usize = 2;
/// How many times the usual discrepancy a plain fit leaves that may have ended beside the scans.
const LEFT_BEHIND: f64 = 1.5;
/// Explanations that are fitted at most.
const MOST_FITS: usize = 8;
/// Part of the most probable effects' probability from which on others are not told from them.
const TOLD_APART: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    fn explanations(all: &[(&[&str], f64)]) -> Explanations {
        let of = |(names, probability): &(&[&str], f64)| {
            let effect = |name: &&str| Effect::named(name).unwrap();
            let cause = match names {
                [] => Cause::Nothing,
                ["else"] => Cause::Else,
                names => Cause::Effects(names.iter().map(effect).collect()),
            };
            Explanation { cause, probability: *probability }
        };
        Explanations(all.iter().map(of).collect())
    }

    #[test]
    fn an_effect_is_there_whether_or_not_another_one_is_beside_it() {
        let crease = explanations(&[
            (&["crease"], 0.8),
            (&["crease", "friction"], 0.16),
            (&["tilt"], 0.02),
            (&[], 0.02),
        ]);
        assert!(crease.show_an_effect() && !crease.show_nothing());
        assert_eq!(crease.alike().len(), 1);
        // nor is a second one named that is not sure
        let pair =
            explanations(&[(&["softening", "friction"], 0.7), (&["softening"], 0.28), (&[], 0.02)]);
        let alike = pair.alike();
        let [(effects, _)] = alike[..] else { panic!("{alike:?}") };
        assert_eq!(effects, [Effect::named("softening").unwrap()]);
        assert!(pair.show_an_effect());
        // two that are not told apart are one answer, many are none
        let both = [(&["tilt"][..], 0.6), (&["scale"][..], 0.36), (&[][..], 0.04)];
        assert!(explanations(&both).show_an_effect());
        let names = ["tilt", "scale", "crease", "skew", "friction"];
        let many: Vec<(&[&str], f64)> =
            names.iter().map(|name| (std::slice::from_ref(name), 0.2)).collect();
        assert!(!explanations(&many).show_an_effect());
        let open = explanations(&[(&["tilt"], 0.6), (&[], 0.4)]);
        assert!(!open.show_an_effect() && !open.show_nothing() && !open.show_something_else());
        assert!(explanations(&[(&["else"], 0.97), (&[], 0.03)]).show_something_else());
        assert!(explanations(&[(&[], 0.7), (&["friction"], 0.3)]).show_nothing());
    }

    #[test]
    fn the_next_measurement_tells_the_two_most_probable_apart() {
        let next = |one: &str, other: &str| {
            next_measurement(&explanations(&[(&[one], 0.6), (&[other], 0.4)]), false).unwrap()
        };
        assert!(next("scale", "plate_radius").starts_with("Measure the sides"));
        assert!(next("tilt", "softening").starts_with("Level the plate"));
        assert!(next("natural_curvature", "softening").starts_with("Turn the specimen over"));
        assert!(next("natural_curvature", "crease").starts_with("Lay the specimen"));
        assert!(next("hysteresis", "softening").starts_with("Measure more drops"));
        assert_eq!(next_measurement(&explanations(&[(&[], 1.0)]), false), None);
        // whose faces were both measured is not turned over again
        let faces = explanations(&[(&["natural_curvature"], 0.6), (&["softening"], 0.4)]);
        assert!(next_measurement(&faces, true).unwrap().starts_with("Lay the specimen on a table"));
    }
}

//! Which effects the residual of a plain fit asks for.
//!
//! In: the least squares around the drapes of the plain fit, with the moves of every number of every effect. Out: the
//! effects in the order in which they are chosen, each with those that these drapes cannot tell from it. All of this is
//! linear: no drape is simulated here.
//!
//! Each effect is asked two things. What it foretells: the unknowns that all drapes share are fitted to the drapes of all specimens but one, and
//! the cost of that one's drapes is taken; likewise of each specimen in turn. And how sure it is: by how many of its
//! standard errors its size is from nothing, these from the sizes that come out without each specimen (the jackknife). An
//! effect is chosen where the held-out cost falls and its size is sure at a level of 1 % (Student's t, one side: of the ten or so
//! effects that are asked some five are told apart). Specimens differ, and what two or three of them have in common by chance is no effect: so that the
//! independent unit is the specimen, not the drape and not the point. Of fewer specimens than three the drapes are held out in turn
//! ([`Independent::Drapes`]).
//!
//! Patterns of the outline without any physics ([`PATTERNS`]) are asked the same, after the effects: where they foretell
//! what no effect does, something is unexplained. Last the [`Field`]s on the cloth, which show where it may be.
//!
//! Of scans all this is shown beside what explains them ([`super::explain`]), which decides.
//!
//! Where it fails: an effect so large that its moves are not linear may be ranked wrongly; the refit that follows is not
//! linear.

use super::effect::{EFFECTS, Effect, PATTERNS};
use super::field::{Field, fields};
use super::fit::Fit;
use super::independent::{FEWEST_UNITS, Independent, Units};
use super::linear::{LEAST_GAIN, Linear, falls, positions};
use crate::numeric::moments::{mean, mean_and_error};

/// How well an effect foretells the drapes of specimens that it was not fitted to.
#[derive(Clone, Copy, Debug)]
pub struct Ranked {
    /// The effect.
    pub effect: &'static Effect,
    /// Fall of the logarithm of the held-out cost with it, mean over the specimens and standard error.
    pub gain: [f64; 2],
    /// Its size over the size's standard error over the specimens.
    pub sure: f64,
}

/// An effect that was chosen.
#[derive(Clone, Debug)]
pub struct Choice {
    /// How well it foretells.
    pub ranked: Ranked,
    /// The others that foretell as well, as far as these drapes can tell.
    pub group: Vec<Ranked>,
}

/// What a residual asks for.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Number of independent units.
    pub units: usize,
    /// What they are.
    pub independent: Independent,
    /// Held-out cost without effects, mean over the specimens \[squared standard deviations\].
    pub plain: f64,
    /// All effects, each alone, best first.
    pub alone: Vec<Ranked>,
    /// The effects chosen, in that order.
    pub chosen: Vec<Choice>,
    /// The pattern that foretells what the chosen effects leave, if one does.
    pub unexplained: Option<Ranked>,
    /// The fields on the cloth that explain most of what the chosen effects leave, the one that foretells most first.
    pub fields: Vec<Field>,
}

/// Standard errors beyond which a mean over so many units is sure.
fn student(units: usize) -> f64 {
    *STUDENT.get(units.saturating_sub(2)).unwrap_or(&STUDENT_BEYOND)
}

/// Most effects that are chosen.
const MOST: usize = 2;
/// Student's t beyond which one per cent lies, for 1, 2, ... degrees of freedom, and for more.
const STUDENT: [f64; 12] =
    [31.82, 6.96, 4.54, 3.75, 3.36, 3.143, 3.00, 2.90, 2.82, 2.76, 2.72, 2.68];
const STUDENT_BEYOND: f64 = 2.5;
/// Standard errors beyond which one effect foretells less than another.
const TOLD_APART: f64 = 2.0;

/// What the residual of a plain fit asks for, some effects left out of the list; the units are those of the fit's
/// targets. `None` where there are fewer than [`FEWEST_UNITS`] of them, or a sheet has no sensitivities.
#[must_use]
pub fn trace(fit: &mut Fit<'_>, units: &Units, without: &[&'static Effect]) -> Option<Trace> {
    if units.count() < FEWEST_UNITS {
        return None;
    }
    let linear = Linear::of(fit, units)?;
    let is_asked = |effect: &&'static Effect| !without.contains(effect) && linear.moves(effect);
    let asked = EFFECTS.iter().filter(is_asked).collect();
    Asked { asked, linear, independent: units.independent }.trace()
}

/// A plain fit's specimens, and what they are asked.
struct Asked {
    linear: Linear,
    /// The effects that are looked for: of the list, those that move these drapes at all.
    asked: Vec<&'static Effect>,
    independent: Independent,
}

impl Asked {
    fn trace(&self) -> Option<Trace> {
        let plain = self.linear.held_out(&self.linear.declared)?.costs;
        let mut alone: Vec<Ranked> = self.ranked(&self.linear.declared, &self.asked, &plain);
        alone.sort_by(|a, b| b.gain[0].total_cmp(&a.gain[0]));
        let mut chosen: Vec<Choice> = Vec::new();
        let mut best = plain.clone();
        while chosen.len() < MOST {
            let with = self.with(&chosen);
            let Some(choice) = self.choice(&with, &best) else { break };
            best = self.linear.held_out(&[with, vec![choice.ranked.effect]].concat())?.costs;
            chosen.push(choice);
        }
        let with = self.with(&chosen);
        let left = self.ranked(&with, &PATTERNS.iter().collect::<Vec<_>>(), &best);
        let sure = left.into_iter().filter(|ranked| self.is_sure(ranked));
        let unexplained = sure.max_by(|a, b| a.gain[0].total_cmp(&b.gain[0]));
        let plain = mean(&plain);
        let fields = fields(&self.linear, &with, &best);
        let (units, independent) = (self.linear.specimens.len(), self.independent);
        Some(Trace { units, independent, plain, alone, chosen, unexplained, fields })
    }

    /// What the plain model has, and the effects chosen.
    fn with(&self, chosen: &[Choice]) -> Vec<&'static Effect> {
        let chosen = chosen.iter().map(|choice| choice.ranked.effect);
        self.linear.declared.iter().copied().chain(chosen).collect()
    }

    /// The effect that foretells most beside those chosen, and those that foretell no less; `None` where none is sure to.
    fn choice(&self, with: &[&'static Effect], best: &[f64]) -> Option<Choice> {
        let ranked = self.ranked(with, &self.asked, best);
        let sure = ranked.iter().filter(|ranked| self.is_sure(ranked));
        let first = *sure.max_by(|a, b| a.gain[0].total_cmp(&b.gain[0]))?;
        let of = |effect: &'static Effect| {
            Some(self.linear.held_out(&[with, &[effect]].concat())?.costs)
        };
        let own = of(first.effect)?;
        let as_good = |other: &&Ranked| {
            let Some(costs) = of(other.effect) else { return false };
            let [mean, error] = mean_and_error(&falls(&costs, &own));
            other.effect != first.effect && other.gain[0] > LEAST_GAIN && mean < TOLD_APART * error
        };
        let group = ranked.iter().filter(as_good).copied().collect();
        Some(Choice { ranked: first, group })
    }

    fn is_sure(&self, ranked: &Ranked) -> bool {
        let [gain, error] = ranked.gain;
        let sure = student(self.linear.specimens.len());
        gain > LEAST_GAIN && gain > error && ranked.sure > sure
    }

    /// What each of some effects foretells beside those of `with`, whose held-out costs are `best`.
    fn ranked(
        &self,
        with: &[&'static Effect],
        of: &[&'static Effect],
        best: &[f64],
    ) -> Vec<Ranked> {
        let other = of.iter().copied().filter(|effect| !with.contains(effect));
        let ranked = |effect: &'static Effect| {
            let of = [with, &[effect]].concat();
            let foretold = self.linear.held_out(&of)?;
            let gain = mean_and_error(&falls(best, &foretold.costs));
            Some(Ranked { effect, gain, sure: foretold.sure(&positions(&of, effect)) })
        };
        other.filter_map(ranked).collect()
    }
}

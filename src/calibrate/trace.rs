//! Which effects the residual of a plain fit asks for.
//!
//! In: the least squares around the drapes of the plain fit, with the moves of every number of every effect. Out: the
//! effects in the order in which they are chosen, each with those that these drapes cannot tell from it. All of this is
//! linear: no drape is simulated here.
//!
//! Each drape's pose is taken out of its sums, and out of each specimen's one factor on its bending stiffnesses, by which
//! specimens of one cloth differ: what these could explain explains nothing else. Then each effect is asked
//! two things. What it foretells: the unknowns that all drapes share are fitted to the drapes of all specimens but one, and
//! the cost of that one's drapes is taken; likewise of each specimen in turn. And how sure it is: by how many of its
//! standard errors its size is from nothing, these from the sizes that come out without each specimen (the jackknife). An
//! effect is chosen where the held-out cost falls and its size is sure at a level of 1 % (Student's t, one side: of the ten or so
//! effects that are asked some five are told apart). Specimens differ, and what two or three of them have in common by chance is no effect: so that the
//! independent unit is the specimen, not the drape and not the point.
//!
//! Patterns of the outline without any physics ([`PATTERNS`]) are asked the same, after the effects: where they foretell
//! what no effect does, something is unexplained.
//!
//! Where it fails: an effect so large that its moves are not linear may be ranked wrongly; the refit that follows is not
//! linear.

use nalgebra::{DMatrix, DVector};

use super::effect::{EFFECTS, Effect, Number, PATTERNS};
use super::fit::Fit;
use super::pose::POSE;
use super::squares::Sums;
use crate::fabric::STIFFNESSES;
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
    /// Number of independent units: specimens.
    pub units: usize,
    /// Held-out cost without effects, mean over the specimens \[squared standard deviations\].
    pub plain: f64,
    /// All effects, each alone, best first.
    pub alone: Vec<Ranked>,
    /// The effects chosen, in that order.
    pub chosen: Vec<Choice>,
    /// The pattern that foretells what the chosen effects leave, if one does.
    pub unexplained: Option<Ranked>,
}

/// Fewest specimens that anything can be held out of.
pub const FEWEST_UNITS: usize = 3;
/// Most effects that are chosen.
const MOST: usize = 2;
/// Least fall of the logarithm of the held-out cost.
const LEAST_GAIN: f64 = 0.05;
/// Student's t beyond which one per cent lies, for 1, 2, ... degrees of freedom, and for more.
const STUDENT: [f64; 12] =
    [31.82, 6.96, 4.54, 3.75, 3.36, 3.143, 3.00, 2.90, 2.82, 2.76, 2.72, 2.68];
const STUDENT_BEYOND: f64 = 2.5;
/// Standard errors beyond which one effect foretells less than another.
const TOLD_APART: f64 = 2.0;

/// Numbers of all effects and patterns.
pub fn all_numbers() -> Vec<&'static Number> {
    EFFECTS.iter().chain(&PATTERNS).flat_map(|effect| effect.numbers).collect()
}

/// What the residual of a plain fit asks for, some effects left out of the list; `units[k]` is the specimen of the fit's k-th
/// target. `None` where there are fewer than [`FEWEST_UNITS`] of them, or a sheet has no sensitivities.
#[must_use]
pub fn trace(fit: &mut Fit<'_>, units: &[usize], without: &[&'static Effect]) -> Option<Trace> {
    let numbers = all_numbers();
    let state = fit.state_with(&numbers)?;
    let (precision, pull, _) = fit.squares(&numbers).prior(&state.shared);
    let drapes: Option<Vec<Quadratic>> = state.sums.iter().map(Quadratic::of).collect();
    let count = units.iter().max().map_or(0, |most| most + 1);
    let mut specimens: Vec<Option<Quadratic>> = (0..count).map(|_| None).collect();
    for (drape, &unit) in drapes?.into_iter().zip(units) {
        match &mut specimens[unit] {
            Some(sum) => sum.add(&drape),
            empty => *empty = Some(drape),
        }
    }
    let specimens: Vec<Quadratic> =
        specimens.into_iter().flatten().map(Quadratic::of_specimen).collect();
    let moves = |effect: &&'static Effect| {
        let own = positions(&[effect], effect);
        let all = indices(&[effect]);
        own.iter().any(|&at| specimens.iter().any(|s| s.a[(all[at], all[at])] > 0.0))
    };
    let asked = EFFECTS.iter().filter(|effect| !without.contains(effect)).filter(moves).collect();
    let declared = fit.declared();
    let is_declared = |effect: &&Effect| effect.numbers.iter().any(|n| declared.contains(&n));
    let declared = EFFECTS.iter().filter(is_declared).collect();
    let linear = Linear { specimens, precision, pull, declared, asked };
    (count >= FEWEST_UNITS).then(|| linear.trace()).flatten()
}

/// Cost of an independent point that is as near as drapes are known at all: half of the standard deviation, as pictures of
/// one drape differ. What lies below that is no residual.
const KNOWN: f64 = 0.25;
/// Standard deviation of the logarithm by which the bending of specimens of one cloth differs: the 3 to 4 points by which
/// drape coefficients of one face scatter over the specimens of the measured fabrics.
const SPECIMENS_DIFFER: f64 = 0.15;

/// The cost of a drape or of a specimen's drapes over the shared unknowns' changes, its pose at its best:
/// `c - 2 b d + d A d`.
struct Quadratic {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: f64,
}

impl Quadratic {
    fn of(sums: &Sums) -> Option<Self> {
        let common = sums.right.len() - POSE;
        let pose = sums.normal.view((common, common), (POSE, POSE)).into_owned().cholesky()?;
        let coupled = sums.normal.view((common, 0), (POSE, common)).into_owned();
        let own = sums.right.rows(common, POSE).into_owned();
        let solved = pose.solve(&coupled);
        let a = sums.normal.view((0, 0), (common, common)) - coupled.tr_mul(&solved);
        let b = sums.right.rows(0, common) - solved.tr_mul(&own);
        let c = sums.cost - own.dot(&pose.solve(&own)) + KNOWN * sums.independent;
        Some(Self { a, b, c })
    }

    fn add(&mut self, other: &Self) {
        self.a += &other.a;
        self.b += &other.b;
        self.c += other.c;
    }

    /// The same with a factor of its own on the three bending stiffnesses, at its best.
    fn of_specimen(mut self) -> Self {
        let stiffer =
            DVector::from_fn(
                self.b.len(),
                |k, _| {
                    if (3..STIFFNESSES).contains(&k) { 1.0 } else { 0.0 }
                },
            );
        let bent = &self.a * &stiffer;
        let (pulled, whole) =
            (stiffer.dot(&self.b), stiffer.dot(&bent) + SPECIMENS_DIFFER.powi(-2));
        self.a.ger(-1.0 / whole, &bent, &bent, 1.0);
        self.b.axpy(-pulled / whole, &bent, 1.0);
        self.c -= pulled * pulled / whole;
        self
    }
}

struct Linear {
    specimens: Vec<Quadratic>,
    precision: DMatrix<f64>,
    pull: DVector<f64>,
    /// What the plain model has.
    declared: Vec<&'static Effect>,
    /// The effects that are looked for: of the list, those that move these drapes at all.
    asked: Vec<&'static Effect>,
}

impl Linear {
    fn trace(&self) -> Option<Trace> {
        let plain = self.held_out(&self.declared)?.costs;
        let mut alone: Vec<Ranked> = self.ranked(&self.declared, &self.asked, &plain);
        alone.sort_by(|a, b| b.gain[0].total_cmp(&a.gain[0]));
        let mut chosen: Vec<Choice> = Vec::new();
        let mut best = plain.clone();
        while chosen.len() < MOST {
            let with = self.with(&chosen);
            let Some(choice) = self.choice(&with, &best) else { break };
            best = self.held_out(&[with, vec![choice.ranked.effect]].concat())?.costs;
            chosen.push(choice);
        }
        let with = self.with(&chosen);
        let left = self.ranked(&with, &PATTERNS.iter().collect::<Vec<_>>(), &best);
        let sure = left.into_iter().filter(|ranked| self.is_sure(ranked));
        let unexplained = sure.max_by(|a, b| a.gain[0].total_cmp(&b.gain[0]));
        let plain = mean(&plain);
        Some(Trace { units: self.specimens.len(), plain, alone, chosen, unexplained })
    }

    /// What the plain model has, and the effects chosen.
    fn with(&self, chosen: &[Choice]) -> Vec<&'static Effect> {
        let chosen = chosen.iter().map(|choice| choice.ranked.effect);
        self.declared.iter().copied().chain(chosen).collect()
    }

    /// The effect that foretells most beside those chosen, and those that foretell no less; `None` where none is sure to.
    fn choice(&self, with: &[&'static Effect], best: &[f64]) -> Option<Choice> {
        let ranked = self.ranked(with, &self.asked, best);
        let sure = ranked.iter().filter(|ranked| self.is_sure(ranked));
        let first = *sure.max_by(|a, b| a.gain[0].total_cmp(&b.gain[0]))?;
        let of = |effect: &'static Effect| Some(self.held_out(&[with, &[effect]].concat())?.costs);
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
        let sure = STUDENT.get(self.specimens.len().saturating_sub(2)).unwrap_or(&STUDENT_BEYOND);
        gain > LEAST_GAIN && gain > error && ranked.sure > *sure
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
            let foretold = self.held_out(&of)?;
            let gain = mean_and_error(&falls(best, &foretold.costs));
            Some(Ranked { effect, gain, sure: foretold.sure(&positions(&of, effect)) })
        };
        other.filter_map(ranked).collect()
    }

    /// What comes of each specimen's drapes with some effects fitted to all others.
    fn held_out(&self, effects: &[&'static Effect]) -> Option<Foretold> {
        let of = indices(effects);
        let own = |(k, held): (usize, &Quadratic)| {
            let mut a = picked(&self.precision, &of);
            let mut b = self.pull.select_rows(&of);
            for (_, fitted) in self.specimens.iter().enumerate().filter(|(other, _)| *other != k) {
                a += picked(&fitted.a, &of);
                b += fitted.b.select_rows(&of);
            }
            let change = a.cholesky()?.solve(&b);
            let bent = picked(&held.a, &of) * &change;
            let cost = held.c - 2.0 * held.b.select_rows(&of).dot(&change) + change.dot(&bent);
            Some((cost, change))
        };
        let all: Option<Vec<_>> = self.specimens.iter().enumerate().map(own).collect();
        let (costs, changes) = all?.into_iter().unzip();
        Some(Foretold { costs, changes })
    }
}

/// What was fitted without each specimen, and what it costs there.
struct Foretold {
    costs: Vec<f64>,
    changes: Vec<DVector<f64>>,
}

impl Foretold {
    /// The size of the numbers at some places over its standard error: along their mean, from the sizes without each
    /// specimen (Tukey's jackknife).
    fn sure(&self, at: &[usize]) -> f64 {
        let count = self.changes.len() as f64;
        let of: Vec<DVector<f64>> = self.changes.iter().map(|c| c.select_rows(at)).collect();
        let mean = of.iter().sum::<DVector<f64>>() / count;
        let square: f64 = of.iter().map(|c| (c.dot(&mean) - mean.norm_squared()).powi(2)).sum();
        let error = ((count - 1.0) / count * square).sqrt();
        if error > 0.0 { mean.norm_squared() / error } else { 0.0 }
    }
}

/// Where the numbers of one of some effects are among the unknowns of [`indices`].
fn positions(effects: &[&'static Effect], of: &'static Effect) -> Vec<usize> {
    let all = indices(effects);
    let own = indices(&[of]);
    let is_own = |&at: &usize| all[at] >= STIFFNESSES && own.contains(&all[at]);
    (0..all.len()).filter(is_own).collect()
}

/// The unknowns of the fabric and of some effects among all.
fn indices(effects: &[&'static Effect]) -> Vec<usize> {
    let mut all: Vec<usize> = (0..STIFFNESSES).collect();
    let mut at = STIFFNESSES;
    for effect in EFFECTS.iter().chain(&PATTERNS) {
        if effects.contains(&effect) {
            all.extend(at..at + effect.numbers.len());
        }
        at += effect.numbers.len();
    }
    all
}

fn picked(matrix: &DMatrix<f64>, of: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(of).select_columns(of)
}

/// Falls of the logarithms of costs.
fn falls(from: &[f64], to: &[f64]) -> Vec<f64> {
    from.iter().zip(to).map(|(a, b)| (a / b).ln()).collect()
}

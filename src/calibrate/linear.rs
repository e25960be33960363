//! The least squares around a plain fit, by specimens: what comes of each with some effects fitted to the others.
//!
//! In: a plain fit, and the specimen of each of its targets. Out: [`Linear`], the cost of each specimen over the changes of what all
//! drapes share, and [`Foretold`] of a choice of effects. No drape is simulated here but once for its moves.
//!
//! Each drape's pose is taken out of its sums, and out of each specimen's one factor on its bending stiffnesses, by which
//! specimens of one cloth differ: what these could explain explains nothing else. Out of a scanned drape's a small part of every effect
//! is taken as well: a hundred scans of a bench that is 0.1 mm other than it is said to be are sure of that, and it is nothing.

use nalgebra::{DMatrix, DVector};

use super::effect::{Acts, EFFECTS, Effect, Number, known};
use super::fit::Fit;
use super::independent::{Independent, Units};
use super::pose::POSE;
use super::squares::Sums;
use crate::fabric::STIFFNESSES;
use crate::sim::sensitivity::Parameter;

/// A plain fit's specimens.
pub(super) struct Linear {
    pub specimens: Vec<Quadratic>,
    precision: DMatrix<f64>,
    pull: DVector<f64>,
    /// How far each unknown may change, where that is bound.
    room: Vec<Option<[f64; 2]>>,
    /// What the plain model has.
    pub declared: Vec<&'static Effect>,
    /// Whether sheets were scanned, or outlines and rims alone are known.
    pub is_scan: bool,
}

impl Linear {
    /// The units are those of the fit's targets. `None` where a sheet has no sensitivities.
    pub fn of(fit: &mut Fit<'_>, units: &Units) -> Option<Self> {
        let numbers: Vec<&'static Number> = known().flat_map(|effect| effect.numbers).collect();
        let state = fit.state_with(&numbers)?;
        let (precision, pull, _) = fit.squares(&numbers).prior(&state.shared);
        let scanned = fit.scanned();
        let is_scan = scanned.contains(&true);
        let both = state.sums.iter().zip(scanned);
        let drapes: Option<Vec<Quadratic>> = both
            .map(|(sums, scanned)| match scanned {
                true => Quadratic::of(sums, KNOWN_SCANNED)?.but_small_effects(),
                false => Quadratic::of(sums, KNOWN),
            })
            .collect();
        let mut specimens: Vec<Option<Quadratic>> = (0..units.count()).map(|_| None).collect();
        for (drape, &unit) in drapes?.into_iter().zip(&units.of) {
            match &mut specimens[unit] {
                Some(sum) => sum.add(&drape),
                empty => *empty = Some(drape),
            }
        }
        // drapes of one specimen differ by no factor
        let of_unit = match units.independent {
            Independent::Specimens => Quadratic::of_specimen,
            Independent::Drapes => |drape| drape,
        };
        let specimens = specimens.into_iter().flatten().map(of_unit).collect();
        let declared = fit.declared();
        let is_declared = |effect: &&Effect| effect.numbers.iter().any(|n| declared.contains(&n));
        let declared = known().filter(is_declared).collect();
        let room = fit.squares(&numbers).room(&state.shared);
        Some(Self { specimens, precision, pull, room, declared, is_scan })
    }

    /// Whether an effect moves these drapes at all.
    pub fn moves(&self, effect: &'static Effect) -> bool {
        let own = positions(&[effect], effect);
        let all = indices(&[effect]);
        own.iter().any(|&at| self.specimens.iter().any(|s| s.a[(all[at], all[at])] > 0.0))
    }

    /// Precision of the unknowns of [`indices`] before any drape is seen.
    pub fn precision(&self, effects: &[&'static Effect]) -> DMatrix<f64> {
        picked(&self.precision, &indices(effects))
    }

    /// What comes of each specimen's drapes with some effects fitted to all others.
    pub fn held_out(&self, effects: &[&'static Effect]) -> Option<Foretold> {
        self.held_out_with(effects, &self.precision(effects))
    }

    /// The same with another precision of the unknowns.
    pub fn held_out_with(
        &self,
        effects: &[&'static Effect],
        precision: &DMatrix<f64>,
    ) -> Option<Foretold> {
        let of = indices(effects);
        let own = |(k, held): (usize, &Quadratic)| {
            let change = self.fitted(effects, precision, Some(k))?;
            let bent = picked(&held.a, &of) * &change;
            let cost = held.c - 2.0 * held.b.select_rows(&of).dot(&change) + change.dot(&bent);
            Some((cost, change))
        };
        let all: Option<Vec<_>> = self.specimens.iter().enumerate().map(own).collect();
        let (costs, changes) = all?.into_iter().unzip();
        Some(Foretold { costs, changes })
    }

    /// The changes of the unknowns of some effects that fit all specimens but one.
    pub fn fitted(
        &self,
        effects: &[&'static Effect],
        precision: &DMatrix<f64>,
        but: Option<usize>,
    ) -> Option<DVector<f64>> {
        let of = indices(effects);
        let mut a = precision.clone();
        let mut b = self.pull.select_rows(&of);
        for (_, fitted) in self.specimens.iter().enumerate().filter(|(k, _)| Some(*k) != but) {
            a += picked(&fitted.a, &of);
            b += fitted.b.select_rows(&of);
        }
        let mut change = a.clone().cholesky()?.solve(&b);
        // what is bound stays within what is tried of it
        for (at, &unknown) in of.iter().enumerate() {
            let Some([low, high]) = self.room[unknown] else { continue };
            if change[at] < low || change[at] > high {
                a[(at, at)] += FIXED;
                b[at] += FIXED * change[at].clamp(low, high);
                change = a.clone().cholesky()?.solve(&b);
            }
        }
        Some(change)
    }
}

/// Precision of an unknown that is at an end of what is tried of it.
const FIXED: f64 = 1e12;

/// Cost of an independent point that is as near as drapes are known at all: half of the standard deviation, as pictures of
/// one drape differ. What lies below that is no residual.
const KNOWN: f64 = 0.25;
/// The same of scanned sheets, which lie nearer: 0.2 standard deviations, as drapes of the model itself do
/// (`docs/closing_the_loop.md`).
const KNOWN_SCANNED: f64 = 0.04;
/// Part of what may be expected of each effect that every scan has of its own, whatever the cloth: by so much a bench is not what it is
/// said to be, a scan not what was there, cells not the cloth.
const OF_EACH_SCAN: f64 = 0.1;
/// The same of the specimen's size (0.5 mm, chosen before a sensor's edge was in the fit: cloth without effects asked for 0.4 to 0.5 mm less;
/// whether it is needed beside that has not been measured), and of the logarithm of a stiffness.
const SIZE_OF_EACH_SCAN: f64 = 0.25;
const STIFFNESS_OF_EACH_SCAN: f64 = 0.02;
/// Standard deviation of the logarithm by which the bending of specimens of one cloth differs: the 3 to 4 points by which
/// drape coefficients of one face scatter over the specimens of the measured fabrics.
const SPECIMENS_DIFFER: f64 = 0.15;

/// The cost of a drape or of a specimen's drapes over the shared unknowns' changes, its pose at its best:
/// `c - 2 b d + d A d`.
pub(super) struct Quadratic {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: f64,
}

impl Quadratic {
    /// Of a drape's sums, an independent point of which is known so well.
    fn of(sums: &Sums, known: f64) -> Option<Self> {
        let common = sums.right.len() - POSE;
        let pose = sums.normal.view((common, common), (POSE, POSE)).into_owned().cholesky()?;
        let coupled = sums.normal.view((common, 0), (POSE, common)).into_owned();
        let own = sums.right.rows(common, POSE).into_owned();
        let solved = pose.solve(&coupled);
        let a = sums.normal.view((0, 0), (common, common)) - coupled.tr_mul(&solved);
        let b = sums.right.rows(0, common) - solved.tr_mul(&own);
        let c = sums.cost - own.dot(&pose.solve(&own)) + known * sums.independent;
        Some(Self { a, b, c })
    }

    /// The same with a small change of every stiffness and every effect of the drape's own, at their best: what these could make of one
    /// scan is no residual, and of an effect no more is known from one scan than how far it differs from so small a one.
    fn but_small_effects(self) -> Option<Self> {
        let expected = |number: &Number| match number.acts {
            Acts::Sheet(&[Parameter::Warp, Parameter::Weft]) => SIZE_OF_EACH_SCAN,
            _ => OF_EACH_SCAN,
        };
        let sigmas: Vec<f64> = std::iter::repeat_n(STIFFNESS_OF_EACH_SCAN, STIFFNESSES)
            .chain(EFFECTS.iter().flat_map(|effect| effect.numbers).map(expected))
            .collect();
        let (own, all) = (sigmas.len(), self.b.len());
        let mut inner = self.a.view((0, 0), (own, own)).into_owned();
        sigmas.iter().enumerate().for_each(|(k, sigma)| inner[(k, k)] += sigma.powi(-2));
        let inner = inner.cholesky()?;
        let coupled = self.a.view((0, 0), (own, all)).into_owned();
        let pulled = self.b.rows(0, own).into_owned();
        let solved = inner.solve(&coupled);
        let a = &self.a - coupled.tr_mul(&solved);
        let b = &self.b - solved.tr_mul(&pulled);
        let c = self.c - pulled.dot(&inner.solve(&pulled));
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

/// What was fitted without each specimen, and what it costs there.
pub(super) struct Foretold {
    pub costs: Vec<f64>,
    changes: Vec<DVector<f64>>,
}

impl Foretold {
    /// The size of the numbers at some places over its standard error: along their mean, from the sizes without each
    /// specimen (Tukey's jackknife).
    pub fn sure(&self, at: &[usize]) -> f64 {
        let count = self.changes.len() as f64;
        let of: Vec<DVector<f64>> = self.changes.iter().map(|c| c.select_rows(at)).collect();
        let mean = of.iter().sum::<DVector<f64>>() / count;
        let square: f64 = of.iter().map(|c| (c.dot(&mean) - mean.norm_squared()).powi(2)).sum();
        let error = ((count - 1.0) / count * square).sqrt();
        if error > 0.0 { mean.norm_squared() / error } else { 0.0 }
    }

    /// The standard error of each number at some places, likewise.
    pub fn errors(&self, at: &[usize]) -> Vec<f64> {
        let count = self.changes.len() as f64;
        let of = |&k: &usize| {
            let mean = self.changes.iter().map(|c| c[k]).sum::<f64>() / count;
            let squares: f64 = self.changes.iter().map(|c| (c[k] - mean).powi(2)).sum();
            ((count - 1.0) / count * squares).sqrt()
        };
        at.iter().map(of).collect()
    }
}

/// Least fall of the logarithm of the held-out cost that is more than chance.
pub(super) const LEAST_GAIN: f64 = 0.05;

/// Where the numbers of one of some effects are among the unknowns of [`indices`].
pub(super) fn positions(effects: &[&'static Effect], of: &'static Effect) -> Vec<usize> {
    let all = indices(effects);
    let own = indices(&[of]);
    let is_own = |&at: &usize| all[at] >= STIFFNESSES && own.contains(&all[at]);
    (0..all.len()).filter(is_own).collect()
}

/// The unknowns of the fabric and of some effects among all.
pub(super) fn indices(effects: &[&'static Effect]) -> Vec<usize> {
    let mut all: Vec<usize> = (0..STIFFNESSES).collect();
    let mut at = STIFFNESSES;
    for effect in known() {
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
pub(super) fn falls(from: &[f64], to: &[f64]) -> Vec<f64> {
    from.iter().zip(to).map(|(a, b)| (a / b).ln()).collect()
}

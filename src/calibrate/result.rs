//! What was found of a fabric, what it amounts to ([`Verdict`]), and its drapes by role and face.
//!
//! In: a plain fit and one with the effects that were chosen, each drape beside what was measured
//! of it. The verdict compares the drapes held out before and after as pairs.

use super::comparison::Comparison;
use super::effect::Acts;
use super::explain::{Explanations, next_measurement};
use super::fabric_prior::FabricPrior;
use super::field::Field;
use super::fit::{FitError, Fitted};
use super::floor::Spread;
use super::found::FoundEffect;
use super::manifest::{Face, Role};
use super::measured::Measured;
use super::measures::Measures;
use super::residual_size::{ResidualSize, residual_size};
use super::specimens::specimens_of;
use crate::base::units::M_PER_MM;
use crate::numeric::moments::{mean, mean_and_error};
use crate::sim::experiment::{CELLS_PER_BENDING_LENGTH, bending_length_m};
use crate::sim::sensitivity::SensitivityError;

/// A measured drape beside its simulated one.
#[derive(Clone, Debug)]
pub struct ComparedDrape {
    /// Which of [`FabricResult::measured`] it is.
    pub measured: usize,
    /// The drape, or why there is none.
    pub comparison: Result<Comparison, SensitivityError>,
}

/// What was found of a fabric.
#[derive(Clone, Debug)]
pub struct FabricResult {
    /// Its name in the manifest.
    pub name: String,
    /// The prior of it, with the density of its drapes.
    pub fabric_prior: FabricPrior,
    /// Its outlines.
    pub measured: Vec<Measured>,
    /// How well they are known.
    pub floor: Vec<Spread>,
    /// The plain fit; its drapes are the first of [`Self::drapes`].
    pub fitted: Result<Fitted, FitError>,
    /// The drapes that were fitted, then those that were predicted.
    pub drapes: Vec<ComparedDrape>,
    /// What explains the drapes, with probabilities; `None` where a sheet does not say how it
    /// moves.
    pub explanations: Option<Explanations>,
    /// What smooth fields on the cloth would explain beside the effects that were found, the most
    /// probable first.
    pub fields: Vec<Field>,
    /// The fit with the effects that were chosen, if any were.
    pub after: Option<After>,
    /// What all this amounts to.
    pub verdict: Verdict,
}

/// A fabric with effects.
#[derive(Clone, Debug)]
pub struct After {
    /// Its effects, each with those that cannot be told from it.
    pub effects: Vec<FoundEffect>,
    /// The fit.
    pub fitted: Fitted,
    /// The drapes, in the order of [`FabricResult::drapes`].
    pub drapes: Vec<ComparedDrape>,
}

/// What was found of a fabric beyond the plain model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Verdict {
    /// One effect, or one of a few that the drapes do not tell apart, is as good as sure, and
    /// drapes held out confirm it where there are any.
    Found,
    /// Several explanations are probable, or the drapes held out do not confirm the one that is; or
    /// a face that was not fitted is off; or nothing is found while the edges of the scans are
    /// where a sensor alone is not held to have them.
    Undecided,
    /// Something is there that is not on the list, or an effect is found that lets go of the drapes
    /// held out.
    Unexplained,
    /// Nothing beyond the plain model is more probable than all else together.
    None,
}

impl Verdict {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Undecided => "undecided",
            Self::Unexplained => "unexplained",
            Self::None => "none",
        }
    }
}

/// Why a fabric is not to be relied on as it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// The word in files.
    pub code: &'static str,
    /// A sentence.
    pub text: String,
}

/// A drape held out, before and after effects were added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Which of [`FabricResult::measured`] it is.
    pub measured: usize,
    /// Root mean square distance of the outlines, before and after \[m\].
    pub rms_m: [f64; 2],
    /// The same of scanned sheets that were held, once they are released \[m\].
    pub released_rms_m: Option<[f64; 2]>,
    /// Drape coefficient less the measured one, before and after \[%\].
    pub dc_off: [f64; 2],
}

/// Drapes of one role and face, and of one look at drapes that settle, taken together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Group {
    /// Whether they were fitted.
    pub role: Role,
    /// Which side is up, if it is known.
    pub face: Option<Face>,
    /// Which look at a drape that settles.
    pub observation: Option<u32>,
    /// Number of drapes at rest.
    pub drapes: usize,
    /// Number of drapes that did not come to rest.
    pub lost: usize,
    /// Mean and standard error of the outline's root mean square distance \[m\].
    pub rms_m: [f64; 2],
    /// Mean force of the springs that hold a drape, as a share of the weight of the cloth beyond
    /// the plate's edge.
    pub springs_share: f64,
    /// Mean drape coefficient, measured and simulated \[%\].
    pub drape_coefficient: [f64; 2],
    /// Standard error of their difference \[%\].
    pub difference_se: f64,
    /// Mean number of folds, measured and simulated.
    pub folds: [f64; 2],
}

/// What the drapes of a group share: role, face, which look at a drape that settles.
type Together = (Role, Option<Face>, Option<u32>);

impl FabricResult {
    /// The measurement that would tell the two most probable explanations apart; where what was
    /// fitted does not hold for the other face, the rows that have to be fitted too.
    #[must_use]
    pub fn next_measurement(&self) -> Option<&'static str> {
        if self.other_face_is_off().is_some() {
            return Some(
                "Mark drapes of both faces fit: what the faces differ by can be found from both alone.",
            );
        }
        let has = |face: Face| self.measured.iter().any(|m| m.entry.face == Some(face));
        next_measurement(self.explanations.as_ref()?, has(Face::Up) && has(Face::Down))
    }

    /// Number of specimens of which a drape was fitted; a drape of an unknown specimen is of one of
    /// its own.
    #[must_use]
    pub fn specimens_fitted(&self) -> usize {
        let is_fitted = |d: &&ComparedDrape| self.measured[d.measured].entry.role == Role::Fit;
        let own = self.drapes.iter().filter(is_fitted);
        let specimens: Vec<Option<&str>> =
            own.map(|d| self.measured[d.measured].entry.specimen.as_deref()).collect();
        specimens_of(&specimens).into_iter().max().map_or(0, |most| most + 1)
    }

    /// Root mean square distances of the drapes that were predicted and came to rest \[m\].
    #[must_use]
    pub fn held_out_rms_m(&self) -> Vec<f64> {
        let held = |d: &&ComparedDrape| self.measured[d.measured].entry.role == Role::Holdout;
        let at_rest =
            |d: &ComparedDrape| d.comparison.as_ref().ok().map(|comparison| comparison.rms_m);
        self.drapes.iter().filter(held).filter_map(at_rest).collect()
    }

    /// The drapes held out that came to rest before and after effects were added.
    #[must_use]
    pub fn pairs(&self) -> Vec<Pair> {
        let Some(after) = &self.after else { return Vec::new() };
        let both = self.drapes.iter().zip(&after.drapes);
        let pair = |(before, after): (&ComparedDrape, &ComparedDrape)| {
            let measured = &self.measured[before.measured];
            let (Ok(a), Ok(b)) = (&before.comparison, &after.comparison) else { return None };
            let dc = |comparison: &Comparison| {
                comparison.measures.drape_coefficient - measured.measures.drape_coefficient
            };
            let (rms_m, dc_off) = ([a.rms_m, b.rms_m], [dc(a), dc(b)]);
            let held = measured.entry.role == Role::Holdout;
            let released_rms_m = a.released_rms_m.zip(b.released_rms_m).map(<[f64; 2]>::from);
            held.then_some(Pair { measured: before.measured, rms_m, released_rms_m, dc_off })
        };
        both.filter_map(pair).collect()
    }

    /// Why the fabric is not to be relied on as it stands: the verdict, and cells that are too
    /// coarse for the cloth.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        let of_verdict = match self.verdict {
            Verdict::Found | Verdict::None => None,
            Verdict::Undecided => Some((
                "calibration_undecided",
                "the drapes do not decide whether something is there that the parameters lack",
            )),
            Verdict::Unexplained => Some((
                "calibration_unexplained",
                "the drapes show something that the parameters lack",
            )),
        };
        let of_verdict = of_verdict.map(|(code, text)| Doubt { code, text: text.to_owned() });
        of_verdict.into_iter().chain(self.coarse_cells()).collect()
    }

    /// Cells that are too coarse for the cloth, where the fit does not know what finer ones do:
    /// drapes then ask for a stiffness that is the cells' own.
    #[must_use]
    pub fn coarse_cells(&self) -> Option<Doubt> {
        let after = self.after.as_ref();
        let fitted = after.map(|after| &after.fitted).or(self.fitted.as_ref().ok())?;
        // a fit's own drapes were moved there
        let drapes = after.map_or(&self.drapes, |after| &after.drapes);
        let rims = self.measured.iter().filter_map(|measured| measured.rim.as_ref());
        let knows_finer = rims.clone().count() > 0 && rims.clone().all(|rim| rim.sheet.is_some());
        let drape = &drapes.iter().find_map(|drape| drape.comparison.as_ref().ok())?.drape;
        let cell_m = drape.grid.spacing_m;
        let shortest_m = bending_length_m(&fitted.cloth.fabric);
        (!knows_finer && cell_m * CELLS_PER_BENDING_LENGTH > shortest_m).then(|| Doubt {
            code: "cells_too_coarse",
            text: format!(
                "cells of {:.1} mm are too coarse for a bending length of {:.1} mm: the stiffnesses are partly the cells' own; use more --vertices",
                cell_m / M_PER_MM,
                shortest_m / M_PER_MM
            ),
        })
    }

    /// What stays of the drapes, fitted and held out, with the effects that were added or without
    /// any.
    #[must_use]
    pub fn residual_size(&self) -> Option<ResidualSize> {
        let drapes = self.after.as_ref().map_or(&self.drapes, |after| &after.drapes);
        residual_size(drapes.iter().filter_map(|drape| drape.comparison.as_ref().ok()))
    }

    /// By how much the squares of the distances of the drapes held out fall with the effects: of
    /// each drape, or of fewer than [`FEWEST_DRAPES`] of each arc of their outlines \[m^2\].
    fn falls(&self) -> Vec<f64> {
        let pairs = self.pairs();
        if pairs.len() >= FEWEST_DRAPES {
            return pairs.iter().map(|p| p.rms_m[0].powi(2) - p.rms_m[1].powi(2)).collect();
        }
        let rows = |drapes: &[ComparedDrape], k: usize| -> Vec<f64> {
            let own = drapes.iter().find(|drape| drape.measured == k);
            let comparison = own.and_then(|drape| drape.comparison.as_ref().ok());
            comparison.iter().flat_map(|b| b.rows.iter().map(|row| row.across_m.powi(2))).collect()
        };
        let after = self.after.iter().map(|after| &after.drapes);
        let of_pair = |(pair, after): (&Pair, &Vec<ComparedDrape>)| -> Vec<f64> {
            let (before, after) = (rows(&self.drapes, pair.measured), rows(after, pair.measured));
            let falls: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a - b).collect();
            falls.chunks(falls.len().div_ceil(ARCS).max(1)).map(mean).collect()
        };
        after
            .flat_map(|after| pairs.iter().map(move |pair| (pair, after)))
            .flat_map(of_pair)
            .collect()
    }

    /// Whether the plain fit has the scans' edges as far beside the cloth's as a sensor is held to
    /// shift them at most.
    #[must_use]
    pub fn edge_at_limit(&self) -> bool {
        let Ok(fitted) = &self.fitted else { return false };
        let mut all = fitted.cloth.effects.iter().zip(&fitted.at_limit);
        all.any(|((number, _), at_limit)| number.acts == Acts::Edge && *at_limit)
    }

    /// The verdict, by what explains the drapes. Drapes held out have to confirm an effect where
    /// there are any, and what is fitted to one face has to hold for the other.
    pub(super) fn judge(&self) -> Verdict {
        let Some(explanations) = &self.explanations else { return Verdict::Undecided };
        let is_held_out = !self.pairs().is_empty();
        let verdict = if explanations.show_an_effect() && self.after.is_some() {
            match (self.is_confirmed() || !is_held_out, self.falls_away()) {
                (true, false) => Verdict::Found,
                (true, true) => Verdict::Unexplained,
                (false, _) => Verdict::Undecided,
            }
        } else if explanations.show_something_else() {
            Verdict::Unexplained
        } else if explanations.show_nothing() {
            Verdict::None
        } else {
            Verdict::Undecided
        };
        let is_off = self.other_face_is_off().is_some();
        match verdict {
            Verdict::None if self.edge_at_limit() => Verdict::Undecided,
            Verdict::None | Verdict::Found if is_off => Verdict::Undecided,
            verdict => verdict,
        }
    }

    /// A face of which no drape was fitted, and whose drapes held out have another drape
    /// coefficient than is simulated, beyond two standard errors of the mean and a point: measured
    /// and simulated \[%\].
    #[must_use]
    pub fn other_face_is_off(&self) -> Option<(Face, [f64; 2])> {
        let groups = self.groups_of(self.after.as_ref().map_or(&self.drapes, |a| &a.drapes));
        let is_fitted = |face| groups.iter().any(|g| g.role == Role::Fit && g.face == Some(face));
        let is_off = |group: &Group| {
            let [measured, simulated] = group.drape_coefficient;
            let face = group.face.filter(|face| !is_fitted(*face))?;
            let off = (measured - simulated).abs();
            let sure = off > OFF_BY.0 * group.difference_se && off > OFF_BY.1;
            sure.then_some((face, group.drape_coefficient))
        };
        groups.iter().filter(|group| group.role == Role::Holdout).find_map(is_off)
    }

    /// Whether drapes held out lie nearer with the effects that were added than without, beyond two
    /// standard errors of the squares.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        let [mean, error] = mean_and_error(&self.falls());
        self.after.is_some() && mean > CONFIRMED * error
    }

    /// Whether scanned sheets held out, released, lie far from their scans with the effects that
    /// were added and not without: such effects bring tied sheets nearer and are none that the
    /// cloth rests with.
    #[must_use]
    pub fn falls_away(&self) -> bool {
        let free: Vec<[f64; 2]> = self.pairs().iter().filter_map(|p| p.released_rms_m).collect();
        fall_away(&free)
    }

    /// The drapes by role and face: fitted first, face up first.
    #[must_use]
    pub fn groups(&self) -> Vec<Group> {
        self.groups_of(&self.drapes)
    }

    /// The same of other drapes of these measured ones.
    #[must_use]
    pub fn groups_of(&self, drapes: &[ComparedDrape]) -> Vec<Group> {
        let key = |drape: &ComparedDrape| {
            let entry = &self.measured[drape.measured].entry;
            (entry.role, entry.face, entry.observation)
        };
        let mut keys: Vec<_> = drapes.iter().map(key).collect();
        keys.sort();
        keys.dedup();
        let of = |own| self.group(own, drapes.iter().filter(|d| key(d) == own).collect());
        keys.into_iter().map(of).collect()
    }

    fn group(&self, (role, face, observation): Together, all: Vec<&ComparedDrape>) -> Group {
        let at_rest: Vec<(&Measures, &Comparison)> = all
            .iter()
            .filter_map(|d| {
                Some((&self.measured[d.measured].measures, d.comparison.as_ref().ok()?))
            })
            .collect();
        let of = |value: &dyn Fn(&Measures, &Comparison) -> f64| {
            let values: Vec<f64> = at_rest.iter().map(|(m, b)| value(m, b)).collect();
            mean_and_error(&values)
        };
        let coefficient = |m: &Measures| m.drape_coefficient;
        Group {
            role,
            face,
            observation,
            drapes: at_rest.len(),
            lost: all.len() - at_rest.len(),
            rms_m: of(&|_, b| b.rms_m),
            springs_share: of(&|_, b| b.springs_share)[0],
            drape_coefficient: [
                of(&|m, _| coefficient(m))[0],
                of(&|_, b| coefficient(&b.measures))[0],
            ],
            difference_se: of(&|m, b| coefficient(&b.measures) - coefficient(m))[1],
            folds: [of(&|m, _| m.folds as f64)[0], of(&|_, b| b.measures.folds as f64)[0]],
        }
    }
}

/// Whether sheets that were released, at distances \[m\] without effects and with them, lie far off
/// with these: half of them or more by both of [`FAR_OFF`].
fn fall_away(free: &[[f64; 2]]) -> bool {
    let [factor, more_m] = FAR_OFF;
    let far = |[without, with]: &&[f64; 2]| *with > (factor * without).max(without + more_m);
    !free.is_empty() && 2 * free.iter().filter(far).count() >= free.len()
}

/// Standard errors and points of the drape coefficient beyond which a face is off that was not
/// fitted.
const OFF_BY: (f64, f64) = (2.0, 1.0);
/// Standard errors by which drapes held out must be nearer with an effect than without.
const CONFIRMED: f64 = 2.0;
/// Drapes held out from which on their own scatter says how sure a fall is; of fewer that of the
/// arcs of their outlines does, each longer than what is alike along them.
const FEWEST_DRAPES: usize = 3;
const ARCS: usize = 8;
/// How many times as far from its scan a sheet that is released lies with effects as without, and
/// how much farther \[m\], where it does not rest with them: 2 mm lie between neighbouring minima
/// of one cloth.
const FAR_OFF: [f64; 2] = [2.0, 2e-3];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_fall_away_where_half_of_them_lie_far_off_with_effects_alone() {
        assert!(fall_away(&[[1.2e-3, 8.0e-3], [1.1e-3, 9.8e-3]]));
        // nearer, as far as one minimum lies from the next, or far off without effects as well
        assert!(!fall_away(&[[1.2e-3, 0.5e-3], [1.7e-3, 1.4e-3]]));
        assert!(!fall_away(&[[0.4e-3, 1.9e-3]]) && !fall_away(&[[5.8e-3, 8.9e-3]]));
        // one of two is enough, one of three may have found other folds; of none nothing is said
        let (stays, falls) = ([1.2e-3, 0.5e-3], [1.2e-3, 14e-3]);
        assert!(fall_away(&[stays, falls]) && !fall_away(&[stays, falls, stays]));
        assert!(!fall_away(&[]));
    }
}

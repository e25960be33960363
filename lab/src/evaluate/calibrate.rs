//! Calibration held against sealed cases, for `scan2params-lab calibrate`.
//!
//! In: a seed, which cases, how they are made and calibrated. Out: one [`Scored`] a case: its
//! truth, what the calibration [`Said`], and the held-out error of the truth: the true fabric in
//! the true experiment, guided by the same outlines on the calibration's own cells, which no answer
//! can be blamed for. [`Summary`] has the figures that are promised.
//!
//! A case's folder is made, its manifest calibrated, and the truth looked at last; what was said is
//! kept in the folder for the next run of the same program (`kept.rs`).

use std::path::{Path, PathBuf};

use serde::Serialize;

use self::kept::{Keeper, Kept};
pub use self::said::{Said, said_of};
use crate::sealed::{Case, CaseError, Kind, MakeError, MakeOptions, Sealed, make};
use scan2params::base::units::M_PER_MM;
use scan2params::calibrate::effect::{Acts, Cloth, Effect};
use scan2params::calibrate::manifest::{Bench, Face, ManifestError, Role, read as read_manifest};
use scan2params::calibrate::predict::predict;
use scan2params::calibrate::result::FabricResult;
use scan2params::calibrate::run::{CalibrateError, Options, Told, calibrate};
use scan2params::calibrate::target::Target;
use scan2params::io::WriteError;
use scan2params::numeric::moments::mean;
use scan2params::numeric::robust::median;
use scan2params::sim::Experiment;

/// A sealed case and its calibration.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The truth.
    pub sealed: Sealed,
    /// What was said, or why nothing was.
    pub said: Result<Said, String>,
    /// Mean distance of the held-out outlines from the drapes of the truth, guided by them \[mm\];
    /// NaN where none came to rest.
    pub truth_mm: f64,
    /// Effects that the calibration did not look for.
    pub without: Vec<&'static str>,
    /// Specimen and plate of even cloth.
    pub bench: Experiment,
}

/// Why a case is not scored.
#[derive(Debug, thiserror::Error)]
pub enum SeriesError {
    /// It cannot be drawn.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// It cannot be made.
    #[error(transparent)]
    Make(#[from] MakeError),
    /// Its manifest cannot be read.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// Its manifest cannot be calibrated.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// What was said cannot be kept.
    #[error(transparent)]
    Keep(#[from] WriteError),
}

/// Sealed cases, each made, calibrated and scored.
pub struct Series {
    /// Seed of the cases.
    pub seed: u64,
    /// Discs seen from above, or squares that are scanned.
    pub bench: Bench,
    /// One specimen, dropped so often with its face up, in place of several with both faces.
    pub drops: Option<usize>,
    /// Which of them.
    pub cases: std::ops::Range<u64>,
    /// How they are made.
    pub make: MakeOptions,
    /// How they are calibrated.
    pub calibrate: Options,
    /// Where each has its own folder; cases that are there already are not made again, and those
    /// that this program calibrated with these options are read.
    pub folder: PathBuf,
}

impl Series {
    /// Runs the cases one after another, each on all cores; `tell` hears of each as it ends. A case
    /// whose drapes never come to rest is an error; a fabric that is not fitted is scored as such.
    ///
    /// # Errors
    /// The first case that cannot be made or calibrated.
    pub fn run(&self, mut tell: impl FnMut(&Scored)) -> Result<Vec<Scored>, SeriesError> {
        let keeper = Keeper::of(&self.calibrate);
        let mut all = Vec::new();
        for index in self.cases.clone() {
            let scored = self.scored(index, keeper.as_ref())?;
            tell(&scored);
            all.push(scored);
        }
        Ok(all)
    }

    fn scored(&self, index: u64, keeper: Option<&Keeper>) -> Result<Scored, SeriesError> {
        let case = Case::drawn(self.seed, index, self.bench, self.drops)?;
        let folder = self.folder.join(format!("{}-{index}", self.seed));
        let sealed = make(&case, &folder, &self.make)?;
        let kept = match keeper.and_then(|keeper| keeper.read(&folder)) {
            Some(kept) => kept,
            None => {
                let kept = self.calibrated(&case, &folder)?;
                keeper.map_or(Ok(()), |keeper| keeper.write(&folder, &kept))?;
                kept
            }
        };
        let Kept { said, truth_mm } = kept;
        let without = self.calibrate.without.iter().map(|effect| effect.name);
        Ok(Scored { sealed, said, truth_mm, without: without.collect(), bench: case.plain() })
    }

    /// The calibration of a case that was made, and the truth's own error. Files of which none can
    /// be used, or a fabric that is not fitted, are a case of which nothing is said.
    fn calibrated(&self, case: &Case, folder: &Path) -> Result<Kept, SeriesError> {
        let entries = read_manifest(Sealed::manifest(folder))?;
        let unanswered = |why: &dyn std::fmt::Display| Err(why.to_string());
        let found = match calibrate(&entries, &self.calibrate, &|_: Told<'_>| ()) {
            Err(none @ CalibrateError::Nothing { .. }) => {
                return Ok(Kept { said: unanswered(&none), truth_mm: f64::NAN });
            }
            found => found?,
        };
        let Some(result) = found.fabrics.first() else {
            return Ok(Kept { said: unanswered(&"no picture could be used"), truth_mm: f64::NAN });
        };
        let said = match &result.fitted {
            Ok(_) => Ok(said_of(result)),
            Err(error) => unanswered(error),
        };
        Ok(Kept { said, truth_mm: self.truth_mm(case, result) })
    }

    /// The held-out error of the truth.
    fn truth_mm(&self, case: &Case, result: &FabricResult) -> f64 {
        let held = result.drapes.iter().map(|drape| &result.measured[drape.measured]);
        let held: Vec<_> = held.filter(|measured| measured.entry.role == Role::Holdout).collect();
        let smaller = 1.0 / (1.0 + case.scale_by());
        let camera = Effect::named("perspective").into_iter().flat_map(|effect| effect.numbers);
        let mut effects: Vec<_> = camera.map(|number| (number, case.per_height())).collect();
        if self.bench == Bench::Square {
            let scale = Effect::named("scale").into_iter().flat_map(|effect| effect.numbers);
            effects.extend(scale.map(|number| (number, case.scale_by().ln_1p())));
            // the sensor's edges are no part of the truth, and are taken as they are known, or else
            // as they were found
            let [mean_m, sigma_m] = self.calibrate.fit.sensor_edge_m;
            let after = result.after.as_ref().map(|after| &after.fitted);
            let last = after.or(result.fitted.as_ref().ok());
            let found = last.into_iter().flat_map(|fitted| &fitted.cloth.effects);
            let edge = found.filter(|(number, _)| number.acts == Acts::Edge);
            let known = |&(number, m)| (number, if sigma_m > 0.0 { mean_m } else { m });
            effects.extend(edge.map(known));
        }
        let mut rms_m = Vec::new();
        for face in [Face::Up, Face::Down] {
            let bench = case.experiment(face);
            let of_face = held.iter().filter(|measured| measured.entry.face == Some(face));
            let targets: Vec<Target> = of_face
                .filter_map(|measured| {
                    if let Some(rim) = &measured.rim {
                        return Target::of_rim(rim.clone(), &bench);
                    }
                    let outline = measured.outline.mapped(|p| p.map(|v| v * smaller));
                    Some(Target::of(&outline, measured.warp_rad, &bench))
                })
                .collect();
            let fit = self.calibrate.fit;
            let (fabric_prior, rule) = (&result.fabric_prior, &self.calibrate.folds);
            let cloth = Cloth { effects: effects.clone(), ..Cloth::plain(case.fabric) };
            let drapes = predict(&targets, fabric_prior, &cloth, &fit, rule, &|_| ());
            rms_m.extend(drapes.into_iter().flatten().map(|comparison| comparison.rms_m));
        }
        mean(&rms_m) / M_PER_MM
    }
}

/// How many floors the effects of a case must move an outline by for it to count as one that can be
/// seen.
pub const LEAST_FLOORS: f64 = 3.0;

impl Scored {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "case, kind, truth, drapes, size_mm, remaining_mm, verdict, effects, group, right, before_mm, after_mm, released_before_mm, released_after_mm, misfit_before, misfit_after, \
         floor_mm, truth_mm, strongest, in_region, region_share, failure";

    /// How far the effects move an outline on its branch \[mm\], if that is known.
    #[must_use]
    pub fn size_mm(&self) -> Option<f64> {
        self.sealed.size_m().map(|size_m| size_m / M_PER_MM)
    }

    /// What six stiffnesses and the drapes' poses leave of that \[mm\], if it is known.
    #[must_use]
    pub fn remaining_mm(&self) -> Option<f64> {
        self.sealed.remaining_m().map(|remaining_m| remaining_m / M_PER_MM)
    }

    /// Whether the effects move an outline by more than [`LEAST_FLOORS`]; where nothing was said,
    /// by any known distance.
    #[must_use]
    pub fn is_large(&self) -> bool {
        self.is_above(self.size_mm())
    }

    /// Whether what stiffnesses and poses leave of it does.
    #[must_use]
    pub fn stays_large(&self) -> bool {
        self.is_above(self.remaining_mm())
    }

    fn is_above(&self, size_mm: Option<f64>) -> bool {
        let floor_mm = self.said.as_ref().map_or(0.0, |said| said.floor_mm);
        size_mm.is_some_and(|size_mm| size_mm > LEAST_FLOORS * floor_mm)
    }

    /// The effect with a region on the specimen, if there is one.
    fn regional(&self) -> Option<(&crate::sealed::Effect, f64)> {
        let mut own = self.sealed.effects.iter();
        own.find_map(|effect| Some((effect, effect.share(&self.bench)?)))
    }

    /// Whether the tracer's field is strongest where the effect acts; `None` where the effect has
    /// no region, or no field is anything.
    #[must_use]
    pub fn is_in_region(&self) -> Option<bool> {
        let (effect, _) = self.regional()?;
        effect.acts_at(&self.bench, self.said.as_ref().ok()?.strongest?)
    }

    /// The share of the specimen at which the effect acts.
    #[must_use]
    pub fn region_share(&self) -> Option<f64> {
        self.regional().map(|(_, share)| share)
    }

    /// Whether what was said is right. Of cases with effects on the list: each is named or within
    /// the group, and nothing else is named. Of one with none: `none`. Of one that is on no list,
    /// or was left out of it: `unexplained`.
    #[must_use]
    pub fn is_right(&self) -> bool {
        let Ok(said) = &self.said else { return false };
        let left_out = self.sealed.effects.iter().any(|e| self.without.contains(&e.name()));
        match self.sealed.kind {
            _ if left_out => said.verdict == "unexplained",
            Kind::None => said.verdict == "none",
            Kind::Unlisted => said.verdict == "unexplained",
            Kind::One | Kind::Two => {
                let true_names: Vec<&str> = self.sealed.effects.iter().map(|e| e.name()).collect();
                let said_of =
                    |name: &str| said.effects.iter().chain(&said.group).any(|s| s == name);
                let in_group = |name: &String| said.group.contains(name);
                let wrong = |name: &String| !true_names.contains(&name.as_str()) && !in_group(name);
                !said.effects.is_empty()
                    && true_names.iter().all(|name| said_of(name))
                    && !said.effects.iter().any(wrong)
            }
        }
    }

    /// The case as a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Sealed { index, kind, effects, drapes, .. } = &self.sealed;
        let truth: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
        let known = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.2}"));
        let (size, left) = (known(self.size_mm()), known(self.remaining_mm()));
        let (names, drapes) = (truth.join(" "), drapes.len());
        let begun = format!("{index}, {}, {names}, {drapes}, {size}, {left}", kind.name());
        let region = known(self.region_share());
        let right = if self.is_right() { "yes" } else { "no" };
        match &self.said {
            Ok(said) => format!(
                "{begun}, {}, {}, {}, {right}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {}, {}, {region}, ",
                said.verdict,
                said.effects.join(" "),
                said.group.join(" "),
                said.before_mm,
                said.after_mm,
                said.released_mm[0],
                said.released_mm[1],
                said.misfit[0],
                said.misfit[1],
                said.floor_mm,
                self.truth_mm,
                said.strongest.map_or(String::new(), |[warp, weft]| format!("{warp:.2} {weft:.2}")),
                match self.is_in_region() {
                    Some(true) => "yes",
                    Some(false) => "no",
                    None => "",
                },
            ),
            Err(why) => {
                let why = why.replace(", ", "; ");
                let truth_mm = self.truth_mm;
                format!("{begun}, , , , {right}, , , , , , , , {truth_mm:.2}, , , {region}, {why}")
            }
        }
    }
}

/// The figures of some cases; none where no case counts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Cases.
    pub cases: usize,
    /// Those of which nothing was said.
    pub failed: usize,
    /// Cases with one effect.
    pub one: usize,
    /// Those of them whose effect moves outlines by more than [`LEAST_FLOORS`].
    pub large: usize,
    /// Share of the large ones that are right.
    pub named: Option<f64>,
    /// Those whose effect moves outlines by more than [`LEAST_FLOORS`] after six stiffnesses and
    /// the poses took up what they can.
    pub staying: usize,
    /// Share of these that are right.
    pub staying_named: Option<f64>,
    /// Share of the cases with two effects that are right.
    pub both_named: Option<f64>,
    /// Cases without effects.
    pub none: usize,
    /// Share of which something else was said than that there is none, of these less the ones of
    /// which nothing was said.
    pub false_alarms: Option<f64>,
    /// Cases with an effect that is on no list.
    pub unlisted: usize,
    /// Share of these that were called unexplained.
    pub unexplained: Option<f64>,
    /// Those of them whose effect has a region on the specimen, and of which a field is drawn.
    pub drawn: usize,
    /// Share of the drawn ones whose field is strongest in that region.
    pub in_region: Option<f64>,
    /// Mean share of the specimen that these regions are: what places drawn at random would score.
    pub region_share: Option<f64>,
    /// Median, over the large ones, of the held-out error after over that before.
    pub after_over_before: Option<f64>,
    /// Median, over the same, of the held-out error after over the floor.
    pub after_over_floor: Option<f64>,
    /// Median, over the same, of the held-out error after over that of the truth.
    pub after_over_truth: Option<f64>,
}

impl Summary {
    /// Of some cases.
    #[must_use]
    pub fn of(cases: &[Scored]) -> Self {
        let of_kind = |kind: Kind| -> Vec<&Scored> {
            cases.iter().filter(|case| case.sealed.kind == kind).collect()
        };
        let right = |cases: &[&Scored]| {
            let right = cases.iter().filter(|case| case.is_right()).count();
            (!cases.is_empty()).then(|| right as f64 / cases.len() as f64)
        };
        let (one, none) = (of_kind(Kind::One), of_kind(Kind::None));
        let unlisted = of_kind(Kind::Unlisted);
        let judged: Vec<&Scored> = none.iter().copied().filter(|c| c.said.is_ok()).collect();
        let large: Vec<&Scored> = one.iter().copied().filter(|case| case.is_large()).collect();
        let staying: Vec<&Scored> = one.iter().copied().filter(|case| case.stays_large()).collect();
        let drawn = unlisted.iter().filter_map(|c| Some((c.is_in_region()?, c.region_share()?)));
        let drawn: Vec<(bool, f64)> = drawn.collect();
        let of_drawn = |value: &dyn Fn(&(bool, f64)) -> f64| {
            (!drawn.is_empty()).then(|| mean(&drawn.iter().map(value).collect::<Vec<_>>()))
        };
        let ratio = |over: &dyn Fn(&Said, &Scored) -> f64| {
            let ratios = large.iter().filter_map(|case| {
                let said = case.said.as_ref().ok()?;
                Some(said.after_mm / over(said, case)).filter(|ratio| ratio.is_finite())
            });
            median(ratios.collect())
        };
        Self {
            cases: cases.len(),
            failed: cases.iter().filter(|case| case.said.is_err()).count(),
            one: one.len(),
            large: large.len(),
            named: right(&large),
            staying: staying.len(),
            staying_named: right(&staying),
            both_named: right(&of_kind(Kind::Two)),
            none: none.len(),
            false_alarms: right(&judged).map(|right| 1.0 - right),
            unlisted: unlisted.len(),
            unexplained: right(&unlisted),
            drawn: drawn.len(),
            in_region: of_drawn(&|(is_in, _)| f64::from(u8::from(*is_in))),
            region_share: of_drawn(&|(_, share)| *share),
            after_over_before: ratio(&|said, _| said.before_mm),
            after_over_floor: ratio(&|said, _| said.floor_mm),
            after_over_truth: ratio(&|_, case| case.truth_mm),
        }
    }
}

mod kept;
mod said;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sealed::{Effect, SealedDrape};
    use scan2params::sim::experiment::Hem;

    fn scored(kind: Kind, effects: Vec<Effect>, size_m: Option<f64>, said: Said) -> Scored {
        let drape = SealedDrape {
            specimen: 1,
            face: "up".to_owned(),
            role: "fit".to_owned(),
            drop_seed: 1,
            folds: 7,
            size_m,
            remaining_m: size_m.map(|size_m| 0.5 * size_m),
        };
        let sealed = Sealed {
            schema: String::new(),
            seed: 1,
            index: 0,
            kind,
            prior: "measured".to_owned(),
            fabric_si: [1.0; 7],
            effects,
            vertices: 41,
            sensor: None,
            drapes: vec![drape],
        };
        let bench = Experiment::default();
        Scored { sealed, said: Ok(said), truth_mm: 0.5, without: Vec::new(), bench }
    }

    fn said(verdict: &str, effects: &[&str], group: &[&str], after_mm: f64) -> Said {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Said {
            verdict: verdict.to_owned(),
            effects: names(effects),
            group: names(group),
            before_mm: 5.0,
            after_mm,
            released_mm: [f64::NAN; 2],
            misfit: [1.0, 0.5],
            floor_mm: 1.0,
            strongest: None,
        }
    }

    #[test]
    fn what_is_right_depends_on_what_is_true() {
        let friction = Effect::Friction { coefficient: 0.6 };
        let tilt = Effect::Tilt { down_x_rad: 0.02, down_z_rad: 0.0 };
        let right = |kind, effects: &[Effect], said| {
            scored(kind, effects.to_vec(), Some(4e-3), said).is_right()
        };
        let one = |said| right(Kind::One, &[friction], said);
        assert!(one(said("found", &["friction"], &[], 1.0)));
        assert!(one(said("undecided", &["plate_radius"], &["plate_radius", "friction"], 1.0)));
        assert!(!one(said("found", &["plate_radius"], &[], 1.0)));
        assert!(!one(said("found", &["friction", "tilt"], &[], 1.0)));
        assert!(!one(said("unexplained", &[], &[], 1.0)));
        assert!(!one(said("none", &[], &[], 1.0)));
        let two = |said| right(Kind::Two, &[friction, tilt], said);
        assert!(two(said("found", &["tilt", "friction"], &[], 1.0)));
        assert!(!two(said("found", &["tilt"], &[], 1.0)));
        assert!(right(Kind::None, &[], said("none", &[], &[], 5.0)));
        assert!(!right(Kind::None, &[], said("found", &["tilt"], &[], 5.0)));
        assert!(right(Kind::Unlisted, &[friction], said("unexplained", &[], &[], 5.0)));
        assert!(!right(Kind::Unlisted, &[friction], said("none", &[], &[], 5.0)));
    }

    #[test]
    fn a_summary_counts_only_what_can_be_seen() {
        let friction = || vec![Effect::Friction { coefficient: 0.6 }];
        let cases = [
            scored(Kind::One, friction(), Some(4e-3), said("found", &["friction"], &[], 1.0)),
            scored(Kind::One, friction(), Some(5e-3), said("none", &[], &[], 5.0)),
            // half of it stays: above three floors in this one alone
            scored(Kind::One, friction(), Some(6.2e-3), said("found", &["friction"], &[], 2.0)),
            // smaller than three floors, and of no known size
            scored(Kind::One, friction(), Some(2e-3), said("none", &[], &[], 5.0)),
            scored(Kind::One, friction(), None, said("none", &[], &[], 5.0)),
            scored(Kind::None, Vec::new(), None, said("found", &["tilt"], &[], 5.0)),
            scored(Kind::None, Vec::new(), None, said("none", &[], &[], 5.0)),
        ];
        let summary = Summary::of(&cases);
        assert_eq!((summary.cases, summary.one, summary.large, summary.none), (7, 5, 3, 2));
        assert_eq!((summary.named, summary.false_alarms), (Some(2.0 / 3.0), Some(0.5)));
        // a case of which nothing was said is no alarm
        let failed = Scored {
            said: Err("no sheet comes to rest".to_owned()),
            ..scored(Kind::None, Vec::new(), None, said("none", &[], &[], 5.0))
        };
        let [.., found, none] = cases.each_ref();
        let with = Summary::of(&[found.clone(), none.clone(), failed]);
        assert_eq!((with.failed, with.none, with.false_alarms), (1, 3, Some(0.5)));
        assert_eq!((summary.staying, summary.staying_named), (1, Some(1.0)));
        assert_eq!((summary.unexplained, summary.both_named), (None, None));
        assert_eq!((summary.drawn, summary.in_region, summary.region_share), (0, None, None));
        assert_eq!((summary.after_over_floor, summary.after_over_truth), (Some(2.0), Some(4.0)));
        assert!((summary.after_over_before.unwrap() - 0.4).abs() < 1e-12);
        for case in &cases {
            let columns = Scored::COLUMNS.split(", ").count();
            assert_eq!(case.row().split(", ").count(), columns, "{}", case.row());
        }
    }

    #[test]
    fn a_field_is_held_against_the_place_where_an_unlisted_effect_acts() {
        let hem = Hem { added_kg_m2: 0.2, width_m: 20e-3, toward_rad: 0.0 };
        let drawn = |effect: Effect, strongest: Option<[f64; 2]>| {
            let said = Said { strongest, ..said("unexplained", &[], &[], 5.0) };
            scored(Kind::Unlisted, vec![effect], Some(4e-3), said)
        };
        let hem = Effect::Hem(hem);
        let scale = Effect::Scale { by: 0.01 };
        let cases = [
            drawn(hem, Some([1.0, 0.5])),
            drawn(hem, Some([0.0, 0.5])),
            // nothing drawn, and no region
            drawn(hem, None),
            drawn(scale, Some([1.0, 0.5])),
        ];
        let is_in: Vec<_> = cases.iter().map(Scored::is_in_region).collect();
        assert_eq!(is_in, [Some(true), Some(false), None, None]);
        let summary = Summary::of(&cases);
        assert_eq!((summary.drawn, summary.in_region), (2, Some(0.5)));
        assert!((summary.region_share.unwrap() - 0.19).abs() < 0.02);
        for case in &cases {
            let columns = Scored::COLUMNS.split(", ").count();
            assert_eq!(case.row().split(", ").count(), columns, "{}", case.row());
        }
    }
}

//! Sheets guided by what was measured of them, and from cloth to cloth.
//!
//! In: a cloth, a [`Target`], the pose it lies in. Out: a sheet at rest with what is seen of it, or
//! why it does not come to rest. A sheet is laid where it was scanned and held there, guided by a
//! rim that nothing holds, or by an outline, which continues to hold it; after that it follows the
//! cloth.
//!
//! A sheet that comes to rest on a saddle slides off it on the way to a cloth a little stiffer and
//! back; where it does not, it is taken as if a little inertia held it there.

use rayon::prelude::*;

use super::effect::{Cloth, View};
use super::equations::{Problem, parameters};
use super::options::FitOptions;
use super::pose::{Pose, scaled};
use super::prediction::{Prediction, prediction_of, steadied_prediction_of};
use super::target::{Finer, Target, farther};
use crate::fabric::Fabric;
use crate::inverse::STRETCH_AND_SHEAR;
use crate::numeric::moments::mean;
use crate::sim::sensitivity::{Parameter, SensitivityError};
use crate::sim::{Drop, DropStart, FollowOptions, Follower, Hold, SimOptions, Stop};

/// A sheet at rest and what is seen of it.
pub(super) type Sheet = (Follower, Prediction);

/// A cloth that sheets are brought to, and the sensitivities wanted there.
pub(super) struct Continuation<'a> {
    pub cloth: &'a Cloth,
    pub options: &'a FitOptions,
    pub asked: Vec<Parameter>,
}

impl<'a> Continuation<'a> {
    /// With what a problem asks for.
    pub(super) fn of(problem: &Problem<'a>, cloth: &'a Cloth) -> Self {
        Self { cloth, options: problem.options, asked: parameters(&problem.numbers) }
    }

    /// Sheets guided by outlines in some poses, and held.
    pub(super) fn all(
        &self,
        targets: &[Target],
        poses: &[Pose],
    ) -> Vec<Result<Sheet, SensitivityError>> {
        targets.par_iter().zip(poses).map(|(target, pose)| self.guided(target, pose)).collect()
    }

    /// A sheet guided by what was measured of it.
    pub(super) fn guided(&self, target: &Target, pose: &Pose) -> Result<Sheet, SensitivityError> {
        let mut sheet = self.laid(target, pose, self.options.sim.vertices);
        let prediction = self.seen(&mut sheet, target, pose)?;
        Ok((sheet, prediction))
    }

    /// What is seen of a sheet at rest; of one that rests on a saddle once it has slid off it, or,
    /// where it does not, as if a little inertia held it there.
    pub(super) fn seen(
        &self,
        sheet: &mut Follower,
        target: &Target,
        pose: &Pose,
    ) -> Result<Prediction, SensitivityError> {
        let mut prediction = prediction_of(sheet, &self.asked, target.compared());
        for by in OFF_A_SADDLE {
            if !matches!(prediction, Err(SensitivityError::Unstable)) {
                break;
            }
            let (cloth, asked) = (&stiffer(self.cloth, by), parameters(&[]));
            Continuation { cloth, asked, ..*self }.on(sheet, target, pose).ok();
            prediction = self.on(sheet, target, pose);
        }
        match prediction {
            Err(SensitivityError::Unstable) => {
                steadied_prediction_of(sheet, &self.asked, target.compared())
            }
            prediction => prediction,
        }
    }

    /// A sheet brought to the cloth, held by its outline in a pose: what is seen of it there.
    pub(super) fn on(
        &self,
        sheet: &mut Follower,
        target: &Target,
        pose: &Pose,
    ) -> Result<Prediction, SensitivityError> {
        let Self { cloth, options, asked } = self;
        if options.hold_per_m > 0.0 && target.rim.is_none() {
            let view = cloth.view();
            let outline = target.in_plan(&scaled(pose, view.ln_scale), view);
            sheet.hold(&Hold { outline, per_m: options.hold_per_m }, pose.pull_m);
        }
        if target.is_held(options) {
            sheet.hold_farther(farther(cloth.view()));
        }
        let to = cloth.setup(&target.bench, target.lies(pose));
        let way = sheet.follow(&to, &FollowOptions::default());
        match way {
            Ok(way) if way.reached < 1.0 => Err(SensitivityError::NotAtRest(way.stop)),
            Ok(_) => prediction_of(sheet, asked, target.compared()),
            Err(_) => Err(SensitivityError::NotAtRest(Stop::Iterations)),
        }
    }

    /// The same of a sheet that comes to rest on a saddle there as well.
    pub(super) fn steadily_on(
        &self,
        sheet: &mut Follower,
        target: &Target,
        pose: &Pose,
    ) -> Result<Prediction, SensitivityError> {
        match self.on(sheet, target, pose) {
            Err(SensitivityError::Unstable) => {
                steadied_prediction_of(sheet, &self.asked, target.compared())
            }
            way => way,
        }
    }

    /// What finer cells move a tied sheet by, beside its trial; `None` where nothing holds it, or
    /// it does not come to rest there, or in other folds.
    pub(super) fn finer(
        &self,
        target: &Target,
        pose: &Pose,
        prediction: &Prediction,
    ) -> Option<Box<Finer>> {
        let options = self.options;
        if options.finer <= 1.0 || !target.is_held(options) {
            return None;
        }
        let cells = (options.sim.vertices - 1) as f64 * options.finer;
        let drape = self.laid(target, pose, cells.round() as usize + 1).drape();
        let (rim, places) = prediction.moves_to(&drape);
        let squared: Vec<f64> = rim.iter().map(|move_| move_.norm_squared()).collect();
        let fabric_prior = options.believed_of_cells();
        let is_near = drape.stop == Stop::AtRest && mean(&squared).sqrt() < OTHER_FOLDS_M;
        is_near.then(|| Box::new(Finer { rim, places, fabric_prior }))
    }

    /// A sheet guided by what was measured of it, at rest on so many vertices a side.
    pub(super) fn laid(&self, target: &Target, pose: &Pose, vertices: usize) -> Follower {
        let Self { cloth, options, .. } = self;
        let experiment = cloth.setup(&target.bench, target.lies(pose)).experiment;
        let sim = SimOptions { experiment, vertices, ..options.sim };
        let drop = Drop { start: start_of(target, pose, cloth.view(), options) };
        Follower::drop(&cloth.fabric, &drop, &sim)
    }
}

/// A cloth stiffer to bend by this change of logarithms: a sheet that came to rest on a saddle
/// slides off it while it is brought there and back.
fn stiffer(cloth: &Cloth, by: f64) -> Cloth {
    let mut ln = cloth.ln();
    ln[STRETCH_AND_SHEAR..].iter_mut().for_each(|ln| *ln += by);
    let fabric = Fabric::from_ln_stiffnesses(&ln, cloth.fabric.density_kg_m2);
    Cloth { fabric, ..cloth.clone() }
}

/// How a sheet is brought to a target's branch: tied to the scanned sheet or rim, or guided by the
/// outline, which continues to hold it.
fn start_of(target: &Target, pose: &Pose, view: View, options: &FitOptions) -> DropStart {
    let in_plan = || target.in_plan(&scaled(pose, view.ln_scale), view);
    target.start(view, options).unwrap_or_else(|| match options.hold_per_m > 0.0 {
        true => DropStart::Held(Box::new(Hold { outline: in_plan(), per_m: options.hold_per_m })),
        false => DropStart::Outline(Box::new(in_plan())),
    })
}

/// Changes of bending's logarithms that bring a sheet off a saddle, tried in turn.
const OFF_A_SADDLE: [f64; 2] = [0.03, 0.1];
/// Root mean square move of a rim to finer cells from which on the sheet has other folds there
/// \[m\].
const OTHER_FOLDS_M: f64 = 3e-3;

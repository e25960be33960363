//! What each scene of the laboratory is drawn to be: sensor, stand, surroundings, fabric, views,
//! unit.
//!
//! In: the run's seed and the scene's number alone. Out: a [`Drawn`]. Sensors and causes take
//! turns, so that each has its share; everything else is drawn.

use rand::RngExt as _;
use rand::seq::IndexedRandom as _;

use super::broken::Cause;
use super::drapes::KeptDrape;
use scan2params::base::seed;
use scan2params::dataset::setting::Setting;
use scan2params::sensor::{
    CameraPose, Profile, Scene, SceneError, Seen, StandKind, Surroundings, draw_views, seen,
};

/// Fewest and most views of a scene.
const VIEWS: [usize; 2] = [6, 40];
/// Least share of the rim that the views of a valid scene must see.
const LEAST_SEEN: f64 = 0.95;
/// Longest stretch of the rim that they may miss, in points of 244 (5 mm each).
const MOST_HIDDEN: usize = 6;
/// Times that the views are drawn before there are more of them.
const TRIES: u64 = 4;
/// So many more then.
const MORE_VIEWS: usize = 4;

/// One scene, as drawn.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Its number in the run.
    pub index: u64,
    /// The sensor, with the unit of its file.
    pub profile: Profile,
    /// Stand and surroundings.
    pub setting: Setting,
    /// Which drape of the folder.
    pub drape: usize,
    /// Views that are tried first.
    pub views: usize,
    /// What is wrong with it.
    pub cause: Cause,
    /// Seed of its noise, its sizes and its frame.
    pub seed: u64,
}

impl Drawn {
    /// Scene `index` of a run over these sensors and drapes, with these causes in turn.
    #[must_use]
    pub fn of(
        index: u64,
        run_seed: u64,
        sensors: &[Profile],
        drapes: &[KeptDrape],
        causes: &[Cause],
    ) -> Self {
        let mut rng = seed::rng(run_seed, "evaluate-scene", index);
        let place = index as usize;
        let cause = causes[place % causes.len()];
        // Each cause meets each sensor.
        let turn = place / causes.len() + place % causes.len();
        let mut profile = sensors[turn % sensors.len()].clone();
        profile.unit_m = if rng.random() { 1.0 } else { 1e-3 };
        let stand = *StandKind::ALL.choose(&mut rng).unwrap_or(&StandKind::Column);
        // Only a post can be held from far below, without a floor.
        let bare = stand == StandKind::Post && rng.random_bool(0.4);
        let on_floors = &Surroundings::ALL[1..];
        let around = *on_floors.choose(&mut rng).unwrap_or(&Surroundings::Open);
        let surroundings = if bare { Surroundings::Bare } else { around };
        let setting =
            Setting { stand: Some(stand), surroundings: Some(surroundings), rounding_m: None };
        let fits = |k: &usize| cause.suits(&drapes[*k]);
        let suited: Vec<usize> = (0..drapes.len()).filter(fits).collect();
        let drape = suited.choose(&mut rng).copied().unwrap_or(0);
        let views = rng.random_range(VIEWS[0]..=VIEWS[1]);
        Self { index, profile, setting, drape, views, cause, seed: rng.random() }
    }

    /// Name of the stand.
    #[must_use]
    pub fn stand(&self) -> &'static str {
        self.setting.stand.map_or("cusick", StandKind::name)
    }

    /// Name of the surroundings.
    #[must_use]
    pub fn surroundings(&self) -> &'static str {
        self.setting.surroundings.map_or("table", Surroundings::name)
    }

    /// Draws views until they see the rim, more of them where so many cannot; what they see of it.
    ///
    /// # Errors
    /// When the scene is none.
    pub fn views(
        &self,
        scene: &Scene,
        rim: &[scan2params::base::Point3],
    ) -> Result<(Vec<CameraPose>, Seen), SceneError> {
        let mut best: Option<(Vec<CameraPose>, Seen)> = None;
        let mut views = self.views;
        for round in 0.. {
            for attempt in 0..TRIES {
                let seed = self.seed.wrapping_add(round * TRIES + attempt);
                let poses = draw_views(scene, &self.profile, views, seed)?;
                let own = seen(scene, &self.profile, &poses, rim)?;
                let sees = own.share >= LEAST_SEEN && own.longest_hidden <= MOST_HIDDEN;
                if best.as_ref().is_none_or(|(_, best)| own.share > best.share) {
                    best = Some((poses, own));
                }
                if sees {
                    break;
                }
            }
            let done = best.as_ref().is_some_and(|(_, best)| {
                best.share >= LEAST_SEEN && best.longest_hidden <= MOST_HIDDEN
            });
            if done || views >= VIEWS[1] {
                break;
            }
            views = (views + MORE_VIEWS).min(VIEWS[1]);
        }
        Ok(best.unwrap_or_else(|| unreachable!("one round at least")))
    }
}

//! A drape of a case: how it is draped, and pictured or scanned.

use std::path::Path;

use rand::RngExt as _;

use super::record::{DROPS, MakeError, MakeOptions, SealedDrape};
use super::size::size_of;
use crate::sealed::case::{Case, Plan};
use crate::sealed::remaining::Moved;
use scan2params::base::seed::rng;
use scan2params::calibrate::manifest::{Bench, Face, Role};
use scan2params::io::{write_ply, write_png};
use scan2params::sensor::silhouette::{SilhouetteCamera, SilhouetteErrors, silhouette};
use scan2params::sensor::{self, Scene, Stand, default_ring};
use scan2params::sim::{Drape, Drop, DropStart, Follower, SimOptions, Stop};

/// Colour of the mark on a specimen that is scanned.
const MARK: [u8; 3] = [255, 0, 0];
/// Seeds between two drops of a specimen: more than its captures and tries need.
const DROPPED_ANEW: u64 = 1_000_000;
/// By how many pixels the plate's axis is off the picture's middle at most, and the specimen's
/// bearing from the one given \[rad\].
const OFF_MIDDLE_PX: f64 = 6.0;
const OFF_BEARING_RAD: f64 = 0.03;

/// Discs and squares that are marked to be fitted.
const FITTED: [usize; 2] = [4, 2];

/// A drape of a specimen with one side up.
pub(super) struct Unit {
    pub(super) specimen: usize,
    pub(super) face: Face,
    /// Which of its drops, from 1, where it is dropped several times.
    pub(super) drop: Option<usize>,
}

/// The drapes of a plan.
pub(super) fn units(plan: Plan) -> Vec<Unit> {
    let both = |specimen| [Face::Up, Face::Down].map(|face| Unit { specimen, face, drop: None });
    let dropped = |drop| Unit { specimen: 1, face: Face::Up, drop: Some(drop) };
    match plan {
        Plan::Specimens(count) => (1..=count).flat_map(both).collect(),
        Plan::Drops(count) => (1..=count).map(dropped).collect(),
    }
}

impl Unit {
    /// The first specimens are fitted. Four discs, of which each is held out in turn; of squares,
    /// whose scans tell more, the four drapes of two.
    pub(super) fn role(&self, bench: Bench) -> Role {
        let [discs, squares] = FITTED;
        let fitted = if bench == Bench::Cusick { discs } else { squares };
        if self.specimen <= fitted { Role::Fit } else { Role::Holdout }
    }

    /// How often it is seen: of squares those held out are scanned twice, or the first drop, which
    /// gives the floor.
    pub(super) fn captures(&self, bench: Bench, options: &MakeOptions) -> usize {
        match (bench, self.role(bench), self.drop) {
            (Bench::Square, Role::Fit, None | Some(2..)) => 1,
            _ => options.captures,
        }
    }

    pub(super) fn file(&self, bench: Bench, capture: usize) -> String {
        let (specimen, face) = (self.specimen, self.face.name());
        match (bench, self.drop) {
            (Bench::Cusick, _) => format!("S{specimen}_{face}_{capture}.png"),
            (Bench::Square, None) => format!("S{specimen}_{face}_{capture}.ply"),
            (Bench::Square, Some(drop)) => format!("S{specimen}_{face}_drop{drop}_{capture}.ply"),
        }
    }

    /// One seed for each purpose and each try.
    fn seed(&self, case: &Case, purpose: &str, number: u64) -> u64 {
        let of_run: u64 = rng(case.seed, purpose, case.index).random();
        let own = 2 * self.specimen as u64 + u64::from(self.face == Face::Down);
        let drop = self.drop.map_or(0, |drop| DROPPED_ANEW * drop as u64);
        rng(of_run, purpose, drop + 1000 * own + number).random()
    }

    /// Drapes it and writes its pictures or its scan.
    pub(super) fn made(
        &self,
        case: &Case,
        folder: &Path,
        options: &MakeOptions,
    ) -> Result<(SealedDrape, Option<Moved>), MakeError> {
        let (mut follower, drop_seed) = self.draped(case, options.vertices)?;
        let drape = follower.drape();
        for capture in 1..=self.captures(case.bench, options) {
            match case.bench {
                Bench::Cusick => self.pictured(case, &drape, capture, folder, options)?,
                Bench::Square => self.scanned(case, &drape, capture, folder, options)?,
            }
        }
        let size = size_of(case, &drape, &mut follower);
        let (size_m, moved) = size.map_or((None, None), |(size_m, moved)| (Some(size_m), moved));
        let drape = SealedDrape {
            specimen: self.specimen,
            face: self.face.name().to_owned(),
            role: self.role(case.bench).name().to_owned(),
            drop_seed,
            folds: drape.nodes,
            size_m,
            remaining_m: None,
        };
        Ok((drape, moved))
    }

    /// Takes a picture of a drape.
    fn pictured(
        &self,
        case: &Case,
        drape: &Drape,
        capture: usize,
        folder: &Path,
        options: &MakeOptions,
    ) -> Result<(), MakeError> {
        let camera = self.camera(case, capture as u64, options);
        let noise_seed = self.seed(case, "sealed noise", capture as u64);
        let mesh = drape.grid.mesh(&drape.positions_m);
        let picture = silhouette(&mesh, &drape.boundary, &camera, noise_seed);
        let file = folder.join(self.file(case.bench, capture));
        Ok(write_png(file, picture.size_px, &picture.rgb())?)
    }

    /// Scans a drape on its stand, a red mark where its warp points.
    fn scanned(
        &self,
        case: &Case,
        drape: &Drape,
        capture: usize,
        folder: &Path,
        options: &MakeOptions,
    ) -> Result<(), MakeError> {
        let plate_radius_m = case.experiment(self.face).plate.radius_m;
        let stand = Stand { plate_radius_m, ..Stand::MODIFIED_CUSICK };
        let mut scene = Scene::on(drape.mesh(), stand);
        scene.mark_warp_side(MARK)?;
        let noise_seed = self.seed(case, "sealed noise", capture as u64);
        let mut scan = sensor::scan(&scene, &default_ring(), &options.sensor, noise_seed)?;
        let larger = 1.0 + case.scale_by();
        scan.cloud.points.iter_mut().for_each(|point| *point *= larger);
        Ok(write_ply(folder.join(self.file(case.bench, capture)), &scan.cloud, 1.0)?)
    }

    /// The sheet at rest, and the seed of its drop.
    fn draped(&self, case: &Case, vertices: usize) -> Result<(Follower, u64), MakeError> {
        let experiment = case.experiment(self.face);
        let options = SimOptions { vertices, experiment, ..SimOptions::default() };
        let mut last = Stop::Iterations;
        for attempt in 0..DROPS {
            let drop_seed = self.seed(case, "sealed drop", attempt);
            let drop = Drop { start: DropStart::Perturbed(drop_seed) };
            let follower = Follower::drop(&case.fabric, &drop, &options);
            let drape = follower.drape();
            if drape.stop == Stop::AtRest && drape.intersections == 0 {
                return Ok((follower, drop_seed));
            }
            last = drape.stop;
        }
        let face = self.face.name();
        Err(MakeError::NeverAtRest { specimen: self.specimen, face, stop: last })
    }

    pub(super) fn camera(
        &self,
        case: &Case,
        capture: u64,
        options: &MakeOptions,
    ) -> SilhouetteCamera {
        // the specimen is laid once, the plate does not move much between two pictures
        let mut laid = rng(self.seed(case, "sealed camera", 0), "laid", 0);
        let mut own = rng(self.seed(case, "sealed camera", capture), "capture", 0);
        let middle = options.size_px.map(|n| 0.5 * f64::from(n));
        let off = [0, 1].map(|_| laid.random_range(-OFF_MIDDLE_PX..OFF_MIDDLE_PX));
        let moved = [0, 1].map(|_| own.random_range(-1.0..1.0));
        SilhouetteCamera {
            size_px: options.size_px,
            // what looks larger has smaller pixels than the manifest says
            pixel_m: options.pixel_m / (1.0 + case.scale_by()),
            axis_px: [0, 1].map(|c| middle[c] + off[c] + moved[c]),
            rotation_rad: laid.random_range(-OFF_BEARING_RAD..OFF_BEARING_RAD),
            per_height: case.per_height(),
            errors: SilhouetteErrors::usual(),
        }
    }
}

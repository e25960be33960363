//! Scenes drawn blind, for `scan2params-lab scenes`: sensor, stand, surroundings, fabric, views and
//! unit, each scan through the whole scan path.
//!
//! In: sensors, a folder of drapes ([`drapes`]), a seed. Out: a [`Record`] of each scene: what it
//! was, and the rim's error and stated sigma, or the refusal. With [`Series::broken`] every scene
//! has a [`Cause`] to be refused, and the record says whether the refusal names it. With
//! [`Series::invariance`] each cloud is also cropped, added to and turned.
//!
//! Where it fails: drapes are simulated, and nothing in a scene moves. A valid scene is one whose
//! views see 95 % of the rim and miss no 30 mm of it; views are drawn until they do, or until
//! there are 40, and [`Record::rim_seen`] has the share.

pub mod broken;
mod deform;
pub mod drapes;
mod draw;
mod files;
mod invariance;
mod made;
mod spread;
pub mod table;

use std::path::PathBuf;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

pub use invariance::Variant;

use self::broken::{Cause, is_right, name_of};
use self::drapes::{DrapesError, KeptDrape};
pub(super) use self::draw::Drawn;
pub(super) use self::made::Made;
use super::scan::{RimOff, rim_error, sheet_off_and_sigma_mm};
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Boundary, Vector3};
use scan2params::geom::Mesh;
use scan2params::io::WriteError;
use scan2params::numeric::robust;
use scan2params::scan::{
    Quality, ScanError, ScanOptions, ScannedBoundary, WarpToward, boundary_from_scan,
};
use scan2params::sensor::{Profile, SceneError, VirtualScan};

/// A mean rim error up to this is an answer that is right, of a scene that is broken \[mm\].
const RIGHT_ALL_THE_SAME_MM: f64 = 1.5;

/// Scenes to draw.
#[derive(Clone, Debug)]
pub struct Series {
    /// The sensors, in turn.
    pub sensors: Vec<Profile>,
    /// The drapes to draw from.
    pub drapes: Vec<KeptDrape>,
    /// Seed of the run.
    pub seed: u64,
    /// Which scenes.
    pub scenes: std::ops::Range<u64>,
    /// Whether every scene is to be refused, each cause in its turn.
    pub broken: bool,
    /// Whether each valid cloud is also cropped, added to and turned.
    pub invariance: bool,
    /// Folder for every scan with its truth.
    pub write: Option<PathBuf>,
    /// Whether every rim that is found is answered, so that limits can be judged by both rates.
    pub relaxed: bool,
}

/// What limits judge, of a rim that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// Noise of single points \[mm\].
    pub noise_mm: f64,
    /// Root mean square distance of the smoothed points to the sheet \[mm\],
    pub misfit_mm: f64,
    /// and over the plate.
    pub misfit_on_plate_mm: f64,
    /// Share of the rim that is observed.
    pub observed: f64,
    /// Longest bridged arc \[mm\].
    pub gap_mm: f64,
    /// Largest area near the rim that the sheet does not explain \[mm^2\].
    pub unexplained_mm2: f64,
    /// Largest difference of a side from the four sides' median \[mm\].
    pub uneven_mm: f64,
    /// Radius of the plate, and its scatter over the bearings \[mm\].
    pub plate_mm: [f64; 2],
    /// Log-likelihood ratio of a drape against anything, and how far the next place is behind
    /// \[nats\].
    pub nats: (f64, Option<f64>),
}

impl Judged {
    fn of(q: &Quality) -> Self {
        let mm = |m: f64| m / M_PER_MM;
        let median_m = robust::median(q.side_lengths_m.to_vec()).unwrap_or(0.0);
        let off_m = q.side_lengths_m.iter().map(|side| (side - median_m).abs());
        Self {
            noise_mm: mm(q.noise_m),
            misfit_mm: mm(q.sheet_rms_m),
            misfit_on_plate_mm: mm(q.sheet_rms_on_plate_m),
            observed: q.observed_fraction,
            gap_mm: mm(q.longest_gap_m),
            unexplained_mm2: q.unexplained_m2 * 1e6,
            uneven_mm: mm(off_m.fold(0.0, f64::max)),
            plate_mm: [q.plate_radius_m, q.plate_radius_scatter_m].map(mm),
            nats: (q.drape_nats, q.drape_ahead_nats),
        }
    }
}

/// What was drawn and what came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// The scene's number.
    pub index: u64,
    /// Name of the sensor.
    pub sensor: String,
    /// Name of the stand.
    pub stand: String,
    /// Name of the surroundings.
    pub scene: String,
    /// The drape's file.
    pub drape: String,
    /// Its shortest bending length \[mm\]; null if its fabric is not known.
    pub bending_length_mm: Option<f64>,
    /// Views.
    pub views: usize,
    /// The file's unit.
    pub unit: &'static str,
    /// Points of the cloud.
    pub points: usize,
    /// Share of the rim that one view or more sees.
    pub rim_seen: f64,
    /// What is wrong with the scene.
    pub cause: Cause,
    /// What came of it.
    pub outcome: Outcome,
    /// Wall time of the scan path, next to other scenes \[s\].
    pub seconds: f64,
    /// Variants of the cloud.
    pub variants: Vec<Variant>,
}

/// What came of a scan.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// A rim was found.
    Answered {
        /// Mean distance of corresponding points from the true rim \[mm\].
        rim_mean_mm: f64,
        /// Largest distance \[mm\].
        rim_largest_mm: f64,
        /// Mean distance after the rigid motion that fits best \[mm\].
        deformed_mm: f64,
        /// Root mean square of a coordinate's error, and what the rim states of it \[mm\].
        rms_and_sigma_mm: [f64; 2],
        /// The same of the sheet, across the cloth and but for a rigid motion \[mm\].
        sheet_rms_and_sigma_mm: [f64; 2],
        /// What limits judge.
        judged: Judged,
    },
    /// The scan was refused.
    Refused {
        /// The variant of the refusal.
        error: String,
        /// What it says.
        message: String,
        /// Whether it names what is wrong; of a valid scene never.
        right: bool,
    },
}

/// Why a series cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ScenesError {
    /// A drape makes no scene.
    #[error("scene {index}: {source}")]
    Scene {
        /// The scene's number.
        index: u64,
        /// Why.
        source: SceneError,
    },
    /// The drapes cannot be made or read.
    #[error(transparent)]
    Drapes(#[from] DrapesError),
    /// A scan cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Series {
    /// Draws, scans and asks on all cores; `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first scene that cannot be made or written.
    pub fn run(&self, tell: impl Fn(&Record) + Sync) -> Result<Vec<Record>, ScenesError> {
        let scenes: Vec<u64> = self.scenes.clone().collect();
        let records = scenes.into_par_iter().with_max_len(1).map(|index| {
            let record = self.one(index)?;
            tell(&record);
            Ok(record)
        });
        records.collect()
    }

    fn one(&self, index: u64) -> Result<Record, ScenesError> {
        let causes: &[Cause] = if self.broken { &Cause::BROKEN } else { &[Cause::Valid] };
        let drawn = Drawn::of(index, self.seed, &self.sensors, &self.drapes, causes);
        let made =
            Made::of(drawn, &self.drapes).map_err(|source| ScenesError::Scene { index, source })?;
        if let Some(folder) = &self.write {
            let fabric = self.drapes[made.drawn.drape].fabric.as_ref();
            files::write(folder, &made, fabric)?;
        }
        let before = Instant::now();
        let found = boundary_from_scan(&made.scan.cloud, &self.options(&made.scan));
        let seconds = before.elapsed().as_secs_f64();
        let cause = made.drawn.cause;
        let variants = if self.invariance && cause == Cause::Valid {
            invariance::variants(&made, &found, |scan| {
                boundary_from_scan(&scan.cloud, &self.options(scan))
            })
        } else {
            Vec::new()
        };
        Ok(self.record(&made, &found, seconds, variants))
    }

    /// Options of a scan, with the direction of the warp.
    fn options(&self, made: &VirtualScan) -> ScanOptions {
        let warp = made.truth.simulation_from_scanner.inverse() * Vector3::x();
        let warp_toward = Some(WarpToward::Direction(warp.into()));
        let options = ScanOptions { warp_toward, ..ScanOptions::default() };
        if !self.relaxed {
            return options;
        }
        ScanOptions {
            max_gap_m: 1.0,
            max_unexplained_m2: 1.0,
            max_misfit_m: 1.0,
            min_observed: 0.0,
            min_observed_per_noise: 0.0,
            max_uneven_m: 1.0,
            side_range_m: [0.0, 1.0],
            ..options
        }
    }

    fn record(
        &self,
        made: &Made,
        found: &Result<ScannedBoundary, ScanError>,
        seconds: f64,
        variants: Vec<Variant>,
    ) -> Record {
        let drawn = &made.drawn;
        let drape = &self.drapes[drawn.drape];
        let outcome = match found {
            Ok(found) => answered(found, &made.mesh, &made.rim),
            Err(error) => refused(drawn.cause, error),
        };
        Record {
            index: drawn.index,
            sensor: drawn.profile.name.to_owned(),
            stand: drawn.stand().to_owned(),
            scene: drawn.surroundings().to_owned(),
            drape: drape.name.clone(),
            bending_length_mm: drape.bending_length_m().map(|m| m / M_PER_MM),
            views: made.scan.views.len(),
            unit: if drawn.profile.unit_m == 1.0 { "m" } else { "mm" },
            points: made.scan.cloud.points.len(),
            rim_seen: made.seen.share,
            cause: drawn.cause,
            outcome,
            seconds,
            variants,
        }
    }
}

fn answered(found: &ScannedBoundary, mesh: &Mesh, rim: &Boundary) -> Outcome {
    let error = rim_error(found, mesh, rim);
    let off = RimOff::of(&found.boundary, rim);
    Outcome::Answered {
        rim_mean_mm: error.mean_m / M_PER_MM,
        rim_largest_mm: error.largest_m / M_PER_MM,
        deformed_mm: error.without_motion_m / M_PER_MM,
        rms_and_sigma_mm: [off.off_mm, off.sigma_mm],
        sheet_rms_and_sigma_mm: sheet_off_and_sigma_mm(&found.surface, mesh),
        judged: Judged::of(&found.quality),
    }
}

fn refused(cause: Cause, error: &ScanError) -> Outcome {
    let name = name_of(error);
    let right = is_right(cause, &name);
    Outcome::Refused { error: name, message: error.to_string(), right }
}

impl Record {
    /// Whether a rim was found.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        matches!(self.outcome, Outcome::Answered { .. })
    }

    /// Whether the program did right: of a valid scene, that it answered; of a broken one, that the
    /// refusal names the cause, or that the rim found is the true one all the same.
    #[must_use]
    pub fn is_right(&self) -> bool {
        match &self.outcome {
            Outcome::Answered { .. } if self.cause == Cause::Valid => true,
            Outcome::Answered { rim_mean_mm, .. } => {
                self.cause.has_a_rim() && *rim_mean_mm < RIGHT_ALL_THE_SAME_MM
            }
            Outcome::Refused { right, .. } => *right,
        }
    }
}

#[cfg(test)]
pub(super) mod tests;

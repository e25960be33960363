//! What the caller knows about the scan and what it will accept.

use serde::Serialize;

use super::color::MarkColor;
use super::tuning::Tuning;
use super::unit::LengthUnit;
use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};

/// Where the specimen's warp (the +x axis of the simulation frame) points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WarpToward {
    /// A direction in the scan's frame; its horizontal part counts.
    Direction([f64; 3]),
    /// A bearing in degrees, see [`super::frame::Bearing`].
    BearingDeg(f64),
}

/// The settings of one scan, all with defaults.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScanOptions {
    /// The file's unit; `None` guesses it from the scene's size.
    pub unit: Option<LengthUnit>,
    /// Side of the square specimen \[m\].
    pub specimen_side_m: f64,
    /// Radius of the plate \[m\].
    pub plate_radius_m: f64,
    /// Height in the simulation frame of the cloth where it lies flat on the plate
    /// \[m\]: the simulator keeps its vertices this far above the face (contact
    /// gap), and a scan only shows the cloth.
    pub cloth_height_m: f64,
    /// Where the warp points; `None` leaves weft and warp undecided.
    pub warp_toward: Option<WarpToward>,
    /// Colour of a mark in the middle of the side to which the warp runs; read where
    /// `warp_toward` says nothing.
    pub mark: Option<MarkColor>,
    /// Seed of the plane consensus.
    pub seed: u64,
    /// Largest arc of the rim that is bridged \[m\]. Empirical, as the four below, from
    /// `evaluate scan`: a scan that is answered must not be off by 5 mm anywhere.
    pub max_gap_m: f64,
    /// By how much shorter it must be for each metre of noise beyond 1 mm \[-\]: then
    /// folds are missed that the lengths cannot bring back.
    pub max_gap_per_noise: f64,
    /// Largest area of scanned cloth near a point of the rim that lies off the fitted
    /// sheet \[m^2\]: more means that the sheet has missed a fold.
    pub max_unexplained_m2: f64,
    /// Largest root mean square distance of the smoothed points to the fitted
    /// sheet \[m\], and what each metre of noise adds; more means that the sheet took a wrong
    /// turn, or that the cloth has creases.
    pub max_misfit_m: f64,
    /// See [`ScanOptions::max_misfit_m`].
    pub max_misfit_per_noise: f64,
    /// Smallest share of the rim that must be observed.
    pub min_observed: f64,
    /// By how much larger it must be for each metre of noise beyond 1 mm \[1/m\].
    pub min_observed_per_noise: f64,
    /// Shortest and longest accepted side of the specimen \[m\]: 300 mm less what
    /// smoothing takes, and plus the stretch of the softest knit.
    pub side_range_m: [f64; 2],
    /// Most that a side's length may differ from the four sides' median \[m\], and what each
    /// metre of noise adds.
    pub max_uneven_m: f64,
    /// See [`ScanOptions::max_uneven_m`].
    pub max_uneven_per_noise: f64,
    /// The tuned constants; written with a result only where they are not those that ship.
    #[serde(skip_serializing_if = "Tuning::is_shipped")]
    pub tuning: Tuning,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            unit: None,
            specimen_side_m: SPECIMEN_SIDE_M,
            plate_radius_m: PLATE_RADIUS_M,
            cloth_height_m: 1e-3,
            warp_toward: None,
            mark: None,
            seed: 0,
            max_gap_m: 0.068,
            max_gap_per_noise: 42.0,
            max_unexplained_m2: 33e-6,
            max_misfit_m: 0.15e-3,
            max_misfit_per_noise: 0.45,
            min_observed: 0.75,
            min_observed_per_noise: 120.0,
            side_range_m: [0.280, 0.330],
            max_uneven_m: 2.5e-3,
            max_uneven_per_noise: 0.5,
            tuning: Tuning::default(),
        }
    }
}

impl ScanOptions {
    /// Least share of the rim that must be observed at this noise \[m\].
    #[must_use]
    pub fn least_observed(&self, noise_m: f64) -> f64 {
        self.min_observed + self.min_observed_per_noise * self.more_noise_m(noise_m)
    }

    /// Longest arc of the rim that is bridged at this noise \[m\].
    #[must_use]
    pub fn longest_gap_m(&self, noise_m: f64) -> f64 {
        (self.max_gap_m - self.max_gap_per_noise * self.more_noise_m(noise_m)).max(0.0)
    }

    /// Largest root mean square distance of cloth and sheet at this noise \[m\].
    #[must_use]
    pub fn most_misfit_m(&self, noise_m: f64) -> f64 {
        self.max_misfit_m + self.max_misfit_per_noise * noise_m
    }

    /// Most that a side's length may differ from the four sides' median at this noise \[m\].
    #[must_use]
    pub fn most_uneven_m(&self, noise_m: f64) -> f64 {
        self.max_uneven_m + self.max_uneven_per_noise * noise_m
    }

    /// Noise beyond that up to which bridges are held by the sheet's lengths \[m\].
    fn more_noise_m(&self, noise_m: f64) -> f64 {
        (noise_m - self.tuning.limits.bridged_well_noise_m).max(0.0)
    }
}

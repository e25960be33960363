//! What the caller knows about the scan and what it will accept.

use serde::Serialize;

use super::color::MarkColor;
use super::tuning::Tuning;
use super::unit::LengthUnit;
use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};

/// Where the specimen's warp (the +x axis of the simulation frame) points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum WarpToward {
    /// A direction in the scan's frame \[-\]; its horizontal part counts.
    Direction([f64; 3]),
    /// A bearing, counter-clockwise from above, from the scan's x axis \[deg\].
    BearingDeg(f64),
}

/// The part of a scan that is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Crop {
    /// What lies within a radius of the plate. Where `plate_near` is given the plate
    /// is looked for within a sphere about that place, and a sphere about the plate stays.
    /// Otherwise a cylinder about the plate's axis stays, once the plate is found.
    Radius {
        /// The radius \[mm\].
        radius_mm: f64,
    },
    /// What lies within a box along the file's axes.
    Box {
        /// Its corner of the smallest coordinates, file's frame and unit \[file's unit\].
        low: [f64; 3],
        /// Its corner of the largest \[file's unit\].
        high: [f64; 3],
    },
}

/// Largest angle between the plate's normal and [`ScanOptions::up`] \[degrees\]. Chosen: a user
/// names an axis of the file, and stands are levelled by eye.
pub const UP_WITHIN_DEG: f64 = 20.0;
/// Largest distance between the plate's centre and [`ScanOptions::plate_near`] \[m\]. Chosen: half
/// of what keeps two drapes apart, and more than a place read off a screen errs by.
pub const PLATE_WITHIN_M: f64 = 0.1;

/// The settings of one scan, all with defaults.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
    /// The part of the scan that is looked at; `None` looks at all of it.
    pub crop: Option<Crop>,
    /// A direction in the scan's frame \[-\] within 20 degrees of which ([`UP_WITHIN_DEG`]) the
    /// plate's normal lies; `None` finds it from the cloth.
    pub up: Option<[f64; 3]>,
    /// A place \[file's unit\] in the file's frame within 100 mm of which ([`PLATE_WITHIN_M`]) the
    /// plate's centre lies; `None` looks everywhere.
    pub plate_near: Option<[f64; 3]>,
    /// Seed of the plane consensus \[-\].
    pub seed: u64,
    /// Largest arc of the rim that is bridged \[m\]. Empirical, as the four below, from
    /// `scan2params-lab scan`: a scan that is answered must not be off by 5 mm anywhere.
    pub max_gap_m: f64,
    /// By how much shorter it must be for each metre of noise beyond 1 mm \[-\]: then
    /// folds are missed that the lengths cannot bring back.
    pub max_gap_per_noise: f64,
    /// Largest area of scanned cloth near a point of the rim that lies off the fitted
    /// sheet \[m^2\]: more means that the sheet has missed a fold.
    pub max_unexplained_m2: f64,
    /// Largest root mean square distance of the smoothed points to the fitted sheet \[m\], beside
    /// `max_misfit_per_noise` times what it is over the plate, where the cloth is smooth and only
    /// the scan's noise is left; more means that the sheet took a wrong turn, or that the cloth has
    /// creases.
    pub max_misfit_m: f64,
    /// What each metre of noise adds to `max_misfit_m` \[-\].
    pub max_misfit_per_noise: f64,
    /// Smallest share of the rim that must be observed \[-\].
    pub min_observed: f64,
    /// By how much larger it must be for each metre of noise beyond 1 mm \[1/m\].
    pub min_observed_per_noise: f64,
    /// Shortest and longest accepted side of the specimen \[m\]: 300 mm less what
    /// smoothing takes, and plus the stretch of the softest knit.
    pub side_range_m: [f64; 2],
    /// Most that a side's length may differ from the four sides' median \[m\], and what each metre
    /// of noise adds. Where soft cloth lies double between folds that touch, sides are read up to 9
    /// mm off.
    pub max_uneven_m: f64,
    /// What each metre of noise adds to `max_uneven_m` \[-\].
    pub max_uneven_per_noise: f64,
    /// The tuned constants; written with a result only where they are not those that ship.
    /// src/scan/tuning.rs has names and units.
    #[cfg_attr(test, schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    #[serde(skip_serializing_if = "Tuning::is_shipped")]
    pub tuning: Tuning,
}

/// Sizes of specimen and plate that the method takes, each with its bounds \[m\].
const SIDES_M: [f64; 2] = [0.2, 0.45];
const RADII_M: [f64; 2] = [0.03, 0.1];
/// Least length of cloth that must hang from the plate in the middle of a side \[m\].
const LEAST_HANGING_M: f64 = 0.06;

/// Why the method does not take a specimen and a plate.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentFault {
    /// The specimen's size.
    #[error(
        "a specimen of {side_mm} mm is none that rims can be found of ({:.0} to {:.0} mm)",
        1e3 * SIDES_M[0], 1e3 * SIDES_M[1]
    )]
    Specimen {
        /// Side asked for.
        side_mm: f64,
    },
    /// The plate's radius.
    #[error(
        "a plate of {radius_mm} mm radius is none that is looked for ({:.0} to {:.0} mm)",
        1e3 * RADII_M[0], 1e3 * RADII_M[1]
    )]
    Plate {
        /// Radius asked for.
        radius_mm: f64,
    },
    /// Too little cloth hangs.
    #[error(
        "of a specimen of {side_mm} mm only {hanging_mm:.0} mm hang from a plate of {radius_mm} mm radius \
         ({:.0} mm are needed)", 1e3 * LEAST_HANGING_M
    )]
    Hanging {
        /// Side asked for.
        side_mm: f64,
        /// Radius asked for.
        radius_mm: f64,
        /// What hangs.
        hanging_mm: f64,
    },
}

/// Why what a caller says of the scene cannot be meant.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HintFault {
    /// A crop that cuts the cloth.
    #[error(
        "a crop of {radius_mm} mm radius about the plate cuts the cloth: give at least {least_mm:.0} mm, half the \
         specimen's diagonal"
    )]
    CropRadius {
        /// Radius asked for.
        radius_mm: f64,
        /// Least radius.
        least_mm: f64,
    },
    /// A box without an inside.
    #[error(
        "a crop to a box from {low} to {high} along {axis} leaves nothing: give two opposite corners of the box, in \
         the file's frame and unit"
    )]
    CropBox {
        /// The axis: x, y or z.
        axis: char,
        /// Where the box begins along it.
        low: f64,
        /// Where it ends.
        high: f64,
    },
    /// A direction of no length, or of no number.
    #[error("up is no direction: give three finite numbers, not all 0")]
    Up,
    /// A place of no number.
    #[error("the place of the plate is none: give three finite numbers")]
    PlateNear,
}

impl ScanOptions {
    /// Refuses a crop, an up or a place of the plate that cannot be meant.
    ///
    /// # Errors
    /// The first of them.
    pub fn check_hints(&self) -> Result<(), HintFault> {
        match self.crop {
            Some(Crop::Radius { radius_mm }) => {
                let least_mm = 1e3 * self.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
                if !(radius_mm.is_finite() && radius_mm >= least_mm) {
                    return Err(HintFault::CropRadius { radius_mm, least_mm: least_mm.ceil() });
                }
            }
            Some(Crop::Box { low, high }) => {
                for ((axis, low), high) in ['x', 'y', 'z'].into_iter().zip(low).zip(high) {
                    if !(low.is_finite() && high.is_finite() && low < high) {
                        return Err(HintFault::CropBox { axis, low, high });
                    }
                }
            }
            None => {}
        }
        let finite = |numbers: [f64; 3]| numbers.iter().all(|number| number.is_finite());
        if self.up.is_some_and(|up| !finite(up) || up == [0.0; 3]) {
            return Err(HintFault::Up);
        }
        if self.plate_near.is_some_and(|place| !finite(place)) {
            return Err(HintFault::PlateNear);
        }
        Ok(())
    }

    /// The default settings for a specimen of another side, on a plate of another radius
    /// \[m\].
    ///
    /// # Errors
    /// When the method does not take them.
    pub fn for_experiment(side_m: f64, plate_radius_m: f64) -> Result<Self, ExperimentFault> {
        let (side_mm, radius_mm) = (side_m * 1e3, plate_radius_m * 1e3);
        let within = |[low, high]: [f64; 2], value: f64| (low..=high).contains(&value);
        if !within(SIDES_M, side_m) {
            return Err(ExperimentFault::Specimen { side_mm });
        }
        if !within(RADII_M, plate_radius_m) {
            return Err(ExperimentFault::Plate { radius_mm });
        }
        let hanging_m = 0.5 * side_m - plate_radius_m;
        if hanging_m < LEAST_HANGING_M {
            let hanging_mm = hanging_m * 1e3;
            return Err(ExperimentFault::Hanging { side_mm, radius_mm, hanging_mm });
        }
        let default = Self::default();
        let side_range_m = if default.specimen_side_m == side_m {
            default.side_range_m
        } else {
            default.side_range_m.map(|limit| limit * side_m / default.specimen_side_m)
        };
        // Sides err in proportion to their length, short ones by the sensor.
        let longer = (side_m / default.specimen_side_m).max(1.0);
        let max_uneven_m = default.max_uneven_m * longer;
        Ok(Self { specimen_side_m: side_m, plate_radius_m, side_range_m, max_uneven_m, ..default })
    }

    /// Whether specimen and plate are those of the modified Cusick drape, which the shipped
    /// model knows.
    #[must_use]
    pub fn is_modified_cusick(&self) -> bool {
        self.specimen_side_m == SPECIMEN_SIDE_M && self.plate_radius_m == PLATE_RADIUS_M
    }
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
            crop: None,
            up: None,
            plate_near: None,
            seed: 0,
            max_gap_m: 0.080,
            max_gap_per_noise: 5.0,
            max_unexplained_m2: 66e-6,
            max_misfit_m: 0.25e-3,
            max_misfit_per_noise: 2.0,
            min_observed: 0.75,
            min_observed_per_noise: 20.0,
            side_range_m: [0.280, 0.330],
            max_uneven_m: 10e-3,
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

    /// Largest root mean square distance of cloth and sheet where it is this over the plate \[m\].
    #[must_use]
    pub fn most_misfit_m(&self, on_plate_m: f64) -> f64 {
        self.max_misfit_m + self.max_misfit_per_noise * on_plate_m
    }

    /// Largest area of scanned cloth off the sheet, of surface points this far apart \[m^2\].
    #[must_use]
    pub fn most_unexplained_m2(&self, spacing_m: f64) -> f64 {
        // Fewer points than this are strays.
        let least_m2 = self.tuning.limits.unexplained_points * spacing_m.powi(2);
        self.max_unexplained_m2.max(least_m2)
    }

    /// Noise beyond that up to which bridges are held by the sheet's lengths \[m\].
    fn more_noise_m(&self, noise_m: f64) -> f64 {
        (noise_m - self.tuning.limits.bridged_well_noise_m).max(0.0)
    }
}

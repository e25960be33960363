//! The limits of a verdict, each with its unit, where it is from, and the command that
//! measures what it stands on.
//!
//! Sources, by the letter behind each number:
//!
//! - M: measured on valid scans, by `scan2params-lab verdict` (the whole main job on virtual scans
//!   of a prior's fabrics with known truth; the runs are in docs/validation/verdict.md), or by
//!   `scan2params-lab estimate`. The limit stands a little beyond the worst of those that were
//!   answered well.
//! - W: measured on scans that are wrong in a known way (other plates, other scales), as
//!   docs/validation/verdict.md has them.
//! - C: chosen, with the reason next to it.

use serde::Serialize;

/// Beyond the first number a result is doubtful, beyond the second not to be used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Steps {
    /// Doubtful beyond this.
    pub doubtful: f64,
    /// Not to be used beyond this.
    pub do_not_use: f64,
}

/// The limits of a verdict. Lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// A side may be shorter than the cloth's by this over the bending length \[m^2\]: sharp folds
    /// may be smoothed.
    pub side_loss_m2: f64,
    /// Bending length of the softest cloth \[m\], for a scan without an answer.
    pub least_bending_length_m: f64,
    /// Share of the stretch of hanging cloth that shows in the length of its rim \[-\].
    pub stretch_of_rim: f64,
    /// What one side may differ from its expected length \[m\].
    pub side_off_m: Steps,
    /// Folds of cloth softer than this may touch: bending length \[m\].
    pub touching_bending_length_m: f64,
    /// What a side may differ from the median of the four, over the specimen's side \[-\],
    pub uneven_share: f64,
    /// and what each metre of noise adds \[-\].
    pub uneven_per_noise: f64,
    /// What the mean of the four sides of a rim from a file may differ from its expected length
    /// \[m\].
    pub scale_off_m: Steps,
    /// What each metre of noise adds to both, of single points in a scan, of what a rim from a file
    /// says \[-\].
    pub side_off_per_noise: f64,
    /// Sensors see cloth end this far before its edges, both together \[m\].
    pub width_lead_m: f64,
    /// Noisy sensors see cloth end this far beyond its edges, both together, over the noise of
    /// single points \[-\].
    pub width_swell_per_noise: f64,
    /// Share of the stretch of hanging cloth that shows in its length from edge to edge \[-\].
    pub stretch_of_width: f64,
    /// What the length from edge to opposite edge may differ from its expected length \[m\].
    /// The sheet is fitted with the specimen's lengths, so that the sides tell a wrong scale only
    /// in part; this is measured on the cloth itself.
    pub width_off_m: Steps,
    /// What each metre of noise adds to that \[-\].
    pub width_off_per_noise: f64,
    /// Standard deviation of the scale that the cloth's lengths tell \[-\],
    pub scale_sigma: f64,
    /// what each metre of noise adds \[1/m\],
    pub scale_sigma_per_noise: f64,
    /// and what the stretch of hanging cloth adds: mean and standard deviation over the stretch
    /// \[-\].
    pub scale_per_stretch: [f64; 2],
    /// Standard deviation of the scale that the plate tells \[-\].
    pub scale_sigma_of_plate: f64,
    /// By how much the logarithm of bending moves with that of the scale \[-\].
    pub bending_per_scale: f64,
    /// Share of a side that the chords between the points of a rim from a file may cut off \[-\].
    pub chord_share: f64,
    /// The cloth leaves the plate's plane this far inside the plate's edge \[m\].
    pub plate_lead_m: f64,
    /// By how much the radius found may be larger than the radius given, less that lead, beyond
    /// `plate_larger_sigmas` of its standard errors \[m\]. Beyond the second the scan is not the
    /// experiment.
    pub plate_larger_m: Steps,
    /// See [`Limits::plate_larger_m`].
    pub plate_larger_sigmas: f64,
    /// The same where it is smaller. Stiff cloth arches over the plate and leaves it early: the
    /// more, the more the radius scatters over the bearings.
    pub plate_smaller_m: Steps,
    /// See [`Limits::plate_smaller_m`].
    pub plate_smaller_sigmas: f64,
    /// With a larger standard error \[m\] a radius that is too small says nothing without the
    /// cloth's bending length.
    pub plate_arched_sigma_m: f64,
    /// How much farther in cloth leaves the plate at most, over the square of its bending length
    /// \[1/m\].
    pub plate_arch_per_m: f64,
    /// Standard errors that are allowed for besides,
    pub plate_arched_sigmas: f64,
    /// and what each metre of noise adds, which hides the first of the fall \[-\].
    pub plate_arched_per_noise: f64,
    /// How far off the plate's centre a specimen may lie whose answer is the network's, which knows
    /// of none \[m\].
    pub off_centre_m: Steps,
    /// Tilt of the plate that refining found \[rad\].
    pub tilt_rad: Steps,
    /// Folds times the square root of the bending length, least and largest \[m^0.5\].
    pub folds_root_m05: [f64; 2],
    /// Folds beyond these.
    pub folds_beyond: Steps,
    /// Share of what is refused beyond which a scan is doubtful \[-\].
    pub near_refusal: f64,
    /// How near to a diagonal of the specimen the warp's direction may point \[degrees\].
    pub diagonal_deg: f64,
    /// Distance of the rim from those of the training, over what 99 % of these stay below \[-\].
    pub novelty: Steps,
    /// Distance of the fabric from the part of the prior that it is likeliest of, over what 99 % of
    /// that part's own fabrics stay below, where it is like no part \[-\].
    pub outside_prior: Steps,
    /// Share of an interval that is cut off at the end of what the model was trained on \[-\].
    pub interval_cut: f64,
    /// Factor by which the density lies outside the training \[-\].
    pub density_factor: Steps,
    /// Distance of the refined drape from the sheet, in standard deviations of scan and simulator.
    pub refined_misfit: Steps,
    /// Share of what was uncertain of a stiffness that its drape has to take away to show it \[-\].
    pub shown: f64,
    /// Mean distance of a refined fabric's released drape from the scanned rim beyond which it is
    /// said \[m\].
    pub released_far_m: f64,
    /// Mean distance of the released drape of the network's fabric from the scanned rim, of cloth
    /// so soft that it may fall into another shape \[m\].
    pub released_m: Steps,
    /// The same of stiff cloth, which falls into one shape \[m\].
    pub released_stiff_m: Steps,
    /// Bending lengths up to which cloth is soft and from which on it is stiff in this; straight
    /// between \[m\].
    pub released_lengths_m: [f64; 2],
    /// Difference between the counts of folds of the two.
    pub released_folds: Steps,
}

impl Limits {
    /// What the released drape may lie off the scanned rim, for cloth of this bending length \[m\].
    pub(super) fn released_at(&self, bending_length_m: f64) -> Steps {
        let [soft_m, stiff_m] = self.released_lengths_m;
        let part = ((bending_length_m - soft_m) / (stiff_m - soft_m)).clamp(0.0, 1.0);
        let between = |soft: f64, stiff: f64| soft + part * (stiff - soft);
        let Self { released_m: soft, released_stiff_m: stiff, .. } = self;
        Steps {
            doubtful: between(soft.doubtful, stiff.doubtful),
            do_not_use: between(soft.do_not_use, stiff.do_not_use),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        let steps = |doubtful, do_not_use| Steps { doubtful, do_not_use };
        Self {
            side_loss_m2: 7.5e-6,                   // M
            least_bending_length_m: 2.5e-3,         // M: softest of the prior
            stretch_of_rim: 0.1,                    // M
            side_off_m: steps(2.0e-3, 4.0e-3),      // M, W
            touching_bending_length_m: 8e-3,        // M: 3 to 6 mm
            uneven_share: 2.0e-3 / 0.3,             // M
            uneven_per_noise: 0.4,                  // M
            scale_off_m: steps(1.2e-3, 3.0e-3),     // M, W
            side_off_per_noise: 1.0,                // M
            width_lead_m: 0.8e-3,                   // M
            stretch_of_width: 0.3,                  // M
            width_swell_per_noise: 1.5,             // M
            width_off_m: steps(2.0e-3, 3.2e-3),     // M, W
            width_off_per_noise: 0.25,              // M
            scale_sigma: 3e-3,                      // M
            scale_sigma_per_noise: 4.0,             // M
            scale_per_stretch: [0.15, 0.1],         // M
            scale_sigma_of_plate: 0.02,             // M
            bending_per_scale: 9.0,                 // M
            chord_share: 0.03,                      // M
            plate_lead_m: 0.7e-3,                   // M
            plate_larger_m: steps(1.5e-3, 4.0e-3),  // M, W
            plate_larger_sigmas: 2.0,               // M
            plate_smaller_m: steps(1.0e-3, 2.0e-3), // M, W
            plate_smaller_sigmas: 4.0,              // M
            plate_arched_sigma_m: 1.0e-3,           // M
            plate_arch_per_m: 22.0,                 // M
            plate_arched_sigmas: 1.0,               // M, W
            plate_arched_per_noise: 4.0,            // M
            off_centre_m: steps(8e-3, 15e-3),       // M: half of bending's interval, and all of it
            tilt_rad: steps(0.03, 0.06),            // C: at 5 degrees 7 mm from any trained rim
            folds_root_m05: [0.5376, 0.8854],       // M
            folds_beyond: steps(0.5, 3.5),          // M, C
            near_refusal: 0.8,                      // C
            diagonal_deg: 10.0,                     // C
            novelty: steps(1.0, 2.0),               // M, C
            outside_prior: steps(1.0, 2.0),         // M, C: no fabric of 200 is farther
            interval_cut: 0.2,                      // M
            density_factor: steps(1.0, 2.5),        // W
            refined_misfit: steps(0.6, 1.5),        // M, C: where a fit begins again
            shown: 0.3,                             // C
            released_far_m: 3e-3,                   // C: the true fabric moves by 0.3 to 2 mm
            released_m: steps(14e-3, 22e-3),        // M, C
            released_stiff_m: steps(4e-3, 7e-3),    // M
            released_lengths_m: [10e-3, 16e-3],     // M
            released_folds: steps(1.5, 3.5),        // M, C
        }
    }
}

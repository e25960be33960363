//! Named sets of a depth camera's errors, each number with where it is from.
//!
//! Sources, by the letter behind each number:
//!
//! - N: Nguyen, Izadi, Lovell, "Modeling Kinect Sensor Noise for Improved 3D
//!   Reconstruction and Tracking", 3DIMPVT 2012, their fits for the first Kinect.
//! - K: Khoshelham, Elberink, "Accuracy and Resolution of Kinect Depth Data",
//!   Sensors 12, 2012: 1/8 pixel of disparity, base 75 mm.
//! - B: Breitbarth et al., "Measurement accuracy and dependence on external
//!   influences of the iPhone X TrueDepth sensor", SPIE 11144, 2019, which finds
//!   errors "in the millimetre range": the size is of that order, the number a guess.
//! - D: order of magnitude of data sheets of desktop structured-light scanners
//!   (0.05 to 0.2 mm single-shot).
//! - R: measured on real recordings of such sensors: the standard deviation of the
//!   residual about quadratics in windows of pixels, and its autocorrelation at 1, 2, 4
//!   and 8 pixels ([`super::DepthNoise`]); `sensor::recorded` compares. The recordings:
//!   ZEISS/iPad_TrueDepth_Issue_Eval (flat boards before three TrueDepth cameras),
//!   graspnet/graspnet-baseline (a D435-like camera before a table),
//!   BerkeleyAutomation/gqcnn (PhoXi structured light before a bin), all on GitHub.
//! - F: what such files hold (unit, step of the stored depth, pixels).
//! - g: a guess, made to look like scans seen. Most are: nobody has published the
//!   flying pixels, holes and edge shifts of these cameras on cloth.
//!
//! The form of the axial and lateral noise is N's for every profile.
//!
//! `phone`, `d435` and `handheld` have the noise of recordings, which is smooth over
//! pixels. The others are older; their noise is white, and their bytes stay as they are.

use super::Camera;

/// The errors of a camera and of the program that fuses its views. Lengths in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name, as the command line takes it.
    pub name: &'static str,
    /// Resolution and focal length.
    pub camera: Camera,
    /// Nearest and furthest depth \[m\].
    pub range_m: [f64; 2],
    /// Axial noise a + b (z - z0)^2 + c / sqrt(z) * t^2 / (pi/2 - t)^2 with depth
    /// z \[m\] and incidence t \[rad\]; here a \[m\].
    pub axial_m: f64,
    /// b \[1/m\].
    pub axial_growth_per_m: f64,
    /// z0 \[m\].
    pub axial_best_m: f64,
    /// c \[m^1.5\].
    pub axial_incidence_m15: f64,
    /// Lateral noise d + e t / (pi/2 - t); here d \[pixels\].
    pub lateral_px: f64,
    /// e \[pixels\].
    pub lateral_incidence_px: f64,
    /// Step of 1/z \[1/m\], so that depths step by z^2 times this; 0 for none.
    pub disparity_step_per_m: f64,
    /// Unit of the stored depth \[m\]; 0 for none.
    pub depth_unit_m: f64,
    /// Chance that a pixel at a depth edge mixes both surfaces.
    pub flying_fraction: f64,
    /// Neighbours further apart in depth than this make a depth edge \[m\].
    pub edge_step_m: f64,
    /// Pixels by which the nearer surface's edge recedes (positive) or spreads
    /// over what is behind (negative).
    pub edge_erosion_px: i32,
    /// Drop-out begins at the first incidence and is complete at the second \[rad\].
    pub grazing_rad: [f64; 2],
    /// Round holes per view.
    pub holes_per_view: usize,
    /// Least and largest radius of a hole \[pixels\].
    pub hole_radius_px: [f64; 2],
    /// Chance of an outlier.
    pub outlier_fraction: f64,
    /// Outliers lie within this of the true depth, evenly \[m\].
    pub outlier_reach_m: f64,
    /// Standard deviation of the error of a view's position, per axis \[m\].
    pub pose_shift_m: f64,
    /// Standard deviation of the error of a view's rotation about the plate's
    /// centre, per axis \[rad\].
    pub pose_turn_rad: f64,
    /// Side of the voxels to which the fused cloud is downsampled \[m\].
    pub spacing_m: f64,
    /// Samples in a voxel that keep it for sure; with fewer it is kept by chance
    /// in proportion. Fusion weighs by counts, so that lone outliers are not
    /// made more numerous by thinning.
    pub samples_per_point: f64,
    /// Length of the exported file's unit \[m\].
    pub unit_m: f64,
    /// What of the axial noise neighbouring pixels share; the rest of its variance is white.
    pub smooth: [Smooth; 2],
    /// Standard deviation of the relative error of the focal length that the fusing program
    /// uses, one draw for a scan.
    pub focal_error: f64,
    /// Passes into which the views are divided, in their order: each has an error of pose of
    /// its own, which wanders from view to view; 0 for none.
    pub passes: usize,
    /// Standard deviation of a pass's position, per axis, and of how far it has wandered at the
    /// pass's end \[m\].
    pub drift_shift_m: f64,
    /// The same of its rotation about the plate's centre \[rad\].
    pub drift_turn_rad: f64,
    /// What a voxel of the fused cloud gives.
    pub fusion: Fusion,
    /// Share of the depth edges' pixels that are lost in patches.
    pub edge_loss_fraction: f64,
    /// Least and largest radius of such a patch \[pixels\].
    pub edge_loss_px: [f64; 2],
    /// Spots of surface per view that are not seen.
    pub specks_per_view: usize,
    /// Least and largest radius of a spot \[m\].
    pub speck_radius_m: [f64; 2],
    /// Least and largest distance from which such a sensor is used \[m\].
    pub usual_distance_m: [f64; 2],
}

/// Noise that is smooth over pixels: white noise through a Gaussian filter, to unit variance. Its
/// autocorrelation at a distance of r pixels is exp(-r^2 / (4 sigma^2)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smooth {
    /// Share of the variance.
    pub share: f64,
    /// Standard deviation of the filter \[pixels\].
    pub sigma_px: f64,
}

impl Smooth {
    const NONE: Self = Self { share: 0.0, sigma_px: 0.0 };
}

/// What a voxel of the fused cloud gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fusion {
    /// One of its samples, by lot: voxel downsampling.
    OneSample,
    /// The mean of its samples, as scanning apps and distance fields average.
    Mean,
}

/// No errors at all: for tests, and to see what visibility alone does.
pub(super) const IDEAL: Profile = Profile {
    name: "ideal",
    camera: Camera { width: 640, height: 480, focal_px: 600.0 },
    range_m: [0.1, 2.0],
    axial_m: 0.0,
    axial_growth_per_m: 0.0,
    axial_best_m: 0.0,
    axial_incidence_m15: 0.0,
    lateral_px: 0.0,
    lateral_incidence_px: 0.0,
    disparity_step_per_m: 0.0,
    depth_unit_m: 0.0,
    flying_fraction: 0.0,
    edge_step_m: 0.01, // g, in all profiles
    edge_erosion_px: 0,
    grazing_rad: [std::f64::consts::FRAC_PI_2; 2],
    holes_per_view: 0,
    hole_radius_px: [1.0, 1.0],
    outlier_fraction: 0.0,
    outlier_reach_m: 0.0,
    pose_shift_m: 0.0,
    pose_turn_rad: 0.0,
    spacing_m: 0.0015,
    samples_per_point: 1.0,
    unit_m: 1.0,
    smooth: [Smooth::NONE; 2],
    focal_error: 0.0,
    passes: 0,
    drift_shift_m: 0.0,
    drift_turn_rad: 0.0,
    fusion: Fusion::OneSample,
    edge_loss_fraction: 0.0,
    edge_loss_px: [1.0, 1.0],
    specks_per_view: 0,
    speck_radius_m: [1e-3, 1e-3],
    usual_distance_m: [0.40, 0.50], // g
};

/// A stationary structured-light scanner: 0.15 mm axial noise, edges that recede
/// by a pixel, millimetres.
pub(super) const STRUCTURED_LIGHT: Profile = Profile {
    name: "structured-light",
    camera: Camera { width: 960, height: 720, focal_px: 900.0 }, // g
    axial_m: 0.15e-3,                                            // D
    axial_incidence_m15: 0.0125e-3,                              // N, scaled as axial_m is
    lateral_px: 0.2,                                             // g
    depth_unit_m: 1e-5,                                          // F
    flying_fraction: 0.05,                                       // g
    edge_erosion_px: 1,                                          // g
    grazing_rad: [70_f64.to_radians(), 85_f64.to_radians()],     // g
    holes_per_view: 2,                                           // g
    hole_radius_px: [2.0, 6.0],                                  // g
    outlier_fraction: 1e-4,                                      // g
    outlier_reach_m: 0.02,                                       // g
    pose_shift_m: 0.05e-3,                                       // D
    pose_turn_rad: 0.01_f64.to_radians(),                        // g
    spacing_m: 0.0018,                                           // g
    samples_per_point: 8.0,                                      // g
    unit_m: 1e-3,                                                // F
    ..IDEAL
};

/// A tablet's front camera (structured infrared dots, TrueDepth-like) led around
/// the drape: 0.5 mm at 0.25 m, 1.5 mm at 0.7 m, and views that miss each other by
/// 0.5 mm.
pub(super) const TRUEDEPTH: Profile = Profile {
    name: "truedepth",
    camera: Camera { width: 640, height: 480, focal_px: 590.0 }, // F
    range_m: [0.2, 1.0],                                         // g
    axial_m: 0.5e-3,                                             // B
    axial_growth_per_m: 5e-3,                                    // B
    axial_best_m: 0.25,                                          // g
    axial_incidence_m15: 0.04e-3,                                // N, scaled as axial_m is
    lateral_px: 0.5,                                             // g
    lateral_incidence_px: 0.02,                                  // g
    depth_unit_m: 1e-4,                                          // F
    flying_fraction: 0.3,                                        // g
    grazing_rad: [65_f64.to_radians(), 82_f64.to_radians()],     // g
    holes_per_view: 3,                                           // g
    hole_radius_px: [2.0, 8.0],                                  // g
    outlier_fraction: 1e-3,                                      // g
    outlier_reach_m: 0.03,                                       // g
    pose_shift_m: 0.5e-3,                                        // g
    pose_turn_rad: 0.15_f64.to_radians(),                        // g
    spacing_m: 0.0025,                                           // g
    samples_per_point: 12.0,                                     // g
    ..IDEAL
};

/// A first-generation consumer depth camera: 1.2 mm at 0.4 m, 1 % outliers, holes,
/// edges that spread by a pixel, 1 mm pose errors.
pub(super) const CONSUMER: Profile = Profile {
    name: "consumer",
    camera: Camera { width: 640, height: 480, focal_px: 580.0 }, // K
    range_m: [0.35, 3.0],                                        // K, nearest: g
    axial_m: 1.2e-3,                                             // N
    axial_growth_per_m: 1.9e-3,                                  // N
    axial_best_m: 0.4,                                           // N
    axial_incidence_m15: 0.1e-3,                                 // N
    lateral_px: 0.8,                                             // N
    lateral_incidence_px: 0.035,                                 // N
    disparity_step_per_m: 1.0 / (8.0 * 580.0 * 0.075),           // K
    depth_unit_m: 1e-3,                                          // F
    flying_fraction: 0.5,                                        // g
    edge_erosion_px: -1,                                         // g
    grazing_rad: [60_f64.to_radians(), 80_f64.to_radians()],     // N fits up to 60 degrees; end: g
    holes_per_view: 8,                                           // g
    hole_radius_px: [3.0, 10.0],                                 // g
    outlier_fraction: 0.01,                                      // g
    outlier_reach_m: 0.05,                                       // g
    pose_shift_m: 1e-3,                                          // g
    pose_turn_rad: 0.3_f64.to_radians(),                         // g
    spacing_m: 0.003,                                            // g
    samples_per_point: 12.0,                                     // g
    ..IDEAL
};

/// A phone's front camera (TrueDepth) led around the drape by a scanning app that averages in
/// voxels.
pub(super) const PHONE: Profile = Profile {
    name: "phone",
    camera: Camera { width: 640, height: 480, focal_px: 590.0 }, // F
    range_m: [0.15, 0.9],                                        // g
    axial_m: 0.17e-3,                                            // R: 0.28 mm at 0.196 m in all
    axial_growth_per_m: 2.9e-3,                                  // R: 0.28 mm at 0.196 m, z^2
    axial_best_m: 0.0,                                           // R
    axial_incidence_m15: 0.03e-3,                                // N, scaled as axial_m is
    smooth: [Smooth { share: 0.33, sigma_px: 1.1 }, Smooth { share: 0.65, sigma_px: 5.0 }], // R
    depth_unit_m: 1e-4,                                          // F
    flying_fraction: 0.3,                                        // g
    grazing_rad: [65_f64.to_radians(), 82_f64.to_radians()],     // g
    holes_per_view: 2,                                           // g
    hole_radius_px: [2.0, 8.0],                                  // g
    outlier_fraction: 2e-4,                                      // g
    outlier_reach_m: 0.02,                                       // g
    pose_shift_m: 0.15e-3,                                       // g
    pose_turn_rad: 0.05_f64.to_radians(),                        // g
    focal_error: 0.002, // g: R has -0.4, +1.2 and -6.2 % of the factory's; what does no harm
    passes: 3,          // g
    drift_shift_m: 0.25e-3, // g: 0.4 mm in space
    drift_turn_rad: 0.06_f64.to_radians(), // g
    fusion: Fusion::Mean, // F
    edge_loss_fraction: 0.08, // g
    edge_loss_px: [2.0, 6.0], // g
    specks_per_view: 12, // g
    speck_radius_m: [1e-3, 3e-3], // g
    spacing_m: 0.002,   // g
    samples_per_point: 6.0, // g
    usual_distance_m: [0.30, 0.45], // g
    ..IDEAL
};

/// A stereo camera with an infrared pattern (RealSense D4xx) led around the drape, averaged in
/// voxels. The image is the middle of its 1280 x 720 pixels.
pub(super) const D435: Profile = Profile {
    name: "d435",
    camera: Camera { width: 640, height: 480, focal_px: 631.5 }, // R, F
    range_m: [0.25, 1.2],                                        // F, furthest: g
    axial_m: 0.0,                                                // R
    axial_growth_per_m: 6.4e-3,                                  // R: 1.2 mm at 0.45 m, z^2
    axial_best_m: 0.0,                                           // R
    axial_incidence_m15: 0.09e-3,                                // N, scaled as the noise is
    smooth: [Smooth { share: 0.20, sigma_px: 1.3 }, Smooth { share: 0.80, sigma_px: 3.1 }], // R
    depth_unit_m: 1e-3,                                          // F, R
    flying_fraction: 0.3,                                        // g
    grazing_rad: [65_f64.to_radians(), 82_f64.to_radians()],     // g
    holes_per_view: 4,                                           // g
    hole_radius_px: [3.0, 10.0],                                 // g
    outlier_fraction: 2e-4,                                      // g
    outlier_reach_m: 0.02,                                       // g
    pose_shift_m: 0.1e-3,                                        // g
    pose_turn_rad: 0.03_f64.to_radians(),                        // g
    focal_error: 0.001,                                          // g
    passes: 3,                                                   // g
    drift_shift_m: 0.2e-3,                                       // g
    drift_turn_rad: 0.05_f64.to_radians(),                       // g
    fusion: Fusion::Mean,                                        // F
    edge_loss_fraction: 0.08,                                    // g
    edge_loss_px: [2.0, 6.0],                                    // g
    specks_per_view: 12,                                         // g
    speck_radius_m: [1e-3, 3e-3],                                // g
    spacing_m: 0.002,                                            // g
    samples_per_point: 6.0,                                      // g
    usual_distance_m: [0.45, 0.60],                              // g
    ..IDEAL
};

/// A handheld structured-light scanner: a denser cloud, averaged in voxels, in millimetres.
pub(super) const HANDHELD: Profile = Profile {
    name: "handheld",
    camera: Camera { width: 800, height: 600, focal_px: 800.0 }, // g
    range_m: [0.15, 0.8],                                        // g
    axial_m: 0.12e-3,                                            // D; R: 0.19 mm at 0.79 m
    axial_incidence_m15: 0.01e-3,                                // N, scaled as axial_m is
    smooth: [Smooth { share: 0.12, sigma_px: 0.8 }, Smooth::NONE], // R: 0.1 at 1 px
    depth_unit_m: 1e-5,                                          // F
    flying_fraction: 0.05,                                       // g
    grazing_rad: [70_f64.to_radians(), 85_f64.to_radians()],     // g
    holes_per_view: 2,                                           // g
    hole_radius_px: [2.0, 6.0],                                  // g
    outlier_fraction: 1e-4,                                      // g
    outlier_reach_m: 0.02,                                       // g
    pose_shift_m: 0.05e-3,                                       // D
    pose_turn_rad: 0.01_f64.to_radians(),                        // g
    focal_error: 0.0003,                                         // g
    passes: 2,                                                   // g
    drift_shift_m: 0.09e-3,                                      // g: 0.15 mm in space
    drift_turn_rad: 0.02_f64.to_radians(),                       // g
    fusion: Fusion::Mean,                                        // F
    edge_loss_fraction: 0.05,                                    // g
    edge_loss_px: [2.0, 5.0],                                    // g
    specks_per_view: 10,                                         // g
    speck_radius_m: [0.8e-3, 2.5e-3],                            // g
    spacing_m: 0.001,                                            // g
    samples_per_point: 2.0,                                      // g
    unit_m: 1e-3,                                                // F
    usual_distance_m: [0.30, 0.45],                              // g
    ..IDEAL
};

impl Profile {
    /// Every named profile.
    pub const ALL: [Self; 7] =
        [IDEAL, STRUCTURED_LIGHT, TRUEDEPTH, CONSUMER, PHONE, D435, HANDHELD];

    /// The profile of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| profile.name == name)
    }

    /// Standard deviation of a depth at depth `z_m` and incidence `t_rad` \[m\].
    #[must_use]
    pub fn axial_sigma_m(&self, z_m: f64, t_rad: f64) -> f64 {
        let slant = slant(t_rad);
        let growth = self.axial_growth_per_m * (z_m - self.axial_best_m).powi(2);
        self.axial_m + growth + self.axial_incidence_m15 / z_m.sqrt() * slant * slant
    }

    /// Standard deviation of a ray's position in the image, per axis \[pixels\].
    #[must_use]
    pub fn lateral_sigma_px(&self, t_rad: f64) -> f64 {
        self.lateral_px + self.lateral_incidence_px * slant(t_rad)
    }
}

/// t / (pi/2 - t), held at its value 5 degrees from grazing, where the source's
/// fit ends and the ratio would grow without bound.
fn slant(t_rad: f64) -> f64 {
    let most = 85_f64.to_radians();
    let t = t_rad.clamp(0.0, most);
    t / (std::f64::consts::FRAC_PI_2 - t)
}

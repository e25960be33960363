//! What a sealed case's drapes differ by from those of even cloth on the standard plate, level and
//! in still air.
//!
//! In: random numbers. Out: an [`Effect`] of a size that can matter, and what it makes of the
//! experiment and of the picture. Ranges are chosen: from what hardly shows to what a careful hand
//! would notice.

use rand::RngExt as _;
use serde::{Deserialize, Serialize};

use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::base::seed::Rng;
use scan2params::sim::Experiment;
use scan2params::sim::experiment::{
    AsymmetricBending, Curl, Draught, EdgeCurl, Hem, Hysteresis, Seam, Softening,
    StiffnessGradient, Tilt,
};

/// One effect with its size, SI. Signs are those of the specimen with its face up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "snake_case")]
pub enum Effect {
    /// The cloth is curled when it is weightless.
    NaturalCurvature {
        /// Along the weft, positive towards the face \[1/m\].
        weft_per_m: f64,
        /// Along the warp \[1/m\].
        warp_per_m: f64,
    },
    /// The cloth is stiffer towards one face.
    AsymmetricBending {
        /// The law's a along the weft.
        weft: f64,
        /// The law's a along the warp.
        warp: f64,
    },
    /// The rim rolls.
    EdgeCurl {
        /// Curvature at the rim, positive towards the face \[1/m\].
        curvature_per_m: f64,
        /// Distance from the rim at which it has fallen to zero \[m\].
        width_m: f64,
    },
    /// Bending softens with curvature.
    Softening {
        /// The law's s along weft, warp and bias \[m\].
        length_m: f64,
    },
    /// Another friction of the plate.
    Friction {
        /// Its coefficient.
        coefficient: f64,
    },
    /// Another plate.
    PlateRadius {
        /// Its radius less the standard one \[m\].
        by_m: f64,
    },
    /// Another cut of the specimens.
    SpecimenSize {
        /// Their diameter less the standard one \[m\].
        by_m: f64,
    },
    /// The plate is not level.
    Tilt {
        /// Angle by which it falls towards +x, the picture's right \[rad\].
        down_x_rad: f64,
        /// Angle by which it falls towards +z, downwards in the picture \[rad\].
        down_z_rad: f64,
    },
    /// Drapes look larger than the manifest's extent of a pixel has them.
    Scale {
        /// By this share.
        by: f64,
    },
    /// The camera stands no higher than this above the plate's face, and sees what hangs deeper
    /// smaller.
    Perspective {
        /// Its height \[m\].
        height_m: f64,
    },
    /// The specimens were folded.
    Crease {
        /// Curvature on the line along the warp, positive towards the face \[1/m\].
        along_warp_per_m: f64,
        /// The same on the line along the weft \[1/m\].
        along_weft_per_m: f64,
        /// Distance from a line at which it has fallen to zero \[m\].
        width_m: f64,
    },
    /// Friction inside the cloth.
    Hysteresis {
        /// Its moment per width, along weft and warp \[N\].
        moment_n: f64,
        /// Curvature over which it rises to that \[1/m\].
        slip_per_m: f64,
    },
    /// Another edge of the plate.
    PlateEdge {
        /// Its radius less the standard one \[m\].
        by_m: f64,
    },
    /// Specimens that are cut askew.
    Skew {
        /// Angle by which their sides lean \[rad\].
        by_rad: f64,
    },
    /// A heavier border on one side; on no list.
    Hem(Hem),
    /// A stiff line; on no list.
    Seam(Seam),
    /// Stiffer on one side; on no list.
    StiffnessGradient(StiffnessGradient),
    /// Air from one side; on no list.
    Draught(Draught),
}

/// The effects that a calibration may name.
pub const LISTED: [&str; 14] = [
    "natural_curvature",
    "asymmetric_bending",
    "edge_curl",
    "softening",
    "friction",
    "plate_radius",
    "specimen_size",
    "tilt",
    "scale",
    "perspective",
    "crease",
    "hysteresis",
    "plate_edge",
    "skew",
];

/// Those that it has no name for.
pub const UNLISTED: [&str; 4] = ["hem", "seam", "stiffness_gradient", "draught"];

/// What sizes are drawn beside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cloth {
    /// Areal density \[kg/m^2\].
    pub density_kg_m2: f64,
}

/// A size within limits, of either sign.
fn signed(rng: &mut Rng, [least, most]: [f64; 2]) -> f64 {
    let size = rng.random_range(least..most);
    if rng.random_bool(0.5) { size } else { -size }
}

/// A bearing \[rad\].
fn bearing(rng: &mut Rng) -> f64 {
    rng.random_range(-std::f64::consts::PI..std::f64::consts::PI)
}

impl Effect {
    /// The effect of number `k` of [`LISTED`], of a size drawn by `rng`.
    #[must_use]
    pub fn listed(k: usize, rng: &mut Rng) -> Self {
        match k % LISTED.len() {
            0 => {
                let [weft_per_m, warp_per_m] = [0, 1].map(|_| signed(rng, [4.0, 15.0]));
                // along the weft, along the warp, both
                match rng.random_range(0..3) {
                    0 => Self::NaturalCurvature { weft_per_m, warp_per_m: 0.0 },
                    1 => Self::NaturalCurvature { weft_per_m: 0.0, warp_per_m },
                    _ => Self::NaturalCurvature { weft_per_m, warp_per_m },
                }
            }
            1 => {
                // both towards one face, as of a coating or of the float side of a weave
                let weft = signed(rng, [0.15, 0.6]);
                let warp = rng.random_range(0.15..0.6_f64).copysign(weft);
                Self::AsymmetricBending { weft, warp }
            }
            2 => {
                let width_m = rng.random_range(8e-3..15e-3);
                Self::EdgeCurl { curvature_per_m: signed(rng, [15.0, 60.0]), width_m }
            }
            3 => Self::Softening { length_m: rng.random_range(2e-3..8e-3) },
            4 => {
                let smooth = rng.random_bool(0.5);
                let range = if smooth { 0.1..0.2 } else { 0.45..0.9 };
                Self::Friction { coefficient: rng.random_range(range) }
            }
            5 => Self::PlateRadius { by_m: signed(rng, [1e-3, 3e-3]) },
            6 => Self::SpecimenSize { by_m: signed(rng, [1e-3, 4e-3]) },
            7 => {
                let slope = rng.random_range(0.5_f64..2.0).to_radians();
                let (sin, cos) = bearing(rng).sin_cos();
                Self::Tilt { down_x_rad: slope * cos, down_z_rad: slope * sin }
            }
            8 => Self::Scale { by: signed(rng, [0.01, 0.03]) },
            9 => Self::Perspective { height_m: rng.random_range(0.5..1.5) },
            10 => {
                let [along_warp_per_m, along_weft_per_m] =
                    [0, 1].map(|_| signed(rng, [30.0, 120.0]));
                let width_m = rng.random_range(8e-3..15e-3);
                // folded about the warp, about the weft, about both
                let [warp, weft] = match rng.random_range(0..3) {
                    0 => [along_warp_per_m, 0.0],
                    1 => [0.0, along_weft_per_m],
                    _ => [along_warp_per_m, along_weft_per_m],
                };
                Self::Crease { along_warp_per_m: warp, along_weft_per_m: weft, width_m }
            }
            11 => Self::Hysteresis {
                moment_n: rng.random_range(0.5e-4..3e-4),
                slip_per_m: rng.random_range(5.0..20.0),
            },
            12 => {
                let sharp = rng.random_bool(0.3);
                let range = if sharp { -1.4e-3..-0.8e-3 } else { 1e-3..4e-3 };
                Self::PlateEdge { by_m: rng.random_range(range) }
            }
            _ => Self::Skew { by_rad: signed(rng, [0.4, 1.5]).to_radians() },
        }
    }

    /// The effect of number `k` of [`UNLISTED`], of a size drawn by `rng`.
    #[must_use]
    pub fn unlisted(k: usize, cloth: &Cloth, rng: &mut Rng) -> Self {
        let toward_rad = bearing(rng);
        match k % UNLISTED.len() {
            0 => {
                let added_kg_m2 = cloth.density_kg_m2 * rng.random_range(0.5..1.5);
                Self::Hem(Hem { added_kg_m2, width_m: rng.random_range(15e-3..25e-3), toward_rad })
            }
            1 => {
                let (added, offset_m) = (rng.random_range(3.0..10.0), rng.random_range(0.0..60e-3));
                let width_m = rng.random_range(5e-3..8e-3);
                Self::Seam(Seam { added, width_m, toward_rad, offset_m })
            }
            2 => {
                let ln_factor = rng.random_range(0.3..0.8);
                Self::StiffnessGradient(StiffnessGradient { ln_factor, toward_rad })
            }
            _ => {
                // of the cloth's own weight
                let weight_pa = cloth.density_kg_m2 * GRAVITY_M_S2;
                let pressure_pa = weight_pa * rng.random_range(0.05..0.2);
                Self::Draught(Draught { pressure_pa, toward_rad })
            }
        }
    }

    /// The word in files, one of [`LISTED`] or of [`UNLISTED`].
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::NaturalCurvature { .. } => LISTED[0],
            Self::AsymmetricBending { .. } => LISTED[1],
            Self::EdgeCurl { .. } => LISTED[2],
            Self::Softening { .. } => LISTED[3],
            Self::Friction { .. } => LISTED[4],
            Self::PlateRadius { .. } => LISTED[5],
            Self::SpecimenSize { .. } => LISTED[6],
            Self::Tilt { .. } => LISTED[7],
            Self::Scale { .. } => LISTED[8],
            Self::Perspective { .. } => LISTED[9],
            Self::Crease { .. } => LISTED[10],
            Self::Hysteresis { .. } => LISTED[11],
            Self::PlateEdge { .. } => LISTED[12],
            Self::Skew { .. } => LISTED[13],
            Self::Hem(_) => UNLISTED[0],
            Self::Seam(_) => UNLISTED[1],
            Self::StiffnessGradient(_) => UNLISTED[2],
            Self::Draught(_) => UNLISTED[3],
        }
    }

    /// Puts the effect into the experiment of a specimen with its face up.
    pub fn apply(&self, experiment: &mut Experiment) {
        let e = experiment;
        match *self {
            Self::NaturalCurvature { weft_per_m, warp_per_m } => {
                e.curl.nodes = Curl::uniform([weft_per_m, warp_per_m, 0.0]).nodes;
            }
            Self::AsymmetricBending { weft, warp } => {
                e.asymmetric_bending = AsymmetricBending { weft, warp };
            }
            Self::EdgeCurl { curvature_per_m, width_m } => {
                e.curl.edge = EdgeCurl { curvature_per_m, width_m };
            }
            Self::Softening { length_m } => {
                e.softening = Softening::uniform(length_m);
            }
            Self::Friction { coefficient } => e.plate.friction = coefficient,
            Self::PlateRadius { by_m } => e.plate.radius_m += by_m,
            Self::SpecimenSize { by_m } => {
                e.specimen.warp_m += by_m;
                e.specimen.weft_m += by_m;
            }
            Self::Tilt { down_x_rad, down_z_rad } => e.tilt = Tilt { down_x_rad, down_z_rad },
            Self::Scale { .. } | Self::Perspective { .. } => {}
            Self::Crease { along_warp_per_m, along_weft_per_m, width_m } => {
                let both = [&mut e.curl.line, &mut e.curl.cross_line];
                for (line, per_m) in both.into_iter().zip([along_warp_per_m, along_weft_per_m]) {
                    (line.curvature_per_m, line.width_m) = (per_m, width_m);
                }
            }
            Self::Hysteresis { moment_n, slip_per_m } => {
                e.hysteresis = Hysteresis { weft_n: moment_n, warp_n: moment_n, slip_per_m };
            }
            Self::PlateEdge { by_m } => e.plate.edge_radius_m += by_m,
            Self::Skew { by_rad } => e.specimen.skew_rad += by_rad,
            Self::Hem(hem) => e.uneven.hem = hem,
            Self::Seam(seam) => e.uneven.seam = seam,
            Self::StiffnessGradient(gradient) => e.uneven.gradient = gradient,
            Self::Draught(draught) => e.uneven.draught = draught,
        }
    }

    /// Share by which drapes look larger than they are.
    #[must_use]
    pub fn scale_by(&self) -> f64 {
        if let Self::Scale { by } = self { *by } else { 0.0 }
    }

    /// One over the camera's height \[1/m\]; 0 for one that looks from afar.
    #[must_use]
    pub fn per_height(&self) -> f64 {
        if let Self::Perspective { height_m } = self { 1.0 / height_m } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::base::seed::rng;

    #[test]
    fn the_effects_that_are_listed_are_those_that_a_calibration_looks_for() {
        // no sealed drape is looked at twice, so that none settles
        use scan2params::calibrate::effect::{Acts, EFFECTS};
        let lasts =
            |n: &scan2params::calibrate::effect::Number| !matches!(n.acts, Acts::Settling(_));
        let lasting = EFFECTS.iter().filter(|effect| effect.numbers.iter().all(lasts));
        let mut names: Vec<&str> = lasting.map(|effect| effect.name).collect();
        let mut listed = LISTED;
        names.sort_unstable();
        listed.sort_unstable();
        assert_eq!(names, listed);
    }

    #[test]
    fn every_effect_has_its_name_and_changes_a_sound_experiment() {
        let cloth = Cloth { density_kg_m2: 0.2 };
        let mut rng = rng(1, "test", 0);
        for round in 0..20 {
            let listed = (0..LISTED.len()).map(|k| (LISTED[k], Effect::listed(k, &mut rng)));
            let mut all: Vec<_> = listed.collect();
            all.extend(
                (0..UNLISTED.len()).map(|k| (UNLISTED[k], Effect::unlisted(k, &cloth, &mut rng))),
            );
            for (name, effect) in all {
                assert_eq!(effect.name(), name);
                let mut experiment = Experiment::default();
                effect.apply(&mut experiment);
                assert_eq!(experiment.check(), Ok(()), "{round} {effect:?}");
                assert_eq!(experiment.face_down().check(), Ok(()), "{round} {effect:?}");
                let changed = experiment != Experiment::default();
                let of_picture = effect.scale_by() != 0.0 || effect.per_height() != 0.0;
                assert!(changed != of_picture, "{effect:?}");
                let text = serde_json::to_string(&effect).unwrap();
                assert!(text.contains(name), "{text}");
                assert_eq!(serde_json::from_str::<Effect>(&text).unwrap(), effect);
            }
        }
    }
}

//! Scenes that must be refused: what is wrong with each, how it is made, and which refusals name
//! it.
//!
//! In: a [`Cause`]. Out: what it does to the cloth, the scene, the views or the scan; and
//! [`is_right`], the table of refusals that say what is wrong. Refusals are compared by the name
//! of their variant, so that the table reads alike before and after one is added.

use rand::RngExt as _;
use rand::seq::IndexedRandom as _;
use serde::Serialize;

use super::deform::{crease, touching_fold};
use super::drapes::KeptDrape;
use super::spread::{Under, spread_over};
use scan2params::base::{Isometry3, Vector3, seed};
use scan2params::geom::Mesh;
use scan2params::scan::ScanError;
use scan2params::sensor::{
    CameraPose, Fusion, Profile, Scene, Solid, Stand, Support, Thing, VirtualScan,
};

/// What is wrong with a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Nothing.
    Valid,
    /// The cloud is cut by an upright plane near the plate's axis.
    HalfDrape,
    /// The two layers of a fold lie on each other along 40 mm or more.
    TouchingFold,
    /// A sharp ridge of 2 to 4 mm across the hanging cloth.
    Crease,
    /// Half of the views lie 3 mm or 1 degree off the others.
    PassesApart,
    /// All views are from one side.
    MissingSide,
    /// The points lie 5 to 8 mm apart.
    TooCoarse,
    /// The focal length is 1.2 or 6.2 % off, as of two real devices.
    FocalLength,
    /// The cloth lies over a box or a ball, or flat on a table: there is no plate.
    NoPlate,
    /// A table and nothing on it.
    Table,
    /// A board.
    Board,
    /// A box on a floor.
    Box,
    /// Two drapes side by side.
    TwoDrapes,
}

impl Cause {
    /// Those that are wrong, in the order in which they take turns.
    pub const BROKEN: [Self; 12] = [
        Self::HalfDrape,
        Self::TouchingFold,
        Self::Crease,
        Self::PassesApart,
        Self::MissingSide,
        Self::TooCoarse,
        Self::FocalLength,
        Self::NoPlate,
        Self::Table,
        Self::Board,
        Self::Box,
        Self::TwoDrapes,
    ];

    /// The word in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Valid => "valid",
            Self::HalfDrape => "half_drape",
            Self::TouchingFold => "touching_fold",
            Self::Crease => "crease",
            Self::PassesApart => "passes_apart",
            Self::MissingSide => "missing_side",
            Self::TooCoarse => "too_coarse",
            Self::FocalLength => "focal_length",
            Self::NoPlate => "no_plate",
            Self::Table => "table",
            Self::Board => "board",
            Self::Box => "box",
            Self::TwoDrapes => "two_drapes",
        }
    }

    /// The variants of [`ScanError`] that name it; of [`Self::Valid`] none.
    #[must_use]
    pub fn right_names(self) -> &'static [&'static str] {
        match self {
            Self::Valid => &[],
            Self::PassesApart => &["PassesApart"],
            Self::HalfDrape | Self::MissingSide => &["HiddenRim", "Gap", "TooLittleRim"],
            Self::TouchingFold | Self::Crease => &["Misfit", "Unexplained"],
            Self::TooCoarse => &["TooSparse", "TooFewPoints"],
            Self::FocalLength => &["WrongSize"],
            Self::NoPlate | Self::Table | Self::Board | Self::Box => &["NoPlate"],
            Self::TwoDrapes => &["SeveralDrapes"],
        }
    }

    /// Whether a rim that is found may be compared with the true one: the cloth is a drape.
    #[must_use]
    pub fn has_a_rim(self) -> bool {
        !matches!(self, Self::NoPlate | Self::Table | Self::Board | Self::Box)
    }

    /// Whether it can be made of this drape: a fold can be pressed together only where the cloth
    /// has folds.
    #[must_use]
    pub fn suits(self, drape: &KeptDrape) -> bool {
        const SOFT_M: f64 = 0.014;
        self != Self::TouchingFold || drape.bending_length_m().is_some_and(|m| m < SOFT_M)
    }

    /// What it does to the cloth; `false` where it cannot.
    pub fn deform(self, mesh: &mut Mesh, seed: u64) -> bool {
        let mut rng = seed::rng(seed, "broken-cloth", 0);
        match self {
            Self::TouchingFold => touching_fold(mesh, &mut rng),
            Self::Crease => {
                crease(mesh, &mut rng);
                true
            }
            _ => true,
        }
    }

    /// What it does to the scene; `other` is a second drape.
    pub fn rearrange(self, scene: &mut Scene, other: &Mesh, seed: u64) {
        let mut rng = seed::rng(seed, "broken-scene", 0);
        match self {
            Self::NoPlate => no_plate(scene, &mut rng),
            Self::Table => {
                let sides = [rng.random_range(0.5..1.0), 0.03, rng.random_range(0.4..0.7)];
                alone(scene, sides, 0.7);
            }
            Self::Board => {
                let sides = [rng.random_range(0.2..0.4), 0.01, rng.random_range(0.15..0.3)];
                alone(scene, sides, 0.0);
            }
            Self::Box => {
                let sides = [(0.10, 0.3), (0.08, 0.25), (0.10, 0.3)];
                let sides = sides.map(|(low, high)| rng.random_range(low..high));
                alone(scene, sides, sides[1]);
            }
            Self::TwoDrapes => second_drape(scene, other, &mut rng),
            _ => {}
        }
    }

    /// What it does to the views.
    pub fn narrow(self, poses: &mut Vec<CameraPose>, seed: u64) {
        if self != Self::MissingSide {
            return;
        }
        const HALF_RAD: f64 = 1.05;
        let mut rng = seed::rng(seed, "broken-views", 0);
        let turn = rng.random_range(0.0..std::f64::consts::TAU);
        let toward = Vector3::new(turn.cos(), 0.0, turn.sin());
        let most = HALF_RAD.cos();
        poses.retain(|pose| {
            let eye = pose.simulation_from_camera.translation.vector;
            let flat = Vector3::new(eye.x, 0.0, eye.z);
            flat.norm() > 0.05 && flat.normalize().dot(&toward) > most
        });
    }

    /// What it does to the sensor.
    pub fn coarsen(self, profile: &mut Profile, seed: u64) {
        if self == Self::TooCoarse {
            let mut rng = seed::rng(seed, "broken-spacing", 0);
            profile.spacing_m = rng.random_range(5e-3..8e-3);
            profile.fusion = Fusion::OneSample;
        }
    }

    /// What it does to the scan.
    pub fn spoil(self, made: &mut VirtualScan, profile: &Profile, seed: u64) {
        let mut rng = seed::rng(seed, "broken-scan", 0);
        match self {
            Self::HalfDrape => {
                let turn = rng.random_range(0.0..std::f64::consts::TAU);
                let beyond: f64 = rng.random_range(-0.01..0.04);
                let normal = Vector3::new(turn.cos(), 0.0, turn.sin());
                let truth = made.truth;
                keep(made, |p| truth.to_simulation_m(p).coords.dot(&normal) < beyond);
            }
            Self::PassesApart => {
                let turn = rng.random_range(0.0..std::f64::consts::TAU);
                let shift = Vector3::new(turn.cos(), 0.0, turn.sin());
                let motion = if rng.random() {
                    Isometry3::new(3e-3 * shift, Vector3::zeros())
                } else {
                    Isometry3::new(Vector3::zeros(), 1_f64.to_radians() * shift)
                };
                let half = made.views.len() / 2;
                for view in &mut made.views[half..] {
                    let pose = &mut view.pose_believed.simulation_from_camera;
                    *pose = motion * *pose;
                }
                made.fuse_again(profile, seed);
            }
            Self::FocalLength => {
                let error = *[0.0118, -0.0118, 0.0621, -0.0621].choose(&mut rng).unwrap_or(&0.0118);
                for view in &mut made.views {
                    view.camera.focal_px *= 1.0 + error;
                }
                made.fuse_again(profile, seed);
            }
            _ => {}
        }
    }
}

/// The name of a refusal's variant.
#[must_use]
pub fn name_of(error: &ScanError) -> String {
    let text = format!("{error:?}");
    text.chars().take_while(|c| c.is_alphanumeric()).collect()
}

/// Whether a refusal of this name says what is wrong.
#[must_use]
pub fn is_right(cause: Cause, error: &str) -> bool {
    cause.right_names().contains(&error)
}

/// Leaves of the cloud the points that fit.
pub(super) fn keep(made: &mut VirtualScan, fits: impl Fn(&scan2params::base::Point3) -> bool) {
    let cloud = &mut made.cloud;
    let kept: Vec<usize> = (0..cloud.points.len()).filter(|&k| fits(&cloud.points[k])).collect();
    cloud.points = kept.iter().map(|&k| cloud.points[k]).collect();
    if !cloud.colors.is_empty() {
        cloud.colors = kept.iter().map(|&k| cloud.colors[k]).collect();
    }
}

/// In place of the drape a block whose top is at y = 0, on a floor so far below, or on none.
fn alone(scene: &mut Scene, sides: [f64; 3], floor_m: f64) {
    let block = Solid::standing_block([0.0; 2], -sides[1], sides, 0.0);
    scene.drape = block.block_mesh().unwrap_or_default();
    scene.things.clear();
    let floor_radius_m = if floor_m > 0.0 { 1.5 } else { 0.0 };
    let floor_y_m = if floor_m > 0.0 { -floor_m.max(sides[1]) } else { -0.6 };
    scene.stand =
        Stand { support: Support::Nothing, floor_y_m, floor_radius_m, ..Stand::MODIFIED_CUSICK };
}

/// The cloth spread over a box or a ball, or flat on the floor.
fn no_plate(scene: &mut Scene, rng: &mut seed::Rng) {
    let under = match rng.random_range(0..3) {
        0 => Under::Box([
            rng.random_range(0.08..0.16),
            rng.random_range(0.08..0.16),
            rng.random_range(0.08..0.16),
        ]),
        1 => Under::Ball(rng.random_range(0.05..0.09)),
        _ => Under::Floor,
    };
    let (mesh, solid, floor_y_m) = spread_over(under);
    scene.drape = mesh;
    scene.cloth_colors.clear();
    scene.things = solid.into_iter().map(|solid| Thing { solid, color: [150, 120, 80] }).collect();
    scene.stand = Stand {
        support: Support::Nothing,
        floor_y_m,
        floor_radius_m: 1.5,
        ..Stand::MODIFIED_CUSICK
    };
}

/// A second drape with its plate and its column, 330 to 450 mm beside the first.
fn second_drape(scene: &mut Scene, other: &Mesh, rng: &mut seed::Rng) {
    let (away, turn) = (rng.random_range(0.33..0.45), rng.random_range(0.0..std::f64::consts::TAU));
    let shift = Vector3::new(away * turn.cos(), 0.0, away * turn.sin());
    let first = scene.drape.vertices.len() as u32;
    scene.drape.vertices.extend(other.vertices.iter().map(|p| p + shift));
    let shifted = other.triangles.iter().map(|t| t.map(|v| v + first));
    scene.drape.triangles.extend(shifted);
    scene.things.clear();
    let stand = &mut scene.stand;
    let lowest = scene.drape.vertices.iter().map(|p| p.y).fold(0.0, f64::min);
    stand.floor_y_m = stand.floor_y_m.min(lowest - stand.plate_thickness_m - 0.02);
    let axis = [shift.x, shift.z];
    let upright = |radius: f64, bottom: f64, top: f64| Thing {
        solid: Solid::Cone { axis, radii: [radius; 2], heights: [bottom, top] },
        color: Scene::STAND_COLOR,
    };
    let bottom = -stand.plate_thickness_m;
    scene.things.push(upright(stand.plate_radius_m, bottom, 0.0));
    scene.things.push(upright(0.02, stand.floor_y_m, bottom));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_broken_cause_has_a_right_name_that_is_a_variant() {
        let source = include_str!("../../../../src/scan/error.rs");
        for cause in Cause::BROKEN {
            let names = cause.right_names();
            assert!(!names.is_empty(), "{}", cause.name());
            for name in names {
                assert!(source.contains(&format!("\n    {name} {{")), "{name} is no variant");
                assert!(is_right(cause, name) && !is_right(Cause::Valid, name));
            }
        }
    }

    #[test]
    fn refusals_go_by_the_name_of_their_variant() {
        assert_eq!(name_of(&ScanError::NoColors), "NoColors");
        assert_eq!(name_of(&ScanError::TooFewPoints { points: 1, limit: 2 }), "TooFewPoints");
    }
}

//! What stands around a drape where people scan: a floor, boxes, a wall, a lamp, a hand.
//!
//! In: a kind, a [`Scene`] with its stand, a seed. Out: the scene with its floor and its things.
//! All that is drawn keeps [`CLEAR_M`] from the cloth. Sizes are guesses at a household.

use nalgebra::{UnitQuaternion, Vector3 as Column};
use rand::RngExt as _;

use super::scene::{Scene, Thing};
use super::solids::Solid;
use crate::base::{Isometry3, Point3, Vector3, seed};

/// What there is around a drape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surroundings {
    /// Nothing, not even a floor: for a stand that is held from far below.
    Bare,
    /// A small round table.
    Table,
    /// A wide floor.
    Open,
    /// A wide floor with two to four boxes, cups and balls.
    Clutter,
    /// A wide floor, and a hand near the cloth.
    Hand,
    /// A wide floor and a wall.
    Wall,
    /// A wide floor and a desk lamp.
    Lamp,
}

/// Least distance from the cloth \[m\].
const CLEAR_M: f64 = 0.02;
/// Radius of a wide floor \[m\].
const WIDE_M: f64 = 1.5;

impl Surroundings {
    /// Every kind.
    pub const ALL: [Self; 7] =
        [Self::Bare, Self::Table, Self::Open, Self::Clutter, Self::Hand, Self::Wall, Self::Lamp];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bare => "bare",
            Self::Table => "table",
            Self::Open => "open",
            Self::Clutter => "clutter",
            Self::Hand => "hand",
            Self::Wall => "wall",
            Self::Lamp => "lamp",
        }
    }

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Gives the scene a floor and things. A wall stands `room_m` or more from the plate's axis, so
    /// that a camera has room before it.
    pub fn furnish(self, scene: &mut Scene, room_m: f64, run_seed: u64) {
        let mut rng = seed::rng(run_seed, "sensor-surroundings", 0);
        let lowest = scene.drape.vertices.iter().map(|p| p.y).fold(0.0, f64::min);
        let stand = &mut scene.stand;
        let below_m: f64 = rng.random_range(0.03..0.15);
        stand.floor_y_m = match self {
            Self::Bare => -0.6,
            _ => lowest - stand.plate_thickness_m - below_m,
        };
        stand.floor_radius_m = match self {
            Self::Bare => 0.0,
            Self::Table => rng.random_range(0.18..0.30),
            _ => WIDE_M,
        };
        let floor_y = stand.floor_y_m;
        let solids = match self {
            Self::Bare | Self::Table | Self::Open => Vec::new(),
            Self::Clutter => clutter(scene, floor_y, &mut rng),
            Self::Hand => hand(scene, &mut rng),
            Self::Wall => vec![wall(floor_y, room_m, &mut rng)],
            Self::Lamp => lamp(scene, floor_y, &mut rng),
        };
        let thing = |solid| Thing { solid, color: [0; 3].map(|_| rng.random_range(60..230)) };
        scene.things = solids.into_iter().map(thing).collect();
    }
}

/// Whether a shape keeps so far from the cloth, the plate's axis side included.
fn is_clear(scene: &Scene, solid: &Solid, clear_m: f64) -> bool {
    scene.drape.vertices.iter().all(|p| solid.distance_m(p) >= clear_m)
}

/// Two to four boxes, cups and balls, 220 to 600 mm from the axis.
fn clutter(scene: &Scene, floor_y: f64, rng: &mut seed::Rng) -> Vec<Solid> {
    let count = rng.random_range(2..=4);
    let mut all: Vec<Solid> = Vec::new();
    for _ in 0..200 {
        let (away, turn) = (rng.random_range(0.22..0.60), bearing(rng));
        let at = [away * turn.cos(), away * turn.sin()];
        let solid = match rng.random_range(0..4) {
            0 => {
                let radius = rng.random_range(0.025..0.08);
                let middle = Point3::new(at[0], floor_y + radius, at[1]);
                Solid::Capsule { ends: [middle; 2], radius }
            }
            1 => {
                let foot = rng.random_range(0.025..0.04);
                let radii = [foot, foot + rng.random_range(0.0..0.012)];
                let heights = [floor_y, floor_y + rng.random_range(0.08..0.14)];
                Solid::Cone { axis: at, radii, heights }
            }
            _ => {
                let sides = [(0.04, 0.25), (0.03, 0.22), (0.04, 0.25)];
                let sides = sides.map(|(low, high)| rng.random_range(low..high));
                Solid::standing_block(at, floor_y, sides, bearing(rng))
            }
        };
        // Apart from the cloth by the width of a hand, and not in each other.
        let apart = all.iter().all(|other| {
            let middle = middle(&solid);
            other.distance_m(&middle) > 0.02 - solid.distance_m(&middle).min(0.0)
        });
        if apart && is_clear(scene, &solid, 2.0 * CLEAR_M) {
            all.push(solid);
        }
        if all.len() == count {
            break;
        }
    }
    all
}

fn middle(solid: &Solid) -> Point3 {
    match *solid {
        Solid::Block { place, .. } => Point3::from(place.translation.vector),
        Solid::Capsule { ends: [a, b], .. } => nalgebra::center(&a, &b),
        Solid::Cone { axis, heights, .. } => {
            Point3::new(axis[0], 0.5 * (heights[0] + heights[1]), axis[1])
        }
        Solid::Cylinder { bottom, top, .. } | Solid::Rounded { bottom, top, .. } => {
            Point3::new(0.0, 0.5 * (bottom + top), 0.0)
        }
    }
}

fn bearing(rng: &mut seed::Rng) -> f64 {
    rng.random_range(0.0..std::f64::consts::TAU)
}

/// Four fingers, a thumb, a palm and a forearm that reach towards the cloth, 20 to 60 mm from it.
fn hand(scene: &Scene, rng: &mut seed::Rng) -> Vec<Solid> {
    let (turn, height) = (bearing(rng), rng.random_range(-0.12..0.0));
    let rise: f64 = rng.random_range(-0.1..0.4);
    let away_m = rng.random_range(CLEAR_M..0.06);
    // Along the arm from the fingertips, and across it.
    let outward = Vector3::new(turn.cos() * rise.cos(), rise.sin(), turn.sin() * rise.cos());
    let across = Vector3::new(-turn.sin(), 0.0, turn.cos());
    let limb = |tip: Point3, from: [f64; 2], to: [f64; 2], radius: f64| {
        let at = |[along, aside]: [f64; 2]| tip + outward * along + across * aside;
        Solid::Capsule { ends: [at(from), at(to)], radius }
    };
    let at = |tip: Point3| {
        vec![
            limb(tip, [0.010, -0.033], [0.085, -0.030], 0.008),
            limb(tip, [0.000, -0.011], [0.085, -0.010], 0.009),
            limb(tip, [0.004, 0.011], [0.085, 0.010], 0.009),
            limb(tip, [0.020, 0.031], [0.085, 0.028], 0.007),
            limb(tip, [0.060, -0.070], [0.120, -0.030], 0.010),
            limb(tip, [0.095, -0.022], [0.150, -0.018], 0.018),
            limb(tip, [0.095, 0.022], [0.150, 0.018], 0.018),
            limb(tip, [0.160, 0.0], [0.420, 0.0], 0.032),
        ]
    };
    let mut reach = 0.08;
    loop {
        let tip = Point3::new(reach * turn.cos(), height, reach * turn.sin());
        let solids = at(tip);
        if solids.iter().all(|solid| is_clear(scene, solid, away_m)) {
            return solids;
        }
        reach += 0.004;
    }
}

/// A wall 250 to 500 mm from the axis, not nearer than `room_m`.
fn wall(floor_y: f64, room_m: f64, rng: &mut seed::Rng) -> Solid {
    const THICKNESS_M: f64 = 0.1;
    let away = rng.random_range(0.25..0.50_f64).max(room_m) + 0.5 * THICKNESS_M;
    let turn = bearing(rng);
    let half = [0.5 * THICKNESS_M, 0.6, 1.2];
    let turned = UnitQuaternion::from_axis_angle(&Column::y_axis(), -turn);
    let middle = Vector3::new(away * turn.cos(), floor_y + half[1], away * turn.sin());
    Solid::Block { place: Isometry3::from_parts(middle.into(), turned), half }
}

/// A foot, a thin post, an arm and a shade that keeps 150 mm above the cloth or to its side.
fn lamp(scene: &Scene, floor_y: f64, rng: &mut seed::Rng) -> Vec<Solid> {
    let (away, turn) = (rng.random_range(0.26..0.45), bearing(rng));
    let at = |r: f64, y: f64| Point3::new(r * turn.cos(), y, r * turn.sin());
    let top = floor_y + rng.random_range(0.45..0.60);
    let radius = rng.random_range(0.05..0.08);
    let axis = [away * turn.cos(), away * turn.sin()];
    let foot = Solid::Cone { axis, radii: [0.07, 0.06], heights: [floor_y, floor_y + 0.02] };
    let post = Solid::Capsule { ends: [at(away, floor_y), at(away, top)], radius: 0.007 };
    // The shade hangs 60 to 160 mm inward of the post, as far as it keeps clear.
    let mut inward = rng.random_range(0.06..0.16);
    loop {
        let over = away - inward;
        let heights = [top - 0.10, top];
        let axis = [over * turn.cos(), over * turn.sin()];
        let shade = Solid::Cone { axis, radii: [radius, 0.5 * radius], heights };
        if inward <= 0.0 || is_clear(scene, &shade, 0.15) {
            let arm = Solid::Capsule { ends: [at(away, top), at(over, top)], radius: 0.006 };
            return vec![foot, post, arm, shade];
        }
        inward -= 0.01;
    }
}

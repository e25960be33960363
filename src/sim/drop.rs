//! How the flat specimen is released.
//!
//! In: a [`Drop`] and a grid. Out: the positions from which the sheet falls, and the
//! springs of a guided drop. A drape has several stable shapes; which one a drop
//! ends in is decided here, by fractions of a millimetre, as it is in reality.

use rand::RngExt as _;

use crate::base::boundary::{BoundaryPoint, POINTS_PER_SIDE};
use crate::base::frame::GRAVITY_M_S2;
use crate::base::{Boundary, Outline, Surface, Vector3, seed};
use crate::fabric::Fabric;
use crate::sim::experiment::Experiment;
use crate::sim::grid::Grid;
use crate::sim::guide::{Guide, Target, known};
use crate::sim::initialise::SAG_M;
use crate::sim::options::SimOptions;

/// The state from which the flat specimen falls.
#[derive(Clone, Debug, PartialEq)]
pub enum DropStart {
    /// The specimen is level, with a fixed unevenness of 0.2 mm that breaks the symmetry.
    Canonical,
    /// The corners are lifted and the sheet is tilted, uneven and a little off centre, all drawn
    /// from this seed. Different seeds sample the stable shapes of a fabric.
    Perturbed(u64),
    /// Springs guide the border to a scanned rim (simulation frame) and are released before the
    /// sheet comes to rest, so that it ends in an equilibrium near what was scanned.
    Guided(Box<Boundary>),
    /// As [`Self::Guided`], but weak springs keep the border tied to the rim: the sheet comes to
    /// rest next to it also where it would move to another equilibrium if it were released.
    HeldRim(Box<HeldRim>),
    /// Springs guide the rim of a disc to an outline seen from above (simulation frame) and are
    /// released before the sheet comes to rest. Which place of the rim lies where along the outline
    /// is not known: even steps of the one are taken for even steps of the other, turned so that
    /// the bearings agree on the whole; nor is the height, for which the cloth beyond the plate's
    /// edge is taken as nearly straight. The specimen must lie on the plate's centre without
    /// rotation.
    Outline(Box<Outline>),
    /// As [`Self::Outline`], but weak springs keep the rim tied across the outline: the sheet comes
    /// to rest on the outline's branch also where it would leave that if it were released.
    Held(Box<Hold>),
    /// The sheet is laid where this surface of the specimen lies (simulation frame) and comes to
    /// rest without a fall: it ends in the equilibrium next to the surface. A surface with an error
    /// (a scan's) is first held by springs over all of it, which are released in stages.
    Surface(Box<Surface>),
    /// As [`Self::Surface`], but weak springs keep all of the sheet tied to the surface: it comes
    /// to rest next to it also where it would move to another equilibrium if it were released.
    HeldSurface(Box<HeldSurface>),
}

/// A surface that a sheet starts from and stays tied to by weak springs, until
/// [`crate::sim::Follower::release`].
///
/// They act along all directions and by area, weaker where the surface's standard deviation is
/// large.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldSurface {
    /// The surface, simulation frame.
    pub surface: Surface,
    /// How far the weight of a piece of cloth stretches the springs on it \[m\]: the larger, the
    /// weaker they are.
    pub sag_m: f64,
    /// By how much farther from the frame's origin the surface lies than it is given, as a share
    /// \[-\].
    pub farther: f64,
}

/// A rim that the border of a sheet is guided to and stays tied to by weak springs, until
/// [`crate::sim::Follower::release`].
///
/// They act along all directions, weaker where the rim's standard deviation is large.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldRim {
    /// The rim, simulation frame.
    pub rim: Boundary,
    /// How far a cell's weight stretches one of the springs \[m\]: the larger, the weaker they are.
    pub sag_m: f64,
    /// By how much farther from the frame's origin the rim lies than it is given, as a share
    /// \[-\].
    pub farther: f64,
}

/// Weak springs that hold a disc's rim across an outline.
///
/// They act in the plan alone, across the outline, and not on the mean:
/// [`crate::sim::Follower::hold`] sets how far outwards they pull, all alike, and where that is
/// such that they pull nowhere on the whole, the drape's mean extent is the cloth's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// The outline seen from above, plan of the simulation frame \[m\].
    pub outline: Outline,
    /// Force of all springs, each stretched by a distance, over that distance and the weight of the
    /// cloth beyond the plate's edge \[1/m\]: 10 for a hundredth of that weight for each
    /// millimetre.
    pub per_m: f64,
}

/// How a specimen is dropped onto the plate.
#[derive(Clone, Debug, PartialEq)]
pub struct Drop {
    /// The state from which the specimen falls.
    pub start: DropStart,
}

impl Drop {
    /// The drop that every fabric is compared by: level, with a fixed small unevenness.
    #[must_use]
    pub fn canonical() -> Self {
        Self { start: DropStart::Canonical }
    }
}

/// How a specimen that nothing leads falls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fall {
    /// As all others ([`DropStart::Canonical`]).
    Canonical,
    /// In its own way, drawn from a seed ([`DropStart::Perturbed`]).
    Perturbed,
}

impl Fall {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Canonical, Self::Perturbed];

    /// The word in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Canonical => "canonical",
            Self::Perturbed => "perturbed",
        }
    }

    /// The drop; a canonical one has no use for the seed.
    #[must_use]
    pub fn drop(self, seed: u64) -> Drop {
        match self {
            Self::Canonical => Drop::canonical(),
            Self::Perturbed => Drop { start: DropStart::Perturbed(seed) },
        }
    }
}

/// The springs of a guided drop; `None` if nothing guides the sheet.
///
/// They are of such a stiffness that a cell's weight stretches one by 8 mm (the best of 0.5 to 50
/// mm, tried on one drape). They choose the branch and are released before the search for
/// equilibrium.
pub(super) fn guide(
    start: &DropStart,
    grid: &Grid,
    fabric: &Fabric,
    experiment: &Experiment,
) -> Option<Guide> {
    let targets = match start {
        DropStart::Guided(rim) => rim_targets(grid, rim, |_| 1.0),
        DropStart::HeldRim(held) => return Some(on_rim(held, grid, fabric, SPRING_SAG_M)),
        DropStart::Outline(outline) => led(outline_targets(grid, outline, experiment)),
        DropStart::Held(hold) => led(outline_targets(grid, &hold.outline, experiment)),
        DropStart::Canonical
        | DropStart::Perturbed(_)
        | DropStart::Surface(_)
        | DropStart::HeldSurface(_) => return None,
    };
    Some(sagging(targets, grid, fabric, SPRING_SAG_M))
}

/// The springs of a tied rim, weaker where that is less sure; a cell's weight stretches one by
/// `sag_m`.
fn on_rim(held: &HeldRim, grid: &Grid, fabric: &Fabric, sag_m: f64) -> Guide {
    let targets = rim_targets(grid, &held.rim, |point| known(point.sigma_m));
    Guide { farther: held.farther, ..sagging(targets, grid, fabric, sag_m) }
}

/// Springs that a cell's weight stretches by `sag_m`.
fn sagging(targets: Vec<Target>, grid: &Grid, fabric: &Fabric, sag_m: f64) -> Guide {
    let cell_n = fabric.density_kg_m2 * grid.spacing_m.powi(2) * GRAVITY_M_S2;
    Guide { targets, stiffness_n_m: cell_n / sag_m, outwards_m: 0.0, farther: 0.0 }
}

/// Stronger springs on which a sheet guided by its rim, which will be tied, is brought to rest
/// first, as one that is laid is: the cloth within slides freely to where the rim asks for it.
/// (Without them the true fabric of a test rests 2.0 mm off after release, and 0.26 mm with them.)
pub(super) fn clasping(start: &DropStart, grid: &Grid, fabric: &Fabric) -> Option<Guide> {
    match start {
        DropStart::HeldRim(held) => Some(on_rim(held, grid, fabric, SAG_M)),
        _ => None,
    }
}

/// The springs that keep a sheet tied after guiding; none if it is released.
pub(super) fn holding(
    start: &DropStart,
    grid: &Grid,
    fabric: &Fabric,
    experiment: &Experiment,
) -> Guide {
    match start {
        DropStart::Held(hold) => across_outline(hold, grid, fabric, experiment),
        DropStart::HeldRim(held) => on_rim(held, grid, fabric, held.sag_m),
        _ => Guide::default(),
    }
}

/// Springs to the same places that act along all directions: a sheet is led in height too.
fn led(targets: Vec<Target>) -> Vec<Target> {
    targets.into_iter().map(|target| Target { along: None, ..target }).collect()
}

/// The springs of a hold.
pub(super) fn across_outline(
    hold: &Hold,
    grid: &Grid,
    fabric: &Fabric,
    experiment: &Experiment,
) -> Guide {
    let mut targets = outline_targets(grid, &hold.outline, experiment);
    let share = 1.0 / targets.len().max(1) as f64;
    targets.iter_mut().for_each(|target| target.weight = share);
    let weight_n = hanging_n(fabric, experiment);
    Guide { targets, stiffness_n_m: hold.per_m * weight_n, outwards_m: 0.0, farther: 0.0 }
}

/// Weight of a disc beyond the plate's edge \[N\].
fn hanging_n(fabric: &Fabric, experiment: &Experiment) -> f64 {
    let radius_m = 0.5 * experiment.specimen.weft_m;
    let area_m2 = std::f64::consts::PI * (radius_m.powi(2) - experiment.plate.radius_m.powi(2));
    fabric.density_kg_m2 * GRAVITY_M_S2 * area_m2
}

/// Each vertex of the border and where the rim has it; the weight of its spring by the rim's point
/// next to it.
fn rim_targets(grid: &Grid, rim: &Boundary, weight: impl Fn(&BoundaryPoint) -> f64) -> Vec<Target> {
    let points = rim.points();
    let border = grid.border();
    let per_side = grid.n - 1;
    let scale = (POINTS_PER_SIDE - 1) as f64 / per_side as f64;
    let steps = grid.along_border();
    let target = |k: usize| {
        let along = steps[k] * scale;
        let index = k / per_side * POINTS_PER_SIDE + along.floor() as usize;
        let (at, next) = (&points[index], &points[(index + 1) % points.len()]);
        let nearest = if along.fract() < 0.5 { at } else { next };
        let (from, to) = (at.position_m, next.position_m);
        ((from + (to - from) * along.fract()).coords, weight(nearest))
    };
    let spring = |(k, &vertex): (usize, &usize)| {
        let (position_m, weight) = target(k);
        Target { vertex, position_m, along: None, weight }
    };
    border.iter().enumerate().map(spring).collect()
}

/// Each vertex of a disc within a cell of its rim, where the outline has it, and the direction
/// across the outline: the rim lies below its outline so deep that the cloth from the plate's edge
/// to it is nearly straight, and the vertex between them.
///
/// The true fabric ends 0.1 to 0.5 mm from the drape whose outline led it, in three of three. An
/// earlier start with springs in the plan alone, which left the height free, and with other places
/// for vertices behind the rim lost folds in two of them.
fn outline_targets(grid: &Grid, outline: &Outline, experiment: &Experiment) -> Vec<Target> {
    let even = outline.evenly(OUTLINE_POINTS);
    let [cx, cz] = outline.centroid_m();
    let count = OUTLINE_POINTS as f64;
    let angle_of = |k: usize| std::f64::consts::TAU * k as f64 / count;
    // by how many steps the outline's first point is ahead of the rim's, on the mean over the
    // circle
    let (sin, cos) = even.iter().enumerate().fold((0.0, 0.0), |(s, c), (k, p)| {
        let (ds, dc) = ((p[1] - cz).atan2(p[0] - cx) - angle_of(k)).sin_cos();
        (s + ds, c + dc)
    });
    let ahead = sin.atan2(cos) / std::f64::consts::TAU * count;
    let radius_m = 0.5 * experiment.specimen.weft_m;
    let plate_m = experiment.plate.radius_m;
    let near = |&v: &usize| grid.share(v) > 0.0 && grid.flat(v).norm() > radius_m - grid.spacing_m;
    let target = |vertex: usize| {
        let flat = grid.flat(vertex);
        let angle = flat.z.atan2(flat.x);
        let at = angle / std::f64::consts::TAU * count - ahead;
        let (whole, part) = (at.floor(), at - at.floor());
        let first = whole.rem_euclid(count) as usize;
        let (a, b) = (even[first], even[(first + 1) % OUTLINE_POINTS]);
        let [x, z] = [0, 1].map(|c| a[c] + (b[c] - a[c]) * part);
        let rim = Vector3::new(x, -rim_depth_m(experiment, x.hypot(z)), z);
        let edge = Vector3::new(angle.cos(), 0.0, angle.sin()) * plate_m;
        let share = (flat.norm() - plate_m) / (radius_m - plate_m);
        // across the outline, outwards: it runs from the warp towards the weft
        let (dx, dz) = (b[0] - a[0], b[1] - a[1]);
        let along = Some(Vector3::new(dz, 0.0, -dx) / dx.hypot(dz));
        Target { vertex, position_m: edge + (rim - edge) * share, along, weight: 1.0 }
    };
    (0..grid.vertices()).filter(near).map(target).collect()
}

/// How deep a disc's rim hangs below the plate's face where it lies so far from the axis \[m\]: the
/// cloth from the plate's edge to it is nearly straight.
#[must_use]
pub fn rim_depth_m(experiment: &Experiment, distance_m: f64) -> f64 {
    let plate_m = experiment.plate.radius_m;
    let out = (distance_m - plate_m).max(0.0);
    let chord = CHORD * (0.5 * experiment.specimen.weft_m - plate_m);
    (chord * chord - out * out).max(0.0).sqrt()
}

/// Distance of a disc's rim from the plate's edge, as a part of the cloth between them: observed on
/// three drapes with a bending length of 24 mm as 0.990 to 0.992 on the mean, 0.01 from place to
/// place.
const CHORD: f64 = 0.99;
/// Even steps that an outline is cut into, finer than any grid's.
const OUTLINE_POINTS: usize = 720;

/// How far a cell's weight stretches a guiding spring \[m\].
const SPRING_SAG_M: f64 = 8e-3;

/// The unevenness of a canonical drop.
pub(crate) const CANONICAL_WAVES: [Wave; 2] = [
    Wave { height_m: 0.2e-3, along_x: 1.3, along_z: 2.1, phase: 0.4 },
    Wave { height_m: 0.1e-3, along_x: 3.2, along_z: -1.7, phase: 1.9 },
];

/// An unevenness of the flat sheet: a wave over the specimen's half sides.
pub(crate) struct Wave {
    /// Its amplitude \[m\].
    height_m: f64,
    /// Radians a half side along x.
    along_x: f64,
    /// Radians a half side along z.
    along_z: f64,
    /// Phase at the specimen's centre \[rad\].
    phase: f64,
}

impl Wave {
    /// Height \[m\] at a place that is given as shares of the half sides along x and z.
    pub(crate) fn height_at_m(&self, x: f64, z: f64) -> f64 {
        self.height_m * (self.along_x * x + self.along_z * z + self.phase).sin()
    }
}

/// The positions from which the sheet falls \[m\]: its lowest point over the plate lies one gap
/// above the plate's face.
pub(super) fn start_positions(drop: &Drop, grid: &Grid, options: &SimOptions) -> Vec<Vector3> {
    let specimen = &options.experiment.specimen;
    let half = 0.5 * specimen.weft_m;
    let mut waves = Vec::new();
    let (mut tilt, mut offset) = ([0.0, 0.0, 0.0], Vector3::zeros());
    match drop.start {
        // a surface is laid, not dropped: `initialise`
        DropStart::Canonical
        | DropStart::Guided(_)
        | DropStart::HeldRim(_)
        | DropStart::Outline(_)
        | DropStart::Held(_)
        | DropStart::Surface(_)
        | DropStart::HeldSurface(_) => {
            waves.extend(CANONICAL_WAVES);
        }
        DropStart::Perturbed(drop_seed) => {
            let mut rng = seed::rng(drop_seed, "drop", 0);
            let mut uniform = |limit: f64| rng.random_range(-limit..limit);
            tilt = [uniform(0.02), uniform(0.02), uniform(0.03)];
            offset = Vector3::new(uniform(1e-3), 0.0, uniform(1e-3));
            for _ in 0..6 {
                waves.push(Wave {
                    height_m: uniform(1e-3),
                    along_x: uniform(6.0),
                    along_z: uniform(6.0),
                    phase: uniform(3.2),
                });
            }
        }
    }
    let shape = |p: Vector3| {
        let (x, z) = (p.x / half, p.z / half);
        // lifted by the square of the distance, so that the plate's part stays flat
        let lift =
            (x * tilt[0] + z * tilt[1] + x * z * tilt[2]) * p.norm_squared() / (2.0 * half * half);
        let uneven: f64 = waves.iter().map(|wave| wave.height_at_m(x, z)).sum();
        specimen.place(p) + offset + Vector3::new(0.0, lift + uneven, 0.0)
    };
    let mut x: Vec<_> = (0..grid.vertices()).map(|v| shape(grid.flat(v))).collect();
    let reach = options.experiment.plate.radius_m + grid.spacing_m;
    let lowest =
        x.iter().filter(|p| p.x.hypot(p.z) < reach).map(|p| p.y).fold(f64::INFINITY, f64::min);
    for p in &mut x {
        p.y += options.experiment.plate.gap_m - lowest;
    }
    grid.park_outside(&mut x);
    x
}

//! Views of a turntable: in order, without poses, the camera standing still.
//!
//! In: views in metres, each in its camera's frame; the step by which the drape turns from one to the
//! next, where it is said. Out: the views without what stands still around the drape, and for each a pose in the
//! first one's frame from which [`Register::settled`] goes on.
//!
//! Each view's plate is found. Their normals are the axis' direction; their centres, which lie on a circle
//! if the plate stands beside the axis, give its place. Where the step is not said it is looked for in steps of 5
//! degrees, either way round: the one is taken with which neighbouring views lie best on one another.
//! Then each view is brought to the one before.
//!
//! Where it fails: steps that differ by more than some 5 degrees, and drapes that look alike from several sides.

use nalgebra::{Translation3, UnitQuaternion, UnitVector3};
use rayon::prelude::*;

use super::register::{LEAST_SHARED, Placed, Register};
use crate::base::{Isometry3, Point3, Vector3};
use crate::io::SeenView;
use crate::numeric::robust::median;
use crate::scan::{FoundPlate, ScanOptions, plate_of};

/// Steps that are tried are multiples of this \[rad\].
const GRID_RAD: f64 = 5.0_f64.to_radians();
/// Of these the best are followed to their end,
const FOLLOWED: usize = 8;
/// with so many pairs of neighbours, spread over the views.
const PAIRS: usize = 4;
/// Steps are one if they differ by less than this \[rad\].
const SAME_RAD: f64 = 0.05;
/// The best step's misfit is less than this share of any other's \[-\].
const BETTER: f64 = 0.8;
/// What lies so many sides of the specimen from the axis does not turn \[-\]: its corners lie at 0.71.
const REACH_SIDES: f64 = 0.8;
/// So many views at a time are asked for their plate, until so many show one.
const ASKED: usize = 6;
const ENOUGH: usize = 4;
/// A plate is another thing whose normal is turned by so much from the middle one \[rad\], or whose centre lies so far
/// off \[m\].
const TURNED_RAD: f64 = 0.2;
const BESIDE_M: f64 = 60e-3;
/// Usual distance of a plate from the axis, and error of a view's centre \[m\].
const OFF_AXIS_M: f64 = 20e-3;
const CENTRE_SIGMA_M: f64 = 2e-3;

/// No step, or several, make neighbouring views agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoStep;

/// The plates as the camera sees them.
#[derive(Clone, Debug)]
pub struct Plates {
    up: UnitVector3<f64>,
    /// The middle of the centres \[m\].
    middle: Point3,
    /// The view's number and its plate's centre \[m\].
    centres: Vec<(usize, Point3)>,
}

/// Where the views begin.
#[derive(Clone, Debug)]
pub struct Begun {
    /// The first view's frame from each view's.
    pub poses: Vec<Isometry3>,
    /// By how much the drape turns from one view to the next, in the middle; positive counter-clockwise from
    /// above \[rad\].
    pub step_rad: f64,
}

impl Plates {
    /// The plates of the views, of which one is enough; `None` if none is seen, or most are elsewhere.
    #[must_use]
    pub fn of(views: &[SeenView], options: &ScanOptions) -> Option<Self> {
        let found = Self::found(views, options);
        let middle_of = |of: fn(&FoundPlate) -> Vector3| -> Option<Vector3> {
            let along = |axis: usize| median(found.iter().map(|(_, p)| of(p)[axis]).collect());
            Some(Vector3::new(along(0)?, along(1)?, along(2)?))
        };
        let up = UnitVector3::try_new(middle_of(|plate| plate.up)?, 1e-6)?;
        let middle = Point3::from(middle_of(|plate| plate.centre.coords)?);
        let is_one = |plate: &FoundPlate| {
            plate.up.angle(&up) < TURNED_RAD && (plate.centre - middle).norm() < BESIDE_M
        };
        let centres: Vec<(usize, Point3)> =
            found.iter().filter(|(_, p)| is_one(p)).map(|(k, p)| (*k, p.centre)).collect();
        (2 * centres.len() > found.len()).then_some(Self { up, middle, centres })
    }

    /// Views' numbers and plates, of views all round until enough show one.
    fn found(views: &[SeenView], options: &ScanOptions) -> Vec<(usize, FoundPlate)> {
        let rounds = views.len().div_ceil(ASKED);
        let mut found = Vec::new();
        for round in 0..rounds {
            let asked: Vec<usize> = (round..views.len()).step_by(rounds).collect();
            let seen = |k: usize| Some((k, plate_of(&views[k].cloud.points, options)?));
            found.par_extend(asked.into_par_iter().filter_map(seen));
            if found.len() >= ENOUGH {
                break;
            }
        }
        found
    }

    /// Leaves those points of a view that may turn with the drape: near the axis.
    pub fn crop(&self, view: &mut SeenView, options: &ScanOptions) {
        let reach_m = REACH_SIDES * options.specimen_side_m;
        let turns = |p: &Point3| (p - self.middle).cross(&self.up).norm() < reach_m;
        view.cloud = view.cloud.part(turns);
    }

    /// Where the views begin, with the step that is said (either way round) or found.
    ///
    /// # Errors
    /// When no step, or several, make neighbouring views agree.
    pub fn begin(&self, register: &Register, said_rad: Option<f64>) -> Result<Begun, NoStep> {
        let count = register.count();
        if count < 2 {
            return Ok(Begun { poses: vec![Isometry3::identity(); count], step_rad: 0.0 });
        }
        let step_rad = self.step(register, said_rad).ok_or(NoStep)?;
        let turn = self.turn(step_rad);
        let each: Vec<Isometry3> =
            (1..count).into_par_iter().map(|k| followed(register, k, &turn).0).collect();
        let turns = each.iter().map(|turn| self.angle(turn)).collect();
        let mut poses = vec![Isometry3::identity()];
        poses.extend(each.iter().scan(Isometry3::identity(), |pose, turn| {
            *pose *= turn;
            Some(*pose)
        }));
        Ok(Begun { poses, step_rad: median(turns).unwrap_or(step_rad) })
    }

    /// The step with which neighbouring views lie best on one another.
    fn step(&self, register: &Register, said_rad: Option<f64>) -> Option<f64> {
        let count = register.count();
        let pairs = PAIRS.min(count - 1);
        let second = |k: usize| 1 + k * (count - 1) / pairs;
        let tried: Vec<f64> = match said_rad {
            Some(step_rad) => vec![step_rad, -step_rad],
            None => (-35..=36).filter(|k| *k != 0).map(|k| f64::from(k) * GRID_RAD).collect(),
        };
        let shared = |step_rad: &f64| -> f64 {
            let still = Isometry3::identity();
            let turn = self.turn(*step_rad);
            let of = |k: usize| register.some(&[k - 1, k]).shared(&[still, turn]);
            (0..pairs).map(|k| of(second(k))).sum()
        };
        let mut tried: Vec<(f64, f64)> =
            tried.into_par_iter().map(|step| (shared(&step), step)).collect();
        tried.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let ended = |&(_, step_rad): &(f64, f64)| -> Option<(f64, f64)> {
            let turn = self.turn(step_rad);
            let ends: Vec<(Isometry3, Placed)> =
                (0..pairs).map(|k| followed(register, second(k), &turn)).collect();
            let share = median(ends.iter().map(|(_, end)| end.after.shared).collect())?;
            let misfit_m = median(ends.iter().map(|(_, end)| end.after.misfit_m).collect())?;
            let step_rad = median(ends.iter().map(|(turn, _)| self.angle(turn)).collect())?;
            (share >= LEAST_SHARED && misfit_m.is_finite()).then_some((misfit_m, step_rad))
        };
        let mut ends: Vec<(f64, f64)> = tried.par_iter().take(FOLLOWED).filter_map(ended).collect();
        ends.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let &(best_m, step_rad) = ends.first()?;
        let other = |&(_, other_rad): &&(f64, f64)| turned(other_rad - step_rad).abs() > SAME_RAD;
        let rival = ends.iter().filter(other).any(|(misfit_m, _)| best_m > BETTER * misfit_m);
        (!rival).then_some(step_rad)
    }

    /// The frame of a view from that of the next, by a step.
    fn turn(&self, step_rad: f64) -> Isometry3 {
        let axis = Translation3::from(self.on_axis(step_rad).coords);
        axis * UnitQuaternion::from_axis_angle(&self.up, -step_rad) * axis.inverse()
    }

    /// A point of the axis, if the plates' centres go round it by this step: least squares, with the plate
    /// near the axis where the centres do not say.
    fn on_axis(&self, step_rad: f64) -> Point3 {
        // In the plane of the circle, as complex numbers: centre = c + e exp(i k step).
        let level = super::frames::level(&self.up);
        let beside = self.up.cross(&level);
        let (mut s_z, mut s_u, mut s_zu) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for (k, centre) in &self.centres {
            let off = centre - self.middle;
            let z = [off.dot(&level), off.dot(&beside)];
            let (sin, cos) = (*k as f64 * step_rad).sin_cos();
            s_z = [s_z[0] + z[0], s_z[1] + z[1]];
            s_u = [s_u[0] + cos, s_u[1] + sin];
            // The conjugate of the turn times the centre.
            s_zu = [s_zu[0] + cos * z[0] + sin * z[1], s_zu[1] + cos * z[1] - sin * z[0]];
        }
        let count = self.centres.len() as f64;
        let held = count + (CENTRE_SIGMA_M / OFF_AXIS_M).powi(2);
        // count c + s_u e = s_z, conj(s_u) c + held e = s_zu.
        let times =
            |a: [f64; 2], b: [f64; 2]| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
        let s_u_zu = times(s_u, s_zu);
        let below = count * held - (s_u[0] * s_u[0] + s_u[1] * s_u[1]);
        let c = [0, 1].map(|k| (held * s_z[k] - s_u_zu[k]) / below);
        self.middle + level.into_inner() * c[0] + beside * c[1]
    }

    /// The angle about the axis by which the drape turned \[rad\].
    fn angle(&self, turn: &Isometry3) -> f64 {
        -turn.rotation.scaled_axis().dot(&self.up)
    }
}

/// View `k` in the frame of the one before, from a turn on; and how it then lies.
fn followed(register: &Register, k: usize, turn: &Isometry3) -> (Isometry3, Placed) {
    let placed = register.some(&[k - 1, k]).placed(&[Isometry3::identity(), *turn]);
    let [before, own] = placed[..] else { unreachable!("two views were placed") };
    (before.pose.inverse() * own.pose, own)
}

/// An angle between minus and plus half a turn \[rad\].
fn turned(angle_rad: f64) -> f64 {
    let half = std::f64::consts::PI;
    (angle_rad + half).rem_euclid(2.0 * half) - half
}

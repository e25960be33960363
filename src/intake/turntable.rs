//! Views of a turntable: in order, without poses, the camera standing still.
//!
//! In: views in metres, each in its camera's frame; the step by which the drape turns from one to
//! the next, where it is said. Out: the views without what stands still around the drape, and for
//! each a pose in the first one's frame from which [`Register::settled`] continues.
//!
//! Each view's plate is found. Their normals are the axis' direction; their centres, which lie on a
//! circle if the plate stands beside the axis, give its place. Where the step is not said it is
//! looked for in steps of 5 degrees, either way round: the one is taken with which neighbouring
//! views lie best on one another. Then each view is brought to the one before.
//!
//! Where it fails: steps that differ by more than some 5 degrees, and drapes that look alike from
//! several sides.

use nalgebra::{Complex, Translation3, UnitQuaternion, UnitVector3};
use rayon::prelude::*;

use super::frames::{BETTER, SAME_RAD, level};
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
/// What lies so many sides of the specimen from the axis does not turn \[-\]: its corners lie at
/// 0.71.
const REACH_SIDES: f64 = 0.8;
/// So many views at a time are asked for their plate, until so many show one.
const ASKED: usize = 6;
const ENOUGH: usize = 4;
/// A plate is another thing whose normal is turned by so much from the middle one \[rad\], or whose
/// centre lies so far off \[m\].
const TURNED_RAD: f64 = 0.2;
const BESIDE_M: f64 = 60e-3;
/// Usual distance of a plate from the axis, and error of a view's centre \[m\].
const OFF_AXIS_M: f64 = 20e-3;
const CENTRE_SIGMA_M: f64 = 2e-3;

/// Why the views cannot be put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotFound {
    /// In no view the plate is seen, or in most of those that show one it is another thing.
    Plate,
    /// No step, or several, make neighbouring views agree.
    Step,
}

/// The plates as the camera sees them.
struct Plates {
    up: UnitVector3<f64>,
    /// The middle of the centres \[m\].
    middle: Point3,
    /// The view's number and its plate's centre \[m\].
    centres: Vec<(usize, Point3)>,
}

/// Where the views begin.
pub struct Begun {
    /// The views, to be placed from their poses on.
    pub register: Register,
    /// The first view's frame from each view's.
    pub poses: Vec<Isometry3>,
    /// By how much the drape turns from one view to the next, in the middle; positive
    /// counter-clockwise from above \[rad\].
    pub step_rad: f64,
}

/// Where the views begin, with the step that is said (either way round) or found. Leaves of each
/// what may turn with the drape.
///
/// # Errors
/// See [`NotFound`].
pub fn begin(
    views: &mut [SeenView],
    said_rad: Option<f64>,
    options: &ScanOptions,
) -> Result<Begun, NotFound> {
    let plates = Plates::of(views, options).ok_or(NotFound::Plate)?;
    views.iter_mut().for_each(|view| plates.crop(view, options));
    let register = Register::of(views);
    let count = views.len();
    if count < 2 {
        return Ok(Begun { register, poses: vec![Isometry3::identity(); count], step_rad: 0.0 });
    }
    let step_rad = plates.step(&register, count, said_rad).ok_or(NotFound::Step)?;
    let turn = plates.turn(step_rad);
    let followed = |k: usize| register.some(&[k - 1, k]).second(&turn).0;
    let each: Vec<Isometry3> = (1..count).into_par_iter().map(followed).collect();
    let turns = each.iter().map(|turn| plates.angle(turn)).collect();
    let mut poses = vec![Isometry3::identity()];
    poses.extend(each.iter().scan(Isometry3::identity(), |pose, turn| {
        *pose *= turn;
        Some(*pose)
    }));
    Ok(Begun { register, poses, step_rad: median(turns).unwrap_or(step_rad) })
}

impl Plates {
    /// The plates of the views, of which one is enough; `None` if none is seen, or most are
    /// elsewhere.
    fn of(views: &[SeenView], options: &ScanOptions) -> Option<Self> {
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
    fn crop(&self, view: &mut SeenView, options: &ScanOptions) {
        let reach_m = REACH_SIDES * options.specimen_side_m;
        let turns = |p: &Point3| (p - self.middle).cross(&self.up).norm() < reach_m;
        view.cloud = view.cloud.part(turns);
    }

    /// The step with which neighbouring views lie best on one another.
    fn step(&self, register: &Register, count: usize, said_rad: Option<f64>) -> Option<f64> {
        let pairs = PAIRS.min(count - 1);
        let second = |k: usize| 1 + k * (count - 1) / pairs;
        let tried: Vec<f64> = match said_rad {
            Some(step_rad) => vec![step_rad, -step_rad],
            None => {
                let half = (std::f64::consts::PI / GRID_RAD).round() as i32;
                let steps = (1 - half..=half).filter(|k| *k != 0);
                steps.map(|k| f64::from(k) * GRID_RAD).collect()
            }
        };
        let pairs: Vec<Register> =
            (0..pairs).map(|k| register.some(&[second(k) - 1, second(k)])).collect();
        let shared = |step_rad: &f64| -> f64 {
            let poses = [Isometry3::identity(), self.turn(*step_rad)];
            pairs.iter().map(|pair| pair.shared(&poses)).sum()
        };
        let mut tried: Vec<(f64, f64)> =
            tried.into_par_iter().map(|step| (shared(&step), step)).collect();
        tried.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let ended = |&(_, step_rad): &(f64, f64)| -> Option<(f64, f64)> {
            let turn = self.turn(step_rad);
            let ends: Vec<(Isometry3, Placed)> =
                pairs.iter().map(|pair| pair.second(&turn)).collect();
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

    /// A point of the axis, if the plates' centres go round it by this step: least squares, with
    /// the plate near the axis where the centres do not say.
    fn on_axis(&self, step_rad: f64) -> Point3 {
        // In the plane of the circle: centre = c + e exp(i k step).
        let across = level(&self.up);
        let beside = self.up.cross(&across);
        let [mut s_z, mut s_u, mut s_zu] = [Complex::<f64>::ZERO; 3];
        for (k, centre) in &self.centres {
            let off = centre - self.middle;
            let z = Complex::new(off.dot(&across), off.dot(&beside));
            let u = Complex::cis(*k as f64 * step_rad);
            (s_z, s_u, s_zu) = (s_z + z, s_u + u, s_zu + u.conj() * z);
        }
        let count = self.centres.len() as f64;
        let held = count + (CENTRE_SIGMA_M / OFF_AXIS_M).powi(2);
        // count c + s_u e = s_z, conj(s_u) c + held e = s_zu.
        let c = (s_z * held - s_u * s_zu) / (count * held - s_u.norm_sqr());
        self.middle + across.into_inner() * c.re + beside * c.im
    }

    /// The angle about the axis by which the drape turned \[rad\].
    fn angle(&self, turn: &Isometry3) -> f64 {
        -turn.rotation.scaled_axis().dot(&self.up)
    }
}

/// An angle between minus and plus half a turn \[rad\].
fn turned(angle_rad: f64) -> f64 {
    let half = std::f64::consts::PI;
    (angle_rad + half).rem_euclid(2.0 * half) - half
}

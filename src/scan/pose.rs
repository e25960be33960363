//! Which of the places in a scene is the drape: each is carried through the cheap first part of
//! the path, on a coarse cloth, and judged by what only the experiment has.
//!
//! In: points of the scene \[m\], any frame. Out: the plate under the likeliest drape, how likely
//! it is, and the next one.
//!
//! A drape is a nearly isometric image of a square of known side, centred on a disc from which it
//! hangs. So the cloth at each place is cut free and flattened from the disc outwards, and the
//! outline of what comes of it is held against that square. On each bearing it ends at the
//! square's side, within sigma; or short of it, where the cloth is hidden; or beyond it, which
//! cloth never does. With the chance of each, and of what ends anywhere, the outline has a
//! log-likelihood ratio of a drape against anything. Neighbouring bearings err together, so that
//! some count as one. What lies off the disc's centre costs as a normal deviate.
//!
//! Tables and walls go on beyond the square, boxes and cups end short of it, a fold's back has the
//! specimen's middle far from its own. Tried and dropped: limits on the share of the disc's edge
//! from which a surface falls, on its roundness and its radius. Each was set on scenes of one
//! virtual bench, and a box or a fold's back passed.

use rayon::prelude::*;

use super::cloth::{self, Cloth};
use super::error::ScanError;
use super::frame::{self, LocalFrame};
use super::options::ScanOptions;
use super::plate::{self, Place, Plate};
use super::square::{self, Ends};
use super::unit::LengthUnit;
use super::parameterisation::{self, Parameterisation};
use super::{fit, origin};
use crate::base::clock::Stages;
use crate::base::{Isometry3, Point3, Vector3};

/// The drape in a scene.
pub(super) struct Pose {
    /// The plate under it.
    pub plate: Plate,
    /// How likely it is.
    pub fit: PoseFit,
    /// How likely the next place is, if another was looked at \[nats\].
    pub next_nats: Option<f64>,
    /// The plate of another drape in the scene.
    pub another: Option<Plate>,
}

/// How well the flattened surface at a place is the specimen.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseFit {
    /// Where it ends.
    pub ends: Ends,
    /// Offset of its middle from the disc's \[m\].
    pub off_m: f64,
    /// Log-likelihood ratio of a drape against anything \[nats\].
    pub nats: f64,
}

/// A place that was verified.
struct Verified {
    place: Place,
    fit: PoseFit,
}

/// Finds the drape.
pub(super) fn find(
    points: &[Point3],
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<Pose, ScanError> {
    let tuning = &options.tuning.pose;
    let stride = points.len().div_ceil(tuning.most_points).max(1);
    let some: Vec<Point3> = points.iter().step_by(stride).copied().collect();
    let places = plate::places(points, options);
    let mut verified: Vec<Verified> = places
        .into_par_iter()
        .map(|place| Verified { fit: verify(&some, &place, options), place })
        .collect();
    if std::env::var("POSE").is_ok() {
        for v in &verified {
            println!(
                "    {:?} up {:?} {:?} r {:.1} round {:.2} | {:?} off {:.1} nats {:.1}",
                v.place.plate.centre.coords.map(|c| (c * 1e3).round()).as_slice(),
                v.place.plate.up.map(|c| (c * 100.0).round() / 100.0).as_slice(),
                v.place.evidence, v.place.plate.radius_m * 1e3, v.place.plate.round, v.fit.ends, v.fit.off_m * 1e3, v.fit.nats
            );
        }
    }
    verified.sort_by(|a, b| b.fit.nats.total_cmp(&a.fit.nats));
    let mut verified = verified.into_iter();
    let Some(best) = verified.next() else {
        return Err(ScanError::NoPlate { best: None, radius_m: options.plate_radius_m, falling_limit: 0.35, unit });
    };
    let next_nats = verified.next().map(|next| next.fit.nats);
    let Place { plate, .. } = best.place;
    let plate = centred(points, &some, &plate, options).unwrap_or(plate);
    Ok(Pose { plate, fit: best.fit, next_nats, another: None })
}

/// A flattened cloth, coarse, and the frame that it is in.
struct Flattened {
    local_from_scan: Isometry3,
    cloth: Cloth,
    surface: Parameterisation,
}

/// Flattens what lies at a place.
fn flatten(points: &[Point3], plate: &Plate, options: &ScanOptions) -> Flattened {
    let mut coarse = options.clone();
    coarse.tuning.cloth.cell_m = options.tuning.pose.cell_m;
    let LocalFrame { local_from_scan, floor } = frame::find(points, plate, &coarse);
    let local: Vec<Point3> = points.iter().map(|p| local_from_scan * p).collect();
    let cloth = cloth::isolate(&local, floor, plate, &coarse, &mut Stages::off());
    let mut surface = parameterisation::grow(&cloth, &coarse);
    parameterisation::relax(&mut surface, cloth.spacing_m, &coarse);
    Flattened { local_from_scan, cloth, surface }
}

/// The plate with the axis that a sheet through the coarse cloth bends over: noise and the gentle
/// bend of stiff cloth move the circle of raw points by up to 10 mm. `None` if there is no sheet.
fn centred(
    points: &[Point3],
    some: &[Point3],
    plate: &Plate,
    options: &ScanOptions,
) -> Option<Plate> {
    let mut plate = plate.clone();
    for _ in 0..2 {
        let Flattened { local_from_scan, cloth, mut surface } = flatten(some, &plate, options);
        let square = parameterisation::straighten(&mut surface, cloth.spacing_m, options).ok()?;
        let sheet = fit::fit_sheet(&surface, &square, plate.noise_m, options)?.sheet;
        let origin = origin::find(&sheet, &square, options)?;
        let [x, z] = origin.axis;
        if std::env::var("POSE").is_ok() {
            println!("    centred by {:.2} {:.2} sigma {:.2}, square off {:.1} {:.1}", x * 1e3, z * 1e3, origin.axis_sigma_m * 1e3, square.centre[0] * 1e3, square.centre[1] * 1e3);
        }
        plate.centre += local_from_scan.inverse_transform_vector(&Vector3::new(x, 0.0, z));
        plate.centre_sigma_m = origin.axis_sigma_m;
        plate::level(points, &mut plate, options);
    }
    Some(plate)
}

/// Flattens what lies at a place and holds it against the specimen.
fn verify(points: &[Point3], place: &Place, options: &ScanOptions) -> PoseFit {
    let tuning = &options.tuning.pose;
    let Flattened { surface, .. } = flatten(points, &place.plate, options);
    let (square, ends) = square::ends(&surface.flat, options.specimen_side_m, &options.tuning.square, tuning);
    let off_m = square.centre[0].hypot(square.centre[1]);
    let nats = ends.nats(tuning) - 0.5 * (off_m / tuning.off_sigma_m).powi(2);
    PoseFit { ends, off_m, nats }
}

//! Which of the places in a scene is the drape: each is carried through the first, cheap part of
//! the path on a coarse cloth and judged by what only the experiment has.
//!
//! In: points of the scene \[m\], any frame. Out: the plate under the likeliest drape, how likely
//! it is, the next place, and the plate of another drape.
//!
//! A drape is a nearly isometric image of a square of known side, whose middle lies on a disc from
//! which it hangs. So the cloth at each place is cut free and flattened from the disc outwards, and
//! the outline of what comes of it is held against that square. On each bearing it ends at the
//! square's side, within sigma; or short of it, where cloth is hidden, on a share of the bearings
//! that is not known; or beyond it, which cloth hardly does. So the outline has a log-likelihood
//! ratio of a specimen against anything. Neighbouring bearings err together, so that some count as
//! one. A middle that lies off the disc's counts as a normal deviate. A little beyond the disc a
//! drape hangs wherever it is seen, while a board or a table's corner is level.
//!
//! Tables and walls continue beyond the square, boxes and cups end short of it, and from the back
//! of a fold the specimen's middle is far. Tried and dropped: limits, before anything is flattened,
//! on the share of the disc's edge from which a surface falls, on its roundness and its radius.
//! Each was set on scenes of one virtual bench; boxes and folds of others passed them.
//!
//! Fails where the flat disc itself is not seen, from any side.

use nalgebra::UnitVector3;
use rayon::prelude::*;

use super::cloth;
use super::error::{NoDrape, PlateCandidate, ScanError};
use super::frame::{self, LocalFrame};
use super::hints::Hints;
use super::options::ScanOptions;
use super::parameterisation::{self, Parameterisation};
use super::plate::{self, Candidate, Placed, Plate};
use super::square::{self, Ends};
use super::unit::LengthUnit;
use super::{fit, limits, origin};
use crate::base::clock::Stages;
use crate::base::{Isometry3, Point3, Vector3};
use crate::numeric::robust;

/// The drape in a scene.
pub(super) struct Pose {
    /// The plate under it.
    pub plate: Plate,
    /// How likely it is a drape: log-likelihood ratio against anything \[nats\].
    pub nats: f64,
    /// By how much less likely the next place is \[nats\]; `None` if there is no other.
    pub ahead_nats: Option<f64>,
    /// The plate of another drape in the scene.
    pub another: Option<Plate>,
    /// Side of the square that the cloth makes, roughly \[m\].
    pub side_m: f64,
    /// The place as a refusal shows it, where it is hardly likelier a drape than anything else.
    pub unlikely: Option<PlateCandidate>,
}

/// A place that was verified.
struct Verified {
    plate: Plate,
    /// The specimen's middle, about.
    middle: Point3,
    /// What lies there, flattened.
    flattened: Flattened,
    /// Where the flattened surface there ends.
    ends: Ends,
    /// Share of the bearings on which something is seen a little beyond the disc.
    around: f64,
    /// Log-likelihood ratio of a drape against anything \[nats\].
    nats: f64,
}

/// Finds the drape; where nothing is surely one, also among patches that are less flat: noise adds
/// to the arch of stiff cloth.
///
/// # Errors
/// When nothing in the scene is likelier a drape than anything else.
pub(super) fn find(
    points: &[Point3],
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<Pose, ScanError> {
    let is_sure = |found: &Result<Pose, ScanError>| {
        found.as_ref().is_ok_and(|pose| pose.nats > options.tuning.pose.sure_nats)
    };
    let first = find_among_flat(points, unit, options);
    if is_sure(&first) {
        return first;
    }
    let mut less_flat = options.clone();
    less_flat.tuning.plate.flat_rms_m = options.tuning.pose.less_flat_rms_m;
    let second = find_among_flat(points, unit, &less_flat);
    let is_only = first.is_err() && second.is_ok();
    if is_only || is_sure(&second) { second } else { first }
}

/// Finds the drape among the patches that are flat.
fn find_among_flat(
    points: &[Point3],
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<Pose, ScanError> {
    let refuse = |why| Err(ScanError::NoPlate { why, radius_m: options.plate_radius_m, unit });
    let (hints, tuning) = (Hints::of(options, unit), &options.tuning.pose);
    let sought = plate::candidates(points, &hints, options);
    let verify = |candidate: &Candidate| {
        let plate = plate::measure(points, candidate, &hints, options)?;
        Some(verify(points, plate, options))
    };
    let mut verified: Vec<Verified> = Vec::new();
    let mut later = sought.candidates.as_slice();
    while !later.is_empty() && !verified.iter().any(|place| place.nats > tuning.enough_nats) {
        let (some, rest) = later.split_at(tuning.at_once.min(later.len()));
        verified.par_extend(some.par_iter().filter_map(verify));
        later = rest;
    }
    let Some(best) = likeliest(&verified) else {
        return refuse(limits::no_place(&sought, options));
    };
    // Beside the likeliest there may be another drape.
    let beside = |place: &&Candidate| verified[best].is_beside(&place.centre, options);
    let beside: Vec<&Candidate> = later.iter().filter(beside).take(tuning.most_beside).collect();
    verified.par_extend(beside.into_par_iter().filter_map(verify));
    let first = verified[0].candidate();
    verified.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    let mut verified = verified.into_iter();
    let Some(best) = verified.next().filter(|best| best.nats > tuning.least_nats) else {
        return refuse(NoDrape::NotTheSpecimen(first));
    };
    let others: Vec<Verified> =
        verified.filter(|other| !best.is_of_the_same_disc(other, options)).collect();
    let ahead_nats = others.first().map(|next| best.nats - next.nats);
    let is_drape = |other: &Verified| other.nats > tuning.least_another_nats;
    let is_another =
        |other: &Verified| is_drape(other) && best.is_beside(&other.plate.centre, options);
    let another = others.into_iter().find(is_another).map(|other| other.plate);
    let (nats, side_m) = (best.nats, best.ends.side_m);
    let unlikely = (nats <= tuning.sure_nats).then(|| best.candidate());
    let rough = best.plate.clone();
    let plate = centred(points, best, options).unwrap_or(rough);
    Ok(Pose { plate, nats, ahead_nats, another, side_m, unlikely })
}

impl Pose {
    /// Whether the cloth is as large as a specimen may be that was cut wrongly. Something square
    /// can be found in one of many units.
    pub fn is_of_size(&self, options: &ScanOptions) -> bool {
        let share = self.side_m / options.specimen_side_m;
        (share - 1.0).abs() < options.tuning.pose.cut_wrongly
    }
}

/// The number of the place that is likeliest a drape.
fn likeliest(verified: &[Verified]) -> Option<usize> {
    (0..verified.len()).max_by(|&a, &b| verified[a].nats.total_cmp(&verified[b].nats))
}

impl Verified {
    /// Whether both places are on the same plate.
    fn is_of_the_same_disc(&self, other: &Self, options: &ScanOptions) -> bool {
        let apart_m = (self.plate.centre - other.plate.centre).norm();
        apart_m < options.plate_radius_m && self.plate.up.dot(&other.plate.up) > 0.9
    }

    /// Whether a plate with this centre is so far beside this one that it is not under the same
    /// cloth.
    fn is_beside(&self, centre: &Point3, options: &ScanOptions) -> bool {
        let apart = centre - self.plate.centre;
        let up = self.plate.up.into_inner();
        let level_m = (apart - up * apart.dot(&up)).norm();
        level_m > options.tuning.pose.apart_sides * options.specimen_side_m
    }

    /// The place, as a refusal shows it.
    fn candidate(&self) -> PlateCandidate {
        let Self { plate, ends, .. } = self;
        PlateCandidate {
            radius_m: plate.radius_m,
            centre: plate.centre,
            up: plate.up.into_inner(),
            short: ends.short_share,
            beyond: ends.beyond_share,
            around: self.around,
        }
    }
}

/// Flattens what lies at a place and holds it against the specimen.
fn verify(points: &[Point3], plate: Plate, options: &ScanOptions) -> Verified {
    let tuning = &options.tuning.pose;
    let flattened = flatten(points, &plate, options);
    let (square, ends) = square::ends(&flattened.surface.flat, options);
    let off_m = square.centre[0].hypot(square.centre[1]);
    let surface = &flattened.surface;
    let placed =
        surface.flat.iter().zip(&surface.points).map(|(&xz_m, p)| Placed { xz_m, height_m: p.y });
    let overhang = Overhang::of(placed, options);
    let nats = ends.nats + overhang.nats - 0.5 * (off_m / tuning.off_sigma_m).powi(2);
    let [x, z] = square.centre;
    let off = flattened.local_from_scan.inverse_transform_vector(&Vector3::new(x, 0.0, z));
    Verified { middle: plate.centre + off, plate, flattened, ends, around: overhang.around, nats }
}

/// What is seen where the cloth hangs over the disc's edge.
struct Overhang {
    /// Share of the bearings on which something is.
    around: f64,
    /// Log-likelihood ratio of a drape against anything, by whether that has fallen \[nats\].
    nats: f64,
}

impl Overhang {
    /// Of points by their place on the flattened cloth and their height.
    fn of(cloth: impl Iterator<Item = Placed>, options: &ScanOptions) -> Self {
        let tuning = &options.tuning.pose;
        let [near_m, far_m] = tuning.fallen_beyond_m.map(|m| options.plate_radius_m + m);
        let mut heights_m = vec![Vec::new(); options.tuning.plate.bearings];
        for placed in cloth.filter(|p| (near_m..far_m).contains(&p.radius_m())) {
            heights_m[placed.sector(options.tuning.plate.bearings)].push(placed.height_m);
        }
        let nats = |height_m: &f64| {
            let is_level = *height_m > -tuning.fallen_m;
            let [drape, anything] = [tuning.level_drape, tuning.level_anything]
                .map(|level| if is_level { level } else { 1.0 - level });
            (drape / anything).ln()
        };
        let bearings = heights_m.len() as f64;
        let seen: Vec<f64> = heights_m.into_iter().filter_map(robust::median).collect();
        Self {
            around: seen.len() as f64 / bearings,
            nats: tuning.bearings * seen.iter().map(nats).sum::<f64>() / bearings,
        }
    }
}

/// A coarse cloth, flattened, and the frame that it is in.
struct Flattened {
    local_from_scan: Isometry3,
    /// The floor's normal in the scan's frame, if a floor is seen.
    floor_up: Option<Vector3>,
    surface: Parameterisation,
}

/// Flattens what lies at a place.
fn flatten(points: &[Point3], plate: &Plate, options: &ScanOptions) -> Flattened {
    let mut coarse = options.clone();
    coarse.tuning.cloth.cell_m = options.tuning.pose.cell_m;
    coarse.tuning.cloth.apart_cells = options.tuning.pose.apart_cells;
    let LocalFrame { local_from_scan, floor } = frame::find(points, plate, &coarse);
    let reach_m = options.tuning.plate.around_sides * options.specimen_side_m;
    let near = |p: &&Point3| (*p - plate.centre).norm_squared() < reach_m.powi(2);
    let mut local: Vec<Point3> = points.par_iter().filter(near).copied().collect();
    let stride = local.len().div_ceil(options.tuning.pose.most_points).max(1);
    local = local.iter().step_by(stride).map(|p| local_from_scan * p).collect();
    let cloth = cloth::isolate(&local, floor, plate, &coarse, &mut Stages::off());
    let mut surface = parameterisation::grow(&cloth, &coarse);
    parameterisation::relax(&mut surface, cloth.spacing_m, &coarse);
    let floor_up = floor.map(|floor| local_from_scan.inverse_transform_vector(&floor.normal));
    Flattened { local_from_scan, floor_up, surface }
}

/// The plate about the axis that a sheet through the coarse cloth bends over: noise, and the gentle
/// bend of stiff cloth, move the circle through raw points by up to 10 mm. `None` if too little of
/// a sheet is seen.
///
/// Stiff cloth is level about more than one place of its arch. So where no such axis is found, or
/// the floor is not parallel to the plate, the plate is also looked for from the specimen's middle
/// and the floor's level on, and the likelier one is taken.
fn centred(points: &[Point3], found: Verified, options: &ScanOptions) -> Option<Plate> {
    let Verified { plate, middle, flattened, .. } = found;
    let floor_up = flattened.floor_up;
    let own = Centred::of(points, plate.clone(), flattened, options);
    let is_tilted = own.as_ref().is_none_or(|own| own.is_tilted(options));
    let Some(floor_up) = floor_up.filter(|_| is_tilted) else { return Some(own?.plate) };
    let start = Plate { centre: middle, up: UnitVector3::new_normalize(floor_up), ..plate };
    let flattened = flatten(points, &start, options);
    let level = Centred::of(points, start, flattened, options);
    let both = own.into_iter().chain(level);
    let likelier = both.min_by(|a, b| a.deviates(options).total_cmp(&b.deviates(options)));
    Some(likelier?.plate)
}

/// A plate about the axis that a sheet bends over.
struct Centred {
    plate: Plate,
    /// How far the specimen's middle lies off the plate's axis \[m\].
    off_m: f64,
    /// The floor's normal in the scan's frame, if a floor is seen.
    floor_up: Option<Vector3>,
}

impl Centred {
    /// From a plate and the cloth flattened about it.
    fn of(
        points: &[Point3],
        mut plate: Plate,
        mut flattened: Flattened,
        options: &ScanOptions,
    ) -> Option<Self> {
        let tuning = &options.tuning.pose;
        let mut rounds = 0;
        loop {
            let Flattened { local_from_scan, floor_up, surface } = &flattened;
            let fit = square::find(&surface.flat, options.specimen_side_m, &options.tuning.square);
            limits::square(&fit, options).ok()?;
            let sheet = fit::fit_sheet(surface, &fit.square, plate.noise_m, options)?.sheet;
            let origin = origin::find(&sheet, &fit.square, options)?;
            let [x, z] = origin.axis;
            plate.centre += local_from_scan.inverse_transform_vector(&Vector3::new(x, 0.0, z));
            plate::level(points, &mut plate, options);
            (plate.radius_m, plate.radius_scatter_m) = (origin.radius_m, origin.radius_scatter_m);
            plate.from_sheet = true;
            rounds += 1;
            if x.hypot(z) < tuning.centred_m || rounds == tuning.centrings {
                let middle = sheet.at([0.0; 2]);
                return Some(Self {
                    plate,
                    off_m: (middle.x - x).hypot(middle.z - z),
                    floor_up: *floor_up,
                });
            }
            flattened = flatten(points, &plate, options);
        }
    }

    /// Angle between floor and plate \[rad\]; 0 where no floor is seen.
    fn tilt_rad(&self) -> f64 {
        self.floor_up.map_or(0.0, |floor_up| self.plate.up.angle(&floor_up))
    }

    fn is_tilted(&self, options: &ScanOptions) -> bool {
        self.tilt_rad() > options.tuning.pose.level_sigma_rad
    }

    /// Squares of the deviates by which the specimen is off centre and the plate off level.
    fn deviates(&self, options: &ScanOptions) -> f64 {
        let tuning = &options.tuning.pose;
        let squared = |deviate: f64| deviate * deviate;
        squared(self.off_m / tuning.off_sigma_m) + squared(self.tilt_rad() / tuning.level_sigma_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_on_level_beyond_the_disc_is_no_drape_and_what_is_not_seen_says_nothing() {
        let options = ScanOptions::default();
        let overhang = |slope: f64, half_only: bool| {
            let at = |k: usize| (f64::from(k as u32) * 2.4, 0.1 * (k % 100) as f64 / 100.0);
            let place = |(turn, r): (f64, f64)| Placed {
                xz_m: [r * turn.cos(), r * turn.sin()],
                height_m: -slope * (r - options.plate_radius_m).max(0.0),
            };
            let seen = |p: &Placed| !half_only || p.xz_m[0] > 0.0;
            Overhang::of((0..20_000).map(at).map(place).filter(seen), &options)
        };
        let (whole, half) = (overhang(0.5, false), overhang(0.5, true));
        assert!(whole.around == 1.0 && (half.around - 0.5).abs() < 0.1, "{}", half.around);
        assert!(whole.nats > 0.0 && (half.nats / whole.nats - 0.5).abs() < 0.1, "{}", half.nats);
        assert!(overhang(0.05, false).nats < -20.0 && overhang(0.05, true).nats < -10.0);
        let nothing = Overhang::of(std::iter::empty(), &options);
        assert_eq!([nothing.around, nothing.nats], [0.0; 2]);
    }
}

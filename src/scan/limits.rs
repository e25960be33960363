//! Limits and refusals: the one place where what was measured is held against what is
//! accepted. (The plate's search refuses in `plate`.)
//!
//! In: figures of the stages and the caller's options. Out: nothing, or a [`ScanError`]
//! that says what was measured, the limit, the place and the remedy.

use super::coordinate_step::coordinate_step;
use super::error::{NoDrape, PlateCandidate, ScanError, SizeReading};
use super::measured::{MarkedSide, Marking, MeasuredSize, Misfit, Scatter};
use super::options::ScanOptions;
use super::plate::{Plate, Sought};
use super::rim::{Rim, bearing_deg, longest_gap};
use super::square::SquareFit;
use super::tuning::LimitTuning;
use super::uncertainty::Unexplained;
use super::underside::Cut;
use super::unit::LengthUnit;
use super::unit_guess::Guess;
use crate::base::Point3;
use crate::base::boundary::{POINTS_PER_SIDE, SIDES};
use crate::numeric::robust;

/// The refusal of a scan whose points do not carry a rim.
pub(super) fn too_few_points(points: usize, options: &ScanOptions) -> ScanError {
    ScanError::TooFewPoints { points, limit: options.tuning.limits.min_points }
}

/// Refuses a scan of too few points.
pub(super) fn enough_points(points: usize, options: &ScanOptions) -> Result<(), ScanError> {
    let enough = points >= options.tuning.limits.min_points;
    if enough { Ok(()) } else { Err(too_few_points(points, options)) }
}

/// The guessed units, if the scene has the size of one with a drape in any.
pub(super) fn units(guess: Guess, options: &ScanOptions) -> Result<Vec<LengthUnit>, ScanError> {
    if !guess.units.is_empty() {
        return Ok(guess.units);
    }
    Err(ScanError::Size {
        measured_units: guess.size_units,
        smallest_m: options.tuning.scene.smallest_m,
        largest_m: options.tuning.scene.largest_m,
    })
}

/// Why there is no place for a drape in a scene in which this was found.
pub(super) fn no_place(sought: &Sought, options: &ScanOptions) -> NoDrape {
    /// A scan of which one plane is as much shows a board.
    const MOSTLY: f64 = 0.5;
    if sought.wide_share >= options.tuning.pose.only_wide {
        NoDrape::WidePlanes { percent: 100.0 * sought.wide_share }
    } else if sought.candidates.is_empty() && sought.plane_share < MOSTLY {
        NoDrape::NoPatch
    } else {
        NoDrape::NothingFalls
    }
}

/// Refuses a plate of another radius, where a sheet has shown it.
pub(super) fn plate(
    plate: &Plate,
    unit: LengthUnit,
    options: &ScanOptions,
) -> Result<(), ScanError> {
    let (tuning, expected_m) = (&options.tuning.plate, options.plate_radius_m);
    let (bearings, radius_m) = (tuning.bearings, plate.radius_m);
    if !plate.from_sheet {
        return Ok(());
    }
    // Where stiff cloth falls away slowly, noise hides the edge: its scatter counts.
    let sigma_m = plate.radius_scatter_m / (bearings as f64 / 4.0).sqrt();
    if (radius_m - expected_m).abs() > tuning.radius_tolerance * expected_m + 2.0 * sigma_m {
        let (centre, up) = (plate.centre, plate.up.into_inner());
        let candidate =
            PlateCandidate { radius_m, centre, up, short: 0.0, beyond: 0.0, around: 1.0 };
        let why = NoDrape::OtherRadius(candidate);
        return Err(ScanError::NoPlate { why, radius_m: expected_m, unit });
    }
    Ok(())
}

/// Refuses a scan that shows another drape beside the first.
pub(super) fn one_drape(
    plate: &Plate,
    another: Option<&Plate>,
    unit: LengthUnit,
) -> Result<(), ScanError> {
    let Some(another) = another else { return Ok(()) };
    let apart_mm = (plate.centre - another.centre).norm() * 1e3;
    let centres = [plate, another].map(|plate| (plate.centre / unit.metres()).coords.into());
    Err(ScanError::SeveralDrapes { apart_mm, centres, unit })
}

/// Refuses a flattened cloth whose sides are clearly not the specimen's. Chords make a mesh
/// of long edges read shorter.
pub(super) fn size(
    measured: &MeasuredSize,
    mesh_edge_m: Option<f64>,
    options: &ScanOptions,
) -> Result<(), ScanError> {
    let [shortest, longest] = options.tuning.limits.sides;
    let edge_radii = mesh_edge_m.unwrap_or(0.0) / options.tuning.scene.fold_radius_m;
    let shortest = shortest * (1.0 - edge_radii * edge_radii / 24.0).max(0.0);
    wrong_size(measured, [shortest, longest], options).map_or(Ok(()), Err)
}

/// The refusal of a size outside of these shares of the specimen's; says whether the plate
/// makes the scale or the specimen the likelier reason.
fn wrong_size(
    measured: &MeasuredSize,
    [shortest, longest]: [f64; 2],
    options: &ScanOptions,
) -> Option<ScanError> {
    let MeasuredSize { side_m, plate_radius_m, noise_m } = *measured;
    let side = side_m / options.specimen_side_m;
    let longest = longest + options.tuning.limits.size_noises * noise_m / options.specimen_side_m;
    if (shortest..=longest).contains(&side) {
        return None;
    }
    let plate = plate_radius_m / (options.tuning.limits.plate_reads * options.plate_radius_m);
    // Nearer to the sides' scale than to its own size?
    let reading = if (plate - side).abs() < (plate - 1.0).abs() {
        SizeReading::Scale
    } else {
        SizeReading::Specimen
    };
    Some(ScanError::WrongSize {
        side_mm: side_m * 1e3,
        expected_side_mm: options.specimen_side_m * 1e3,
        least_mm: shortest * options.specimen_side_m * 1e3,
        most_mm: longest * options.specimen_side_m * 1e3,
        plate_mm: plate_radius_m * 1e3,
        expected_plate_mm: options.plate_radius_m * 1e3,
        reading,
    })
}

/// A refusal of what is hardly likelier a drape than anything else and is found to be none: there
/// is no drape. Half a drape is hardly likelier either: a rim that is not seen stays the reason,
/// unless the surface is seen all round the plate, so that nothing hides what ends before its rim.
pub(super) fn no_drape(
    error: ScanError,
    unlikely: Option<&PlateCandidate>,
    unit: Option<LengthUnit>,
    options: &ScanOptions,
) -> ScanError {
    let is_none = |place: &PlateCandidate| match error {
        ScanError::WrongSize { .. }
        | ScanError::Unexplained { .. }
        | ScanError::Misfit { .. }
        | ScanError::PassesApart { .. }
        | ScanError::TooNoisy { .. } => true,
        ScanError::HiddenRim { .. } => place.around > options.tuning.limits.all_round,
        _ => false,
    };
    match (unlikely, unit) {
        (Some(place), Some(unit)) if is_none(place) => {
            let why = NoDrape::NotTheSpecimen(place.clone());
            ScanError::NoPlate { why, radius_m: options.plate_radius_m, unit }
        }
        _ => error,
    }
}

/// What lies under a refusal: points too far apart, or a size that is likely to be wrong,
/// rather than the cloth or the rim that is not seen because of it.
pub(super) fn underlying(
    error: ScanError,
    spacing_m: Option<f64>,
    measured: Option<&MeasuredSize>,
    options: &ScanOptions,
) -> ScanError {
    let tuning = &options.tuning.limits;
    let (unseen, unfit) = match &error {
        // A table of sparse points is no drape for other reasons.
        ScanError::NoPlate {
            why: NoDrape::WidePlanes { .. } | NoDrape::OtherRadius(_), ..
        } => (false, false),
        ScanError::NoPlate { .. } => (true, false),
        ScanError::NotASquare { .. }
        | ScanError::HiddenRim { .. }
        | ScanError::TooLittleRim { .. }
        | ScanError::Gap { .. }
        | ScanError::Unexplained { .. }
        | ScanError::Misfit { .. }
        | ScanError::PassesApart { .. }
        | ScanError::TooNoisy { .. } => (true, true),
        ScanError::SideLength { .. } | ScanError::UnevenSides { .. } => (false, true),
        ScanError::WrongSize { side_mm, expected_side_mm, .. } => {
            let share = side_mm / expected_side_mm;
            ((tuning.sparse_reads..1.0).contains(&share), false)
        }
        _ => (false, false),
    };
    if let Some(spacing_m) = spacing_m.filter(|m| unseen && *m > tuning.sparse_m) {
        let (spacing_mm, needed_mm) = (spacing_m * 1e3, tuning.needed_m * 1e3);
        let likelier = likelier(spacing_m, tuning, options.unit);
        return ScanError::TooSparse { spacing_mm, likelier, needed_mm, cause: Box::new(error) };
    }
    let measured = measured.filter(|_| unfit);
    measured.and_then(|m| wrong_size(m, tuning.likely_sides, options)).unwrap_or(error)
}

/// The unit that was given, and the first in which points lie as far apart as those of scanners do.
fn likelier(
    spacing_m: f64,
    tuning: &LimitTuning,
    given: Option<LengthUnit>,
) -> Option<[LengthUnit; 2]> {
    /// Points nearer than this are no scanner's \[m\].
    const NEAREST_M: f64 = 1e-4;
    let given = given?;
    let there_m = |other: &LengthUnit| spacing_m * other.metres() / given.metres();
    let scanned = |other: &LengthUnit| (NEAREST_M..=tuning.needed_m).contains(&there_m(other));
    LengthUnit::ALL.into_iter().find(scanned).map(|other| [given, other])
}

/// A refusal, or the coarse coordinates of the scene from which it follows.
pub(super) fn coarse(
    error: ScanError,
    scene: &[Point3],
    unit: Option<LengthUnit>,
    options: &ScanOptions,
) -> ScanError {
    /// Steps to a scene of unknown unit, fewer than which are coarse.
    const LEAST_STEPS: f64 = 200.0;
    let Some(step) = coordinate_step(scene) else { return error };
    let step = match (&error, unit) {
        (ScanError::Size { measured_units, .. }, _) => {
            (LEAST_STEPS * step > *measured_units).then(|| format!("{step:.3} file units"))
        }
        (ScanError::SeveralDrapes { .. } | ScanError::NoColors | ScanError::NoMark { .. }, _) => {
            None
        }
        (ScanError::NoPlate { unit, .. }, None) => in_mm(step * unit.metres(), options),
        (_, None) => None,
        (_, Some(_)) => in_mm(step, options),
    };
    match step {
        Some(step) => ScanError::TooCoarse { step, cause: Box::new(error) },
        None => error,
    }
}

/// A step of coordinates in mm, if it is a coarse one.
fn in_mm(step_m: f64, options: &ScanOptions) -> Option<String> {
    let coarse = step_m > options.tuning.limits.coarse_step_m;
    coarse.then(|| format!("{} mm", (step_m * 1e4).round() / 10.0))
}

/// Refuses a cut of a closed mesh that has found no crease.
pub(super) fn crease(cut: &Cut, options: &ScanOptions) -> Result<(), ScanError> {
    let tuning = &options.tuning.underside;
    if cut.length_m > tuning.whole_cut_m && cut.crease_rad < tuning.min_crease_rad {
        return Err(ScanError::NoCrease {
            crease_deg: cut.crease_rad.to_degrees(),
            limit_deg: tuning.min_crease_rad.to_degrees(),
        });
    }
    Ok(())
}

/// Refuses a cut of a closed mesh that follows too little of the rim: `own_edge_share`
/// of it is an edge of the mesh that is left.
pub(super) fn edge_of_cut(own_edge_share: f64, options: &ScanOptions) -> Result<(), ScanError> {
    let min_clear = options.tuning.limits.min_clear;
    if own_edge_share >= min_clear {
        return Ok(());
    }
    Err(ScanError::HiddenCrease {
        clear_percent: 100.0 * own_edge_share,
        limit_percent: 100.0 * min_clear,
    })
}

/// Refuses a parameterised cloth that is no square of the specimen's size.
pub(super) fn square(fit: &SquareFit, options: &ScanOptions) -> Result<(), ScanError> {
    let tuning = &options.tuning.limits;
    if fit.on_share >= tuning.min_on_square {
        return Ok(());
    }
    if fit.hidden.share > tuning.most_hidden {
        return Err(ScanError::HiddenRim {
            hidden_percent: fit.hidden.share * 100.0,
            limit_percent: tuning.most_hidden * 100.0,
            arc_deg: fit.hidden.arc_deg,
            bearing_deg: fit.hidden.bearing_deg,
        });
    }
    Err(ScanError::NotASquare {
        side_mm: options.specimen_side_m * 1e3,
        rms_mm: fit.rms_m * 1e3,
        limit_mm: options.tuning.square.bound_m * 1e3,
        bearing_deg: fit.worst_bearing_deg,
    })
}

/// The bearing of the side that a mark tells \[degrees\].
pub(super) fn mark(marking: Marking, options: &ScanOptions) -> Result<f64, ScanError> {
    let tuning = &options.tuning.limits;
    let MarkedSide { points, share, off_deg, middle_bearing_deg, side_bearing_deg } = match marking
    {
        Marking::NoColors => return Err(ScanError::NoColors),
        Marking::LikeCloth { cloth_percent } => {
            return Err(ScanError::MarkLikeCloth { cloth_percent });
        }
        Marking::Side(side) => side,
    };
    if points < tuning.least_mark_points {
        return Err(ScanError::NoMark { points, limit: tuning.least_mark_points });
    }
    if share < tuning.least_mark_share || off_deg > tuning.most_mark_off_deg {
        return Err(ScanError::MarkUnclear {
            share_percent: 100.0 * share,
            limit_percent: 100.0 * tuning.least_mark_share,
            off_deg,
            limit_deg: tuning.most_mark_off_deg,
            bearing_deg: middle_bearing_deg,
        });
    }
    Ok(side_bearing_deg)
}

/// Refuses a sheet that lies farther off the points than the scan's noise does on the plate, a
/// little farther where that blurs the folds everywhere, and passes that do not meet: sideways they
/// meet on the plate all the same.
pub(super) fn misfit(
    misfit: &Misfit,
    scatter: &Scatter,
    noise_m: f64,
    options: &ScanOptions,
) -> Result<(), ScanError> {
    let tuning = &options.tuning.limits;
    let limit_m = options.most_misfit_m(misfit.on_plate_m);
    let times = scatter.hanging_m / scatter.on_plate_m.max(noise_m);
    let in_layers = times > tuning.scatter && scatter.hanging_m > tuning.least_scatter_m;
    // Noise blurs folds wherever they are; a fold that is missed is in one place.
    let is_blurred = misfit.half_share > tuning.blurred_places
        && misfit.typical_m > tuning.everywhere * limit_m
        && misfit.rms_m < noise_m
        && times < tuning.scatter_where_off;
    let is_usable = is_blurred && noise_m < tuning.blurred_noise_m;
    let limit_m = if is_usable { tuning.blurred_misfit * limit_m } else { limit_m };
    if misfit.rms_m <= limit_m && !in_layers {
        return Ok(());
    }
    let [rms_mm, limit_mm, noise_mm] = [misfit.rms_m, limit_m, noise_m].map(|m| m * 1e3);
    let [hanging_mm, plate_mm] = [scatter.hanging_m, scatter.on_plate_m].map(|m| m * 1e3);
    let is_in_many_places = misfit.half_share > tuning.many_places;
    Err(if is_blurred {
        ScanError::TooNoisy { noise_mm, rms_mm, limit_mm }
    } else if in_layers || (is_in_many_places && times > tuning.scatter_where_off) {
        ScanError::PassesApart { rms_mm, limit_mm, hanging_mm, plate_mm }
    } else {
        ScanError::Misfit { rms_mm, limit_mm, bearing_deg: misfit.worst_bearing_deg }
    })
}

/// Refuses a rim whose uncertainty is not known.
pub(super) fn rim(
    rim: &Rim,
    unexplained: &Unexplained,
    noise_m: f64,
    is_cut: bool,
    options: &ScanOptions,
) -> Result<(), ScanError> {
    observed(rim, noise_m, options)?;
    let most_m2 = options.most_unexplained_m2(unexplained.spacing_m);
    if unexplained.area_m2 > most_m2 {
        return Err(ScanError::Unexplained {
            area_mm2: unexplained.area_m2 * 1e6,
            limit_mm2: most_m2 * 1e6,
            bearing_deg: bearing_deg(&rim.points[unexplained.rim_point].position_m),
        });
    }
    // A mesh that was cut where its membrane and not the cloth ends has such sides too.
    let share = if is_cut { options.tuning.limits.uneven_of_cut } else { 1.0 };
    sides(rim, share * options.max_uneven_m + options.max_uneven_per_noise * noise_m, options)
}

/// The refusal of a rim of which most of a side is not seen, if it is one.
pub(super) fn lacks_a_side(rim: &Rim, noise_m: f64, options: &ScanOptions) -> Option<ScanError> {
    let most_m = options.tuning.limits.most_of_a_side * options.specimen_side_m;
    let lacks_it = longest_gap(&rim.points).length_m > most_m;
    observed(rim, noise_m, options).err().filter(|_| lacks_it)
}

/// A refusal of a rim that is not seen, or the strain of the sheet from which it follows: the edges
/// of what cannot be laid flat lie elsewhere than the specimen's.
pub(super) fn strained(error: ScanError, strain: f64, options: &ScanOptions) -> ScanError {
    let most = options.tuning.limits.most_strain;
    match error {
        ScanError::TooLittleRim { .. } | ScanError::Gap { .. } if strain > most => {
            ScanError::Strained { strain_percent: 100.0 * strain, limit_percent: 100.0 * most }
        }
        _ => error,
    }
}

/// Refuses a rim of which too little is observed.
fn observed(rim: &Rim, noise_m: f64, options: &ScanOptions) -> Result<(), ScanError> {
    let (min_observed, max_gap_m) =
        (options.least_observed(noise_m), options.longest_gap_m(noise_m));
    let observed = rim.observed_fraction();
    let gap = longest_gap(&rim.points);
    if observed < min_observed {
        return Err(ScanError::TooLittleRim {
            observed_percent: observed * 100.0,
            limit_percent: min_observed * 100.0,
            length_mm: gap.length_m * 1e3,
            bearing_deg: gap.bearing_deg,
        });
    }
    if gap.length_m > max_gap_m {
        return Err(ScanError::Gap {
            length_mm: gap.length_m * 1e3,
            limit_mm: max_gap_m * 1e3,
            bearing_deg: gap.bearing_deg,
        });
    }
    Ok(())
}

/// Refuses sides of a length that the specimen's cannot have, and sides that differ.
fn sides(rim: &Rim, limit_m: f64, options: &ScanOptions) -> Result<(), ScanError> {
    let bearing = |side: usize| {
        bearing_deg(&rim.points[side * POINTS_PER_SIDE + POINTS_PER_SIDE / 2].position_m)
    };
    for (side, length) in rim.side_lengths_m.iter().enumerate() {
        if !(options.side_range_m[0]..=options.side_range_m[1]).contains(length) {
            return Err(ScanError::SideLength {
                measured_mm: length * 1e3,
                min_mm: options.side_range_m[0] * 1e3,
                max_mm: options.side_range_m[1] * 1e3,
                bearing_deg: bearing(side),
            });
        }
    }
    let median_m = robust::median(rim.side_lengths_m.to_vec()).unwrap_or(0.0);
    let off = |side: usize| (rim.side_lengths_m[side] - median_m).abs();
    let worst = (0..SIDES).max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
    if off(worst) > limit_m {
        return Err(ScanError::UnevenSides {
            measured_mm: rim.side_lengths_m[worst] * 1e3,
            median_mm: median_m * 1e3,
            limit_mm: limit_m * 1e3,
            bearing_deg: bearing(worst),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_is_refused() {
        let disc: Vec<[f64; 2]> = (0..40_000)
            .map(|k| [f64::from(k % 200) * 1e-3 - 0.1, f64::from(k / 200) * 1e-3 - 0.1])
            .filter(|p| p[0].hypot(p[1]) < 0.1)
            .collect();
        let options = ScanOptions::default();
        let fit = super::super::square::find(&disc, 0.3, &options.tuning.square);
        let judged = square(&fit, &options);
        assert!(matches!(judged, Err(ScanError::HiddenRim { .. })));
    }

    #[test]
    fn what_a_misfit_means_is_told_by_where_it_is_and_by_the_scatter_of_points() {
        let options = ScanOptions::default();
        // figures of scans of seed 6001 of the laboratory's scenes [mm]
        let name =
            |[rms, on_plate, typical, noise]: [f64; 4], half_share, [plate, hanging]: [f64; 2]| {
                let misfit = super::super::measured::Misfit {
                    rms_m: 1e-3 * rms,
                    on_plate_m: 1e-3 * on_plate,
                    typical_m: 1e-3 * typical,
                    half_share,
                    worst_bearing_deg: 0.0,
                    strain: 0.0,
                };
                let scatter = Scatter { on_plate_m: 1e-3 * plate, hanging_m: 1e-3 * hanging };
                match super::misfit(&misfit, &scatter, 1e-3 * noise, &options) {
                    Ok(()) => "fits",
                    Err(ScanError::PassesApart { .. }) => "passes",
                    Err(ScanError::TooNoisy { .. }) => "noise",
                    Err(ScanError::Misfit { .. }) => "crease",
                    Err(other) => panic!("{other:?}"),
                }
            };
        // a handheld scan, and its passes 3 mm apart
        assert_eq!(name([0.061, 0.033, 0.025, 0.145], 0.045, [0.099, 0.131]), "fits");
        assert_eq!(name([0.174, 0.047, 0.049, 0.157], 0.052, [0.117, 0.583]), "passes");
        // a phone's drift, and its passes 3 mm apart
        assert_eq!(name([0.33, 0.13, 0.1, 0.19], 0.1, [0.19, 0.61]), "fits");
        assert_eq!(name([0.551, 0.128, 0.176, 0.455], 0.087, [0.464, 0.83]), "passes");
        // a crease, a touching fold, a soft knit before a stereo camera
        assert_eq!(name([0.570, 0.132, 0.159, 0.225], 0.088, [0.42, 0.58]), "crease");
        assert_eq!(name([1.552, 0.437, 0.657, 1.234], 0.052, [1.157, 1.555]), "crease");
        assert_eq!(name([1.195, 0.269, 0.678, 2.275], 0.158, [2.194, 2.018]), "noise");
        // of seed 7001, soft knits before it: rims 1.5 mm off in the mean, and 24 mm at a fold
        assert_eq!(name([0.73, 0.215, 0.44, 1.83], 0.212, [1.6, 1.6]), "fits");
        assert_eq!(name([0.97, 0.175, 0.39, 1.94], 0.037, [1.9, 1.9]), "crease");
    }

    #[test]
    fn what_is_hardly_likelier_a_drape_than_anything_else_is_said_to_be_none() {
        let options = ScanOptions::default();
        let off = || ScanError::TooNoisy { noise_mm: 2.0, rms_mm: 1.8, limit_mm: 1.0 };
        let place = PlateCandidate {
            radius_m: 0.05,
            centre: Point3::origin(),
            up: crate::base::Vector3::y(),
            short: 0.5,
            beyond: 0.0,
            around: 0.6,
        };
        let unit = Some(LengthUnit::Metre);
        let said = no_drape(off(), Some(&place), unit, &options);
        let named = |error: &ScanError| matches!(error, ScanError::NoPlate { why: NoDrape::NotTheSpecimen(at), .. } if *at == place);
        assert!(named(&said), "{said}");
        assert_eq!(no_drape(off(), None, unit, &options), off());
        // half a drape
        let half = ScanError::TooLittleRim {
            observed_percent: 50.0,
            limit_percent: 75.0,
            length_mm: 300.0,
            bearing_deg: 9.0,
        };
        assert_eq!(no_drape(half.clone(), Some(&place), unit, &options), half);
        let hidden = |around: f64| {
            let place = PlateCandidate { around, ..place.clone() };
            let error = ScanError::HiddenRim {
                hidden_percent: 60.0,
                limit_percent: 20.0,
                arc_deg: 90.0,
                bearing_deg: 9.0,
            };
            no_drape(error, Some(&place), unit, &options)
        };
        assert!(matches!(hidden(0.8), ScanError::HiddenRim { .. }));
        assert!(matches!(hidden(1.0), ScanError::NoPlate { .. }));
    }
}

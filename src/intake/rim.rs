//! The rim that an estimate is made from: found in a scan, or read from a boundary
//! CSV that a user may have corrected by hand.
//!
//! In: a path, or what is in memory already. Out: a [`Rim`], 244 points in the simulation frame. A
//! boundary CSV is known by its first line; what was typed wrong in it shows as a jump, an open
//! corner or a side of impossible length, and is refused with its line.
//!
//! A boundary CSV says whether weft and warp were known when it was written, and then
//! `--warp-toward`, which was of the scan's frame, is not needed and not used. For a file that
//! does not say it, or says that they are not known, the flag is of the file's frame:
//! `+x` says that weft and warp are as in the file, `+z` that they are exchanged.

use std::path::Path;

use super::error::{IntakeError, RimError};
use super::joined;
use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::clock::Stages;
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Isometry3, Point3, Surface};
use crate::geom::Cloud;
use crate::io::boundary_csv::{self, OrientedRim};
use crate::io::{Fault, Format, Place, ReadError, ReadNotes, ReadOptions, checked};
use crate::scan::{
    LengthUnit, Orientation, Refusal, ScanError, ScanOptions, ScannedBoundary, WarpToward,
    boundary_in_stages, quarters_to_warp, scale_of_drape,
};

/// Farthest that neighbouring points of a rim may lie from each other \[m\]: twice
/// their distance on the flat specimen, which no knit stretches to.
const LARGEST_STEP_M: f64 = 10e-3;
/// Farthest that the two points of one corner may lie from each other \[m\].
const LARGEST_CORNER_GAP_M: f64 = 2e-3;
/// A chord between points 5 mm apart is shorter than the cloth by up to this share
/// where the rim folds sharply. Empirical: 3 % on a soft knit.
const CHORD_SHARE: f64 = 0.06;

/// Farthest that the middle of a rim lies beside the plate's axis \[m\]: beyond it cloth of this
/// size slides off.
const FARTHEST_MIDDLE_M: f64 = 40e-3;
/// Least depth of a rim's lowest point below the plate's face \[m\]: half of what the stiffest
/// fabric that the model knows hangs down.
const LEAST_DROP_M: f64 = 25e-3;
/// Highest that a rim's points lie above the plate's face \[m\].
const MOST_RISE_M: f64 = 10e-3;
/// Over the half diagonal less the plate, what a corner may hang down \[-\]: limp cloth stretches,
/// and may lie 10 mm off the axis.
const DEEPEST_STRETCH: f64 = 1.25;

/// The rim that an estimate is made from.
#[derive(Clone, Debug)]
pub enum Rim {
    /// Found in a scan.
    Scanned {
        /// The rim, and how it was found.
        scanned: Box<ScannedBoundary>,
        /// What the reader left out.
        notes: ReadNotes,
    },
    /// Read from a boundary CSV.
    Given {
        /// The rim, simulation frame.
        boundary: Boundary,
        /// Whether the file or the user said which direction is the warp.
        orientation: Orientation,
        /// What was done with the user's word on it.
        warp: GivenWarp,
    },
}

/// Where the warp of a rim from a boundary CSV comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GivenWarp {
    /// The file says it, and the user nothing.
    File,
    /// The file says it, and what the user said was not used.
    FileNotFlag,
    /// The user says it; the angle between that direction and the file's axis that was taken
    /// for the warp \[rad\].
    Flag(f64),
    /// Nobody says it.
    Unknown,
}

impl Rim {
    /// The 244 points, simulation frame.
    #[must_use]
    pub fn boundary(&self) -> &Boundary {
        match self {
            Self::Scanned { scanned, .. } => &scanned.boundary,
            Self::Given { boundary, .. } => boundary,
        }
    }

    /// The whole scanned sheet, simulation frame; `None` for a rim that was given.
    #[must_use]
    pub fn sheet(&self) -> Option<&Surface> {
        self.scanned().map(|scanned| &scanned.surface)
    }

    /// Whether weft and warp are known.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        match self {
            Self::Scanned { scanned, .. } => scanned.orientation,
            Self::Given { orientation, .. } => *orientation,
        }
    }

    /// Angle between the direction that the user gave for the warp and the specimen's axis
    /// that was taken for it \[rad\]; `None` if none was given or used.
    #[must_use]
    pub fn warp_off_rad(&self) -> Option<f64> {
        match self {
            Self::Scanned { scanned, .. } => scanned.warp_off_rad,
            Self::Given { warp: GivenWarp::Flag(off_rad), .. } => Some(*off_rad),
            Self::Given { .. } => None,
        }
    }

    /// What was found in the scan; `None` for a rim that was given.
    #[must_use]
    pub fn scanned(&self) -> Option<&ScannedBoundary> {
        match self {
            Self::Scanned { scanned, .. } => Some(scanned),
            Self::Given { .. } => None,
        }
    }

    /// What the reader left out of the scan; `None` for a rim that was given.
    #[must_use]
    pub fn notes(&self) -> Option<&ReadNotes> {
        match self {
            Self::Scanned { notes, .. } => Some(notes),
            Self::Given { .. } => None,
        }
    }

    /// Share of the points that were observed, not bridged.
    #[must_use]
    pub fn observed_fraction(&self) -> f64 {
        let points = self.boundary().points();
        points.iter().filter(|p| p.observed).count() as f64 / points.len() as f64
    }
}

/// The rim of a scan, or of a boundary CSV.
///
/// # Errors
/// When the file cannot be read, the scan is refused, or the file's rim is none.
pub fn of_input(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<Rim, IntakeError> {
    if read.format.is_none() && boundary_csv::is_one(path) {
        let refused = |path: &Path, fault: &str| {
            let fault = Fault::Layout(fault.to_owned());
            Err(ReadError { path: path.to_owned(), place: Place::File, fault }.into())
        };
        if let Some(pass) = read.passes.first() {
            let fault =
                "a rim needs no more passes; give the scans that it is of, or the rim alone";
            return refused(pass, fault);
        }
        if read.rescale.is_some() {
            return refused(path, "a rim has the scale of its scan; give the scan with --rescale");
        }
        return of_rim(path, boundary_csv::read_oriented(path)?, options);
    }
    let (scanned, notes) = of_scan(path, read, options)?;
    Ok(Rim::Scanned { scanned: Box::new(scanned), notes })
}

/// A rim that is in memory, checked and turned to the warp as that of a boundary CSV is. `name`
/// stands for the file in messages, whose lines are those that the rim would have in one: a point's
/// number and 2.
///
/// # Errors
/// When it can be no rim of the specimen.
pub fn of_rim(name: &Path, rim: OrientedRim, options: &ScanOptions) -> Result<Rim, IntakeError> {
    check(&rim.boundary, options)
        .and_then(|()| oriented(rim, options))
        .map_err(|source| IntakeError::RimRefused { path: name.to_owned(), source })
}

/// The rim of a cloud or a mesh that is in memory, in the unit of the options; `name` stands for
/// the file in messages. Points that are none (NaN, infinite) are left out and noted, as the
/// readers do.
///
/// # Errors
/// When there are no points, the colours or the triangles are not theirs, or the scan is refused.
pub fn of_cloud(name: &Path, cloud: Cloud, options: &ScanOptions) -> Result<Rim, IntakeError> {
    let (cloud, notes) = checked(cloud).map_err(|fault| ReadError {
        path: name.to_owned(),
        place: Place::File,
        fault,
    })?;
    let scanned = Box::new(in_cloud(name, cloud, &notes, options, &mut Stages::off())?);
    Ok(Rim::Scanned { scanned, notes })
}

/// Finds the rim in what was read.
fn in_cloud(
    path: &Path,
    cloud: Cloud,
    notes: &ReadNotes,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Result<ScannedBoundary, IntakeError> {
    boundary_in_stages(cloud, options, stages).map_err(|refusal| {
        let Refusal { error: source, found } = refusal;
        IntakeError::Refused {
            path: path.to_owned(),
            taken: notes.taken.clone(),
            source: Box::new(source),
            found,
        }
    })
}

/// Reads a scan and finds its rim.
///
/// # Errors
/// When the file cannot be read or the scan is refused.
pub fn of_scan(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(ScannedBoundary, ReadNotes), IntakeError> {
    of_scan_in_stages(path, read, options, &mut Stages::off())
}

/// [`of_scan`], with the time that each stage takes.
///
/// # Errors
/// As there.
pub fn of_scan_in_stages(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Result<(ScannedBoundary, ReadNotes), IntakeError> {
    let (cloud, notes) = stages.span("read", || joined::read(path, read, options))?;
    // Their reader has made metres of them.
    let known = matches!(notes.format, Some(Format::DepthPng | Format::Views));
    let unit = options.unit.or(known.then_some(LengthUnit::Metre));
    let options = ScanOptions { unit, ..options.clone() };
    let depths = (notes.format == Some(Format::DepthPng)).then(|| cloud.clone());
    let refused = match in_cloud(path, cloud, &notes, &options, stages) {
        Ok(scanned) => return Ok((scanned, notes)),
        Err(refused) => refused,
    };
    if let Some(depths) = depths {
        other_depth_scale(path, &depths, &refused, read, &options)?;
    }
    Err(refused)
}

/// Says with which depth scale a depth image that shows no drape would show one.
fn other_depth_scale(
    path: &Path,
    depths: &Cloud,
    refused: &IntakeError,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(), IntakeError> {
    /// Scales that sensors have, against one another.
    const FACTORS: [f64; 8] = [0.1, 10.0, 0.2, 5.0, 0.25, 4.0, 0.001, 1000.0];
    let IntakeError::Refused { source, .. } = refused else { return Ok(()) };
    let of_size =
        matches!(source.follows(), ScanError::NoPlate { .. } | ScanError::WrongSize { .. });
    let factor = of_size.then(|| scale_of_drape(depths, &FACTORS, options)).flatten();
    let Some(factor) = factor else { return Ok(()) };
    let (scale, taken) = (read.depth_scale / factor, read.depth_scale);
    let fault = Fault::Layout(format!(
        "a drape of the right size is seen with {scale} units of depth in a metre, and none with the {taken} \
         that were taken: give --depth-scale {scale}, or --sensor"
    ));
    Err(ReadError { path: path.to_owned(), place: Place::File, fault }.into())
}

/// Turns a given rim so that its x axis is the warp, if the user said where that
/// points in the file's frame and the file does not say that x is the warp already.
fn oriented(rim: OrientedRim, options: &ScanOptions) -> Result<Rim, RimError> {
    let OrientedRim { boundary, orientation } = rim;
    let (orientation, warp) = match (orientation, options.warp_toward) {
        (Some(Orientation::Given), None) => (Orientation::Given, GivenWarp::File),
        (Some(Orientation::Given), Some(_)) => (Orientation::Given, GivenWarp::FileNotFlag),
        (_, None) => (Orientation::Ambiguous, GivenWarp::Unknown),
        (_, Some(warp)) => {
            let least_deg = options.tuning.limits.least_warp_off_vertical_deg;
            let bearing_rad = warp.bearing_rad(&Isometry3::identity(), least_deg)?;
            // A quarter turn of `Boundary::rotated` brings +z, bearing -90 degrees, to +x.
            let (quarters, off_rad) = quarters_to_warp(-bearing_rad);
            let boundary = boundary.rotated(quarters.rem_euclid(SIDES as f64) as usize);
            let warp = GivenWarp::Flag(off_rad);
            return Ok(Rim::Given { boundary, orientation: Orientation::Given, warp });
        }
    };
    Ok(Rim::Given { boundary, orientation, warp })
}

/// A direction that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("give +x, -x, +y, ..., x,y,z or a bearing in degrees")]
pub struct WarpTowardError;

/// Where the warp points, as a user writes it: `+x`, `-y`, `z`, three numbers
/// `x,y,z`, or a bearing in degrees.
///
/// # Errors
/// When it is none of these.
pub fn parse_warp_toward(text: &str) -> Result<WarpToward, WarpTowardError> {
    let axis = |sign: f64, name: &str| match name {
        "x" => Some([sign, 0.0, 0.0]),
        "y" => Some([0.0, sign, 0.0]),
        "z" => Some([0.0, 0.0, sign]),
        _ => None,
    };
    let named = match text.split_at_checked(1) {
        Some(("+", name)) => axis(1.0, name),
        Some(("-", name)) => axis(-1.0, name),
        _ => axis(1.0, text),
    };
    if let Some(direction) = named {
        return Ok(WarpToward::Direction(direction));
    }
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some([degrees]) => Ok(WarpToward::BearingDeg(*degrees)),
        Some(&[x, y, z]) if [x, y, z] != [0.0; 3] => Ok(WarpToward::Direction([x, y, z])),
        _ => Err(WarpTowardError),
    }
}

/// Holds a rim against what a specimen's rim can be.
fn check(boundary: &Boundary, options: &ScanOptions) -> Result<(), RimError> {
    let points: Vec<Point3> = boundary.positions_m().collect();
    // The table's first line is its header.
    let line = |index: usize| index + 2;
    let step_m = |index: usize| (points[(index + 1) % POINTS] - points[index]).norm();
    let ends_a_side = |index: usize| index % POINTS_PER_SIDE == POINTS_PER_SIDE - 1;
    for index in 0..POINTS {
        let (line, next_line) = (line(index), line((index + 1) % POINTS));
        let measured_mm = step_m(index) / M_PER_MM;
        let corner = ends_a_side(index);
        let limit_mm = if corner { LARGEST_CORNER_GAP_M } else { LARGEST_STEP_M } / M_PER_MM;
        if measured_mm > limit_mm {
            return Err(if corner {
                RimError::Corner { line, next_line, measured_mm, limit_mm }
            } else {
                RimError::Jump { line, next_line, measured_mm, limit_mm }
            });
        }
    }
    let [least_m, most_m] = options.side_range_m;
    let least_m = least_m * (1.0 - CHORD_SHARE);
    for side in 0..SIDES {
        let first = side * POINTS_PER_SIDE;
        let last = first + POINTS_PER_SIDE - 1;
        let length_m: f64 = (first..last).map(step_m).sum();
        if !(least_m..=most_m).contains(&length_m) {
            return Err(RimError::SideLength {
                side,
                first_line: line(first),
                last_line: line(last),
                measured_mm: length_m / M_PER_MM,
                min_mm: least_m / M_PER_MM,
                max_mm: most_m / M_PER_MM,
            });
        }
    }
    hangs(&points, options)
}

/// Holds a rim of the right lengths against where a specimen on the plate has its rim.
fn hangs(points: &[Point3], options: &ScanOptions) -> Result<(), RimError> {
    let mean = |of: fn(&Point3) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let beside_m = mean(|p| p.x).hypot(mean(|p| p.z));
    if beside_m > FARTHEST_MIDDLE_M {
        let [measured_mm, limit_mm] = [beside_m, FARTHEST_MIDDLE_M].map(|m| m / M_PER_MM);
        return Err(RimError::BesidePlate { measured_mm, limit_mm });
    }
    let height_m = |pick: fn(f64, f64) -> f64| points.iter().map(|p| p.y).reduce(pick);
    let (lowest_m, highest_m) =
        (height_m(f64::min).unwrap_or(0.0), height_m(f64::max).unwrap_or(0.0));
    let half_diagonal_m = options.specimen_side_m * std::f64::consts::FRAC_1_SQRT_2;
    let most_drop_m = (half_diagonal_m - options.plate_radius_m) * DEEPEST_STRETCH;
    if !(LEAST_DROP_M..=most_drop_m).contains(&-lowest_m) || highest_m > MOST_RISE_M {
        return Err(RimError::NotHanging {
            lowest_mm: lowest_m / M_PER_MM,
            highest_mm: highest_m / M_PER_MM,
            least_drop_mm: LEAST_DROP_M / M_PER_MM,
            most_drop_mm: most_drop_m / M_PER_MM,
            most_rise_mm: MOST_RISE_M / M_PER_MM,
        });
    }
    // Twice the area, seen from above, of the rim's polygon: positive as the flat specimen's.
    let next = |k: usize| &points[(k + 1) % points.len()];
    let twice_m2 = |(k, p): (usize, &Point3)| p.x * next(k).z - next(k).x * p.z;
    if points.iter().enumerate().map(twice_m2).sum::<f64>() < 0.0 {
        return Err(RimError::Mirrored);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{BoundaryPoint, Vector3};

    /// A square, level, 100 mm below the plate.
    fn flat() -> Boundary {
        let at = |i| Boundary::flat_xz_m(i, 0.3);
        Boundary::exact((0..POINTS).map(|i| Point3::new(at(i)[0], -0.1, at(i)[1]))).unwrap()
    }

    fn with(index: usize, shift_m: f64) -> Boundary {
        let mut points: Vec<BoundaryPoint> = flat().points().to_vec();
        points[index].position_m.y += shift_m;
        Boundary::new(points).unwrap()
    }

    #[test]
    fn a_point_that_was_typed_wrong_is_named_by_its_line() {
        let options = ScanOptions::default();
        assert_eq!(check(&flat(), &options), Ok(()));
        assert_eq!(check(&with(7, 0.008), &options), Ok(()));
        let error = check(&with(7, 0.012), &options).unwrap_err();
        assert!(matches!(error, RimError::Jump { line: 8, next_line: 9, .. }), "{error}");
        let error = check(&with(60, 0.003), &options).unwrap_err();
        assert!(matches!(error, RimError::Corner { line: 62, next_line: 63, .. }), "{error}");
        let error = check(&with(0, 0.003), &options).unwrap_err();
        assert!(matches!(error, RimError::Corner { line: 245, next_line: 2, .. }), "{error}");
        let metres = Boundary::exact(flat().positions_m().map(|p| p * 1e-3)).unwrap();
        let error = check(&metres, &options).unwrap_err();
        assert!(matches!(error, RimError::SideLength { side: 0, .. }), "{error}");
    }

    #[test]
    fn a_rim_of_no_cloth_on_the_plate_is_refused() {
        let options = ScanOptions::default();
        let refusal = |change: fn(Point3) -> Point3| {
            let changed = Boundary::exact(flat().positions_m().map(change)).unwrap();
            let refusal = check(&changed, &options).unwrap_err();
            println!("{refusal}");
            refusal
        };
        let at = |x, y, z| Point3::new(x, y, z);
        let mirrored = refusal(|p| Point3::new(-p.x, p.y, p.z));
        assert_eq!(mirrored, RimError::Mirrored);
        let beside = refusal(|p| p + Vector3::new(0.2, 0.0, 0.0));
        assert!(
            matches!(beside, RimError::BesidePlate { measured_mm, .. } if (measured_mm - 200.0).abs() < 0.1)
        );
        for rise_m in [0.1, 0.3, -0.2] {
            let raised = Boundary::exact(flat().positions_m().map(|p| at(p.x, p.y + rise_m, p.z)));
            let refusal = check(&raised.unwrap(), &options).unwrap_err();
            assert!(matches!(refusal, RimError::NotHanging { .. }), "{rise_m}: {refusal}");
        }
        // As far as cloth that slides, stretches or hardly hangs may come.
        for by in [at(0.035, 0.0, 0.0), at(0.0, -0.09, 0.02), at(0.0, 0.07, 0.0)] {
            let moved = Boundary::exact(flat().positions_m().map(|p| p + by.coords)).unwrap();
            assert_eq!(check(&moved, &options), Ok(()), "{by}");
        }
    }

    fn with_warp(warp_toward: Option<WarpToward>) -> ScanOptions {
        ScanOptions { warp_toward, ..ScanOptions::default() }
    }

    #[test]
    fn the_warp_s_direction_turns_the_rim_by_quarters() {
        let rim = with(7, 0.008);
        let turned = |says, warp| {
            let rim = OrientedRim { boundary: rim.clone(), orientation: says };
            match oriented(rim, &with_warp(warp)).unwrap() {
                Rim::Given { boundary, orientation, warp } => (boundary, orientation, warp),
                Rim::Scanned { .. } => panic!("not scanned"),
            }
        };
        let unknown = (rim.clone(), Orientation::Ambiguous, GivenWarp::Unknown);
        for says in [None, Some(Orientation::Ambiguous)] {
            assert_eq!(turned(says, None), unknown);
            for (direction, bearing_deg, quarters) in [
                ([1.0, 0.0, 0.0], 360.0, 0),
                ([0.0, 0.0, 1.0], -90.0, 1),
                ([-1.0, 0.3, 0.1], 180.0, 2),
                ([0.0, 0.0, -2.0], 85.0, 3),
            ] {
                for warp in [WarpToward::Direction(direction), WarpToward::BearingDeg(bearing_deg)]
                {
                    let (boundary, orientation, warp) = turned(says, Some(warp));
                    assert_eq!(boundary, rim.rotated(quarters));
                    assert_eq!(orientation, Orientation::Given);
                    let GivenWarp::Flag(off_rad) = warp else { panic!("{warp:?}") };
                    assert!(off_rad.to_degrees() < 6.0, "{off_rad}");
                }
            }
        }
        let diagonal = turned(None, Some(WarpToward::BearingDeg(140.0)));
        assert_eq!((diagonal.0, diagonal.1), (rim.rotated(2), Orientation::Given));
        assert!(
            matches!(diagonal.2, GivenWarp::Flag(off) if (off.to_degrees() - 40.0).abs() < 1e-9)
        );
    }

    #[test]
    fn a_rim_whose_file_says_where_the_warp_is_is_not_turned() {
        let rim = OrientedRim { boundary: with(7, 0.008), orientation: Some(Orientation::Given) };
        for (flag, want) in [
            (None, GivenWarp::File),
            (Some(WarpToward::Direction([0.0, 0.0, 1.0])), GivenWarp::FileNotFlag),
            // Of the scan's frame, whose up was another.
            (Some(WarpToward::Direction([0.0, 1.0, 0.0])), GivenWarp::FileNotFlag),
        ] {
            let Rim::Given { boundary, orientation, warp } =
                oriented(rim.clone(), &with_warp(flag)).unwrap()
            else {
                panic!("not scanned")
            };
            assert_eq!((boundary, orientation), (rim.boundary.clone(), Orientation::Given));
            assert_eq!(warp, want);
        }
        let silent = OrientedRim { orientation: None, ..rim };
        let upright = Some(WarpToward::Direction([0.1, 1.0, 0.0]));
        let refused = oriented(silent, &with_warp(upright)).unwrap_err();
        assert!(matches!(refused, RimError::WarpSteep(_)), "{refused}");
    }

    #[test]
    fn directions_and_bearings() {
        assert_eq!(parse_warp_toward("+x"), Ok(WarpToward::Direction([1.0, 0.0, 0.0])));
        assert_eq!(parse_warp_toward("-z"), Ok(WarpToward::Direction([0.0, 0.0, -1.0])));
        assert_eq!(parse_warp_toward("0.5,0,-2"), Ok(WarpToward::Direction([0.5, 0.0, -2.0])));
        assert_eq!(parse_warp_toward("-35"), Ok(WarpToward::BearingDeg(-35.0)));
        for wrong in ["", "+w", "1,2", "0,0,0", "nan"] {
            assert!(parse_warp_toward(wrong).is_err(), "{wrong}");
        }
    }
}

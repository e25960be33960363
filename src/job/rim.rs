//! The rim that an estimate is made from: found in a scan, or read from a boundary
//! CSV that a user may have corrected by hand.
//!
//! In: a path. Out: a [`Rim`], 244 points in the simulation frame. A boundary CSV
//! is known by its first line; what was typed wrong in it shows as a jump, an
//! open corner or a side of impossible length, and is refused with its line.
//!
//! A boundary CSV does not say whether weft and warp were known when it was
//! written: `--warp-toward +x` (x is the warp in the simulation frame) says that
//! they were, `+z` that they are exchanged.

use std::path::Path;

use super::JobError;
use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::clock::Stages;
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3};
use crate::io::{Format, ReadNotes, ReadOptions, boundary_csv, read_scan_with};
use crate::scan::{
    LengthUnit, Orientation, Refusal, ScanOptions, ScannedBoundary, WarpToward, boundary_in_stages,
};

/// Farthest that neighbouring points of a rim may lie from each other \[m\]: twice
/// their distance on the flat specimen, which no knit stretches to.
const LARGEST_STEP_M: f64 = 10e-3;
/// Farthest that the two points of one corner may lie from each other \[m\].
const LARGEST_CORNER_GAP_M: f64 = 2e-3;
/// A chord between points 5 mm apart is shorter than the cloth by up to this share
/// where the rim folds sharply. Empirical: 3 % on a soft knit.
const CHORD_SHARE: f64 = 0.06;

/// The rim that an estimate is made from.
#[derive(Debug)]
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
        /// Whether the user said which direction is the warp.
        orientation: Orientation,
    },
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

    /// Whether weft and warp are known.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        match self {
            Self::Scanned { scanned, .. } => scanned.orientation,
            Self::Given { orientation, .. } => *orientation,
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

/// Why a rim from a file cannot be one. Lines are those of a boundary CSV.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RimError {
    /// Two neighbours too far apart.
    #[error(
        "the points of lines {line} and {next_line} lie {measured_mm:.1} mm apart (limit {limit_mm:.0} mm); \
         correct the one that is off"
    )]
    Jump {
        /// Line of the first point.
        line: usize,
        /// Line of the second.
        next_line: usize,
        /// Their distance \[mm\].
        measured_mm: f64,
        /// Largest accepted \[mm\].
        limit_mm: f64,
    },
    /// The two points of a corner differ.
    #[error(
        "lines {line} and {next_line} are the same corner of the specimen but lie {measured_mm:.1} mm apart \
         (limit {limit_mm:.0} mm); give both the same position"
    )]
    Corner {
        /// Line of the end of a side.
        line: usize,
        /// Line of the start of the next side.
        next_line: usize,
        /// Their distance \[mm\].
        measured_mm: f64,
        /// Largest accepted \[mm\].
        limit_mm: f64,
    },
    /// A side of impossible length.
    #[error(
        "side {side} (lines {first_line} to {last_line}) measures {measured_mm:.1} mm, accepted are \
         {min_mm:.0} to {max_mm:.0} mm; check the points' positions and that they are in mm"
    )]
    SideLength {
        /// Side, 0 to 3.
        side: usize,
        /// Line of its first point.
        first_line: usize,
        /// Line of its last point.
        last_line: usize,
        /// Its length \[mm\].
        measured_mm: f64,
        /// Least accepted \[mm\].
        min_mm: f64,
        /// Largest accepted \[mm\].
        max_mm: f64,
    },
}

/// The rim of a scan, or of a boundary CSV.
///
/// # Errors
/// When the file cannot be read, the scan is refused, or the file's rim is none.
pub fn of_input(path: &Path, read: &ReadOptions, options: &ScanOptions) -> Result<Rim, JobError> {
    if boundary_csv::is_one(path) {
        let boundary = boundary_csv::read(path)?;
        check(&boundary, options)
            .map_err(|source| JobError::RimRefused { path: path.to_owned(), source })?;
        return Ok(oriented(&boundary, options.warp_toward));
    }
    let (scanned, notes) = of_scan(path, read, options)?;
    Ok(Rim::Scanned { scanned: Box::new(scanned), notes })
}

/// Reads a scan and finds its rim.
///
/// # Errors
/// When the file cannot be read or the scan is refused.
pub fn of_scan(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(ScannedBoundary, ReadNotes), JobError> {
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
) -> Result<(ScannedBoundary, ReadNotes), JobError> {
    let (cloud, notes) = stages.span("read", || read_scan_with(path, read))?;
    // Their reader has made metres of them.
    let known = matches!(notes.format, Format::DepthPng | Format::Views);
    let unit = options.unit.or(known.then_some(LengthUnit::Metre));
    let options = ScanOptions { unit, ..options.clone() };
    let scanned = boundary_in_stages(cloud, &options, stages).map_err(|refusal| {
        let Refusal { error: source, found } = refusal;
        JobError::Refused { path: path.to_owned(), source, found }
    })?;
    Ok((scanned, notes))
}

/// Turns a given rim so that its x axis is the warp, if the user said where that
/// points in the file's frame.
fn oriented(boundary: &Boundary, warp: Option<WarpToward>) -> Rim {
    let bearing_deg = match warp {
        None => {
            let boundary = boundary.clone();
            return Rim::Given { boundary, orientation: Orientation::Ambiguous };
        }
        Some(WarpToward::BearingDeg(degrees)) => degrees,
        Some(WarpToward::Direction([x, _, z])) => (-z).atan2(x).to_degrees(),
    };
    // A quarter turn of `Boundary::rotated` brings +z, bearing -90 degrees, to +x.
    let quarters = (-bearing_deg / 90.0).round().rem_euclid(SIDES as f64) as usize;
    Rim::Given { boundary: boundary.rotated(quarters), orientation: Orientation::Given }
}

/// Where the warp points, as a user writes it: `+x`, `-y`, `z`, three numbers
/// `x,y,z`, or a bearing in degrees.
///
/// # Errors
/// What may be written.
pub fn parse_warp_toward(text: &str) -> Result<WarpToward, String> {
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
        _ => Err("give +x, -x, +y, ..., x,y,z or a bearing in degrees".into()),
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
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::BoundaryPoint;

    fn flat() -> Boundary {
        let at = |i| Boundary::flat_xz_m(i, 0.3);
        Boundary::exact((0..POINTS).map(|i| Point3::new(at(i)[0], 0.0, at(i)[1]))).unwrap()
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
    fn the_warp_s_direction_turns_the_rim_by_quarters() {
        let rim = with(7, 0.008);
        let turned = |warp| match oriented(&rim, warp) {
            Rim::Given { boundary, orientation } => (boundary, orientation),
            Rim::Scanned { .. } => panic!("not scanned"),
        };
        assert_eq!(turned(None), (rim.clone(), Orientation::Ambiguous));
        for (direction, bearing_deg, quarters) in [
            ([1.0, 0.0, 0.0], 360.0, 0),
            ([0.0, 0.0, 1.0], -90.0, 1),
            ([-1.0, 0.3, 0.1], 180.0, 2),
            ([0.0, 0.0, -2.0], 85.0, 3),
        ] {
            let want = (rim.rotated(quarters), Orientation::Given);
            assert_eq!(turned(Some(WarpToward::Direction(direction))), want);
            assert_eq!(turned(Some(WarpToward::BearingDeg(bearing_deg))), want);
        }
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

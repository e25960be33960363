//! Why a scan is refused: what was measured, the limit, the place, the remedy.

use thiserror::Error;

use super::unit::LengthUnit;
use crate::base::units::LIKELY_SCALES;
use crate::base::{Point3, Vector3};

/// A refused scan. Bearings are degrees, see [`super::frame::Bearing`].
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ScanError {
    /// Not enough points to carry a rim.
    #[error(
        "{points} usable points, at least {limit} are needed; scan more densely, check the file, or widen --crop if it \
         is given"
    )]
    TooFewPoints {
        /// Finite points in the cloud.
        points: usize,
        /// Least number.
        limit: usize,
    },
    /// The scene fits a drape in no unit.
    #[error(
        "the scene measures {measured_units:.4} file units: no unit that files have puts it \
         between {smallest_m} m and {largest_m} m; give the unit or check the export"
    )]
    Size {
        /// Typical size in file units.
        measured_units: f64,
        /// Smallest plausible \[m\].
        smallest_m: f64,
        /// Largest plausible \[m\].
        largest_m: f64,
    },
    /// The points lie too far apart; what follows from that is the cause of the refusal.
    #[error(
        "the points lie {spacing_mm:.1} mm apart, {needed_mm:.1} mm are needed: scan nearer or longer, or export \
         without decimating{}. With these, {}", in_other_unit(*spacing_mm, *likelier), cause.brief()
    )]
    TooSparse {
        /// Typical distance between points.
        spacing_mm: f64,
        /// The unit that was given, and another in which the points would lie near enough.
        likelier: Option<[LengthUnit; 2]>,
        /// Distance that is enough.
        needed_mm: f64,
        /// What cannot be found for it.
        cause: Box<ScanError>,
    },
    /// The file's coordinates have too few digits; what follows from that is the cause of the
    /// refusal.
    #[error(
        "the file stores its coordinates in steps of {step}; steps of 1 mm or less are needed: export with more digits, \
         a smaller scale factor (LAS, E57: 0.0001), in double precision, or without a map's offset. With these steps, {}",
        cause.brief()
    )]
    TooCoarse {
        /// The step, with its unit.
        step: String,
        /// What cannot be found for it.
        cause: Box<ScanError>,
    },
    /// The cloth is a square, but not of the specimen's size.
    #[error(
        "the cloth is a square of {side_mm:.1} mm, accepted are {least_mm:.1} to {most_mm:.1}, on a plate of \
         {plate_mm:.1} mm radius as it reads: {}",
        reading.remedy([*side_mm, *expected_side_mm], *expected_plate_mm)
    )]
    WrongSize {
        /// Side of the flattened cloth.
        side_mm: f64,
        /// Side of the specimen.
        expected_side_mm: f64,
        /// Least side accepted.
        least_mm: f64,
        /// Longest accepted.
        most_mm: f64,
        /// Radius at which the cloth leaves the plate.
        plate_mm: f64,
        /// Radius of the plate.
        expected_plate_mm: f64,
        /// The likelier reason.
        reading: SizeReading,
    },
    /// Nothing in the scan is a drape.
    #[error("no drape found: {}", why.says(*radius_m, *unit))]
    NoPlate {
        /// What is there instead.
        why: NoDrape,
        /// Radius of the plate looked for \[m\].
        radius_m: f64,
        /// The unit in use.
        unit: LengthUnit,
    },
    /// More than one drape in the scan.
    #[error(
        "another drape stands {apart_mm:.0} mm from this one: their plates are at {} and {} {}; choose one with \
         --plate-near {}, or leave one out with --crop",
        place(&centres[0], *unit), place(&centres[1], *unit), unit.name(), as_flag(&centres[0], *unit)
    )]
    SeveralDrapes {
        /// Distance of the two plates \[mm\].
        apart_mm: f64,
        /// Their centres in the file's frame and unit.
        centres: [[f64; 3]; 2],
        /// The file's unit.
        unit: LengthUnit,
    },
    /// A closed mesh whose cloth ends nowhere.
    #[error(
        "the mesh is closed underneath, and where the cloth ends it turns by {crease_deg:.0} degrees only \
         (limit {limit_deg:.0}): the free edge cannot be told from what closes it; export the mesh \
         unclosed (no hole filling, no Poisson surface), or the point cloud"
    )]
    NoCrease {
        /// Median turn of the surface along the best cut.
        crease_deg: f64,
        /// Least turn accepted.
        limit_deg: f64,
    },
    /// A closed mesh whose edge shows in too few places.
    #[error(
        "the mesh is closed underneath, and the cloth's free edge shows as a crease along {clear_percent:.0} % \
         of the rim only (limit {limit_percent:.0} %); export the mesh unclosed (no hole filling, no Poisson \
         surface), or the point cloud"
    )]
    HiddenCrease {
        /// Share of the rim with an edge of the mesh after the cut.
        clear_percent: f64,
        /// Least share.
        limit_percent: f64,
    },
    /// A mark is to be found in a scan without colours.
    #[error(
        "the scan has no colours in which a mark could be found (depth images and bare points have \
         none); export it with colours, or give --warp-toward instead of --mark"
    )]
    NoColors,
    /// The cloth is of the mark's colour.
    #[error(
        "the cloth's own colour ({} % red, {} % green, {} % blue) is too near to the mark's; mark in \
         another colour, or give --warp-toward", cloth_percent[0], cloth_percent[1], cloth_percent[2]
    )]
    MarkLikeCloth {
        /// Shares of red, green and blue in percent.
        cloth_percent: [u8; 3],
    },
    /// No mark on the cloth.
    #[error(
        "{points} points on the cloth have the mark's colour, at least {limit} are needed; check the \
         colour, make the mark larger, or give --warp-toward"
    )]
    NoMark {
        /// Points found.
        points: usize,
        /// Least number.
        limit: usize,
    },
    /// The mark does not tell one side.
    #[error(
        "the mark tells no side: {share_percent:.0} % of its points lie towards one side (limit \
         {limit_percent:.0} %), their middle {off_deg:.0} degrees off the middle of that side (limit \
         {limit_deg:.0}), at {bearing_deg:.0} degrees; mark the middle of one side only, the one to which \
         the warp runs, or give --warp-toward"
    )]
    MarkUnclear {
        /// Share of the marked points on the side that has most.
        share_percent: f64,
        /// Least share.
        limit_percent: f64,
        /// Angle between the mark's middle and the side's, seen from the centre.
        off_deg: f64,
        /// Largest angle.
        limit_deg: f64,
        /// Where the mark's middle lies.
        bearing_deg: f64,
    },
    /// The direction given for the warp stands nearly upright.
    #[error(transparent)]
    WarpSteep(#[from] super::warp::WarpSteep),
    /// The flattened cloth is not a square of the specimen's size.
    #[error(
        "the flattened outline differs from a {side_mm:.0} mm square by {rms_mm:.1} mm rms (limit \
         {limit_mm:.1} mm), most towards {bearing_deg:.0} degrees: corners not found; check the specimen's \
         size and whether something touches the cloth there"
    )]
    NotASquare {
        /// The specimen's side.
        side_mm: f64,
        /// Root mean square difference.
        rms_mm: f64,
        /// Largest accepted.
        limit_mm: f64,
        /// Where it differs most.
        bearing_deg: f64,
    },
    /// The cloth is not seen out to its rim.
    #[error(
        "on {hidden_percent:.0} % of all bearings the cloth is not seen out to its rim (limit \
         {limit_percent:.0} %); the longest hidden arc is {arc_deg:.0} degrees wide, around \
         {bearing_deg:.0} degrees; add views from there, level with the rim"
    )]
    HiddenRim {
        /// Share of the bearings.
        hidden_percent: f64,
        /// Largest share at which the specimen's square is still looked for.
        limit_percent: f64,
        /// Width of the longest hidden arc, seen from the plate's axis.
        arc_deg: f64,
        /// Its middle.
        bearing_deg: f64,
    },
    /// A side of the rim has an impossible length.
    #[error(
        "the rim's side towards {bearing_deg:.0} degrees measures {measured_mm:.1} mm, accepted are \
         {min_mm:.0} to {max_mm:.0} mm; check the unit and the specimen's size"
    )]
    SideLength {
        /// Length found.
        measured_mm: f64,
        /// Least.
        min_mm: f64,
        /// Most.
        max_mm: f64,
        /// The side's middle.
        bearing_deg: f64,
    },
    /// The sides differ in length.
    #[error(
        "the rim's side towards {bearing_deg:.0} degrees measures {measured_mm:.1} mm, the four sides' median is \
         {median_mm:.1} mm (limit {limit_mm:.1} mm apart): cloth there was joined wrongly; lay the specimen again \
         or add views from there"
    )]
    UnevenSides {
        /// Length found.
        measured_mm: f64,
        /// Median of the four.
        median_mm: f64,
        /// Largest difference accepted.
        limit_mm: f64,
        /// The side's middle.
        bearing_deg: f64,
    },
    /// Too long an arc of the rim is hidden.
    #[error(
        "the rim is missing {length_mm:.0} mm at {bearing_deg:.0} degrees (limit {limit_mm:.0} mm); add a \
         view from there, or see whether the cloth is cut, folded or held there"
    )]
    Gap {
        /// Length of the arc along the cloth.
        length_mm: f64,
        /// Longest that is bridged.
        limit_mm: f64,
        /// The arc's middle.
        bearing_deg: f64,
    },
    /// Too little of the rim is seen in all.
    #[error(
        "only {observed_percent:.0} % of the rim is seen (limit {limit_percent:.0} %), the longest missing \
         arc is {length_mm:.0} mm at {bearing_deg:.0} degrees; add views, or see whether the cloth is cut, folded or \
         held there"
    )]
    TooLittleRim {
        /// Seen share.
        observed_percent: f64,
        /// Least share.
        limit_percent: f64,
        /// Longest missing arc.
        length_mm: f64,
        /// Its middle.
        bearing_deg: f64,
    },
    /// The rim is not where the specimen's would be, and the surface cannot be laid flat as cloth
    /// can.
    #[error(
        "the surface is not that of a flat cloth: laid on the specimen it is stretched by {strain_percent:.1} % in the \
         median (limit {limit_percent:.1} %), and its rim is not found; see whether the scan was sheared, scaled along one \
         axis, smoothed or joined from different drapes, whether this is the specimen, and whether all its folds were seen"
    )]
    Strained {
        /// Median of the larger principal strain.
        strain_percent: f64,
        /// Largest that is taken for cloth.
        limit_percent: f64,
    },
    /// Scanned cloth near the rim lies off the fitted sheet.
    #[error(
        "{area_mm2:.0} square millimetres of scanned cloth near the rim at {bearing_deg:.0} degrees lie off \
         the fitted sheet (limit {limit_mm2:.0}): a fold is hidden there; add a view from there or lay the \
         specimen again"
    )]
    Unexplained {
        /// Largest area of it around one point of the rim.
        area_mm2: f64,
        /// Largest accepted.
        limit_mm2: f64,
        /// Where.
        bearing_deg: f64,
    },
    /// Points scatter across the hanging cloth more than on the plate, or lie off the fitted sheet
    /// in many places.
    #[error(
        "the scan's passes or views do not meet: points scatter by {hanging_mm:.2} mm across the hanging cloth, for \
         {plate_mm:.2} mm on the plate, and lie off one sheet by {rms_mm:.2} mm rms (limit {limit_mm:.2} mm); align them \
         again, scan in one pass, or check the focal length"
    )]
    PassesApart {
        /// Standard deviation across the hanging cloth.
        hanging_mm: f64,
        /// The same on the plate.
        plate_mm: f64,
        /// Root mean square distance.
        rms_mm: f64,
        /// Largest accepted.
        limit_mm: f64,
    },
    /// The fitted sheet and the scanned points disagree nearly everywhere, by less than the noise
    /// of single points.
    #[error(
        "the scan's noise of {noise_mm:.1} mm blurs the cloth's folds: nearly everywhere the fitted sheet lies off the \
         points, {rms_mm:.2} mm rms (limit {limit_mm:.2} mm); scan from nearer, or with a sensor of less noise"
    )]
    TooNoisy {
        /// Noise of single points.
        noise_mm: f64,
        /// Root mean square distance.
        rms_mm: f64,
        /// Largest accepted.
        limit_mm: f64,
    },
    /// The fitted sheet and the scanned points disagree in some places.
    #[error(
        "the fitted sheet is {rms_mm:.2} mm rms off the scanned cloth (limit {limit_mm:.2} mm), most towards \
         {bearing_deg:.0} degrees: the cloth is creased or touches itself or something else there; lay \
         the specimen again"
    )]
    Misfit {
        /// Root mean square distance.
        rms_mm: f64,
        /// Largest accepted.
        limit_mm: f64,
        /// Where it is worst.
        bearing_deg: f64,
    },
}

/// A place on the rim, as seen from the plate's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its bearing, see [`super::frame::Bearing`].
    pub bearing_deg: f64,
    /// Its width; 0 if not known \[degrees\].
    pub arc_deg: f64,
}

/// What points that far apart would be in a likelier unit, for a message.
fn in_other_unit(spacing_mm: f64, likelier: Option<[LengthUnit; 2]>) -> String {
    likelier.map_or(String::new(), |[given, other]| {
        let there_mm = spacing_mm * other.metres() / given.metres();
        format!(
            ", or give --unit {} in place of {}, in which they lie {there_mm:.1} mm apart",
            other.name(),
            given.name()
        )
    })
}

impl ScanError {
    /// What was measured, without the remedy.
    fn brief(&self) -> String {
        match self {
            Self::WrongSize { side_mm, expected_side_mm, .. } => format!(
                "the cloth reads as a square of {side_mm:.0} mm ({expected_side_mm:.0} expected)"
            ),
            other => other.to_string().split(';').next().unwrap_or_default().to_owned(),
        }
    }

    /// What is wrong with the drape, where sparse points or coarse coordinates are to blame for it.
    #[must_use]
    pub fn follows(&self) -> &Self {
        match self {
            Self::TooSparse { cause, .. } | Self::TooCoarse { cause, .. } => cause.follows(),
            error => error,
        }
    }

    /// The likeliest place for a drape, where none was found.
    pub(super) fn candidate(&self) -> Option<&PlateCandidate> {
        match self.follows() {
            Self::NoPlate { why, .. } => why.candidate(),
            _ => None,
        }
    }

    /// Where it is that something is missing or wrong, if it is one place.
    #[must_use]
    pub fn place(&self) -> Option<Place> {
        let (bearing_deg, arc_deg) = match *self.follows() {
            Self::HiddenRim { bearing_deg, arc_deg, .. } => (bearing_deg, arc_deg),
            Self::MarkUnclear { bearing_deg, .. }
            | Self::NotASquare { bearing_deg, .. }
            | Self::SideLength { bearing_deg, .. }
            | Self::UnevenSides { bearing_deg, .. }
            | Self::Gap { bearing_deg, .. }
            | Self::TooLittleRim { bearing_deg, .. }
            | Self::Unexplained { bearing_deg, .. }
            | Self::Misfit { bearing_deg, .. } => (bearing_deg, 0.0),
            _ => return None,
        };
        Some(Place { bearing_deg, arc_deg })
    }
}

/// Why a cloth is likely to have the wrong size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeReading {
    /// The plate is off by as much: the scan's scale is.
    Scale,
    /// The plate has its size: the specimen is another one.
    Specimen,
}

impl SizeReading {
    /// What is likely and what to do; sides found and expected, and the plate's radius \[mm\].
    fn remedy(self, [found, expected]: [f64; 2], plate: f64) -> String {
        let share = found / expected;
        let percent = 100.0 * (share - 1.0).abs();
        let way = if share < 1.0 { "small" } else { "large" };
        let rescale = match LIKELY_SCALES.contains(&share) {
            true => format!(", or give --rescale {share:.3}"),
            false => String::new(),
        };
        match self {
            Self::Scale => format!(
                "the plate is off by the same factor, so the scan seems to be {percent:.0} % too {way}; check the \
                 scanner's scale and the file's unit{rescale}. If the things themselves are of that \
                 size, give --specimen-size {found:.0} --plate-radius {:.0} to inspect or boundary",
                plate * share
            ),
            Self::Specimen => format!(
                "the plate is of the size expected ({plate:.0} mm), so the specimen seems to be {percent:.0} % \
                 too {way}, or the scan's vertical scale is off; cut one of {expected:.0} mm and check the \
                 scale, or give --specimen-size {found:.0} to inspect or boundary"
            ),
        }
    }
}

/// What a scan without a drape has instead.
#[derive(Clone, Debug, PartialEq)]
pub enum NoDrape {
    /// Nearly nothing but planes wider than the specimen.
    WidePlanes {
        /// Their share of the scene.
        percent: f64,
    },
    /// No level patch of the plate's size.
    NoPatch,
    /// Level patches, from none of which a surface falls away.
    NothingFalls,
    /// The likeliest place is not the specimen's.
    NotTheSpecimen(PlateCandidate),
    /// The plate has another radius.
    OtherRadius(PlateCandidate),
}

impl NoDrape {
    /// The place that was likeliest, if there is one.
    #[must_use]
    pub fn candidate(&self) -> Option<&PlateCandidate> {
        match self {
            Self::NotTheSpecimen(best) | Self::OtherRadius(best) => Some(best),
            Self::WidePlanes { .. } | Self::NoPatch | Self::NothingFalls => None,
        }
    }

    /// What was found, and what to do; the radius looked for \[m\].
    fn says(&self, radius_m: f64, unit: LengthUnit) -> String {
        let radius_mm = radius_m * 1e3;
        let at = |best: &PlateCandidate| {
            let centre: [f64; 3] = (best.centre / unit.metres()).coords.into();
            format!("{} {}", place(&centre, unit), unit.name())
        };
        let help = "If the drape is in the scan, give its position: --plate-near X,Y,Z, --up AXIS or --crop";
        match self {
            Self::WidePlanes { percent } => format!(
                "{percent:.0} % of the scan is a plane wider than the specimen, a table, a board or a wall, and nothing \
                 level of {radius_mm:.0} mm radius stands out of it; scan a drape, or crop the scan to it with --crop"
            ),
            Self::NoPatch => format!(
                "there is no level patch of {radius_mm:.0} mm radius; scan the drape from above too, or give --unit if {} \
                 is wrong. {help}",
                unit.name()
            ),
            Self::NothingFalls => format!(
                "there are flat patches of {radius_mm:.0} mm radius, and from none of them a surface falls away on all \
                 sides, as cloth does from its plate: a board, a box or a table; scan a drape. {help}"
            ),
            Self::NotTheSpecimen(best) if best.beyond > best.short => format!(
                "at the likeliest place, {}, the surface continues beyond the specimen on {:.0} % of the bearings, as a \
                 table, a board or a wall does. {help}",
                at(best),
                best.beyond * 100.0
            ),
            Self::NotTheSpecimen(best) => format!(
                "at the likeliest place, {}, the surface ends before the specimen's edge on {:.0} % of the bearings: \
                 something smaller, or a drape of which too little is seen; scan it from all sides. {help}",
                at(best),
                best.short * 100.0
            ),
            Self::OtherRadius(best) => format!(
                "a cloth hangs at {}, but it leaves its plate at a radius of {:.0} mm, and {radius_mm:.0} are expected; \
                 if the plate has that radius, give --plate-radius {:.0}",
                at(best),
                best.radius_m * 1e3,
                best.radius_m * 1e3
            ),
        }
    }
}

/// A place that was considered as the plate.
#[derive(Clone, Debug, PartialEq)]
pub struct PlateCandidate {
    /// Radius at which the surface leaves the patch's plane \[m\].
    pub radius_m: f64,
    /// The patch's centre, scan's frame \[m\].
    pub centre: Point3,
    /// Its normal, away from where the surface falls.
    pub up: Vector3,
    /// Share of the bearings on which the flattened surface ends short of the specimen's edge,
    pub short: f64,
    /// and beyond it.
    pub beyond: f64,
    /// Share of the bearings on which something is seen a little beyond the plate's edge.
    pub around: f64,
}

/// Coordinates in a file's unit, to a tenth of a millimetre.
fn place(at: &[f64; 3], unit: LengthUnit) -> String {
    format!("({})", written(at, unit).join(", "))
}

/// The same as a flag takes them.
fn as_flag(at: &[f64; 3], unit: LengthUnit) -> String {
    written(at, unit).join(",")
}

fn written(at: &[f64; 3], unit: LengthUnit) -> [String; 3] {
    let decimals = (unit.metres() / 1e-4).log10().ceil() as usize;
    at.map(|c| format!("{c:.decimals$}"))
}

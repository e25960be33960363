//! Several views, or several passes, of one drape as one cloud.
//!
//! In: a set of views with the poses that it states, or the files of passes, whose frames are one
//! up to misses of some 20 mm and 5 degrees, or have nothing to do with each other (see `frames`).
//! Out: their points in one frame, each view brought to the others ([`super::register`]), with a
//! note of what was done with each.
//!
//! A set's poses are first held against other conventions (`Convention`): inverses, millimetres,
//! the other axes of a camera. One is taken in place of what is written where it alone makes the
//! views agree. Views that lie on one another as their poses say are not moved. A view that does
//! not fit is left out by name; where most do not, the input is refused.

use std::path::{Path, PathBuf};

use same_file::is_same_file;

use super::error::IntakeError;
use super::frames::{self, Start};
use super::register::{LEAST_SHARED, Placed, Register, Unfit};
use super::turntable::{self, NotFound};
use crate::base::units::{LIKELY_SCALES, M_PER_MM};
use crate::base::{Isometry3, Point3};
use crate::geom::Cloud;
use crate::io::{
    Fault, Format, Place, ReadError, ReadNotes, ReadOptions, SeenView, SeenViews, Turntable,
    ViewNote, joined_as_posed, opengl, read_scan_with, read_views,
};
use crate::scan::{ScanOptions, likely_unit};

/// Another convention is taken if the views share so many times what they share as they are
/// written, and by the next best one.
const TIMES_SHARED: f64 = 3.0;
/// Poses stay as they are unless a view's misfit shrinks by this factor.
const IMPROVES: f64 = 1.1;
/// A view whose place is not known stays where its pose is, unless others were moved by so many
/// times their misfit.
const TRUSTED_MISFITS: f64 = 2.0;
/// What passes must be, for whoever means other scans.
const ONE_DRAPE: &str = "several inputs are recordings of one drape that nothing has touched; `batch FOLDER` takes \
                         scans of several drapes, and `estimate --with MORE` other drops of the fabric";
/// What a turntable's views must be.
const TURNTABLE: &str = "let the drape turn by equal steps, with the camera at rest and the views in order, and \
                         say the step (turntable_step_deg)";
/// What views with poses must be.
const POSED: &str = "give poses to 20 mm and 5 degrees, and let nothing move between views";
/// Points of a view that say how far it was moved.
const ASKED: usize = 1000;

/// Reads a scan, be it one file, a set of views, or several passes. Views are in metres; passes are
/// in the unit and the frame of the first.
///
/// # Errors
/// When a file cannot be read, or most of the views or passes do not lie on one another.
pub fn read(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(Cloud, ReadNotes), IntakeError> {
    let (mut cloud, mut notes) = if !read.passes.is_empty() {
        of_passes(path, read, options)?
    } else if let Some(seen) = read_views(path, read) {
        let SeenViews { views, turntable } = seen?;
        match turntable {
            Some(turntable) => of_turntable(path, views, turntable, options)?,
            None => of_views(path, views)?,
        }
    } else {
        read_scan_with(path, read)?
    };
    if let Some(scale) = read.rescale {
        if !LIKELY_SCALES.contains(&scale) {
            let fault = Fault::Layout(format!("a scale of {scale}; give one near 1, like 1.012"));
            return Err(ReadError { path: path.to_owned(), place: Place::File, fault }.into());
        }
        cloud.points.iter_mut().for_each(|p| *p /= scale);
        notes.taken.push(format!("all lengths are divided by {scale}, the scale given"));
    }
    Ok((cloud, notes))
}

/// The views of a set, brought together.
fn of_views(path: &Path, mut views: Vec<SeenView>) -> Result<(Cloud, ReadNotes), ReadError> {
    let register = Register::of(&views);
    let written: Vec<Isometry3> = views.iter().map(|view| view.pose).collect();
    let (poses, convention) = Convention::of(&register, &written);
    for (view, pose) in views.iter_mut().zip(&poses) {
        view.pose = *pose;
    }
    let (cloud, mut notes) = together(path, views, register.settled(&poses), Given::Posed)?;
    notes.taken.extend(convention);
    if notes.views.len() > 1 && notes.views.iter().all(|view| view.misfit_m.is_nan()) {
        let said = "in the poses given no view shares anything with another, so the poses could not be checked";
        notes.taken.push(said.to_owned());
    }
    Ok((cloud, notes))
}

/// The views of a turntable, brought together in the frame of the first.
fn of_turntable(
    path: &Path,
    mut views: Vec<SeenView>,
    given: Turntable,
    options: &ScanOptions,
) -> Result<(Cloud, ReadNotes), ReadError> {
    let fault = |fault: String| {
        let fault = Fault::Layout(format!("its views have no poses, {fault}"));
        ReadError { path: path.to_owned(), place: Place::File, fault }
    };
    let begun = turntable::begin(&mut views, given.step_rad, options).map_err(|why| {
        fault(match (why, given.step_rad) {
            (NotFound::Plate, _) => {
                "and in none of them the plate is seen for sure; go nearer, let the camera see the cloth's top, \
                 or give poses"
                    .to_owned()
            }
            (NotFound::Step, Some(step)) => format!(
                "and a turn of {:.1} degrees does not make neighbours lie on one another; {TURNTABLE}",
                step.to_degrees()
            ),
            (NotFound::Step, None) => format!(
                "and not exactly one turn about the plate's axis makes neighbours lie on one another; {TURNTABLE}"
            ),
        })
    })?;
    for (view, pose) in views.iter_mut().zip(&begun.poses) {
        view.pose = *pose;
    }
    let count = views.len();
    let (cloud, mut notes) =
        together(path, views, begun.register.settled(&begun.poses), Given::Turntable)?;
    notes.taken.push(format!(
        "the views have no poses: they are taken for a turntable's, {count} of them, turned by {:.1} degrees \
         from one to the next",
        begun.step_rad.to_degrees()
    ));
    Ok((cloud, notes))
}

/// A file that is among the passes twice, by any link or spelling.
fn named_twice<'a>(paths: &[&'a Path]) -> Option<&'a Path> {
    let is_before =
        |k: usize| paths[..k].iter().any(|p| is_same_file(p, paths[k]).unwrap_or(false));
    (0..paths.len()).find(|&k| is_before(k)).map(|k| paths[k])
}

/// Passes, brought together in the frame and the unit of the first.
fn of_passes(
    path: &Path,
    read: &ReadOptions,
    options: &ScanOptions,
) -> Result<(Cloud, ReadNotes), ReadError> {
    let own = ReadOptions { passes: Vec::new(), ..read.clone() };
    let paths: Vec<&Path> =
        std::iter::once(path).chain(read.passes.iter().map(PathBuf::as_path)).collect();
    if let Some(again) = named_twice(&paths) {
        let fault = Fault::Layout("is named twice; give each pass once".to_owned());
        return Err(ReadError { path: again.to_owned(), place: Place::File, fault });
    }
    let mut units_m = Vec::with_capacity(paths.len());
    let mut views = Vec::with_capacity(paths.len());
    for path in &paths {
        let (mut cloud, notes) = read_scan_with(path, &own)?;
        let metres = matches!(notes.format, Some(Format::DepthPng | Format::Views));
        let unit_m = if metres { 1.0 } else { likely_unit(&cloud.points, options).metres() };
        cloud.points.iter_mut().for_each(|p| *p *= unit_m);
        units_m.push(unit_m);
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        views.push(SeenView { name, cloud, pose: Isometry3::identity(), notes });
    }
    let register = Register::of(&views);
    let placed = |starts: &[Option<Start>]| {
        let poses: Option<Vec<Isometry3>> =
            starts.iter().map(|start| Some((*start)?.pose)).collect();
        poses.map(|poses| register.settled(&poses))
    };
    let mut starts = frames::starts(&views, &register, options, false);
    let mut settled = placed(&starts);
    if !settled.as_ref().is_some_and(all_fit) {
        // What they share may be the floor alone.
        let anew = frames::starts(&views, &register, options, true);
        if let Some(fitting) = placed(&anew).filter(all_fit) {
            (starts, settled) = (anew, Some(fitting));
        }
    }
    for (view, start) in views.iter_mut().zip(&starts) {
        let Some(start) = start else { return Err(elsewhere(path, &view.name)) };
        view.pose = start.pose;
        if start.or_half_round {
            let said =
                format!("{} fits half a turn round about as well, since the drape does", view.name);
            view.notes.taken.push(said);
        }
    }
    // The unit is the first's again, which is guessed or given, unless that was metres for sure.
    let format = views.first().and_then(|first| first.notes.format);
    let format = format.filter(|format| *format != Format::DepthPng).or(Some(Format::Views));
    let (mut cloud, notes) = together(path, views, settled.unwrap_or_default(), Given::Passes)?;
    let unit_m = units_m.first().copied().unwrap_or(1.0);
    cloud.points.iter_mut().for_each(|p| *p /= unit_m);
    Ok((cloud, ReadNotes { format, ..notes }))
}

/// What is brought together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Given {
    /// Views with poses.
    Posed,
    /// Views of a turntable.
    Turntable,
    /// Passes.
    Passes,
}

/// Views with their places, and why one is not to be used.
type Settled = Vec<(Placed, Option<Unfit>)>;

fn all_fit(settled: &Settled) -> bool {
    settled.iter().all(|(_, fault)| fault.is_none())
}

/// A pass whose frame is another one, and could not be found.
fn elsewhere(path: &Path, name: &str) -> ReadError {
    let fault = Fault::Layout(format!(
        "{name} lies elsewhere, and its place on the other passes is not found: its plate is not seen, or the drape \
         looks alike from several sides; {ONE_DRAPE}"
    ));
    ReadError { path: path.to_owned(), place: Place::File, fault }
}

/// The views as one cloud: moved where that makes them agree better, without those that do not fit.
fn together(
    path: &Path,
    mut views: Vec<SeenView>,
    settled: Settled,
    given: Given,
) -> Result<(Cloud, ReadNotes), ReadError> {
    let posed = given == Given::Posed;
    let begun: Vec<Isometry3> = views.iter().map(|view| view.pose).collect();
    let (placed, faults): (Vec<Placed>, Vec<Option<Unfit>>) = settled.into_iter().unzip();
    let improves = |view: &Placed| view.before.misfit_m > IMPROVES * view.after.misfit_m;
    let moves = placed.iter().zip(&faults).any(|(view, fault)| fault.is_none() && improves(view));
    // The first pass stays where it is: what a caller says of places and directions is of its
    // frame.
    let back = match (begun.first(), placed.first()) {
        (Some(begun), Some(first)) if !posed => begun * first.pose.inverse(),
        _ => Isometry3::identity(),
    };
    let ended = |k: usize| if moves { back * placed[k].pose } else { begun[k] };
    let poses: Vec<Isometry3> = (0..views.len()).map(ended).collect();
    let stated = |k: usize| if posed { begun[k] } else { Isometry3::identity() };
    let moved_m = |k: usize| moved_m(&views[k].cloud.points, &stated(k), &poses[k]);
    let fit = (0..views.len()).filter(|&k| faults[k].is_none());
    let trusts =
        posed && fit.clone().all(|k| moved_m(k) < TRUSTED_MISFITS * placed[k].after.misfit_m);
    let notes: Vec<ViewNote> = (0..views.len())
        .map(|k| {
            let why = match faults[k] {
                Some(Unfit::Apart) => Some("does not lie on the others"),
                Some(Unfit::Loose) if !trusts => Some("shares too little with the others"),
                _ => None,
            };
            ViewNote {
                name: views[k].name.clone(),
                moved_m: moved_m(k),
                turned_rad: poses[k].rotation.angle_to(&stated(k).rotation),
                misfit_before_m: placed[k].before.misfit_m,
                misfit_m: if moves { placed[k].after.misfit_m } else { placed[k].before.misfit_m },
                left_out: why.map(str::to_owned),
            }
        })
        .collect();
    let left_out = notes.iter().filter(|note| note.left_out.is_some()).count();
    if 2 * left_out > views.len() || (!posed && left_out + 1 >= views.len()) {
        return Err(refusal(path, &notes, given));
    }
    for (k, view) in views.iter_mut().enumerate() {
        // A loose view stays where its pose is.
        if faults[k].is_none() {
            view.pose = poses[k];
        }
    }
    let mut stays = notes.iter().map(|note| note.left_out.is_none());
    views.retain(|_| stays.next() != Some(false));
    let joined = joined_as_posed(views).ok_or_else(|| refusal(path, &notes, given));
    joined.map(|(cloud, read)| (cloud, ReadNotes { views: notes, ..read }))
}

/// How far points are moved from one pose to another, root mean square \[m\].
fn moved_m(points: &[Point3], from: &Isometry3, to: &Isometry3) -> f64 {
    let stride = points.len().div_ceil(ASKED).max(1);
    let asked = || points.iter().step_by(stride);
    let sum: f64 = asked().map(|p| (to * p - from * p).norm_squared()).sum();
    (sum / asked().count().max(1) as f64).sqrt()
}

fn refusal(path: &Path, notes: &[ViewNote], given: Given) -> ReadError {
    let off = |note: &ViewNote| {
        let why = note.left_out.as_deref()?;
        let misfit = match note.misfit_m {
            misfit if misfit.is_finite() => format!(" ({:.1} mm off)", misfit / M_PER_MM),
            _ => String::new(),
        };
        Some(format!("{} {why}{misfit}", note.name))
    };
    let off: Vec<String> = notes.iter().filter_map(off).collect();
    let (parts, remedy) = match given {
        Given::Posed => ("views", POSED),
        Given::Turntable => ("views", TURNTABLE),
        Given::Passes => ("passes", ONE_DRAPE),
    };
    let fault = Fault::Layout(format!(
        "{} of {} {parts} do not lie on one another: {}; {remedy}",
        off.len(),
        notes.len(),
        off.join("; ")
    ));
    ReadError { path: path.to_owned(), place: Place::File, fault }
}

/// Another way to read a set's poses.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Convention {
    inverse: bool,
    /// Metres in the unit of the shifts.
    shift_m: f64,
    /// Whether the camera's other axes are meant.
    axes: bool,
}

impl Convention {
    const AS_WRITTEN: Self = Self { inverse: false, shift_m: 1.0, axes: false };

    fn all() -> impl Iterator<Item = Self> {
        let flags = [false, true];
        flags.into_iter().flat_map(move |inverse| {
            [1.0, M_PER_MM].into_iter().flat_map(move |shift_m| {
                flags.into_iter().map(move |axes| Self { inverse, shift_m, axes })
            })
        })
    }

    /// The poses by the one convention with which the views agree, and what to say of it; as
    /// written where that agrees or none does.
    fn of(register: &Register, written: &[Isometry3]) -> (Vec<Isometry3>, Option<String>) {
        let as_written = register.shared(written);
        if written.len() < 2 || as_written > TIMES_SHARED * LEAST_SHARED {
            return (written.to_vec(), None);
        }
        let others = Self::all().filter(|other| *other != Self::AS_WRITTEN);
        let mut shared: Vec<(f64, Self)> =
            others.map(|other| (register.shared(&other.poses(written)), other)).collect();
        shared.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        match shared[..] {
            [(best, other), (next, _), ..]
                if best >= LEAST_SHARED && best >= TIMES_SHARED * as_written.max(next) =>
            {
                let said = format!(
                    "the poses are taken {}: so the views share {:.0} % of what they see, as written {:.0} %",
                    other.words(),
                    100.0 * best,
                    100.0 * as_written
                );
                (other.poses(written), Some(said))
            }
            _ => (written.to_vec(), None),
        }
    }

    fn poses(self, written: &[Isometry3]) -> Vec<Isometry3> {
        let axes = if self.axes { opengl() } else { Isometry3::identity() };
        let read = |pose: &Isometry3| {
            let mut pose = *pose;
            pose.translation.vector *= self.shift_m;
            (if self.inverse { pose.inverse() } else { pose }) * axes
        };
        written.iter().map(read).collect()
    }

    fn words(self) -> String {
        let mut words = Vec::new();
        if self.inverse {
            words.push("as camera_from_world");
        }
        if self.shift_m != 1.0 {
            words.push("with shifts in mm");
        }
        if self.axes {
            words.push("with the other camera_axes");
        }
        words.join(", ")
    }
}

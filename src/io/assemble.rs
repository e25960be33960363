//! The last step of each reader: from what the file says to a checked cloud. Points that are in
//! memory already take the same step.

use super::{At, Fault, Format};
use crate::base::Point3;
use crate::geom::Cloud;

/// Coordinates beyond this are no positions but sentinels (sensors write 1e38
/// for "nothing seen"), and their squares would overflow later. In the file's
/// unit: a thousand kilometres in millimetres.
pub const LARGEST_COORDINATE: f64 = 1e9;

/// What a reader left out, and what it read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadNotes {
    /// The format; `None` for points that were in memory.
    pub format: Option<Format>,
    /// Points in the file, the dropped ones included.
    pub points_in_file: usize,
    /// Points dropped: NaN, infinite, beyond [`LARGEST_COORDINATE`], or invalid (E57) or withheld
    /// (LAS) as the file says.
    pub dropped_non_finite: usize,
    /// Pixels of depth images dropped beside depth jumps, if that was asked for.
    pub dropped_jumps: usize,
    /// Triangles dropped because they touch a dropped point.
    pub dropped_triangles: usize,
    /// Triangles dropped because they name a vertex twice.
    pub degenerate_triangles: usize,
    /// Names of the file's elements and properties that were not used.
    pub ignored: Vec<String>,
    /// What was taken where the file does not say it plainly, a sentence each.
    pub taken: Vec<String>,
    /// What was done with each view, of several that were brought together.
    pub views: Vec<ViewNote>,
}

/// How a view was brought to the others.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewNote {
    /// Its file's name.
    pub name: String,
    /// How far its points were moved, root mean square \[m\].
    pub moved_m: f64,
    /// By what angle it was turned \[rad\].
    pub turned_rad: f64,
    /// How far its points lay from the other views, robustly \[m\]; NaN if they share none,
    pub misfit_before_m: f64,
    /// and how far they lie.
    pub misfit_m: f64,
    /// Why it was left out; `None` if it was not.
    pub left_out: Option<String>,
}

/// What a file says, unchecked.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) points: Vec<Point3>,
    /// Empty, or one per point.
    pub(super) colors: Vec<[u8; 3]>,
    pub(super) faces: Faces,
    pub(super) ignored: Vec<String>,
    /// See [`ReadNotes::taken`].
    pub(super) taken: Vec<String>,
    /// Pixels of a depth image that were left out beside depth jumps.
    pub(super) dropped_jumps: usize,
}

/// Polygons, cut into fans of triangles.
#[derive(Debug, Default)]
pub(super) struct Faces {
    triangles: Vec<[u32; 3]>,
    /// The face, counted from 1, of each triangle.
    face_of: Vec<u32>,
    /// Faces so far.
    count: u32,
}

impl Faces {
    /// Adds a polygon; fewer than three corners make no triangle.
    pub(super) fn push(&mut self, corners: &[u32]) {
        self.count = self.count.saturating_add(1);
        if let [first, rest @ ..] = corners {
            for pair in rest.windows(2) {
                self.triangles.push([*first, pair[0], pair[1]]);
                self.face_of.push(self.count);
            }
        }
    }

    /// Triangles so far.
    pub(super) fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of all triangles.
    pub(super) fn corners(&self) -> impl Iterator<Item = &u32> {
        self.triangles.iter().flatten()
    }

    /// The number of the next face, counted from 1.
    pub(super) fn next_number(&self) -> usize {
        self.count as usize + 1
    }
}

/// Drops what is no point, remaps the triangles, refuses what cannot be meant.
pub(super) fn finish(raw: Raw, format: Format) -> Result<(Cloud, ReadNotes), At> {
    let points_in_file = raw.points.len();
    if points_in_file == 0 {
        return Err(Fault::NoPoints.anywhere());
    }
    check_faces(&raw.faces, points_in_file, Some(format))?;
    kept(raw, Some(format))
}

/// Points in memory, checked as those of a file are: what is no point is dropped, with the
/// triangles that touch it, and noted. Colours are none, or one for each point.
///
/// # Errors
/// No points, none that is finite, colours that are more or fewer than the points, a triangle that
/// names a point that is not there.
pub fn checked(cloud: Cloud) -> Result<(Cloud, ReadNotes), Fault> {
    let Cloud { points, colors, triangles } = cloud;
    if points.is_empty() {
        return Err(Fault::NoPoints);
    }
    if !colors.is_empty() && colors.len() != points.len() {
        return Err(Fault::Colors { colors: colors.len(), points: points.len() });
    }
    let mut faces = Faces::default();
    triangles.iter().for_each(|triangle| faces.push(triangle));
    let raw = Raw { points, colors, faces, ..Raw::default() };
    let found = check_faces(&raw.faces, raw.points.len(), None).and_then(|()| kept(raw, None));
    found.map_err(|at| at.fault)
}

/// Drops what is no point and remaps the triangles.
fn kept(raw: Raw, format: Option<Format>) -> Result<(Cloud, ReadNotes), At> {
    let points_in_file = raw.points.len();
    const GONE: u32 = u32::MAX;
    let valid = |p: &Point3| p.iter().all(|c| c.abs() <= LARGEST_COORDINATE);
    let mut kept = 0_u32;
    let new_index: Vec<u32> = raw
        .points
        .iter()
        .map(|point| {
            let index = if valid(point) { kept } else { GONE };
            kept = kept.saturating_add(u32::from(index != GONE));
            index
        })
        .collect();
    if kept == 0 {
        return Err(Fault::NoFinitePoints { count: points_in_file }.anywhere());
    }
    let mut notes = ReadNotes {
        format,
        points_in_file,
        dropped_non_finite: points_in_file - kept as usize,
        dropped_jumps: raw.dropped_jumps,
        dropped_triangles: 0,
        degenerate_triangles: 0,
        ignored: raw.ignored,
        taken: raw.taken,
        views: Vec::new(),
    };
    let mut triangles = raw.faces.triangles;
    triangles.retain_mut(|triangle| {
        *triangle = triangle.map(|vertex| new_index[vertex as usize]);
        let [a, b, c] = *triangle;
        let (gone, degenerate) = (triangle.contains(&GONE), a == b || b == c || c == a);
        notes.dropped_triangles += usize::from(gone);
        notes.degenerate_triangles += usize::from(degenerate && !gone);
        !gone && !degenerate
    });
    let (mut points, mut colors) = (raw.points, raw.colors);
    if notes.dropped_non_finite > 0 {
        let mut at = 0;
        colors.retain(|_| {
            at += 1;
            new_index[at - 1] != GONE
        });
        points.retain(valid);
    }
    Ok((Cloud { points, colors, triangles }, notes))
}

fn check_faces(faces: &Faces, vertices: usize, format: Option<Format>) -> Result<(), At> {
    let from = i64::from(format == Some(Format::Obj));
    for (triangle, &face) in faces.triangles.iter().zip(&faces.face_of) {
        if let Some(&index) = triangle.iter().find(|&&index| index as usize >= vertices) {
            let index = i64::from(index) + from;
            return Err(Fault::FaceIndex { face: face as usize, index, vertices }.anywhere());
        }
    }
    Ok(())
}

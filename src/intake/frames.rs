//! Frames of passes that have nothing to do with each other: an app begins each recording in
//! another one.
//!
//! In: passes in metres, each in its own frame. Out: for each a pose in the first one's frame from
//! which [`Register`] continues. Passes that agree as they are keep their frames. Of others the
//! plate is found, whose middle and axis leave a turn open; the turn is tried all round.

use nalgebra::{Translation3, UnitQuaternion};
use rayon::prelude::*;

use super::register::{LEAST_SHARED, Placed, Register};
use crate::base::{Isometry3, Vector3};
use crate::io::SeenView;
use crate::scan::{FoundPlate, ScanOptions, plate_of};

/// Turns that are tried: every 5 degrees, between which folds still overlap.
const TURNS: usize = 72;
/// Of these the best are followed to their end.
const FOLLOWED: usize = 6;
/// Ends are one if they are turned by less than this against each other \[rad\].
pub(super) const SAME_RAD: f64 = 0.05;
/// The best end's misfit is less than this share of any other's \[-\].
pub(super) const BETTER: f64 = 0.8;

/// Where a pass begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// The first pass's frame from its own.
    pub pose: Isometry3,
    /// Whether it fits half a turn round about as well: so does the drape, and one is as good as
    /// the other.
    pub or_half_round: bool,
}

/// A start for each pass; `None` for a pass whose place among the others is not found. Where the
/// frames are held to have nothing to do with each other (`anew`), none is kept.
pub(super) fn starts(
    views: &[SeenView],
    register: &Register,
    options: &ScanOptions,
    anew: bool,
) -> Vec<Option<Start>> {
    let still = Start { pose: Isometry3::identity(), or_half_round: false };
    let mut starts: Vec<Option<Start>> = vec![None; views.len()];
    let Some(first) = starts.first_mut() else { return starts };
    *first = Some(still);
    let pair = |known: usize, pass: usize| register.some(&[known, pass]);
    let agrees = |starts: &[Option<Start>], pass: usize| {
        let known = (0..starts.len()).filter(|&k| starts[k].is_some());
        let shared = |k: usize| pair(k, pass).shared(&[Isometry3::identity(); 2]);
        starts[pass].is_none() && known.map(shared).any(|shared| shared >= LEAST_SHARED)
    };
    while let Some(pass) = (0..views.len()).find(|&pass| !anew && agrees(&starts, pass)) {
        starts[pass] = Some(still);
    }
    if starts.iter().all(Option::is_some) {
        return starts;
    }
    let plates: Vec<Option<FoundPlate>> =
        views.par_iter().map(|view| plate_of(&view.cloud.points, options)).collect();
    for pass in 0..views.len() {
        let known = (0..views.len()).filter(|&k| starts[pass].is_none() && starts[k].is_some());
        let mut found = known.filter_map(|known| {
            let (plate, own) = (plates[known].as_ref()?, plates[pass].as_ref()?);
            let start = turned(&pair(known, pass), plate, own)?;
            Some(Start { pose: starts[known]?.pose * start.pose, ..start })
        });
        if let Some(start) = found.next() {
            starts[pass] = Some(start);
        }
    }
    starts
}

/// The second of two passes in the first one's frame, both about their plates.
fn turned(pair: &Register, plate: &FoundPlate, own: &FoundPlate) -> Option<Start> {
    let upright = UnitQuaternion::rotation_between(&own.up, &plate.up)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&level(&own.up), std::f64::consts::PI));
    let axis = nalgebra::Unit::new_normalize(plate.up);
    let pose = |turn: usize| {
        let angle = turn as f64 * std::f64::consts::TAU / TURNS as f64;
        let rotation = UnitQuaternion::from_axis_angle(&axis, angle) * upright;
        Translation3::from(plate.centre.coords) * rotation * Translation3::from(-own.centre.coords)
    };
    let poses: Vec<Isometry3> = (0..TURNS).map(pose).collect();
    let still = Isometry3::identity();
    let shared: Vec<f64> = poses.par_iter().map(|pose| pair.shared(&[still, *pose])).collect();
    let mut best: Vec<usize> = (0..TURNS).collect();
    best.sort_by(|&a, &b| shared[b].total_cmp(&shared[a]));
    let ended = |&turn: &usize| pair.second(&poses[turn]);
    let mut ends: Vec<(Isometry3, Placed)> = best.par_iter().take(FOLLOWED).map(ended).collect();
    ends.retain(|(_, end)| end.after.shared >= LEAST_SHARED && end.after.misfit_m.is_finite());
    ends.sort_by(|(_, a), (_, b)| a.after.misfit_m.total_cmp(&b.after.misfit_m));
    let (pose, placed) = ends.first()?;
    let by_rad = |other: &Isometry3| (pose.rotation.inverse() * other.rotation).angle();
    let others = ends.iter().filter(|(other, _)| by_rad(other) > SAME_RAD);
    // A stiff square looks alike from four sides. From two it is one drape all the same.
    let near = |end: &Placed| placed.after.misfit_m > BETTER * end.after.misfit_m;
    let half_round = |other: &Isometry3| by_rad(other) > std::f64::consts::PI - SAME_RAD;
    let mut alike = others.filter(|(_, end)| near(end)).peekable();
    let or_half_round = alike.peek().is_some();
    alike.all(|(other, _)| half_round(other)).then_some(Start { pose: *pose, or_half_round })
}

/// A direction at right angles to another.
pub(super) fn level(up: &Vector3) -> nalgebra::Unit<Vector3> {
    let other = if up.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    nalgebra::Unit::new_normalize(up.cross(&other))
}

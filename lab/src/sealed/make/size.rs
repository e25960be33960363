//! How far the effects of a case move what is measured of a drape.

use crate::sealed::case::Case;
use crate::sealed::remaining::{Moved, at_rest, of_outline, of_scan};
use scan2params::base::boundary::POINTS;
use scan2params::base::{Outline, Vector3};
use scan2params::calibrate::floor::distance_m;
use scan2params::calibrate::manifest::Bench;
use scan2params::calibrate::options::FitOptions;
use scan2params::calibrate::prediction::{Prediction, outline_seen};
use scan2params::fabric::STIFFNESSES;
use scan2params::sim::{Drape, FollowOptions, Follower, Setup, Stop};

/// Parts of the effects that are taken away to see how far they move an outline: the first that
/// keeps to the branch counts.
const TAKEN_AWAY: [f64; 2] = [0.2, 0.05];

/// Root mean square distance that the effects move a drape's outline or rim by \[m\], from a part
/// of them, and the moves of what is measured of it, where it has sensitivities.
pub(super) fn size_of(
    case: &Case,
    drape: &Drape,
    follower: &mut Follower,
) -> Option<(f64, Option<Moved>)> {
    if case.effects.is_empty() {
        return None;
    }
    let plain = Setup { fabric: case.fabric, experiment: case.plain() };
    let here = follower.keep();
    let (now, part) = TAKEN_AWAY.into_iter().find_map(|part| {
        follower.return_to(&here);
        let to = follower.setup().between(&plain, part);
        let way = follower.follow(&to, &FollowOptions::default()).ok()?;
        let kept = way.reached >= 1.0 && way.stop == Stop::AtRest && way.events.is_empty();
        kept.then(|| (follower.drape(), part))
    })?;
    follower.return_to(&here);
    let prediction = at_rest(follower, case.bench);
    let moved = prediction.map(|prediction| moved_by(case, &prediction, &now, part));
    Some((size_m(case, drape, &now, part), moved))
}

/// Root mean square distance of a drape from one with a part of the effects taken away, as if it
/// were all of them \[m\].
fn size_m(case: &Case, drape: &Drape, now: &Drape, part: f64) -> f64 {
    let moved_m = match case.bench {
        Bench::Cusick => distance_m(&seen(case, drape, 1.0), &seen(case, now, 1.0 - part)),
        Bench::Square => {
            let rim = |drape: &Drape, share: f64| -> Vec<Vector3> {
                let scale = 1.0 + share * case.scale_by();
                drape.boundary.positions_m().map(|p| p.coords * scale).collect()
            };
            let both = rim(drape, 1.0).into_iter().zip(rim(now, 1.0 - part));
            let squared: f64 = both.map(|(a, b)| (a - b).norm_squared()).sum();
            (squared / POINTS as f64).sqrt()
        }
    };
    moved_m / part
}

/// The outline of a drape in a picture with a share of the effects.
fn seen(case: &Case, drape: &Drape, share: f64) -> Outline {
    let scale = 1.0 + share * case.scale_by();
    outline_seen(drape, share * case.per_height()).mapped(|p| p.map(|v| v * scale))
}

/// How what is measured of a drape moves with the effects, a part of which `now` has not.
fn moved_by(case: &Case, prediction: &Prediction, now: &Drape, part: f64) -> Moved {
    let ln = case.fabric.in_si().map(f64::ln);
    let (ln, options) = (&ln[..STIFFNESSES], FitOptions::default());
    let (own, other) = (1.0 + case.scale_by(), 1.0 + (1.0 - part) * case.scale_by());
    match case.bench {
        Bench::Square => {
            let both = prediction.drape.positions_m.iter().zip(&now.positions_m);
            let by: Vec<Vector3> = both.map(|(a, b)| (a * own - b * other) / part).collect();
            of_scan(prediction, &by, ln, &options)
        }
        Bench::Cusick => {
            let other = seen(case, now, 1.0 - part);
            let own = seen(case, &prediction.drape, 1.0);
            let across = own.points_m().iter().map(|&p| other.foot(p).outwards_m / part);
            of_outline(prediction, &across.collect::<Vec<_>>(), ln, &options)
        }
    }
}

//! Where the flat square lies in the parameterised cloth: its rotation and its centre.
//!
//! In: places (u, v) of all surface points in the parameter plane \[m\]. Out: the rotation
//! and shift after which the specimen's sides face +-x and +-z, up to quarter turns.
//! The outline is the farthest reach on each bearing; hidden parts reach less and
//! are outvoted by a bounded loss.

use super::options::ScanOptions;
use super::tuning::{PoseTuning, SquareTuning};

/// The specimen's square in the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Square {
    /// Rotation from the square's axes to the parameter plane's: (u, v) = R (x, z) + c
    /// with R = [[cos, sin], [-sin, cos]], counter-clockwise seen from above.
    pub rotation_rad: f64,
    /// Centre in the parameter plane \[m\].
    pub centre: [f64; 2],
}

impl Square {
    /// Material coordinates of a place in the parameter plane.
    pub fn material(&self, flat: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.rotation_rad.sin_cos();
        let (u, v) = (flat[0] - self.centre[0], flat[1] - self.centre[1]);
        [c * u - s * v, s * u + c * v]
    }

    /// The inverse of [`Square::material`].
    pub fn flat(&self, m: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.rotation_rad.sin_cos();
        [c * m[0] + s * m[1] + self.centre[0], -s * m[0] + c * m[1] + self.centre[1]]
    }

    /// The square that takes material coordinates to their places in the
    /// parameter plane with the least squares; itself if there are none.
    pub fn rotated_to(self, pairs: impl Iterator<Item = ([f64; 2], [f64; 2])> + Clone) -> Self {
        let count = pairs.clone().count() as f64;
        if count == 0.0 {
            return self;
        }
        let sum = pairs
            .clone()
            .fold([0.0; 4], |s, (m, p)| [s[0] + m[0], s[1] + m[1], s[2] + p[0], s[3] + p[1]]);
        let mean = sum.map(|s| s / count);
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (m, p) in pairs {
            let (x, z) = (m[0] - mean[0], m[1] - mean[1]);
            let (u, v) = (p[0] - mean[2], p[1] - mean[3]);
            cosine += x * u + z * v;
            sine += z * u - x * v;
        }
        let rotated = Self { rotation_rad: sine.atan2(cosine), centre: [0.0; 2] };
        let at = rotated.flat([mean[0], mean[1]]);
        Self { centre: [mean[2] - at[0], mean[3] - at[1]], ..rotated }
    }

    /// Derivatives of [`excess`] at material coordinates `m` to rotation and centre.
    fn excess_slope(&self, m: [f64; 2]) -> [f64; 3] {
        let (s, c) = self.rotation_rad.sin_cos();
        if m[0].abs() > m[1].abs() {
            [-m[1], -c, s].map(|d| d * m[0].signum())
        } else {
            [m[0], -s, -c].map(|d| d * m[1].signum())
        }
    }

    /// The corners of a square of this side in the parameter plane, one after another.
    pub fn corners(&self, side_m: f64) -> [[f64; 2]; 4] {
        let half = 0.5 * side_m;
        [[half, -half], [half, half], [-half, half], [-half, -half]].map(|m| self.flat(m))
    }

    /// Bearing in degrees, in the parameter plane, of material coordinates.
    pub fn bearing_deg(&self, material: [f64; 2]) -> f64 {
        ((-material[1]).atan2(material[0]) + self.rotation_rad).to_degrees().rem_euclid(360.0)
    }
}

/// Bearings of the outline.
const BEARINGS: usize = 180;

/// A square, and how well the outline lies on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SquareFit {
    /// The square.
    pub square: Square,
    /// Share of the bearings whose outline lies on it within the tuning's bound.
    pub on_share: f64,
    /// Root mean square distance of the outline from it \[m\].
    pub rms_m: f64,
    /// Where the outline is farthest from it, bearing in the parameter plane \[degrees\].
    pub worst_bearing_deg: f64,
    /// Where the cloth is not seen out to its rim.
    pub hidden: Hidden,
}

/// The square that the outline makes, of any size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Its rotation and centre.
    pub square: Square,
    /// Its side \[m\].
    pub side_m: f64,
}

fn outline(flat: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
    /// A place and its distance from the middle.
    #[derive(Clone, Copy)]
    struct Reach {
        at: [f64; 2],
        radius: f64,
    }
    let mut far = vec![[Reach { at: [0.0; 2], radius: 0.0 }; 3]; BEARINGS];
    for &at in flat {
        let radius = at[0].hypot(at[1]);
        let sector = ((at[1].atan2(at[0]) / std::f64::consts::TAU).rem_euclid(1.0)
            * BEARINGS as f64) as usize;
        let list = &mut far[sector.min(BEARINGS - 1)];
        if radius > list[2].radius {
            list[2] = Reach { at, radius };
            list.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        }
    }
    // The second farthest: one stray does not make an outline.
    far.iter().map(|list| (list[1].radius > 0.0).then_some(list[1].at)).collect()
}

/// Distance of a place outside (+) or inside (-) the square's outline.
fn excess(p: [f64; 2], half: f64) -> f64 {
    p[0].abs().max(p[1].abs()) - half
}

/// Finds the square of side `side_m`.
pub(super) fn find(flat: &[[f64; 2]], side_m: f64, tuning: &SquareTuning) -> SquareFit {
    let half = 0.5 * side_m;
    let outline = outline(flat);
    let points: Vec<[f64; 2]> = outline.iter().copied().flatten().collect();
    let loss = |square: &Square| -> f64 {
        points
            .iter()
            .map(|&p| (excess(square.material(p), half).abs() / tuning.bound_m).min(1.0))
            .sum()
    };
    let mut best = Square { rotation_rad: 0.0, centre: [0.0; 2] };
    let mut least = f64::INFINITY;
    for k in 0..90 {
        for shift in 0..9 {
            let centre = [
                f64::from(shift % 3 - 1) * tuning.start_shift_m,
                f64::from(shift / 3 - 1) * tuning.start_shift_m,
            ];
            let square = Square { rotation_rad: f64::from(k).to_radians(), centre };
            let now = loss(&square);
            if now < least {
                (least, best) = (now, square);
            }
        }
    }
    for round in 0..30 {
        // Gauss-Newton with Cauchy weights, derivative of the active side's distance.
        let scale = if round < 10 { tuning.first_scale_m } else { tuning.scale_m };
        let mut normal = nalgebra::Matrix3::<f64>::identity() * 1e-9;
        let mut right = nalgebra::Vector3::<f64>::zeros();
        for &p in &points {
            let m = best.material(p);
            let residual = excess(m, half);
            let weight = 1.0 / (1.0 + (residual / scale).powi(2));
            let row = nalgebra::Vector3::from(best.excess_slope(m));
            normal += row * row.transpose() * weight;
            right += row * (residual * weight);
        }
        let Some(step) = normal.cholesky().map(|f| f.solve(&right)) else { break };
        best.rotation_rad -= step[0];
        best.centre[0] -= step[1];
        best.centre[1] -= step[2];
    }
    let hidden = hidden_arc(&outline, half - tuning.bound_m);
    describe(best, &points, half, tuning.bound_m, hidden)
}

/// Where a flattened surface ends, against a square: shares of all bearings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    /// Short of its side, or nowhere seen.
    pub short_share: f64,
    /// Beyond it.
    pub beyond_share: f64,
    /// That side \[m\].
    pub side_m: f64,
    /// Log-likelihood ratio of the specimen against anything \[nats\].
    pub nats: f64,
}

/// Where the outline of `flat` ends, against the square of about the specimen's side that fits
/// best.
pub(super) fn ends(flat: &[[f64; 2]], options: &ScanOptions) -> (Square, Ends) {
    let (side_m, tuning) = (options.specimen_side_m, &options.tuning.square);
    let outline = outline(flat);
    let on = |square: Square, side_m: f64| {
        (square, ends_on(&outline, &square, side_m, &options.tuning.pose))
    };
    let nominal = on(find(flat, side_m, tuning).square, side_m);
    // A specimen of another size is one too; what is wrong with it is said later.
    let scaled = measure(flat, side_m, tuning).map(|own| on(own.square, own.side_m));
    let best = scaled.filter(|scaled| scaled.1.nats > nominal.1.nats);
    best.unwrap_or(nominal)
}

/// Where the points of an outline end against a square.
///
/// Short of the side the specimen ends where it is hidden, anything else anywhere; on how large a
/// share of the bearings is not known of either, so that the likelihoods are means over all shares.
fn ends_on(
    outline: &[Option<[f64; 2]>],
    square: &Square,
    side_m: f64,
    tuning: &PoseTuning,
) -> Ends {
    let (half_m, sigma_m) = (0.5 * side_m, tuning.edge_sigma_m);
    let off_m = |p: &Option<[f64; 2]>| p.map_or(-half_m, |p| excess(square.material(p), half_m));
    let off_m: Vec<f64> = outline.iter().map(off_m).collect();
    let count = off_m.len() as f64;
    let normal = |off: f64| {
        (-0.5 * (off / sigma_m).powi(2)).exp() / (sigma_m * std::f64::consts::TAU.sqrt())
    };
    let beyond = 1.0 / (tuning.anywhere_m - half_m).max(sigma_m);
    // Density of the end at `off` of the specimen and of anything, of which a share ends short.
    let specimen = |off: f64, short: f64| {
        let elsewhere = if off < 0.0 { short / half_m } else { tuning.beyond * beyond };
        (1.0 - short) * normal(off) + elsewhere
    };
    let anything =
        |off: f64, short: f64| if off < 0.0 { short / half_m } else { (1.0 - short) * beyond };
    let likelihood = |density: &dyn Fn(f64, f64) -> f64| {
        let nats = (0..SHARES).map(|k| {
            let short = (f64::from(k) + 0.5) / f64::from(SHARES);
            tuning.bearings * off_m.iter().map(|&off| density(off, short).ln()).sum::<f64>() / count
        });
        log_mean_exp(&nats.collect::<Vec<_>>())
    };
    let share = |is: &dyn Fn(f64) -> bool| off_m.iter().filter(|&&o| is(o)).count() as f64 / count;
    let near_m = tuning.near_sigmas * sigma_m;
    Ends {
        short_share: share(&|off| off <= -near_m),
        beyond_share: share(&|off| off >= near_m),
        side_m,
        nats: likelihood(&specimen) - likelihood(&anything),
    }
}

/// Shares of hidden bearings over which a likelihood is taken.
const SHARES: u32 = 10;

/// Logarithm of the mean of what these are the logarithms of.
fn log_mean_exp(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + (logs.iter().map(|log| (log - most).exp()).sum::<f64>() / logs.len() as f64).ln()
}

/// The square that the flattened cloth makes, of a side within the tuning's range about
/// `side_m`; `None` if too little of its outline lies on one.
pub(super) fn measure(flat: &[[f64; 2]], side_m: f64, tuning: &SquareTuning) -> Option<Outline> {
    let points: Vec<[f64; 2]> = outline(flat).into_iter().flatten().collect();
    let mut best = Outline { square: Square { rotation_rad: 0.0, centre: [0.0; 2] }, side_m };
    let mut least = f64::INFINITY;
    let [low, high] = tuning.sides.map(|share| (share * 100.0).round() as i32);
    for (degrees, percent) in
        (0..90).step_by(3).flat_map(|d| (low..=high).step_by(2).map(move |p| (d, p)))
    {
        let square = Square { rotation_rad: f64::from(degrees).to_radians(), centre: [0.0; 2] };
        let side_m = side_m * f64::from(percent) / 100.0;
        let off = |&p: &[f64; 2]| excess(square.material(p), 0.5 * side_m).abs();
        let loss = points.iter().map(|p| (off(p) / tuning.bound_m).min(1.0)).sum();
        if loss < least {
            (least, best) = (loss, Outline { square, side_m });
        }
    }
    for round in 0..30 {
        let scale = if round < 10 { tuning.first_scale_m } else { tuning.scale_m };
        best = refined(&best, &points, scale)?;
    }
    // The steps may have left the range: a plate alone is round, and square enough.
    let is_in_range = (tuning.sides[0]..=tuning.sides[1]).contains(&(best.side_m / side_m));
    // Every side must show itself: half a square would fit many sizes.
    let (mut on, mut all) = ([0_u32; 4], [0_u32; 4]);
    for &p in &points {
        let m = best.square.material(p);
        let side = match (m[0].abs() > m[1].abs(), m[0] > 0.0, m[1] > 0.0) {
            (true, positive, _) => usize::from(positive),
            (false, _, positive) => 2 + usize::from(positive),
        };
        all[side] += 1;
        on[side] += u32::from(excess(m, 0.5 * best.side_m).abs() < tuning.on_outline_m);
    }
    let shown = |side: usize| f64::from(on[side]) >= tuning.least_shown * f64::from(all[side]);
    let whole = points.len() as f64 > tuning.least_outline * BEARINGS as f64;
    (is_in_range && whole && (0..4).all(shown)).then_some(best)
}

/// One Gauss-Newton step of rotation, centre and side, with Cauchy weights.
fn refined(outline: &Outline, points: &[[f64; 2]], scale: f64) -> Option<Outline> {
    let Outline { square, side_m } = *outline;
    let mut normal = nalgebra::Matrix4::<f64>::identity() * 1e-9;
    let mut right = nalgebra::Vector4::<f64>::zeros();
    for &p in points {
        let m = square.material(p);
        let residual = excess(m, 0.5 * side_m);
        let weight = 1.0 / (1.0 + (residual / scale).powi(2));
        let slope = square.excess_slope(m);
        let row = nalgebra::Vector4::new(slope[0], slope[1], slope[2], -0.5);
        normal += row * row.transpose() * weight;
        right += row * (residual * weight);
    }
    let step = normal.cholesky()?.solve(&right);
    let centre = [square.centre[0] - step[1], square.centre[1] - step[2]];
    let square = Square { rotation_rad: square.rotation_rad - step[0], centre };
    Some(Outline { square, side_m: side_m - step[3] })
}

/// Bearings on which the cloth is not seen to its rim.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hidden {
    /// Share of all bearings.
    pub share: f64,
    /// Width of the longest run of them \[degrees\].
    pub arc_deg: f64,
    /// Bearing of its middle in the parameter plane \[degrees\].
    pub bearing_deg: f64,
}

/// Wherever the square's corners lie, its outline is half a side or more from the
/// middle: a bearing that reaches less ends in cloth that was not seen.
fn hidden_arc(outline: &[Option<[f64; 2]>], least_m: f64) -> Hidden {
    let reaches = |p: &[f64; 2]| p[0].hypot(p[1]) > least_m;
    let hidden: Vec<bool> = outline.iter().map(|p| !p.as_ref().is_some_and(reaches)).collect();
    let count = hidden.len();
    let run = |start: usize| (0..count).take_while(|d| hidden[(start + d) % count]).count();
    let longest = (0..count).max_by_key(|&start| run(start)).unwrap_or(0);
    let sector_deg = 360.0 / count as f64;
    let middle = longest as f64 + 0.5 * run(longest) as f64;
    Hidden {
        share: hidden.iter().filter(|h| **h).count() as f64 / count as f64,
        arc_deg: run(longest) as f64 * sector_deg,
        // Sectors count from x to z, bearings the other way.
        bearing_deg: (-middle * sector_deg).rem_euclid(360.0),
    }
}

/// How well the outline's points lie on the square.
fn describe(
    square: Square,
    points: &[[f64; 2]],
    half: f64,
    bound_m: f64,
    hidden: Hidden,
) -> SquareFit {
    let material: Vec<[f64; 2]> = points.iter().map(|&p| square.material(p)).collect();
    let off: Vec<f64> = material.iter().map(|&m| excess(m, half)).collect();
    let on = off.iter().filter(|o| o.abs() < bound_m).count() as f64;
    let worst = (0..off.len()).max_by(|&a, &b| off[a].abs().total_cmp(&off[b].abs()));
    SquareFit {
        square,
        on_share: on / BEARINGS as f64,
        rms_m: (off.iter().map(|o| o * o).sum::<f64>() / off.len().max(1) as f64).sqrt(),
        worst_bearing_deg: worst.map_or(0.0, |k| square.bearing_deg(material[k])),
        hidden,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotated_and_shifted_square_is_found_with_a_quarter_missing() {
        let truth = Square { rotation_rad: 0.4, centre: [3e-3, -2e-3] };
        let mut flat = Vec::new();
        for i in 0..151 {
            for k in 0..151 {
                let (x, z) = (f64::from(i) * 2e-3 - 0.15, f64::from(k) * 2e-3 - 0.15);
                let (s, c) = truth.rotation_rad.sin_cos();
                let p = [c * x + s * z + truth.centre[0], -s * x + c * z + truth.centre[1]];
                if !(p[0] > 0.06 && p[1] > 0.06) {
                    flat.push(p);
                }
            }
        }
        let found = find(&flat, 0.3, &crate::scan::tuning::Tuning::default().square).square;
        let off = (found.rotation_rad - truth.rotation_rad).rem_euclid(std::f64::consts::FRAC_PI_2);
        assert!(off.min(std::f64::consts::FRAC_PI_2 - off) < 3e-3, "{found:?}");
        assert!((found.centre[0] - 3e-3).hypot(found.centre[1] + 2e-3) < 1e-3, "{found:?}");
    }

    #[test]
    fn a_plate_alone_is_no_specimen_of_any_size() {
        let tuning = crate::scan::tuning::Tuning::default().square;
        let grid =
            |half: i32| (-half..=half).flat_map(move |i| (-half..=half).map(move |k| (i, k)));
        let places = |half: i32| grid(half).map(|(i, k)| [i, k].map(|n| f64::from(n) * 1e-3));
        let plate: Vec<[f64; 2]> = places(41).filter(|p| p[0].hypot(p[1]) < 0.041).collect();
        assert!(measure(&plate, 0.3, &tuning).is_none());
        let cut_small: Vec<[f64; 2]> = places(130).collect();
        let found = measure(&cut_small, 0.3, &tuning).unwrap();
        assert!((found.side_m - 0.26).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn the_square_through_pairs_is_exact_without_noise() {
        let truth = Square { rotation_rad: -2.3, centre: [1e-3, 4e-3] };
        let material = [[0.01, 0.0], [-0.02, 0.03], [0.0, -0.04]];
        let start = Square { rotation_rad: 0.0, centre: [0.0; 2] };
        let found = start.rotated_to(material.into_iter().map(|m| (m, truth.flat(m))));
        assert!((found.rotation_rad - truth.rotation_rad).abs() < 1e-12);
        assert!((found.centre[0] - 1e-3).hypot(found.centre[1] - 4e-3) < 1e-12);
    }

    #[test]
    fn the_hidden_arc_is_named() {
        // Sector k of 180 spans 2k degrees from x towards z: bearings 360 - 2k.
        let at = |k: usize| (k as f64 + 0.5) / 180.0 * std::f64::consts::TAU;
        let outline: Vec<Option<[f64; 2]>> = (0..180)
            .map(|k| match k {
                10..40 => None,
                100..105 => Some([0.08, 0.0]),
                _ => Some([0.16 * at(k).cos(), 0.16 * at(k).sin()]),
            })
            .collect();
        let hidden = hidden_arc(&outline, 0.14);
        assert!((hidden.share - 35.0 / 180.0).abs() < 1e-12);
        assert!((hidden.arc_deg - 60.0).abs() < 1e-9 && (hidden.bearing_deg - 310.0).abs() < 1e-9);
    }
}

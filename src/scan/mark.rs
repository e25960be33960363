//! A coloured mark on the specimen: where the warp points.
//!
//! The user colours the middle of one side, the side to which the warp runs: chalk, a
//! stitch, a sticker. In: coloured points of the scene in the local frame, the
//! unrolled cloth and its square, the mark's colour. Out: the bearing in the unrolled
//! plane of the side that carries it.
//!
//! Colours are compared as shares of red, green and blue, which shadows do not
//! change: from the cloth's own colour (the median on the plate) a mark lies towards
//! the mark's. So grey, black and white marks are refused, and marks of the cloth's
//! hue. Colours that are off the cloth do not count.

use std::str::FromStr;

use serde::Serialize;

use super::error::ScanError;
use super::neighbours::Neighbours;
use super::square::Square;
use super::unroll::Unrolled;
use crate::base::Point3;
use crate::numeric::robust;

/// The colour of a mark, red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MarkColor(pub [u8; 3]);

/// Names, with the colours of tape and chalk rather than of screens.
const NAMED: [(&str, [u8; 3]); 7] = [
    ("red", [220, 40, 40]),
    ("orange", [240, 130, 30]),
    ("yellow", [235, 215, 40]),
    ("green", [40, 160, 70]),
    ("cyan", [40, 190, 210]),
    ("blue", [40, 70, 200]),
    ("magenta", [210, 40, 160]),
];
/// Shares of red, green and blue closer than this cannot be told apart.
const LEAST_DIFFERENCE: f64 = 0.10;
/// Darker points have no hue: sum of the three channels.
const DARKEST: f64 = 45.0;
/// Of the way from the cloth's colour to the mark's, a point of the mark has come
/// this far at least,
const LEAST_WAY: f64 = 0.4;
/// and has strayed from it by no more than this share of the way.
const MOST_ASTRAY: f64 = 0.6;
/// Fewer points are no mark.
const LEAST_POINTS: usize = 20;
/// Share of the marked points that must lie towards one side.
const LEAST_SHARE: f64 = 0.8;
/// How far the middle of the mark may lie from the middle of its side, as seen from
/// the specimen's centre \[degrees\]: a mark in a corner tells no side.
const MOST_OFF_DEG: f64 = 30.0;

impl FromStr for MarkColor {
    type Err = String;

    /// A name or `#rrggbb`.
    fn from_str(text: &str) -> Result<Self, String> {
        let named = NAMED.iter().find(|(name, _)| text.eq_ignore_ascii_case(name));
        let hex = || {
            let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
            let channel = |k: usize| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok();
            Some([channel(0)?, channel(1)?, channel(2)?])
        };
        let names = NAMED.map(|named| named.0).join(", ");
        let color = named.map(|named| named.1).or_else(hex);
        let color = color.ok_or_else(|| format!("give #rrggbb or one of {names}"))?;
        let shares = shares(color).unwrap_or([1.0 / 3.0; 3]);
        if distance(shares, [1.0 / 3.0; 3]) < LEAST_DIFFERENCE {
            return Err(format!("{text} has no hue that a shadow keeps; mark in one of {names}"));
        }
        Ok(Self(color))
    }
}

/// Shares of the three channels; `None` of a dark colour.
fn shares(color: [u8; 3]) -> Option<[f64; 3]> {
    let color = color.map(f64::from);
    let sum: f64 = color.iter().sum();
    (sum >= DARKEST).then(|| color.map(|c| c / sum))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// What tells a mark's colour from the cloth's.
struct Hue {
    cloth: [f64; 3],
    way: [f64; 3],
    length: f64,
}

impl Hue {
    fn new(mark: MarkColor, cloth: [f64; 3]) -> Option<Self> {
        let mark = shares(mark.0)?;
        let way = [0, 1, 2].map(|k| mark[k] - cloth[k]);
        let length = distance(mark, cloth);
        (length >= LEAST_DIFFERENCE).then_some(Self { cloth, way, length })
    }

    fn is_mark(&self, color: [u8; 3]) -> bool {
        let Some(shares) = shares(color) else { return false };
        let off = [0, 1, 2].map(|k| shares[k] - self.cloth[k]);
        let along = (0..3).map(|k| off[k] * self.way[k]).sum::<f64>() / self.length;
        let astray = (distance(off, [0.0; 3]).powi(2) - along * along).max(0.0).sqrt();
        along > LEAST_WAY * self.length && astray < MOST_ASTRAY * along
    }
}

/// Points, colours and the unrolled cloth that they lie on.
pub(super) struct Marked<'a> {
    /// Points of the scene, local frame \[m\].
    pub points: &'a [Point3],
    /// Their colours; empty if the file has none.
    pub colors: &'a [[u8; 3]],
    /// The unrolled cloth.
    pub cloth: &'a Unrolled,
    /// Its square.
    pub square: &'a Square,
    /// Farther from the cloth's surface a point is not on it \[m\].
    pub reach_m: f64,
    /// Radius of the plate \[m\].
    pub plate_radius_m: f64,
}

/// The bearing of the side that carries the mark, in the unrolled plane \[degrees\].
pub(super) fn bearing_deg(marked: &Marked, mark: MarkColor) -> Result<f64, ScanError> {
    if marked.colors.is_empty() {
        return Err(ScanError::NoColors);
    }
    let places = places(marked, mark)?;
    if places.len() < LEAST_POINTS {
        return Err(ScanError::NoMark { points: places.len(), limit: LEAST_POINTS });
    }
    // Sides 0 to 3 face +x, -z, -x, +z: bearings 0, 90, 180, 270 of the square.
    let bearing = |p: &[f64; 2]| (-p[1]).atan2(p[0]).to_degrees();
    let side_of = |degrees: f64| (degrees / 90.0).round().rem_euclid(4.0) as usize;
    let mut count = [0_usize; 4];
    places.iter().for_each(|p| count[side_of(bearing(p))] += 1);
    let side = (0..4).max_by_key(|&k| count[k]).unwrap_or(0);
    let share = count[side] as f64 / places.len() as f64;
    let on_side: Vec<&[f64; 2]> = places.iter().filter(|p| side_of(bearing(p)) == side).collect();
    let middle = [0, 1].map(|c| on_side.iter().map(|p| p[c]).sum::<f64>() / on_side.len() as f64);
    let off_deg = (bearing(&middle) - 90.0 * side as f64 + 180.0).rem_euclid(360.0) - 180.0;
    if share < LEAST_SHARE || off_deg.abs() > MOST_OFF_DEG {
        let square_deg = marked.square.turn_rad.to_degrees();
        return Err(ScanError::MarkUnclear {
            share_percent: 100.0 * share,
            limit_percent: 100.0 * LEAST_SHARE,
            off_deg: off_deg.abs(),
            limit_deg: MOST_OFF_DEG,
            bearing_deg: (bearing(&middle) + square_deg).rem_euclid(360.0),
        });
    }
    Ok(90.0 * side as f64 + marked.square.turn_rad.to_degrees())
}

/// Material coordinates of the marked points.
fn places(marked: &Marked, mark: MarkColor) -> Result<Vec<[f64; 2]>, ScanError> {
    let radius_m = 0.8 * marked.plate_radius_m;
    let colored = || marked.points.iter().zip(marked.colors);
    let on_plate = colored().filter(|(p, _)| p.x.hypot(p.z) < radius_m && p.y.abs() < 5e-3);
    let seen: Vec<[f64; 3]> = on_plate.filter_map(|(_, &color)| shares(color)).collect();
    let cloth = [0, 1, 2].map(|k| robust::median(seen.iter().map(|s| s[k]).collect()));
    let [Some(r), Some(g), Some(b)] = cloth else { return Err(ScanError::NoColors) };
    let hue = Hue::new(mark, [r, g, b]).ok_or(ScanError::MarkLikeCloth {
        cloth_percent: [r, g, b].map(|share| (100.0 * share).round() as u8),
    })?;
    let tree = Neighbours::new(&marked.cloth.points);
    let on_cloth = |p: &Point3| {
        let &(i, squared) = tree.nearest(p, 1).first()?;
        (squared < marked.reach_m * marked.reach_m)
            .then(|| marked.square.material(marked.cloth.flat[i]))
    };
    Ok(colored().filter(|(_, c)| hue.is_mark(**c)).filter_map(|(p, _)| on_cloth(p)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_have_names_and_greys_are_none() {
        assert_eq!("Red".parse(), Ok(MarkColor([220, 40, 40])));
        assert_eq!("#0a64ff".parse(), Ok(MarkColor([10, 100, 255])));
        for wrong in ["", "#12", "#12345g", "#808080", "#000000", "white", "#ffffff"] {
            assert!(wrong.parse::<MarkColor>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_mark_is_known_in_light_and_shadow_and_washed_out() {
        let red = MarkColor([220, 40, 40]);
        for cloth in [[70_u8, 110, 185], [230, 230, 225], [60, 60, 60], [180, 170, 120]] {
            let hue = Hue::new(red, shares(cloth).unwrap()).unwrap();
            for light in [1.0, 0.6, 0.35] {
                let lit = |c: [u8; 3]| c.map(|v| (f64::from(v) * light) as u8);
                assert!(hue.is_mark(lit([220, 40, 40])), "{cloth:?} {light}");
                assert!(hue.is_mark(lit([205, 80, 75])), "{cloth:?} {light}");
                for other in [cloth, [205, 205, 200], [95, 85, 75], [40, 160, 70]] {
                    assert!(!hue.is_mark(lit(other)), "{cloth:?} {light} {other:?}");
                }
            }
        }
        assert!(Hue::new(red, shares([200, 45, 40]).unwrap()).is_none());
    }
}

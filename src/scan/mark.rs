//! A coloured mark on the specimen: where the warp points.
//!
//! The user colours the middle of one side, the side to which the warp runs: chalk, a
//! stitch, a sticker. In: coloured points of the scene in the local frame, the
//! parameterised cloth and its square, the mark's colour. Out: where its points lie, from
//! which the bearing of the side that carries it follows.
//!
//! Colours are compared by their chromaticity: from the cloth's own (the median on the
//! plate) a mark lies towards the mark's. So grey, black and white marks are refused, and
//! marks of the cloth's hue. Colours that are off the cloth do not count.

use super::color::{Chromaticity, LEAST_DIFFERENCE, MarkColor, norm};
use super::measured::{MarkedSide, Marking};
use super::parameterisation::Parameterisation;
use super::square::Square;
use super::tuning::MarkTuning;
use crate::base::Point3;
use crate::geom::Neighbours;
use crate::numeric::robust;

/// What tells a mark's colour from the cloth's.
struct Hue {
    cloth: Chromaticity,
    way: [f64; 3],
    length: f64,
}

impl Hue {
    fn new(mark: MarkColor, cloth: Chromaticity) -> Option<Self> {
        let mark = Chromaticity::of(mark.0)?;
        let way = mark.minus(cloth);
        let length = norm(way);
        (length >= LEAST_DIFFERENCE).then_some(Self { cloth, way, length })
    }

    fn is_mark(&self, color: [u8; 3], tuning: &MarkTuning) -> bool {
        let Some(color) = Chromaticity::of(color) else { return false };
        let off = color.minus(self.cloth);
        let along = (0..3).map(|k| off[k] * self.way[k]).sum::<f64>() / self.length;
        let astray = (norm(off).powi(2) - along * along).max(0.0).sqrt();
        along > tuning.least_way * self.length && astray < tuning.most_astray * along
    }
}

/// Points, colours and the parameterised cloth that they lie on.
pub(super) struct Marked<'a> {
    /// Points of the scene, local frame \[m\].
    pub points: &'a [Point3],
    /// Their colours; empty if the file has none.
    pub colors: &'a [[u8; 3]],
    /// The cloth.
    pub cloth: &'a Parameterisation,
    /// Its square.
    pub square: &'a Square,
    /// Farther from the cloth's surface a point is not on it \[m\].
    pub reach_m: f64,
    /// Radius of the plate \[m\].
    pub plate_radius_m: f64,
    /// The constants.
    pub tuning: &'a MarkTuning,
}

/// Looks for the side that carries the mark.
pub(super) fn find(marked: &Marked, mark: MarkColor) -> Marking {
    let Some(cloth) = cloth_color(marked) else { return Marking::NoColors };
    match Hue::new(mark, cloth) {
        Some(hue) => Marking::Side(side(&places(marked, &hue), marked.square)),
        None => {
            Marking::LikeCloth { cloth_percent: cloth.0.map(|share| (100.0 * share).round() as u8) }
        }
    }
}

/// The side on which most of the places lie, given in material coordinates.
fn side(places: &[[f64; 2]], square: &Square) -> MarkedSide {
    // Sides 0 to 3 face +x, -z, -x, +z: bearings 0, 90, 180, 270 of the square.
    let bearing = |p: &[f64; 2]| (-p[1]).atan2(p[0]).to_degrees();
    let side_of = |degrees: f64| (degrees / 90.0).round().rem_euclid(4.0) as usize;
    let mut count = [0_usize; 4];
    places.iter().for_each(|p| count[side_of(bearing(p))] += 1);
    let side = (0..4).max_by_key(|&k| count[k]).unwrap_or(0);
    let share = count[side] as f64 / places.len() as f64;
    let on_side: Vec<&[f64; 2]> = places.iter().filter(|p| side_of(bearing(p)) == side).collect();
    let middle = [0, 1].map(|c| on_side.iter().map(|p| p[c]).sum::<f64>() / on_side.len() as f64);
    let square_deg = square.rotation_rad.to_degrees();
    MarkedSide {
        points: places.len(),
        share,
        off_deg: ((bearing(&middle) - 90.0 * side as f64 + 180.0).rem_euclid(360.0) - 180.0).abs(),
        middle_bearing_deg: (bearing(&middle) + square_deg).rem_euclid(360.0),
        side_bearing_deg: 90.0 * side as f64 + square_deg,
    }
}

/// The cloth's own colour: the median on the plate; `None` without colours there.
fn cloth_color(marked: &Marked) -> Option<Chromaticity> {
    let radius_m = marked.tuning.plate_radii * marked.plate_radius_m;
    let colored = marked.points.iter().zip(marked.colors);
    let on_plate = colored.filter(|(p, _)| p.x.hypot(p.z) < radius_m && p.y.abs() < 5e-3);
    let seen: Vec<Chromaticity> =
        on_plate.filter_map(|(_, &color)| Chromaticity::of(color)).collect();
    let median = |k: usize| robust::median(seen.iter().map(|s| s.0[k]).collect());
    Some(Chromaticity([median(0)?, median(1)?, median(2)?]))
}

/// Material coordinates of the marked points.
fn places(marked: &Marked, hue: &Hue) -> Vec<[f64; 2]> {
    let tree = Neighbours::new(&marked.cloth.points);
    let on_cloth = |p: &Point3| {
        let near = tree.one(p)?;
        (near.distance_sq < marked.reach_m * marked.reach_m)
            .then(|| marked.square.material(marked.cloth.flat[near.index]))
    };
    let colored = marked.points.iter().zip(marked.colors);
    colored
        .filter(|(_, c)| hue.is_mark(**c, marked.tuning))
        .filter_map(|(p, _)| on_cloth(p))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_known_in_light_and_shadow_and_washed_out() {
        let tuning = crate::scan::tuning::Tuning::default().mark;
        let red = MarkColor([220, 40, 40]);
        let hue = |cloth| Hue::new(red, Chromaticity::of(cloth).unwrap());
        for cloth in [[70_u8, 110, 185], [230, 230, 225], [60, 60, 60], [180, 170, 120]] {
            let hue = hue(cloth).unwrap();
            let is_mark = |color| hue.is_mark(color, &tuning);
            for light in [1.0, 0.6, 0.35] {
                let lit = |c: [u8; 3]| c.map(|v| (f64::from(v) * light) as u8);
                assert!(is_mark(lit([220, 40, 40])), "{cloth:?} {light}");
                assert!(is_mark(lit([205, 80, 75])), "{cloth:?} {light}");
                for other in [cloth, [205, 205, 200], [95, 85, 75], [40, 160, 70]] {
                    assert!(!is_mark(lit(other)), "{cloth:?} {light} {other:?}");
                }
            }
        }
        assert!(hue([200, 45, 40]).is_none());
    }
}

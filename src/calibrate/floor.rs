//! How well an outline is known: what two pictures of one drape differ by, and what a drape differs
//! by from its specimen's other face and from other specimens.
//!
//! In: outlines of one fabric, each with its independent unit (specimen and face). Out: for each
//! pair its root mean square distance \[m\], at the best translation, and at the best translation
//! and rotation. Two captures of one unit give the floor: no model of the drape comes nearer to one
//! of them than by this over the square root of two.
//!
//! The distance is that of even points of each outline from the other curve, both ways.

use rayon::prelude::*;

use super::manifest::Face;
use crate::base::Outline;
use crate::numeric::robust;

/// What two outlines of a fabric have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pairing {
    /// The drape: two captures of it.
    Captures,
    /// Specimen and face, dropped anew.
    Drops,
    /// The specimen: its two faces.
    Faces,
    /// The face: two specimens.
    Specimens,
}

impl Pairing {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Captures, Self::Drops, Self::Faces, Self::Specimens];

    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Captures => "captures",
            Self::Drops => "drops",
            Self::Faces => "faces",
            Self::Specimens => "specimens",
        }
    }

    /// Of two outlines of a fabric; `None` for different specimens on different faces, or where one
    /// is unknown.
    #[must_use]
    pub fn of(a: &Observed<'_>, b: &Observed<'_>) -> Option<Self> {
        match (a.unit.0? == b.unit.0?, a.unit.1? == b.unit.1?) {
            (true, true) if a.drape == b.drape => Some(Self::Captures),
            (true, true) => Some(Self::Drops),
            (true, false) => Some(Self::Faces),
            (false, true) => Some(Self::Specimens),
            (false, false) => None,
        }
    }
}

/// An outline with its unit.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// The outline.
    pub outline: &'a Outline,
    /// Specimen and face.
    pub unit: (Option<&'a str>, Option<Face>),
    /// Which drape of them it is: captures of one drape share the number.
    pub drape: usize,
}

/// The distances of pairs of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// What the pairs have in common.
    pub pairing: Pairing,
    /// Number of pairs.
    pub pairs: usize,
    /// Median over the pairs of the root mean square distance at the best translation \[m\].
    pub median_m: f64,
    /// Its 10 % and 90 % quantiles \[m\].
    pub quantiles_m: [f64; 2],
    /// Median at the best translation and rotation, of faces with one of both mirrored \[m\].
    pub turned_median_m: f64,
}

/// The spreads of one fabric's outlines, of each kind of which there is a pair.
#[must_use]
pub fn spreads(outlines: &[Observed<'_>]) -> Vec<Spread> {
    let pairs: Vec<(Pairing, usize, usize)> = (0..outlines.len())
        .flat_map(|a| (a + 1..outlines.len()).map(move |b| (a, b)))
        .filter_map(|(a, b)| Some((Pairing::of(&outlines[a], &outlines[b])?, a, b)))
        .collect();
    let measured: Vec<(Pairing, f64, f64)> = pairs
        .par_iter()
        .map(|&(pairing, a, b)| {
            let (a, b) = (outlines[a].outline, outlines[b].outline);
            (pairing, distance_m(a, b), turned_distance_m(a, b, pairing == Pairing::Faces))
        })
        .collect();
    let of = |pairing: Pairing| {
        let own = || measured.iter().filter(move |(p, ..)| *p == pairing);
        let along: Vec<f64> = own().map(|(_, d, _)| *d).collect();
        let turned: Vec<f64> = own().map(|(.., d)| *d).collect();
        let at = |share: f64| robust::quantile(along.clone(), share);
        Some(Spread {
            pairing,
            pairs: along.len(),
            median_m: at(0.5)?,
            quantiles_m: [at(0.1)?, at(0.9)?],
            turned_median_m: robust::median(turned)?,
        })
    };
    Pairing::ALL.into_iter().filter_map(of).collect()
}

/// Root mean square distance of two outlines at the best translation \[m\].
#[must_use]
pub fn distance_m(a: &Outline, b: &Outline) -> f64 {
    aligned(&centred(a, POINTS), &centred(b, POINTS), false)
}

/// The same at the best translation and rotation; with `mirrored`, of the one and the other seen
/// from below.
#[must_use]
pub fn turned_distance_m(a: &Outline, b: &Outline, mirrored: bool) -> f64 {
    let flip = if mirrored { -1.0 } else { 1.0 };
    let (a, b) = (centred(a, POINTS), centred(b, POINTS));
    let (coarse_a, coarse_b) = (centred(&a, COARSE_POINTS), centred(&b, COARSE_POINTS));
    let turned = |outline: &Outline, step: usize| {
        let (sin, cos) = (std::f64::consts::TAU * step as f64 / TURNS as f64).sin_cos();
        let points = outline.points_m().iter().map(|&[x, z]| {
            let x = flip * x;
            [x * cos - z * sin, x * sin + z * cos]
        });
        Outline::new(points.collect()).unwrap_or_else(|_| outline.clone())
    };
    let coarsely = |step: usize| one_way_sq(&coarse_a, &turned(&coarse_b, step));
    let mut steps: Vec<(usize, f64)> = (0..TURNS).map(|step| (step, coarsely(step))).collect();
    steps.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = steps.iter().take(REFINED_TURNS);
    best.map(|&(step, _)| aligned(&a, &turned(&b, step), true)).fold(f64::INFINITY, f64::min)
}

/// Even points of an outline: one every 2.5 mm or so of a Cusick drape.
const POINTS: usize = 360;
/// Even points for the search over rotations, and its steps.
const COARSE_POINTS: usize = 90;
const TURNS: usize = 90;
/// Rotations that are refined.
const REFINED_TURNS: usize = 3;
/// Rounds of feet and least squares.
const ROUNDS: usize = 12;

/// Even points around the centroid.
fn centred(outline: &Outline, count: usize) -> Outline {
    let [cx, cz] = outline.centroid_m();
    let points = outline.evenly(count).into_iter().map(|[x, z]| [x - cx, z - cz]).collect();
    Outline::new(points).unwrap_or_else(|_| outline.clone())
}

fn one_way_sq(from: &Outline, to: &Outline) -> f64 {
    let points = from.points_m();
    points.iter().map(|&p| to.foot(p).outwards_m.powi(2)).sum::<f64>() / points.len() as f64
}

/// Root mean square distance after moving `b` by the least squares of distances across the curves.
fn aligned(a: &Outline, b: &Outline, rotates: bool) -> f64 {
    let mut moved = b.clone();
    let rms = |b: &Outline| (0.5 * (one_way_sq(a, b) + one_way_sq(b, a))).sqrt();
    let mut best = rms(&moved);
    for _ in 0..ROUNDS {
        let (mut normal, mut right) =
            (nalgebra::Matrix3::<f64>::zeros(), nalgebra::Vector3::zeros());
        for &p in moved.points_m() {
            let foot = a.foot(p);
            let [nx, nz] = foot.normal;
            let row =
                nalgebra::Vector3::new(nx, nz, if rotates { nz * p[0] - nx * p[1] } else { 0.0 });
            normal += row * row.transpose();
            right -= row * foot.outwards_m;
        }
        normal[(2, 2)] += if rotates { 1e-12 } else { 1.0 };
        let Some(factor) = normal.cholesky() else { break };
        let step = factor.solve(&right);
        let (sin, cos) = step[2].sin_cos();
        let next =
            moved.mapped(|[x, z]| [x * cos - z * sin + step[0], x * sin + z * cos + step[1]]);
        let now = rms(&next);
        if now > best - 1e-9 {
            break;
        }
        (best, moved) = (now, next);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy(order: f64, phase: f64, centre: [f64; 2]) -> Outline {
        let point = |k: usize| {
            let t = std::f64::consts::TAU * k as f64 / 900.0;
            let r = 0.12 + 5e-3 * (order * t - phase).cos() + 2e-3 * (2.0 * t - phase).cos();
            [centre[0] + r * t.cos(), centre[1] + r * t.sin()]
        };
        Outline::new((0..900).map(point).collect()).unwrap()
    }

    #[test]
    fn one_drape_moved_is_the_same_and_turned_it_is_so_only_if_it_may_turn() {
        let (a, moved) = (wavy(7.0, 0.0, [0.0; 2]), wavy(7.0, 0.0, [3e-3, -2e-3]));
        // observed: 1e-6 and below
        assert!(distance_m(&a, &moved) < 2e-5, "{}", distance_m(&a, &moved));
        // the same drape, turned by 0.7
        let (sin, cos) = 0.7_f64.sin_cos();
        let turned = a.mapped(|[x, z]| [x * cos - z * sin, x * sin + z * cos]);
        assert!(distance_m(&a, &turned) > 3e-3);
        assert!(turned_distance_m(&a, &turned, false) < 1e-4);
        let mirrored = Outline::new(turned.points_m().iter().map(|&[x, z]| [-x, z]).collect());
        assert!(turned_distance_m(&a, &mirrored.unwrap(), true) < 1e-4);
    }

    #[test]
    fn the_distance_of_two_discs_is_that_of_their_radii() {
        let disc = |r: f64| {
            let at = |k: usize| std::f64::consts::TAU * k as f64 / 900.0;
            Outline::new((0..900).map(|k| [r * at(k).cos(), r * at(k).sin()]).collect()).unwrap()
        };
        assert!((distance_m(&disc(0.12), &disc(0.1215)) - 1.5e-3).abs() < 1e-5);
    }

    #[test]
    fn pairs_are_told_apart_and_what_is_unknown_is_in_none() {
        let (up, down) = (Some(Face::Up), Some(Face::Down));
        let (a, b, c) =
            (wavy(7.0, 0.0, [0.0; 2]), wavy(7.0, 0.1, [0.0; 2]), wavy(6.0, 0.3, [0.0; 2]));
        let of = |outline, specimen, face| Observed { outline, unit: (specimen, face), drape: 0 };
        let all = [
            of(&a, Some("1"), up),
            of(&b, Some("1"), up),
            of(&c, Some("1"), down),
            of(&c, Some("2"), up),
            of(&a, None, up),
            of(&a, Some("3"), None),
        ];
        let found = spreads(&all);
        let pairs: Vec<_> = found.iter().map(|s| (s.pairing, s.pairs)).collect();
        let wanted = [(Pairing::Captures, 1), (Pairing::Faces, 2), (Pairing::Specimens, 2)];
        assert_eq!(pairs, wanted);
        assert!(found[0].median_m < found[2].median_m);
        // the same two, dropped anew between them
        let anew = [all[0], Observed { drape: 1, ..all[1] }];
        let pairs: Vec<_> = spreads(&anew).iter().map(|s| (s.pairing, s.pairs)).collect();
        assert_eq!(pairs, [(Pairing::Drops, 1)]);
    }
}

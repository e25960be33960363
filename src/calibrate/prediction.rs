//! One fabric's drape as it is seen, from above and at its rim, and how it moves with every
//! unknown.
//!
//! In: a sheet at rest. Out: its outline about the plate's axis, the farthest point of cloth at
//! each of [`BEARINGS`] bearings, in the plan of the simulation frame \[m\], and the moves of these
//! points \[m per unit\]. The cloth is the rim's 244 points and the cells that lie wholly on the
//! specimen. Likewise the rim's points themselves, in space.
//!
//! Where springs hold the sheet ([`crate::sim::Hold`]), how far they are stretched on the mean is
//! told with its moves.
//!
//! A point of the outline that is no rim lies where the sheet turns over, and the outline moves
//! there, across itself, as the cloth under it does: the sheet's tangent there is vertical.
//!
//! Where it fails: cloth that hangs back under a fold is not seen, as from above, and an outline
//! that goes back on its bearing is cut off radially.

use crate::base::boundary::POINTS;
use crate::base::{Outline, Surface, Vector3};
use crate::sim::sensitivity::{Parameter, Sensitivity, SensitivityError};
use crate::sim::{Drape, Follower};

use super::measures::each_bearing;

/// Bearings at which the outline is taken: one every half degree.
pub const BEARINGS: usize = 720;

/// A drape seen from above.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The drape.
    pub drape: Drape,
    /// Its outline, a point for each bearing from 0 on.
    pub outline: Outline,
    /// Heights of the outline's points \[m\].
    pub heights_m: Vec<f64>,
    /// Its rim's points \[m\].
    pub rim: Vec<Vector3>,
    /// The places of a scanned sheet that are compared, see [`compared`] \[m\]; none where the rim
    /// alone is.
    pub places: Vec<Vector3>,
    /// How it moves with each parameter asked for.
    pub moves: Vec<Move>,
    /// The springs that hold it; nothing of a sheet that was released.
    pub hold: Held,
    /// Whether its rest is not stable, and its moves those of a sheet that a little inertia holds
    /// there.
    pub is_steadied: bool,
}

/// How a drape's outline moves with a parameter.
#[derive(Clone, Debug)]
pub struct Move {
    /// The parameter.
    pub parameter: Parameter,
    /// Moves of the outline's points in the plan \[m per SI unit\].
    pub outline: Vec<[f64; 2]>,
    /// Moves of the rim's points \[m per SI unit\].
    pub rim: Vec<Vector3>,
    /// Moves of the sheet's places \[m per SI unit\].
    pub places: Vec<Vector3>,
    /// Change of the mean stretch of the springs \[m per SI unit\].
    pub stretch_m: f64,
}

/// How far the springs of a hold are stretched, and how far outwards they pull.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Mean stretch, positive where the cloth lies outwards of where they pull \[m\].
    pub mean_m: f64,
    /// Root mean square stretch \[m\].
    pub rms_m: f64,
    /// How far beyond the outline they pull \[m\].
    pub pull_m: f64,
}

impl Prediction {
    /// Its outline as a camera above the plate's axis sees it, on the plate's face.
    #[must_use]
    pub fn seen_from_above(&self, per_height: f64) -> Outline {
        nearer(&self.outline, &self.heights_m, per_height)
    }

    /// How the rim's points and the places lie in another drape beside this one \[m\].
    pub(super) fn moves_to(&self, drape: &Drape) -> (Vec<Vector3>, Vec<Vector3>) {
        let of = if self.places.is_empty() { Compared::Rim } else { Compared::Sheet };
        let less = |there: Vec<Vector3>, here: &[Vector3]| -> Vec<Vector3> {
            there.iter().zip(here).map(|(there, here)| there - here).collect()
        };
        let (rim, places) = (rim(drape, &drape.positions_m), places(drape, &drape.positions_m, of));
        (less(rim, &self.rim), less(places, &self.places))
    }

    /// How it moves with a parameter that was asked for.
    pub(super) fn with(&self, parameter: Parameter) -> &Move {
        match self.moves.iter().find(|m| m.parameter == parameter) {
            Some(found) => found,
            None => unreachable!("{} was not asked for", parameter.name()),
        }
    }
}

/// The cloth under a point of the outline: on the way from one node to another. Nodes are the rim's
/// points, then the grid's vertices.
#[derive(Clone, Copy, Debug)]
struct Source {
    from: usize,
    to: usize,
    part: f64,
    distance_m: f64,
}

/// What of a drape is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compared {
    /// Its outline or its rim.
    Rim,
    /// The whole sheet as well.
    Sheet,
}

/// Vertices of [`crate::base::Surface`] that are compared with a drape, as warp and weft: every
/// third within the border. Neighbours err alike.
pub fn compared() -> impl Iterator<Item = [usize; 2]> {
    let inside = || (STRIDE..Surface::SIDE - 1).step_by(STRIDE);
    inside().flat_map(move |i| inside().map(move |j| [i, j]))
}

/// Steps of the surface between two places that are compared.
pub const STRIDE: usize = 3;

/// The sheet of `follower` as it is seen.
///
/// # Errors
/// When it is not at a stable rest.
pub fn prediction_of(
    follower: &mut Follower,
    parameters: &[Parameter],
    compared: Compared,
) -> Result<Prediction, SensitivityError> {
    let sensitivities = follower.sensitivities(parameters)?;
    Ok(with_moves(follower, &sensitivities, compared, false))
}

/// The same of a sheet whose rest is not stable ([`Follower::steadied_sensitivities`]).
///
/// # Errors
/// When it is not at rest.
pub(super) fn steadied_prediction_of(
    follower: &mut Follower,
    parameters: &[Parameter],
    compared: Compared,
) -> Result<Prediction, SensitivityError> {
    let sensitivities = follower.steadied_sensitivities(parameters)?;
    Ok(with_moves(follower, &sensitivities, compared, true))
}

fn with_moves(
    follower: &Follower,
    sensitivities: &[Sensitivity],
    compared: Compared,
    is_steadied: bool,
) -> Prediction {
    let (drape, springs) = (follower.drape(), follower.held());
    let sources = sources(&drape);
    let outline = curve(&drape, &sources);
    let count = springs.len().max(1) as f64;
    let moved = |sensitivity: &Sensitivity| {
        let nodes = nodes(&drape, &sensitivity.moves);
        let along: f64 = springs.iter().map(|s| s.along.dot(&sensitivity.moves[s.vertex])).sum();
        let pulled = if sensitivity.parameter == Parameter::Pull { 1.0 } else { 0.0 };
        Move {
            parameter: sensitivity.parameter,
            outline: sources.iter().map(|source| source.at(&nodes)).collect(),
            rim: rim(&drape, &sensitivity.moves),
            places: places(&drape, &sensitivity.moves, compared),
            stretch_m: if springs.is_empty() { 0.0 } else { along / count - pulled },
        }
    };
    let moves = sensitivities.iter().map(moved).collect();
    let hold = Held {
        mean_m: springs.iter().map(|s| s.stretch_m).sum::<f64>() / count,
        rms_m: (springs.iter().map(|s| s.stretch_m.powi(2)).sum::<f64>() / count).sqrt(),
        pull_m: follower.pull_m(),
    };
    let rim = rim(&drape, &drape.positions_m);
    let places = places(&drape, &drape.positions_m, compared);
    let heights_m = heights_m(&drape, &sources);
    Prediction { drape, outline, heights_m, rim, places, moves, hold, is_steadied }
}

/// The outline of a drape seen from far above, plan of the simulation frame \[m\].
#[must_use]
pub fn outline_of(drape: &Drape) -> Outline {
    curve(drape, &sources(drape))
}

/// The same as a camera above the plate's axis sees it, on the plate's face; one over its height
/// \[1/m\].
#[must_use]
pub fn outline_seen(drape: &Drape, per_height: f64) -> Outline {
    let sources = sources(drape);
    nearer(&curve(drape, &sources), &heights_m(drape, &sources), per_height)
}

/// An outline whose points lie at some heights, as it is seen from a height.
fn nearer(outline: &Outline, heights_m: &[f64], per_height: f64) -> Outline {
    let points = outline.points_m().iter().zip(heights_m);
    let seen = points.map(|(p, y)| p.map(|v| v / (1.0 - per_height * y))).collect();
    Outline::new(seen).unwrap_or_else(|_| outline.clone())
}

fn heights_m(drape: &Drape, sources: &[Source]) -> Vec<f64> {
    let rim = drape.boundary.positions_m().map(|p| p.y);
    let nodes: Vec<f64> = rim.chain(drape.positions_m.iter().map(|p| p.y)).collect();
    let at = |source: &Source| {
        let (a, b) = (nodes[source.from], nodes[source.to]);
        a + (b - a) * source.part
    };
    sources.iter().map(at).collect()
}

fn curve(drape: &Drape, sources: &[Source]) -> Outline {
    let nodes = nodes(drape, &drape.positions_m);
    match Outline::new(sources.iter().map(|source| source.at(&nodes)).collect()) {
        Ok(outline) => outline,
        Err(_) => unreachable!("cloth lies on the plate all around its axis"),
    }
}

/// A field on the vertices at the rim's points.
fn rim(drape: &Drape, field: &[Vector3]) -> Vec<Vector3> {
    drape.grid.boundary(field).positions_m().map(|p| p.coords).collect()
}

/// A field on the vertices at the places of a sheet that are compared.
fn places(drape: &Drape, field: &[Vector3], of: Compared) -> Vec<Vector3> {
    if of == Compared::Rim {
        return Vec::new();
    }
    let all = drape.grid.evenly(Surface::SIDE).prolong(&drape.grid, field, 1.0);
    compared().map(|[i, j]| all[i * Surface::SIDE + j]).collect()
}

/// A field on the vertices in the plan, at the rim's points and at the vertices.
fn nodes(drape: &Drape, field: &[Vector3]) -> Vec<[f64; 2]> {
    rim(drape, field)
        .into_iter()
        .map(|p| [p.x, p.z])
        .chain(field.iter().map(|p| [p.x, p.z]))
        .collect()
}

impl Source {
    fn at(&self, nodes: &[[f64; 2]]) -> [f64; 2] {
        let (a, b) = (nodes[self.from], nodes[self.to]);
        [0, 1].map(|c| a[c] + (b[c] - a[c]) * self.part)
    }
}

/// The farthest cloth at each bearing.
fn sources(drape: &Drape) -> Vec<Source> {
    let nodes = nodes(drape, &drape.positions_m);
    let nothing = Source { from: 0, to: 0, part: 0.0, distance_m: 0.0 };
    let mut farthest = vec![nothing; BEARINGS];
    let mut edge = |from: usize, to: usize| {
        each_bearing(
            nodes[from],
            nodes[to],
            std::f64::consts::TAU / BEARINGS as f64,
            |k, distance_m, part| {
                let best = &mut farthest[k.rem_euclid(BEARINGS as isize) as usize];
                if distance_m > best.distance_m {
                    *best = Source { from, to, part, distance_m };
                }
            },
        );
    };
    (0..POINTS).for_each(|k| edge(k, (k + 1) % POINTS));
    let cells = drape.grid.cells.iter().zip(&drape.grid.volume_fraction);
    for (cell, _) in cells.filter(|(_, fraction)| **fraction > WHOLE) {
        let [a, b, c, d] = cell.map(|v| POINTS + v as usize);
        for (from, to) in [(a, b), (c, d), (a, c), (b, d)] {
            edge(from, to);
        }
    }
    farthest
}

/// Volume fraction from which on a cell is cloth all over.
const WHOLE: f64 = 0.999;

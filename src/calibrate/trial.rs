//! One fabric's drape as it is seen from above, and how its outline moves with everything that is asked for.
//!
//! In: a sheet at rest. Out: its outline about the plate's axis, the farthest point of cloth at each of
//! [`BEARINGS`] bearings, in the plan of the simulation frame \[m\], and the moves of these points \[m per unit\]. The cloth is the
//! rim's 244 points and the cells that lie wholly on the specimen.
//!
//! A point of the outline that is no rim lies where the sheet turns over, and the outline moves there, across itself,
//! as the cloth under it does: the sheet's tangent there is vertical.
//!
//! Where it fails: cloth that hangs back under a fold is not seen, as from above, and an outline that goes back on its
//! bearing is cut off radially.

use crate::base::boundary::POINTS;
use crate::base::{Outline, Vector3};
use crate::sim::sensitivity::{Parameter, SensitivityError};
use crate::sim::{Drape, Follower};

use super::measures::each_bearing;

/// Bearings at which the outline is taken: one every half degree.
pub const BEARINGS: usize = 720;

/// A drape seen from above.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The drape.
    pub drape: Drape,
    /// Its outline, a point for each bearing from 0 on.
    pub outline: Outline,
    /// Moves of the outline's points in the plan with each parameter asked for \[m per SI unit\].
    pub moves: Vec<Vec<[f64; 2]>>,
}

/// The cloth under a point of the outline: on the way from one node to another. Nodes are the rim's points, then the
/// grid's vertices.
#[derive(Clone, Copy, Debug)]
struct Source {
    from: usize,
    to: usize,
    part: f64,
    distance_m: f64,
}

/// The sheet of `follower` seen from above.
///
/// # Errors
/// When it is not at a stable rest.
pub fn trial_of(
    follower: &mut Follower,
    parameters: &[Parameter],
) -> Result<Trial, SensitivityError> {
    let sensitivities = follower.sensitivities(parameters)?;
    let drape = follower.drape();
    let sources = sources(&drape);
    let outline = curve(&drape, &sources);
    let moves = sensitivities
        .iter()
        .map(|sensitivity| {
            let nodes = nodes(&drape, &sensitivity.moves);
            sources.iter().map(|source| source.at(&nodes)).collect()
        })
        .collect();
    Ok(Trial { drape, outline, moves })
}

/// The outline of a drape seen from above, plan of the simulation frame \[m\].
#[must_use]
pub fn outline_of(drape: &Drape) -> Outline {
    curve(drape, &sources(drape))
}

fn curve(drape: &Drape, sources: &[Source]) -> Outline {
    let nodes = nodes(drape, &drape.positions_m);
    match Outline::new(sources.iter().map(|source| source.at(&nodes)).collect()) {
        Ok(outline) => outline,
        Err(_) => unreachable!("cloth lies on the plate all around its axis"),
    }
}

/// A field on the vertices in the plan, at the rim's points and at the vertices.
fn nodes(drape: &Drape, field: &[Vector3]) -> Vec<[f64; 2]> {
    let rim = drape.grid.boundary(field);
    let rim = rim.positions_m().map(|p| [p.x, p.z]).collect::<Vec<_>>();
    rim.into_iter().chain(field.iter().map(|p| [p.x, p.z])).collect()
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

//! One fabric's drape on a scan's branch, and how its places move with everything that is fitted.

use crate::base::boundary::POINTS;
use crate::base::{Boundary, Point3, Vector3};
use crate::fabric::STIFFNESSES;
use crate::sim::sensitivity::{Parameter, SensitivityError};
use crate::sim::{Drape, Follower};

use super::data::{SIDE, Scan, place_of};

/// What is not known of a bench: place and rotation of the specimen, tilt of the plate, the height
/// of its face and the place of its axis in the scan's frame.
pub(super) const BENCH: usize = 8;
/// The first of the two tilts of the plate among these,
pub(super) const TILT: usize = 3;
/// and of the two of its axis's place.
pub(super) const AXIS: usize = 6;
/// What is not known beside the fabric: the bench, and how far the last cells are from cloth.
pub(super) const NUISANCES: usize = BENCH + 1;

/// The parameters with a sensitivity of their own: the stiffnesses, then the bench but the height,
/// with the ties' place for the axis's.
const PARAMETERS: [Parameter; STIFFNESSES + BENCH - 1] = {
    use Parameter::{OffsetX, OffsetZ, Rotation, TiesX, TiesZ, TiltX, TiltZ};
    let [a, b, c, d, e, f] = Parameter::STIFFNESSES;
    [a, b, c, d, e, f, OffsetX, OffsetZ, Rotation, TiltX, TiltZ, TiesX, TiesZ]
};

/// A drape on a scan's branch, at the places of [`crate::base::Surface`].
pub(super) struct Prediction {
    pub drape: Drape,
    /// Positions of the places \[m\].
    pub at: Vec<Vector3>,
    /// Their moves with the logarithm of each stiffness, then with each nuisance \[m per unit\].
    pub moves: Vec<Vec<Vector3>>,
}

/// The sheet of `follower` as it is. `finer` is the move of its places from coarser cells to its
/// own, where that is known \[m\].
///
/// # Errors
/// When it is not at a stable rest.
pub(super) fn prediction_of(
    follower: &mut Follower,
    finer: Option<&[Vector3]>,
) -> Result<Prediction, SensitivityError> {
    let sensitivities = follower.sensitivities(&PARAMETERS)?;
    let (drape, setup) = (follower.drape(), *follower.setup());
    let values = setup.fabric.in_si();
    let mut moves: Vec<Vec<Vector3>> = sensitivities
        .iter()
        .enumerate()
        .map(|(k, sensitivity)| {
            // d/d ln v = v d/dv
            let scale = if k < STIFFNESSES { values[k] } else { 1.0 };
            at_places(&drape, &sensitivity.moves).into_iter().map(|m| m * scale).collect()
        })
        .collect();
    // a plate that moves under the ties carries the sheet along but for what they hold back
    let ties = moves.split_off(STIFFNESSES + AXIS - 1);
    moves.push(vec![Vector3::y(); SIDE * SIDE]);
    for (along, held) in [Vector3::x(), Vector3::z()].iter().zip(ties) {
        moves.push(held.into_iter().map(|held| along - held).collect());
    }
    moves.push(finer.map_or_else(|| vec![Vector3::zeros(); SIDE * SIDE], <[Vector3]>::to_vec));
    Ok(Prediction { at: places_of(&drape), moves, drape })
}

/// Where a scan has the axis of its plate, as its bench's numbers say \[m\].
pub(super) fn axis_m(numbers: &[f64; NUISANCES]) -> Vector3 {
    Vector3::new(numbers[AXIS], 0.0, numbers[AXIS + 1])
}

fn root_mean(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Where the places of [`crate::base::Surface`] lie in a drape \[m\].
pub(super) fn places_of(drape: &Drape) -> Vec<Vector3> {
    at_places(drape, &drape.positions_m)
}

/// A field on a drape's vertices at the places.
fn at_places(drape: &Drape, field: &[Vector3]) -> Vec<Vector3> {
    drape.grid.evenly(SIDE).prolong(&drape.grid, field, 1.0)
}

impl Prediction {
    /// The same sensitivities at another sheet on the same cells, a short step away.
    pub(super) fn at_sheet(&self, drape: Drape) -> Self {
        Self { at: places_of(&drape), moves: self.moves.clone(), drape }
    }

    /// The same in a frame in which the plate's axis stands so far from the origin \[m\].
    pub(super) fn translated(self, by_m: Vector3) -> Self {
        let at = self.at.iter().map(|p| p + by_m).collect();
        Self { at, drape: self.drape.translated(by_m), moves: self.moves }
    }

    /// Mean distance of its rim from another \[m\].
    pub(super) fn rim_distance_m(&self, rim: &Boundary) -> f64 {
        let distance = |(index, p): (usize, Point3)| (p.coords - self.at[place_of(index)]).norm();
        rim.positions_m().enumerate().map(distance).sum::<f64>() / POINTS as f64
    }

    /// Force of the springs that hold it to a scan, root mean square, as a share of its weight; the
    /// springs are as weak as [`FitOptions::hold_sag_m`](super::FitOptions::hold_sag_m) says, those
    /// of a rim alone as `rim_hold_sag_m`. Springs that are weaker where the scan is less sure
    /// count as if they were not.
    pub(super) fn springs_share(
        &self,
        scan: &Scan<'_>,
        hold_sag_m: f64,
        rim_hold_sag_m: f64,
    ) -> f64 {
        let stretched = |(to, at): (Point3, &Vector3)| (to.coords - at).norm_squared();
        match scan.sheet {
            Some(sheet) => {
                let places = sheet.points().iter().zip(&self.at).filter(|(to, _)| to.observed);
                let squares = places.map(|(to, at)| stretched((to.position_m, at)));
                root_mean(squares) / hold_sag_m
            }
            None => {
                let rim = scan.rim.positions_m().enumerate();
                let squares = rim.map(|(index, to)| stretched((to, &self.at[place_of(index)])));
                // each of the border's vertices holds as much as a cell weighs
                let (border, cells) = (self.drape.grid.border().len(), self.drape.grid.cells.len());
                root_mean(squares) / rim_hold_sag_m * border as f64 / cells as f64
            }
        }
    }
}

//! The direction of the warp, as a user gives it.
//!
//! In: a direction in the scan's frame or a bearing. Out: the specimen's axis nearest to it,
//! and how far it is from that axis: near a diagonal the choice is not safe. Refused
//! where the direction stands nearly upright, for then its horizontal part says nothing.

use super::options::WarpToward;
use crate::base::{Isometry3, Vector3};

/// A direction for the warp that stands nearly upright on the plate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the direction given for the warp is {off_vertical_deg:.0} degrees off the vertical (at least \
     {limit_deg:.0} are needed; up is ({:.2}, {:.2}, {:.2}) here), and the warp lies level on the plate: \
     give --warp-toward a direction along the plate, or a bearing", up[0], up[1], up[2]
)]
pub struct WarpSteep {
    /// Angle between the direction and the vertical, 0 to 90.
    pub off_vertical_deg: f64,
    /// Least accepted.
    pub limit_deg: f64,
    /// Up, in the frame in which the direction was given.
    pub up: [f64; 3],
}

impl WarpToward {
    /// Bearing of the warp \[rad\] in a frame with y up, counter-clockwise seen from above, x
    /// at 0; `level_from_given` takes the frame of the direction to that one.
    ///
    /// # Errors
    /// When the direction is less than `limit_deg` from the vertical there.
    pub fn bearing_rad(
        self,
        level_from_given: &Isometry3,
        limit_deg: f64,
    ) -> Result<f64, WarpSteep> {
        let direction = match self {
            Self::BearingDeg(degrees) => return Ok(degrees.to_radians()),
            Self::Direction(direction) => level_from_given * Vector3::from(direction),
        };
        let off_vertical_deg = direction.x.hypot(direction.z).atan2(direction.y.abs()).to_degrees();
        if off_vertical_deg < limit_deg {
            let up = level_from_given.inverse_transform_vector(&Vector3::y()).into();
            return Err(WarpSteep { off_vertical_deg, limit_deg, up });
        }
        Ok((-direction.z).atan2(direction.x))
    }
}

/// The number of quarter turns nearest to a bearing \[rad\], and how far it is from them
/// \[rad\], at most an eighth of a turn.
#[must_use]
pub fn quarters_to_warp(bearing_rad: f64) -> (f64, f64) {
    let quarter = std::f64::consts::FRAC_PI_2;
    let quarters = (bearing_rad / quarter).round();
    (quarters, (bearing_rad - quarters * quarter).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_near_the_vertical_is_refused_with_its_angle() {
        let level = Isometry3::identity();
        let tilted = |deg: f64| {
            let (sin, cos) = deg.to_radians().sin_cos();
            WarpToward::Direction([0.0, 2.0 * cos, 2.0 * sin])
        };
        let steep = tilted(29.0).bearing_rad(&level, 30.0).unwrap_err();
        assert!((steep.off_vertical_deg - 29.0).abs() < 1e-9, "{steep}");
        assert!(tilted(151.5).bearing_rad(&level, 30.0).is_err(), "downward is as steep");
        assert!((tilted(31.0).bearing_rad(&level, 30.0).unwrap().to_degrees() + 90.0).abs() < 1e-9);
        // Up is z in this frame, so that y is level and z is not.
        let rotation =
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -90_f64.to_radians());
        let z_up = Isometry3::from_parts(nalgebra::Translation3::identity(), rotation);
        assert!(WarpToward::Direction([0.0, 1.0, 0.0]).bearing_rad(&z_up, 30.0).is_ok());
        let steep = WarpToward::Direction([0.0, 0.0, 1.0]).bearing_rad(&z_up, 30.0).unwrap_err();
        assert!(steep.up[2] > 0.999 && steep.to_string().contains("(0.00, 0.00, 1.00)"), "{steep}");
    }

    #[test]
    fn the_angle_to_the_nearest_axis_is_an_eighth_of_a_turn_at_most() {
        for (degrees, quarters, off_deg) in
            [(0.0, 0.0, 0.0), (44.0, 0.0, 44.0), (46.0, 1.0, 44.0), (-93.0, -1.0, 3.0)]
        {
            let (found, off_rad) = quarters_to_warp(f64::to_radians(degrees));
            assert_eq!(found, quarters);
            assert!((off_rad.to_degrees() - off_deg).abs() < 1e-9, "{degrees}");
        }
    }
}

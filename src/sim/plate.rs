//! The plate that a specimen lies on: a horizontal disc with a rounded edge.
//!
//! In: radius, radius of the edge, gap and friction. Out: the signed distance of a point from
//! the plate's surface with its first two derivatives. The top face lies at y = 0; the edge is
//! fully rounded (a half torus), so that the plate is as thick as twice its edge's radius. How
//! the plate bears on the cloth is in `energy/plate.rs`.

use nalgebra::Matrix3;

use crate::base::Vector3;

/// The plate that the specimen lies on, and its friction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Plate {
    /// Radius of the disc \[m\].
    pub radius_m: f64,
    /// Radius of the rounded edge, which is half the plate's thickness \[m\].
    pub edge_radius_m: f64,
    /// Distance from the plate at which contact begins \[m\].
    pub gap_m: f64,
    /// Coefficient of Coulomb friction between cloth and plate.
    pub friction: f64,
    /// Distance along the surface by which a point of the cloth is pulled away from where it sticks
    /// before it slips \[m\].
    pub slip_m: f64,
}

impl Default for Plate {
    fn default() -> Self {
        Self {
            radius_m: crate::base::frame::PLATE_RADIUS_M,
            edge_radius_m: 2.0e-3,
            gap_m: 1.0e-3,
            friction: 0.3,
            slip_m: 0.1e-3,
        }
    }
}

/// Signed distance \[m\], its gradient and Hessian.
pub(super) struct Distance {
    /// The signed distance, negative inside the plate \[m\].
    pub d: f64,
    /// Its gradient: the unit normal of the surface at the nearest point.
    pub normal: Vector3,
    /// Its Hessian \[1/m\].
    pub curvature: Matrix3<f64>,
}

impl Plate {
    /// Signed distance from the plate's surface; `None` beyond `limit_m`.
    pub(super) fn distance(&self, p: &Vector3, limit_m: f64) -> Option<Distance> {
        let reach = self.edge_radius_m + limit_m;
        let centre_y = -self.edge_radius_m;
        let height = p.y - centre_y;
        if height.abs() > reach {
            return None;
        }
        let rho = p.x.hypot(p.z);
        let flat_radius = self.radius_m - self.edge_radius_m;
        let out = rho - flat_radius;
        if out > reach {
            return None;
        }
        if out <= 0.0 {
            let normal = Vector3::new(0.0, height.signum(), 0.0);
            let d = height.abs() - self.edge_radius_m;
            return Some(Distance { d, normal, curvature: Matrix3::zeros() });
        }
        let length = out.hypot(height).max(1e-12);
        let radial = Vector3::new(p.x / rho, 0.0, p.z / rho);
        let normal = (radial * out + Vector3::new(0.0, height, 0.0)) / length;
        let around = Vector3::new(-radial.z, 0.0, radial.x);
        let tangent = normal.cross(&around);
        // principal curvatures of the offset surface: 1/length along the round
        // edge, normal.radial/rho around the axis
        let curvature = tangent * tangent.transpose() / length
            + around * around.transpose() * (normal.dot(&radial) / rho);
        Some(Distance { d: length - self.edge_radius_m, normal, curvature })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_is_to_the_rounded_disc() {
        let plate = Plate::default();
        let d = |x: f64, y: f64, z: f64| plate.distance(&Vector3::new(x, y, z), 1.0).unwrap().d;
        assert!((d(0.0, 0.01, 0.02) - 0.01).abs() < 1e-15);
        assert!((d(0.053, -0.002, 0.0) - 0.003).abs() < 1e-15);
        assert!((d(0.0, -0.002, -0.053) - 0.003).abs() < 1e-15);
        assert!((d(0.01, -0.007, 0.0) - 0.003).abs() < 1e-15);
        let diagonal = 0.048 + 0.003 / 2.0_f64.sqrt();
        assert!((d(diagonal, -0.002 + 0.003 / 2.0_f64.sqrt(), 0.0) - 0.001).abs() < 1e-12);
    }
}

//! Points by their place about an upright axis.

use crate::base::{Point3, Vector3};

/// A point by its place on two level axes and its height \[m\].
pub(in crate::scan) struct Placed {
    /// Along the level axes.
    pub xz_m: [f64; 2],
    /// Along up.
    pub height_m: f64,
}

impl Placed {
    /// `point` in the axes `[u, up, v]` about `centre`.
    pub fn of(point: &Point3, centre: &Point3, [u, up, v]: [&Vector3; 3]) -> Self {
        let d = point - centre;
        Self { xz_m: [d.dot(u), d.dot(v)], height_m: d.dot(up) }
    }

    /// Distance from the axis \[m\].
    pub fn radius_m(&self) -> f64 {
        self.xz_m[0].hypot(self.xz_m[1])
    }

    /// Which of `count` equal sectors about the axis it lies in.
    pub fn sector(&self, count: usize) -> usize {
        let share = (self.xz_m[1].atan2(self.xz_m[0]) / std::f64::consts::TAU).rem_euclid(1.0);
        ((share * count as f64) as usize).min(count - 1)
    }
}

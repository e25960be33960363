//! Shapes that a ray can meet: the parts of stands and the things around a drape.
//!
//! In: a shape in the simulation frame \[m\], a ray with a unit direction, or a point.
//! Out: where the ray enters the shape, or how far the point lies from its surface.
//!
//! A cylinder and a block are solved. The others are traced: from the ray's origin in
//! steps of the distance to the surface, which never passes through it (Hart, "Sphere
//! tracing", The Visual Computer 12, 1996). Not parry's shapes, whose iteration stops at
//! about 1e-8. A ray that starts inside of a shape meets it at once or not at all: no
//! camera stands there.

use nalgebra::{Translation3, UnitQuaternion};

use crate::base::{Isometry3, Point3, Vector3};
use crate::geom::{Hit, Mesh};

/// A shape, simulation frame \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solid {
    /// Upright, about the y axis, with two caps.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Height of the lower cap.
        bottom: f64,
        /// Height of the upper cap.
        top: f64,
    },
    /// The same, the upper edge rounded.
    Rounded {
        /// Its radius.
        radius: f64,
        /// Height of the lower cap.
        bottom: f64,
        /// Height of the upper cap.
        top: f64,
        /// Radius of the rounding, at most that of the shape and its height.
        rounding: f64,
    },
    /// Upright, wider at one end.
    Cone {
        /// Where its axis meets y = 0, as x and z.
        axis: [f64; 2],
        /// Radii of the lower and the upper cap.
        radii: [f64; 2],
        /// Heights of both.
        heights: [f64; 2],
    },
    /// With six rectangular sides.
    Block {
        /// From its own frame, whose origin is its middle.
        place: Isometry3,
        /// Half its sides.
        half: [f64; 3],
    },
    /// All points within a radius of a segment; a ball where its ends are one.
    Capsule {
        /// The segment's ends.
        ends: [Point3; 2],
        /// The radius.
        radius: f64,
    },
}

/// A traced ray has arrived when it is this close \[m\].
const ARRIVED_M: f64 = 1e-9;
/// Steps of a traced ray: one that grazes a plane at a quarter of a degree needs so many.
const MOST_STEPS: usize = 4000;

impl Solid {
    /// A block that stands on a floor of this height, turned by `yaw_rad`, its middle above `at`
    /// (x, z).
    #[must_use]
    pub fn standing_block(at: [f64; 2], floor_y: f64, sides: [f64; 3], yaw_rad: f64) -> Self {
        let half = sides.map(|side| 0.5 * side);
        let middle = Translation3::new(at[0], floor_y + half[1], at[1]);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw_rad);
        Self::Block { place: Isometry3::from_parts(middle, turned), half }
    }

    /// Distance of a point from the surface \[m\], negative inside; inside a block or a cylinder
    /// that of the nearest side.
    #[must_use]
    pub fn distance_m(&self, point: &Point3) -> f64 {
        match *self {
            Self::Cylinder { radius, bottom, top } => {
                let out = point.x.hypot(point.z) - radius;
                outside_or_inside([out, (point.y - top).max(bottom - point.y)])
            }
            Self::Rounded { radius, bottom, top, rounding } => {
                let (r, y) = (point.x.hypot(point.z), point.y);
                let corner = [r - (radius - rounding), y - (top - rounding)];
                if corner[0] > 0.0 && corner[1] > 0.0 {
                    return corner[0].hypot(corner[1]) - rounding;
                }
                outside_or_inside([r - radius, (y - top).max(bottom - y)])
            }
            Self::Cone { axis, radii, heights } => {
                let r = (point.x - axis[0]).hypot(point.z - axis[1]);
                cone_distance(r, point.y, radii, heights)
            }
            Self::Block { place, half } => {
                let own = place.inverse_transform_point(point);
                let out: [f64; 3] = std::array::from_fn(|k| own[k].abs() - half[k]);
                let beyond = out.map(|side| side.max(0.0));
                let most = out.into_iter().fold(f64::NEG_INFINITY, f64::max);
                Vector3::from(beyond).norm() + most.min(0.0)
            }
            Self::Capsule { ends: [a, b], radius } => {
                let along = b - a;
                let share = (point - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
                (point - (a + along * share.clamp(0.0, 1.0))).norm() - radius
            }
        }
    }

    /// Where a ray (unit direction) from outside enters, within `most_m`.
    #[must_use]
    pub fn cast(&self, origin: &Point3, ray: &Vector3, most_m: f64) -> Option<Hit> {
        let hit = match *self {
            Self::Cylinder { radius, bottom, top } => {
                Cylinder { radius, bottom, top }.cast(origin, ray)
            }
            Self::Block { place, half } => cast_on_block(&place, half, origin, ray),
            _ => self.trace(origin, ray, most_m),
        };
        hit.filter(|hit| hit.distance <= most_m)
    }

    fn trace(&self, origin: &Point3, ray: &Vector3, most_m: f64) -> Option<Hit> {
        let (middle, reach) = self.ball()?;
        let along = (middle - origin).dot(ray);
        let passes_sq = (middle - origin).norm_squared() - along * along;
        if passes_sq > reach * reach {
            return None;
        }
        let half_chord = (reach * reach - passes_sq).sqrt();
        let mut t = (along - half_chord).max(0.0);
        let end = (along + half_chord).min(most_m);
        for _ in 0..MOST_STEPS {
            if t > end {
                return None;
            }
            let step = self.distance_m(&(origin + ray * t));
            if step < ARRIVED_M {
                let at = origin + ray * t;
                return Some(Hit { distance: t, normal: self.normal(&at), triangle: 0 });
            }
            t += step;
        }
        None
    }

    /// A ball around a shape that is traced.
    fn ball(&self) -> Option<(Point3, f64)> {
        match *self {
            Self::Rounded { radius, bottom, top, .. } => {
                let middle = Point3::new(0.0, 0.5 * (bottom + top), 0.0);
                Some((middle, radius.hypot(0.5 * (top - bottom))))
            }
            Self::Cone { axis, radii, heights } => {
                let middle = Point3::new(axis[0], 0.5 * (heights[0] + heights[1]), axis[1]);
                let half = 0.5 * (heights[1] - heights[0]);
                Some((middle, radii[0].max(radii[1]).hypot(half)))
            }
            Self::Capsule { ends: [a, b], radius } => {
                Some((nalgebra::center(&a, &b), 0.5 * (b - a).norm() + radius))
            }
            Self::Cylinder { .. } | Self::Block { .. } => None,
        }
    }

    /// The direction in which the distance grows, by differences.
    fn normal(&self, at: &Point3) -> Vector3 {
        const STEP_M: f64 = 1e-6;
        let slope = |axis: usize| {
            let mut step = Vector3::zeros();
            step[axis] = STEP_M;
            self.distance_m(&(at + step)) - self.distance_m(&(at - step))
        };
        Vector3::new(slope(0), slope(1), slope(2)).normalize()
    }

    /// The surface of a block as twelve triangles, for points spread over it; none of other shapes.
    #[must_use]
    pub fn block_mesh(&self) -> Option<Mesh> {
        let Self::Block { place, half } = *self else { return None };
        let corner = |k: usize| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            place * Point3::new(sign(0) * half[0], sign(1) * half[1], sign(2) * half[2])
        };
        let sides =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Some(Mesh { vertices: (0..8).map(corner).collect(), triangles: triangles.collect() })
    }
}

/// Distance from a right angle between two directions, of which these are the distances.
fn outside_or_inside(out: [f64; 2]) -> f64 {
    if out[0] > 0.0 && out[1] > 0.0 { out[0].hypot(out[1]) } else { out[0].max(out[1]) }
}

/// Distance of the point (r, y) from a cone's half section, a convex quadrilateral.
fn cone_distance(r: f64, y: f64, radii: [f64; 2], heights: [f64; 2]) -> f64 {
    let corners =
        [[0.0, heights[0]], [radii[0], heights[0]], [radii[1], heights[1]], [0.0, heights[1]]];
    let (mut nearest, mut inside) = (f64::INFINITY, true);
    for pair in corners.windows(2) {
        let ([ax, ay], [bx, by]) = (pair[0], pair[1]);
        let (ex, ey) = (bx - ax, by - ay);
        let (px, py) = (r - ax, y - ay);
        inside &= ex * py - ey * px >= 0.0;
        let share = ((px * ex + py * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
        nearest = nearest.min((px - ex * share).hypot(py - ey * share));
    }
    if inside { -nearest } else { nearest }
}

/// The slab that the ray enters last, if it has left none before.
fn cast_on_block(place: &Isometry3, half: [f64; 3], origin: &Point3, ray: &Vector3) -> Option<Hit> {
    let from = place.inverse_transform_point(origin);
    let along = place.inverse_transform_vector(ray);
    let (mut enter, mut leave, mut side) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for axis in 0..3 {
        let [a, b] = [-half[axis], half[axis]].map(|at| (at - from[axis]) / along[axis]);
        // A ray in the slab's plane: both are infinite, or not a number where it touches.
        let (near, far) = (a.min(b), a.max(b));
        if near > enter {
            (enter, side) = (near, axis);
        }
        leave = leave.min(far);
    }
    if !(enter > 0.0 && enter <= leave) {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[side] = -along[side].signum();
    Some(Hit { distance: enter, normal: place * normal, triangle: 0 })
}

/// An upright cylinder about the y axis, with its two caps; rays from outside.
struct Cylinder {
    radius: f64,
    bottom: f64,
    top: f64,
}

impl Cylinder {
    fn cast(&self, origin: &Point3, ray: &Vector3) -> Option<Hit> {
        let hits = [self.cast_on_side(origin, ray), self.cast_on_cap(origin, ray)];
        hits.into_iter().flatten().min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Solves |o + t d|^2 = r^2 in the horizontal plane, for the entering t.
    fn cast_on_side(&self, origin: &Point3, ray: &Vector3) -> Option<Hit> {
        let a = ray.x * ray.x + ray.z * ray.z;
        let half_b = origin.x * ray.x + origin.z * ray.z;
        let c = origin.x * origin.x + origin.z * origin.z - self.radius * self.radius;
        let discriminant = half_b * half_b - a * c;
        if a == 0.0 || discriminant < 0.0 {
            return None;
        }
        let distance = (-half_b - discriminant.sqrt()) / a;
        let at = origin + ray * distance;
        let normal = Vector3::new(at.x, 0.0, at.z) / self.radius;
        let hit = Hit { distance, normal, triangle: 0 };
        (distance > 0.0 && (self.bottom..=self.top).contains(&at.y)).then_some(hit)
    }

    fn cast_on_cap(&self, origin: &Point3, ray: &Vector3) -> Option<Hit> {
        let (y, normal) =
            if ray.y < 0.0 { (self.top, Vector3::y()) } else { (self.bottom, -Vector3::y()) };
        let distance = (y - origin.y) / ray.y;
        let at = origin + ray * distance;
        let hit = Hit { distance, normal, triangle: 0 };
        (distance.is_finite() && distance > 0.0 && at.x.hypot(at.z) <= self.radius).then_some(hit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> [Solid; 5] {
        let ends = [Point3::new(0.01, -0.05, 0.0), Point3::new(0.04, 0.03, 0.02)];
        let block = Solid::standing_block([0.01, -0.02], -0.06, [0.05, 0.08, 0.03], 0.4);
        [
            Solid::Cylinder { radius: 0.05, bottom: -0.02, top: 0.0 },
            Solid::Rounded { radius: 0.05, bottom: -0.02, top: 0.0, rounding: 0.004 },
            Solid::Cone { axis: [0.01, 0.0], radii: [0.03, 0.05], heights: [-0.1, -0.01] },
            block,
            Solid::Capsule { ends, radius: 0.02 },
        ]
    }

    /// Rays from a ball around the shapes through their middle.
    fn rays() -> impl Iterator<Item = (Point3, Vector3)> {
        (0..400).map(|k| {
            let (turn, rise) = (2.4 * f64::from(k), -1.0 + f64::from(k) / 200.0);
            let flat = (1.0 - rise * rise).max(0.0).sqrt();
            let away = Vector3::new(flat * turn.cos(), rise, flat * turn.sin());
            let from = Point3::new(0.0, -0.02, 0.0) + away * 0.4;
            let aim = Vector3::new(0.02 * (1.7 * turn).sin(), 0.02 * turn.cos(), 0.0);
            (from, (aim - away * 0.4).normalize())
        })
    }

    #[test]
    fn a_ray_ends_on_the_surface_and_nothing_lies_before_it() {
        for solid in all() {
            let mut met = 0;
            for (from, ray) in rays() {
                let Some(hit) = solid.cast(&from, &ray, 1.0) else {
                    let passes = (0..800).map(|k| from + ray * (f64::from(k) * 1e-3));
                    // A ray that grazes a face by less than a quarter of a degree may be lost.
                    let deepest = passes.map(|p| solid.distance_m(&p)).fold(1.0, f64::min);
                    assert!(deepest > -2e-4, "{solid:?}: {deepest}");
                    continue;
                };
                met += 1;
                let at = from + ray * hit.distance;
                assert!(solid.distance_m(&at).abs() < 1e-8, "{solid:?} {at}");
                assert!((hit.normal.norm() - 1.0).abs() < 1e-9 && hit.normal.dot(&ray) < 1e-6);
                let before = (1..100).map(|k| from + ray * (hit.distance * f64::from(k) / 100.0));
                assert!(before.map(|p| solid.distance_m(&p)).all(|d| d > 0.0), "{solid:?}");
            }
            assert!(met > 200, "{solid:?}: {met} rays");
        }
    }

    #[test]
    fn a_rounded_edge_lies_inside_the_sharp_one_and_meets_it_on_top_and_side() {
        let [sharp, rounded, ..] = all();
        let down = |x: f64, solid: &Solid| {
            solid.cast(&Point3::new(x, 0.3, 0.0), &-Vector3::y(), 1.0).map(|hit| 0.3 - hit.distance)
        };
        assert!(down(0.045, &rounded).unwrap().abs() < 1e-8);
        // 3 mm out from where the quarter circle of 4 mm begins: 4 - sqrt(16 - 9) mm lower.
        let want = -(4.0 - 7.0_f64.sqrt()) * 1e-3;
        assert!((down(0.049, &rounded).unwrap() - want).abs() < 1e-8);
        assert!(down(0.049, &sharp).unwrap().abs() < 1e-12);
        assert!(rounded.distance_m(&Point3::new(0.05, 0.0, 0.0)) > 1.5e-3);
    }

    #[test]
    fn a_block_has_the_area_of_its_sides() {
        let mesh = all()[3].block_mesh().unwrap();
        let area = |k| crate::geom::adjacency::area_vector2(&mesh, k).norm() * 0.5;
        let sum: f64 = (0..mesh.triangles.len()).map(area).sum();
        assert!((sum - 2.0 * (0.05 * 0.08 + 0.08 * 0.03 + 0.03 * 0.05)).abs() < 1e-12);
        assert!(all()[0].block_mesh().is_none());
    }
}

//! The outline of a drape seen from above: a closed curve in the plan.
//!
//! In: points (x, z) of the simulation frame's plan \[m\], in order along the curve. Out: a loop
//! along which the bearing from +x towards +z grows; its area, centroid, length, even points and
//! feet of perpendiculars. A camera above with x to the right sees z downwards, so that an image's
//! columns and rows are x and z.
//!
//! Where it fails: that the curve does not cross itself is not checked.

/// A closed curve in the plan (x, z) \[m\], anticlockwise in (x, z): the bearing from +x towards +z
/// grows along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    points_m: Vec<[f64; 2]>,
}

/// Why points are no outline.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OutlineError {
    /// Too few of them.
    #[error("{found} points, but a closed curve needs at least 3")]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// A coordinate is no number, or the curve encloses nothing.
    #[error("the curve encloses {area_m2} m^2; give finite points in order along it")]
    Empty {
        /// The area.
        area_m2: f64,
    },
}

/// The point of an outline that is nearest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// The segment, which runs from the point of this number to the next one.
    pub segment: usize,
    /// How far along the segment, 0 to 1.
    pub fraction: f64,
    /// The foot itself \[m\].
    pub at_m: [f64; 2],
    /// Distance of the place from it, positive outside the curve's segment \[m\].
    pub outwards_m: f64,
    /// Unit vector across the segment, outwards.
    pub normal: [f64; 2],
}

impl Outline {
    /// Takes the points in either sense.
    ///
    /// # Errors
    /// Fewer than three points, or no area.
    pub fn new(mut points_m: Vec<[f64; 2]>) -> Result<Self, OutlineError> {
        if points_m.len() < 3 {
            return Err(OutlineError::TooFew { found: points_m.len() });
        }
        let area_m2 = signed_area(&points_m);
        if !(area_m2.is_finite() && area_m2 != 0.0) {
            return Err(OutlineError::Empty { area_m2 });
        }
        if area_m2 < 0.0 {
            points_m.reverse();
        }
        Ok(Self { points_m })
    }

    /// The points in order \[m\].
    #[must_use]
    pub fn points_m(&self) -> &[[f64; 2]] {
        &self.points_m
    }

    /// The segments in order, each with its two ends \[m\].
    pub fn segments(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let count = self.points_m.len();
        (0..count).map(move |k| [self.points_m[k], self.points_m[(k + 1) % count]])
    }

    /// The area inside \[m^2\].
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        signed_area(&self.points_m)
    }

    /// Length of the curve \[m\].
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.segments().map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1])).sum()
    }

    /// Centroid of the area inside \[m\].
    #[must_use]
    pub fn centroid_m(&self) -> [f64; 2] {
        // from the first point on, so that nothing cancels far from the origin
        let [x0, z0] = self.points_m[0];
        let (mut sum, mut area) = ([0.0; 2], 0.0);
        for [a, b] in self.segments() {
            let (a, b) = ([a[0] - x0, a[1] - z0], [b[0] - x0, b[1] - z0]);
            let twice = a[0] * b[1] - b[0] * a[1];
            area += twice;
            (0..2).for_each(|c| sum[c] += (a[c] + b[c]) * twice);
        }
        [x0 + sum[0] / (3.0 * area), z0 + sum[1] / (3.0 * area)]
    }

    /// `count` points at even steps along the curve, and where on the curve each is: the first one
    /// is the first point.
    #[must_use]
    pub fn evenly(&self, count: usize) -> Vec<[f64; 2]> {
        let step = self.length_m() / count as f64;
        let (mut points, mut done) = (Vec::with_capacity(count), 0.0);
        for [a, b] in self.segments() {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            while points.len() < count && points.len() as f64 * step < done + length {
                let part = (points.len() as f64 * step - done) / length;
                points.push([0, 1].map(|c| a[c] + (b[c] - a[c]) * part));
            }
            done += length;
        }
        // rounding may leave the last one at the end of the last segment
        points.resize(count, self.points_m[0]);
        points
    }

    /// The same curve with every point mapped; the map must keep its sense.
    #[must_use]
    pub fn mapped(&self, map: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        Self { points_m: self.points_m.iter().map(|&p| map(p)).collect() }
    }

    /// The point of the curve that is nearest to `place`.
    #[must_use]
    pub fn foot(&self, place: [f64; 2]) -> Foot {
        let mut best = (f64::INFINITY, 0, 0.0);
        for (segment, [a, b]) in self.segments().enumerate() {
            let along = [b[0] - a[0], b[1] - a[1]];
            let to = [place[0] - a[0], place[1] - a[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let share =
                if square > 0.0 { (to[0] * along[0] + to[1] * along[1]) / square } else { 0.0 };
            let fraction = share.clamp(0.0, 1.0);
            let off = [to[0] - fraction * along[0], to[1] - fraction * along[1]];
            let distance_sq = off[0] * off[0] + off[1] * off[1];
            if distance_sq < best.0 {
                best = (distance_sq, segment, fraction);
            }
        }
        let (distance_sq, segment, fraction) = best;
        let (a, b) = (self.points_m[segment], self.points_m[(segment + 1) % self.points_m.len()]);
        let at_m = [0, 1].map(|c| a[c] + (b[c] - a[c]) * fraction);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(f64::MIN_POSITIVE);
        // the curve runs anticlockwise: outside lies to the right of its direction
        let normal = [(b[1] - a[1]) / length, (a[0] - b[0]) / length];
        let side = (place[0] - at_m[0]) * normal[0] + (place[1] - at_m[1]) * normal[1];
        Foot { segment, fraction, at_m, normal, outwards_m: distance_sq.sqrt().copysign(side) }
    }
}

fn signed_area(points: &[[f64; 2]]) -> f64 {
    let count = points.len();
    let [x0, z0] = points[0];
    let twice = |k: usize| {
        let (a, b) = (points[k], points[(k + 1) % count]);
        (a[0] - x0) * (b[1] - z0) - (b[0] - x0) * (a[1] - z0)
    };
    0.5 * (0..count).map(twice).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse(count: usize, sense: f64) -> Outline {
        let point = |k: usize| {
            let (sin, cos) = (sense * std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            [10.0 + 0.2 * cos, -3.0 + 0.1 * sin]
        };
        Outline::new((0..count).map(point).collect()).unwrap()
    }

    #[test]
    fn an_ellipse_has_its_area_centroid_and_length_in_either_sense() {
        for sense in [1.0, -1.0] {
            let outline = ellipse(4000, sense);
            assert!((outline.area_m2() / (std::f64::consts::PI * 0.02) - 1.0).abs() < 1e-6);
            let [x, z] = outline.centroid_m();
            assert!((x - 10.0).abs() < 1e-9 && (z + 3.0).abs() < 1e-9);
            // Ramanujan's second formula, exact to 1e-9 here
            assert!((outline.length_m() - 0.968_844_8).abs() < 1e-6, "{}", outline.length_m());
        }
    }

    #[test]
    fn even_points_lie_on_the_curve_at_even_steps() {
        let outline = ellipse(4000, 1.0);
        let even = Outline::new(outline.evenly(100)).unwrap();
        let step = outline.length_m() / 100.0;
        for [a, b] in even.segments() {
            let chord = (b[0] - a[0]).hypot(b[1] - a[1]);
            assert!((chord / step - 1.0).abs() < 2e-3, "{chord} {step}");
        }
        assert!(even.points_m().iter().all(|&p| outline.foot(p).outwards_m.abs() < 1e-12));
    }

    #[test]
    fn a_foot_is_signed_and_across_the_curve() {
        let outline = ellipse(4000, -1.0);
        for (place, outwards) in [([10.25, -3.0], 0.05), ([10.0, -2.93], -0.03)] {
            let foot = outline.foot(place);
            assert!((foot.outwards_m - outwards).abs() < 1e-6, "{foot:?}");
            let back = [0, 1].map(|c| foot.at_m[c] + foot.normal[c] * foot.outwards_m);
            assert!((back[0] - place[0]).hypot(back[1] - place[1]) < 1e-3);
        }
    }

    #[test]
    fn what_encloses_nothing_is_refused() {
        assert_eq!(Outline::new(vec![[0.0; 2]; 2]), Err(OutlineError::TooFew { found: 2 }));
        let line = vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]];
        assert!(matches!(Outline::new(line), Err(OutlineError::Empty { .. })));
        let nan = vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, 0.0]];
        assert!(matches!(Outline::new(nan), Err(OutlineError::Empty { .. })));
    }
}

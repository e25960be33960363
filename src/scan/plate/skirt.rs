//! The cloth near the plate's edge, by bearing and distance from the axis. It falls outward:
//! what lies lower than the cloth farther out is not cloth but the plate's side or its
//! underside, seen from below.

use super::super::tuning::PlateTuning;
use super::placed::Placed;

/// Width of a ring \[m\]: a plate's side is told from cloth 1.5 mm outside of it.
const RING_M: f64 = 1e-3;

/// Heights about an upright axis, by sector and ring.
pub(in crate::scan) struct Skirt {
    /// The two uppermost points of each \[m\], ring by ring in each sector; minus infinity
    /// where there are none.
    tops_m: Vec<[f64; 2]>,
    sectors: usize,
    rings: usize,
    /// The rings that are looked at, counted outward from a point's own.
    ahead: std::ops::RangeInclusive<usize>,
}

impl Skirt {
    /// Of points about the plate's axis; those that lie higher than cloth rises must be left
    /// out before.
    pub fn new(points: impl Iterator<Item = Placed>, radius_m: f64, tuning: &PlateTuning) -> Self {
        let [nearest, farthest] = tuning.outside_m.map(|m| (m / RING_M).round() as usize);
        let rings = (tuning.side_radii * radius_m / RING_M).ceil() as usize + farthest + 1;
        let sectors = tuning.skirt_sectors;
        let mut skirt = Self {
            tops_m: vec![[f64::NEG_INFINITY; 2]; sectors * rings],
            sectors,
            rings,
            ahead: nearest..=farthest,
        };
        for p in points {
            let ring = ring(&p);
            if ring < rings {
                put(&mut skirt.tops_m[p.sector(sectors) * rings + ring], p.height_m);
            }
        }
        skirt
    }

    /// Whether the cloth a little farther out is higher than `point` by `margin_m`. Of two
    /// points that are, one may be a stray.
    pub fn is_higher_outside(&self, point: &Placed, margin_m: f64) -> bool {
        let (ring, first) = (ring(point), point.sector(self.sectors) * self.rings);
        let mut top_m = [f64::NEG_INFINITY; 2];
        let ahead = self.ahead.clone().map(|k| ring.saturating_add(k));
        for k in ahead.filter(|k| *k < self.rings) {
            self.tops_m[first + k].iter().for_each(|height_m| put(&mut top_m, *height_m));
        }
        top_m[1] > point.height_m + margin_m
    }
}

fn ring(point: &Placed) -> usize {
    (point.radius_m() / RING_M) as usize
}

/// Keeps the two highest.
fn put(top_m: &mut [f64; 2], height_m: f64) {
    if height_m > top_m[0] {
        *top_m = [height_m, top_m[0]];
    } else if height_m > top_m[1] {
        top_m[1] = height_m;
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::tuning::Tuning;
    use super::*;

    /// Cloth that leaves a plate of 50 mm radius and falls, and the plate's side.
    #[test]
    fn a_plates_side_lies_under_the_cloth_outside_and_the_cloth_does_not() {
        let cloth = |k: usize| {
            let (t, r) = (2.4 * k as f64, 0.045 + 0.015 * (k % 100) as f64 / 100.0);
            let height_m = if r < 0.05 { 0.0 } else { -60.0 * (r - 0.05) * (r - 0.05) };
            Placed { xz_m: [r * t.cos(), r * t.sin()], height_m }
        };
        let side = |k: usize| {
            let (t, depth_m) = (2.4 * k as f64, 4e-3 + 2e-3 * (k % 10) as f64 / 10.0);
            Placed { xz_m: [0.05 * t.cos(), 0.05 * t.sin()], height_m: -depth_m }
        };
        let all = (0..20_000).map(cloth).chain((0..500).map(side));
        let skirt = Skirt::new(all, 0.05, &Tuning::default().plate);
        assert!((0..20_000).all(|k| !skirt.is_higher_outside(&cloth(k), 1.2e-3)));
        assert!((0..500).all(|k| skirt.is_higher_outside(&side(k), 1.2e-3)));
    }
}

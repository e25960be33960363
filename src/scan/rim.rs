//! The rim: edges and corners in material coordinates, carried into space by the
//! sheet and divided into the boundary vector's points.
//!
//! Corners are where the edges of two sides meet. Each side is divided into 60
//! equal arcs in space; for cloth that stretches evenly along a side these are
//! the material's 5 mm.

use super::edge::Edge;
use super::sheet::Sheet;
use super::sides::from_side;
use crate::base::boundary::{POINTS_PER_SIDE, SIDES};
use crate::base::{BoundaryPoint, Point3};
use crate::numeric::robust;

/// The rim in the local frame.
pub(super) struct Rim {
    /// Points in the boundary vector's order.
    pub points: Vec<BoundaryPoint>,
    /// Their material coordinates \[m\].
    pub material: Vec<[f64; 2]>,
    /// Length of each side along the cloth \[m\].
    pub side_lengths_m: [f64; SIDES],
    /// Where the edge's outward coordinate lies, mean of each side \[m\].
    pub edge_m: [f64; SIDES],
}

impl Rim {
    /// Share of the points that are observed.
    pub fn observed_fraction(&self) -> f64 {
        self.points.iter().filter(|p| p.observed).count() as f64 / self.points.len() as f64
    }
}

/// The cloth from edge to opposite edge, median over the lines across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Width {
    /// Its length in space \[m\].
    pub length_m: f64,
    /// The integral of its squared curvature \[1/m\].
    pub bent_per_m: f64,
}

impl Width {
    /// Along x (sides 2 to 0) and along z (sides 3 to 1). Lines with a bridged end do not count;
    /// `None` if none is left.
    pub fn of(sheet: &Sheet, edges: &[Edge; SIDES], half_m: f64) -> [Option<Self>; 2] {
        [0, 1].map(|side| {
            let lines: Vec<Self> = (-14..=14)
                .map(|k| f64::from(k) / 15.0 * half_m)
                .filter(|&along| {
                    edges[side].observed_at(along) && edges[side + 2].observed_at(-along)
                })
                .map(|along| {
                    let (from, to) =
                        (-edges[side + 2].outward_at(-along), edges[side].outward_at(along));
                    Self::along((0..=PIECES).map(|k| {
                        let outward = from + (to - from) * k as f64 / PIECES as f64;
                        sheet.at(from_side(side, [along, outward]))
                    }))
                })
                .collect();
            let median = |of: fn(&Self) -> f64| robust::median(lines.iter().map(of).collect());
            Some(Self {
                length_m: median(|line| line.length_m)?,
                bent_per_m: median(|line| line.bent_per_m)?,
            })
        })
    }

    /// Of one line, by its points.
    fn along(line: impl Iterator<Item = Point3>) -> Self {
        let line: Vec<Point3> = line.collect();
        let length_m: f64 = line.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
        let apart: Vec<&Point3> = line.iter().step_by(BENT_PIECES).collect();
        let step_m = length_m / (apart.len() - 1) as f64;
        let bent = apart.windows(3).map(|p| ((p[2] - p[1]) - (p[1] - p[0])).norm_squared());
        Self { length_m, bent_per_m: bent.sum::<f64>() / step_m.powi(3) }
    }
}

/// Pieces of a line across the cloth ...
const PIECES: usize = 201;
/// ... and how many of them are one where its curvature is read: 4.5 mm, beyond a sheet's noise.
const BENT_PIECES: usize = 3;

/// Traces the rim along the edges.
pub(super) fn trace(sheet: &Sheet, edges: &[Edge; SIDES], half_m: f64) -> Rim {
    // corner[s]: the outward coordinates of sides s and s + 1 where they meet.
    let corner: [[f64; 2]; SIDES] = std::array::from_fn(|s| {
        let (this, next) = (&edges[s], &edges[(s + 1) % SIDES]);
        let mut at = [half_m, half_m];
        for _ in 0..4 {
            at = [this.outward_at(at[1]), next.outward_at(-at[0])];
        }
        at
    });
    let mut rim = Rim {
        points: vec![],
        material: vec![],
        side_lengths_m: [0.0; SIDES],
        edge_m: [0.0; SIDES],
    };
    for s in 0..SIDES {
        let start = -corner[(s + SIDES - 1) % SIDES][0];
        let end = corner[s][1];
        let fine = 8 * (POINTS_PER_SIDE - 1);
        let path: Vec<Point3> = (0..=fine)
            .map(|k| {
                let along = start + (end - start) * k as f64 / fine as f64;
                sheet.at(from_side(s, [along, edges[s].outward_at(along)]))
            })
            .collect();
        let mut length = vec![0.0];
        for pair in path.windows(2) {
            length.push(length[length.len() - 1] + (pair[1] - pair[0]).norm());
        }
        let total = length[fine];
        rim.side_lengths_m[s] = total;
        rim.edge_m[s] = edges[s].mean_m();
        for k in 0..POINTS_PER_SIDE {
            let want = total * k as f64 / (POINTS_PER_SIDE - 1) as f64;
            let i = length.partition_point(|l| *l < want).clamp(1, fine);
            let t =
                ((want - length[i - 1]) / (length[i] - length[i - 1]).max(1e-12)).clamp(0.0, 1.0);
            let along = start + (end - start) * ((i - 1) as f64 + t) / fine as f64;
            let m = from_side(s, [along, edges[s].outward_at(along)]);
            rim.material.push(m);
            rim.points.push(BoundaryPoint {
                position_m: sheet.at(m),
                sigma_m: sheet.sigma_m(m).hypot(edges[s].sigma_at(along) / 3_f64.sqrt()),
                observed: edges[s].observed_at(along),
            });
        }
    }
    rim
}

/// An arc of the rim that is bridged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    /// Its length along the rim \[m\].
    pub length_m: f64,
    /// The bearing halfway between its ends \[degrees\].
    pub bearing_deg: f64,
}

/// The longest run of bridged points; of no length if there is none.
pub(super) fn longest_gap(points: &[BoundaryPoint]) -> Gap {
    let n = points.len();
    let Some(first) = points.iter().position(|p| p.observed) else {
        return Gap { length_m: f64::INFINITY, bearing_deg: 0.0 };
    };
    let bearing = |i: usize| bearing_deg(&points[i % n].position_m);
    let mut longest = Gap { length_m: 0.0, bearing_deg: 0.0 };
    let (mut run, mut run_m, mut swept_deg) = (0, 0.0, 0.0);
    for step in first + 1..=first + n {
        run_m += (points[step % n].position_m - points[(step - 1) % n].position_m).norm();
        swept_deg += (bearing(step) - bearing(step - 1) + 540.0).rem_euclid(360.0) - 180.0;
        if points[step % n].observed {
            if run > 0 && run_m > longest.length_m {
                let bearing_deg = (bearing(step) - 0.5 * swept_deg).rem_euclid(360.0);
                longest = Gap { length_m: run_m, bearing_deg };
            }
            (run, run_m, swept_deg) = (0, 0.0, 0.0);
        } else {
            run += 1;
        }
    }
    longest
}

/// Bearing of a place in the local frame, seen from the plate's axis \[degrees\].
pub(super) fn bearing_deg(at: &Point3) -> f64 {
    (-at.z).atan2(at.x).to_degrees().rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_gap_is_found_across_the_seam() {
        let at = |i: usize| {
            let angle = (i as f64).to_radians();
            Point3::new(0.3 * angle.cos(), 0.0, -0.3 * angle.sin())
        };
        let seen = |i: usize| !(100..104).contains(&i) && (6..354).contains(&i);
        let point = |i: usize| BoundaryPoint { position_m: at(i), sigma_m: 0.0, observed: seen(i) };
        let points: Vec<_> = (0..360).map(point).collect();
        let Gap { length_m, bearing_deg } = longest_gap(&points);
        assert!((length_m - 0.3 * 13_f64.to_radians()).abs() < 1e-4, "{length_m}");
        assert!((bearing_deg + 0.5).rem_euclid(360.0) < 1e-9, "{bearing_deg}");
    }
}

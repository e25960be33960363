//! The rim: edges and corners in material coordinates, carried into space by the
//! sheet and divided into the boundary vector's points.
//!
//! Corners are where the edges of two sides meet. Each side is divided into 60
//! equal arcs in space; for cloth that stretches evenly along a side these are
//! the material's 5 mm.

use super::edge::{self, Edge};
use super::error::ScanError;
use super::options::ScanOptions;
use super::relax::Tie;
use super::sheet::Sheet;
use super::trust::Unexplained;
use crate::base::boundary::{POINTS_PER_SIDE, SIDES};
use crate::base::{BoundaryPoint, Point3};
use crate::numeric::robust;

/// Noise up to which bridges are held by the sheet's lengths [m].
const BRIDGED_WELL_NOISE_M: f64 = 1e-3;
/// Points this close to the edge are tied to the square's side [m].
const EDGE_BAND_M: f64 = 4e-3;

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

/// Material coordinates as (along, outward) of a side: 0 is x = +half walked
/// towards +z, 1 is z = +half towards -x, and so on.
pub(super) fn to_side(side: usize, m: [f64; 2]) -> [f64; 2] {
    match side {
        0 => [m[1], m[0]],
        1 => [-m[0], m[1]],
        2 => [-m[1], -m[0]],
        _ => [m[0], -m[1]],
    }
}

/// The inverse of [`to_side`].
pub(super) fn from_side(side: usize, [along, outward]: [f64; 2]) -> [f64; 2] {
    match side {
        0 => [outward, along],
        1 => [-along, outward],
        2 => [-outward, -along],
        _ => [along, -outward],
    }
}

/// Edges of the four sides from material coordinates of raw points near them.
pub(super) fn edges(material: &[[f64; 2]], half_m: f64, blur_m: f64) -> [Edge; SIDES] {
    std::array::from_fn(|side| {
        let points: Vec<[f64; 2]> = material.iter().map(|&m| to_side(side, m)).collect();
        edge::measure(&points, half_m, blur_m)
    })
}

/// Ties that pull points at the free edge so that each side becomes straight.
pub(super) fn ties(material: &[[f64; 2]], half_m: f64) -> Vec<Tie> {
    let mut ties = Vec::new();
    for side in 0..SIDES {
        let points: Vec<[f64; 2]> = material.iter().map(|&m| to_side(side, m)).collect();
        let edge = edge::measure_bent(&points, half_m);
        let line = edge.mean_m();
        for (point, p) in points.iter().enumerate() {
            let inward = edge.outward_at(p[0]) - p[1];
            if p[0].abs() < half_m
                && edge.observed_at(p[0])
                && (-2e-3..EDGE_BAND_M).contains(&inward)
            {
                let target = from_side(side, [p[0], line - inward]);
                let coordinate = side % 2;
                ties.push(Tie { point, coordinate, target_m: target[coordinate], weight: 1.0 });
            }
        }
    }
    ties
}

/// Mean length of the cloth in space from edge to opposite edge \[m\]: along x
/// (sides 2 to 0), along z (sides 3 to 1). Lines with a bridged end do not count;
/// `None` if none is left.
pub(super) fn widths_m(sheet: &Sheet, edges: &[Edge; SIDES], half_m: f64) -> [Option<f64>; 2] {
    [0, 1].map(|side| {
        let lengths: Vec<f64> = (-14..=14)
            .map(|k| f64::from(k) / 15.0 * half_m)
            .filter(|&along| edges[side].observed_at(along) && edges[side + 2].observed_at(-along))
            .map(|along| {
                let (from, to) =
                    (-edges[side + 2].outward_at(-along), edges[side].outward_at(along));
                let count = 200;
                let at = |k: i32| {
                    let outward = from + (to - from) * f64::from(k) / f64::from(count);
                    sheet.at(from_side(side, [along, outward]))
                };
                (0..count).map(|k| (at(k + 1) - at(k)).norm()).sum()
            })
            .collect();
        robust::median(lengths)
    })
}

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
        let path: Vec<([f64; 2], Point3)> = (0..=fine)
            .map(|k| {
                let along = start + (end - start) * k as f64 / fine as f64;
                let m = from_side(s, [along, edges[s].outward_at(along)]);
                (m, sheet.at(m))
            })
            .collect();
        let mut length = vec![0.0];
        for pair in path.windows(2) {
            length.push(length[length.len() - 1] + (pair[1].1 - pair[0].1).norm());
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

/// The longest run of bridged points: its length along the rim \[m\] and the bearing
/// halfway between its ends \[degrees\].
pub(super) fn longest_gap(points: &[BoundaryPoint]) -> (f64, f64) {
    let n = points.len();
    let Some(first) = points.iter().position(|p| p.observed) else {
        return (f64::INFINITY, 0.0);
    };
    let bearing = |i: usize| bearing_deg(&points[i % n].position_m);
    let mut best = (0.0, 0.0);
    let (mut run, mut run_m, mut turned_deg) = (0, 0.0, 0.0);
    for step in first + 1..=first + n {
        run_m += (points[step % n].position_m - points[(step - 1) % n].position_m).norm();
        turned_deg += (bearing(step) - bearing(step - 1) + 540.0).rem_euclid(360.0) - 180.0;
        if points[step % n].observed {
            if run > 0 && run_m > best.0 {
                best = (run_m, (bearing(step) - 0.5 * turned_deg).rem_euclid(360.0));
            }
            (run, run_m, turned_deg) = (0, 0.0, 0.0);
        } else {
            run += 1;
        }
    }
    best
}

/// Bearing of a place in the local frame, seen from the plate's axis \[degrees\].
pub(super) fn bearing_deg(at: &Point3) -> f64 {
    (-at.z).atan2(at.x).to_degrees().rem_euclid(360.0)
}

/// Refuses a rim that cannot be trusted.
pub(super) fn judge(
    rim: &Rim,
    unexplained: &Unexplained,
    noise_m: f64,
    options: &ScanOptions,
) -> Result<(), ScanError> {
    let more_noise_m = (noise_m - BRIDGED_WELL_NOISE_M).max(0.0);
    let min_observed = options.min_observed + options.min_observed_per_noise * more_noise_m;
    let max_gap_m = (options.max_gap_m - options.max_gap_per_noise * more_noise_m).max(0.0);
    let bearing = |i: usize| bearing_deg(&rim.points[i].position_m);
    let observed =
        rim.points.iter().filter(|p| p.observed).count() as f64 / rim.points.len() as f64;
    let (gap_m, gap_bearing_deg) = longest_gap(&rim.points);
    if observed < min_observed {
        return Err(ScanError::TooLittleRim {
            observed_percent: observed * 100.0,
            limit_percent: min_observed * 100.0,
            length_mm: gap_m * 1e3,
            bearing_deg: gap_bearing_deg,
        });
    }
    if gap_m > max_gap_m {
        return Err(ScanError::Gap {
            length_mm: gap_m * 1e3,
            limit_mm: max_gap_m * 1e3,
            bearing_deg: gap_bearing_deg,
        });
    }
    if unexplained.area_m2 > options.max_unexplained_m2 {
        return Err(ScanError::Unexplained {
            area_mm2: unexplained.area_m2 * 1e6,
            limit_mm2: options.max_unexplained_m2 * 1e6,
            bearing_deg: bearing(unexplained.rim_point),
        });
    }
    let side_bearing = |s: usize| bearing(s * POINTS_PER_SIDE + POINTS_PER_SIDE / 2);
    for (s, length) in rim.side_lengths_m.iter().enumerate() {
        if !(options.side_range_m[0]..=options.side_range_m[1]).contains(length) {
            return Err(ScanError::SideLength {
                measured_mm: length * 1e3,
                min_mm: options.side_range_m[0] * 1e3,
                max_mm: options.side_range_m[1] * 1e3,
                bearing_deg: side_bearing(s),
            });
        }
    }
    let median_m = robust::median(rim.side_lengths_m.to_vec()).unwrap_or(0.0);
    let off = |s: usize| (rim.side_lengths_m[s] - median_m).abs();
    let worst = (0..SIDES).max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
    let limit_m = options.max_uneven_m + options.max_uneven_per_noise * noise_m;
    if off(worst) > limit_m {
        return Err(ScanError::UnevenSides {
            measured_mm: rim.side_lengths_m[worst] * 1e3,
            median_mm: median_m * 1e3,
            limit_mm: limit_m * 1e3,
            bearing_deg: side_bearing(worst),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Boundary;

    #[test]
    fn sides_run_like_the_boundary_vector() {
        for i in 0..244 {
            let m = Boundary::flat_xz_m(i, 0.3);
            let [along, outward] = to_side(i / 61, m);
            assert!((outward - 0.15).abs() < 1e-12, "{i}");
            assert!((along - ((i % 61) as f64 * 5e-3 - 0.15)).abs() < 1e-12, "{i}");
            let back = from_side(i / 61, [along, outward]);
            assert!((back[0] - m[0]).abs() + (back[1] - m[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn the_longest_gap_is_found_across_the_seam() {
        let at = |i: usize| {
            let angle = (i as f64).to_radians();
            Point3::new(0.3 * angle.cos(), 0.0, -0.3 * angle.sin())
        };
        let seen = |i: usize| !(100..104).contains(&i) && (6..354).contains(&i);
        let point = |i: usize| BoundaryPoint { position_m: at(i), sigma_m: 0.0, observed: seen(i) };
        let points: Vec<_> = (0..360).map(point).collect();
        let (length_m, bearing_deg) = longest_gap(&points);
        assert!((length_m - 0.3 * 13_f64.to_radians()).abs() < 1e-4, "{length_m}");
        assert!((bearing_deg + 0.5).rem_euclid(360.0) < 1e-9, "{bearing_deg}");
    }
}

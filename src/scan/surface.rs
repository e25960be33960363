//! The sheet as the simulator takes it: the places of the flat specimen, 5 mm apart, in space.
//!
//! The fitted map x(m) is read at m + e(m): e is where the measured free edge lies off the nominal
//! one. On the four sides it is the rim's own, so that the sides of the sheet are the rim; between
//! them it is the bilinear blend (Coons 1967), so that an edge 0.3 mm farther out stretches
//! the sheet by 0.2 % and moves nothing by more.
//!
//! In: the sheet, the rim traced on it (both local frame) and the surface points' places. Out: a
//! [`Surface`]. A place is observed if enough surface points lie around it on the sheet; its sigma
//! is the posterior's, what views disagree by and, away from what was observed, that of a bridge.

use rayon::prelude::*;

use super::rim::Rim;
use super::sheet::Sheet;
use super::tuning::UncertaintyTuning;
use super::uncertainty::{curvature_per_m, sheet_sigma_m};
use crate::base::boundary::{Boundary, POINTS_PER_SIDE, SIDES};
use crate::base::{Isometry3, Surface, SurfacePoint};

/// Every how many places the posterior is computed; between them it is linear.
const POSTERIOR_STEP: usize = 4;

/// What a sheet is sampled from.
pub(super) struct Sampled<'a> {
    /// The map.
    pub sheet: &'a Sheet,
    /// The rim, with its flags set; its positions may be of any frame.
    pub rim: &'a Rim,
    /// Places of the surface points on the sheet \[m\].
    pub material: &'a [[f64; 2]],
    /// Distance between surface points \[m\].
    pub spacing_m: f64,
    /// Noise of single points \[m\].
    pub noise_m: f64,
    /// What it leaves of itself on the smoothed surface, seen over the plate \[m\].
    pub on_plate_m: f64,
    /// Side of the flat specimen \[m\].
    pub side_m: f64,
    /// The simulation frame from the sheet's.
    pub sim_from_local: Isometry3,
    /// The constants.
    pub tuning: &'a UncertaintyTuning,
}

/// Samples the sheet.
pub(super) fn sample(of: &Sampled) -> Surface {
    let n = Surface::SIDE;
    let step_m = of.side_m / (n - 1) as f64;
    let flat = |i: usize, j: usize| [i, j].map(|k| k as f64 * step_m - 0.5 * of.side_m);
    let edge = EdgeOffset::of(of.rim, of.side_m);
    let place = |i: usize, j: usize| {
        let (m, e) = (flat(i, j), edge.at([i, j]));
        [m[0] + e[0], m[1] + e[1]]
    };
    let posterior_m = posterior_m(of, place);
    let away = steps_from_observed(&observed(of, place));
    let common_m = sheet_sigma_m(curvature_per_m(of.rim), of.on_plate_m, of.tuning)
        .hypot(of.tuning.rotation_sigma_m);
    let point = |k: usize| {
        let (i, j) = (k / n, k % n);
        let at = of.sheet.at(place(i, j));
        let bridge_m = match away[k] {
            0 => 0.0,
            steps => {
                of.tuning.bridged_share * steps as f64 * step_m
                    + of.tuning.bridged_noise_share * of.noise_m
            }
        };
        let sigma_m =
            (of.tuning.posterior_share * posterior_m(i, j)).hypot(common_m).hypot(bridge_m);
        SurfacePoint { position_m: of.sim_from_local * at, sigma_m, observed: away[k] == 0 }
    };
    Surface::new((0..n * n).map(point).collect())
        .unwrap_or_else(|_| unreachable!("{n} x {n} places"))
}

/// Where the measured edge lies off the nominal one, in material coordinates \[m\].
struct EdgeOffset {
    /// Of the places of the sides, along each side's rising coordinate: j of i = last, i of
    /// j = last, j of i = 0, i of j = 0.
    sides: [Vec<[f64; 2]>; SIDES],
}

impl EdgeOffset {
    fn of(rim: &Rim, side_m: f64) -> Self {
        let sides = std::array::from_fn(|side| {
            let offset = |k: usize| {
                let index = side * POINTS_PER_SIDE + k;
                let (m, flat) = (rim.material[index], Boundary::flat_xz_m(index, side_m));
                [m[0] - flat[0], m[1] - flat[1]]
            };
            // the walk runs against the coordinate on the second and the third side
            let against = side == 1 || side == 2;
            let last = POINTS_PER_SIDE - 1;
            (0..=last).map(|k| offset(if against { last - k } else { k })).collect()
        });
        Self { sides }
    }

    /// The offset at a place of the sheet.
    fn at(&self, [i, j]: [usize; 2]) -> [f64; 2] {
        let last = POINTS_PER_SIDE - 1;
        let [u, v] = [i, j].map(|k| k as f64 / last as f64);
        let [far_i, far_j, near_i, near_j] = &self.sides;
        std::array::from_fn(|c| {
            let along_i = near_i[j][c] * (1.0 - u) + far_i[j][c] * u;
            let along_j = near_j[i][c] * (1.0 - v) + far_j[i][c] * v;
            let corners = (near_i[0][c] * (1.0 - v) + near_i[last][c] * v) * (1.0 - u)
                + (far_i[0][c] * (1.0 - v) + far_i[last][c] * v) * u;
            along_i + along_j - corners
        })
    }
}

/// The posterior standard deviation of the places, per coordinate \[m\].
fn posterior_m(
    of: &Sampled,
    place: impl Fn(usize, usize) -> [f64; 2] + Sync,
) -> impl Fn(usize, usize) -> f64 {
    let coarse = (Surface::SIDE - 1) / POSTERIOR_STEP + 1;
    let known: Vec<f64> = (0..coarse * coarse)
        .into_par_iter()
        .map(|k| {
            let (i, j) = (k / coarse * POSTERIOR_STEP, k % coarse * POSTERIOR_STEP);
            of.sheet.sigma_m(place(i, j))
        })
        .collect();
    move |i, j| {
        let [a, b] = [i, j].map(|k| (k / POSTERIOR_STEP).min(coarse - 2));
        let [s, t] =
            [(i, a), (j, b)].map(|(k, from)| k as f64 / POSTERIOR_STEP as f64 - from as f64);
        let at = |da: usize, db: usize| known[(a + da) * coarse + b + db];
        (at(0, 0) * (1.0 - t) + at(0, 1) * t) * (1.0 - s)
            + (at(1, 0) * (1.0 - t) + at(1, 1) * t) * s
    }
}

/// Which places have enough surface points around them on the sheet; those of the sides are as the
/// rim says.
fn observed(of: &Sampled, place: impl Fn(usize, usize) -> [f64; 2]) -> Vec<bool> {
    let n = Surface::SIDE;
    // a square of this half side around each place is looked at
    let reach_m = 0.5 * of.tuning.around_m;
    let cell_m = of.side_m / (n - 1) as f64;
    let mut counts = vec![0_u32; n * n];
    for m in of.material {
        let [ci, cj] = m.map(|c| (c + 0.5 * of.side_m) / cell_m);
        let range = |c: f64| {
            let low = (c - reach_m / cell_m).ceil().max(0.0) as usize;
            let high = (c + reach_m / cell_m).floor().min((n - 1) as f64);
            low..if high < 0.0 { 0 } else { high as usize + 1 }
        };
        for i in range(ci) {
            for j in range(cj) {
                counts[i * n + j] += 1;
            }
        }
    }
    let half_m = 0.5 * of.side_m;
    let mut observed: Vec<bool> = (0..n * n)
        .map(|k| {
            let m = place(k / n, k % n);
            let inside = m.map(|c| reach_m + (half_m - c.abs()).clamp(0.0, reach_m));
            let wanted = inside[0] * inside[1] / of.spacing_m.powi(2);
            f64::from(counts[k]) > of.tuning.min_support * wanted
        })
        .collect();
    for side in 0..SIDES {
        for k in 0..n {
            let last = n - 1;
            let (i, j) = match side {
                0 => (last, k),
                1 => (last - k, last),
                2 => (0, last - k),
                _ => (k, 0),
            };
            observed[i * n + j] = of.rim.points[side * POINTS_PER_SIDE + k].observed;
        }
    }
    observed
}

/// Steps of a place from the nearest observed one, along the flat cloth; 0 for those that are.
fn steps_from_observed(observed: &[bool]) -> Vec<usize> {
    let n = Surface::SIDE;
    let mut steps: Vec<usize> = observed.iter().map(|seen| if *seen { 0 } else { n }).collect();
    let mut relax = |k: usize| {
        let (i, j) = (k / n, k % n);
        let neighbours = [
            (i > 0, k.wrapping_sub(n)),
            (i + 1 < n, k + n),
            (j > 0, k.wrapping_sub(1)),
            (j + 1 < n, k + 1),
        ];
        for (_, near) in neighbours.into_iter().filter(|(inside, _)| *inside) {
            steps[k] = steps[k].min(steps[near] + 1);
        }
    };
    // sweeps there and back carry the distance from neighbour to neighbour
    for _ in 0..2 {
        (0..n * n).for_each(&mut relax);
        (0..n * n).rev().for_each(&mut relax);
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_from_what_was_observed_grows_over_a_hole() {
        let n = Surface::SIDE;
        let hole = |k: usize| (20..27).contains(&(k / n)) && (30..51).contains(&(k % n));
        let observed: Vec<bool> = (0..n * n).map(|k| !hole(k)).collect();
        let steps = steps_from_observed(&observed);
        assert_eq!(
            [19 * n + 40, 20 * n + 40, 23 * n + 40, 23 * n + 31].map(|k| steps[k]),
            [0, 1, 4, 2]
        );
    }
}

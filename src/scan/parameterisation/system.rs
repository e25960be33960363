//! The linear system of one relaxation round, by conjugate gradients with a two-level
//! preconditioner.

use rayon::prelude::*;

use super::super::tuning::ParameterisationTuning;
use super::links::Links;
use crate::numeric::banded::{Banded, Factor};

/// Pulls one coordinate of a point to a target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tie {
    /// The point.
    pub point: usize,
    /// 0 for x, 1 for z.
    pub coordinate: usize,
    /// Where to \[m\].
    pub target_m: f64,
    /// Weight; a link has 1.
    pub weight: f64,
}

/// The coarse half of a two-level preconditioner: one unknown per cell of the
/// material plane, solved directly. Without it, what strips of cloth between two
/// slits do as a whole takes hundreds of steps.
struct Coarse {
    /// Cell of each point.
    cell: Vec<usize>,
    /// Factor for each coordinate.
    factors: [Option<Factor>; 2],
    cells: usize,
}

impl Coarse {
    fn new(system: &System, tied: &[[f64; 2]], x: &[[f64; 2]]) -> Self {
        let System { links, weights, fixed, tuning, .. } = *system;
        let (half_m, cell_m) = (tuning.coarse_half_m, tuning.coarse_cell_m);
        let side = (2.0 * half_m / cell_m).ceil() as usize;
        let of = |c: f64| (((c + half_m) / cell_m).max(0.0) as usize).min(side - 1);
        let cell: Vec<usize> = x.iter().map(|p| of(p[0]) * side + of(p[1])).collect();
        let cells = side * side;
        let mut linked = Banded::zeros(cells, side + 1);
        for i in 0..cells {
            linked.add(i, i, 1e-6);
        }
        for i in (0..links.points()).filter(|&i| !fixed[i]) {
            for e in links.range(i) {
                let (a, j) = (cell[i], links.to[e] as usize);
                let b = cell[j];
                if fixed[j] {
                    linked.add(a, a, weights[e]);
                } else if a != b && a.abs_diff(b) <= side + 1 && i < j {
                    linked.add(a, a, weights[e]);
                    linked.add(b, b, weights[e]);
                    linked.add(a, b, -weights[e]);
                }
            }
        }
        let with_ties = |c: usize| {
            let mut matrix = linked.clone();
            for i in (0..links.points()).filter(|&i| !fixed[i] && tied[i][c] != 0.0) {
                matrix.add(cell[i], cell[i], tied[i][c]);
            }
            matrix.cholesky()
        };
        let (x, z) = rayon::join(|| with_ties(0), || with_ties(1));
        let factors = [x, z];
        Self { cell, factors, cells }
    }

    /// Adds the coarse correction of `r` to `z`.
    fn add(&self, r: &[[f64; 2]], fixed: &[bool], z: &mut [[f64; 2]]) {
        for (c, factor) in self.factors.iter().enumerate() {
            let Some(factor) = factor else { continue };
            let mut sum = vec![0.0; self.cells];
            for (i, r) in r.iter().enumerate() {
                sum[self.cell[i]] += r[c];
            }
            factor.solve(&mut sum);
            for (i, z) in z.iter_mut().enumerate().filter(|(i, _)| !fixed[*i]) {
                z[c] += sum[self.cell[i]];
            }
        }
    }
}

/// The system of one round: links with their weights, points that stay, ties.
#[derive(Clone, Copy)]
pub(super) struct System<'a> {
    /// The links.
    pub links: &'a Links,
    /// Their weights.
    pub weights: &'a [f64],
    /// Points that stay.
    pub fixed: &'a [bool],
    /// Pulls on single coordinates.
    pub ties: &'a [Tie],
    /// The constants.
    pub tuning: &'a ParameterisationTuning,
}

impl System<'_> {
    /// Conjugate gradients with a two-level preconditioner, both coordinates at once,
    /// started at the present coordinates; `rotations` bring the points' steps to what they should
    /// be.
    pub fn solve(&self, rotations: &[[f64; 2]], steps: usize, x: &mut [[f64; 2]]) {
        let System { links, weights, fixed, ties, .. } = *self;
        let count = x.len();
        let mut tied = vec![[0.0; 2]; count];
        let mut pull = vec![[0.0; 2]; count];
        for tie in ties {
            tied[tie.point][tie.coordinate] += tie.weight;
            pull[tie.point][tie.coordinate] +=
                tie.weight * (tie.target_m - x[tie.point][tie.coordinate]);
        }
        let diagonal: Vec<[f64; 2]> = (0..count)
            .map(|i| {
                let own = links.range(i).map(|e| weights[e]).sum::<f64>().max(1e-9);
                [own + tied[i][0], own + tied[i][1]]
            })
            .collect();
        let mut r: Vec<[f64; 2]> = (0..count)
            .into_par_iter()
            .map(|i| {
                let mut g = pull[i];
                if fixed[i] {
                    return [0.0; 2];
                }
                for e in links.range(i).filter(|&e| weights[e] > 0.0) {
                    let (j, back) = (links.to[e] as usize, links.back[e] as usize);
                    let there = links.rotated(e, rotations[i]);
                    let again = links.rotated(back, rotations[j]);
                    for c in 0..2 {
                        let want = 0.5 * (there[c] - again[c]);
                        g[c] += weights[e] * (x[j][c] - x[i][c] - want);
                    }
                }
                g
            })
            .collect();
        let product = |p: &[[f64; 2]]| -> Vec<[f64; 2]> {
            (0..count)
                .into_par_iter()
                .map(|i| {
                    if fixed[i] {
                        return [0.0; 2];
                    }
                    let mut out = [tied[i][0] * p[i][0], tied[i][1] * p[i][1]];
                    for e in links.range(i) {
                        let j = links.to[e] as usize;
                        out[0] += weights[e] * (p[i][0] - p[j][0]);
                        out[1] += weights[e] * (p[i][1] - p[j][1]);
                    }
                    out
                })
                .collect()
        };
        let dot = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            a.iter().zip(b).fold([0.0; 2], |s, (a, b)| [s[0] + a[0] * b[0], s[1] + a[1] * b[1]])
        };
        let coarse = Coarse::new(self, &tied, x);
        let precondition = |r: &[[f64; 2]]| -> Vec<[f64; 2]> {
            let mut z: Vec<[f64; 2]> =
                r.iter().zip(&diagonal).map(|(r, d)| [r[0] / d[0], r[1] / d[1]]).collect();
            coarse.add(r, fixed, &mut z);
            z
        };
        let mut z = precondition(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        for _ in 0..steps {
            let ap = product(&p);
            let pap = dot(&p, &ap);
            let alpha = [0, 1].map(|c| if pap[c] > 1e-300 { rz[c] / pap[c] } else { 0.0 });
            for i in 0..count {
                for c in 0..2 {
                    x[i][c] += alpha[c] * p[i][c];
                    r[i][c] -= alpha[c] * ap[i][c];
                }
            }
            z = precondition(&r);
            let next = dot(&r, &z);
            let beta = [0, 1].map(|c| if rz[c] > 1e-300 { next[c] / rz[c] } else { 0.0 });
            rz = next;
            for i in 0..count {
                for c in 0..2 {
                    p[i][c] = z[i][c] + beta[c] * p[i][c];
                }
            }
        }
    }
}

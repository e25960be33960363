//! Relaxation of material coordinates: the best local isometry, with the free
//! edge tied to the square.
//!
//! Minimises over the coordinates x and a rotation R per point
//!   sum over links w_ij |x_j - x_i - R_i t_ij|^2 + sum over ties v (x_c - target)^2
//! alternately (local/global, Liu et al. 2008): t_ij is the step from i to j in
//! the tangent plane of i. Links whose length disagrees, because they step from
//! one layer of cloth to another, lose their weight (Geman-McClure).
//!
//! In and out: coordinates \[m\] of the unrolled points. Points on the plate stay.

use rayon::prelude::*;

use crate::numeric::banded::{Banded, Factor};

/// Cell of the coarse grid of the preconditioner [m], and its half side.
const COARSE_M: f64 = 12e-3;
const COARSE_HALF_M: f64 = 0.21;

/// How far to go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Most rounds.
    pub rounds: usize,
    /// Conjugate gradient steps in each.
    pub steps: usize,
    /// A round that moves the points by less than this in the mean is the last \[m\].
    pub enough_m: f64,
}

/// Directed links with the step in the tangent plane of their start.
#[derive(Default)]
pub(super) struct Links {
    start: Vec<usize>,
    to: Vec<u32>,
    step: Vec<[f64; 2]>,
    /// The link the other way round, `u32::MAX` if there is none.
    back: Vec<u32>,
}

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

/// Length. (`hypot` guards against overflow and costs a tenth of the whole path.)
fn norm([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

impl Links {
    /// From each point's list of (neighbour, step), neighbours increasing.
    pub fn new(lists: impl Iterator<Item = Vec<(u32, [f64; 2])>>) -> Self {
        let (mut start, mut to, mut step) = (vec![0], Vec::new(), Vec::new());
        for list in lists {
            for (j, d) in list {
                to.push(j);
                step.push(d);
            }
            start.push(to.len());
        }
        let count = start.len() - 1;
        let back = (0..count)
            .into_par_iter()
            .flat_map_iter(|i| {
                let (start, to) = (&start, &to);
                (start[i]..start[i + 1]).map(move |e| {
                    let j = to[e] as usize;
                    let found = to[start[j]..start[j + 1]].binary_search(&(i as u32));
                    found.map_or(u32::MAX, |at| (start[j] + at) as u32)
                })
            })
            .collect();
        Self { start, to, step, back }
    }

    fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i]..self.start[i + 1]
    }

    fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Weights of the links at the coordinates `x`: 1 where lengths agree.
    fn weights(&self, x: &[[f64; 2]], spacing_m: f64) -> Vec<f64> {
        let mut one_way = vec![0.0; self.to.len()];
        self.fill(&mut one_way, &|i, own| {
            for (weight, e) in own.iter_mut().zip(self.range(i)) {
                let j = self.to[e] as usize;
                let length = norm(self.step[e]);
                let now = norm([x[j][0] - x[i][0], x[j][1] - x[i][1]]);
                *weight = 1.0 / (1.0 + ((now - length) / (0.5 * spacing_m)).powi(2)).powi(2);
            }
        });
        (0..self.to.len())
            .into_par_iter()
            .map(|e| match self.back[e] {
                u32::MAX => 0.0,
                back => one_way[e].min(one_way[back as usize]),
            })
            .collect()
    }

    /// The steps turned into the plane of the coordinates, each point's by its
    /// best rotation.
    fn turned(&self, x: &[[f64; 2]], weights: &[f64]) -> Vec<[f64; 2]> {
        let mut turned = vec![[0.0; 2]; self.to.len()];
        self.fill(&mut turned, &|i, own| {
            let (mut c, mut s) = (0.0, 0.0);
            for e in self.range(i) {
                let j = self.to[e] as usize;
                let (dx, dy) = (x[j][0] - x[i][0], x[j][1] - x[i][1]);
                c += weights[e] * (dx * self.step[e][0] + dy * self.step[e][1]);
                s += weights[e] * (dy * self.step[e][0] - dx * self.step[e][1]);
            }
            let norm = c.hypot(s).max(1e-300);
            let (c, s) = (c / norm, s / norm);
            for (turned, e) in own.iter_mut().zip(self.range(i)) {
                let step = self.step[e];
                *turned = [c * step[0] - s * step[1], s * step[0] + c * step[1]];
            }
        });
        turned
    }

    /// Lets `of` fill each point's links in `all`, which has one entry per link.
    fn fill<T: Send>(&self, all: &mut [T], of: &(impl Fn(usize, &mut [T]) + Sync)) {
        self.fill_points(0..self.len(), all, of);
    }

    fn fill_points<T: Send>(
        &self,
        points: std::ops::Range<usize>,
        all: &mut [T],
        of: &(impl Fn(usize, &mut [T]) + Sync),
    ) {
        const TOGETHER: usize = 2048;
        let first = self.start[points.start];
        if points.len() > TOGETHER {
            let middle = points.start + points.len() / 2;
            let (left, right) = all.split_at_mut(self.start[middle] - first);
            rayon::join(
                || self.fill_points(points.start..middle, left, of),
                || self.fill_points(middle..points.end, right, of),
            );
            return;
        }
        for i in points {
            let own = self.range(i);
            of(i, &mut all[own.start - first..own.end - first]);
        }
    }
}

/// Relaxes `x` in place; `fixed` points stay. Each round is one local and one
/// global step; Anderson acceleration over the last rounds takes the place of the
/// hundreds that a long strip of cloth needs to swing.
pub(super) fn relax(
    links: &Links,
    fixed: &[bool],
    ties: &[Tie],
    spacing_m: f64,
    effort: Effort,
    x: &mut [[f64; 2]],
) {
    let mut mixer = Mixer::default();
    for _ in 0..effort.rounds {
        let weights = links.weights(x, spacing_m);
        let turned = links.turned(x, &weights);
        let mut next = x.to_vec();
        solve(links, &weights, &turned, (fixed, ties), effort.steps, &mut next);
        let before = x.to_vec();
        mixer.step(x, next);
        let moves = x.iter().zip(&before).map(|(a, b)| norm([a[0] - b[0], a[1] - b[1]]));
        if moves.sum::<f64>() < effort.enough_m * x.len() as f64 {
            break;
        }
    }
}

/// Anderson acceleration of a fixed-point iteration (Walker and Ni 2011).
#[derive(Default)]
struct Mixer {
    /// Differences of the residuals and of the images of successive rounds.
    history: Vec<(Vec<f64>, Vec<f64>)>,
    last: Option<(Vec<f64>, Vec<f64>)>,
}

impl Mixer {
    /// Rounds that are remembered.
    const MEMORY: usize = 5;

    /// Replaces `x` by the accelerated successor; `image` is the plain one.
    fn step(&mut self, x: &mut [[f64; 2]], image: Vec<[f64; 2]>) {
        let flat = |v: &[[f64; 2]]| -> Vec<f64> { v.iter().flatten().copied().collect() };
        let image = flat(&image);
        let residual: Vec<f64> = image.iter().zip(flat(x)).map(|(g, x)| g - x).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        if let Some((old_residual, old_image)) = self.last.take() {
            // A residual that grows means that the links' weights have changed.
            if dot(&residual, &residual) > 2.0 * dot(&old_residual, &old_residual) {
                self.history.clear();
            } else {
                let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                self.history.push((minus(&residual, &old_residual), minus(&image, &old_image)));
                if self.history.len() > Self::MEMORY {
                    self.history.remove(0);
                }
            }
        }
        let m = self.history.len();
        let mut mixed = image.clone();
        if m > 0 {
            let gram = nalgebra::DMatrix::from_fn(m, m, |a, b| {
                dot(&self.history[a].0, &self.history[b].0)
            });
            let ridge = 1e-10 * gram.trace() + 1e-300;
            let right = nalgebra::DVector::from_fn(m, |a, _| dot(&self.history[a].0, &residual));
            let system = gram + nalgebra::DMatrix::identity(m, m) * ridge;
            if let Some(share) = system.cholesky().map(|c| c.solve(&right)) {
                for (k, (_, image)) in self.history.iter().enumerate() {
                    mixed.iter_mut().zip(image).for_each(|(x, d)| *x -= share[k] * d);
                }
            }
        }
        for (point, pair) in x.iter_mut().zip(mixed.chunks_exact(2)) {
            *point = [pair[0], pair[1]];
        }
        self.last = Some((residual, image));
    }
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
    fn new(
        links: &Links,
        weights: &[f64],
        fixed: &[bool],
        tied: &[[f64; 2]],
        x: &[[f64; 2]],
    ) -> Self {
        let side = (2.0 * COARSE_HALF_M / COARSE_M).ceil() as usize;
        let of = |c: f64| (((c + COARSE_HALF_M) / COARSE_M).max(0.0) as usize).min(side - 1);
        let cell: Vec<usize> = x.iter().map(|p| of(p[0]) * side + of(p[1])).collect();
        let cells = side * side;
        let mut linked = Banded::zeros(cells, side + 1);
        for i in 0..cells {
            linked.add(i, i, 1e-6);
        }
        for i in (0..links.len()).filter(|&i| !fixed[i]) {
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
            for i in (0..links.len()).filter(|&i| !fixed[i] && tied[i][c] != 0.0) {
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

/// Conjugate gradients with a two-level preconditioner, both coordinates at once,
/// started at the present coordinates.
fn solve(
    links: &Links,
    weights: &[f64],
    turned: &[[f64; 2]],
    (fixed, ties): (&[bool], &[Tie]),
    steps: usize,
    x: &mut [[f64; 2]],
) {
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
                for c in 0..2 {
                    let want = 0.5 * (turned[e][c] - turned[back][c]);
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
    let coarse = Coarse::new(links, weights, fixed, &tied, x);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat 20 x 20 patch, 2 mm apart, with true steps.
    fn patch() -> (Links, Vec<[f64; 2]>) {
        let at = |k: usize| [(k / 20) as f64 * 2e-3, (k % 20) as f64 * 2e-3];
        let lists = (0..400).map(|i| {
            let near = (0..400_usize).filter(|&j| {
                let d = [at(j)[0] - at(i)[0], at(j)[1] - at(i)[1]];
                j != i && d[0].hypot(d[1]) < 3e-3
            });
            near.map(|j| (j as u32, [at(j)[0] - at(i)[0], at(j)[1] - at(i)[1]])).collect()
        });
        (Links::new(lists), (0..400).map(at).collect())
    }

    #[test]
    fn a_bent_patch_relaxes_to_its_true_shape() {
        let (links, truth) = patch();
        let mut x: Vec<[f64; 2]> = truth.iter().map(|p| [p[0], p[1] + 2.0 * p[0] * p[0]]).collect();
        let fixed: Vec<bool> = (0..400).map(|k| k < 40).collect();
        x[..40].copy_from_slice(&truth[..40]);
        let effort = Effort { rounds: 20, steps: 12, enough_m: 1e-6 };
        relax(&links, &fixed, &[], 2e-3, effort, &mut x);
        let worst =
            x.iter().zip(&truth).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
        assert!(worst < 0.05e-3, "{:.3} mm", worst * 1e3);
    }
}

//! Links between neighbouring surface points: the step along the surface from each to the
//! next, in the tangent plane of the first.

use rayon::prelude::*;

/// Directed links between surface points, those of each point one after another.
#[derive(Default)]
pub(crate) struct Links {
    start: Vec<usize>,
    /// The point that each link leads to.
    pub to: Vec<u32>,
    step: Vec<[f64; 2]>,
    /// The link the other way round, `u32::MAX` if there is none.
    pub back: Vec<u32>,
}

/// Length. (`hypot` guards against overflow and costs a tenth of the whole path.)
pub(super) fn norm([x, y]: [f64; 2]) -> f64 {
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
        to.shrink_to_fit();
        step.shrink_to_fit();
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

    /// The numbers of the links that start at point `i`.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i]..self.start[i + 1]
    }

    /// Points that are linked.
    pub fn points(&self) -> usize {
        self.start.len() - 1
    }

    /// Weights of the links at the coordinates `x`: 1 where lengths agree, a quarter where
    /// they are off by `off_m`.
    pub fn weights(&self, x: &[[f64; 2]], off_m: f64) -> Vec<f64> {
        let mut one_way = vec![0.0; self.to.len()];
        self.fill(&mut one_way, &|i, own| {
            for (weight, e) in own.iter_mut().zip(self.range(i)) {
                let j = self.to[e] as usize;
                let length = norm(self.step[e]);
                let now = norm([x[j][0] - x[i][0], x[j][1] - x[i][1]]);
                *weight = 1.0 / (1.0 + ((now - length) / off_m).powi(2)).powi(2);
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

    /// The best rotation of each point's steps into the plane of the coordinates: cosine, sine.
    pub fn rotations(&self, x: &[[f64; 2]], weights: &[f64]) -> Vec<[f64; 2]> {
        let best = |i: usize| {
            let (mut c, mut s) = (0.0, 0.0);
            for e in self.range(i) {
                let j = self.to[e] as usize;
                let (dx, dy) = (x[j][0] - x[i][0], x[j][1] - x[i][1]);
                c += weights[e] * (dx * self.step[e][0] + dy * self.step[e][1]);
                s += weights[e] * (dy * self.step[e][0] - dx * self.step[e][1]);
            }
            let norm = c.hypot(s).max(1e-300);
            [c / norm, s / norm]
        };
        (0..self.points()).into_par_iter().map(best).collect()
    }

    /// A link's step, rotated.
    pub fn rotated(&self, link: usize, [c, s]: [f64; 2]) -> [f64; 2] {
        let step = self.step[link];
        [c * step[0] - s * step[1], s * step[0] + c * step[1]]
    }

    /// Lets `of` fill each point's links in `all`, which has one entry per link.
    fn fill<T: Send>(&self, all: &mut [T], of: &(impl Fn(usize, &mut [T]) + Sync)) {
        self.fill_points(0..self.points(), all, of);
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

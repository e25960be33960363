//! Non-rigid registration: the sheet is drawn onto the scan without changing its lengths.
//!
//! `sheet` fits points that keep their material coordinates but for a slow slide;
//! where the parameterisation has cut a fold short, all that lies behind it stays shifted.
//! Here the sheet slides freely under the points and its lengths hold it. Over the
//! controls of the map x(m), a stretch a and a shift b of the free edge,
//!
//! `sum (n . (p_i - x(m_i)))^2 / s_i^2` from raw points to the tangent planes they lie over,
//! `+ integral |E - a W|^2 / e^2` of the strain E = (F^T F - 1) / 2, F = dx/dm,
//! `+ sum |second differences|^2 / d^2`,
//! `+ sum (o . (q - x(end)) - b)^2 / s_q^2` of the free edge q along outward tangents o,
//! `+ (a - a_0)^2 / s_a^2 + b^2 / s_b^2`
//!
//! is lowered by Gauss-Newton steps, the points moved to their nearest places on the
//! sheet before each. A fold that was cut short shows as strain next to it, and the
//! step that removes the strain brings the cloth behind it back. (Tangent planes
//! instead of points: Chen and Medioni 1992.) W is the strain of a sheet that hangs
//! from the plate by its own weight; a is that weight over the stretch stiffness. W
//! grows from the free edge inward and b does not. So an edge that a sensor has shifted
//! strains the sheet little; how far it was shifted is told by `shift`.
//!
//! In: a sheet within a few millimetres and raw points, local frame \[m\]. Out: the
//! sheet and the posterior covariance of its places. Fails where the sheet has been
//! laid into the wrong one of two layers: it stays there.

use nalgebra::{SVector, Vector3};
use rayon::prelude::*;

use super::edge::Edge;
use super::sheet::Sheet;
use super::sides::from_side;
use super::tuning::{RegistrationTuning, SheetTuning};
use crate::base::Point3;
use crate::base::boundary::SIDES;
use crate::numeric::bspline::Grid;
use crate::numeric::spline_system::{SpanSum, SplineSystem};

/// Priors of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Priors<'a> {
    /// Half side of the specimen \[m\].
    pub half_m: f64,
    /// Places on the sheet go no farther than this from its middle along an axis \[m\].
    pub reach_m: f64,
    /// Radius of the plate \[m\].
    pub plate_radius_m: f64,
    /// Standard deviation of a point \[m\].
    pub point_sigma_m: f64,
    /// The first sheet's constants, whose priors of curvature and bounds hold here too.
    pub sheet: &'a SheetTuning,
    /// The constants.
    pub tuning: &'a RegistrationTuning,
}

/// The mean of raw points that are nearest to one surface point.
pub(super) struct Mean {
    /// The mean \[m\].
    pub at: Point3,
    /// Its place on the sheet \[m\].
    pub place: [f64; 2],
    /// Number of raw points.
    pub count: f64,
}

/// Spans whose sums (10 kB each) are held at once.
const SPANS_AT_ONCE: usize = 256;

/// The two unknowns that are common to the whole sheet.
type Row = SVector<f64, 2>;

/// The sheet on its points.
pub(super) struct Registration<'a> {
    pub sheet: Sheet,
    priors: Priors<'a>,
    points: Vec<Point3>,
    /// How many points each stands for.
    counts: Vec<f64>,
    places: Vec<[f64; 2]>,
    system: SplineSystem<2>,
    /// Weight over stretch stiffness \[1/m\].
    pub stretch_per_m: f64,
    /// Outward shift of the free edge against the sheet's lengths \[m\].
    shift_m: f64,
    /// Largest move of a control in the last step \[m\].
    last_move_m: f64,
}

/// A strip of the free edge, as measured.
struct Anchor {
    /// The sheet's end there, material coordinates \[m\], and outward in those.
    end: [f64; 2],
    outward: [f64; 2],
    /// The edge's place \[m\] and its standard deviation across the edge.
    at: Point3,
    sigma_m: f64,
}

impl<'a> Registration<'a> {
    /// A sheet and means of points over it. All together they count as so many points at most as
    /// the priors are weighed against.
    pub fn new(sheet: Sheet, means: &[Mean], priors: Priors<'a>) -> Self {
        let system = SplineSystem::new(sheet.grid);
        let all: f64 = means.iter().map(|mean| mean.count).sum();
        let each = (priors.tuning.most_points as f64 / all).min(1.0);
        let counts = means.iter().map(|mean| mean.count * each).collect();
        let points = means.iter().map(|mean| mean.at).collect();
        let places = means.iter().map(|mean| mean.place).collect();
        let (stretch_per_m, shift_m, last_move_m) = (0.0, 0.0, f64::INFINITY);
        Self { sheet, priors, points, counts, places, system, stretch_per_m, shift_m, last_move_m }
    }

    /// Draws the sheet onto the points and onto the measured edges, in `steps` steps at most.
    /// `None` if the system is singular.
    pub fn draw(&mut self, edges: &[Edge; SIDES], steps: usize) -> Option<()> {
        let tuning = self.priors.tuning;
        let anchors = self.anchors(edges);
        for _ in 0..steps {
            let (sheet, reach_m) = (&self.sheet, self.priors.reach_m);
            self.points.par_iter().zip(&mut self.places).for_each(|(p, place)| {
                *place = sheet.nearest(p, *place, reach_m).material;
            });
            self.assemble(&anchors);
            if self.last_move_m > tuning.factor_m && !self.system.factorize() {
                return None;
            }
            let (step, common) = self.system.step()?;
            let most_m: f64 = step.iter().map(Vector3::norm).fold(0.0, f64::max);
            let share = (tuning.most_move_m / most_m).min(1.0);
            self.last_move_m = most_m;
            for (control, step) in self.sheet.controls.iter_mut().zip(&step) {
                *control += step * share;
            }
            // Cloth does not shrink under its weight.
            self.stretch_per_m = (self.stretch_per_m + common[0] * share).max(0.0);
            self.shift_m += common[1] * share;
            if most_m < tuning.converged_m {
                break;
            }
        }
        Some(())
    }

    fn assemble(&mut self, anchors: &[Anchor]) {
        let grid = self.sheet.grid;
        let spans = grid.side() - 3;
        let mut in_span = vec![(Vec::new(), Vec::new()); spans * spans];
        let span = |at: [f64; 2]| {
            let [a, b] = grid.weights(at).first;
            a * spans + b
        };
        for (i, &place) in self.places.iter().enumerate() {
            in_span[span(place)].0.push(i);
        }
        for anchor in anchors {
            in_span[span(anchor.end)].1.push(anchor);
        }
        self.system.clear();
        for (first, some) in in_span.chunks(SPANS_AT_ONCE).enumerate() {
            let this = &*self;
            let sums: Vec<SpanSum<2>> = some
                .par_iter()
                .enumerate()
                .map(|(k, (points, anchors))| {
                    let k = first * SPANS_AT_ONCE + k;
                    let mut sum = SpanSum::default();
                    points.iter().for_each(|&i| this.add_point(i, &mut sum));
                    this.add_strain([k / spans, k % spans], &mut sum);
                    anchors.iter().for_each(|anchor| this.add_anchor(anchor, &mut sum));
                    sum
                })
                .collect();
            for (k, sum) in sums.iter().enumerate() {
                let k = first * SPANS_AT_ONCE + k;
                self.system.add_span([k / spans, k % spans], sum);
            }
        }
        self.add_bending(grid);
        let tuning = self.priors.tuning;
        self.system.hold(tuning.held_m.powi(-2));
        let from_mean = tuning.stretch_per_m - self.stretch_per_m;
        self.system.hold_common(0, from_mean, tuning.stretch_sigma_per_m.powi(-2));
        self.system.hold_common(1, -self.shift_m, tuning.shift_sigma_m.powi(-2));
    }

    /// One point to its tangent plane; robust: points far off count little.
    fn add_point(&self, i: usize, sum: &mut SpanSum<2>) {
        let (place, sigma_m) = (self.places[i], self.priors.point_sigma_m);
        let (weights, at, slopes) = self.sheet.near(place);
        let off = self.points[i] - at;
        let normal = slopes.column(0).cross(&slopes.column(1));
        let Some(normal) = normal.try_normalize(1e-6) else { return };
        let bound_m = (self.priors.sheet.bound_sigmas * sigma_m).max(self.priors.sheet.bound_m);
        let far = off.norm_squared() / (bound_m * bound_m);
        let weight = self.counts[i] / (sigma_m * (1.0 + far)).powi(2);
        let row = weights.value.map(|value| normal * value);
        sum.add(&row, &Row::zeros(), normal.dot(&off), weight);
    }

    /// The strain at four places of a span.
    fn add_strain(&self, span: [usize; 2], sum: &mut SpanSum<2>) {
        let (grid, a) = (self.sheet.grid, self.stretch_per_m);
        let weight = 0.25 / self.priors.tuning.strain_sigma.powi(2);
        for quarter in [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]] {
            let at = [0, 1].map(|c| (span[c] as f64 + quarter[c]) * grid.spacing() - grid.half());
            let (w, _, slopes) = self.sheet.near(at);
            let (xu, xv): (Vector3<f64>, Vector3<f64>) =
                (slopes.column(0).into(), slopes.column(1).into());
            let unit = self.hanging(at);
            let rows = [
                (w.du.map(|d| xu * d), 0.5 * (xu.dot(&xu) - 1.0), 1.0),
                (w.dv.map(|d| xv * d), 0.5 * (xv.dot(&xv) - 1.0), 1.0),
                (std::array::from_fn(|k| xu * w.dv[k] + xv * w.du[k]), xu.dot(&xv), 0.5),
            ];
            for ((row, strain, share), unit) in rows.into_iter().zip(unit) {
                sum.add(&row, &Row::new(-unit, 0.0), a * unit - strain, share * weight);
            }
        }
    }

    /// Strain (uu, vv, 2 uv) of the hanging cloth for a = 1 / m: radial, by the weight
    /// below on each bearing; even on the plate.
    fn hanging(&self, at: [f64; 2]) -> [f64; 3] {
        let tuning = self.priors.tuning;
        let r = at[0].hypot(at[1]);
        if r < self.priors.plate_radius_m {
            return [tuning.on_plate_m, tuning.on_plate_m, 0.0];
        }
        let (c, s) = (at[0] / r, at[1] / r);
        let end = self.priors.half_m / c.abs().max(s.abs());
        let below = ((end * end - r * r) / (2.0 * r)).max(0.0);
        [below * c * c, below * s * s, tuning.shear * below * c * s]
    }

    fn add_bending(&mut self, grid: Grid) {
        let spread = self.priors.sheet.curvature_sigma_per_m * grid.spacing().powi(2);
        let weight = 1.0 / (spread * spread);
        let (n, now) = (grid.side(), &self.sheet.controls);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            if i + 2 < n {
                let along = [(i, j, 1.0), (i + 1, j, -2.0), (i + 2, j, 1.0)];
                self.system.add_stencil(&along, now, weight);
            }
            if j + 2 < n {
                let along = [(i, j, 1.0), (i, j + 1, -2.0), (i, j + 2, 1.0)];
                self.system.add_stencil(&along, now, weight);
            }
            if i + 1 < n && j + 1 < n {
                let twist = [(i, j, 1.0), (i, j + 1, -1.0), (i + 1, j, -1.0), (i + 1, j + 1, 1.0)];
                self.system.add_stencil(&twist, now, 2.0 * weight);
            }
        }
    }

    /// The free edge lies where the sheet ends, up to the sensor's shift.
    fn add_anchor(&self, anchor: &Anchor, sum: &mut SpanSum<2>) {
        let slopes = self.sheet.slopes(anchor.end);
        let outward: Vector3<f64> =
            slopes.column(0) * anchor.outward[0] + slopes.column(1) * anchor.outward[1];
        let Some(outward) = outward.try_normalize(1e-6) else { return };
        let row = self.sheet.grid.weights(anchor.end).value.map(|value| outward * value);
        let residual = outward.dot(&(anchor.at - self.sheet.at(anchor.end))) - self.shift_m;
        sum.add(&row, &Row::new(0.0, 1.0), residual, anchor.sigma_m.powi(-2));
    }

    /// The observed strips of the free edge, where the sheet puts them now.
    fn anchors(&self, edges: &[Edge; SIDES]) -> Vec<Anchor> {
        let half_m = self.priors.half_m;
        let strips = |side: usize| {
            let edge = &edges[side];
            let seen = move |k: &usize| edge.observed[*k] && edge.along[*k].abs() <= half_m;
            (0..edge.along.len()).filter(seen).map(move |k| Anchor {
                end: from_side(side, [edge.along[k], half_m]),
                outward: from_side(side, [0.0, 1.0]),
                at: self.sheet.at(from_side(side, [edge.along[k], edge.outward[k]])),
                sigma_m: edge.sigma[k].hypot(self.priors.tuning.edge_sigma_m),
            })
        };
        (0..SIDES).flat_map(strips).collect()
    }
}

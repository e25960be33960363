//! The least squares around the drapes of one fabric: sums over the places of all scans, the
//! bench's numbers at their best, and the step that is predicted to help.
//!
//! Unknown are the logarithms of the six stiffnesses, which all scans share, and the numbers
//! of each scan's bench. A place that lies more than a few standard deviations off pulls no harder
//! than one at that distance (Huber 1964); nor does the prior of a stiffness.

use nalgebra::{DMatrix, DVector};

use super::damping::damped_step;
use super::data::{DataOptions, Datum};
use super::prediction::{BENCH, NUISANCES, Prediction};
use super::prior::Prior;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::sim::SimOptions;
use crate::sim::experiment::bending_length_m;

/// How a fit is made.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FitOptions {
    /// How sure scans and model are.
    pub data: DataOptions,
    /// Most drapes of a scan from one start, and where a fit begins again.
    pub evaluations: [usize; 2],
    /// Most factorisations in which a sheet that is continued to another fabric may come to rest: a
    /// step that needs more is shortened.
    pub step_factorisations: usize,
    /// The same of a sheet that is laid on the last cells.
    pub last_factorisations: usize,
    /// Vertices on a side of the cells of the first steps, and of the last; as many as the first
    /// have: no last steps.
    pub vertices: [usize; 2],
    /// Vertices of the last cells of cloth whose bending length is `stiff_m` and more; as many as
    /// `vertices` has or fewer.
    pub stiff_vertices: usize,
    /// Bending length from which on coarser last cells do \[m\].
    pub stiff_m: f64,
    /// Standard deviation by which drapes on the first cells lie off \[m\].
    pub first_model_m: f64,
    /// Largest change of a logarithm in one step.
    pub longest_step: f64,
    /// Standard deviations of the bench's numbers: offset x and z \[m\], rotation \[rad\], tilt
    /// towards x and z \[rad\], height of the plate's face \[m\], place of its axis x and z \[m\].
    pub bench_sigma: [f64; BENCH],
    /// Distance, in its standard deviations, from which on the prior of a stiffness or of a bench's
    /// number pulls no harder.
    pub prior_outlier: f64,
    /// Misfit from which on a fit begins again at stiffer stretch and shear.
    pub largest_misfit: f64,
    /// How far cloth lies beyond the drape on the last cells, in parts of what an error that falls
    /// with the square of the cell predicts from the moves between the first cells and the last:
    /// mean and standard deviation of the prior.
    pub cells: [f64; 2],
    /// How far the weight of a piece of cloth stretches the springs that hold it to the scanned
    /// sheet \[m\].
    pub hold_sag_m: f64,
    /// The same of the springs on the rim of a scan that has no sheet; they are few.
    pub rim_hold_sag_m: f64,
    /// Whether the sheet is released in the end ([`ScanFit::released`](super::ScanFit::released)).
    /// Nothing else depends on it.
    pub release: bool,
    /// The simulator's options but for the experiment, which each scan has.
    pub sim: SimOptions,
}

/// Factorisations in which the sheet of one evaluation has to come to rest: fewer than a drape's,
/// since a fit tries fabrics that are not the scan's, and one that finds no rest soon is no better
/// than one that finds none.
const EVALUATION: usize = 200;

impl Default for FitOptions {
    /// Numbers and where they are from: `docs/design/refinement.md`.
    fn default() -> Self {
        Self {
            data: DataOptions::default(),
            evaluations: [16, 12],
            step_factorisations: 40,
            last_factorisations: 100,
            vertices: [61, 111],
            stiff_vertices: 91,
            stiff_m: 12e-3,
            first_model_m: 1.5e-3,
            longest_step: 0.7,
            bench_sigma: [0.5e-3, 0.5e-3, 5e-3, 3e-3, 3e-3, 0.3e-3, 0.5e-3, 0.5e-3],
            prior_outlier: 2.0,
            largest_misfit: 0.6,
            cells: [0.62, 0.5],
            hold_sag_m: 30e-3,
            rim_hold_sag_m: 1e-3,
            release: false,
            sim: SimOptions { iterations: EVALUATION, ..SimOptions::default() },
        }
    }
}

impl FitOptions {
    /// Vertices of the last cells of a fabric.
    pub(super) fn last_vertices(&self, fabric: &Fabric) -> usize {
        let [first, last] = self.vertices;
        let stiff = bending_length_m(fabric) >= self.stiff_m;
        if stiff { last.min(self.stiff_vertices).max(first) } else { last }
    }

    /// Prior of how far cloth lies beyond cells of so many vertices a side, in moves from the first
    /// cells to these: mean and standard deviation.
    pub(super) fn prior_of_cells(&self, vertices: usize) -> [f64; 2] {
        let finer = (vertices - 1) as f64 / (self.vertices[0] - 1) as f64;
        let second_order = 1.0 / (finer * finer - 1.0);
        self.cells.map(|part| part * second_order)
    }
}

/// What the least squares are over: the scans' data, one list per scan, and the priors.
pub(super) struct NormalEquations<'a> {
    /// What each scan says, as sure as the drapes on the present cells are.
    pub data: Vec<Vec<Datum>>,
    /// Prior of how far cloth lies beyond the present cells ([`FitOptions::prior_of_cells`]).
    pub cells: [f64; 2],
    /// What of each scan's numbers its drapes are made with beyond its experiment: tilt and place
    /// of the plate, 0 for the others.
    pub made_with: Vec<[f64; NUISANCES]>,
    pub density_kg_m2: f64,
    pub prior: &'a Prior,
    pub options: &'a FitOptions,
}

/// A fabric with its drapes, and the least squares around it.
pub(super) struct State {
    pub(super) ln: [f64; STIFFNESSES],
    pub(super) predictions: Vec<Prediction>,
    /// The bench's numbers, scan by scan, beyond those that the drapes are made with,
    pub(super) bench: Vec<[f64; NUISANCES]>,
    /// and these.
    pub(super) made_with: Vec<[f64; NUISANCES]>,
    /// Sum of the squared distances in standard deviations, with robust (Huber) weights, and of the
    /// priors'.
    pub(super) cost: f64,
    /// The data's part of it, and the number of independent coordinates.
    pub(super) data_cost: f64,
    pub(super) independent: f64,
    /// Normal matrix of the data alone and of the priors (diagonal), and right-hand side of both.
    pub(super) normal: DMatrix<f64>,
    pub(super) priors: DVector<f64>,
    pub(super) right: DVector<f64>,
}

impl State {
    /// All of the bench's numbers, scan by scan.
    pub(super) fn whole_bench(&self) -> Vec<[f64; NUISANCES]> {
        let sum = |(beyond, made): (&[f64; NUISANCES], &[f64; NUISANCES])| {
            std::array::from_fn(|m| beyond[m] + made[m])
        };
        self.bench.iter().zip(&self.made_with).map(sum).collect()
    }

    /// Root mean square distance of an independent coordinate in standard deviations.
    pub(super) fn misfit(&self) -> f64 {
        (self.data_cost / self.independent).sqrt()
    }
}

impl NormalEquations<'_> {
    /// The fabric of six logarithms, made one that can be.
    pub(super) fn fabric(&self, ln: &[f64; STIFFNESSES]) -> Fabric {
        Fabric::from_ln_stiffnesses(ln, self.density_kg_m2)
    }

    /// The least squares around some drapes, the bench's numbers at their best.
    pub(super) fn around(
        &self,
        ln: [f64; STIFFNESSES],
        predictions: Vec<Prediction>,
        mut bench: Vec<[f64; NUISANCES]>,
    ) -> State {
        for _ in 0..BENCH_ROUNDS {
            for (k, data) in self.data.iter().enumerate() {
                bench[k] = self.bench_of(k, data, &predictions[k], &bench[k]);
            }
        }
        let size = STIFFNESSES + NUISANCES * self.data.len();
        let mut normal = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        let (mut data_cost, mut independent) = (0.0, 0.0);
        for (k, (data, prediction)) in self.data.iter().zip(&predictions).enumerate() {
            let column = |c: usize| if c < STIFFNESSES { c } else { c + NUISANCES * k };
            let sums = Sums::of(data, prediction, &bench[k], self.options.data.outlier);
            for a in 0..COLUMNS {
                right[column(a)] += sums.right[a];
                for b in 0..COLUMNS {
                    normal[(column(a), column(b))] += sums.normal[(a, b)];
                }
            }
            data_cost += sums.cost;
            independent += sums.independent;
        }
        let mut priors = DVector::zeros(size);
        let mut cost = data_cost;
        for k in 0..STIFFNESSES {
            let off = (self.prior.ln_mean[k] - ln[k]) / self.prior.ln_sigma[k];
            let huber_weight = huber_weight(off.abs(), self.options.prior_outlier);
            priors[k] = huber_weight * self.prior.ln_sigma[k].powi(-2);
            right[k] += huber_weight * off / self.prior.ln_sigma[k];
            cost += off * off * huber_weight * (2.0 - huber_weight);
        }
        for (k, numbers) in bench.iter().enumerate() {
            for (m, (value, [mean, sigma])) in numbers.iter().zip(self.bench_prior(k)).enumerate() {
                let at = STIFFNESSES + NUISANCES * k + m;
                let off = (mean - value) / sigma;
                let huber_weight = huber_weight(off.abs(), self.options.prior_outlier);
                priors[at] = huber_weight * sigma.powi(-2);
                right[at] += huber_weight * off / sigma;
                cost += off * off * huber_weight * (2.0 - huber_weight);
            }
        }
        State {
            ln,
            predictions,
            bench,
            made_with: self.made_with.clone(),
            cost,
            data_cost,
            independent,
            normal,
            priors,
            right,
        }
    }

    /// Mean and standard deviation of the prior of a scan's numbers.
    pub(super) fn bench_prior(&self, scan: usize) -> [[f64; 2]; NUISANCES] {
        let (sigmas, made_with) = (&self.options.bench_sigma, &self.made_with[scan]);
        std::array::from_fn(|m| match sigmas.get(m) {
            Some(sigma) => [-made_with[m], *sigma],
            None => self.cells,
        })
    }

    /// The bench's numbers that fit one drape best.
    fn bench_of(
        &self,
        scan: usize,
        data: &[Datum],
        prediction: &Prediction,
        from: &[f64; NUISANCES],
    ) -> [f64; NUISANCES] {
        let sums = Sums::of(data, prediction, from, self.options.data.outlier);
        let mut matrix =
            sums.normal.fixed_view::<NUISANCES, NUISANCES>(STIFFNESSES, STIFFNESSES).into_owned();
        let mut right = sums.right.fixed_rows::<NUISANCES>(STIFFNESSES).into_owned();
        for (m, [mean, sigma]) in self.bench_prior(scan).into_iter().enumerate() {
            let off = (mean - from[m]) / sigma;
            let huber_weight = huber_weight(off.abs(), self.options.prior_outlier);
            matrix[(m, m)] += huber_weight * sigma.powi(-2);
            right[m] += huber_weight * off / sigma;
        }
        let change = matrix.cholesky().map(|factor| factor.solve(&right)).unwrap_or_default();
        std::array::from_fn(|m| from[m] + change[m])
    }

    /// Where a damped step leads, and by how much the cost is predicted to fall.
    pub(super) fn step(&self, at: &State, damping: f64) -> Option<([f64; STIFFNESSES], f64)> {
        let whole = &at.normal + DMatrix::from_diagonal(&at.priors);
        let longest = self.options.longest_step;
        let limits = &self.prior.ln_limits;
        let (next, predicted) = damped_step((&whole, &at.right), &at.ln, limits, damping, longest)?;
        Some((std::array::from_fn(|k| next[k]), predicted))
    }
}

/// Weight of what lies so many standard deviations off: from `outlier` on it pulls no harder (Huber
/// 1964).
fn huber_weight(far: f64, outlier: f64) -> f64 {
    if far > outlier { outlier / far } else { 1.0 }
}

/// Columns of one scan: stiffnesses and bench.
const COLUMNS: usize = STIFFNESSES + NUISANCES;

/// The sums of the least squares over one scan's places.
struct Sums {
    normal: nalgebra::SMatrix<f64, COLUMNS, COLUMNS>,
    right: nalgebra::SVector<f64, COLUMNS>,
    cost: f64,
    independent: f64,
}

impl Sums {
    fn of(data: &[Datum], prediction: &Prediction, bench: &[f64; NUISANCES], outlier: f64) -> Self {
        let mut sums = Self {
            normal: nalgebra::SMatrix::zeros(),
            right: nalgebra::SVector::zeros(),
            cost: 0.0,
            independent: 0.0,
        };
        for datum in data {
            let place = datum.place;
            let mut off = datum.position_m - prediction.at[place];
            for (value, moves) in bench.iter().zip(&prediction.moves[STIFFNESSES..]) {
                off -= moves[place] * *value;
            }
            let pull = datum.information * off;
            // per coordinate, so that a place of three coordinates is as far as one of one
            let far = (off.dot(&pull) / 3.0).sqrt();
            let huber_weight = huber_weight(far, outlier);
            let weight = datum.counts * huber_weight;
            sums.cost += 3.0 * datum.counts * far * far * huber_weight * (2.0 - huber_weight);
            sums.independent += 3.0 * datum.counts;
            let columns: [_; COLUMNS] = std::array::from_fn(|c| prediction.moves[c][place]);
            for a in 0..COLUMNS {
                let weighted = datum.information * columns[a] * weight;
                sums.right[a] += weighted.dot(&off);
                for b in 0..=a {
                    sums.normal[(a, b)] += weighted.dot(&columns[b]);
                }
            }
        }
        sums.normal.fill_upper_triangle_with_lower_triangle();
        sums
    }
}

/// Rounds in which the bench's numbers and the weights of outliers follow each other.
const BENCH_ROUNDS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn less_is_expected_beyond_finer_cells() {
        let options = FitOptions::default();
        // an error of 4 on the first cells is one of 1 on cells half as wide: a third of the way
        // between them
        let halved = FitOptions { cells: [1.0, 0.5], ..options };
        let [mean, sigma] = halved.prior_of_cells(121);
        assert!((mean - 1.0 / 3.0).abs() < 1e-12 && (sigma - 0.5 / 3.0).abs() < 1e-12);
        assert!(options.prior_of_cells(111)[0] < 0.6 * options.prior_of_cells(91)[0]);
    }
}

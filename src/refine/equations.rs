//! The least squares around the drapes of one fabric: sums over the places of all scans, the
//! bench's numbers at their best, and the step that is predicted to help.
//!
//! Unknown are the logarithms of the six stiffnesses, which all scans share, and the numbers
//! of each scan's bench. A place that lies more than a few standard deviations off pulls no harder
//! than one at that distance (Huber 1964); nor does the prior of a stiffness.

use nalgebra::{DMatrix, DVector};

use super::data::{DataOptions, Datum};
use super::prediction::{BENCH, NUISANCES, Prediction};
use super::prior::Prior;
use crate::fabric::{Fabric, STIFFNESSES};
use crate::inverse::{
    self, Part, Pull, SharedPrior, Step, Sums, at_best, huber_cost, huber_weight, scanned,
};
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
            evaluations: [20, 12],
            step_factorisations: 40,
            last_factorisations: 100,
            vertices: [61, 111],
            stiff_vertices: 91,
            stiff_m: 12e-3,
            first_model_m: 1.5e-3,
            longest_step: 0.7,
            bench_sigma: [
                scanned::OFFSET_M,
                scanned::OFFSET_M,
                scanned::ROTATION_RAD,
                scanned::TILT_RAD,
                scanned::TILT_RAD,
                scanned::HEIGHT_M,
                scanned::OFFSET_M,
                scanned::OFFSET_M,
            ],
            prior_outlier: 2.0,
            largest_misfit: 0.6,
            cells: scanned::CELLS,
            hold_sag_m: scanned::HOLD_SAG_M,
            rim_hold_sag_m: scanned::RIM_HOLD_SAG_M,
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
        let times = (vertices - 1) as f64 / (self.vertices[0] - 1) as f64;
        scanned::beyond_cells(self.cells, times)
    }
}

/// What the least squares are over: the scans' data, one list per scan, and the priors.
pub(super) struct Problem<'a> {
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

/// What is kept of a scan's drape.
pub(super) struct Draped {
    pub prediction: Prediction,
    /// The bench's numbers beyond those that the drape is made with,
    pub bench: [f64; NUISANCES],
    /// and these.
    pub made_with: [f64; NUISANCES],
}

impl Draped {
    /// All of the bench's numbers.
    pub(super) fn whole_bench(&self) -> [f64; NUISANCES] {
        std::array::from_fn(|m| self.bench[m] + self.made_with[m])
    }
}

/// A fabric with its drapes, and the least squares around it.
pub(super) type State = inverse::State<Draped>;

impl Problem<'_> {
    /// The fabric of six logarithms, made one that can be.
    pub(super) fn fabric(&self, ln: &[f64]) -> Fabric {
        let six = std::array::from_fn(|k| ln[k]);
        Fabric::from_ln_stiffnesses(&six, self.density_kg_m2)
    }

    /// The least squares around some drapes, the bench's numbers at their best from `bench` on.
    pub(super) fn around(
        &self,
        ln: [f64; STIFFNESSES],
        predictions: Vec<Prediction>,
        bench: &[[f64; NUISANCES]],
    ) -> State {
        let drapes = predictions.into_iter().zip(bench).enumerate();
        let (drapes, parts) = drapes
            .map(|(scan, (prediction, from))| {
                let part = |bench: &[f64; NUISANCES]| self.part(scan, &prediction, bench);
                let bench = at_best(*from, BENCH_ROUNDS, 0.0, part);
                let (part, made_with) = (part(&bench), self.made_with[scan]);
                (Draped { prediction, bench, made_with }, part)
            })
            .unzip();
        let Prior { ln_mean, ln_sigma, .. } = self.prior;
        let pull = |k| Pull::robust(ln[k], [ln_mean[k], ln_sigma[k]], self.options.prior_outlier);
        let pulls: [Pull; STIFFNESSES] = std::array::from_fn(pull);
        State::around(ln.to_vec(), &SharedPrior::of_each(&pulls), drapes, parts)
    }

    /// Mean and standard deviation of the prior of a scan's numbers.
    pub(super) fn bench_prior(&self, scan: usize) -> [[f64; 2]; NUISANCES] {
        let (sigmas, made_with) = (&self.options.bench_sigma, &self.made_with[scan]);
        std::array::from_fn(|m| match sigmas.get(m) {
            Some(sigma) => [-made_with[m], *sigma],
            None => self.cells,
        })
    }

    /// What a scan's drape adds.
    fn part(&self, scan: usize, prediction: &Prediction, bench: &[f64; NUISANCES]) -> Part {
        let pulls = bench.iter().zip(self.bench_prior(scan));
        let pull =
            |(value, prior): (&f64, _)| Pull::robust(*value, prior, self.options.prior_outlier);
        let own = pulls.map(pull).collect();
        let sums = sums(&self.data[scan], prediction, bench, self.options.data.outlier);
        Part { sums, own }
    }

    /// A damped step.
    pub(super) fn step(&self, at: &State, damping: f64) -> Option<Step> {
        at.step(&self.prior.ln_limits, self.options.longest_step, damping)
    }
}

/// Columns of one scan: stiffnesses and bench.
const COLUMNS: usize = STIFFNESSES + NUISANCES;

/// The sums of the least squares over one scan's places.
fn sums(data: &[Datum], prediction: &Prediction, bench: &[f64; NUISANCES], outlier: f64) -> Sums {
    let mut normal = nalgebra::SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
    let mut right = nalgebra::SVector::<f64, COLUMNS>::zeros();
    let (mut cost, mut independent) = (0.0, 0.0);
    for datum in data {
        let place = datum.place;
        let mut off = datum.position_m - prediction.at[place];
        for (value, moves) in bench.iter().zip(&prediction.moves[STIFFNESSES..]) {
            off -= moves[place] * *value;
        }
        let pull = datum.information * off;
        // per coordinate, so that a place of three coordinates is as far as one of one
        let far = (off.dot(&pull) / 3.0).sqrt();
        let weight = huber_weight(far, outlier);
        cost += huber_cost(3.0 * datum.counts, far, weight);
        independent += 3.0 * datum.counts;
        let weight = datum.counts * weight;
        let columns: [_; COLUMNS] = std::array::from_fn(|c| prediction.moves[c][place]);
        for a in 0..COLUMNS {
            let weighted = datum.information * columns[a] * weight;
            right[a] += weighted.dot(&off);
            for b in 0..=a {
                normal[(a, b)] += weighted.dot(&columns[b]);
            }
        }
    }
    normal.fill_upper_triangle_with_lower_triangle();
    let normal = DMatrix::from_column_slice(COLUMNS, COLUMNS, normal.as_slice());
    Sums { normal, right: DVector::from_column_slice(right.as_slice()), cost, independent }
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

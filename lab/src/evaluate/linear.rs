//! Linear regression from rim to stiffnesses, the baseline of the paper and of `scripts/train.py`.
//!
//! In: drapes with known fabrics. Out: logarithms of stiffness as a linear function of the 732
//! coordinates and the density, by least squares with a ridge that the doubled corners need (1e-3
//! on inputs scaled to [0, 1]), on all eight symmetric views, as `linear_regression` of
//! `scripts/train.py` has it.
//!
//! Where it fails: with fewer drapes than coordinates it follows each of them. Its error falls
//! slowly with their number, so that no figure of it is worth reading without that number
//! ([`Linear::rows`]).

use nalgebra::{DMatrix, DVector};

use scan2params::base::Boundary;
use scan2params::base::boundary::POINTS;
use scan2params::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use scan2params::dataset::Row;
use scan2params::estimate::{SWAPPED, View, views};
use scan2params::fabric::{Fabric, Mixture, STIFFNESSES};

/// Ridge on scaled inputs, and the least range that an input is scaled by \[mm, g/m^2\]: those of
/// `scripts/train.py`.
const RIDGE: f64 = 1e-3;
const LEAST_RANGE: f64 = 5.0;

/// A fitted linear regression.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Drapes that it was fitted to.
    pub rows: usize,
    centre: DVector<f64>,
    scale: DVector<f64>,
    /// One column a stiffness; the last row is the constant.
    weights: DMatrix<f64>,
    limits: [[f64; STIFFNESSES]; 2],
}

/// The regression has no solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no linear regression on {rows} drapes: give a folder of `generate` with drapes at rest")]
pub struct NoRegression {
    /// How many drapes there are.
    pub rows: usize,
}

impl Linear {
    /// Of drapes at rest; answers are cut to the box of `prior`.
    ///
    /// # Errors
    /// When there are no drapes.
    pub fn fit(rows: &[Row], prior: &Mixture) -> Result<Self, NoRegression> {
        let fault = NoRegression { rows: rows.len() };
        let of_row = |row: &Row| -> Vec<(DVector<f64>, [f64; STIFFNESSES])> {
            let values = row.fabric.to_paper_units().map(f64::ln);
            let density_kg_m2 = row.fabric.density_kg_m2;
            let view = |view: &View| {
                let target = |i: usize| values[if view.swapped { SWAPPED[i] } else { i }];
                (inputs(&view.boundary, density_kg_m2), std::array::from_fn(target))
            };
            views(&row.drape.boundary).iter().map(view).collect()
        };
        let all: Vec<(DVector<f64>, [f64; STIFFNESSES])> = rows.iter().flat_map(of_row).collect();
        let Some((first, _)) = all.first() else { return Err(fault) };
        let (mut least, mut most) = (first.clone(), first.clone());
        let mut centre = DVector::zeros(first.len());
        for (input, _) in &all {
            (least, most) = (least.inf(input), most.sup(input));
            centre += input / all.len() as f64;
        }
        let scale = (most - least).map(|range| 1.0 / range.max(LEAST_RANGE));
        let x = DMatrix::from_fn(first.len() + 1, all.len(), |i, row| {
            if i == first.len() { 1.0 } else { (all[row].0[i] - centre[i]) * scale[i] }
        });
        let y = DMatrix::from_fn(all.len(), STIFFNESSES, |row, i| all[row].1[i]);
        let ridge = DMatrix::identity(x.nrows(), x.nrows()) * RIDGE;
        let normal = (&x * x.transpose() + ridge).cholesky().ok_or(fault)?;
        let [low, high] = prior.limits();
        // weft and warp share their ends, as they share everything else here
        let limits = [
            std::array::from_fn(|i| low[i].min(low[SWAPPED[i]])),
            std::array::from_fn(|i| high[i].max(high[SWAPPED[i]])),
        ];
        Ok(Self { rows: rows.len(), centre, scale, weights: normal.solve(&(x * y)), limits })
    }

    /// The fabric that it says, made one that can be.
    #[must_use]
    pub fn fabric(&self, rim: &Boundary, density_kg_m2: f64) -> Fabric {
        let input = (inputs(rim, density_kg_m2) - &self.centre).component_mul(&self.scale);
        let constant = self.weights.nrows() - 1;
        let value = |i: usize| {
            let ln =
                self.weights.column(i).rows(0, constant).dot(&input) + self.weights[(constant, i)];
            ln.exp().clamp(self.limits[0][i], self.limits[1][i])
        };
        let [a, b, c, d, e, f] = std::array::from_fn(value);
        let fabric = Fabric::from_paper_units([a, b, c, d, e, f, 1.0]);
        Fabric { density_kg_m2, ..fabric }.project_bending().0
    }
}

/// 732 coordinates \[mm\] and the density \[g/m^2\].
fn inputs(rim: &Boundary, density_kg_m2: f64) -> DVector<f64> {
    let coordinates = rim.positions_m().flat_map(|p| [p.x, p.y, p.z].map(|m| m / M_PER_MM));
    let all = coordinates.chain([density_kg_m2 / KG_M2_PER_G_M2]);
    DVector::from_iterator(3 * POINTS + 1, all)
}

//! What a model with linear bending is off by on fabrics whose bending softens, for `evaluate physics`.
//!
//! In: a folder with measured bending laws M = L k + NL k^2. Out: for each fabric how far the rim of the paper's drape moves, on one branch, when
//! the measured softening is added to its linear law, what of that is left with the three linear stiffnesses fitted to the softened rim, and how much
//! softer these then are.
//!
//! Every sheet is led ([`Follower`]) and not dropped anew: two drops of one fabric lie farther apart than either of these.

use std::path::Path;

use nalgebra::{Matrix3, Vector3 as Three};
use rayon::prelude::*;

use super::drapes::{Measured, bending_618, mean_length_m, options};
use super::{DataError, Table};
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Vector3};
use crate::fabric::Fabric;
use crate::numeric::robust::quantile;
use crate::sim::sensitivity::Parameter;
use crate::sim::{Drop, Experiment, FollowOptions, Follower, Setup, Stop};

/// A measured fabric with and without the softening of its bending.
struct Cost {
    length_m: f64,
    /// Root mean square distance of the rims, and what is left of it with the three stiffnesses fitted \[m\].
    moved_m: f64,
    left_m: f64,
    /// Change of the logarithm of bending (mean of the three) that is fitted.
    softer: f64,
    /// Whether a sheet left its branch on the way.
    left_branch: bool,
}

/// The stiffnesses that are fitted.
const FITTED: [Parameter; 3] =
    [Parameter::BendingWeft, Parameter::BendingWarp, Parameter::BendingBias];
/// Where they begin among a fabric's seven numbers.
const BENDING: usize = 3;
/// Steps of the fit.
const STEPS: usize = 3;
/// Standard deviation of the logarithm of a fitted stiffness before the rim is seen, and of a point of the rim \[m\].
const EXPECTED: f64 = 0.5;
const KNOWN_M: f64 = 0.1e-3;

/// `count` measured fabrics, evenly over the rank of their bending length, in four groups of equal size.
///
/// # Errors
/// When the file of the folder cannot be read.
pub fn linear_bending(data: &Path, count: usize) -> Result<Table, DataError> {
    let fabrics = bending_618(data, count)?;
    let all: Vec<Option<Cost>> = fabrics.par_iter().map(cost).collect();
    let unanswered = all.iter().filter(|cost| cost.is_none()).count();
    let costs: Vec<Cost> = all.into_iter().flatten().collect();
    let quarters = costs.chunks(costs.len().div_ceil(4).max(1));
    let mut rows: Vec<Vec<String>> = quarters.map(row).collect();
    rows.push(row(&costs));
    Ok(Table {
        title: format!(
            "linear bending in place of the measured softening, the paper's drape, one branch: {} fabrics, {unanswered} without a rest; root mean square of the rim",
            costs.len()
        ),
        columns: vec![
            "bending_length_mm",
            "fabrics",
            "left_the_branch",
            "moved_median_mm, moved_q90_mm",
            "left_median_mm, left_q90_mm",
            "bending_median_percent, bending_q10_percent",
        ],
        rows,
    })
}

fn row(costs: &[Cost]) -> Vec<String> {
    let on_branch: Vec<&Cost> = costs.iter().filter(|cost| !cost.left_branch).collect();
    let of = |value: &dyn Fn(&Cost) -> f64, share: f64| {
        quantile(on_branch.iter().map(|cost| value(cost)).collect(), share).unwrap_or(f64::NAN)
    };
    let mm = |value: &dyn Fn(&Cost) -> f64| {
        format!("{:.2}, {:.2}", of(value, 0.5) / M_PER_MM, of(value, 0.9) / M_PER_MM)
    };
    let lengths = costs.iter().map(|cost| cost.length_m / M_PER_MM);
    let least = lengths.clone().fold(f64::INFINITY, f64::min);
    let percent = |share: f64| 100.0 * of(&|cost| cost.softer, share).exp_m1();
    vec![
        format!("{least:.1} to {:.1}", lengths.fold(0.0, f64::max)),
        costs.len().to_string(),
        (costs.len() - on_branch.len()).to_string(),
        mm(&|cost| cost.moved_m),
        mm(&|cost| cost.left_m),
        format!("{:.0}, {:.0}", percent(0.5), percent(0.1)),
    ]
}

/// `None` where a sheet does not come to rest.
fn cost(measured: &Measured) -> Option<Cost> {
    let plain = Experiment::default();
    let softened = Experiment { softening: measured.softening, ..plain };
    let mut sheet = Follower::drop(&measured.fabric, &Drop::canonical(), &options(plain));
    let (start, linear) = (sheet.keep(), sheet.boundary());
    let mut left_branch = false;
    let mut led = |sheet: &mut Follower, fabric: Fabric, experiment: Experiment| {
        let way = sheet.follow(&Setup { fabric, experiment }, &FollowOptions::default()).ok()?;
        left_branch |= !way.events.is_empty();
        (way.stop == Stop::AtRest).then(|| sheet.boundary())
    };
    let soft = led(&mut sheet, measured.fabric, softened)?;
    let moved_m = distance_m(&linear, &soft);
    sheet.return_to(&start);
    let (mut ln, mut best) = (Three::zeros(), (moved_m, 0.0));
    let mut rim = linear;
    for _ in 0..STEPS {
        ln += step(&mut sheet, &rim, &soft, &ln)?;
        rim = led(&mut sheet, softer(&measured.fabric, &ln), plain)?;
        let left_m = distance_m(&rim, &soft);
        if left_m < best.0 {
            best = (left_m, ln.mean());
        }
    }
    let length_m = mean_length_m(&measured.fabric);
    Some(Cost { length_m, moved_m, left_m: best.0, softer: best.1, left_branch })
}

/// The step of the three logarithms that brings a sheet's rim nearest to another one, linearly.
fn step(
    sheet: &mut Follower,
    rim: &Boundary,
    to: &Boundary,
    ln: &Three<f64>,
) -> Option<Three<f64>> {
    let sensitivities = sheet.sensitivities(&FITTED).ok()?;
    let values = sheet.setup().fabric.in_si();
    let grid = sheet.drape().grid;
    let both = sensitivities.iter().zip(&values[BENDING..]);
    let columns: Vec<Vec<Vector3>> =
        both.map(|(s, v)| s.rim_moves(&grid).iter().map(|move_| move_ * *v).collect()).collect();
    let off: Vec<Vector3> = to.positions_m().zip(rim.positions_m()).map(|(a, b)| a - b).collect();
    let dot = |a: &[Vector3], b: &[Vector3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let (point, prior) = (KNOWN_M.powi(-2), EXPECTED.powi(-2));
    let normal = Matrix3::from_fn(|i, j| {
        point * dot(&columns[i], &columns[j]) + if i == j { prior } else { 0.0 }
    });
    let right = Three::from_fn(|i, _| point * dot(&columns[i], &off) - prior * ln[i]);
    let step = normal.cholesky()?.solve(&right);
    Some(step.map(|change| change.clamp(-EXPECTED, EXPECTED)))
}

/// A fabric with other logarithms of the three bending stiffnesses.
fn softer(fabric: &Fabric, by: &Three<f64>) -> Fabric {
    let [mut ln @ .., _] = fabric.in_si().map(f64::ln);
    (0..3).for_each(|k| ln[BENDING + k] += by[k]);
    Fabric::from_ln_stiffnesses(&ln, fabric.density_kg_m2)
}

/// Root mean square distance of corresponding points \[m\].
fn distance_m(a: &Boundary, b: &Boundary) -> f64 {
    let squared: f64 =
        a.positions_m().zip(b.positions_m()).map(|(a, b)| (a - b).norm_squared()).sum();
    (squared / a.points().len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::experiment::Softening;

    #[test]
    fn fitted_stiffnesses_take_up_most_of_what_softening_does_to_a_rim() {
        let fabric = super::super::drapes::MESH_FABRICS[1].1;
        let softening =
            Softening { weft_m: 2e-3, warp_m: 2e-3, bias_m: 2e-3, ..Softening::default() };
        let measured = |softening| Measured {
            name: "stiff knit".into(),
            fabric: Fabric::from_paper_units(fabric),
            softening,
            drape: None,
        };
        let soft = cost(&measured(softening)).unwrap();
        let said = format!("{:.2e} {:.2e} {:.3}", soft.moved_m, soft.left_m, soft.softer);
        println!("{said}");
        assert!(soft.moved_m > 0.3e-3 && soft.left_m < 0.6 * soft.moved_m, "{said}");
        assert!((-0.5..-0.02).contains(&soft.softer), "{said}");
        let none = cost(&measured(Softening::default())).unwrap();
        assert!(none.moved_m < 1e-5 && none.softer.abs() < 1e-2);
    }
}

//! What a drape costs: processor time by size, where it goes, and what its sensitivities cost.
//!
//! In: timed drapes. Out: rows and sums as text or numbers.

use std::fmt;

use super::timed::{TimedDrape, timed_drape};
use scan2params::base::Vector3;
use scan2params::base::clock::thread_cpu_s;
use scan2params::fabric::MixtureError;
use scan2params::sim::drape::drape_with_sensitivities;
use scan2params::sim::effort::Effort;
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::sensitivity::{Parameter, Sensitivity, SensitivityError};
use scan2params::sim::{Drop, DropStart, SimOptions, Stop};

/// The names of what [`row`] gives.
pub const COLUMNS: &str = "fabric, bending_length_mm, cpu_s, factorisations, nodes, stop, \
     residual_n, intersections";

/// One timed drape as a line of a table.
#[must_use]
pub fn row(index: u64, timed: &TimedDrape) -> String {
    let d = &timed.drape;
    let cpu = timed.cpu_s.map_or("unknown".to_owned(), |s| format!("{s:.2}"));
    format!(
        "{index}, {:.1}, {cpu}, {}, {}, {}, {:.1e}, {}",
        1e3 * bending_length_m(&timed.fabric),
        d.effort.factorisations,
        d.nodes,
        d.stop.name(),
        d.residual_n,
        d.intersections
    )
}

/// What drapes of one size cost.
#[derive(Clone, Debug)]
pub struct Size {
    /// Processor times in rising order \[s\].
    pub cpu_s: Vec<f64>,
    /// Drapes that came to rest.
    pub at_rest: usize,
    /// Work over all of them.
    pub effort: Effort,
}

impl Size {
    /// Of these drapes.
    #[must_use]
    pub fn of(drapes: &[TimedDrape]) -> Self {
        let mut cpu_s: Vec<f64> = drapes.iter().filter_map(|d| d.cpu_s).collect();
        cpu_s.sort_by(f64::total_cmp);
        let mut effort = Effort::default();
        drapes.iter().for_each(|d| effort += d.drape.effort);
        let at_rest = drapes.iter().filter(|d| d.drape.stop == Stop::AtRest).count();
        Self { cpu_s, at_rest, effort }
    }

    /// Processor time below which this share of the drapes stayed \[s\]; NaN of none.
    #[must_use]
    pub fn at(&self, share: f64) -> f64 {
        let last = self.cpu_s.len().saturating_sub(1);
        self.cpu_s.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "cpu_s a drape: least {:.2}, median {:.2}, 95th percentile {:.2}, most {:.2}; {} at \
             rest; of the time",
            self.at(0.0),
            self.at(0.5),
            self.at(0.95),
            self.at(1.0),
            self.at_rest
        )?;
        let parts = self.effort.parts_s();
        let total: f64 = parts.iter().map(|(_, s)| s).sum();
        for (name, s) in parts {
            write!(f, " {name} {:.0} %", 100.0 * s / total)?;
        }
        Ok(())
    }
}

/// The power of the number of vertices with which the median cost grows: least squares over
/// the logarithms. `None` of fewer than two sizes.
#[must_use]
pub fn exponent(sizes: &[(usize, Size)]) -> Option<f64> {
    let points: Vec<[f64; 2]> = sizes
        .iter()
        .map(|(side, size)| [((side * side) as f64).ln(), size.at(0.5).ln()])
        .filter(|p| p[1].is_finite())
        .collect();
    if points.len() < 2 {
        return None;
    }
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let covariance: f64 = points.iter().map(|p| (p[0] - mean[0]) * (p[1] - mean[1])).sum();
    let variance: f64 = points.iter().map(|p| (p[0] - mean[0]).powi(2)).sum();
    (variance > 0.0).then(|| covariance / variance)
}

/// How far a drape's rim moves with each parameter, and what it cost to compute.
#[derive(Clone, Debug)]
pub struct RimSensitivities {
    /// One row a parameter.
    pub rows: Vec<RimSensitivity>,
    /// Processor time of the drape alone \[s\].
    pub drape_cpu_s: f64,
    /// What the sensitivities cost besides \[s\].
    pub cpu_s: f64,
}

/// How far the rim moves with one parameter.
#[derive(Clone, Debug)]
pub struct RimSensitivity {
    /// The parameter's name.
    pub key: String,
    /// Its SI unit.
    pub unit: &'static str,
    /// Mean move of a rim vertex for a change by `part` \[mm\].
    pub rim_mean_mm: f64,
    /// Largest.
    pub rim_largest_mm: f64,
    /// The change: a hundredth of a stiffness, a millimetre, a degree, 1/m ...
    pub part: String,
}

/// Why a drape has no sensitivities.
#[derive(Debug, thiserror::Error)]
pub enum RimSensitivityError {
    /// The fabric could not be drawn.
    #[error(transparent)]
    Fabric(#[from] MixtureError),
    /// The drape has none.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// The system does not tell processor times.
    #[error("this system does not tell a thread's processor time: run it on Linux")]
    NoClock,
}

/// Fabric `index` of the prior, draped once alone and once with all its sensitivities.
///
/// # Errors
/// [`RimSensitivityError`].
pub fn rim_sensitivities(
    seed: u64,
    index: u64,
    options: &SimOptions,
) -> Result<RimSensitivities, RimSensitivityError> {
    let alone = timed_drape(seed, index, options)?;
    let drape_cpu_s = alone.cpu_s.ok_or(RimSensitivityError::NoClock)?;
    let drop = Drop { start: DropStart::Perturbed(seed ^ index) };
    let before = thread_cpu_s().ok_or(RimSensitivityError::NoClock)?;
    let (drape, found) = drape_with_sensitivities(&alone.fabric, &drop, options, &Parameter::ALL)?;
    let both_s = thread_cpu_s().ok_or(RimSensitivityError::NoClock)? - before;
    let border = drape.grid.border();
    let stiffness = alone.fabric.in_si();
    let rows = found.iter().map(|s| rim_sensitivity(s, &border, &stiffness)).collect();
    Ok(RimSensitivities { rows, drape_cpu_s, cpu_s: both_s - drape_cpu_s })
}

fn rim_sensitivity(found: &Sensitivity, border: &[usize], fabric: &[f64; 7]) -> RimSensitivity {
    let (key, unit) = (found.parameter.name(), found.parameter.unit());
    let (change, part) = match (found.parameter.of_fabric(), unit) {
        (Some(k), _) => (0.01 * fabric[k], "1 %".to_owned()),
        (_, "m") => (1e-3, "1 mm".to_owned()),
        (_, "rad") => (1_f64.to_radians(), "1 deg".to_owned()),
        (_, "") => (0.01, "0.01".to_owned()),
        _ => (1.0, format!("1 {unit}")),
    };
    let moves: Vec<f64> =
        border.iter().map(|&v| 1e3 * change * Vector3::norm(&found.moves[v])).collect();
    RimSensitivity {
        key,
        unit,
        rim_mean_mm: moves.iter().sum::<f64>() / moves.len() as f64,
        rim_largest_mm: moves.iter().copied().fold(0.0, f64::max),
        part,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_that_grows_as_a_power_gives_the_power() {
        let sizes = [31_usize, 61, 121].map(|side| {
            let cpu_s = vec![1e-6 * ((side * side) as f64).powf(1.3)];
            (side, Size { cpu_s, at_rest: 1, effort: Effort::default() })
        });
        assert!((exponent(&sizes).unwrap() - 1.3).abs() < 1e-9);
        assert_eq!(exponent(&sizes[..1]), None);
    }
}

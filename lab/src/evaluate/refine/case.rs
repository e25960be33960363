//! A case of a refinement, and how far its answer is from the truth.

use scan2params::base::units::M_PER_MM;
use scan2params::estimate::{Estimate, EstimateError};
use scan2params::fabric::{Fabric, STIFFNESSES};
use scan2params::refine::{FitError, Refined};
use scan2params::scan::ScanError;
use scan2params::sim::Stop;
use scan2params::sim::experiment::bending_length_m;

/// One scan of one drape.
#[derive(Debug)]
pub struct Case {
    /// Name of the prior.
    pub prior: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Its place in the run.
    pub index: u64,
    /// The true fabric.
    pub fabric: Fabric,
    /// What came of it, or why it did not come to a fit.
    pub answer: Result<Answer, NoAnswer>,
}

/// A scan that was refined.
#[derive(Debug)]
pub struct Answer {
    /// What the network said.
    pub estimate: Estimate,
    /// What was found.
    pub refined: Refined,
    /// Mean distance of the scanned rims from the true ones \[m\].
    pub scan_error_m: f64,
    /// Mean distance of the refined fabric's rims from the true ones \[m\].
    pub rim_error_m: f64,
    /// The same of its sheets tied to the scans, which is what was fitted \[m\].
    pub held_rim_error_m: f64,
    /// The same of the true fabric, laid from the scanned sheets on the fit's last cells: what no
    /// fit can be blamed for. NaN where it does not come to rest.
    pub floor_m: f64,
    /// The same of the refined fabric's rims and of those of the floor, each turned about the
    /// plate's axis to where it lies best: a sheet that is released may rotate as a whole \[m\].
    pub turned_m: [f64; 2],
    /// The same as the floor, of the fabric that the network said.
    pub network_rim_error_m: f64,
    /// Mean distance of the true rim from those of the refined fabric and of the network's, each
    /// dropped as the true one was, on its cells, and not guided: the paper's comparison. NaN where
    /// the drop was perturbed, or a drape does not come to rest.
    pub redropped_m: [f64; 2],
    /// Processor time of the fit \[s\]; NaN where the system does not tell it, and for several
    /// drops, which share the machine's cores.
    pub cpu_s: f64,
}

/// Why a scan has no fit.
#[derive(Debug, thiserror::Error)]
pub enum NoAnswer {
    /// The drape on fine cells did not come to rest, or crosses itself in so many pairs of
    /// triangles.
    #[error("the true drape ended as `{}`, with {intersections} crossings", .stop.name())]
    Truth {
        /// Why its search for rest ended.
        stop: Stop,
        /// Crossing pairs of triangles.
        intersections: usize,
    },
    /// The scan was refused.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The network has no answer.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// Nothing was fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl Case {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "prior, fabric, sensor, bending_length_mm, scan_error_mm, rim_error_mm, held_rim_error_mm, network_rim_mm, rim_from_scan_mm, floor_mm, turned_rim_error_mm, turned_floor_mm, redropped_mm, network_redropped_mm, misfit, \
         network_ln_errors, balance_ln_errors, ln_errors, half_widths, shown, ended, drapes, cpu_s, refusal";

    /// The case as a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let length_mm = bending_length_m(&self.fabric) / M_PER_MM;
        let begun = format!("{}, {}, {}, {length_mm:.1}", self.prior, self.index, self.sensor);
        match &self.answer {
            Err(why) => {
                let why = why.to_string().replace(", ", "; ");
                format!("{begun}, , , , , , , , , , , , , , , , , , , , {why}")
            }
            Ok(answer) => {
                let list = |values: [f64; STIFFNESSES]| values.map(|v| format!("{v:.3}")).join(" ");
                let refined = &answer.refined;
                format!(
                    "{begun}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {}, {}, {}, {}, {}, {}, {}, {:.1}, ",
                    answer.scan_error_m / M_PER_MM,
                    answer.rim_error_m / M_PER_MM,
                    answer.held_rim_error_m / M_PER_MM,
                    answer.network_rim_error_m / M_PER_MM,
                    refined.scans[0]
                        .released
                        .as_ref()
                        .map_or(f64::NAN, |r| r.mean_distance_m / M_PER_MM),
                    answer.floor_m / M_PER_MM,
                    answer.turned_m[0] / M_PER_MM,
                    answer.turned_m[1] / M_PER_MM,
                    answer.redropped_m[0] / M_PER_MM,
                    answer.redropped_m[1] / M_PER_MM,
                    refined.misfit,
                    list(answer.network_ln_errors(&self.fabric)),
                    list(answer.balance_ln_errors(&self.fabric)),
                    list(answer.ln_errors(&self.fabric)),
                    list(answer.half_widths()),
                    list(refined.stiffnesses.map(|s| s.shown)),
                    refined.ended.name(),
                    refined.drapes,
                    answer.cpu_s
                )
            }
        }
    }
}

impl Answer {
    /// Whether the interval of a stiffness holds the true one.
    #[must_use]
    pub fn holds(&self, truth: &Fabric, k: usize) -> bool {
        let [low, high] = self.refined.stiffnesses[k].interval90;
        (low..=high).contains(&truth.in_si()[k])
    }

    /// Logarithms of the six values over the true ones.
    #[must_use]
    pub fn ln_errors(&self, truth: &Fabric) -> [f64; STIFFNESSES] {
        let truth = truth.in_si();
        std::array::from_fn(|k| (self.refined.stiffnesses[k].value / truth[k]).ln())
    }

    /// The same of the balance of forces on the first sheets.
    #[must_use]
    pub fn balance_ln_errors(&self, truth: &Fabric) -> [f64; STIFFNESSES] {
        let truth = truth.in_si();
        std::array::from_fn(|k| (self.refined.of_balance[k] / truth[k]).ln())
    }

    /// The same of what the network said.
    #[must_use]
    pub fn network_ln_errors(&self, truth: &Fabric) -> [f64; STIFFNESSES] {
        let (truth, said) = (truth.in_si(), self.estimate.fabric.in_si());
        std::array::from_fn(|k| (said[k] / truth[k]).ln())
    }

    /// Half widths of the six intervals on the logarithm.
    #[must_use]
    pub fn half_widths(&self) -> [f64; STIFFNESSES] {
        self.refined.stiffnesses.map(|s| 0.5 * (s.interval90[1] / s.interval90[0]).ln())
    }
}

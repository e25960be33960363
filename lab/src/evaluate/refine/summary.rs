//! The figures of some cases of a refinement.

use serde::Serialize;

use super::{Answer, Case};
use scan2params::base::units::M_PER_MM;
use scan2params::fabric::{Fabric, STIFFNESSES};
use scan2params::numeric::robust::quantile;

/// The figures of some cases.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Which cases.
    pub group: String,
    /// Cases.
    pub cases: usize,
    /// Those with a fit.
    pub answered: usize,
    /// Shares of these whose rim lies within 1, 2 and 5 mm of the true one.
    pub within_mm: [f64; 3],
    /// Median distance of the rim from the true one \[mm\].
    pub rim_median_mm: f64,
    /// Share of the sheets held to their scans whose rim lies within 1 mm of the true one.
    pub held_within_1_mm: f64,
    /// The median of that distance \[mm\].
    pub held_rim_median_mm: f64,
    /// The same of the true fabric laid on the scan; null in files where that is not known.
    pub floor_median_mm: f64,
    /// Share of the released rims within 1 mm of the true one once turned about the plate's axis,
    /// and of the true fabric's.
    pub turned_within_1_mm: [f64; 2],
    /// The medians of these distances \[mm\].
    pub turned_median_mm: [f64; 2],
    /// The same as the floor, of the fabric that the network said.
    pub network_rim_median_mm: f64,
    /// Share of those within 5 mm.
    pub network_within_5_mm: f64,
    /// Of canonical drops, shares of the refined fabrics and of the network's that fall to within 5
    /// mm of the true rim when they are dropped the same way; null in files for perturbed drops.
    pub redropped_within_5_mm: [Option<f64>; 2],
    /// The medians of these distances \[mm\].
    pub redropped_median_mm: [Option<f64>; 2],
    /// Median over fabrics and the three bending stiffnesses of abs(ln error).
    pub bending_median: f64,
    /// The same of the two stretch stiffnesses and shear.
    pub stretch_median: f64,
    /// The same of the bending stiffnesses that the network said, of the first drop.
    pub network_bending_median: f64,
    /// The same of the balance of forces on the first sheets.
    pub balance_bending_median: f64,
    /// The 95th percentile of the refined.
    pub bending_95: f64,
    /// Share of the intervals of each stiffness that hold the truth.
    pub held: [f64; STIFFNESSES],
    /// Median factor of the half width of the bending stiffnesses' intervals.
    pub bending_factor: f64,
    /// Median and 95th percentile of the processor time \[s\].
    pub cpu_s: [f64; 2],
}

impl Summary {
    /// Of some cases; `None` if none of them was answered.
    #[must_use]
    pub fn of<'a>(group: &str, cases: impl Iterator<Item = &'a Case>) -> Option<Self> {
        let cases: Vec<&Case> = cases.collect();
        let answered = |case: &&'a Case| Some((&case.fabric, case.answer.as_ref().ok()?));
        let answers: Vec<(&Fabric, &Answer)> = cases.iter().filter_map(answered).collect();
        let count = answers.len() as f64;
        let all = |of: &dyn Fn(&Answer) -> f64| -> Vec<f64> {
            answers.iter().map(|(_, answer)| of(answer) / M_PER_MM).collect()
        };
        let known = |of: &dyn Fn(&Answer) -> f64| -> Vec<f64> {
            all(of).into_iter().filter(|mm| !mm.is_nan()).collect()
        };
        let rims = all(&|a| a.rim_error_m);
        let floors = known(&|a| a.floor_m);
        let turned = [0, 1].map(|which| known(&|a| a.turned_m[which]));
        let networks = known(&|a| a.network_rim_error_m);
        let within = |rims: &[f64], mm| rims.iter().filter(|&&rim| rim < mm).count() as f64 / count;
        // a drape that does not come to rest is far off
        let redropped = [0, 1].map(|which| {
            let rest = |m: f64| if m.is_nan() { f64::INFINITY } else { m };
            let own = all(&|a| rest(a.redropped_m[which]));
            own.iter().any(|mm| mm.is_finite()).then_some(own)
        });
        let held_rims = all(&|a| a.held_rim_error_m);
        let some = |of: &dyn Fn(&Answer, &Fabric) -> [f64; STIFFNESSES], from: usize| -> Vec<f64> {
            let values = answers.iter().flat_map(|(f, a)| of(a, f)[from..from + 3].to_vec());
            values.map(f64::abs).collect()
        };
        let stretch = some(&Answer::ln_errors, 0);
        let errors = some(&Answer::ln_errors, 3);
        let network = some(&Answer::network_ln_errors, 3);
        let balance = some(&Answer::balance_ln_errors, 3);
        let half_widths = some(&|answer, _| answer.half_widths(), 3);
        let holds = |k: usize| answers.iter().filter(|(fabric, a)| a.holds(fabric, k)).count();
        let held = std::array::from_fn(|k| holds(k) as f64 / count);
        let times: Vec<f64> = answers.iter().map(|(_, a)| a.cpu_s).collect();
        Some(Self {
            group: group.to_owned(),
            cases: cases.len(),
            answered: answers.len(),
            within_mm: [1.0, 2.0, 5.0].map(|mm| within(&rims, mm)),
            held_within_1_mm: within(&held_rims, 1.0),
            held_rim_median_mm: quantile(held_rims, 0.5)?,
            rim_median_mm: quantile(rims.clone(), 0.5)?,
            floor_median_mm: quantile(floors, 0.5).unwrap_or(f64::NAN),
            turned_within_1_mm: turned.each_ref().map(|own| within(own, 1.0)),
            turned_median_mm: turned.map(|own| quantile(own, 0.5).unwrap_or(f64::NAN)),
            network_within_5_mm: within(&networks, 5.0),
            redropped_within_5_mm: redropped.clone().map(|own| Some(within(&own?, 5.0))),
            redropped_median_mm: redropped.map(|own| quantile(own?, 0.5)),
            network_rim_median_mm: quantile(networks, 0.5).unwrap_or(f64::NAN),
            bending_median: quantile(errors.clone(), 0.5)?,
            bending_95: quantile(errors, 0.95)?,
            stretch_median: quantile(stretch, 0.5)?,
            network_bending_median: quantile(network, 0.5)?,
            balance_bending_median: quantile(balance, 0.5)?,
            held,
            bending_factor: quantile(half_widths, 0.5)?.exp(),
            cpu_s: [quantile(times.clone(), 0.5)?, quantile(times, 0.95)?],
        })
    }
}

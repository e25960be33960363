//! Refining within the main job: from the network's estimate to the fabric whose drape lies closest to
//! the scan, and whether that fabric is the answer.
//!
//! It is where it drapes on the scan's branch. If not, the network's estimate stays, and the verdict says so.

use std::path::PathBuf;
use std::time::Instant;

use super::Rim;
use crate::base::units::M_PER_MM;
use crate::estimate::{Candidate, Estimate, EstimateWarning};
use crate::fabric::{Fabric, Mixture, STIFFNESSES};
use crate::refine::{
    FitError, FitOptions, LedBy, Prior, Progress, Refined, Resimulation, Scan, fit,
};
use crate::sim::Experiment;

/// Another scan of the fabric, which it is refined on together with the first. A second drop shows the
/// fabric on another branch and in another place, and tells apart what one drape leaves mixed.
#[derive(Debug)]
pub struct Companion {
    /// The scan.
    pub path: PathBuf,
    /// Its rim.
    pub rim: Rim,
    /// What the network says of it alone.
    pub network: Estimate,
}

/// What refining found.
#[derive(Debug)]
pub struct Refinement {
    /// The fabric found, or why there is none.
    pub result: Result<Refined, FitError>,
    /// What the network said of the first scan.
    pub network: Estimate,
    /// The other scans that the fabric was refined on; their drapes are those of the result behind the first.
    pub companions: Vec<Companion>,
    /// Time that it took on the wall \[s\].
    pub wall_s: f64,
}

/// A refined fabric that is the answer.
#[derive(Clone, Copy, Debug)]
pub struct Taken<'a>(&'a Refined);

impl Refinement {
    pub(super) fn of(
        rim: &Rim,
        companions: Vec<Companion>,
        (density_kg_m2, experiment): (f64, &Experiment),
        (network, prior): (&Estimate, Option<&Mixture>),
        tell: &impl Fn(&str),
    ) -> Self {
        let start = Instant::now();
        let rims = std::iter::once(rim).chain(companions.iter().map(|other| &other.rim));
        let experiment = *experiment;
        let scans: Vec<Scan<'_>> =
            rims.map(|rim| Scan { rim: rim.boundary(), sheet: rim.sheet(), experiment }).collect();
        let networks = std::iter::once(network).chain(companions.iter().map(|c| &c.network));
        let believed = networks.map(|network| Prior::of_estimate(network, prior));
        let prior = Prior::together(&believed.collect::<Vec<_>>());
        let heard = |progress: Progress| {
            let Progress { drapes, rim_m } = progress;
            tell(&format!(
                "refining on the scan's branch: drape {drapes}, rim {:.2} mm from the scan",
                rim_m / M_PER_MM
            ));
        };
        let result =
            fit(&scans, density_kg_m2, &prior, &prior.starts(), &FitOptions::default(), heard);
        let wall_s = start.elapsed().as_secs_f64();
        Self { result, network: network.clone(), companions, wall_s }
    }

    /// The refined fabric, if it is the answer.
    #[must_use]
    pub fn taken(&self) -> Option<Taken<'_>> {
        self.result.as_ref().ok().filter(|refined| refined.is_on_branch()).map(Taken)
    }
}

impl Taken<'_> {
    /// The answer in the form of an estimate. Values beyond what the network was trained on are in range: the
    /// simulator was asked, not the network.
    pub(super) fn estimate(self, network: &Estimate) -> Estimate {
        let refined = self.0;
        let fabric_of = |values: [f64; STIFFNESSES]| {
            let [a, b, c, d, e, f] = values;
            Fabric::from_si([a, b, c, d, e, f, refined.fabric.density_kg_m2])
        };
        let end = |side: usize| fabric_of(refined.stiffnesses.map(|s| s.interval90[side]));
        let as_given = Candidate { fabric: refined.fabric, interval90: [end(0), end(1)] };
        // The sheet knows nothing of the yarns' names: read the other way round, the same fit has them exchanged.
        let mut candidates = vec![as_given.clone()];
        if network.candidates.len() > 1 {
            candidates.push(as_given.exchanged());
        }
        let stays = |warning: &&EstimateWarning| match warning {
            EstimateWarning::DensityOutsideTraining { .. }
            | EstimateWarning::AtRangeEnd { .. }
            | EstimateWarning::Bending(_) => false,
            EstimateWarning::NovelRim { .. } | EstimateWarning::OrientationAmbiguous => true,
        };
        Estimate {
            in_range: refined.stiffnesses.map(|s| !s.at_limit),
            warnings: network.warnings.iter().filter(stays).cloned().collect(),
            ..Estimate::of_candidates(candidates, network)
        }
    }

    /// Its drape beside the scanned rim.
    pub(super) fn drape(self, rim: &Rim) -> Resimulation {
        let led_by = if rim.sheet().is_some() { LedBy::Sheet } else { LedBy::Rim };
        Resimulation::beside(rim.boundary(), self.0.scans[0].drape.clone(), led_by)
    }
}

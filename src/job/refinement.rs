//! Refining within the main job: from the network's estimate to the fabric whose drape lies closest
//! to the scan, and whether that fabric is the answer.
//!
//! It is where the fit has converged, within its bounds, and leaves so little that something can be
//! told ([`NotTaken`] has what stands against it). If not, the network's estimate stays, and the
//! verdict says so. It is doubtful where the fit leaves more than scan and simulator err.

use std::path::PathBuf;
use std::time::Instant;

use super::Rim;
use super::verdict::Limits;
use crate::estimate::{Candidate, Estimate, EstimateWarning};
use crate::fabric::{Fabric, Mixture, STIFFNESSES};
use crate::refine::{Ended, FitError, FitOptions, Prior, Progress, Refined, Scan, ScanFit, fit};
use crate::sim::Experiment;

/// Another scan of the fabric, which it is refined on together with the first. A second drop shows
/// the fabric on another branch and in another place, and tells apart what one drape leaves mixed.
#[derive(Clone, Debug)]
pub struct Companion {
    /// The scan.
    pub path: PathBuf,
    /// Its rim.
    pub rim: Rim,
    /// What the network says of it alone.
    pub network: Estimate,
}

/// What refining found.
#[derive(Clone, Debug)]
pub struct Refinement {
    /// The fabric found, or why there is none.
    pub result: Result<Refined, FitError>,
    /// The network's answer for the first scan.
    pub network: Estimate,
    /// The other scans that the fabric was refined on; their drapes are those of the result behind
    /// the first.
    pub companions: Vec<Companion>,
    /// Time that it took on the wall \[s\].
    pub wall_s: f64,
}

/// Why a refined fabric is not the answer.
#[derive(Clone, Debug, PartialEq)]
pub enum NotTaken {
    /// There is none.
    Failed(FitError),
    /// The steps did not come to an end.
    NotConverged(Ended),
    /// A stiffness ended at an end of what was allowed; its key.
    AtBound(&'static str),
    /// Tied to the scan, the sheet is so much farther from it than scan and simulator err, in
    /// standard deviations of both, that nothing is known of the fabric.
    Leaves {
        /// What it leaves.
        misfit: f64,
        /// What an answer leaves at most.
        most: f64,
    },
    /// The tied drape has other folds than the scan.
    OtherBranch {
        /// Folds of the scan and of the drape.
        folds: [usize; 2],
        /// Mean distance of the rims \[m\].
        rim_m: f64,
    },
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
        release: bool,
        tell: &impl Fn(Progress),
    ) -> Self {
        let start = Instant::now();
        let rims = std::iter::once(rim).chain(companions.iter().map(|other| &other.rim));
        let experiment = *experiment;
        let scans: Vec<Scan<'_>> =
            rims.map(|rim| Scan { rim: rim.boundary(), sheet: rim.sheet(), experiment }).collect();
        let networks = std::iter::once(network).chain(companions.iter().map(|c| &c.network));
        let believed = networks.map(|network| Prior::of_estimate(network, prior));
        let prior = Prior::together(&believed.collect::<Vec<_>>());
        let options = FitOptions { release, ..FitOptions::default() };
        let result = fit(&scans, density_kg_m2, &prior, &prior.starts(), &options, tell);
        let wall_s = start.elapsed().as_secs_f64();
        Self { result, network: network.clone(), companions, wall_s }
    }

    /// One that nobody waited for the end of.
    pub(super) fn interrupted(network: &Estimate) -> Self {
        let result = Err(FitError::Interrupted);
        Self { result, network: network.clone(), companions: Vec::new(), wall_s: 0.0 }
    }

    /// The refined fabric, if it is the answer.
    #[must_use]
    pub fn taken(&self) -> Option<Taken<'_>> {
        self.result.as_ref().ok().filter(|refined| against(refined).is_none()).map(Taken)
    }

    /// What stands against the refined fabric as the answer; `None` if it is.
    #[must_use]
    pub fn not_taken(&self) -> Option<NotTaken> {
        match &self.result {
            Err(error) => Some(NotTaken::Failed(error.clone())),
            Ok(refined) => against(refined),
        }
    }
}

/// What stands against a refined fabric, the gravest first.
fn against(refined: &Refined) -> Option<NotTaken> {
    let most = Limits::default().refined_misfit.do_not_use;
    if refined.misfit > most {
        return Some(NotTaken::Leaves { misfit: refined.misfit, most });
    }
    // of several scans, the one whose drape lies farthest off
    let off = refined.scans.iter().filter(|scan| !scan.on_branch);
    if let Some(scan) = off.max_by(|a, b| a.tied_mean_m.total_cmp(&b.tied_mean_m)) {
        return Some(NotTaken::OtherBranch { folds: scan.nodes, rim_m: scan.tied_mean_m });
    }
    if let Some(bound) = refined.stiffnesses.iter().find(|stiffness| stiffness.at_limit) {
        return Some(NotTaken::AtBound(bound.key));
    }
    let ended = matches!(refined.ended, Ended::Converged | Ended::NoBetter);
    (!ended).then_some(NotTaken::NotConverged(refined.ended))
}

impl<'a> Taken<'a> {
    /// The refined fabric.
    #[must_use]
    pub fn refined(self) -> &'a Refined {
        self.0
    }

    /// The first scan beside its drapes.
    #[must_use]
    pub fn first(self) -> &'a ScanFit {
        &self.0.scans[0]
    }

    /// The answer in the form of an estimate. Values beyond what the network was trained on are in
    /// range: the simulator was asked, not the network.
    pub(super) fn estimate(self, network: &Estimate) -> Estimate {
        let refined = self.0;
        let fabric_of = |values: [f64; STIFFNESSES]| {
            let [a, b, c, d, e, f] = values;
            Fabric::from_si([a, b, c, d, e, f, refined.fabric.density_kg_m2])
        };
        let end = |side: usize| fabric_of(refined.stiffnesses.map(|s| s.interval90[side]));
        let as_given = Candidate { fabric: refined.fabric, interval90: [end(0), end(1)] };
        // The sheet knows nothing of the yarns' names: read the other way round, the same fit has
        // them exchanged.
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
            // one at an end of what was allowed is no answer
            in_range: [true; STIFFNESSES],
            warnings: network.warnings.iter().filter(stays).cloned().collect(),
            ..Estimate::of_candidates(candidates, network)
        }
    }
}

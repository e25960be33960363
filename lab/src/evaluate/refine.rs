//! Refinement held against fabrics that are known, for `scan2params-lab refine`.
//!
//! In: priors, sensors, seeds. Out: one [`Case`] a virtual scan: a fabric draped by a perturbed
//! drop on cells finer than any that the fit uses, so that the fit never meets its own mesh;
//! scanned; taken through the whole path; estimated by the shipped network; refined. [`Summary`]
//! has the figures that are promised, by sensor and bending length.
//!
//! Drapes on fine cells take up to two minutes each; a folder keeps them from run to run.

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;

use super::estimate::anywhere;
use super::scan::{Setup, SetupError, find};
use scan2params::base::clock::thread_cpu_s;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Boundary, Surface};
use scan2params::dataset::drape_file::{DrapeFileError, read_drape, rim_of};
use scan2params::estimate::{Estimate, EstimateError, Estimator};
use scan2params::fabric::{Fabric, Mixture, MixtureError, STIFFNESSES};
use scan2params::geom::Mesh;
use scan2params::io::{WriteError, write_obj};
use scan2params::numeric::robust;
use scan2params::refine::{FitError, FitOptions, Prior, Refined, Scan, fit, released_drape};
use scan2params::scan::{ScanError, Tuning};
use scan2params::sensor::SceneError;
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::{Drape, Drop, Experiment, Fall, SimOptions, Stop, drape};

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

/// How the search for rest of a true drape ended that is no truth, and its crossing pairs of
/// triangles.
pub(super) type Unfit = (Stop, usize);

/// Why a case cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The prior gives no fabric.
    #[error(transparent)]
    Prior(#[from] MixtureError),
    /// The drape makes no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A kept drape cannot be read.
    #[error(transparent)]
    Read(#[from] DrapeFileError),
    /// A drape cannot be kept.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// How a drape is seen.
#[derive(Clone, Debug)]
pub enum Sight {
    /// Scanned, through the whole scan path.
    Scanned(Box<Setup>),
    /// Its rim as it is, without a sheet: the paper's protocol.
    Rim,
}

impl Sight {
    /// Name of the sight of rims alone.
    const RIM: &str = "rim";

    /// The sight of this name: a sensor's (see [`Setup::named`]), or `rim`.
    ///
    /// # Errors
    /// As [`Setup::named`].
    pub fn named(name: &str) -> Result<Self, SetupError> {
        match name {
            Self::RIM => Ok(Self::Rim),
            _ => Ok(Self::Scanned(Box::new(Setup::named(name)?))),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Scanned(setup) => &setup.name,
            Self::Rim => Self::RIM,
        }
    }

    /// What is seen of a drape.
    pub(super) fn of(
        &self,
        (mesh, rim): &Truth,
        seed: u64,
    ) -> Result<Result<Seen, ScanError>, SceneError> {
        let Self::Scanned(setup) = self else {
            return Ok(Ok(Seen { rim: rim.clone(), sheet: None }));
        };
        let found = find(&setup.scan(mesh, seed)?, &Tuning::default());
        Ok(found.map(|found| Seen { rim: found.boundary, sheet: Some(found.surface) }))
    }
}

/// Where a fit begins; its prior is the network's answer in each case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// At what the network says, as `estimate` does.
    Network,
    /// At the mean fabric of the prior that the true one is of.
    Prior,
}

/// What is seen of a drape.
pub(super) struct Seen {
    pub(super) rim: Boundary,
    sheet: Option<Surface>,
}

/// Fabrics of priors, each draped, seen by every sensor and refined.
pub struct Series<'a> {
    /// Where the fabrics are from; taken in turn.
    pub priors: Vec<Mixture>,
    /// Whether they are drawn evenly from the priors' boxes ([`anywhere`]) and not from the priors.
    pub anywhere: bool,
    /// How they are seen.
    pub sights: Vec<Sight>,
    /// Who begins.
    pub estimator: &'a Estimator,
    /// Where the fits begin.
    pub begin: Begin,
    /// How the fit is made.
    pub options: FitOptions,
    /// Seed of fabrics, drops and scans.
    pub seed: u64,
    /// Which fabrics of each prior.
    pub fabrics: std::ops::Range<u64>,
    /// Drops of each fabric, which are refined together.
    pub drops: u64,
    /// How they fall; canonical drops of a fabric are all the same.
    pub fall: Fall,
    /// Vertices a side of the true drapes.
    pub truth_vertices: usize,
    /// Where the true drapes and those of the paper's comparison end ([`SimOptions::energy_drop`]):
    /// 0 for full rest.
    pub energy_drop: f64,
    /// Folder that keeps the true drapes.
    pub keep: Option<PathBuf>,
}

impl Series<'_> {
    /// Runs all cases on all cores and returns them in order; `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first case that cannot be made.
    pub fn run(&self, tell: impl Fn(&Case) + Sync) -> Result<Vec<Case>, CaseError> {
        let of_fabric = |index: u64| self.priors.iter().map(move |prior| (prior, index));
        let all: Vec<(&Mixture, u64)> = self.fabrics.clone().flat_map(of_fabric).collect();
        let cases = all.into_par_iter().with_max_len(1).map(|(prior, index)| {
            let cases = self.cases(prior, index)?;
            cases.iter().for_each(&tell);
            Ok(cases)
        });
        Ok(cases.collect::<Result<Vec<_>, CaseError>>()?.into_iter().flatten().collect())
    }

    /// The drapes of one fabric, scanned by every sensor.
    pub(super) fn cases(&self, prior: &Mixture, index: u64) -> Result<Vec<Case>, CaseError> {
        let fabric = match self.anywhere {
            true => anywhere(prior, self.seed, index),
            false => prior.sample(self.seed, index)?,
        };
        let truths = (0..self.drops).map(|drop| self.truth(prior, &fabric, index, drop));
        let truths: Result<Vec<Truth>, Unfit> =
            truths.collect::<Result<Vec<_>, CaseError>>()?.into_iter().collect();
        let begin = match self.begin {
            Begin::Network => None,
            Begin::Prior => Some(mean_of(prior, fabric.density_kg_m2)?),
        };
        let case = |sight: &Sight| {
            let answer = match &truths {
                Ok(truths) => self.answer(sight, truths, &fabric, (index, begin))?,
                Err((stop, intersections)) => {
                    Err(NoAnswer::Truth { stop: *stop, intersections: *intersections })
                }
            };
            let (prior, sensor) = (prior.name().to_owned(), sight.name().to_owned());
            Ok(Case { prior, sensor, index, fabric, answer })
        };
        self.sights.iter().map(case).collect()
    }

    /// The true drape, kept or made, or why there is none.
    pub(super) fn truth(
        &self,
        prior: &Mixture,
        fabric: &Fabric,
        index: u64,
        drop: u64,
    ) -> Result<Result<Truth, Unfit>, CaseError> {
        let name = |folder: &PathBuf| {
            let (seed, vertices) = (self.seed, self.truth_vertices);
            let again = match drop {
                _ if self.fall == Fall::Canonical => "-canonical".into(),
                0 => String::new(),
                _ => format!("-drop{drop}"),
            };
            let anywhere = if self.anywhere { "-anywhere" } else { "" };
            folder.join(format!("{}{anywhere}-{seed}-{index}-{vertices}{again}.obj", prior.name()))
        };
        let path = self.keep.as_ref().map(name);
        if let Some(path) = path.as_deref().filter(|path| path.exists()) {
            return Ok(Ok(with_rim(read_drape(path)?)));
        }
        let drop = self.fall.drop(self.seed_of(index, drop));
        let drape = drape(fabric, &drop, &self.truth_options());
        if !drape.stop.is_as_asked() || drape.intersections > 0 {
            return Ok(Err((drape.stop, drape.intersections)));
        }
        if let Some(path) = path.as_deref() {
            write_obj(path, &drape.mesh())?;
        }
        Ok(Ok(with_rim(drape.mesh())))
    }

    /// How the true drapes are made.
    fn truth_options(&self) -> SimOptions {
        let Self { truth_vertices: vertices, energy_drop, .. } = *self;
        SimOptions { vertices, energy_drop, ..SimOptions::default() }
    }

    /// The seed of a drop of a fabric; the first drop of all runs is the same.
    fn seed_of(&self, index: u64, drop: u64) -> u64 {
        self.seed ^ index ^ (drop << 32)
    }

    pub(super) fn answer(
        &self,
        sight: &Sight,
        truths: &[Truth],
        fabric: &Fabric,
        (index, begin): (u64, Option<[f64; STIFFNESSES]>),
    ) -> Result<Result<Answer, NoAnswer>, CaseError> {
        let mut seen = Vec::new();
        for (truth, drop) in truths.iter().zip(0..) {
            match sight.of(truth, self.seed_of(index, drop))? {
                Ok(found) => seen.push(found),
                Err(error) => return Ok(Err(error.into())),
            }
        }
        let rims: Vec<&Boundary> = truths.iter().map(|(_, rim)| rim).collect();
        Ok(self.refined(&seen, &rims, fabric, begin))
    }

    /// The fit to the scans of one fabric's drops beside the true rims.
    fn refined(
        &self,
        seen: &[Seen],
        rims: &[&Boundary],
        fabric: &Fabric,
        begin: Option<[f64; STIFFNESSES]>,
    ) -> Result<Answer, NoAnswer> {
        let density_kg_m2 = fabric.density_kg_m2;
        let estimates = seen
            .iter()
            .map(|seen| self.estimator.estimate(&seen.rim, density_kg_m2, true))
            .collect::<Result<Vec<_>, _>>()?;
        let experiment = Experiment::default();
        let scans: Vec<Scan<'_>> = seen
            .iter()
            .map(|Seen { rim, sheet }| Scan { rim, sheet: sheet.as_ref(), experiment })
            .collect();
        let believed = |own: &Estimate| Prior::of_estimate(own, self.estimator.prior());
        let prior = Prior::together(&estimates.iter().map(believed).collect::<Vec<_>>());
        let cpu = thread_cpu_s();
        let mut starts = prior.starts().to_vec();
        if let Some(mean) = begin {
            starts.insert(0, ("prior", mean));
        }
        let refined = fit(&scans, density_kg_m2, &prior, &starts, &self.options, |_| ())?;
        let cpu_s = cpu.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
        // a drape that rotated as it fell lies turned, and no scan can tell
        let turned = rims.iter().zip(seen).map(|(rim, seen)| rim.turned_onto(&seen.rim));
        let turned: Vec<Boundary> = turned.collect();
        let count = turned.len() as f64;
        let of_scans = turned.iter().zip(seen).map(|(rim, seen)| rim.mean_distance_m(&seen.rim));
        let of_drapes = turned.iter().zip(&refined.scans);
        let of_held = of_drapes.clone().map(|(rim, fit)| rim.mean_distance_m(&fit.tied.boundary));
        let of_drapes = of_drapes.map(|(rim, fit)| match &fit.released {
            Some(released) => beside(rim, &released.drape.boundary),
            None => [f64::NAN; 2],
        });
        let mean = |pairs: Vec<[f64; 2]>| {
            [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<f64>() / count)
        };
        let drapes = mean(of_drapes.collect());
        // what is not asked to be released is not compared with released sheets
        let laid = |rim: &Boundary, seen: &Seen, fabric: &Fabric| match self.options.release {
            true => self.laid_m(rim, seen, fabric),
            false => [f64::NAN; 2],
        };
        let floors = turned.iter().zip(seen).map(|(rim, seen)| laid(rim, seen, fabric));
        let floors = mean(floors.collect());
        let networks = turned.iter().zip(seen).zip(&estimates);
        let networks = networks.map(|((rim, seen), own)| laid(rim, seen, &own.fabric));
        let networks = mean(networks.collect());
        Ok(Answer {
            scan_error_m: of_scans.sum::<f64>() / count,
            rim_error_m: drapes[0],
            held_rim_error_m: of_held.sum::<f64>() / count,
            floor_m: floors[0],
            turned_m: [drapes[1], floors[1]],
            network_rim_error_m: networks[0],
            redropped_m: [&refined.fabric, &estimates[0].fabric]
                .map(|own| self.redropped_m(rims[0], own)),
            cpu_s: if scans.len() == 1 { cpu_s } else { f64::NAN },
            estimate: estimates.into_iter().next().unwrap_or_else(|| unreachable!("one a scan")),
            refined,
        })
    }
}

impl Series<'_> {
    /// Mean distance of a true rim from that of a fabric guided by what was seen and released, as
    /// it lies and turned; NaN where that does not come to rest.
    fn laid_m(&self, rim: &Boundary, seen: &Seen, fabric: &Fabric) -> [f64; 2] {
        let options = SimOptions { vertices: self.options.vertices[1], ..self.options.sim };
        let again = released_drape(&seen.rim, seen.sheet.as_ref(), fabric, &options);
        let Drape { stop, boundary, .. } = &again.drape;
        if *stop == Stop::AtRest { beside(rim, boundary) } else { [f64::NAN; 2] }
    }
}

impl Series<'_> {
    /// Mean distance of a true rim from that of a fabric that is dropped as the true one was; NaN
    /// where no canonical drop was, or it does not come to rest.
    pub(super) fn redropped_m(&self, rim: &Boundary, fabric: &Fabric) -> f64 {
        if self.fall != Fall::Canonical {
            return f64::NAN;
        }
        let Drape { stop, boundary, .. } = drape(fabric, &Drop::canonical(), &self.truth_options());
        if stop.is_as_asked() { rim.mean_distance_m(&boundary) } else { f64::NAN }
    }
}

/// Logarithms of the mean fabric of a prior, at a density: a drape depends on stiffness over
/// weight.
fn mean_of(prior: &Mixture, density_kg_m2: f64) -> Result<[f64; STIFFNESSES], MixtureError> {
    let mut sum = [0.0; STIFFNESSES];
    for index in 0..MEAN_OF {
        let fabric = prior.sample(MEAN_SEED, index)?;
        let heavier = density_kg_m2 / fabric.density_kg_m2;
        sum.iter_mut().zip(fabric.in_si()).for_each(|(sum, v)| *sum += (v * heavier).ln());
    }
    Ok(sum.map(|sum| sum / MEAN_OF as f64))
}

/// Fabrics that the mean of a prior is taken over, and their seed.
const MEAN_OF: u64 = 1000;
const MEAN_SEED: u64 = 1;

/// Mean distance of two rims, as they lie and once the second is turned about the plate's axis onto
/// the first.
fn beside(rim: &Boundary, other: &Boundary) -> [f64; 2] {
    [rim.mean_distance_m(other), rim.mean_distance_m(&other.turned_onto(rim))]
}

/// A true drape and its rim.
pub(super) type Truth = (Mesh, Boundary);

fn with_rim(mesh: Mesh) -> Truth {
    let rim = rim_of(&mesh).unwrap_or_else(|| unreachable!("a square grid of vertices"));
    (mesh, rim)
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
        let answers: Vec<(&Fabric, &Answer)> = cases
            .iter()
            .filter_map(|case| case.answer.as_ref().ok().map(|answer| (&case.fabric, answer)))
            .collect();
        let count = answers.len() as f64;
        let quantile = |values: Vec<f64>, share| robust::quantile(values, share);
        let rims: Vec<f64> = answers.iter().map(|(_, a)| a.rim_error_m / M_PER_MM).collect();
        let floors = answers.iter().map(|(_, a)| a.floor_m / M_PER_MM).filter(|mm| !mm.is_nan());
        let floors: Vec<f64> = floors.collect();
        let turned = [0, 1].map(|which| {
            let own = answers.iter().map(|(_, a)| a.turned_m[which] / M_PER_MM);
            own.filter(|mm| !mm.is_nan()).collect::<Vec<f64>>()
        });
        let networks = answers.iter().map(|(_, a)| a.network_rim_error_m / M_PER_MM);
        let networks: Vec<f64> = networks.filter(|mm| !mm.is_nan()).collect();
        let within = |rims: &[f64], mm| rims.iter().filter(|&&rim| rim < mm).count() as f64 / count;
        // a drape that does not come to rest is far off
        let redropped = [0, 1].map(|which| {
            let own = answers.iter().map(|(_, a)| a.redropped_m[which] / M_PER_MM);
            let own: Vec<f64> =
                own.map(|mm| if mm.is_nan() { f64::INFINITY } else { mm }).collect();
            own.iter().any(|mm| mm.is_finite()).then_some(own)
        });
        let held_rims: Vec<f64> =
            answers.iter().map(|(_, a)| a.held_rim_error_m / M_PER_MM).collect();
        let some = |of: &dyn Fn(&Fabric, &Answer) -> [f64; STIFFNESSES],
                    which: std::ops::Range<usize>|
         -> Vec<f64> {
            let values = answers.iter().flat_map(|(f, a)| of(f, a)[which.clone()].to_vec());
            values.map(f64::abs).collect()
        };
        let bending = |of: &dyn Fn(&Fabric, &Answer) -> [f64; STIFFNESSES]| some(of, 3..6);
        let stretch = some(&|fabric, answer| answer.ln_errors(fabric), 0..3);
        let errors = bending(&|fabric, answer| answer.ln_errors(fabric));
        let network = bending(&|fabric, answer| answer.network_ln_errors(fabric));
        let balance = bending(&|fabric, answer| answer.balance_ln_errors(fabric));
        let held = std::array::from_fn(|k| {
            let holds = |(fabric, answer): &&(&Fabric, &Answer)| {
                let [low, high] = answer.refined.stiffnesses[k].interval90;
                (low..=high).contains(&fabric.in_si()[k])
            };
            answers.iter().filter(holds).count() as f64 / count
        });
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
            bending_factor: quantile(bending(&|_, answer| answer.half_widths()), 0.5)?.exp(),
            cpu_s: [quantile(times.clone(), 0.5)?, quantile(times, 0.95)?],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_is_answered_kept_and_summed() {
        let folder = tempfile::tempdir().unwrap();
        let estimator = Estimator::shipped().unwrap();
        let series = Series {
            priors: vec![Mixture::measured()],
            anywhere: false,
            sights: vec![Sight::named("structured-light").unwrap()],
            estimator: &estimator,
            begin: Begin::Network,
            options: FitOptions {
                vertices: [41, 41],
                evaluations: [4; 2],
                release: true,
                ..FitOptions::default()
            },
            seed: 8,
            fabrics: 0..1,
            drops: 1,
            fall: Fall::Perturbed,
            truth_vertices: 61,
            energy_drop: 0.0,
            keep: Some(folder.path().to_owned()),
        };
        // the run takes the drape that is kept here
        let prior = &series.priors[0];
        let fabric = prior.sample(series.seed, 0).unwrap();
        let (_, rim) = series.truth(prior, &fabric, 0, 0).unwrap().unwrap();
        assert!(folder.path().join("measured-8-0-61.obj").is_file());
        let (_, kept) = series.truth(prior, &fabric, 0, 0).unwrap().unwrap();
        // the file has coordinates to a tenth of a micrometre
        assert!(kept != rim && kept.mean_distance_m(&rim) < 1e-7);
        let cases = series.run(|_| ()).unwrap();
        let case = &cases[0];
        assert_eq!(case.fabric, fabric);
        println!("{}", case.row());
        assert_eq!(case.row().split(", ").count(), Case::COLUMNS.split(", ").count());
        let answer = case.answer.as_ref().unwrap();
        assert!(answer.scan_error_m < 1e-3 && answer.rim_error_m < 5e-3);
        assert!(answer.floor_m < 3e-3, "{}", answer.floor_m);
        let sum = Summary::of("all", cases.iter()).unwrap();
        assert_eq!((sum.cases, sum.answered), (1, 1));
        assert!((sum.rim_median_mm - answer.rim_error_m / M_PER_MM).abs() < 1e-12);
        let held = |k: usize| {
            answer.ln_errors(&case.fabric)[k].abs() <= answer.half_widths()[k] * (1.0 + 1e-9)
        };
        assert!((0..STIFFNESSES).all(|k| sum.held[k] == f64::from(u8::from(held(k)))));
        assert!(Summary::of("none", [].iter()).is_none());
    }
}

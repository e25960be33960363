//! Refinement held against fabrics that are known, for `scan2params-lab refine`.
//!
//! In: priors, sensors, seeds. Out: one [`Case`] a virtual scan: a fabric draped by a perturbed
//! drop on cells finer than any that the fit uses, so that the fit never meets its own mesh;
//! scanned; taken through the whole path; estimated by the shipped network; refined. [`Summary`]
//! has the figures that are promised, by sensor and bending length.
//!
//! Drapes on fine cells take up to two minutes each; a folder keeps them from run to run.

mod case;
mod summary;

pub use case::{Answer, Case, NoAnswer};
pub use summary::Summary;

use std::path::PathBuf;

use rayon::prelude::*;

use super::case_error::CaseError;
use super::estimate::anywhere;
use super::scan::{Setup, SetupError, find};
use scan2params::base::clock::thread_cpu_s;
use scan2params::base::{Boundary, Surface};
use scan2params::dataset::drape_file::{read_drape, rim_of};
use scan2params::estimate::{Estimate, Estimator};
use scan2params::fabric::{Fabric, Mixture, MixtureError, STIFFNESSES};
use scan2params::geom::Mesh;
use scan2params::io::write_obj;
use scan2params::refine::{FitOptions, Prior, Scan, fit, released_drape};
use scan2params::scan::{ScanError, Tuning};
use scan2params::sensor::SceneError;
use scan2params::sim::{Drape, Drop, Experiment, Fall, SimOptions, Stop, drape};

/// How the search for rest of a true drape ended that is no truth, and its crossing pairs of
/// triangles.
pub(super) type Unfit = (Stop, usize);

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
        let estimate = |seen: &Seen| self.estimator.estimate(&seen.rim, density_kg_m2, true);
        let estimates = seen.iter().map(estimate).collect::<Result<Vec<_>, _>>()?;
        let experiment = Experiment::default();
        let scans: Vec<Scan<'_>> = seen
            .iter()
            .map(|Seen { rim, sheet }| Scan { rim, sheet: sheet.as_ref(), experiment })
            .collect();
        let believed = |own: &Estimate| Prior::of_estimate(own, self.estimator.prior());
        let prior = Prior::together(&estimates.iter().map(believed).collect::<Vec<_>>());
        let cpu = thread_cpu_s();
        let begin = begin.map(|mean| ("prior", mean));
        let starts: Vec<_> = begin.into_iter().chain(prior.starts()).collect();
        let refined = fit(&scans, density_kg_m2, &prior, &starts, &self.options, |_| ())?;
        let cpu_s = cpu.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
        // a drape that rotated as it fell lies turned, and no scan can tell
        let turned: Vec<Boundary> =
            rims.iter().zip(seen).map(|(rim, seen)| rim.turned_onto(&seen.rim)).collect();
        let count = turned.len() as f64;
        let both = || turned.iter().zip(seen);
        let of_scans = both().map(|(rim, seen)| rim.mean_distance_m(&seen.rim));
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
        let floors = mean(both().map(|(rim, seen)| laid(rim, seen, fabric)).collect());
        let own = both().zip(&estimates);
        let networks = mean(own.map(|((rim, seen), own)| laid(rim, seen, &own.fabric)).collect());
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

    /// Mean distance of a true rim from that of a fabric guided by what was seen and released, as
    /// it lies and turned; NaN where that does not come to rest.
    fn laid_m(&self, rim: &Boundary, seen: &Seen, fabric: &Fabric) -> [f64; 2] {
        let options = SimOptions { vertices: self.options.vertices[1], ..self.options.sim };
        let again = released_drape(&seen.rim, seen.sheet.as_ref(), fabric, &options);
        let Drape { stop, boundary, .. } = &again.drape;
        if *stop == Stop::AtRest { beside(rim, boundary) } else { [f64::NAN; 2] }
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::base::units::M_PER_MM;

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

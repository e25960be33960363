//! The main job: a scan file to six stiffnesses, and back to a drape.
//!
//! read -> rim -> estimate -> refine, if asked for, with other scans of the same fabric -> re-simulate. In: a path and what the user
//! knows; or, for [`Job::run_on`], a rim in place of the path. Out: an [`Outcome`], which `report` shows.

mod error;
pub mod refinement;
pub mod verdict;

use std::path::{Path, PathBuf};

pub use error::{CompanionFault, FailureKind, JobError};
pub use refinement::{Companion, Refinement};
pub use verdict::Verdict;

use crate::base::units::M_PER_MM;
use crate::estimate::{Estimate, Estimator};
use crate::fabric::{Likeness, check_density};
use crate::intake::{Rim, rim};
use crate::io::ReadOptions;
use crate::refine::{Resimulation, resimulate};
use crate::scan::{Orientation, ScanOptions};
use crate::sim::{Experiment, SimOptions};

/// What to do with one scan.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scan, or a rim as `boundary` writes it.
    pub input: PathBuf,
    /// Areal density of the fabric \[kg/m^2\].
    pub density_kg_m2: f64,
    /// What a depth image does not say itself.
    pub read: ReadOptions,
    /// How the scan is taken.
    pub scan: ScanOptions,
    /// Whether the estimate is draped again and held against the scan.
    pub resimulate: bool,
    /// Whether the simulator looks for the fabric whose drape lies closest to the scan, from the
    /// estimate on.
    pub refine: bool,
    /// Other scans of the same fabric, or rims of it, which it is refined on together with `input`;
    /// read and scanned in the same way. Without `refine` they are not looked at.
    pub with: Vec<PathBuf>,
    /// What is draped where the simulator is asked: the standard experiment, with what the cloth is known to have beyond
    /// the seven parameters.
    pub experiment: Experiment,
}

/// Everything found about one scan.
#[derive(Debug)]
pub struct Outcome {
    /// What was asked.
    pub job: Job,
    /// The rim.
    pub rim: Rim,
    /// The stiffnesses: the refined ones where the refinement was taken, else the network's.
    pub estimate: Estimate,
    /// Where the stiffnesses lie in the prior that the model was trained on; `None` if no such prior ships.
    pub likeness: Option<Likeness>,
    /// What refining found, if asked for.
    pub refinement: Option<Refinement>,
    /// The drape of the estimate, if asked for.
    pub resimulation: Option<Resimulation>,
    /// What all this is worth.
    pub verdict: Verdict,
    /// Name of the model and the SHA-256 of its file.
    pub model: [String; 2],
}

/// Refuses specimens and plates that the model does not know.
///
/// # Errors
/// When they are not those of the modified Cusick drape.
pub fn check_experiment(scan: &ScanOptions) -> Result<(), JobError> {
    if scan.is_modified_cusick() {
        return Ok(());
    }
    let [side_mm, radius_mm] = [scan.specimen_side_m, scan.plate_radius_m].map(|m| m / M_PER_MM);
    Err(JobError::Experiment { side_mm, radius_mm })
}

impl Job {
    /// The estimate of one scan and nothing more, as the program does it without further flags: the unit found from the
    /// scene, weft and warp not known, neither draped again nor refined.
    ///
    /// ```
    /// use scan2params::Job;
    /// use scan2params::job::verdict::Level;
    ///
    /// let job = Job::new("fixtures/scans/mean_structured-light.ply", 0.214);
    /// let outcome = job.run()?;
    /// if outcome.verdict.level != Level::DoNotUse {
    ///     println!("{:.2e} N m along the weft", outcome.estimate.fabric.bending_weft_nm);
    /// }
    /// # assert_eq!(outcome.verdict.level, Level::Reliable);
    /// # assert!(outcome.resimulation.is_none() && outcome.refinement.is_none());
    /// # Ok::<(), scan2params::job::JobError>(())
    /// ```
    #[must_use]
    pub fn new(input: impl Into<PathBuf>, density_kg_m2: f64) -> Self {
        Self {
            input: input.into(),
            density_kg_m2,
            read: ReadOptions::default(),
            scan: ScanOptions::default(),
            resimulate: false,
            refine: false,
            with: Vec::new(),
            experiment: Experiment::default(),
        }
    }

    /// Refuses what there is no estimate of whatever the scan shows: a density that no textile has, another experiment.
    ///
    /// # Errors
    /// [`JobError::Density`], [`JobError::Experiment`].
    pub fn check(&self) -> Result<(), JobError> {
        check_density(self.density_kg_m2)?;
        check_experiment(&self.scan)
    }

    /// Runs the job with the model that ships with the package.
    ///
    /// # Errors
    /// When the density is none, the file cannot be read, the scan is refused, or
    /// the model does not load.
    pub fn run(self) -> Result<Outcome, JobError> {
        self.run_telling(|_| ())
    }

    /// [`Self::run`]; `tell` hears what is being done, in words, as it begins.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_telling(self, tell: impl Fn(&str)) -> Result<Outcome, JobError> {
        self.check()?;
        self.with_model(&Estimator::shipped()?, tell)
    }

    /// Runs the job with a model that is loaded already.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_with(self, estimator: &Estimator) -> Result<Outcome, JobError> {
        self.with_model(estimator, |_| ())
    }

    /// Runs the job on a rim that is there already, and refines, where that is asked for, on the rims of `with` together
    /// with it, each with its name. [`Self::input`] is the first one's name; [`Self::read`] is not used.
    ///
    /// # Errors
    /// As [`Self::run`], but for the reading.
    pub fn run_on(
        mut self,
        rim: Rim,
        with: Vec<(PathBuf, Rim)>,
        estimator: &Estimator,
        tell: impl Fn(&str),
    ) -> Result<Outcome, JobError> {
        self.check()?;
        let (names, rims): (_, Vec<Rim>) = with.into_iter().unzip();
        self.with = names;
        let mut rims = rims.into_iter();
        let next =
            |_: &Path| Ok(rims.next().unwrap_or_else(|| unreachable!("a rim for each name")));
        self.of_rim(rim, next, estimator, tell)
    }

    /// The other scans of the fabric, each taken in by `take`. Weft and warp must be known in all of them: two drops that are
    /// read turned against each other are of two fabrics. One that cannot be trusted is refused with
    /// its path, since it would pull the fabric to itself unseen.
    fn companions(
        &self,
        rim: &Rim,
        mut take: impl FnMut(&Path) -> Result<Rim, JobError>,
        estimator: &Estimator,
        tell: &impl Fn(&str),
    ) -> Result<Vec<Companion>, JobError> {
        let fault = |path: &Path, source| JobError::Companion { path: path.to_owned(), source };
        if !self.with.is_empty() && rim.orientation() != Orientation::Given {
            return Err(fault(&self.input, CompanionFault::UnknownWarp));
        }
        let companion = |path: &PathBuf| {
            tell(&format!("looking for the rim of {}", path.display()));
            let rim = take(path)?;
            if rim.orientation() != Orientation::Given {
                return Err(fault(path, CompanionFault::UnknownWarp));
            }
            let verdict = verdict::of_rim(&rim, &self.scan);
            if verdict.level == verdict::Level::DoNotUse {
                return Err(fault(path, CompanionFault::Unusable(verdict.refusal())));
            }
            let network = estimator.estimate(rim.boundary(), self.density_kg_m2, true)?;
            Ok(Companion { path: path.clone(), rim, network })
        };
        self.with.iter().map(companion).collect()
    }

    fn with_model(self, estimator: &Estimator, tell: impl Fn(&str)) -> Result<Outcome, JobError> {
        self.check()?;
        tell("looking for the rim");
        let rim = rim::of_input(&self.input, &self.read, &self.scan)?;
        // The format is said of the first alone.
        let read = ReadOptions { format: None, ..self.read.clone() };
        let scan = self.scan.clone();
        let take = move |path: &Path| Ok(rim::of_input(path, &read, &scan)?);
        self.of_rim(rim, take, estimator, tell)
    }

    /// What follows once the rim is there.
    fn of_rim(
        self,
        rim: Rim,
        take: impl FnMut(&Path) -> Result<Rim, JobError>,
        estimator: &Estimator,
        tell: impl Fn(&str),
    ) -> Result<Outcome, JobError> {
        let known = rim.orientation() == Orientation::Given;
        tell("estimating the stiffnesses");
        let network = estimator.estimate(rim.boundary(), self.density_kg_m2, known)?;
        let refinement = if self.refine {
            let companions = self.companions(&rim, take, estimator, &tell)?;
            tell("refining on the scan's branch");
            let known = (self.density_kg_m2, &self.experiment);
            Some(Refinement::of(&rim, companions, known, (&network, estimator.prior()), &tell))
        } else {
            None
        };
        let taken = refinement.as_ref().and_then(Refinement::taken);
        let estimate = taken.map_or_else(|| network.clone(), |refined| refined.estimate(&network));
        let resimulation = match taken {
            Some(refined) => Some(refined.drape(&rim)),
            None => self.resimulate.then(|| {
                tell("draping the estimate again");
                let options = SimOptions { experiment: self.experiment, ..SimOptions::default() };
                resimulate(rim.boundary(), rim.sheet(), &estimate.fabric, &options)
            }),
        };
        let model = [estimator.model().id.clone(), estimator.model().onnx_sha256.clone()];
        let likeness = estimator.prior().map(|prior| estimate.likeness(prior));
        let verdict = verdict::of_job(
            &rim,
            &self.scan,
            (&estimate, likeness.as_ref()),
            refinement.as_ref(),
            resimulation.as_ref(),
        );
        Ok(Outcome { job: self, rim, estimate, likeness, refinement, resimulation, verdict, model })
    }
}

//! The main job: a scan file to six stiffnesses, and back to a drape.
//!
//! read -> rim -> the network's estimate -> refined by the simulator, with other scans of the same
//! fabric -> released. In: a path and what the user knows; or, for [`Job::run_on`], a rim in place
//! of the path. Out: an [`Outcome`], which `report` shows.

mod error;
pub mod refinement;
pub mod verdict;

use std::path::{Path, PathBuf};

pub use error::{CompanionFault, FailureKind, JobError};
pub use refinement::{Companion, NotTaken, Refinement, Taken};
pub use verdict::Verdict;

use crate::base::clock::{Begun, Stage, Stages};
use crate::base::units::M_PER_MM;
use crate::estimate::{Estimate, Estimator};
use crate::fabric::{Likeness, check_density};
use crate::intake::{Rim, rim};
use crate::io::ReadOptions;
use crate::refine::{Progress, ReleasedDrape, released_drape};
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
    /// Whether the simulator looks for the fabric whose drape lies closest to the scan, from the
    /// network's estimate on. Without, the answer is the network's.
    pub refine: bool,
    /// Whether the released drape is simulated. No stiffness depends on it.
    pub release: bool,
    /// Other scans of the same fabric, or rims of it, which it is refined on together with `input`;
    /// read and scanned in the same way. Without `refine` they are not looked at.
    pub with: Vec<PathBuf>,
    /// What is draped where the simulator is asked: the standard experiment, with what the cloth is
    /// known to have beyond the seven parameters.
    pub experiment: Experiment,
}

/// Everything found about one scan.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was asked.
    pub job: Job,
    /// The rim.
    pub rim: Rim,
    /// The stiffnesses: the refined ones where the refinement was taken, else the network's.
    pub estimate: Estimate,
    /// Where the stiffnesses lie in the prior that the model was trained on; `None` if no such
    /// prior ships.
    pub likeness: Option<Likeness>,
    /// What refining found, if asked for.
    pub refinement: Option<Refinement>,
    /// The fabric's released drape, if wanted.
    pub released: Option<ReleasedDrape>,
    /// What all this is worth.
    pub verdict: Verdict,
    /// Name of the model and the SHA-256 of its file.
    pub model: [String; 2],
    /// What was done, with processor time and memory.
    pub stages: Vec<Stage>,
}

/// What a job tells while it runs.
#[derive(Clone, Copy, Debug)]
pub enum Told<'a> {
    /// What begins, in words.
    Doing(&'a str),
    /// How far the refinement is.
    Refining(Progress),
}

impl std::fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Doing(what) => f.write_str(what),
            Self::Refining(Progress { drapes, rim_m, misfit, on_last_cells }) => write!(
                f,
                "refining: drape {drapes}, rim {:.2} mm and sheet {misfit:.2} sigma from the scan; {}",
                rim_m / M_PER_MM,
                if *on_last_cells { "on the last cells" } else { "finer cells follow" }
            ),
        }
    }
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
    /// The answer on one scan, as the program gives it without further flags: the unit found from
    /// the scene, weft and warp not known, refined.
    ///
    /// ```
    /// use scan2params::Job;
    /// use scan2params::job::verdict::Level;
    ///
    /// let job = Job::new("fixtures/scans/mean_structured-light.ply", 0.214);
    /// // The network's answer alone takes two seconds.
    /// let outcome = Job { refine: false, ..job }.run()?;
    /// if outcome.verdict.level != Level::DoNotUse {
    ///     println!("{:.2e} N m along the weft", outcome.estimate.fabric.bending_weft_nm);
    /// }
    /// # assert_eq!(outcome.verdict.level, Level::Reliable);
    /// # assert!(outcome.released.is_none() && outcome.refinement.is_none());
    /// # Ok::<(), scan2params::job::JobError>(())
    /// ```
    #[must_use]
    pub fn new(input: impl Into<PathBuf>, density_kg_m2: f64) -> Self {
        Self {
            input: input.into(),
            density_kg_m2,
            read: ReadOptions::default(),
            scan: ScanOptions::default(),
            refine: true,
            release: false,
            with: Vec::new(),
            experiment: Experiment::default(),
        }
    }

    /// Refuses what has no estimate for any scan: a density that no textile has, another
    /// experiment.
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

    /// [`Self::run`]; `tell` hears what is being done as it begins.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_telling(self, tell: impl Fn(Told<'_>)) -> Result<Outcome, JobError> {
        self.check()?;
        let estimator = Estimator::shipped()?;
        self.quick(&estimator, &tell)?.refined(&estimator, &tell)
    }

    /// Runs the job with a model that is loaded already.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_with(self, estimator: &Estimator) -> Result<Outcome, JobError> {
        self.quick(estimator, |_| ())?.refined(estimator, |_| ())
    }

    /// Runs the job on a rim that is there already, and refines, if wanted, on the rims of `with`
    /// together with it, each with its name. [`Self::input`] is the first one's name;
    /// [`Self::read`] is not used.
    ///
    /// # Errors
    /// As [`Self::run`], but for the reading.
    pub fn run_on(
        mut self,
        rim: Rim,
        with: Vec<(PathBuf, Rim)>,
        estimator: &Estimator,
        tell: impl Fn(Told<'_>),
    ) -> Result<Outcome, JobError> {
        self.check()?;
        let (names, rims): (_, Vec<Rim>) = with.into_iter().unzip();
        self.with = names;
        let mut rims = rims.into_iter();
        let next =
            |_: &Path| Ok(rims.next().unwrap_or_else(|| unreachable!("a rim for each name")));
        self.of_rim(rim, estimator, Stages::start(), &tell)?.refined_with(next, estimator, &tell)
    }

    /// The other scans of the fabric, each taken in by `take`. Weft and warp must be known in all
    /// of them: two drops that are read turned against each other are of two fabrics. One that
    /// cannot be trusted is refused with its path, since it would pull the fabric to itself unseen.
    fn companions(
        &self,
        rim: &Rim,
        mut take: impl FnMut(&Path) -> Result<Rim, JobError>,
        estimator: &Estimator,
        tell: &impl Fn(Told<'_>),
    ) -> Result<Vec<Companion>, JobError> {
        let fault = |path: &Path, source| JobError::Companion { path: path.to_owned(), source };
        if !self.with.is_empty() && rim.orientation() != Orientation::Given {
            return Err(fault(&self.input, CompanionFault::UnknownWarp));
        }
        let companion = |path: &PathBuf| {
            tell(Told::Doing(&format!("looking for the rim of {}", path.display())));
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

    /// The network's answer alone: what is known before any drape. [`Outcome::refined`] continues
    /// from it.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn quick(
        self,
        estimator: &Estimator,
        tell: impl Fn(Told<'_>),
    ) -> Result<Outcome, JobError> {
        self.check()?;
        tell(Told::Doing("looking for the rim"));
        let begun = Begun::now();
        let rim = rim::of_input(&self.input, &self.read, &self.scan)?;
        let mut stages = Stages::start();
        stages.add("rim", begun);
        self.of_rim(rim, estimator, stages, tell)
    }

    /// What follows once the rim is there.
    fn of_rim(
        self,
        rim: Rim,
        estimator: &Estimator,
        mut stages: Stages,
        tell: impl Fn(Told<'_>),
    ) -> Result<Outcome, JobError> {
        tell(Told::Doing("estimating the stiffnesses"));
        let begun = Begun::now();
        let known = rim.orientation() == Orientation::Given;
        let estimate = estimator.estimate(rim.boundary(), self.density_kg_m2, known)?;
        stages.add("network", begun);
        let model = [estimator.model().id.clone(), estimator.model().onnx_sha256.clone()];
        let likeness = estimator.prior().map(|prior| estimate.likeness(prior));
        let (scan, at) = (&self.scan, (&estimate, likeness.as_ref()));
        let verdict = verdict::of_job(&rim, scan, at, None, None);
        let (refinement, released) = (None, None);
        let stages = stages.noted().to_vec();
        Ok(Outcome {
            job: self,
            rim,
            estimate,
            likeness,
            refinement,
            released,
            verdict,
            model,
            stages,
        })
    }
}

impl Outcome {
    /// The answer that was asked for, from the network's: refined, and with the released drape.
    ///
    /// # Errors
    /// Where another scan of [`Job::with`] cannot be used.
    pub fn refined(self, estimator: &Estimator, tell: impl Fn(Told<'_>)) -> Result<Self, JobError> {
        // The format and the passes are those of the first alone.
        let read = ReadOptions { format: None, passes: Vec::new(), ..self.job.read.clone() };
        let scan = self.job.scan.clone();
        let take = move |path: &Path| Ok(rim::of_input(path, &read, &scan)?);
        self.refined_with(take, estimator, tell)
    }

    fn refined_with(
        self,
        take: impl FnMut(&Path) -> Result<Rim, JobError>,
        estimator: &Estimator,
        tell: impl Fn(Told<'_>),
    ) -> Result<Self, JobError> {
        let Self { job, rim, estimate: network, mut stages, .. } = self;
        let refinement = if job.refine {
            let companions = job.companions(&rim, take, estimator, &tell)?;
            tell(Told::Doing("refining: laying the scanned sheet on the simulator's cells"));
            let known = (job.density_kg_m2, &job.experiment);
            let believed = (&network, estimator.prior());
            let heard = |progress| tell(Told::Refining(progress));
            Some(Refinement::of(&rim, companions, known, believed, job.release, &heard))
        } else {
            None
        };
        let taken = refinement.as_ref().and_then(Refinement::taken);
        let estimate = taken.map_or_else(|| network.clone(), |taken| taken.estimate(&network));
        if let Some(Ok(refined)) = refinement.as_ref().map(|found| &found.result) {
            stages.extend_from_slice(&refined.stages);
        }
        let released = match taken {
            Some(taken) => taken.first().released.clone(),
            None => job.release.then(|| {
                tell(Told::Doing("simulating the released drape"));
                let options = SimOptions { experiment: job.experiment, ..SimOptions::default() };
                let begun = Begun::now();
                let found = released_drape(rim.boundary(), rim.sheet(), &estimate.fabric, &options);
                let mut own = Stages::start();
                own.add("released", begun);
                stages.extend_from_slice(own.noted());
                found
            }),
        };
        let likeness = estimator.prior().map(|prior| estimate.likeness(prior));
        let at = (&estimate, likeness.as_ref());
        let verdict = verdict::of_job(&rim, &job.scan, at, refinement.as_ref(), released.as_ref());
        let model = self.model;
        Ok(Self { job, rim, estimate, likeness, refinement, released, verdict, model, stages })
    }

    /// The network's answer where nobody waited for the refined one; its verdict says so.
    #[must_use]
    pub fn interrupted(self) -> Self {
        let refinement = Some(Refinement::interrupted(&self.estimate));
        let at = (&self.estimate, self.likeness.as_ref());
        let verdict = verdict::of_job(&self.rim, &self.job.scan, at, refinement.as_ref(), None);
        Self { refinement, verdict, ..self }
    }

    /// The refined fabric, if it is the answer.
    #[must_use]
    pub fn taken(&self) -> Option<Taken<'_>> {
        self.refinement.as_ref().and_then(Refinement::taken)
    }
}

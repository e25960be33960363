//! Scans of what is not quite the experiment, drawn blind, through the whole main job, for
//! `scan2params-lab altered`: does anything pass as reliable that is wrong, and is what is refused
//! called by its cause?
//!
//! In: sensors, a folder of drapes with their fabrics ([`super::scenes::drapes`]), a seed. Out: a
//! [`Record`] of each scan: what was altered ([`Alteration`]), the verdict with its first ground,
//! or the refusal, and how far the answer is from the fabric. A bench that is off is simulated
//! anew; its drapes are kept in the folder `altered` of the drapes' folder.
//!
//! Where it fails: a tilted plate is seen without a floor, which a scene cannot tilt against it.

mod alteration;
mod cloth;
pub mod table;

use std::path::{Path, PathBuf};

use rand::RngExt as _;
use rayon::prelude::*;

pub use alteration::{Alteration, Amount};

use super::estimate::Answer;
use super::scenes::broken::{Cause, name_of};
use super::scenes::drapes::{DrapesError, KeptDrape};
use super::scenes::{Drawn, Made};
use scan2params::base::clock::thread_cpu_s;
use scan2params::base::frame::PLATE_RADIUS_M;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Vector3, seed};
use scan2params::dataset::drape_file::{DrapeFileError, read_drape};
use scan2params::estimate::Estimator;
use scan2params::fabric::Fabric;
use scan2params::geom::Mesh;
use scan2params::intake::Rim;
use scan2params::io::{ReadNotes, WriteError, write_obj};
use scan2params::job::verdict::{Level, Verdict};
use scan2params::job::{Job, JobError};
use scan2params::scan::{ScanOptions, WarpToward, boundary_from_scan};
use scan2params::sensor::{Profile, SceneError, StandKind, Surroundings};
use scan2params::sim::{Fall, SimOptions, drape};

/// Scans to draw.
#[derive(Clone, Debug)]
pub struct Series {
    /// The sensors, in turn.
    pub sensors: Vec<Profile>,
    /// The folder of drapes,
    pub folder: PathBuf,
    /// and the drapes, with their fabrics.
    pub drapes: Vec<KeptDrape>,
    /// What is altered, in turn.
    pub alterations: Vec<Alteration>,
    /// Seed of the run.
    pub seed: u64,
    /// Which scans.
    pub scans: std::ops::Range<u64>,
}

/// What was drawn and what came of it.
#[derive(Clone, Debug)]
pub struct Record {
    /// The scan's number.
    pub index: u64,
    /// What was altered,
    pub alteration: Alteration,
    /// and by how much.
    pub amount: Amount,
    /// Name of the sensor.
    pub sensor: &'static str,
    /// Names of stand and surroundings.
    pub scene: [&'static str; 2],
    /// The drape's file, and its shortest bending length \[mm\].
    pub drape: (String, f64),
    /// What came of it.
    pub outcome: Outcome,
    /// Processor time of the main job \[s\].
    pub cpu_s: f64,
}

/// What came of a scan.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The altered bench has no drape: it does not come to rest, or slides off.
    NoDrape,
    /// The scan was refused: the variant of the refusal, and what it says.
    Refused(String, String),
    /// It was answered.
    Answered {
        /// How far it is to be relied on.
        level: Level,
        /// Codes of the grounds that speak against it, worst first,
        grounds: Vec<&'static str>,
        /// and what the first says.
        text: String,
        /// How it compares with the fabric; `None` of what is no fabric's drape.
        off: Option<Off>,
        /// The fit, whether it was taken or not: what it leaves of the scan, in standard
        /// deviations, and how it compares.
        fit: Option<(f64, Off)>,
    },
}

/// How far an answer is from the fabric.
#[derive(Clone, Copy, Debug)]
pub struct Off {
    /// Bending over its truth, of the one of the three that is farthest off.
    pub bending: f64,
    /// Factor by which a bending lies beyond its interval, 1 within; the largest of the three.
    pub beyond_interval: f64,
    /// Largest factor between a stretch or shear stiffness and its truth.
    pub stretch: f64,
}

impl Off {
    /// A bending this far beyond its interval is wrong,
    const MOST_BEYOND: f64 = 1.1;
    /// and a stretch or shear that is off by this factor.
    const MOST_STRETCH: f64 = 2.0;

    fn of(answer: &Answer, fabric: &Fabric) -> Self {
        let truth = fabric.to_paper_units();
        let ratio = |i: usize| answer.value[i] / truth[i];
        let farther = |a: f64, b: f64| if b.ln().abs() > a.ln().abs() { b } else { a };
        let beyond = |i: usize| {
            let [low, high] = answer.interval90[i];
            (low / truth[i]).max(truth[i] / high)
        };
        Self {
            bending: (3..6).map(ratio).fold(1.0, farther),
            beyond_interval: (3..6).map(beyond).fold(1.0, f64::max),
            stretch: (0..3).map(|i| ratio(i).max(1.0 / ratio(i))).fold(1.0, f64::max),
        }
    }

    /// Whether the answer is wrong.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        self.beyond_interval > Self::MOST_BEYOND || self.stretch > Self::MOST_STRETCH
    }
}

/// Why a series cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum AlteredError {
    /// A drape makes no scene.
    #[error("scan {0}: {1}")]
    Scene(u64, SceneError),
    /// A drape's fabric is not known.
    #[error("{0}: no params.json next to it, so its fabric is not known")]
    NoFabric(String),
    /// The drapes cannot be read.
    #[error(transparent)]
    Drapes(#[from] DrapesError),
    /// A kept drape cannot be read,
    #[error(transparent)]
    Read(#[from] DrapeFileError),
    /// or written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Something that is no refusal of a scan.
    #[error("scan {0}: {1}")]
    Job(u64, JobError),
}

impl Series {
    /// Draws, scans and answers on all cores; `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first scan that cannot be made.
    pub fn run(
        &self,
        estimator: &Estimator,
        tell: impl Fn(&Record) + Sync,
    ) -> Result<Vec<Record>, AlteredError> {
        let scans: Vec<u64> = self.scans.clone().collect();
        let records = scans.into_par_iter().with_max_len(1).map(|index| {
            let record = self.one(index, estimator)?;
            tell(&record);
            Ok(record)
        });
        records.collect()
    }

    fn one(&self, index: u64, estimator: &Estimator) -> Result<Record, AlteredError> {
        let turns = vec![Cause::Valid; self.alterations.len()];
        let mut drawn = Drawn::of(index, self.seed, &self.sensors, &self.drapes, &turns);
        let alteration = self.alterations[index as usize % turns.len()];
        let mut rng = seed::rng(self.seed, "evaluate-altered", index);
        let amount = alteration.draw(&mut rng);
        if alteration == Alteration::Tilted {
            drawn.setting.stand = Some(StandKind::Post);
            drawn.setting.surroundings = Some(Surroundings::Bare);
        }
        let own = &self.drapes[drawn.drape];
        let fabric = own.fabric.ok_or_else(|| AlteredError::NoFabric(own.name.clone()))?;
        let length_mm = own.bending_length_m().unwrap_or(f64::NAN) / M_PER_MM;
        let (sensor, scene) = (drawn.profile.name, [drawn.stand(), drawn.surroundings()]);
        let record = |outcome, cpu_s| Record {
            index,
            alteration,
            amount,
            sensor,
            scene,
            drape: (own.name.clone(), length_mm),
            outcome,
            cpu_s,
        };
        let Some(mesh) = self.cloth(index, (alteration, &amount), (own, &fabric), &mut rng)? else {
            return Ok(record(Outcome::NoDrape, 0.0));
        };
        let plate_radius_m = match alteration {
            Alteration::OtherPlate => amount.value * M_PER_MM,
            _ => PLATE_RADIUS_M,
        };
        let mut made =
            Made::of_cloth(drawn, mesh, |scene| scene.stand.plate_radius_m = plate_radius_m)
                .map_err(|source| AlteredError::Scene(index, source))?;
        alteration.spoil(&amount, &mut made.scan);
        let begun = thread_cpu_s();
        let outcome = self.outcome(index, (&made, &fabric), alteration, estimator)?;
        let cpu_s = begun.zip(thread_cpu_s()).map_or(f64::NAN, |(from, to)| to - from);
        Ok(record(outcome, cpu_s))
    }

    /// The cloth as it is scanned; `None` where the bench has no drape.
    fn cloth(
        &self,
        index: u64,
        (alteration, amount): (Alteration, &Amount),
        (own, fabric): (&KeptDrape, &Fabric),
        rng: &mut seed::Rng,
    ) -> Result<Option<Mesh>, AlteredError> {
        if let Some(bench) = alteration.bench(amount) {
            let name = format!("{}-{}-{index}-{}", alteration.name(), self.seed, own.name);
            let path = self.folder.join("altered").join(name).with_extension("obj");
            let vertices = own.mesh.vertices.len().isqrt();
            let options = SimOptions { experiment: bench, vertices, ..SimOptions::default() };
            return simulated(&path, fabric, self.seed ^ index, &options);
        }
        let others: Vec<&KeptDrape> = self
            .drapes
            .iter()
            .filter(|other| other.mesh.vertices.len() == own.mesh.vertices.len())
            .filter(|other| other.name != own.name)
            .collect();
        let other = others.get(rng.random_range(0..others.len().max(1))).copied().unwrap_or(own);
        Ok(Some(alteration.deform(amount, &own.mesh, &other.mesh, rng)))
    }

    fn outcome(
        &self,
        index: u64,
        (made, fabric): (&Made, &Fabric),
        alteration: Alteration,
        estimator: &Estimator,
    ) -> Result<Outcome, AlteredError> {
        let warp = made.scan.truth.simulation_from_scanner.inverse() * Vector3::x();
        let warp_toward = Some(WarpToward::Direction(warp.into()));
        let options = ScanOptions { warp_toward, ..ScanOptions::default() };
        let found = match boundary_from_scan(&made.scan.cloud, &options) {
            Err(error) => return Ok(Outcome::Refused(name_of(&error), error.to_string())),
            Ok(found) => found,
        };
        let rim = Rim::Scanned { scanned: Box::new(found), notes: ReadNotes::default() };
        let job = Job { scan: options, ..Job::new("scan", fabric.density_kg_m2) };
        let found = job
            .run_on(rim, Vec::new(), estimator, |_| ())
            .map_err(|error| AlteredError::Job(index, error))?;
        let Verdict { level, grounds, .. } = found.verdict;
        let against = || grounds.iter().filter(|ground| ground.level > Level::Reliable);
        let answer = Answer::of(&found.estimate);
        let fitted =
            found.refinement.as_ref().and_then(|refinement| refinement.result.as_ref().ok());
        Ok(Outcome::Answered {
            level,
            grounds: against().map(|ground| ground.code.name()).collect(),
            text: against().next().map_or_else(String::new, |ground| ground.text.clone()),
            off: alteration.is_of_cloth().then(|| Off::of(&answer, fabric)),
            fit: fitted.map(|fitted| (fitted.misfit, Off::of(&Answer::of_fit(fitted), fabric))),
        })
    }
}

/// The drape of a bench, kept or made; `None` where it does not come to rest.
fn simulated(
    path: &Path,
    fabric: &Fabric,
    seed: u64,
    options: &SimOptions,
) -> Result<Option<Mesh>, AlteredError> {
    if path.is_file() {
        return Ok(Some(read_drape(path)?));
    }
    let made = drape(fabric, &Fall::Perturbed.drop(seed), options);
    if !made.stop.is_as_asked() || made.intersections > 0 {
        return Ok(None);
    }
    let folder = path.parent().unwrap_or(path);
    std::fs::create_dir_all(folder)
        .map_err(|source| DrapesError::Folder { path: folder.to_owned(), source })?;
    write_obj(path, &made.mesh())?;
    Ok(Some(made.mesh()))
}

impl Record {
    /// The columns of [`Self::row`].
    pub const COLUMNS: &str = "scan,altered,amount,unit,sensor,stand,surroundings,drape,bending_length_mm,outcome,names,\
         bending_over_truth,beyond_interval,stretch_factor,misfit,fit_bending_over_truth,fit_beyond_interval,\
         fit_stretch_factor,wrong,cpu_s,says";

    /// A line of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let (word, names, says) = match &self.outcome {
            Outcome::NoDrape => ("no_drape", String::new(), ""),
            Outcome::Refused(name, says) => ("refused", name.clone(), says.as_str()),
            Outcome::Answered { level, grounds, text, .. } => {
                (level.name(), grounds.join(" "), text.as_str())
            }
        };
        let three =
            |off: &Off| format!("{:.3},{:.3},{:.2}", off.bending, off.beyond_interval, off.stretch);
        let of_fit = |(misfit, off): &(f64, Off)| format!("{misfit:.2},{}", three(off));
        let (off, fit) = match &self.outcome {
            Outcome::Answered { off, fit, .. } => (off.as_ref(), fit.as_ref()),
            _ => (None, None),
        };
        let off = off.map_or_else(|| ",,".to_owned(), three);
        let fit = fit.map_or_else(|| ",,,".to_owned(), of_fit);
        let Amount { value, unit, .. } = self.amount;
        let [stand, surroundings] = self.scene;
        let (drape, length_mm) = &self.drape;
        let says: String = says.replace(['"', ','], ";").chars().take(160).collect();
        format!(
            "{},{},{value:.3},{unit},{},{stand},{surroundings},{drape},{length_mm:.1},{word},{names},{off},{fit},{},{:.1},{says}",
            self.index,
            self.alteration.name(),
            self.sensor,
            u8::from(self.is_reliable_though_wrong()),
            self.cpu_s
        )
    }

    /// Whether the answer is called reliable and is wrong, or is of no cloth.
    #[must_use]
    pub fn is_reliable_though_wrong(&self) -> bool {
        match &self.outcome {
            Outcome::Answered { level: Level::Reliable, off, .. } => {
                off.is_none_or(|off| off.is_wrong())
            }
            _ => false,
        }
    }

    /// Of a scan that was refused or is not to be used, whether the first cause named is the true
    /// one.
    #[must_use]
    pub fn names_its_cause(&self) -> Option<bool> {
        let name = match &self.outcome {
            Outcome::Refused(name, _) => name,
            Outcome::Answered { level: Level::DoNotUse, grounds, .. } => *grounds.first()?,
            _ => return None,
        };
        Some(self.alteration.right_names().contains(&name))
    }
}

#[cfg(test)]
mod tests {
    use super::table::Group;
    use super::*;
    use crate::evaluate::scenes::tests::{kept, quick};

    #[test]
    fn alterations_take_turns_and_what_is_no_cloth_is_refused() {
        let series = Series {
            sensors: vec![quick("handheld")],
            folder: PathBuf::new(),
            drapes: kept(),
            alterations: vec![Alteration::Cone, Alteration::Bell],
            seed: 3,
            scans: 0..3,
        };
        let records = series.run(&Estimator::shipped().unwrap(), |_| ()).unwrap();
        let kinds: Vec<Alteration> = records.iter().map(|record| record.alteration).collect();
        assert_eq!(kinds, [Alteration::Cone, Alteration::Bell, Alteration::Cone]);
        let groups = Group::all(&records);
        assert_eq!(groups.iter().map(|group| group.scans).collect::<Vec<_>>(), [2, 1, 3]);
        // No cone is a drape.
        assert_eq!((groups[0].verdicts[3], groups[0].wrong), (0, 0), "{}", groups[0].row());
        let columns = Record::COLUMNS.split(',').count();
        for record in &records {
            assert_eq!(record.row().split(',').count(), columns, "{}", record.row());
        }
    }

    #[test]
    fn an_answer_is_wrong_beyond_its_interval_or_by_a_factor_of_stretch() {
        let fabric = kept()[0].fabric.unwrap();
        let truth = fabric.to_paper_units();
        let off = |factors: [f64; 6]| {
            let value = std::array::from_fn(|i| truth[i] * factors[i]);
            let interval90 = value.map(|v: f64| [v / 1.1, v * 1.1]);
            Off::of(&Answer { value, interval90, novel: false }, &fabric)
        };
        assert!(!off([1.9, 1.0, 0.6, 1.2, 1.0, 0.85]).is_wrong());
        assert!(off([2.1, 1.0, 1.0, 1.0, 1.0, 1.0]).is_wrong());
        assert!(off([1.0, 1.0, 1.0, 1.0, 1.25, 1.0]).is_wrong());
        assert!((off([1.0, 1.0, 1.0, 1.2, 0.7, 1.0]).bending - 0.7).abs() < 1e-9);
    }
}
